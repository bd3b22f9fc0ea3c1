"""What stands under the figures of the report."""

from __future__ import annotations

from circuittex.results.claims import parameter_set
from circuittex.results.records import Study

_CAPTIONS = {
    "cell": "The relaxed cell. Colour: magnitude of the force a fibril's section carries.",
    "section": "A centre yarn before and after relaxation, cut across at a crossing (left) and along (right): do the "
    "rows of fibrils (filled circles) settle into fewer levels?",
    "forces": "Total force of the clamps on the +x ends of the warp and on the +y ends of the weft, by component.",
    "strained": "The cell at the largest strain of each loading path, all to one scale of length. Colour: magnitude of "
    "the force a fibril's section carries.",
    "probes": "Current of each probe against strain.",
    "currents": "Current along the fibrils {where}, one picture for each probe, each on its own scale of colour. Plus "
    "marks the source, minus the sink.",
    "temperatures": "Temperature rise from Joule heating {where}, each probe on its own scale of colour.",
    "network": "The reduced network: resistance Ry of a yarn segment between two crossings (dashed: the same yarn "
    "without any contacts) and Rc of a crossing; where there are several kinds of yarn, for each kind and for each "
    "pair that crosses (the median of its crossings).",
    "verification": "Largest differences between the independent routes to the same voltages and currents, and what "
    "merging contacts and the finite-element mesh change.",
    "convergence": "The potential on the mesh of the mechanics, and on two refinements of it, converges to the "
    "circuit: largest relative error of a probe current in the relaxed state.",
}
_CURVES = {
    "forces": "of the force along the yarns",
    "probes": "of the currents",
    "network": "of Ry and Rc",
}
"""Figure of curves against strain -> what its error bars belong to."""
_FIGURES_OF_THE_PAPER = {
    "cell": "9 (right)",
    "section": "10",
    "forces": "11",
    "strained": "12",
    "probes": "11",
    "currents": "13",
    "temperatures": "14",
    "network": "15",
}


def captions(study: Study) -> dict[str, str]:
    """Figure -> what it shows; for the paper's cell with the number of the paper's figure of the same."""
    strained = any(record.loading for record in study.records)
    where = "at the largest strain of each loading path" if strained else "of the relaxed cell"
    texts = {name: text.format(where=where) for name, text in _CAPTIONS.items()}
    if study.errors:
        for name, what in _CURVES.items():
            texts[name] += (
                f" Bars: the estimated discretisation error {what}, in the relaxed state and the last one of each "
                "loading path; one too long for the picture ends in an arrow head, with its size."
            )
    if any(check.bifurcation for check in study.branches):
        for name in _CURVES:
            texts[name] += " Open diamonds: the other branch of a bifurcation."
    if parameter_set(study.design) is None:
        return texts
    paper = _FIGURES_OF_THE_PAPER
    return {
        name: f"{text} Figure {paper[name]} of the paper." if name in paper else text for name, text in texts.items()
    }
