"""Capacitances between yarns and inductances of yarns to first order, from where their fibrils lie.

A yarn is a bundle: its conducting fibrils are at one potential and share its current alike. For the electric field
outside, its outline counts: an ellipse as wide and as high as the bundle, whose round equivalent has the mean of the
half-axes as its radius (exactly, for a cylinder alone: the map that takes the ellipse to a circle leaves the field
far away as it is). Neither skin effect nor what lies beyond the cell is in these numbers, nor the narrow gap of
surfaces that touch.
"""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import CircuitError
from circuittex.base.frozen import frozen
from circuittex.geometry.mesh import FibrilMesh

EPSILON0 = 8.8541878128e-15
"""Permittivity of the vacuum, F/mm (CODATA 2018)."""
MU0 = 1.25663706212e-9
"""Permeability of the vacuum, H/mm (CODATA 2018)."""
MOST_PIECES = 4096
"""Pieces of all yarns together: their dense matrix takes 130 MB."""


@frozen
class YarnLines:
    """Y yarns as bundles along their centre lines, at K places."""

    place: Floats
    """(Y, K, 3) middle of the conductors, mm."""
    radius: Floats
    """(Y,) of the round equivalent of the outline, mm."""
    mean_distance: Floats
    """(Y,) geometric mean distance of the conductors from themselves, mm: of a round wire exp(-1/4) R."""


def yarn_lines(mesh: FibrilMesh, r: Floats) -> YarnLines:
    """The yarns of fibrils with nodes r (N, 3), mm, all with as many nodes; those that conduct, or all if none do.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> mesh = build_mesh(plain_weave(yarns=2, rows=(1,)))
    >>> yarn_lines(mesh, mesh.position).radius.round(12).tolist()
    [0.15, 0.15, 0.15, 0.15]
    """
    lines = r.reshape(mesh.n_fibrils, -1, 3)
    conducts = mesh.electrical_conductivity > 0.0
    counts = conducts | (np.bincount(mesh.yarn, conducts)[mesh.yarn] == 0)
    of_yarn = [counts & (mesh.yarn == k) for k in range(len(mesh.yarn_names))]
    found = [_bundle(lines[own], mesh.radius[own]) for own in of_yarn]
    place, radius, distance = zip(*found, strict=True)
    return YarnLines(np.array(place), np.array(radius), np.array(distance))


def _bundle(lines: Floats, R: Floats) -> tuple[Floats, float, float]:
    middle = lines.mean(axis=0)
    along = np.gradient(middle, axis=0)
    side = np.stack([-along[:, 1], along[:, 0], np.zeros(len(along))], axis=1)
    side /= np.linalg.norm(side, axis=1)[:, None]
    up = np.cross(along, side)
    up /= np.linalg.norm(up, axis=1)[:, None]
    half = []
    for direction in (side, up):
        away = np.einsum("fkc,kc->fk", lines - middle, direction)
        half.append(((away + R[:, None]).max(axis=0) - (away - R[:, None]).min(axis=0)) / 2)
    apart = np.linalg.norm(lines[:, None] - lines[None], axis=-1).mean(axis=2)
    np.fill_diagonal(apart, np.exp(-0.25) * R)
    return middle, float(np.mean(half)), float(np.exp(np.log(apart).mean()))


def inductance(lines: YarnLines) -> Floats:
    """(Y,) partial inductance of each yarn, H: mu0 / (2 pi) (l arsinh(l / g) - sqrt(l^2 + g^2) + g).

    l is the length of its centre line and g the geometric mean distance of its conductors from themselves (Rosa, The
    self and mutual inductances of linear conductors, Bulletin of the Bureau of Standards 4, 1908). Where l is much
    longer than g that is mu0 l / (2 pi) (ln(2 l / g) - 1), of one round wire ln(2 l / R) - 3/4, which would be negative
    for yarns wider than they are long. The current comes back far away.

    >>> straight = YarnLines(np.array([[[0.0, 0, 0], [1e4, 0, 0]]]), np.array([1.0]), np.exp([-0.25]))
    >>> bool(np.isclose(inductance(straight)[0], 2e-10 * 1e4 * (np.log(2e4) - 0.75), rtol=1e-5))
    True
    """
    length = np.linalg.norm(np.diff(lines.place, axis=1), axis=-1).sum(axis=1)
    g = lines.mean_distance
    return np.asarray(MU0 / (2 * np.pi) * (length * np.arcsinh(length / g) - np.hypot(length, g) + g))


def end_capacitances(lines: YarnLines, permittivity: float) -> Floats:
    """(2 Y, 2 Y) capacitances between the ends of yarns, F: entry 2 i + a, 2 j + b for the minus (0) and the plus (1)
    end of yarns i and j; zero on the diagonal.

    The yarns are thin wires in a medium of relative `permittivity`, cut into pieces of even charge whose potentials are
    taken at their middles (Harrington, Field Computation by Moment Methods, 1968, chapter 4). What two pieces of
    different yarns have between them is shared out to the ends of either, to each the more the nearer it is, and so is
    what a piece has to all that is far away. The cell has no charge in all: the point far away is eliminated,
    C_ij + C_i0 C_j0 / sum C_k0. No capacitance is negative.

    Two parallel wires come out 0.4 % below the closed form pi epsilon / arccosh(d / (2 a)) for d = 10 a, 2.6 % for 5 a,
    12 % for 3 a, where they are as far apart as they are thick; what touches has more by its narrow gap.

    Raises `CircuitError` where yarns have so little room that their wires are no conductors in a field.
    """
    places = _cut(lines)
    pieces = places.shape[1] - 1
    yarn = np.repeat(np.arange(len(places)), pieces)
    start, end = places[:, :-1].reshape(-1, 3), places[:, 1:].reshape(-1, 3)
    potential = _potentials(start, end, _apart(places, lines.radius)[yarn][:, yarn])
    try:
        inverse = np.linalg.inv(np.linalg.cholesky(potential))
    except np.linalg.LinAlgError:
        raise CircuitError("capacitances: the yarns lie inside one another") from None
    charge = 4 * np.pi * permittivity * EPSILON0 * (inverse.T @ inverse)
    t = (np.tile(np.arange(pieces), len(places)) + 0.5) / pieces
    shares = np.zeros((len(yarn), 2 * len(places)))
    rows = np.arange(len(yarn))
    shares[rows, 2 * yarn], shares[rows, 2 * yarn + 1] = 1.0 - t, t
    far = shares.T @ np.maximum(charge.sum(axis=1), 0.0)
    mutual = np.where(yarn[:, None] == yarn, 0.0, np.maximum(-charge, 0.0))
    found = shares.T @ mutual @ shares + np.outer(far, far) / far.sum()
    np.fill_diagonal(found, 0.0)
    return np.asarray(found)


def _cut(lines: YarnLines) -> Floats:
    """(Y, K', 3) ends of equal pieces of each line, none shorter than a diameter: the charge of shorter ones sways."""
    steps = np.linalg.norm(np.diff(lines.place, axis=1), axis=-1)
    reached = np.concatenate([np.zeros((len(steps), 1)), np.cumsum(steps, axis=1)], axis=1)
    fewest = int((reached[:, -1] / (2 * lines.radius)).min())
    pieces = max(2, min(fewest, MOST_PIECES // len(steps)))
    at = np.linspace(0.0, 1.0, pieces + 1)
    return np.array(
        [
            [np.interp(at * way[-1], way, column) for column in place.T]
            for way, place in zip(reached, lines.place, strict=True)
        ]
    ).swapaxes(1, 2)


def _apart(places: Floats, radius: Floats) -> Floats:
    """(Y, Y) what is added to the square of distances so that no two outlines lie nearer than they touch, mm2."""
    n = len(places)
    nearest = np.array([[np.linalg.norm(a[:, None] - b[None], axis=-1).min() for b in places] for a in places])
    added = np.maximum((radius[:, None] + radius) ** 2 - nearest**2, 0.0)
    added[np.arange(n), np.arange(n)] = radius**2
    return np.asarray(added)


def _potentials(start: Floats, end: Floats, added: Floats) -> Floats:
    """(n, n) 4 pi epsilon times the potential at the middle of each piece for a unit charge on every other, 1/mm."""
    middle, way = (start + end) / 2, end - start
    length = np.linalg.norm(way, axis=1)
    offset = middle[:, None] - start[None]
    along = np.einsum("mnc,nc->mn", offset, way / length[:, None])
    square = np.maximum(np.einsum("mnc,mnc->mn", offset, offset) - along**2, 0.0) + added
    across = np.sqrt(square)
    found = (np.arcsinh(along / across) - np.arcsinh((along - length) / across)) / length
    return np.asarray((found + found.T) / 2)
