"""ensemble.html: one self-contained page with the bands of an ensemble and the list of its members."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from circuittex.results.report.number import number
from circuittex.results.report.page import picture
from circuittex.results.report.template import render
from circuittex.study.ensemble.result import BANDS, Ensemble, percentiles

CAPTIONS = {
    "forces": "Total force of the clamps on the +x ends of the warp and on the +y ends of the weft, by component.",
    "currents": "Current of each probe; the voltage of one that is driven by a current.",
    "network": "Resistance Ry of a yarn segment between two crossings, and Rc of a crossing.",
}


def page(ensemble: Ensemble, pictures: Mapping[str, bytes]) -> str:
    """The whole page as text; `pictures` are PNG files by the names of `band_figures`."""
    kind, sentences = _verdict(ensemble)
    return str(
        render(
            "ensemble.html",
            "circuittex.study.ensemble",
            title=ensemble.design.name,
            members=len(ensemble.seeds),
            known=_facts(ensemble),
            kind=kind,
            sentences=sentences,
            figures=[picture(CAPTIONS[name], png) for name, png in pictures.items()],
            bands=_bands(ensemble),
            listed=_members(ensemble),
            version=ensemble.version,
        )
    )


def _facts(ensemble: Ensemble) -> dict[str, str]:
    packing = ensemble.design.packing
    return {
        "Design hash": ensemble.design_hash,
        "Seed": str(packing.seed),
        "Start": ensemble.start,
        "Lateral offsets": f"{packing.lateral:.4g} mm",
        "Vertical offsets": f"{packing.vertical:.4g} mm",
        "Twist of the yarns": f"{1e3 * packing.twist:.4g} turns/m",
        "Phase of the yarns": f"{packing.phase:.4g} mm",
    }


def _verdict(ensemble: Ensemble) -> tuple[str, list[str]]:
    """How many members are complete, and whether their routes agree, for a box that cannot be overlooked."""
    total, finished = len(ensemble.seeds), ensemble.finished
    sentences = [f"{finished} of {total} members have all their states."]
    if finished < total:
        sentences.append("The others count in the states that they have; the list of members says why they ended.")
    differing = sum(bool(states) for states in ensemble.disagreeing)
    if differing:
        sentences.append(f"In {differing} members the routes to the currents DISAGREE: do not trust these results.")
    return "good" if finished == total and not differing else "bad", sentences


def _bands(ensemble: Ensemble) -> dict[str, Any]:
    bands = percentiles(ensemble.values, BANDS)
    rows = [
        [state, f"{quantity.name} ({quantity.unit})", *map(number, bands[:, s, q]), str(ensemble.count[s, q])]
        for s, state in enumerate(ensemble.states)
        for q, quantity in enumerate(ensemble.quantities)
    ]
    return {"head": ["state", "quantity", *(f"{percent:g} %" for percent in BANDS), "members"], "rows": rows}


def _members(ensemble: Ensemble) -> dict[str, Any]:
    rows = []
    for member, seed in enumerate(ensemble.seeds):
        outcome = ensemble.failures[member] or "all states"
        if ensemble.disagreeing[member]:
            outcome += "; routes DISAGREE in " + ", ".join(ensemble.disagreeing[member])
        rows.append([f"{member:04d}", str(seed), outcome])
    return {"head": ["member", "seed", "outcome"], "rows": rows}
