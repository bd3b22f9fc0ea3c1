"""The potential of a probe, the currents and the heat that follow from it, and the temperature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Any, Literal

import numpy as np
from scipy.sparse import csr_matrix
from skfem import Basis, ElementLineP2, MeshLine

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal
from circuittex.electrical.fields.cooling import COLD_ENDS, Cooling
from circuittex.electrical.fields.flow import Flow, flows_of, joule_heat
from circuittex.electrical.fields.line import FibrilLine, fibril_line
from circuittex.electrical.fields.system import (
    WEAK,
    System,
    balance,
    build_system,
    outflow,
    peak,
    stiffest,
    surface_loss,
)

Mesh = Literal["feet", "mechanical"]
"""Nodes at the feet of the contacts, or those of the mechanics."""


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
    resistivity: Floats = field(default_factory=lambda: np.empty(0))
    """(M,) mean resistivity of each element of the fibrils over that at 27 C; empty where it follows no temperature."""
    contact_resistivity: Floats = field(default_factory=lambda: np.empty(0))
    """(C,) resistance of each contact over that at 27 C; empty where it follows no temperature."""
    rated: Floats = field(default_factory=lambda: np.empty(0))
    """(3,) a rise of the hottest point, and the current and the power of the source with which it has that [K, A, W];
    empty where the fields are linear, from which these follow."""


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
    if len(cooling.radiating):
        raise DesignError("cooling.radiating", cooling.radiating.max(), "radiation by T^4 is for `solve_steady`")
    line, axes = line_of(contacts, mesh, elements=len(cooling.loss) > 0)
    if not probes:
        return ()
    flows = flows_of(contacts, line, axes, terminals, probes)
    thermal = build_system(Basis(axes, ElementLineP2()), line, line.thermal, contacts.heat_conductance)
    loads = np.stack([joule_heat(thermal, flow, contact_heat) for flow in flows])
    every = np.arange(loads.shape[1])
    surface, through, held = losses(line, thermal, cooling)
    if len(cooling.loss) or not held:
        thermal = replace(thermal, loss=surface + through)
    inside = np.delete(every, line.ends) if held else every
    anchor = None if held else thermal_anchor(line, thermal)
    temperatures = balance(thermal, loads, np.zeros(loads.shape[1]), inside, anchor)
    return tuple(
        fields_of(line, thermal, surface, cooling, *one) for one in zip(probes, flows, loads, temperatures, strict=True)
    )


def solve_potentials(
    contacts: ContactState,
    terminals: Sequence[Terminal],
    probes: Sequence[Probe],
    *,
    mesh: Mesh = "feet",
) -> tuple[Potential, ...]:
    """The potentials and currents of `solve_probes`, for whoever has no use for the temperatures."""
    line, axes = line_of(contacts, mesh)
    return tuple(
        Potential(**_electric(line, probe, flow))
        for probe, flow in zip(probes, flows_of(contacts, line, axes, terminals, probes), strict=True)
    )


def losses(line: FibrilLine, thermal: System, cooling: Cooling) -> tuple[Any, Any, bool]:
    """(N, N) each: what leaves along the fibrils, and through their ends; and whether these are held at T = 0."""
    n = thermal.basis.N
    surface = through = csr_matrix((n, n))
    if len(cooling.loss):
        surface = surface_loss(thermal.basis, cooling.loss[line.fibril[line.segments[:, 0]]])
    if len(cooling.end):
        ends = line.ends.ravel()
        through = csr_matrix((np.tile(cooling.end, 2), (ends, ends)), shape=(n, n))
    return surface, through, not len(cooling.end)


def thermal_anchor(line: FibrilLine, thermal: System) -> Ints | None:
    """(N,) the dof at the start of each fibril whose ends are not held and from which next to nothing leaves, else the
    dof itself: what `balance` asks for."""
    owner, dofs = line.fibril[line.segments[:, 0]], thermal.basis.element_dofs
    fibril = np.empty(thermal.basis.N, dtype=np.int64)
    fibril[dofs] = owner
    leaves = np.bincount(fibril, np.asarray(thermal.loss.sum(axis=1)).ravel(), len(line.ends[0]))
    weak = leaves < WEAK * stiffest(line, line.thermal)
    if not weak.any():
        return None
    anchor: Ints = np.where(weak[fibril], line.ends[0][fibril], np.arange(len(fibril)))
    return anchor


def line_of(contacts: ContactState, mesh: Mesh, elements: bool = False) -> tuple[FibrilLine, MeshLine]:
    """The line mesh of all fibrils, and the same for scikit-fem."""
    if mesh not in ("feet", "mechanical"):
        raise DesignError("mesh", mesh, "allowed are 'feet' and 'mechanical'")
    line = fibril_line(contacts, refine=mesh == "feet", elements=elements)
    return line, MeshLine(line.xi[None, :], np.ascontiguousarray(line.segments.T), sort_t=False, validate=False)


def fields_of(
    line: FibrilLine,
    thermal: System,
    surface: Any,
    cooling: Cooling,
    probe: Probe,
    flow: Flow,
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


def _electric(line: FibrilLine, probe: Probe, flow: Flow) -> dict[str, Any]:
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
