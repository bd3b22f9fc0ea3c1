"""Node voltages and port currents of a circuit by a direct sparse solution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu

from circuittex.circuit import Circuit, islands, port_nodes
from circuittex.errors import CircuitError
from circuittex.frozen import frozen
from circuittex.geometry.mesh import Floats, Ints


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

    @property
    def admittance(self) -> Floats:
        """(D, D) Y[p, q] = Σ G Δφ_p Δφ_q, S: current into port p for one volt at port q, the others at 0 V."""
        return self.flow.T @ self._drop(self.potential)

    def solve(self, drive: Mapping[str, float]) -> NodalSolution:
        """Return the solution for voltages at exactly these driven ports.

        The current into port p is the energy product Σ G Δφ_p ΔV. It equals the sum of the currents that leave the
        port, but that sum loses the digits of ΔV where a port hangs on a tiny resistor. Voltages are taken from the
        first port, so that what all ports have in common costs no digits either.
        """
        volts = np.array([drive[port] for port in self.ports], dtype=np.float64)
        above = self.potential @ (volts - volts[0])
        current = np.zeros(len(self.circuit.ports))
        current[[self.circuit.ports.index(port) for port in self.ports]] = self.flow.T @ self._drop(above)
        return NodalSolution(voltage=above + volts[0], port_current=current)

    def _drop(self, voltage: Floats) -> Floats:
        i, j = self.circuit.resistor_nodes.T
        difference: Floats = voltage[i] - voltage[j]
        return difference


def solve_nodal(circuit: Circuit, drive: Mapping[str, float]) -> NodalSolution:
    """Solve Kirchhoff's laws for given port voltages; ports that are not in `drive` carry no current.

    >>> from circuittex.circuit import reduced_circuit
    >>> solution = solve_nodal(reduced_circuit((1, 1), 2.0, 5.0), {"warp1_minus": 1.0, "weft1_plus": 0.0})
    >>> solution.port_current.round(12).tolist()
    [0.142857142857, 0.0, 0.0, -0.142857142857]

    Raises `CircuitError` for an unknown port, a voltage that is not finite, or an island that no driven port reaches.
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
    """Factorise the circuit with these ports held, and return its response to one volt at each of them."""
    fixed = port_nodes(circuit, ports)
    _refuse_islands(circuit, fixed)
    inner = np.setdiff1d(np.arange(circuit.n_nodes), fixed)
    difference = _incidence(circuit)
    conductance = 1.0 / circuit.resistance
    potential = np.zeros((circuit.n_nodes, len(fixed)))
    potential[fixed, np.arange(len(fixed))] = 1.0
    if len(inner):
        inwards = difference[:, inner].T.tocsr()
        laplacian = (inwards * conductance) @ difference[:, inner]
        lu = splu(laplacian.tocsc(), permc_spec="COLAMD")
        for _ in range(2):  # the second pass is one step of iterative refinement
            flow = conductance[:, None] * (difference @ potential)
            potential[inner] -= lu.solve(inwards @ flow)
    flow = conductance[:, None] * (difference @ potential)
    return PortBasis(circuit=circuit, ports=tuple(ports), potential=potential, flow=flow)


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
