"""Potential and temperature of all fibrils on a contact state, by finite elements (scikit-fem)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementLineP0, ElementLineP1, ElementLineP2, LinearForm, MeshLine
from skfem.helpers import dot, grad

from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal
from circuittex.errors import DesignError
from circuittex.frozen import frozen
from circuittex.geometry.mesh import FibrilMesh, Floats, Ints

ROUNDING = 1e-9
"""Feet closer than this fraction of the fibril's length share a node: shorter elements only add rounding errors."""

REFINEMENTS = 2
"""Steps of iterative refinement, which win back what short elements lose in the assembled matrix."""


@frozen
class Fields:
    """Potential, temperature and currents of one probe on one contact state."""

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


@frozen
class _Line:
    """The line mesh of all fibrils, each on its own [0, L], and where the contacts sit on it."""

    fibril: Ints
    """(K,) fibril of each node, K nodes, fibril after fibril in axis order."""
    xi: Floats
    """(K,) axis coordinate, mm."""
    segments: Ints
    """(S, 2) node numbers of each element."""
    conduction: Floats
    """(S,) sigma A times axial factor, S mm."""
    thermal: Floats
    """(S,) k A, W mm/K."""
    ends: Ints
    """(2, F) nodes at xi = 0 and xi = L."""
    foot_segment: Ints
    """(2, C) element that carries the foot on fibril a and on fibril b."""
    foot_local: Floats
    """(2, C) coordinate of the foot in its element, 0 to 1."""


@frozen
class _System:
    """One discrete field: stiffness with the contacts, and the values at the feet, as sparse matrices."""

    basis: Any
    coefficient: Any
    """Conduction of the fibrils at the quadrature points."""
    conductance: Floats
    """(C,) of the contacts."""
    stiffness: Any
    """(N, N), contacts included."""
    foot: Any
    """Two of (C, N): the field at the feet on fibrils a and b."""
    jump: Any
    """(C, N): difference of the two."""


def solve_fields(
    contacts: ContactState,
    terminals: Sequence[Terminal],
    probe: Probe,
    *,
    contact_heat: bool = True,
    mesh: Literal["feet", "mechanical"] = "feet",
) -> Fields:
    """Solve [38] for the potential and then [37] for the temperature of one probe.

    See `solve_probes`, which solves several probes of one state for less.
    """
    return solve_probes(contacts, terminals, [probe], contact_heat=contact_heat, mesh=mesh)[0]


def solve_probes(
    contacts: ContactState,
    terminals: Sequence[Terminal],
    probes: Sequence[Probe],
    *,
    contact_heat: bool = True,
    mesh: Literal["feet", "mechanical"] = "feet",
) -> tuple[Fields, ...]:
    """Solve the potential [38] and the temperature [37] for each probe on a frozen contact state.

        sum ∫ sigma A V' dV' + sum sigma_c a w [V][dV] = 0
        sum ∫ k A T' dT' + sum h_c a w [T][dT] = sum ∫ sigma A V'^2 dT + contact Joule heat

    V is the probe's at its two terminals, whose fibril ends are joined; all other ends are insulated one by
    one. T = 0 at all fibril ends. [37] has no Joule heat of the contacts; it is added here, half to each
    side, unless `contact_heat` is off. Linear elements for V, quadratic ones for T. With `mesh` "feet" every
    foot of a contact is a node and both fields are exact; with "mechanical" the elements are those of the
    mechanics and the solution converges to that at second order.

    Raises DesignError where a probe names a terminal, or a terminal a yarn end, that does not exist.
    """
    if mesh not in ("feet", "mechanical"):
        raise DesignError("mesh", mesh, "allowed are 'feet' and 'mechanical'")
    line = _line(contacts, refine=mesh == "feet")
    axes = MeshLine(line.xi[None, :], np.ascontiguousarray(line.segments.T), sort_t=False, validate=False)
    electric = _system(Basis(axes, ElementLineP1()), line, line.conduction, _electric_conductance(contacts))
    thermal = _system(Basis(axes, ElementLineP2()), line, line.thermal, contacts.heat_conductance)
    flows = [_flow(contacts, line, electric, terminals, probe) for probe in probes]
    loads = np.stack([_joule_heat(thermal, flow, contact_heat) for flow in flows])
    inside = np.setdiff1d(np.arange(loads.shape[1]), line.ends)
    temperatures = _solve(thermal, loads, np.zeros(loads.shape[1]), inside)
    return tuple(_fields(line, thermal, *one) for one in zip(probes, flows, loads, temperatures, strict=True))


def _fields(line: _Line, thermal: _System, probe: Probe, flow: _Flow, load: Floats, temperature: Floats) -> Fields:
    """What is kept of one solution."""
    ends = line.ends.ravel()
    return Fields(
        probe=probe.name,
        voltage=probe.voltage,
        terminals=(probe.source, probe.sink),
        currents=flow.terminal_currents,
        fibril=line.fibril,
        xi=line.xi,
        potential=flow.potential,
        temperature=temperature[: len(line.xi)],
        segments=line.segments,
        segment_current=flow.along,
        heat=float(load.sum()),
        heat_out=float((load - _outflow(thermal, temperature))[ends].sum()),
        peak_temperature=_peak(thermal.basis, temperature),
        unreached=flow.unreached,
    )


# --- mesh ---------------------------------------------------------------------------------------------------


def _line(contacts: ContactState, *, refine: bool) -> _Line:
    """The mesh of the mechanics or, refined, the one whose nodes are the feet of the contacts."""
    mesh = contacts.mesh
    foot_fibril = np.stack([contacts.fibril_a, contacts.fibril_b])
    foot_xi = _checked_feet(mesh, foot_fibril, np.stack([contacts.xi_a, contacts.xi_b]))
    if refine:
        fibril, xi, foot_xi = _refined_nodes(contacts, foot_fibril, foot_xi)
    else:
        fibril, xi = mesh.node_fibril, mesh.xi
    left = np.flatnonzero(fibril[1:] == fibril[:-1])
    segments = np.column_stack([left, left + 1])
    owner = fibril[left]
    middle = 0.5 * (xi[left] + xi[left + 1])
    element = _locate(mesh, mesh.element_fibril, mesh.xi[mesh.elements[:, 0]], owner, middle)
    foot_segment = _locate(mesh, owner, xi[left], foot_fibril, foot_xi)
    start, stop = xi[segments[foot_segment]].transpose(2, 0, 1)
    return _Line(
        fibril=fibril,
        xi=xi,
        segments=segments,
        conduction=(mesh.electrical_conductivity * mesh.area)[owner] * contacts.axial_factor[element],
        thermal=(mesh.thermal_conductivity * mesh.area)[owner],
        ends=np.stack([np.searchsorted(fibril, np.arange(mesh.n_fibrils), side) for side in ("left", "right")])
        - np.array([[0], [1]]),
        foot_segment=foot_segment,
        foot_local=(foot_xi - start) / (stop - start),
    )


def _checked_feet(mesh: FibrilMesh, fibril: Ints, xi: Floats) -> Floats:
    """The feet, those beyond an end by no more than rounding put there; DesignError for all other feet outside."""
    length = mesh.length[fibril]
    on_fibril = np.clip(xi, 0.0, length)
    outside = np.argwhere(~(np.abs(xi - on_fibril) <= ROUNDING * length))
    if len(outside):
        side, contact = outside[0]
        raise DesignError(
            f"xi_{'ab'[side]}[{contact}]", float(xi[side, contact]), f"it must lie in [0, {length[side, contact]}] mm"
        )
    return on_fibril


def _refined_nodes(contacts: ContactState, foot_fibril: Ints, foot_xi: Floats) -> tuple[Ints, Floats, Floats]:
    """Nodes at the ends, at the feet and, where the conduction varies along the axis, between the elements.

    Returns fibril and coordinate of the nodes, and the coordinate of the node that each foot became.
    """
    mesh = contacts.mesh
    every = np.arange(mesh.n_fibrils)
    breaks = mesh.elements[:, 0] if np.any(contacts.axial_factor != 1.0) else np.empty(0, dtype=np.int64)
    fibril = np.concatenate([every, every, mesh.node_fibril[breaks], foot_fibril.ravel()])
    xi = np.concatenate([np.zeros(mesh.n_fibrils), mesh.length, mesh.xi[breaks], foot_xi.ravel()])
    order = np.lexsort((xi, fibril))
    same_fibril = np.diff(fibril[order]) == 0
    apart = np.diff(xi[order]) > ROUNDING * mesh.length[fibril[order[1:]]]
    first = np.concatenate([[True], ~same_fibril | apart])
    node = np.empty(len(order), dtype=np.int64)
    node[order] = np.cumsum(first) - 1
    node_xi = xi[order[first]]
    node_xi[node[mesh.n_fibrils : 2 * mesh.n_fibrils]] = mesh.length
    return (
        fibril[order[first]],
        node_xi,
        node_xi[node[-foot_xi.size :]].reshape(foot_xi.shape) if foot_xi.size else foot_xi,
    )


def _locate(mesh: FibrilMesh, owner: Ints, start: Floats, fibril: Ints, xi: Floats) -> Ints:
    """The element that contains each point, of elements sorted by `owner` and `start`."""
    # Fibril f covers the keys f to f + 1/2, so that one search serves all fibrils.
    key = owner + 0.5 * start / mesh.length[owner]
    found: Ints = np.searchsorted(key, fibril + 0.5 * xi / mesh.length[fibril], side="right") - 1
    return found


# --- systems ------------------------------------------------------------------------------------------------


@BilinearForm  # type: ignore[untyped-decorator]
def _conduction(u: Any, v: Any, w: Any) -> Any:
    """∫ c u' v' dxi."""
    return w.coefficient * dot(grad(u), grad(v))


@LinearForm  # type: ignore[untyped-decorator]
def _flux(v: Any, w: Any) -> Any:
    """∫ c x' v' dxi of a known field."""
    return w.coefficient * dot(grad(w.known), grad(v))


@LinearForm  # type: ignore[untyped-decorator]
def _source(v: Any, w: Any) -> Any:
    """∫ q v dxi."""
    return w.density * v


def _system(basis: Any, line: _Line, coefficient: Floats, conductance: Floats) -> _System:
    """Stiffness of the fibrils plus one rank-one coupling for each contact."""
    foot = [_evaluation(basis, *at) for at in zip(line.foot_segment, line.foot_local, strict=True)]
    jump = foot[0] - foot[1]
    along = basis.with_element(ElementLineP0()).interpolate(coefficient)
    stiffness = csr_matrix(_conduction.assemble(basis, coefficient=along) + jump.T @ diags_array(conductance) @ jump)
    return _System(basis, along, conductance, stiffness, foot, jump)


def _evaluation(basis: Any, segment: Ints, local: Floats) -> Any:
    """(C, N) matrix that takes nodal values to the field at one point of each given element."""
    dofs = basis.element_dofs[:, segment]
    values = np.stack([basis.elem.lbasis(local[None, :], i)[0] for i in range(len(dofs))])
    rows = np.broadcast_to(np.arange(len(segment)), dofs.shape)
    matrix = csr_matrix((values.ravel(), (rows.ravel(), dofs.ravel())), shape=(len(segment), basis.N))
    matrix.eliminate_zeros()
    return matrix


def _outflow(system: _System, x: Floats) -> Floats:
    """(N,) what leaves each dof through fibrils and contacts: `stiffness` times x, but element by element.

    In the assembled matrix a short element's large conductance swamps its small neighbours; summed element by
    element, what enters it is exactly what leaves it.
    """
    inside: Floats = _flux.assemble(system.basis, coefficient=system.coefficient, known=system.basis.interpolate(x))
    outside: Floats = system.jump.T @ (system.conductance * (system.jump @ x))
    return inside + outside


def _solve(system: _System, load: Floats, value: Floats, free: Ints) -> Floats:
    """Balance `load` (n, N) in the dofs `free`; elsewhere x is `value` (N,), and 0 where that is nan."""
    x = np.nan_to_num(np.tile(value, (len(load), 1)))
    if not len(free):
        return x
    # Symmetric and positive definite, so no pivoting: as fast as COLAMD on the paper's cell, three times on a denser one.
    factor = splu(
        system.stiffness[free][:, free].tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    for _ in range(1 + REFINEMENTS):
        residual = load - np.stack([_outflow(system, row) for row in x])
        x[:, free] += factor.solve(residual[:, free].T).T
    return x


# --- potential ----------------------------------------------------------------------------------------------


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


def _flow(contacts: ContactState, line: _Line, system: _System, terminals: Sequence[Terminal], probe: Probe) -> _Flow:
    """Solve [38] for one probe on the fibrils that its terminals reach."""
    mesh = contacts.mesh
    source, sink = (_held(mesh, terminals, name) for name in (probe.source, probe.sink))
    if np.any(source & sink):
        fibril = int(np.argwhere(source & sink)[0, 1])
        raise DesignError(f"probe {probe.name}", (probe.source, probe.sink), f"both hold an end of fibril {fibril}")
    reached = _reached(contacts, np.flatnonzero(np.any(source | sink, axis=0)))
    live = reached[line.fibril]
    value = np.full(len(live), np.nan)
    value[line.ends[source]], value[line.ends[sink]] = probe.voltage, 0.0
    V = _solve(system, np.zeros((1, len(live))), value, np.flatnonzero(live & np.isnan(value)))[0]
    through, along, into = _currents(line, system, V)
    conduction = line.conduction
    return _Flow(
        potential=np.where(live, V, np.nan),
        unreached=np.flatnonzero((mesh.electrical_conductivity > 0.0) & ~reached),
        along=along,
        terminal_currents=np.array([into[source].sum(), into[sink].sum()]),
        fibril_heat=np.divide(along**2, conduction, out=np.zeros_like(along), where=conduction > 0.0),
        contact_heat=through * (system.jump @ V),
    )


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


def _currents(line: _Line, system: _System, V: Floats) -> tuple[Floats, Floats, Floats]:
    """Currents through the contacts (C,), along the elements (S,), and into both fibril ends (2, F).

    The difference of V over a short element loses the digits that its large conductance multiplies. So the
    current at xi = 0 follows from the whole fibril, V0 - VL = sum R_s i_s, and all others by subtracting what
    the contacts drain on the way (Kirchhoff): the same numbers without that loss.
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
    entering = np.divide(V[first] - V[last] + lost, R_fibril, out=np.zeros_like(lost), where=R_fibril > 0.0)
    along = np.where(conducting, entering[owner] - drained, 0.0)
    return through, along, np.stack([entering, total[last] - before - entering])


# --- temperature --------------------------------------------------------------------------------------------


def _joule_heat(thermal: _System, flow: _Flow, contact_heat: bool) -> Floats:
    """Right-hand side of [37]: heat of the fibrils and, half to each side, of the contacts."""
    constant = thermal.basis.with_element(ElementLineP0())
    load: Floats = _source.assemble(thermal.basis, density=constant.interpolate(flow.fibril_heat))
    if contact_heat:
        load = load + 0.5 * (thermal.foot[0] + thermal.foot[1]).T @ flow.contact_heat
    return load


def _peak(basis: Any, temperature: Floats) -> float:
    """Largest value of a piecewise quadratic field."""
    start, stop, middle = temperature[basis.element_dofs]
    slope = 4.0 * middle - 3.0 * start - stop
    curvature = 2.0 * (start + stop - 2.0 * middle)  # T(s) = start + slope s + curvature s^2
    inside = (slope > 0.0) & (slope < -2.0 * curvature)
    rise = np.divide(slope**2, -4.0 * curvature, out=np.zeros_like(slope), where=inside)
    return float(np.max(np.where(inside, start + rise, np.maximum(start, stop))))
