"""A finer mesh of the same fibrils."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.geometry.mesh import FibrilMesh


def refined(mesh: FibrilMesh, pieces: int) -> FibrilMesh:
    """The mesh whose linear elements are `pieces` equal parts of every interval between neighbouring nodes.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> mesh = build_mesh(plain_weave())
    >>> finer = refined(mesh, 2)
    >>> len(mesh.elements), len(finer.elements), bool((finer.xi[:3] == mesh.length[0] / 80 * np.arange(3)).all())
    (1600, 6400, True)
    """
    last = np.zeros(mesh.n_nodes, dtype=bool)
    last[mesh.end_nodes(+1)] = True
    count = np.where(last, 1, pieces)
    node = np.repeat(np.arange(mesh.n_nodes), count)
    part = (np.arange(len(node)) - np.repeat(np.cumsum(count) - count, count)) / pieces
    following = np.where(last[node], node, node + 1)

    def between(values: Floats) -> Floats:
        t = part.reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray((1 - t) * values[node] + t * values[following])

    first = np.concatenate([[0], np.cumsum(count)])[mesh.first_node]
    left = np.setdiff1d(np.arange(len(node)), first[1:] - 1)
    return replace(
        mesh,
        position=between(mesh.position),
        directors=between(mesh.directors),
        xi=between(mesh.xi),
        natural=between(mesh.natural) if len(mesh.natural) else mesh.natural,
        elements=np.column_stack([left, left + 1]),
        first_node=first,
        first_element=first - np.arange(len(first)),
    )
