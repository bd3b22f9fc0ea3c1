"""Tubes in parallel projection: faces turned away are dropped, the others shaded."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.geometry.mesh import FibrilMesh
from circuittex.results.plot.raster import picture
from circuittex.results.vtk import tubes

LIGHT = (-0.35, 0.45, 0.82)
"""Direction to the light: right, up, and towards the eye."""
AMBIENT = 0.42
SIDES = 16
"""Faces around a fibril, a multiple of four."""


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
    axes: Axes, mesh: FibrilMesh, x: Floats, values: Floats, scale: ScalarMappable, view: Camera, pixels: int
) -> None:
    """Draw all fibrils in the configuration `x` (N, 3, 3), coloured by `values` (I,) of their spans.

    They are one picture, in SVG files as well, with `pixels` along its longer side: as tens of thousands of paths an
    SVG would be slow to open.
    """
    points = view.project(tubes.surface(mesh, x, SIDES))
    walls = _walls(points, tubes.spans(mesh))
    caps = np.concatenate([points[mesh.end_nodes(-1)][:, ::-1], points[mesh.end_nodes(+1)]])
    fibrils = np.arange(mesh.n_fibrils)
    first, last = mesh.first_node[:-1] - fibrils, mesh.first_node[1:] - 2 - fibrils
    span = np.concatenate([np.repeat(np.arange(len(values)), SIDES), first, last])
    normal = np.concatenate([_normal(walls), _normal(caps[:, :: SIDES // 4])])
    light = np.array(LIGHT) / np.linalg.norm(LIGHT)
    brightness = AMBIENT + (1.0 - AMBIENT) * np.clip(normal @ light, 0.0, 1.0)
    colour = scale.to_rgba(values)[span, :3] * brightness[:, None]
    seen = normal[:, 2] > 0.0
    wall, cap = seen[: len(walls)], seen[len(walls) :]
    triangles = np.concatenate([_fans(walls[wall]), _fans(caps[cap])])
    colours = np.concatenate(
        [np.repeat(colour[: len(walls)][wall], 2, axis=0), np.repeat(colour[len(walls) :][cap], SIDES - 2, axis=0)]
    )
    drawn = picture(triangles, colours, pixels)
    axes.imshow(drawn.pixels, extent=drawn.extent, interpolation="antialiased")


def _fans(polygons: Floats) -> Floats:
    """(n (k - 2), 3, 3) triangles of convex polygons (n, k, 3), those of a polygon together."""
    k = polygons.shape[1]
    rest = np.arange(1, k - 1)
    corners = np.stack([np.zeros_like(rest), rest, rest + 1], axis=1)
    fans: Floats = polygons[:, corners].reshape(-1, 3, 3)
    return fans


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
