"""All figures of a study."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from circuittex.results.loadings import by_loading, farthest
from circuittex.results.plot.checks import convergence_figure, verification_figure
from circuittex.results.plot.curves import conductance_figure, force_figure, network_figure
from circuittex.results.plot.section import section_figure
from circuittex.results.plot.style import save
from circuittex.results.plot.weave import cell_figure, probe_figure, strained_figure
from circuittex.results.records import Record, Study

FIGURES: dict[str, Callable[[Study], Figure]] = {
    "cell": lambda study: cell_figure(study, study.records[0]),
    "section": lambda study: section_figure(study, study.records[0]),
    "forces": force_figure,
    "strained": strained_figure,
    "probes": conductance_figure,
    "currents": lambda study: probe_figure(study, _farthest(study), "current"),
    "temperatures": lambda study: probe_figure(study, _farthest(study), "temperature"),
    "network": network_figure,
    "verification": verification_figure,
    "convergence": convergence_figure,
}
"""Name -> what draws it; all of them need at least one record."""
NEED_PROBES = {"currents", "temperatures", "probes", "network", "convergence"}
NEED_LOADING = {"strained"}


def save_figures(study: Study, folder: str | Path) -> dict[str, Path]:
    """Draw every figure into `folder` as PNG and SVG; returns the PNG file of each by name.

    Those of the probes are left out where the design has none, that of strained cells where nothing is strained.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    unwanted = set() if study.design.probes else NEED_PROBES
    unwanted |= set() if any(record.loading for record in study.records) else NEED_LOADING
    return {name: save(draw(study), folder, name)[0] for name, draw in FIGURES.items() if name not in unwanted}


def _farthest(study: Study) -> tuple[Record, ...]:
    return tuple(farthest(records) for records in by_loading(study).values())
