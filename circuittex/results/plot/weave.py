"""The deformed weave in three dimensions, coloured by force, current or temperature."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.electrical.fields import Fields
from circuittex.geometry.mesh import FibrilMesh
from circuittex.results.loadings import by_loading, farthest
from circuittex.results.plot.scene import Camera, camera, draw_tubes
from circuittex.results.plot.style import GREY, bare, new_figure, style
from circuittex.results.records import Record, Study
from circuittex.results.vtk import tubes

VIEW = (-62.0, 38.0)
"""Azimuth and elevation of the single cell, degrees."""
PROBE_VIEW = (-75.0, 58.0)


@frozen
class _Scale:
    """What a colour bar says; `low` is the value of its lower end, the upper end is the largest value."""

    label: str
    unit: str
    colours: str
    low: float


def cell_figure(study: Study, record: Record) -> Figure:
    """The cell of one state as tubes coloured by the magnitude of the section force |∫ P E3 dA|, N."""
    return _force_figure(study, (record,), 1150)


def strained_figure(study: Study) -> Figure:
    """The cell where each loading path has come farthest, coloured by section force, N: figure 12 of the paper."""
    return _force_figure(study, tuple(farthest(records) for records in by_loading(study).values()), 900)


def _force_figure(study: Study, records: Sequence[Record], pixels: int) -> Figure:
    view = camera(*VIEW)
    columns = min(len(records), 2)
    rows = -(-len(records) // columns)
    panels = []
    with style():
        figure = new_figure(7.2 if columns == 1 else 5.6 * columns, 4.4 * rows + 0.6)
        for number, record in enumerate(records):
            axes = figure.add_subplot(rows, columns, number + 1)
            values = record.section_force[tubes.span_element(study.mesh)]
            scale = _Scale("section force", "N", "viridis", float(values.min()))
            _draw(axes, study.mesh, record.configuration.x, values, scale, view, pixels)
            _axes_triad(axes, view, record.configuration.r, _unit(study.mesh))
            axes.set_title(f"{record.name}: section force")
            panels.append(axes)
        _same_scale(panels, 0.5 * _unit(study.mesh))
    return figure


def probe_figure(study: Study, records: Sequence[Record], quantity: str) -> Figure:
    """The `quantity` ('current' or 'temperature') of every probe, a row for each state, each on a scale of its own.

    The current is the mean of its magnitude over the piece between two mesh nodes of one fibril. A plus marks the
    probe's source, a minus its sink.
    """
    label, unit, colours, value = _QUANTITIES[quantity]
    scale = _Scale(label, unit, colours, 0.0)
    view = camera(*PROBE_VIEW)
    columns, panels = len(study.design.probes), []
    with style():
        figure = new_figure(3.6 * columns, 3.5 * len(records))
        # The layout counts the height of one line of a title above axes of a fixed aspect; these have two.
        figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, 1.0 - 0.06 / len(records)), hspace=0.06)
        for row, record in enumerate(records):
            for column, fields in enumerate(record.fields):
                axes = figure.add_subplot(len(records), columns, row * columns + column + 1)
                _draw(axes, study.mesh, record.configuration.x, value(study.mesh, fields), scale, view, 620)
                _mark_terminals(axes, study, record, fields, view)
                current = f"{fields.currents[0]:.4g} A at {fields.voltage:g} V"
                axes.set_title(f"{record.name}, probe {fields.probe}\n{current}")
                panels.append(axes)
        _same_scale(panels, 1.2 * _unit(study.mesh))
    return figure


def _current(mesh: FibrilMesh, fields: Fields) -> Floats:
    return np.abs(tubes.span_current(mesh, fields))


def _temperature(mesh: FibrilMesh, fields: Fields) -> Floats:
    mean: Floats = tubes.at_nodes(mesh, fields, fields.temperature)[tubes.spans(mesh)].mean(axis=1)
    return mean


_QUANTITIES: dict[str, tuple[str, str, str, Callable[[FibrilMesh, Fields], Floats]]] = {
    "current": ("|current| in a fibril", "A", "cividis", _current),
    "temperature": ("temperature rise", "K", "plasma", _temperature),
}
_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def _draw(axes: Axes, mesh: FibrilMesh, x: Floats, values: Floats, scale: _Scale, view: Camera, pixels: int) -> None:
    """Tubes with a colour bar in a unit of the size of the values."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    unit, prefix = next((pair for pair in _PREFIXES if largest >= pair[0]), (1.0, ""))
    low, high = scale.low / unit, largest / unit
    colours = ScalarMappable(Normalize(low, high if high > low else low + 1.0), scale.colours)
    bare(axes)
    draw_tubes(axes, mesh, x, values / unit, colours, view, pixels)
    figure = axes.figure
    assert isinstance(figure, Figure)
    bar = figure.colorbar(colours, ax=axes, orientation="horizontal", shrink=0.6, aspect=30, pad=0.02)
    bar.set_label(f"{scale.label} ({prefix}{scale.unit})")


def _same_scale(panels: Sequence[Axes], margin: float) -> None:
    """Every panel shows a piece of the plane of the same size, with `margin` (mm) round the largest picture."""
    limits = np.array([(axes.get_xlim(), axes.get_ylim()) for axes in panels])
    half = np.ptp(limits, axis=2).max(axis=0) / 2 + margin
    for axes, centre in zip(panels, limits.mean(axis=2), strict=True):
        low, high = centre - half, centre + half
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))


def _unit(mesh: FibrilMesh) -> float:
    """What marks, arrows and margins are measured in, mm: an eighth of the longest fibril, 1 mm in the paper's cell."""
    return float(mesh.length.max()) / 8.0


def round_length(most: float) -> float:
    """The largest length of one digit, 1, 2 or 5, that is no longer than `most`.

    >>> round_length(1.0), round_length(0.25), round_length(0.06)
    (1.0, 0.2, 0.05)
    """
    ten = 10.0 ** math.floor(math.log10(most))
    return max(digit * ten for digit in (1, 2, 5) if digit * ten <= most * (1.0 + 1e-9))


def _axes_triad(axes: Axes, view: Camera, r: Floats, unit: float) -> None:
    """Arrows of a round length along x, y and z in the corner of the picture."""
    low, length = view.project(r).min(axis=0), round_length(unit)
    readable = [withStroke(linewidth=2.5, foreground="white")]  # where a fibril lies behind
    for direction, name in zip(length * view.project(np.eye(3)), "xyz", strict=True):
        tip = low[:2] + direction[:2]
        arrow = {"arrowstyle": "-|>", "color": GREY, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tip, low[:2], arrowprops=arrow, annotation_clip=False)
        right, up = low[:2] + 1.25 * direction[:2]
        axes.text(right, up, name, ha="center", va="center", color=GREY, path_effects=readable)
    axes.text(low[0], low[1] - 0.15 * length, f"{length:g} mm", ha="center", va="top", color=GREY, fontsize=8)


def _mark_terminals(axes: Axes, study: Study, record: Record, fields: Fields, view: Camera) -> None:
    mesh, seen = study.mesh, view.project(record.configuration.r)
    ends = {terminal.name: terminal.ends for terminal in study.design.terminals}
    middle = seen.mean(axis=0)
    for name, sign, colour in zip(fields.terminals, "+−", ("#d55e00", "#0072b2"), strict=True):
        for yarn, side in ends[name]:
            nodes = mesh.end_nodes(side)[mesh.yarn == mesh.yarn_names.index(yarn)]
            place = seen[nodes].mean(axis=0)
            place += 0.9 * _unit(mesh) * (place - middle) / np.linalg.norm((place - middle)[:2])
            axes.text(
                place[0],
                place[1],
                sign,
                ha="center",
                va="center",
                color="white",
                fontweight="bold",
                bbox={"boxstyle": "circle,pad=0.2", "facecolor": colour, "edgecolor": "none"},
            )
