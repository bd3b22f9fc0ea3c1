"""The pictures of a library's datasheet."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from circuittex.base.arrays import Floats
from circuittex.electrical.network.ports import resistances
from circuittex.results.plot.style import COLOURS, MARKERS, new_figure, save, style
from circuittex.study.library.accuracy import Errors
from circuittex.study.library.bicubic import patches, value_at
from circuittex.study.library.facts import Facts
from circuittex.study.library.interpolation import pieces, value
from circuittex.study.library.network import matrix_at, ports_network
from circuittex.study.library.strain_path import StrainPath

SHOWN = 4
"""Pairs of pins whose resistance is drawn against strain."""
FINE, COARSE = 60, 24
"""Strains at which a curve is drawn, and along either side of a grid."""


def save_figures(known: Facts, folder: Path) -> Mapping[str, bytes]:
    """Draw all figures into `folder`; returns the PNG files by name."""
    folder.mkdir(parents=True, exist_ok=True)
    with style():
        figures = {f"errors_{level}": _heat_map(level, errors) for level, errors in known.errors.items()}
        if known.paths:
            figures["strain"] = _against_strain(known)
        if known.grids:
            figures["grid"] = _over_grids(known)
        if known.paths and not known.levels.reason:
            figures["network"] = _network(known)
    return {name: save(figure, folder, name)[0].read_bytes() for name, figure in figures.items()}


def _heat_map(level: str, errors: Errors) -> Figure:
    """Largest errors of each pair of pins over all states, in resistance and in change."""
    figure = new_figure(9.0, 4.2)
    axes = figure.subplots(1, 2)
    for each, values, what in zip(axes, (errors.resistance, errors.change), ("resistance", "its change"), strict=True):
        known = ~np.isnan(values)
        worst = np.where(known.any(axis=0), np.where(known, values, 0.0).max(axis=0), np.nan)
        image = each.imshow(100.0 * worst, cmap="viridis", vmin=0.0)
        each.set_title(f"{level}: largest error of {what} (%)")
        each.set_xticks(range(len(errors.pins)), errors.pins, rotation=90, fontsize=6)
        each.set_yticks(range(len(errors.pins)), errors.pins, fontsize=6)
        each.grid(visible=False)
        figure.colorbar(image, ax=each, shrink=0.85)
    return figure


def _against_strain(known: Facts) -> Figure:
    """Change of the resistances of some pairs of pins: states as points, what the sub-circuits answer as lines."""
    figure = new_figure(4.5 * len(known.paths), 3.4)
    for axes, path in zip(np.atleast_1d(figure.subplots(1, len(known.paths))), known.paths, strict=True):
        _curves(axes, known, path)
    return figure


def _over_grids(known: Facts) -> Figure:
    """Change of one resistance over the strains of each grid: states as points, what the sub-circuits answer as colour.

    The pair of pins is the one whose resistance changes most.
    """
    figure = new_figure(5.0 * len(known.grids), 3.8)
    for axes, grid in zip(np.atleast_1d(figure.subplots(1, len(known.grids))), known.grids, strict=True):
        own = [known.levels.ports[k] for k in grid.records.ravel()]
        network = ports_network(own, np.arange(float(len(own))))
        on = patches(grid.first, grid.second, network.conductance.reshape(*grid.records.shape, -1))
        exact = np.array([resistances(matrix) for matrix in own])
        relaxed = resistances(known.levels.ports[grid.records[_nearest(grid.first), _nearest(grid.second)]])
        with np.errstate(divide="ignore", invalid="ignore"):
            change = np.where(np.isfinite(exact) & (exact > 0.0), exact / relaxed - 1.0, 0.0)
        _, i, j = np.unravel_index(int(np.argmax(np.abs(change))), change.shape)
        x, y = (np.linspace(strain[0], strain[-1], COARSE) for strain in (grid.first, grid.second))
        ohm = np.array([[resistances(matrix_at(network, value_at(on, a, b)))[i, j] for a in x] for b in y])
        shown = 100 * (ohm / relaxed[i, j] - 1.0)
        edges = 100 * x[0], 100 * x[-1], 100 * y[0], 100 * y[-1]
        image = axes.imshow(shown, origin="lower", extent=edges, aspect="auto", cmap="viridis")
        places = np.array(np.meshgrid(grid.first, grid.second, indexing="ij")).reshape(2, -1)
        axes.scatter(*(100 * places), c=100 * change[:, i, j], cmap="viridis", norm=image.norm, edgecolors="white")
        names = [f"{axis} (%)" for axis in grid.axes]
        axes.set(title=f"{known.levels.pins[i]}, {known.levels.pins[j]}", xlabel=names[0], ylabel=names[1])
        axes.grid(visible=False)
        figure.colorbar(image, ax=axes, label="change of resistance (%)")
    return figure


def _nearest(strain: Floats) -> int:
    """The strain nearest to none."""
    return int(np.argmin(np.abs(strain)))


def _curves(axes: Axes, known: Facts, path: StrainPath) -> None:
    network = ports_network([known.levels.ports[k] for k in path.records], path.strain)
    found = pieces(network.strain, network.conductance)
    fine = np.linspace(path.strain[0], path.strain[-1], FINE)
    exact = np.array([resistances(known.levels.ports[k]) for k in path.records])
    curve = np.array([resistances(matrix_at(network, value(found, strain))) for strain in fine.tolist()])
    for number, (i, j) in enumerate(_typical(exact)):
        label, colour = f"{known.levels.pins[i]}, {known.levels.pins[j]}", COLOURS[number % len(COLOURS)]
        axes.plot(100 * fine, 100 * (curve[:, i, j] / exact[0, i, j] - 1), color=colour, label=label)
        shown = 100 * (exact[:, i, j] / exact[0, i, j] - 1)
        axes.plot(100 * path.strain, shown, MARKERS[number % len(MARKERS)], color=colour, markersize=4)
    axes.set(title=path.word, xlabel="strain (%)", ylabel="change of resistance (%)")
    axes.legend()


def _typical(exact: Floats) -> list[tuple[int, int]]:
    """Pairs from the one that falls most to the one that rises most, evenly by rank."""
    i, j = np.triu_indices(exact.shape[1], 1)
    there = np.flatnonzero(np.isfinite(exact[:, i, j]).all(axis=0))
    order = there[np.argsort(exact[-1, i[there], j[there]] / exact[0, i[there], j[there]], kind="stable")]
    chosen = dict.fromkeys(order[np.linspace(0, len(order) - 1, min(SHOWN, len(order))).round().astype(int)].tolist())
    return [(int(i[k]), int(j[k])) for k in chosen]


def _network(known: Facts) -> Figure:
    """Ry and Rc of the fitted network, medians."""
    figure = new_figure(7.5, 3.2)
    for axes, columns, label in zip(figure.subplots(1, 2), ((0, 1), (2,)), ("Ry (Ω)", "Rc (Ω)"), strict=True):
        for number, path in enumerate(known.paths):
            for column, line in zip(columns, ("-", "--"), strict=False):
                what = f"{path.word}{('', ', weft', '')[column] if len(columns) > 1 else ''}"
                values = known.levels.units[path.records, column]
                axes.plot(100 * path.strain, values, line, color=COLOURS[number % len(COLOURS)], marker="o", label=what)
        axes.set(xlabel="strain (%)", ylabel=label)
        # From zero, or changes in the seventh digit would fill the picture.
        top = float(axes.dataLim.y1)
        axes.set_ylim(0.0, 1.1 * top if 0.0 < top < np.inf else 1.0)
        axes.legend()
    return figure
