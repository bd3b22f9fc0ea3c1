"""Cross-sections of a centre yarn before and after: three levels of fibrils become two."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from circuittex.base.arrays import Floats
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import initial_configuration
from circuittex.results.plot.cut import cut
from circuittex.results.plot.style import COLOURS, new_figure, style
from circuittex.results.records import Record, Study


def section_figure(study: Study, record: Record) -> Figure:
    """Cuts through a centre yarn in the initial configuration and in one state.

    Left across the yarn, at its crossing with the centre yarn of the other direction; right along it (the paper's
    figure 10), with the fibrils of the crossing yarns cut across.
    """
    mesh = study.mesh
    warp, weft = _centre_yarn(mesh, 0), _centre_yarn(mesh, 1)
    with style():
        figure = new_figure(9.0, 4.2)
        grid = figure.subplots(2, 2, sharex="col", sharey="col", width_ratios=(1.0, 2.4), squeeze=False)
        states = (("before", initial_configuration(mesh).x), (record.name, record.configuration.x))
        for row, (name, x) in zip(grid, states, strict=True):
            for axes, axis, other in ((row[0], 0, weft), (row[1], 1, warp)):
                place = float(x[mesh.yarn[mesh.node_fibril] == other, 0, axis].mean())
                _draw_cut(axes, mesh, x, axis, place)
                axes.set_title(f"{name}: {'xy'[axis]} = {place:.3g} mm")
                axes.set_ylabel("z (mm)")
            _zoom(row[0], mesh, x, warp)
        grid[1, 0].set_xlabel(f"y (mm), across {mesh.yarn_names[warp]}")
        grid[1, 1].set_xlabel(f"x (mm), along {mesh.yarn_names[warp]}")
        names = ("warp (along x)", "weft (along y)")
        keys = [Patch(color=colour, label=name) for colour, name in zip(COLOURS, names, strict=False)]
        figure.legend(handles=keys, loc="outside lower center", ncols=2)
    return figure


def _centre_yarn(mesh: FibrilMesh, axis: int) -> int:
    """The second of four yarns, the first of one or two: the one before the middle."""
    yarns = np.flatnonzero(mesh.yarn_axis == axis)
    return int(yarns[(len(yarns) - 1) // 2])


def _draw_cut(axes: Axes, mesh: FibrilMesh, x: Floats, axis: int, place: float) -> None:
    pieces = cut(mesh, x, axis, place)
    pale = 0.45 * np.array(to_rgb(COLOURS[1 - axis])) + 0.55
    axes.add_collection(PolyCollection(list(pieces.along), facecolors=pale, edgecolors="white", linewidths=0.8))
    full = COLOURS[axis]
    axes.add_collection(PolyCollection(list(pieces.across), facecolors=full, edgecolors="white", linewidths=0.5))
    axes.set_axisbelow(True)
    axes.set_aspect("equal")
    axes.autoscale_view()


def _zoom(axes: Axes, mesh: FibrilMesh, x: Floats, warp: int) -> None:
    """Show the surroundings of one crossing."""
    y = x[mesh.yarn[mesh.node_fibril] == warp, 0, 1]
    half = 0.7 * float(np.ptp(y)) + 2.0 * float(mesh.radius.max())
    axes.set_xlim(float(y.mean()) - half, float(y.mean()) + half)
