"""In how many levels the fibrils of a yarn lie above one another."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.geometry.mesh import FibrilMesh


def levels(mesh: FibrilMesh, r: Floats, yarn: int, place: float) -> int:
    """The largest number of a yarn's fibrils that one vertical line meets at `place` (mm) along the yarn.

    r (N, 3) are the centre-line nodes, mm; between them the centre line is taken straight. A fibril counts
    for the lines that pass its axis by less than half its radius, so that neighbours in one row, which may
    overlap a little, do not count twice.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> mesh = build_mesh(plain_weave())
    >>> levels(mesh, mesh.position, yarn=1, place=-1.0)
    3
    """
    along = int(mesh.yarn_axis[yarn])
    fibrils = np.flatnonzero(mesh.yarn == yarn)
    nodes = [slice(mesh.first_node[f], mesh.first_node[f + 1]) for f in fibrils]
    lateral = np.array([np.interp(place, r[n, along], r[n, 1 - along]) for n in nodes])
    half = mesh.radius[fibrils] / 2
    # The count changes only at the fibrils' edges, and is largest just inside one of them.
    lines = lateral - half
    return int((np.abs(lines[:, None] - lateral[None, :]) <= half * (1 + 1e-9)).sum(axis=1).max())
