"""How the routes to one current agree in every recorded state, and how the potential on the mesh converges."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from circuittex.results.plot.style import COLOURS, GREY, MARKERS, new_figure, style
from circuittex.results.records import Record, Study
from circuittex.results.verification import AGREEMENT


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
