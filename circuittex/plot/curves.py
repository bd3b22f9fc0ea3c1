"""Forces, currents, network resistances and route differences of all recorded states."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from circuittex.plot.style import COLOURS, GREY, LINES, MARKERS, new_figure, style
from circuittex.results import Record, Study
from circuittex.summary import insulated_resistance
from circuittex.verify import AGREEMENT


def loading_paths(study: Study) -> dict[str, tuple[Record, ...]]:
    """The records of each loading path, the relaxed state first: every path starts there."""
    start = tuple(record for record in study.records if not record.path)
    names = dict.fromkeys(record.path for record in study.records if record.path)
    return {name: start + tuple(r for r in study.records if r.path == name) for name in names} or {"": start}


def force_figure(study: Study) -> Figure:
    """Total clamp force on the +x ends of the warp and the +y ends of the weft, all components, N [40, 41]."""
    with style():
        figure = new_figure(8.0, 3.4)
        left, right = figure.subplots(1, 2)
        for side, (axes, ends) in enumerate(((left, "+x ends of the warp"), (right, "+y ends of the weft"))):
            for component, name in enumerate(("Fx", "Fy", "Fz")):
                _plot_paths(axes, study, _clamp_force(side, component), component, name)
            axes.set_title(f"clamps at the {ends}")
            axes.set_ylabel("force (N)")
        _finish(figure, study)
    return figure


def conductance_figure(study: Study) -> Figure:
    """Current of each probe against strain, A, one panel for each probe: their sizes differ by orders."""
    probes = study.design.probes
    with style():
        figure = new_figure(max(2.9 * len(probes), 3.4), 3.2)
        for number, probe in enumerate(probes):
            axes = figure.add_subplot(1, len(probes), number + 1)
            _plot_paths(axes, study, _current(number), number, "")
            axes.set_title(f"probe {probe.name}")
            axes.set_ylabel(f"current at {probe.voltage:g} V (A)")
        _finish(figure, study)
    return figure


def network_figure(study: Study) -> Figure:
    """Ry and Rc of the reduced network [43-47] against strain, ohm; dashed the Ry of insulated yarns [57]."""
    with style():
        figure = new_figure(8.0, 3.4)
        left, right = figure.subplots(1, 2)
        _plot_paths(left, study, lambda r: r.fit.Ry, 0, "")
        insulated = insulated_resistance(study.mesh)
        if np.isfinite(insulated):
            left.axhline(insulated, color=GREY, linestyle="--", linewidth=1.0, label=f"insulated, {insulated:.4g} Ω")
            low, high = left.get_ylim()  # at least 1 % either side, lest differences in the fifth digit fill the axis
            left.set_ylim(min(low, 0.99 * insulated), max(high, 1.01 * insulated))
        left.set_title("yarn segment")
        left.set_ylabel("Ry (Ω)")
        _plot_paths(right, study, lambda r: r.fit.Rc, 1, "")
        for axes, ohms in ((left, [r.fit.Ry for r in study.records]), (right, [r.fit.Rc for r in study.records])):
            if not np.isfinite(ohms).any():
                axes.text(0.5, 0.5, "infinite or not determined", ha="center", va="center", transform=axes.transAxes)
        right.set_title("crossing")
        right.set_ylabel("Rc (Ω)")
        _finish(figure, study)
    return figure


def verification_figure(study: Study) -> Figure:
    """Largest differences between the routes in every recorded state, and the two errors of discretisation."""
    rows: tuple[tuple[str, Callable[[Record], float]], ...] = (
        ("node voltages between routes (V per V)", lambda r: r.verification.max_voltage_difference),
        ("probe currents between routes (relative)", lambda r: r.verification.max_current_difference),
        ("currents, contacts merged (relative)", lambda r: r.verification.merge_error),
        ("currents, mechanical mesh (relative)", lambda r: r.verification.field_difference),
    )
    places = np.arange(len(study.records))
    with style():
        figure = new_figure(7.2, 1.9 + 0.22 * len(places))
        axes = figure.add_subplot()
        for number, (label, value) in enumerate(rows):
            # Equal to the last bit is drawn at the rounding unit: a logarithm has no zero.
            size = np.maximum([abs(value(record)) for record in study.records], np.finfo(float).eps)
            axes.plot(size, places, MARKERS[number], color=COLOURS[number], label=label, markersize=5)
        required = f"required of the routes, {AGREEMENT:.0e}"
        axes.axvline(AGREEMENT, color=GREY, linestyle="--", linewidth=1.0, label=required)
        axes.set_xscale("log")
        axes.set_yticks(places, [record.name for record in study.records])
        axes.set_ylim(len(places) - 0.5, -0.5)
        axes.set_xlabel("largest difference")
        figure.legend(loc="outside lower center", ncols=2)
    return figure


def convergence_figure(study: Study) -> Figure:
    """Current error of the field on the mechanical mesh against its node distance, beside the slope of second order."""
    with style():
        figure = new_figure(4.6, 3.2)
        axes = figure.add_subplot()
        for number, record in enumerate(r for r in study.records if len(r.field_convergence)):
            distance, error = record.field_convergence.T
            error = np.maximum(error, np.finfo(float).eps)  # a logarithm has no zero
            axes.loglog(distance, error, MARKERS[number], color=COLOURS[number], label=record.name, markersize=5)
            axes.loglog(distance, error[0] * (distance / distance[0]) ** 2, color=GREY, linestyle="--", linewidth=1.0)
        axes.set_xlabel("node distance (mm)")
        axes.set_ylabel("largest relative current error")
        axes.set_title("dashed: second order")
        figure.legend(loc="outside lower center")
    return figure


def _clamp_force(side: int, component: int) -> Callable[[Record], float]:
    return lambda record: float(record.clamp_force[side, component])


def _current(number: int) -> Callable[[Record], float]:
    return lambda record: record.currents[number]


def _plot_paths(axes: Axes, study: Study, value: Callable[[Record], float], colour: int, label: str) -> None:
    """One line for each loading path: the colour tells the quantity, marker and dashes tell the path."""
    paths = loading_paths(study)
    for number, (path, records) in enumerate(paths.items()):
        text = ", ".join(part for part in (label, path if len(paths) > 1 else "") if part)
        axes.plot(
            [record.strain for record in records],
            [value(record) for record in records],
            LINES[number % len(LINES)],
            marker=MARKERS[number % len(MARKERS)],
            markersize=4,
            color=COLOURS[colour % len(COLOURS)],
            label=text,
        )


def _finish(figure: Figure, study: Study) -> None:
    paths = [path for path in loading_paths(study) if path]
    for axes in figure.axes:
        axes.set_xlabel(f"strain ({paths[0]})" if len(paths) == 1 else "strain")
        if any(not label.startswith("_") for label in axes.get_legend_handles_labels()[1]):
            axes.legend()
