"""All figures of a study."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from circuittex.plot.curves import (
    conductance_figure,
    convergence_figure,
    force_figure,
    network_figure,
    verification_figure,
)
from circuittex.plot.section import section_figure
from circuittex.plot.style import save
from circuittex.plot.weave import cell_figure, probe_figure
from circuittex.results import Study

FIGURES: dict[str, Callable[[Study], Figure]] = {
    "cell": lambda study: cell_figure(study, study.records[0]),
    "section": lambda study: section_figure(study, study.records[0]),
    "currents": lambda study: probe_figure(study, study.records[-1], "current"),
    "temperatures": lambda study: probe_figure(study, study.records[-1], "temperature"),
    "forces": force_figure,
    "probes": conductance_figure,
    "network": network_figure,
    "verification": verification_figure,
    "convergence": convergence_figure,
}
"""Name -> what draws it; all of them need at least one record."""
NEED_PROBES = {"currents", "temperatures", "probes", "network", "convergence"}


def save_figures(study: Study, folder: str | Path) -> dict[str, Path]:
    """Draw every figure into `folder` as PNG and SVG; returns the PNG file of each by name.

    Those of the probes are left out where the design has none.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    names = [name for name in FIGURES if study.design.probes or name not in NEED_PROBES]
    return {name: save(FIGURES[name](study), folder, name)[0] for name in names}
