"""The potential of a probe on a line mesh, and the currents and the heat that follow from it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from skfem import Basis, ElementLineP1, MeshLine

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal
from circuittex.electrical.fields.line import FibrilLine
from circuittex.electrical.fields.system import WEAK, System, balance, build_system, constant_source, stiffest
from circuittex.geometry.mesh import FibrilMesh


def electric_conductance(contacts: ContactState) -> Floats:
    """(C,) conductance of each contact; none where one of its fibrils insulates."""
    sigma = contacts.mesh.electrical_conductivity
    conducts = (sigma[contacts.fibril_a] > 0.0) & (sigma[contacts.fibril_b] > 0.0)
    return np.where(conducts, contacts.conductance, 0.0)


@frozen
class Flow:
    """Potential of one probe and the currents that follow from it."""

    potential: Floats
    """(K,) V, nan where undefined."""
    free: Ints
    """Nodes whose potential was sought: all but those without one and those that the terminals hold."""
    unreached: Ints
    """(U,) conducting fibrils without a potential."""
    along: Floats
    """(S,) current along +xi, A."""
    terminal_currents: Floats
    """(2,) into the textile at source and sink, A."""
    through: Floats
    """(C,) current through each contact, from fibril a to fibril b, A."""
    fibril_heat: Floats
    """(S,) Joule heat per length of axis sigma A V'^2, W/mm."""
    contact_heat: Floats
    """(C,) Joule heat of each contact, W."""


def flows_of(
    contacts: ContactState, line: FibrilLine, axes: MeshLine, terminals: Sequence[Terminal], probes: Sequence[Probe]
) -> list[Flow]:
    """Potential and currents of each probe."""
    electric = build_system(Basis(axes, ElementLineP1()), line, line.conduction, electric_conductance(contacts))
    return [flow_of(contacts, line, electric, terminals, probe) for probe in probes]


def flow_of(
    contacts: ContactState, line: FibrilLine, system: System, terminals: Sequence[Terminal], probe: Probe
) -> Flow:
    """Solve [38] for one probe on the fibrils that its terminals reach."""
    mesh = contacts.mesh
    if not probe.voltage:
        allowed = "its voltage follows in each recorded state: solve Record.driven(design).probes, or probe.at(volts)"
        raise DesignError(f"probes.{probe.name}.{probe.stated}", probe.drive, allowed)
    source, sink = (_held(mesh, terminals, name) for name in (probe.source, probe.sink))
    if np.any(source & sink):
        fibril = int(np.argwhere(source & sink)[0, 1])
        raise DesignError(f"probe {probe.name}", (probe.source, probe.sink), f"both hold an end of fibril {fibril}")
    reached = _reached(contacts, np.flatnonzero(np.any(source | sink, axis=0)))
    live = reached[line.fibril]
    value = np.full(len(live), np.nan)
    value[line.ends[source]], value[line.ends[sink]] = probe.voltage, 0.0
    anchor = _anchor(contacts, line, np.any(source | sink, axis=0))
    free = np.flatnonzero(live & np.isnan(value))
    V = balance(system, np.zeros((1, len(live))), value, free, anchor)[0]
    through, along, into = _currents(line, system, V, source | sink)
    conduction = line.conduction
    return Flow(
        potential=np.where(live, V, np.nan),
        free=free,
        unreached=np.flatnonzero((mesh.electrical_conductivity > 0.0) & ~reached),
        along=along,
        terminal_currents=np.array([into[source].sum(), into[sink].sum()]),
        through=through,
        fibril_heat=np.divide(along**2, conduction, out=np.zeros_like(along), where=conduction > 0.0),
        contact_heat=through * (system.jump @ V),
    )


def _anchor(contacts: ContactState, line: FibrilLine, held: NDArray[np.bool_]) -> Ints | None:
    """(K,) the first node of a fibril that hangs on contacts much weaker than its segments, else the node itself."""
    n = len(held)
    G = electric_conductance(contacts)
    hung = np.bincount(contacts.fibril_a, G, n) + np.bincount(contacts.fibril_b, G, n)
    afloat = ~held & (hung < WEAK * stiffest(line, line.conduction))
    if not afloat.any():
        return None
    anchor: Ints = np.where(afloat[line.fibril], line.ends[0][line.fibril], np.arange(len(line.fibril)))
    return anchor


def _held(mesh: FibrilMesh, terminals: Sequence[Terminal], name: str) -> NDArray[np.bool_]:
    """(2, F) the conducting fibril ends, at xi = 0 and xi = L, that the named terminal joins."""
    found = [t for t in terminals if t.name == name]
    if len(found) != 1:
        raise DesignError("terminal", name, f"known are {', '.join(sorted(t.name for t in terminals)) or 'none'}")
    held = np.zeros((2, mesh.n_fibrils), dtype=np.bool_)
    for yarn, side in found[0].ends:
        if yarn not in mesh.yarn_names or side not in (-1, 1):
            raise DesignError(f"terminal {name}", (yarn, side), f"must be one of {mesh.yarn_names} and -1 or +1")
        held[(side + 1) // 2] |= mesh.yarn == mesh.yarn_names.index(yarn)
    return held & (mesh.electrical_conductivity > 0.0)


def _reached(contacts: ContactState, driven: Ints) -> NDArray[np.bool_]:
    """(F,) conducting fibrils that hang together with a driven one."""
    n = contacts.mesh.n_fibrils
    touching = electric_conductance(contacts) > 0.0
    a, b = contacts.fibril_a[touching], contacts.fibril_b[touching]
    _, cluster = connected_components(csr_matrix((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)
    reached: NDArray[np.bool_] = np.isin(cluster, cluster[driven])
    return reached


def _currents(line: FibrilLine, system: System, V: Floats, held: NDArray[np.bool_]) -> tuple[Floats, Floats, Floats]:
    """Currents through the contacts (C,), along the elements (S,), and into both fibril ends (2, F).

    The difference of V over a short element loses the digits that its large conductance multiplies. So the
    current at xi = 0 is what the contacts drain in all where xi = L is not `held` (2, F), nothing where it is not held
    itself, and else follows from the whole fibril, V0 - VL = sum R_s i_s; all others are that less what the contacts
    drain on the way (Kirchhoff): the same numbers without that loss.
    """
    through = system.conductance * (system.jump @ V)
    leaving = system.jump.T @ through
    (first, last), left = line.ends, line.segments[:, 0]
    owner = line.fibril[left]
    length = np.diff(line.xi[line.segments], axis=1)[:, 0]
    conducting = line.conduction > 0.0
    R = np.divide(length, line.conduction, out=np.zeros_like(length), where=conducting)
    total = np.cumsum(leaving)
    before = total[first] - leaving[first]
    drained = total[left] - before[owner]
    R_fibril, lost = (np.bincount(owner, w, len(first)) for w in (R, R * drained))
    through_all = np.divide(V[first] - V[last] + lost, R_fibril, out=np.zeros_like(lost), where=R_fibril > 0.0)
    entering = np.where(held.all(axis=0), through_all, np.where(held[0], total[last] - before, 0.0))
    along = np.where(conducting, entering[owner] - drained, 0.0)
    return through, along, np.where(held, np.stack([entering, total[last] - before - entering]), 0.0)


def joule_heat(thermal: System, flow: Flow, contact_heat: bool) -> Floats:
    """Right-hand side of [37]: heat of the fibrils and, half to each side, of the contacts."""
    load = constant_source(thermal.basis, flow.fibril_heat)
    if contact_heat:
        load = load + 0.5 * (thermal.foot[0] + thermal.foot[1]).T @ flow.contact_heat
    return load
