"""Error bars on curves. They never push a curve out of sight: one that is too long for its panel is cut and named."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.patheffects import withStroke

from circuittex.results.plot.style import GREY

_BAR = Path(
    [(0.0, -1.0), (0.0, 1.0), (-0.5, -1.0), (0.5, -1.0), (-0.5, 1.0), (0.5, 1.0)],
    [Path.MOVETO, Path.LINETO] * 3,
)
_UP = Path([(-0.6, -1.0), (0.0, 0.0), (0.6, -1.0)])
_DOWN = Path([(-0.6, 1.0), (0.0, 0.0), (0.6, 1.0)])


@dataclass(frozen=True)
class Bar:
    """The estimated error of one value of a curve."""

    strain: float
    value: float
    error: float
    dashes: str
    """Those of the curve."""

    @property
    def ends(self) -> tuple[float, float]:
        return self.value - self.error, self.value + self.error


def draw_error_bars(axes: Axes, bars: Iterable[Bar], colour: str) -> None:
    """Bars of value ± error beside the curves that are drawn already; none where either is not known.

    They make the vertical axis at most three times as long as the curves need it. A bar that is still longer ends in
    an arrow head at the edge of the panel, and its error is written there.
    """
    known = [bar for bar in bars if np.isfinite(bar.ends).all()]
    if not known:
        return
    bottom, top = _limits(axes, known)
    axes.set_ylim(bottom, top)
    for bar in known:
        _draw(axes, bar, bottom, top, colour)
    left = [bar for bar in known if bar.strain <= np.mean(axes.get_xlim())]
    for half, bars in (("left", left), ("right", [bar for bar in known if bar not in left])):
        _name(axes, [bar for bar in bars if bar.ends[1] > top], half, "top", colour)
        _name(axes, [bar for bar in bars if bar.ends[0] < bottom and bar.ends[1] <= top], half, "bottom", colour)


def _draw(axes: Axes, bar: Bar, bottom: float, top: float, colour: str) -> None:
    """One bar as far as it is between the ends of the axis, below the markers of the curve."""
    low, high = bar.ends
    ends = max(low, bottom), min(high, top)
    look: dict[str, Any] = {
        "color": colour,
        "linewidth": 1.0,
        "zorder": 1.9,
        "markersize": 8,
        "markerfacecolor": "none",
    }
    axes.plot([bar.strain] * 2, ends, bar.dashes, **look)
    for end, head in zip(ends, (_DOWN if low < bottom else "_", _UP if high > top else "_"), strict=True):
        axes.plot([bar.strain], [end], marker=head, **look)


def _name(axes: Axes, bars: list[Bar], half: str, edge: str, colour: str) -> None:
    """The errors of bars that are cut at an edge, beside their arrow heads, each on a line of its own."""
    bottom, top = axes.get_ylim()
    errors = dict.fromkeys((bar.strain, f"±{float(f'{bar.error:.2g}'):g}") for bar in bars)  # a cycle closes
    for line, (strain, error) in enumerate(errors):
        inwards = 3 + 10 * line
        axes.annotate(
            error,
            (strain, top if edge == "top" else bottom),
            (6 if half == "left" else -6, -inwards if edge == "top" else inwards),
            textcoords="offset points",
            ha=half,
            va=edge,
            color=colour,
            fontsize=8,
            path_effects=[withStroke(linewidth=2.0, foreground="white")],  # where another bar lies behind
        )


def _limits(axes: Axes, bars: list[Bar]) -> tuple[float, float]:
    """Lower and upper end of the vertical axis with the bars, as far as they count."""
    low, high = axes.get_ylim()
    least, most = min(bar.ends[0] for bar in bars), max(bar.ends[1] for bar in bars)
    margin = 0.03 * (max(most, high) - min(least, low))
    # One value alone has no length that has to be kept in sight.
    room = high - low if axes.dataLim.height > 0.0 else np.inf
    return max(low - room, min(low, least - margin)), min(high + room, max(high, most + margin))


def error_bar_key() -> Line2D:
    """What the bars are, for a legend."""
    label = "estimated discretisation error"
    return Line2D([], [], linestyle="", marker=_BAR, markersize=10, markerfacecolor="none", color=GREY, label=label)
