"""Forces, currents and network resistances against strain."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from circuittex.base.arrays import Floats
from circuittex.results.loadings import by_loading, turns
from circuittex.results.outcome import Outcome
from circuittex.results.plot.error_bars import Bar, draw_error_bars, error_bar_key
from circuittex.results.plot.style import COLOURS, GREY, LINES, MARKERS, new_figure, style
from circuittex.results.records import Record, Study
from circuittex.results.summary import insulated_resistances, network_names

CLAMPS = ("warp clamps, +x ends", "weft clamps, +y ends")
ESTIMATED = ("Fx warp", "Fy weft")
"""What error estimates call the force along the yarns at these clamps."""
MOST_COLUMNS = 3
MOST_TICKS = 5
"""Intervals between strains on an axis: numbers as long as 0.0005 stand apart."""
LEAST = 0.01
"""Share of its values that an axis shows on either side at least, lest differences in the fifth digit fill it."""
_DIAMOND: dict[str, Any] = {"linestyle": "", "marker": "D", "markersize": 7, "markerfacecolor": "none"}
"""The other branch of a bifurcation, larger than the markers of the curve that it may lie on."""

Value = Callable[[Outcome], float]


def force_figure(study: Study) -> Figure:
    """Total clamp force in all components, N [40, 41]: for each loading path the warp's above the weft's."""
    loadings = by_loading(study)
    columns = min(len(loadings), MOST_COLUMNS)
    rows = 2 * -(-len(loadings) // columns)
    with style():
        figure = new_figure(max(4.0 * columns, 4.6), 2.7 * rows)
        for number, (loading, records) in enumerate(loadings.items()):
            block, column = divmod(number, columns)
            for side, clamps in enumerate(CLAMPS):
                axes = figure.add_subplot(rows, columns, (2 * block + side) * columns + column + 1)
                for component, name in enumerate(("Fx", "Fy", "Fz")):
                    _line(axes, study, records, _clamp_force(side, component), COLOURS[component], component, name)
                draw_error_bars(axes, _bars(study, [records], ESTIMATED[side]), COLOURS[side])
                axes.set_title(f"{loading}: {clamps}" if loading else clamps)
                axes.set_ylabel("force (N)")
        _finish(figure, study, [loading for loading in loadings for _ in CLAMPS])
    return figure


def conductance_figure(study: Study) -> Figure:
    """Current of each probe against strain, A, one panel for each probe: their sizes differ by orders."""
    probes, loadings = study.design.probes, by_loading(study)
    columns = min(len(probes), MOST_COLUMNS)
    rows = -(-len(probes) // columns)
    with style():
        figure = new_figure(max(3.1 * columns, 3.6), 3.2 * rows)
        for number, probe in enumerate(probes):
            axes = figure.add_subplot(rows, columns, number + 1)
            for k, (loading, records) in enumerate(loadings.items()):
                _line(axes, study, records, _current(number), COLOURS[number % len(COLOURS)], k, loading)
            _widen(axes)
            draw_error_bars(axes, _bars(study, loadings.values(), f"I {probe.name}"), COLOURS[number % len(COLOURS)])
            axes.set_title(f"probe {probe.name}")
            axes.set_ylabel(f"current at {probe.drive} (A)")
        _finish(figure, study, [])
    return figure


def network_figure(study: Study) -> Figure:
    """Ry and Rc of the reduced network [43-47] against strain, ohm; dashed the Ry of insulated yarns [57].

    Where there are several kinds of yarn, each kind and each pair of kinds that cross has a panel: their sizes differ
    by orders."""
    loadings, names = by_loading(study), network_names(study)
    insulated = insulated_resistances(study.design, study.mesh, names)
    columns = min(len(names), 2 if len(names) == 4 else MOST_COLUMNS)
    rows = -(-len(names) // columns)
    with style():
        figure = new_figure({1: 5.0, 2: 8.0, 3: 10.0}[columns], 3.4 * rows)
        for number, name in enumerate(names):
            axes = figure.add_subplot(rows, columns, number + 1)
            colour = COLOURS[number % len(COLOURS)]
            for k, (loading, records) in enumerate(loadings.items()):
                _line(axes, study, records, _resistance(number), colour, k, loading)
            if np.isfinite(ohm := insulated.get(name, np.inf)):
                axes.axhline(ohm, color=GREY, linestyle="--", linewidth=1.0, label=f"insulated, {ohm:.4g} Ω")
                low, high = axes.get_ylim()
                axes.set_ylim(min(low, (1 - LEAST) * ohm), max(high, (1 + LEAST) * ohm))
            draw_error_bars(axes, _bars(study, loadings.values(), name), colour)
            if not np.isfinite([record.outcome.network[number] for record in study.records]).any():
                axes.text(0.5, 0.5, "infinite or not determined", ha="center", va="center", transform=axes.transAxes)
                axes.set(xticks=[], yticks=[])
            letters, _, kind = name.partition(" ")
            part = {"Ry": "yarn segment", "Rc": "crossing"}[letters]
            axes.set_title(f"{part}\n{kind}" if kind else part)
            axes.set_ylabel(f"{letters} (Ω)")
        _finish(figure, study, [])
    return figure


def _clamp_force(side: int, component: int) -> Value:
    return lambda outcome: float(outcome.clamp_force[side, component])


def _current(number: int) -> Value:
    return lambda outcome: outcome.currents[number]


def _resistance(number: int) -> Value:
    return lambda outcome: outcome.network[number]


def _bars(study: Study, loadings: Iterable[Sequence[Record]], name: str) -> Iterator[Bar]:
    """The error bars for the quantity that error estimates call `name`, in the dashes of each loading's line."""
    for kind, records in enumerate(loadings):
        for record in records:
            if (estimate := study.error_of(record.name)) is not None:
                quantity = estimate.quantity(name)
                yield Bar(record.strain, quantity.value, quantity.absolute, LINES[kind % len(LINES)])


def _line(
    axes: Axes, study: Study, records: Sequence[Record], value: Value, colour: str, kind: int, label: str
) -> None:
    """One quantity along one loading; `kind` chooses marker and dashes. States on the way back have hollow markers, the
    other branches of bifurcations diamonds."""
    strain = np.array([record.strain for record in records])
    values = np.array([value(record.outcome) for record in records])
    marker = MARKERS[kind % len(MARKERS)]
    (line,) = axes.plot(strain, values, LINES[kind % len(LINES)], color=colour, label=label or "_", linewidth=1.3)
    back = _on_the_way_back(strain)
    axes.plot(strain[~back], values[~back], marker, color=colour, markersize=4)
    axes.plot(strain[back], values[back], marker, color=colour, markersize=4.5, markerfacecolor="white")
    line.set(marker=marker, markersize=4, markevery=[])  # for the legend
    bends = turns(strain.tolist())
    branches = zip([0, *bends], [*bends, len(strain) - 1], strict=True) if bends else ()
    for middle in ((first + last) // 2 for first, last in branches):
        arrow = {"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (strain[middle + 1], values[middle + 1]), (strain[middle], values[middle]), arrowprops=arrow)

    other = [(record.strain, value(check.again)) for record in records if (check := study.bifurcation_of(record.name))]
    if other:
        axes.plot(*zip(*other, strict=True), color=colour, **_DIAMOND)


def _widen(axes: Axes) -> None:
    """Make an axis at least twice `LEAST` of its values high."""
    low, high = axes.get_ylim()
    spare = LEAST * max(abs(low), abs(high)) - (high - low) / 2.0
    if spare > 0.0:
        axes.set_ylim(low - spare, high + spare)


def _on_the_way_back(strain: Floats) -> NDArray[np.bool_]:
    """(n,) whether the step to a state made the strain smaller."""
    back: NDArray[np.bool_] = np.diff(np.abs(strain), prepend=-np.inf) < 0.0
    return back


def _finish(figure: Figure, study: Study, names: Sequence[str]) -> None:
    """Labels and legends; `names` are the loadings of the panels where each shows but one."""
    loadings = list(by_loading(study).values())
    only = names or [records[-1].loading if len(loadings) == 1 else "" for records in loadings[:1] for _ in figure.axes]
    for axes, name in zip(figure.axes, only, strict=True):
        axes.set_xlabel(f"strain ({name})" if name else "strain")
        if len(axes.get_xticks()):  # a panel that says why it is empty has none
            axes.ticklabel_format(axis="y", useOffset=False)
            axes.locator_params(axis="x", nbins=MOST_TICKS)
        if axes.get_legend_handles_labels()[1]:
            axes.legend()
    keys = []
    if any(turns([record.strain for record in records]) for records in loadings):
        keys += [
            Line2D([], [], marker="o", linestyle="", color=GREY, markerfacecolor=face, markersize=4.5, label=label)
            for face, label in ((GREY, "strain growing"), ("white", "on the way back"))
        ]
    if any(study.bifurcation_of(record.name) for record in study.records):
        keys.append(Line2D([], [], color=GREY, label="other branch of a bifurcation", **_DIAMOND))
    if any(np.isfinite(quantity.absolute) for error in study.errors for quantity in error.quantities):
        keys.append(error_bar_key())
    if keys:
        figure.legend(handles=keys, loc="outside lower center", ncols=3 if figure.get_figwidth() > 6.0 else 2)
