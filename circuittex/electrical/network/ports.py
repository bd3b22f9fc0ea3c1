"""The exact reduction of a circuit to its ports: what any circuit around it sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components

from circuittex.base.arrays import Floats
from circuittex.base.compiled import compiled
from circuittex.base.frozen import frozen
from circuittex.electrical.network.circuit import Circuit, reached_part
from circuittex.electrical.network.nodal import port_basis


@frozen
class PortMatrix:
    """Currents into the ports of a circuit for voltages at them: I = G V, symmetric and passive."""

    ports: tuple[str, ...] = ()
    """(P,) names of the ports."""
    conductance: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    """(P, P) G, S: rows add up to zero, nothing beside the diagonal is positive."""

    def between(self, a: str, b: str) -> float:
        """Resistance between two ports, all others open, ohm; inf where nothing joins them.

        >>> round(PortMatrix(("a", "b"), np.array([[0.5, -0.5], [-0.5, 0.5]])).between("a", "b"), 12)
        2.0
        """
        return float(resistances(self)[self.ports.index(a), self.ports.index(b)])


def port_matrix(circuit: Circuit, ports: Sequence[str] | None = None) -> PortMatrix:
    """The port matrix of a circuit: the Schur complement of its nodal matrix on its ports.

    With f_k the flows that one volt at port k drives through the resistors R, G_kl = sum over resistors of f_k R f_l:
    exact, symmetric and positive semi-definite, with all digits also of what is small. What nothing joins has G = 0.

    Raises `CircuitError` as `solve_nodal` does.

    >>> from circuittex.electrical.network.circuit import reduced_circuit
    >>> resistances(port_matrix(reduced_circuit((1, 1), 2.0, 5.0)))[0].round(12).tolist()
    [0.0, 2.0, 7.0, 7.0]
    """
    names = tuple(circuit.ports if ports is None else ports)
    if not names:
        return PortMatrix()
    part = reached_part(circuit, names)
    flow = port_basis(part, names).flow
    G = flow.T @ (part.resistance[:, None] * flow)
    off = np.minimum(np.where(np.eye(len(names), dtype=bool), 0.0, (G + G.T) / 2), 0.0)
    return PortMatrix(names, off - np.diag(off.sum(axis=1)))


def resistances(matrix: PortMatrix) -> Floats:
    """(P, P) resistance between each two ports, all others open, ohm; inf where nothing joins them.

    With port i at ground, R_ij is the diagonal of the inverse. It comes from an elimination without subtractions
    (Grassmann, Taksar & Heyman, Operations Research 33, 1985), so that small resistances keep their digits beside large
    ones, where a pseudo-inverse of G would lose them.
    """
    G = matrix.conductance
    found = np.full(G.shape, np.inf)
    np.fill_diagonal(found, 0.0)
    count, part = connected_components(G < 0.0, directed=False)
    for number in range(count):
        own = np.flatnonzero(part == number)
        if len(own) > 1:
            found[np.ix_(own, own)] = _between(np.ascontiguousarray(G[np.ix_(own, own)]))
    return found


@compiled
def _between(G: Any) -> Any:
    """(P, P) resistances of connected ports, from the elements beside the diagonal alone."""
    n = G.shape[0]
    found = np.zeros((n, n))
    for ground in range(n):
        a, leak, pivot, y = -G, -G[:, ground], np.zeros(n), np.zeros(n)
        for k in range(n):
            if k == ground:
                continue
            total = leak[k]
            for m in range(k + 1, n):
                if m != ground:
                    total += a[k, m]
            pivot[k] = total
            for m in range(k + 1, n):
                if m == ground:
                    continue
                share = a[m, k] / total
                leak[m] += share * leak[k]
                for p in range(k + 1, n):
                    if p not in (m, ground):
                        a[m, p] += share * a[k, p]
                a[m, k] = share
        for j in range(n):
            if j == ground:
                continue
            y[:] = 0.0
            y[j] = 1.0
            for m in range(j, n):
                if m == ground:
                    continue
                for k in range(j, m):
                    if k != ground:
                        y[m] += a[m, k] * y[k]
                found[ground, j] += y[m] * y[m] / pivot[m]
    return (found + found.T) / 2
