"""Small fibril systems and networks made by hand, and a dense grid to judge the reduced network by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from circuittex.contact.state import ContactState
from circuittex.design import Terminal
from circuittex.electrical.network.circuit import Circuit
from circuittex.geometry.mesh import FibrilMesh

NO_FIBRILS = np.empty(0, dtype=np.int64)


def fibrils(
    lengths: Sequence[float], sigma: Sequence[float], yarn: Sequence[int] | None = None, elements: int = 1
) -> FibrilMesh:
    """Straight fibrils of unit section area, each a yarn of its own ('yarn1', ...) unless said otherwise."""
    n = len(lengths)
    yarns = np.arange(n) if yarn is None else np.asarray(yarn)
    xi = np.concatenate([np.linspace(0.0, length, elements + 1) for length in lengths])
    first = np.arange(n)[:, None] * (elements + 1) + np.arange(elements)
    one = np.ones(n)
    return FibrilMesh(
        position=np.stack([xi, 0 * xi, 0 * xi], axis=1),
        directors=np.tile(np.eye(3)[1:], (len(xi), 1, 1)),
        xi=xi,
        elements=np.stack([first.ravel(), first.ravel() + 1], axis=1),
        first_node=np.arange(n + 1) * (elements + 1),
        first_element=np.arange(n + 1) * elements,
        yarn=yarns,
        length=np.asarray(lengths, dtype=float),
        radius=one / np.sqrt(np.pi),
        youngs_modulus=one,
        poisson_ratio=0 * one,
        density=one,
        electrical_conductivity=np.asarray(sigma, dtype=float),
        thermal_conductivity=one,
        yarn_names=tuple(f"yarn{y + 1}" for y in range(yarns.max() + 1)),
        yarn_axis=np.zeros(yarns.max() + 1, dtype=np.int64),
    )


def touching(
    mesh: FibrilMesh, rows: Sequence[tuple[int, int, float, float, float]], factor: Sequence[float] | None = None
) -> ContactState:
    """A contact state of rows (fibril a, fibril b, xi a, xi b, conductance)."""
    table = np.asarray(rows, dtype=float).reshape(-1, 5)
    one = np.ones(len(table))
    return ContactState(
        mesh=mesh,
        fibril_a=table[:, 0].astype(np.int64),
        fibril_b=table[:, 1].astype(np.int64),
        xi_a=table[:, 2],
        xi_b=table[:, 3],
        gap=-0.01 * one,
        line_load=one,
        width=one,
        weight=one,
        conductance=table[:, 4],
        heat_conductance=one,
        axial_factor=np.ones(len(mesh.elements)) if factor is None else np.asarray(factor, dtype=float),
    )


def end(yarn: int, side: int, name: str = "") -> Terminal:
    """A terminal at one end of 'yarn<yarn>', called 'y1m' or 'y1p'."""
    return Terminal(name or f"y{yarn}{'m' if side < 0 else 'p'}", ((f"yarn{yarn}", side),))


def network(edges: Sequence[tuple[int, int, float]], ports: Sequence[int]) -> Circuit:
    """A circuit of resistors (node, node, ohm) with the ports 'p<node>'."""
    pairs = np.array([edge[:2] for edge in edges], dtype=np.int64).reshape(-1, 2)
    n = int(max(pairs.max(initial=0), *ports)) + 1
    return Circuit(
        node_names=tuple(f"n{k}" for k in range(n)),
        node_fibril=np.full(n, -1),
        node_xi=np.full(n, np.nan),
        resistor_nodes=pairs,
        resistance=np.array([edge[2] for edge in edges], dtype=float),
        resistor_names=tuple(f"r{k}" for k in range(len(edges))),
        resistor_kind=np.full(len(edges), 2),
        ports=tuple(f"p{node}" for node in ports),
        port_node=np.array(ports),
        merged_feet=0,
        dropped_contacts=0,
        unreached=NO_FIBRILS,
    )


def grid_edges(n: int, m: int) -> list[tuple[int, int, float]]:
    """Unit resistors of a square grid of n x m nodes, node (i, j) being i m + j."""
    along = [(i * m + j, i * m + j + 1, 1.0) for i in range(n) for j in range(m - 1)]
    return along + [(i * m + j, (i + 1) * m + j, 1.0) for i in range(n - 1) for j in range(m)]


def woven_grid_current(n: int, m: int, Ry: float, Rc: float, source: tuple[str, int], sink: tuple[str, int]) -> float:
    """Current at 1 V of the reduced network [43-46], cell by cell with its four arms, by dense elimination.

    A yarn end is ('warp' or 'weft' with its number from 1, side), as in 'warp2', -1.
    """
    index: dict[tuple[object, ...], int] = {}

    def node(*key: object) -> int:
        return index.setdefault(key, len(index))

    size = 2 * n * m + n * (m + 1) + m * (n + 1)
    laplacian = np.zeros((size, size))

    def join(i: int, j: int, ohm: float) -> None:
        laplacian[[i, j], [i, j]] += 1.0 / ohm
        laplacian[[i, j], [j, i]] -= 1.0 / ohm

    for i in range(n):
        for j in range(m):
            warp, weft = node("on warp", i, j), node("on weft", i, j)
            join(warp, node("arm warp", i, j), Ry / 2)
            join(warp, node("arm warp", i, j + 1), Ry / 2)
            join(weft, node("arm weft", j, i), Ry / 2)
            join(weft, node("arm weft", j, i + 1), Ry / 2)
            join(warp, weft, Rc)

    def yarn_end(yarn: str, side: int) -> int:
        kind, number = yarn[:4], int(yarn[4:]) - 1
        return node(f"arm {kind}", number, 0 if side < 0 else {"warp": m, "weft": n}[kind])

    a, b = yarn_end(*source), yarn_end(*sink)
    inside = [k for k in range(size) if k != b]
    injected = np.zeros(size)
    injected[a] = 1.0
    voltage = np.linalg.solve(laplacian[np.ix_(inside, inside)], injected[inside])
    return float(1.0 / voltage[inside.index(a)])
