"""The potential of a probe, the currents and the heat that follow from it, and the temperature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from skfem import Basis, ElementLineP1, ElementLineP2, MeshLine

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal
from circuittex.electrical.fields.cooling import COLD_ENDS, Cooling
from circuittex.electrical.fields.line import FibrilLine, fibril_line
from circuittex.electrical.fields.system import (
    System,
    balance,
    build_system,
    constant_source,
    outflow,
    peak,
    surface_loss,
)
from circuittex.geometry.mesh import FibrilMesh

Mesh = Literal["feet", "mechanical"]
"""Nodes at the feet of the contacts, or those of the mechanics."""

WEAK = 1e-10
"""Contacts of a fibril this much weaker than a segment keep six digits in the matrix, which is enough to refine."""


@frozen
class Potential:
    """Potential and terminal currents of one probe on one contact state."""

    probe: str
    """Name of the probe."""
    voltage: float
    """Source above sink, V."""
    terminals: tuple[str, ...]
    """(T,) the driven terminals: source, sink."""
    currents: Floats
    """(T,) current into the textile at each of them [42], A."""
    fibril: Ints
    """(K,) fibril of each node; fibril after fibril, xi ascending."""
    xi: Floats
    """(K,) axis coordinate of each node, mm."""
    potential: Floats
    """(K,) V [38]; nan on insulating fibrils and on those no driven terminal reaches."""


@frozen
class Fields(Potential):
    """Potential, temperature and currents of one probe on one contact state."""

    temperature: Floats
    """(K,) rise over the surroundings [37], K."""
    segments: Ints
    """(S, 2) node numbers of each element, in the direction of +xi."""
    segment_current: Floats
    """(S,) current along +xi, mean over the element, A; 0 where the potential is undefined."""
    heat: float
    """Joule heat released in the fibrils, W; equals voltage times source current if contact heat is counted."""
    heat_out: float
    """Heat that leaves through the fibril ends, W."""
    peak_temperature: float
    """Largest temperature rise, inside the elements included, K."""
    unreached: Ints
    """(U,) conducting fibrils that no driven terminal reaches."""
    heat_lost: float = 0.0
    """Heat that leaves along the fibrils, W."""


def solve_fields(
    contacts: ContactState,
    terminals: Sequence[Terminal],
    probe: Probe,
    *,
    contact_heat: bool = True,
    mesh: Mesh = "feet",
    cooling: Cooling = COLD_ENDS,
) -> Fields:
    """Solve [38] for the potential and then [37] for the temperature of one probe.

    See `solve_probes`, which solves several probes of one state for less. The straight probe of the paper's cell
    whose fibrils do not touch carries what its yarn does [57]:

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> design = plain_weave("paper-code")
    >>> mesh, nobody, nothing = build_mesh(design), np.zeros(0, dtype=int), np.zeros(0)
    >>> untouched = ContactState(mesh, nobody, nobody, *[nothing] * 8, np.ones(len(mesh.elements)))
    >>> solve_fields(untouched, design.terminals, design.probes[0]).currents.round(4).tolist()
    [0.8836, -0.8836]
    """
    return solve_probes(contacts, terminals, [probe], contact_heat=contact_heat, mesh=mesh, cooling=cooling)[0]


def solve_probes(
    contacts: ContactState,
    terminals: Sequence[Terminal],
    probes: Sequence[Probe],
    *,
    contact_heat: bool = True,
    mesh: Mesh = "feet",
    cooling: Cooling = COLD_ENDS,
) -> tuple[Fields, ...]:
    """Solve the potential [38] and the temperature [37] for each probe on a frozen contact state.

        sum ∫ sigma A V' dV' + sum sigma_c a w [V][dV] = 0
        sum ∫ k A T' dT' + sum ∫ g T dT + sum h_c a w [T][dT] = sum ∫ sigma A V'^2 dT + contact Joule heat

    V is the probe's at its two terminals, whose fibril ends are joined; all other ends are insulated one by
    one. T = 0 at all fibril ends, and g = 0, unless `cooling` has a loss along the fibrils or other ends. [37] has no
    Joule heat of the contacts; it is added here, half to each side, unless `contact_heat` is off. Linear elements for
    V, quadratic ones for T. With `mesh` "feet" every foot of a contact is a node and both fields are exact but for what
    g makes of T between nodes, for which those of the mechanics are nodes as well; with "mechanical" the elements are
    those of the mechanics and the solution converges to that at second order.

    Raises DesignError where a probe names a terminal, or a terminal a yarn end, that does not exist.
    """
    line, axes = _line(contacts, mesh, elements=len(cooling.loss) > 0)
    if not probes:
        return ()
    flows = _flows(contacts, line, axes, terminals, probes)
    thermal = build_system(Basis(axes, ElementLineP2()), line, line.thermal, contacts.heat_conductance)
    loads = np.stack([_joule_heat(thermal, flow, contact_heat) for flow in flows])
    every = np.arange(loads.shape[1])
    surface, through, held = _losses(line, thermal, cooling)
    if len(cooling.loss) or not held:
        thermal = replace(thermal, loss=surface + through)
    inside = np.delete(every, line.ends) if held else every
    temperatures = balance(thermal, loads, np.zeros(loads.shape[1]), inside)
    return tuple(
        _fields(line, thermal, surface, cooling, *one) for one in zip(probes, flows, loads, temperatures, strict=True)
    )


def solve_potentials(
    contacts: ContactState,
    terminals: Sequence[Terminal],
    probes: Sequence[Probe],
    *,
    mesh: Mesh = "feet",
) -> tuple[Potential, ...]:
    """The potentials and currents of `solve_probes`, for whoever has no use for the temperatures."""
    line, axes = _line(contacts, mesh)
    return tuple(
        Potential(**_electric(line, probe, flow))
        for probe, flow in zip(probes, _flows(contacts, line, axes, terminals, probes), strict=True)
    )


def _losses(line: FibrilLine, thermal: System, cooling: Cooling) -> tuple[Any, Any, bool]:
    """(N, N) each: what leaves along the fibrils, and through their ends; and whether these are held at T = 0."""
    n = thermal.basis.N
    surface = through = csr_matrix((n, n))
    if len(cooling.loss):
        surface = surface_loss(thermal.basis, cooling.loss[line.fibril[line.segments[:, 0]]])
    if len(cooling.end):
        ends = line.ends.ravel()
        through = csr_matrix((np.tile(cooling.end, 2), (ends, ends)), shape=(n, n))
    return surface, through, not len(cooling.end)


def _line(contacts: ContactState, mesh: Mesh, elements: bool = False) -> tuple[FibrilLine, MeshLine]:
    """The line mesh of all fibrils, and the same for scikit-fem."""
    if mesh not in ("feet", "mechanical"):
        raise DesignError("mesh", mesh, "allowed are 'feet' and 'mechanical'")
    line = fibril_line(contacts, refine=mesh == "feet", elements=elements)
    return line, MeshLine(line.xi[None, :], np.ascontiguousarray(line.segments.T), sort_t=False, validate=False)


def _fields(
    line: FibrilLine,
    thermal: System,
    surface: Any,
    cooling: Cooling,
    probe: Probe,
    flow: _Flow,
    load: Floats,
    temperature: Floats,
) -> Fields:
    """What is kept of one solution."""
    ends = line.ends.ravel()
    # At ends that are held nothing is balanced: what is left over leaves there.
    held = not len(cooling.end)
    through = (load - outflow(thermal, temperature))[ends] if held else np.tile(cooling.end, 2) * temperature[ends]
    return Fields(
        **_electric(line, probe, flow),
        temperature=temperature[: len(line.xi)],
        segments=line.segments,
        segment_current=flow.along,
        heat=float(load.sum()),
        heat_out=float(through.sum()),
        peak_temperature=peak(thermal.basis, temperature),
        unreached=flow.unreached,
        heat_lost=float((surface @ temperature).sum()),
    )


def _electric(line: FibrilLine, probe: Probe, flow: _Flow) -> dict[str, Any]:
    """The values of a `Potential` by name."""
    return {
        "probe": probe.name,
        "voltage": probe.voltage,
        "terminals": (probe.source, probe.sink),
        "currents": flow.terminal_currents,
        "fibril": line.fibril,
        "xi": line.xi,
        "potential": flow.potential,
    }


def _electric_conductance(contacts: ContactState) -> Floats:
    """(C,) conductance of each contact; none where one of its fibrils insulates."""
    sigma = contacts.mesh.electrical_conductivity
    conducts = (sigma[contacts.fibril_a] > 0.0) & (sigma[contacts.fibril_b] > 0.0)
    return np.where(conducts, contacts.conductance, 0.0)


@frozen
class _Flow:
    """Potential of one probe and the currents that follow from it."""

    potential: Floats
    """(K,) V, nan where undefined."""
    unreached: Ints
    """(U,) conducting fibrils without a potential."""
    along: Floats
    """(S,) current along +xi, A."""
    terminal_currents: Floats
    """(2,) into the textile at source and sink, A."""
    fibril_heat: Floats
    """(S,) Joule heat per length of axis sigma A V'^2, W/mm."""
    contact_heat: Floats
    """(C,) Joule heat of each contact, W."""


def _flows(
    contacts: ContactState, line: FibrilLine, axes: MeshLine, terminals: Sequence[Terminal], probes: Sequence[Probe]
) -> list[_Flow]:
    """Potential and currents of each probe."""
    electric = build_system(Basis(axes, ElementLineP1()), line, line.conduction, _electric_conductance(contacts))
    return [_flow(contacts, line, electric, terminals, probe) for probe in probes]


def _flow(
    contacts: ContactState, line: FibrilLine, system: System, terminals: Sequence[Terminal], probe: Probe
) -> _Flow:
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
    V = balance(system, np.zeros((1, len(live))), value, np.flatnonzero(live & np.isnan(value)), anchor)[0]
    through, along, into = _currents(line, system, V, source | sink)
    conduction = line.conduction
    return _Flow(
        potential=np.where(live, V, np.nan),
        unreached=np.flatnonzero((mesh.electrical_conductivity > 0.0) & ~reached),
        along=along,
        terminal_currents=np.array([into[source].sum(), into[sink].sum()]),
        fibril_heat=np.divide(along**2, conduction, out=np.zeros_like(along), where=conduction > 0.0),
        contact_heat=through * (system.jump @ V),
    )


def _anchor(contacts: ContactState, line: FibrilLine, held: NDArray[np.bool_]) -> Ints | None:
    """(K,) the first node of a fibril that hangs on contacts much weaker than its segments, else the node itself."""
    n = len(held)
    G = _electric_conductance(contacts)
    hung = np.bincount(contacts.fibril_a, G, n) + np.bincount(contacts.fibril_b, G, n)
    segment = np.zeros(n)
    length = np.diff(line.xi[line.segments], axis=1)[:, 0]
    np.maximum.at(segment, line.fibril[line.segments[:, 0]], line.conduction / length)
    afloat = ~held & (hung < WEAK * segment)
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
    touching = _electric_conductance(contacts) > 0.0
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


def _joule_heat(thermal: System, flow: _Flow, contact_heat: bool) -> Floats:
    """Right-hand side of [37]: heat of the fibrils and, half to each side, of the contacts."""
    load = constant_source(thermal.basis, flow.fibril_heat)
    if contact_heat:
        load = load + 0.5 * (thermal.foot[0] + thermal.foot[1]).T @ flow.contact_heat
    return load
