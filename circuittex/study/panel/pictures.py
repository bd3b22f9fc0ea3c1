"""Pictures of a panel: voltage, current density, heat, and gradients, over its plane."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from circuittex.base.arrays import Floats
from circuittex.base.atomic import replacing
from circuittex.design.checks import one_of
from circuittex.results.plot.style import DOTS, new_figure, style
from circuittex.study.panel.gradient import PanelGradient
from circuittex.study.panel.solution import PanelSolution
from circuittex.study.panel.statement import Panel

QUANTITIES = ("voltage", "current", "heat", "strain")
"""What `panel_figure` draws."""
_LINE = "#222222"
_PART = 0.2
"""Percent of the cells at either end whose values may lie beyond the colours."""


def panel_figure(solution: PanelSolution, quantity: str = "heat") -> Figure:
    """A map of a panel: 'voltage' of both yarns, 'current' density, 'heat' per area, or 'strain'."""
    one_of(quantity, "quantity", QUANTITIES)
    panel = solution.wiring.panel
    maps: dict[str, tuple[Floats, str]]
    if quantity == "voltage":
        maps = {"warp": (solution.warp_voltage, "V"), "weft": (solution.weft_voltage, "V")}
    elif quantity == "current":
        density = np.hypot(solution.current_x, solution.current_y)
        maps = {"current per width": (1e3 * density, "mA/mm")}
    elif quantity == "heat":
        maps = {"heat per area": (1e3 * solution.heat / panel.pitch**2, "mW/mm²")}
    else:
        maps = {"strain": (100.0 * np.broadcast_to(panel.strain, panel.shape), "%")}
    return _drawn(panel, maps, {"voltage": "viridis", "current": "magma", "heat": "inferno"}.get(quantity, "cividis"))


def gradient_figure(panel: Panel, gradient: PanelGradient) -> Figure:
    """Maps of the derivatives of a resistance with respect to the strain and the Rc of every cell."""
    of = f"R({gradient.source}, {gradient.sink})"
    maps = {
        f"d{of}/d strain": (gradient.strain, "ohm"),
        f"d{of}/dRc": (gradient.crossing, "ohm/ohm"),
    }
    return _drawn(panel, maps, "cividis")


def save_figure(path: Path, figure: Figure) -> None:
    """Write a figure as PNG; the same figure gives the same file."""
    with style(), replacing(path) as partial:
        figure.savefig(partial, format="png", dpi=DOTS, metadata={"Software": None})


def _drawn(panel: Panel, maps: dict[str, tuple[Floats, str]], colours: str) -> Figure:
    width, height = panel.size
    tall = float(np.clip(4.5 * height / width, 1.5, 9.0))
    with style():
        figure = new_figure(5.6 * len(maps), tall + 0.7)
        for place, (title, (values, unit)) in enumerate(maps.items()):
            axes = figure.add_subplot(1, len(maps), place + 1)
            axes.grid(visible=False)
            low, high = _range(values)
            image = axes.imshow(
                np.ma.masked_invalid(values),
                extent=(0.0, width, 0.0, height),
                origin="lower",
                cmap="coolwarm" if low < 0.0 < high and low == -high else colours,
                vmin=low,
                vmax=high,
                interpolation="nearest",
            )
            _furnish(axes, panel)
            axes.set(title=title, xlabel="x, mm", ylabel="y, mm")
            beyond = (bool((values < low).any()), bool((values > high).any()))
            extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(beyond, "neither")
            figure.colorbar(image, ax=axes, label=unit, extend=extend)
    return figure


def _range(values: Floats) -> tuple[float, float]:
    """Ends of the colours: a few cells beside the end of a cut do not leave all others without any."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0, 1.0
    low, high = np.percentile(known, [_PART, 100.0 - _PART])
    if low < 0.0 < high:
        low, high = -max(-low, high), max(-low, high)
    return float(low), float(high)


def _furnish(axes: Axes, panel: Panel) -> None:
    """Outline electrodes and mark cuts."""
    width, height = panel.size
    edges: dict[str, Any] = {
        "left": ([0, 0], [0, height]),
        "right": ([width, width], [0, height]),
        "bottom": ([0, width], [0, 0]),
        "top": ([0, width], [height, height]),
    }
    for electrode in panel.electrodes:
        if electrode.edge:
            axes.plot(*edges[electrode.edge], color=_LINE, linewidth=4, clip_on=False)
        if electrode.rectangle is not None:
            x0, y0, x1, y1 = electrode.rectangle
            axes.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, edgecolor="white", linewidth=1.5))
    for cut in panel.cuts:
        if cut.line is not None:
            (x0, y0), (x1, y1) = cut.line
            axes.plot([x0, x1], [y0, y1], color="white", linewidth=1.5, linestyle="--")
    axes.set(xlim=(0, width), ylim=(0, height))
