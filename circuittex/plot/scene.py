"""Tubes in parallel projection: faces turned away are dropped, the others shaded and drawn from back to front."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection

from circuittex import tubes
from circuittex.frozen import frozen
from circuittex.geometry.mesh import FibrilMesh, Floats, Ints

LIGHT = (-0.35, 0.45, 0.82)
"""Direction to the light: right, up, and towards the eye."""
AMBIENT = 0.42


@frozen
class Camera:
    """Direction of view."""

    frame: Floats
    """(3, 3) rows: right, up and towards the eye, in the coordinates of the fabric."""

    def project(self, points: Floats) -> Floats:
        """(..., 3) right, up, and nearness to the eye."""
        seen: Floats = points @ self.frame.T
        return seen


def camera(azimuth: float, elevation: float) -> Camera:
    """A camera that looks down on the fabric; azimuth from the x axis and elevation above its plane in degrees.

    >>> camera(-90.0, 90.0).project(np.array([1.0, 2.0, 3.0])).round(12).tolist()
    [1.0, 2.0, 3.0]
    """
    a, e = np.deg2rad(azimuth), np.deg2rad(elevation)
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return Camera(np.stack([right, np.cross(eye, right), eye]))


def draw_tubes(
    axes: Axes, mesh: FibrilMesh, x: Floats, values: Floats, scale: ScalarMappable, view: Camera, sides: int
) -> None:
    """Draw all fibrils in the configuration `x` (N, 3, 3), coloured by `values` (I,) of their spans.

    `sides` faces around a fibril, a multiple of four.
    """
    points = view.project(tubes.surface(mesh, x, sides))
    walls = _walls(points, tubes.spans(mesh))
    caps = np.concatenate([points[mesh.end_nodes(-1)][:, ::-1], points[mesh.end_nodes(+1)]])
    fibrils = np.arange(mesh.n_fibrils)
    first, last = mesh.first_node[:-1] - fibrils, mesh.first_node[1:] - 2 - fibrils
    span = np.concatenate([np.repeat(np.arange(len(values)), sides), first, last])
    normal = np.concatenate([_normal(walls), _normal(caps[:, :: sides // 4])])
    depth = np.concatenate([walls[..., 2].mean(axis=1), caps[..., 2].mean(axis=1)])
    visible = np.flatnonzero(normal[:, 2] > 0.0)
    visible = visible[np.argsort(depth[visible], kind="stable")]
    light = np.array(LIGHT) / np.linalg.norm(LIGHT)
    brightness = AMBIENT + (1.0 - AMBIENT) * np.clip(normal[visible] @ light, 0.0, 1.0)
    colour = scale.to_rgba(values)[span[visible], :3] * brightness[:, None]
    outlines = [*walls[..., :2], *caps[..., :2]]
    # Edges in the colour of the face close the hairline gaps of anti-aliasing. An SVG gets the tubes as one picture:
    # as tens of thousands of paths it would be slow to open.
    axes.add_collection(
        PolyCollection(
            [outlines[face] for face in visible],
            facecolors=colour,
            edgecolors=colour,
            linewidths=0.25,
            rasterized=True,
        )
    )
    axes.autoscale_view()


def _walls(points: Floats, nodes: Ints) -> Floats:
    first, second = points[nodes[:, 0]], points[nodes[:, 1]]
    following = np.roll(np.arange(points.shape[1]), -1)
    corners = np.stack([first, first[:, following], second[:, following], second], axis=2)
    return corners.reshape(-1, 4, 3)


def _normal(corners: Floats) -> Floats:
    """(n, 3) unit normals of quadrilaterals (n, 4, 3), from their diagonals; zero where a face has no area."""
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    unit: Floats = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    return unit
