"""Plane cuts through the fibrils."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.geometry.mesh import FibrilMesh
from circuittex.results.vtk import tubes

SIDES = 48
"""Corners of a cut across a fibril."""


@frozen
class Cut:
    """Outlines of the fibrils in the plane, (horizontal in-plane coordinate, z), mm."""

    across: Floats
    """(n, SIDES, 2) fibrils cut through."""
    across_fibril: Ints
    """(n,) which fibrils."""
    along: tuple[Floats, ...]
    """(m, 2) each: outlines of fibrils that run in the plane."""
    along_fibril: Ints
    """Which fibrils, one for each outline."""


def cut(mesh: FibrilMesh, x: Floats, axis: int, place: float) -> Cut:
    """Cut the configuration `x` (N, 3, 3) with the plane coordinate `axis` (0 for x, 1 for y) = `place`.

    Fibrils of yarns along `axis` are cut across: each of the lines that run along the surface,
    r + R cos t g1 + R sin t g2 at constant t, meets the plane. The other fibrils run along the plane and show a strip
    of half-width sqrt(R^2 - d^2) where the distance d of their centre line is below R.
    """
    across, which = _across(mesh, x, axis, place)
    outlines, fibrils = _along(mesh, x, axis, place)
    return Cut(across, which, outlines, fibrils)


def _across(mesh: FibrilMesh, x: Floats, axis: int, place: float) -> tuple[Floats, Ints]:
    points = tubes.surface(mesh, x, SIDES)
    nodes = tubes.spans(mesh)
    height = points[:, :, axis] - place
    lower, upper = height[nodes[:, 0]], height[nodes[:, 1]]
    fibril = mesh.node_fibril[nodes[:, 0]]
    meets = (lower <= 0.0) & (upper > 0.0) & (mesh.yarn_axis[mesh.yarn[fibril]] == axis)[:, None]
    span, line = np.nonzero(meets)
    share = (lower / np.where(meets, lower - upper, 1.0))[span, line, None]
    hit = (1.0 - share) * points[nodes[span, 0], line] + share * points[nodes[span, 1], line]
    # A line that folds back meets the plane again; the first time counts. The last writer wins, so go backwards.
    outline = np.full((mesh.n_fibrils, SIDES, 3), np.nan)
    outline[fibril[span][::-1], line[::-1]] = hit[::-1]
    whole = np.flatnonzero(~np.isnan(outline).any(axis=(1, 2)))
    return outline[whole][:, :, [1 - axis, 2]], whole


def _along(mesh: FibrilMesh, x: Floats, axis: int, place: float) -> tuple[tuple[Floats, ...], Ints]:
    distance = x[:, 0, axis] - place
    radius = mesh.radius[mesh.node_fibril]
    half = np.sqrt(np.clip(radius**2 - distance**2, 0.0, None))
    centre = x[:, 0, [1 - axis, 2]]
    tangent = np.gradient(centre, axis=0)
    tangent[mesh.end_nodes(-1)] = (centre[1:] - centre[:-1])[mesh.end_nodes(-1)]
    tangent[mesh.end_nodes(+1)] = (centre[1:] - centre[:-1])[mesh.end_nodes(+1) - 1]
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    # A plane that only grazes a fibril shows a hair, not a strip.
    inside = (half > 0.05 * radius) & (mesh.yarn_axis[mesh.yarn[mesh.node_fibril]] != axis)
    run = np.cumsum(np.diff(inside, prepend=False) | np.isin(np.arange(mesh.n_nodes), mesh.first_node))
    outlines, fibrils = [], []
    for number in np.unique(run[inside]):
        piece = np.flatnonzero((run == number) & inside)
        if len(piece) > 1:
            shift = half[piece, None] * normal[piece]
            outlines.append(np.concatenate([centre[piece] + shift, (centre[piece] - shift)[::-1]]))
            fibrils.append(mesh.node_fibril[piece[0]])
    return tuple(outlines), np.array(fibrils, dtype=np.int64)
