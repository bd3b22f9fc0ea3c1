"""Places for the nodes of a graph that has none: distances from nodes that lie far apart."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components, dijkstra

from circuittex.base.arrays import Floats


def levels(graph: sp.csr_array) -> Floats:
    """(n, 3) steps of each node from three nodes that lie far from one another, in each connected part by itself.

    Nodes of one distance separate those that are nearer from those that are farther: what nested dissection looks for.

    >>> chain = sp.diags_array([np.ones(3), np.ones(3)], offsets=[-1, 1]).tocsr()
    >>> levels(chain)[:, 0].tolist()
    [3.0, 2.0, 1.0, 0.0]
    """
    count, part = connected_components(graph, directed=False)
    found = np.zeros((graph.shape[0], 3))
    for number in range(count):
        nodes = np.flatnonzero(part == number)
        within = graph[nodes][:, nodes] if count > 1 else graph
        start, least = int(np.argmax(_steps(within, 0))), np.full(len(nodes), np.inf)
        for axis in range(3):
            steps = _steps(within, start)
            least = np.minimum(least, steps)
            found[nodes, axis] = steps
            start = int(np.argmax(least))
    return found


def _steps(graph: sp.csr_array, start: int) -> Floats:
    return np.asarray(dijkstra(graph, directed=False, indices=start, unweighted=True))
