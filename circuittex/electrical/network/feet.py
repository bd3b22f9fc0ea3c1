"""Where the nodes of the detailed circuit lie: contact feet and fibril ends, and what lies between them."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import CircuitError
from circuittex.contact.state import ContactState
from circuittex.electrical.network.names import unique_names
from circuittex.geometry.mesh import FibrilMesh

_OUTSIDE = 1e-12
"""How far outside a fibril a closest point may lie by rounding, relative to the fibril's length."""

_APART = 1e-9
"""Feet closer than this fraction of the fibril's length share a node. Both sides of a contact find the same place up
to rounding, and a segment of that length would have a resistance made of rounding errors, which drown the solution."""


def live_contacts(contacts: ContactState) -> Ints:
    """Return the contacts that can carry current: conductance above zero, both fibrils conducting."""
    sigma = contacts.mesh.electrical_conductivity
    outside = _OUTSIDE * contacts.mesh.length  # a coordinate may miss the fibril's end by rounding, a conductance not
    values = {
        "conductance": (contacts.conductance, np.zeros(contacts.n_contacts)),
        "xi_a": (contacts.xi_a, -outside[contacts.fibril_a]),
        "xi_b": (contacts.xi_b, -outside[contacts.fibril_b]),
    }
    for name, (array, least) in values.items():
        usable = np.isfinite(array) & (array >= least)
        if not usable.all():
            bad = int(np.argmin(usable))
            raise CircuitError(f"contact {bad}: {name} is {float(array[bad])!r}; it must be finite and not negative")
    conducting = (sigma[contacts.fibril_a] > 0) & (sigma[contacts.fibril_b] > 0)
    return np.flatnonzero(conducting & (contacts.conductance > np.finfo(float).tiny))  # 1 / G stays finite


def sites(contacts: ContactState, live: Ints) -> tuple[Ints, Floats, Ints, Ints]:
    """Return the distinct places where a node is needed, fibril after fibril, xi ascending.

    Feet that only rounding keeps apart are one place, at the lowest of them or at the fibril end among them.
    Their fibrils (S,) and coordinates (S,), the sites of both feet of each live contact (L, 2), and those of the two
    ends of each fibril (F, 2), -1 for an insulating one, which has no sites.
    """
    mesh = contacts.mesh
    conducting = np.flatnonzero(mesh.electrical_conductivity > 0)
    ends = np.stack([np.zeros(len(conducting)), mesh.length[conducting]])
    fibril = np.concatenate([contacts.fibril_a[live], contacts.fibril_b[live], conducting, conducting])
    xi = np.concatenate([contacts.xi_a[live], contacts.xi_b[live], ends.ravel()])
    limit = mesh.length[fibril]
    if np.any(xi > limit * (1 + _OUTSIDE)):
        far = int(np.argmax(xi - limit))
        raise CircuitError(
            f"a contact foot lies at xi = {float(xi[far])!r} on a fibril that ends at {float(limit[far])!r} mm"
        )
    xi = np.clip(xi, 0.0, limit)
    permutation = np.lexsort((xi, fibril))
    new = np.ones(len(permutation), dtype=bool)
    new[1:] = (np.diff(fibril[permutation]) != 0) | (np.diff(xi[permutation]) > _APART * limit[permutation[1:]])
    site = np.empty(len(permutation), dtype=np.int64)
    site[permutation] = np.cumsum(new) - 1
    first = permutation[new]
    place = xi[first]
    n = len(live)
    end_site = np.full((mesh.n_fibrils, 2), -1, dtype=np.int64)
    end_site[conducting] = site[2 * n :].reshape(2, -1).T
    place[end_site[conducting]] = ends.T
    return fibril[first].astype(np.int64), place, site[: 2 * n].reshape(2, -1).T, end_site


def axial_resistance(contacts: ContactState, fibril: Ints, xi: Floats) -> Floats:
    """Return the resistance ∫ dxi / (sigma A f) from each site to the next, ohm; meaningless at the last of a fibril.

    The sites are cut again at the element boundaries, where f jumps, and the pieces summed. A difference of
    cumulative integrals would be shorter but loses the digits of a short segment far from the start.
    """
    mesh = contacts.mesh
    if not (np.isfinite(contacts.axial_factor).all() and contacts.axial_factor.min(initial=1.0) > 0.0):
        bad = int(np.argmin(np.where(np.isfinite(contacts.axial_factor), contacts.axial_factor, -1.0)))
        raise CircuitError(
            f"axial_factor of element {bad} is {float(contacts.axial_factor[bad])!r}; it must be positive"
        )
    start_fibril, start_xi = mesh.element_fibril, mesh.xi[mesh.elements[:, 0]]
    kept = np.flatnonzero(mesh.electrical_conductivity[start_fibril] > 0)
    # Element starts come before the sites at the same place, so that a site reads the element that begins there.
    both_fibril = np.concatenate([start_fibril[kept], fibril])
    both_xi = np.concatenate([start_xi[kept], xi])
    is_site = np.arange(len(both_xi)) >= len(kept)
    permutation = np.lexsort((is_site, both_xi, both_fibril))
    is_site = is_site[permutation]
    element = kept[np.cumsum(~is_site) - 1]
    sigma_area = (mesh.electrical_conductivity * mesh.area)[start_fibril[element]]
    length = np.diff(both_xi[permutation], append=np.nan)
    piece = length / (sigma_area * contacts.axial_factor[element])
    return np.add.reduceat(piece, np.flatnonzero(is_site))


def place_names(mesh: FibrilMesh, fibril: Ints, xi: Floats) -> list[str]:
    """Return 'warp2_f03_1250um' for each place: yarn, fibril counted from 1 in it, micrometres from the minus end."""
    prefix = fibril_names(mesh)
    return [f"{prefix[f]}_{um}um" for f, um in zip(fibril.tolist(), micrometres(xi), strict=True)]


def fibril_names(mesh: FibrilMesh) -> tuple[str, ...]:
    """Return 'warp2_f03' for each fibril."""
    yarns = unique_names(mesh.yarn_names)
    number = np.ones(mesh.n_fibrils, dtype=np.int64)
    for yarn in range(len(yarns)):
        members = np.flatnonzero(mesh.yarn == yarn)
        number[members] = np.arange(1, len(members) + 1)
    return tuple(f"{yarns[y]}_f{n:02d}" for y, n in zip(mesh.yarn.tolist(), number.tolist(), strict=True))


def micrometres(xi: Floats) -> list[int]:
    """Return whole micrometres, rounded down but for a nanometre, so that 0.57 mm is 570 and not 569."""
    whole: list[int] = np.floor(xi * 1e3 + 1e-3).astype(np.int64).tolist()
    return whole
