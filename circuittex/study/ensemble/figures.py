"""Bands of forces, currents, Ry and Rc against strain, one row of panels for each loading path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from circuittex.base.arrays import Floats, Ints
from circuittex.design.packing import Packing
from circuittex.fit import network_names
from circuittex.geometry.weave import build_mesh
from circuittex.results.plot.style import COLOURS, GREY, new_figure, save, style
from circuittex.results.summary import insulated_resistances
from circuittex.study.ensemble.quantities import SIDES
from circuittex.study.ensemble.result import BANDS, Ensemble, percentiles
from circuittex.study.plan import plan

MOST_LINES = 40
"""Members up to which each is drawn as a line of its own."""
ENDS = {"warp": "+x ends of the warp", "weft": "+y ends of the weft"}

Panel = tuple[str, str, Sequence[tuple[str, str]]]
"""Title, label of the axis, and quantities with their labels."""


def band_figures(ensemble: Ensemble) -> dict[str, Figure]:
    """The figures by name: forces, and where the design has probes, currents and network."""
    known = {quantity.name for quantity in ensemble.quantities}
    rows: dict[str, list[Panel]] = {
        "forces": [(f"clamps at the {ENDS[s]}", "force (N)", [(f"{s}_F{c}", f"F{c}") for c in "xyz"]) for s in SIDES],
        "currents": [
            (f"probe {probe.name}", f"current at {probe.drive} (A)", [(f"current_{probe.name}", "")])
            if probe.current is None
            else (f"probe {probe.name}", f"voltage at {probe.drive} (V)", [(f"voltage_{probe.name}", "")])
            for probe in ensemble.design.probes
        ],
        "network": [
            (f"{part}{name[2:]}", f"{name[:2]} (Ω)", [(name.replace(" ", "_"), "")])
            for part, names in zip(("yarn segment", "crossing"), network_names(ensemble.design), strict=True)
            for name in names
        ],
    }
    return {
        name: _figure(ensemble, panels)
        for name, panels in rows.items()
        if panels and all(quantity in known for _, _, shown in panels for quantity, _ in shown)
    }


def save_bands(ensemble: Ensemble, folder: Path) -> dict[str, Path]:
    """Draw all figures into `folder` as PNG and SVG; returns the PNG file of each by name."""
    folder.mkdir(parents=True, exist_ok=True)
    return {name: save(figure, folder, name)[0] for name, figure in band_figures(ensemble).items()}


def _figure(ensemble: Ensemble, panels: Sequence[Panel]) -> Figure:
    loadings = list(dict.fromkeys(name for name in ensemble.loadings if name)) or [""]
    column = {quantity.name: number for number, quantity in enumerate(ensemble.quantities)}
    with style():
        figure = new_figure(max(3.1 * len(panels), 4.0), 2.9 * len(loadings))
        for row, loading in enumerate(loadings):
            states, strains = _along(ensemble, loading)
            for place, (title, label, shown) in enumerate(panels):
                axes = figure.add_subplot(len(loadings), len(panels), row * len(panels) + place + 1)
                for colour, (quantity, name) in enumerate(shown):
                    values = ensemble.values[:, states, column[quantity]]
                    # the panels of one quantity have the colours of their place, as in the report of a study
                    number = colour if len(shown) > 1 else place
                    draw_band(axes, strains, values, COLOURS[number % len(COLOURS)], name)
                if shown[0][0].partition("_")[0] == "Ry":
                    _draw_insulated(axes, ensemble, shown[0][0])
                _widen(axes)
                axes.set_title(title)
                axes.set_ylabel(label)
                axes.set_xlabel(f"strain ({loading})" if loading else "strain")
                if any(not text.startswith("_") for text in axes.get_legend_handles_labels()[1]):
                    axes.legend()
    return figure


def _along(ensemble: Ensemble, loading: str) -> tuple[Ints, Floats]:
    """The states of a loading path and their strains: 0 for the state that it starts from."""
    own = np.flatnonzero([name == loading for name in ensemble.loadings])
    if not loading:
        return own, ensemble.strains[own]
    start = next(step.previous for step in plan(ensemble.design) if step.loading == loading)
    return np.append(ensemble.states.index(start), own), np.append(0.0, ensemble.strains[own])


def _draw_insulated(axes: Axes, ensemble: Ensemble, quantity: str) -> None:
    """A dashed line at the Ry of the same yarns without contacts [57], which no packing changes."""
    mesh = build_mesh(replace(ensemble.design, packing=Packing()))
    for name, ohm in insulated_resistances(ensemble.design, mesh, network_names(ensemble.design)[0]).items():
        if name.replace(" ", "_") == quantity and np.isfinite(ohm):
            axes.axhline(ohm, color=GREY, linestyle="--", linewidth=1.0, label=f"insulated, {ohm:.4g} Ω")


def _widen(axes: Axes) -> None:
    """Make the axis at least 2 % of its values high, lest differences in the sixth digit fill it."""
    low, high = axes.get_ylim()
    spare = (0.02 * max(abs(low), abs(high)) - (high - low)) / 2.0
    if spare > 0.0:
        axes.set_ylim(low - spare, high + spare)


def draw_band(axes: Axes, strain: Floats, values: Floats, colour: str, label: str) -> None:
    """The median of `values` (M, S) as a line, bands of 25 to 75 % and 5 to 95 %, and faintly the members."""
    finite = np.where(np.isfinite(values), values, np.nan)
    p5, p25, p50, p75, p95 = percentiles(finite, BANDS)
    if len(strain) == 1:
        axes.vlines(strain, p5, p95, color=colour, alpha=0.35, linewidth=4)
        axes.vlines(strain, p25, p75, color=colour, alpha=0.5, linewidth=9)
    for part in monotone(strain):
        for low, high, alpha in ((p5, p95, 0.18), (p25, p75, 0.3)):
            axes.fill_between(strain[part], low[part], high[part], color=colour, alpha=alpha, linewidth=0)
    if len(values) <= MOST_LINES:
        axes.plot(strain, finite.T, color=colour, alpha=0.25, linewidth=0.5)
    axes.plot(strain, p50, marker="o", markersize=3, linewidth=1.2, color=colour, label=label)
    if not np.isfinite(values).any():
        axes.text(0.5, 0.5, "infinite or not determined", ha="center", va="center", transform=axes.transAxes)


def monotone(strain: Floats) -> list[Ints]:
    """The places of `strain` cut where it turns back, each turning point in both parts: bands would fold there.

    >>> [part.tolist() for part in monotone(np.array([0.0, 0.1, 0.2, 0.1]))]
    [[0, 1, 2], [2, 3]]
    """
    direction = np.sign(np.diff(strain))
    turns = np.flatnonzero(direction[1:] * direction[:-1] < 0) + 1
    edges = [0, *turns.tolist(), len(strain) - 1]
    return [np.arange(a, b + 1) for a, b in pairwise(edges)]
