"""Figures of a study, drawn with matplotlib's object interface: nothing global is touched."""

from circuittex.results.plot.checks import convergence_figure, verification_figure
from circuittex.results.plot.curves import conductance_figure, force_figure, network_figure
from circuittex.results.plot.gallery import FIGURES, save_figures
from circuittex.results.plot.section import section_figure
from circuittex.results.plot.weave import cell_figure, probe_figure, strained_figure

__all__ = [
    "FIGURES",
    "cell_figure",
    "conductance_figure",
    "convergence_figure",
    "force_figure",
    "network_figure",
    "probe_figure",
    "save_figures",
    "section_figure",
    "strained_figure",
    "verification_figure",
]
