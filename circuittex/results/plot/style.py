"""What all figures share: size, fonts, colours, and how they are saved."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from circuittex.base.atomic import replacing

DOTS = 160
"""Dots per inch of PNG files and of the pictures inside SVG files."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Okabe and Ito's palette, distinct to colour-blind readers."""
GREY = "#444444"
MARKERS = ("o", "s", "^", "D", "v", "P")
LINES = ("-", "--", "-.", ":")

_STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "svg.hashsalt": "circuittex",
}


@contextmanager
def style() -> Iterator[None]:
    """The look of the figures while they are made and saved; matplotlib's settings are restored afterwards."""
    settings: dict[Any, Any] = dict(mpl.rcParamsDefault)
    del settings["backend"]  # the user's choice, and nothing that is drawn here depends on it
    with mpl.rc_context(settings | _STYLE):
        yield


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of that size, inches, that knows no window and no pyplot."""
    figure = Figure(figsize=(width, height), layout="constrained", dpi=DOTS)
    FigureCanvasAgg(figure)
    return figure


def bare(axes: Axes) -> None:
    """Drawing area without frame and ticks, one millimetre as long in both directions."""
    axes.set_aspect("equal")
    axes.set_axis_off()


def save(figure: Figure, folder: Path, name: str) -> tuple[Path, Path]:
    """Write `figure` as PNG and SVG; the same figure gives the same files."""
    png, svg = folder / f"{name}.png", folder / f"{name}.svg"
    with style():
        layout = figure.get_layout_engine()
        if layout is not None:
            layout.execute(figure)  # found once and kept; each file would find it again
            figure.set_layout_engine("none")
        with replacing(png) as partial:
            figure.savefig(partial, format="png", dpi=DOTS, metadata={"Software": None})
        with replacing(svg) as partial:
            figure.savefig(partial, format="svg", dpi=DOTS, metadata={"Date": None, "Creator": "circuittex"})
    return png, svg
