"""The C1 centre line on which contact is found: cubic Hermite through the nodes, Catmull-Rom tangents.

Straight segments put equilibria of bent fibrils on kinks where the contact force jumps; this curve has a
continuous tangent. An *interval* lies between two neighbouring nodes; its cubic reads four consecutive
nodes, its *window*. At a fibril's ends, where a neighbour is missing, the curve is the parabola through
the last three nodes. Positions on a fibril are counted in nodes: s = 2.25 lies a quarter into interval 2.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled
from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.geometry.mesh import FibrilMesh

BASIS = np.array(
    [
        [[1.0, -1.5, 0.5, 0.0], [0.0, 2.0, -1.0, 0.0], [0.0, -0.5, 0.5, 0.0], [0.0, 0.0, 0.0, 0.0]],
        [[0.0, -0.5, 1.0, -0.5], [1.0, 0.0, -2.5, 1.5], [0.0, 0.5, 2.0, -1.5], [0.0, 0.0, -0.5, 0.5]],
        [[0.0, 0.0, 0.0, 0.0], [0.0, -0.5, 0.5, 0.0], [1.0, 0.0, -1.0, 0.0], [0.0, 0.5, 0.5, 0.0]],
    ]
)
"""(kind, node of the window, power of t): first, inner and last interval of a fibril."""


@frozen
class CurveTable:
    """Where each of the I intervals finds its nodes."""

    first_interval: Ints
    """(F + 1,) offsets into the intervals."""
    fibril: Ints
    """(I,) fibril of each interval."""
    window: Ints
    """(I,) first node of the window."""
    kind: Ints
    """(I,) 0 first, 1 inner, 2 last interval of its fibril."""


class Curve(NamedTuple):
    """The centre lines of one configuration, as compiled functions take them."""

    r: Floats
    """(N, 3) nodes, mm."""
    basis: Floats
    """`BASIS`."""
    window: Ints
    """(I,) `CurveTable.window`."""
    kind: Ints
    """(I,) `CurveTable.kind`."""


def curve_through(table: CurveTable, r: Floats) -> Curve:
    """The centre lines through nodes r (N, 3)."""
    return Curve(r=r, basis=BASIS, window=table.window, kind=table.kind)


def curve_table(mesh: FibrilMesh) -> CurveTable:
    """The table for a mesh; every fibril needs at least four nodes."""
    nodes = np.diff(mesh.first_node)
    if nodes.min() < 4:
        raise DesignError("nodes of a fibril", int(nodes.min()), "contact needs four nodes on every fibril")
    first = np.concatenate([[0], np.cumsum(nodes - 1)])
    fibril = np.repeat(np.arange(mesh.n_fibrils), nodes - 1)
    k = np.arange(first[-1]) - first[fibril]
    window = mesh.first_node[fibril] + np.clip(k - 1, 0, nodes[fibril] - 4)
    kind = np.where(k == 0, 0, np.where(k == nodes[fibril] - 2, 2, 1))
    return CurveTable(first_interval=first, fibril=fibril, window=window, kind=kind)


def bezier(table: CurveTable, r: Floats) -> Floats:
    """(I, 4, 3) Bézier control points of every interval: the curve stays within their convex hull."""
    power = np.einsum("iap,iac->ipc", BASIS[table.kind], r[table.window[:, None] + np.arange(4)])
    to_bezier = np.array([[1, 0, 0, 0], [1, 1 / 3, 0, 0], [1, 2 / 3, 1 / 3, 0], [1, 1, 1, 1]])
    return np.asarray(np.einsum("bp,ipc->ibc", to_bezier, power))


def tangents(table: CurveTable, r: Floats, interval: Ints, t: Floats) -> Floats:
    """(n, 3) derivative of the curves through nodes r (N, 3) at local coordinates t (n,) of intervals (n,)."""
    powers = np.stack([np.zeros_like(t), np.ones_like(t), 2 * t, 3 * t**2], axis=1)
    weight = np.einsum("nap,np->na", BASIS[table.kind[interval]], powers)
    return np.asarray(np.einsum("na,nac->nc", weight, r[table.window[interval][:, None] + np.arange(4)]))


@compiled
def weights(basis: Any, t: float, derivative: int, c: Any) -> None:
    """Fill c (4,) with the weights of the window's nodes at t in [0, 1], or their first or second derivatives."""
    for a in range(4):
        b = basis[a]
        if derivative == 0:
            c[a] = b[0] + t * (b[1] + t * (b[2] + t * b[3]))
        elif derivative == 1:
            c[a] = b[1] + t * (2 * b[2] + t * 3 * b[3])
        else:
            c[a] = 2 * b[2] + 6 * t * b[3]


@compiled
def evaluate(basis: Any, r: Any, window: int, t: float, derivative: int, c: Any, x: Any) -> None:
    """Fill x (3,) with the curve, or its derivative of the given order with respect to t; c (4,) with the weights."""
    weights(basis, t, derivative, c)
    for k in range(3):
        x[k] = c[0] * r[window, k] + c[1] * r[window + 1, k] + c[2] * r[window + 2, k] + c[3] * r[window + 3, k]
