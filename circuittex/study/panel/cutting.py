"""Which yarn segments and crossings of a panel its cuts take away, and which crossings lie in a rectangle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.study.panel.statement import Box, Panel, Point

Flags = NDArray[np.bool_]


@frozen
class Severed:
    """What the cuts of a panel take away."""

    warp: Flags
    """(n, m + 1) segments of the warp yarns: from the minus end to the first crossing, ..., to the plus end."""
    weft: Flags
    """(n + 1, m) segments of the weft yarns: from the minus end to the first crossing, ..., to the plus end."""
    crossing: Flags
    """(n, m) crossings."""


def severed(panel: Panel) -> Severed:
    """Segments and crossings that the cuts take away.

    >>> from circuittex.study.panel.cells import CellResistances
    >>> from circuittex.study.panel.statement import Cut, Electrode
    >>> cut = Cut(line=((1.0, 0.0), (1.0, 2.0)))
    >>> panel = Panel((2, 2), CellResistances(1.0, 1.0, 1.0), (Electrode("a", edge="left"),), cuts=(cut,))
    >>> severed(panel).warp.tolist(), bool(severed(panel).weft.any())
    ([[False, True, False], [False, True, False]], False)
    """
    n, m = panel.shape
    width, height = panel.size
    warp, weft = np.zeros((n, m + 1), dtype=bool), np.zeros((m, n + 1), dtype=bool)
    crossing = np.zeros((n, m), dtype=bool)
    for cut in panel.cuts:
        if cut.line is not None:
            (x0, y0), (x1, y1) = cut.line
            _cross(warp, panel.x, panel.y, width, (x0, y0), (x1, y1))
            _cross(weft, panel.y, panel.x, height, (y0, x0), (y1, x1))
        else:
            assert cut.rectangle is not None
            x0, y0, x1, y1 = cut.rectangle
            _reach(warp, panel.x, panel.y, width, (x0, y0, x1, y1))
            _reach(weft, panel.y, panel.x, height, (y0, x0, y1, x1))
            crossing[within(panel, cut.rectangle)] = True
    return Severed(warp, weft.T, crossing)


def within(panel: Panel, box: Box) -> tuple[slice, slice]:
    """Rows and columns of the crossings in a rectangle, those on its border included."""
    x0, y0, x1, y1 = box

    def inside(places: Floats, low: float, high: float) -> slice:
        return slice(int(np.searchsorted(places, low, "left")), int(np.searchsorted(places, high, "right")))

    return inside(panel.y, y0, y1), inside(panel.x, x0, x1)


def _cross(segments: Flags, along: Floats, across: Floats, length: float, first: Point, last: Point) -> None:
    """Mark the segments (yarns, crossings + 1) that a line crosses; points are (along the yarns, across them)."""
    (a0, c0), (a1, c1) = first, last
    if c0 == c1:  # parallel to the yarns
        return
    t = (across - c0) / (c1 - c0)
    at = a0 + t * (a1 - a0)
    yarns = np.flatnonzero((t >= 0.0) & (t <= 1.0) & (at >= 0.0) & (at <= length))
    # A line through a crossing itself cuts behind it, on the side of the plus end.
    segments[yarns, np.searchsorted(along, at[yarns], side="right")] = True


def _reach(segments: Flags, along: Floats, across: Floats, length: float, box: Box) -> None:
    """Mark the segments of which a part lies in a box (along, across, along, across)."""
    a0, c0, a1, c1 = box
    bounds = np.concatenate([[0.0], along, [length]])
    segments[np.ix_((across >= c0) & (across <= c1), (bounds[:-1] < a1) & (bounds[1:] > a0))] = True
