"""Node voltages and port currents of a circuit by a direct sparse solution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import CircuitError
from circuittex.base.frozen import frozen
from circuittex.electrical.network.circuit import Circuit, islands, port_nodes

_UNBALANCED = 1e-8
"""Port currents whose sum exceeds this fraction of the largest are not a solution of Kirchhoff's laws."""
_REFINEMENTS = 6
"""Steps of iterative refinement at most; one or two are enough unless conductances differ by ten decades."""
_SAMPLES = 8
_STEPS = 2
"""Roundings of a node's largest term that a simulator's elimination adds up there."""
_NO_ENERGY = float(16.0 * np.finfo(float).eps) ** 2
"""G times this, at 1 V, is what rounding makes of the current where both voltages of its energy product are zero."""


@frozen
class NodalSolution:
    """Voltages and currents of a circuit whose ports are driven by voltage sources."""

    voltage: Floats
    """(K,) potential of each node, V."""
    port_current: Floats
    """(P,) current into the circuit at each port, A; 0 at the ports that are not driven."""


@frozen
class PortBasis:
    """The response of a circuit to one volt at each of D driven ports in turn, the other driven ports at 0 V."""

    circuit: Circuit
    """The circuit it belongs to."""
    ports: tuple[str, ...]
    """(D,) the driven ports."""
    potential: Floats
    """(K, D) node voltages φ, V per V."""
    flow: Floats
    """(R, D) currents G Δφ through the resistors, S."""

    def solve(self, drive: Mapping[str, float]) -> NodalSolution:
        """Return the solution for voltages at exactly these driven ports.

        The current into port p is the energy product Σ G Δφ_p ΔV. It equals the sum of the currents that leave the
        port, but that sum loses the digits of ΔV where a port hangs on a tiny resistor. Voltages are taken from that of
        the middle port, so that what most ports have in common costs no digits either.

        Raises `CircuitError` where the currents break Kirchhoff's law: they do not add up to zero.
        """
        volts = np.array([drive[port] for port in self.ports], dtype=np.float64)
        middle = np.sort(volts)[len(volts) // 2]
        above = self.potential @ (volts - middle)
        current = np.zeros(len(self.circuit.ports))
        drop = self.circuit.resistance * (self.flow @ (volts - middle))
        current[[self.circuit.ports.index(port) for port in self.ports]] = self.flow.T @ drop
        self._refuse_unbalanced(current, volts)
        return NodalSolution(voltage=above + middle, port_current=current)

    def _refuse_unbalanced(self, current: Floats, volts: Floats) -> None:
        """Raise where the currents do not add up to zero; currents that are all rounding are as good as none."""
        largest = np.abs(current).max(initial=0.0)
        nothing = _NO_ENERGY * float(np.sum(1.0 / self.circuit.resistance)) * float(np.ptp(volts))
        if not abs(current.sum()) <= max(_UNBALANCED * largest, nothing):
            raise CircuitError(
                f"singular: the port currents add up to {float(current.sum()):.3g} A and the largest is "
                f"{float(largest):.3g} A: resistances between {float(self.circuit.resistance.min()):.1e} and "
                f"{float(self.circuit.resistance.max()):.1e} ohm are too far apart for a nodal solution"
            )


def solve_nodal(circuit: Circuit, drive: Mapping[str, float]) -> NodalSolution:
    """Solve Kirchhoff's laws for given port voltages; ports that are not in `drive` carry no current.

    >>> from circuittex.electrical.network.circuit import reduced_circuit
    >>> solution = solve_nodal(reduced_circuit((1, 1), 2.0, 5.0), {"warp1_minus": 1.0, "weft1_plus": 0.0})
    >>> solution.port_current.round(12).tolist()
    [0.142857142857, 0.0, 0.0, -0.142857142857]

    Raises `CircuitError` for an unknown port, a voltage that is not finite, a resistance that is not positive and
    finite, or an island that no driven port reaches.
    """
    return solve_drives(circuit, [drive])[0]


def solve_drives(circuit: Circuit, drives: Sequence[Mapping[str, float]]) -> tuple[NodalSolution, ...]:
    """Solve for several drives; those that drive the same ports share one factorisation."""
    bases: dict[frozenset[str], PortBasis] = {}
    solutions = []
    for drive in drives:
        for port, volts in drive.items():
            if not np.isfinite(volts):
                raise CircuitError(f"port {port!r}: {volts!r} V is not a finite voltage")
        ports = frozenset(drive)
        if ports not in bases:
            bases[ports] = port_basis(circuit, tuple(drive))
        solutions.append(bases[ports].solve(drive))
    return tuple(solutions)


def port_basis(circuit: Circuit, ports: Sequence[str]) -> PortBasis:
    """Factorise the circuit with these ports held, and return its response to one volt at each of them.

    Between nodes that a large conductance joins, the drop is far smaller than the voltages and would lose its digits
    in their difference. So voltages are kept as a rounded part, whose differences are exact there, and a small rest
    that iterative refinement finds.
    """
    _refuse_resistances(circuit)
    grounded = _grounded(circuit, ports)
    potential = np.zeros((circuit.n_nodes, len(grounded.fixed)))
    potential[grounded.fixed, np.arange(len(grounded.fixed))] = 1.0
    potential -= grounded.response(grounded.flow(potential))
    rest = np.zeros_like(potential)
    flow = grounded.flow(potential)
    for _ in range(_REFINEMENTS):
        step = grounded.response(flow)
        rest -= step
        flow = grounded.flow(potential) + grounded.flow(rest)
        if np.abs(step).max(initial=0.0) <= np.finfo(float).eps ** 2:
            break
    return PortBasis(circuit=circuit, ports=tuple(ports), potential=potential + rest, flow=flow)


def _refuse_resistances(circuit: Circuit) -> None:
    """Raise where a resistance is not positive and finite, by hand or from a file: it would be solved all the same."""
    wrong = np.flatnonzero(~((circuit.resistance > 0.0) & np.isfinite(circuit.resistance)))
    if len(wrong):
        first = int(wrong[0])
        more = f" ({len(wrong)} such resistors in all)" if len(wrong) > 1 else ""
        raise CircuitError(
            f"resistor {circuit.resistor_names[first]!r}: {float(circuit.resistance[first])!r} ohm is not usable; a "
            f"resistance must be positive and finite{more}"
        )


def rounding_errors(circuit: Circuit, drive: Mapping[str, float]) -> tuple[float, Floats]:
    """Return what rounding does to a simulator's answer: voltage, V per V, and current (D,) of each driven port, S.

    One solution in double precision, unrefined as in a simulator, satisfies Kirchhoff's law at each node up to
    some eps Σ G, the largest terms it adds there (eps = 2.2e-16). How far such errors carry depends on the circuit: a
    yarn on contacts of little conductance floats on them. So errors of twice this size, eight of random sign,
    are sent through the solution. What ngspice was measured to err by, on woven cells with sigma_c from 1e-10 to 10
    S/mm2 and 138 to 484 resistors, lies between 0.005 and 0.2 of the largest sample, over 11 decades; in 300 cells
    drawn at random (`tests/random_designs.py`) it is 0.6 at most.
    """
    grounded = _grounded(circuit, tuple(drive))
    eps = _STEPS * float(np.finfo(float).eps)
    at_node = abs(grounded.difference).T @ grounded.conductance
    sign = np.random.default_rng(0).choice([-1.0, 1.0], (len(grounded.inner), _SAMPLES))
    voltage = np.zeros((circuit.n_nodes, _SAMPLES))
    voltage[grounded.inner] = eps * grounded.solve(sign * at_node[grounded.inner, None])
    out = grounded.difference[:, grounded.fixed].T @ grounded.flow(voltage)
    current: Floats = np.abs(out).max(axis=1) + eps * at_node[grounded.fixed]
    return float(np.abs(voltage).max(initial=0.0)), current


@dataclass(frozen=True)
class _Grounded:
    """The factorised equations of a circuit with some nodes held."""

    fixed: Ints
    inner: Ints
    difference: csc_array
    inwards: csr_array
    conductance: Floats
    lu: SuperLU | None

    def flow(self, potential: Floats) -> Floats:
        """Currents G Δφ (R, D)."""
        flow: Floats = self.conductance[:, None] * (self.difference @ potential)
        return flow

    def solve(self, injected: Floats) -> Floats:
        """Voltages of the inner nodes for currents into them."""
        solution: Floats = injected if self.lu is None else self.lu.solve(injected)
        return solution

    def response(self, flow: Floats) -> Floats:
        """Voltages (K, D) that carry the current which these flows leave over at the inner nodes."""
        voltage = np.zeros((self.difference.shape[1], flow.shape[1]))
        voltage[self.inner] = self.solve(self.inwards @ flow)
        return voltage


def _grounded(circuit: Circuit, ports: Sequence[str]) -> _Grounded:
    fixed = port_nodes(circuit, ports)
    _refuse_islands(circuit, fixed)
    inner = np.delete(np.arange(circuit.n_nodes), fixed)
    difference = _incidence(circuit)
    conductance = 1.0 / circuit.resistance
    inwards = difference[:, inner].T
    lu = None
    if len(inner):
        # Without pivoting, in the order of minimum degree, it is twice as fast but loses a twelfth digit.
        try:
            lu = splu(((inwards * conductance) @ inwards.T).tocsc(), permc_spec="COLAMD")
        except RuntimeError as error:  # a pivot of zero: nothing of the weak resistors is left in the matrix
            least, most = float(circuit.resistance.min()), float(circuit.resistance.max())
            raise CircuitError(
                f"singular: resistances between {least:.1e} and {most:.1e} ohm are too far apart for a nodal solution"
            ) from error
    return _Grounded(fixed, inner, difference, inwards, conductance, lu)


def _incidence(circuit: Circuit) -> csc_array:
    """Return the matrix (R, K) that takes node voltages to the voltage over each resistor."""
    r, k = circuit.n_resistors, circuit.n_nodes
    values = np.tile([1.0, -1.0], r)
    return coo_array((values, (np.repeat(np.arange(r), 2), circuit.resistor_nodes.ravel())), shape=(r, k)).tocsc()


def _refuse_islands(circuit: Circuit, fixed: Ints) -> None:
    """Raise where a part of the circuit has no driven port, so that its potential is undefined."""
    if len(fixed) == 0:
        raise CircuitError("no port is driven: every potential is undefined")
    if len(set(fixed.tolist())) < len(fixed):
        raise CircuitError("two driven ports are the same node")
    island = islands(circuit)
    lost = np.flatnonzero(~np.isin(island, island[fixed]))
    if len(lost):
        first = lost[island[lost] == island[lost[0]]]
        names = ", ".join(circuit.node_names[k] for k in first[:3])
        driven = ", ".join(circuit.ports[int(np.flatnonzero(circuit.port_node == k)[0])] for k in fixed)
        raise CircuitError(
            f"singular: no driven port ({driven}) reaches the island of {len(first)} nodes "
            f"{names}{', ...' if len(first) > 3 else ''}; cut it off with reached_part(circuit, driven ports)"
        )
