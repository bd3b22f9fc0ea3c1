"""ensemble.html: one self-contained page with the bands of an ensemble and the list of its members."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from html import escape
from string import Template

from circuittex.results.report.frame import PAGE as REPORT_PAGE
from circuittex.results.report.table import number, table
from circuittex.study.ensemble.result import BANDS, Ensemble, percentiles

STYLE = REPORT_PAGE.partition("<style>")[2].partition("</style>")[0]
"""The look of a study's report."""
CAPTIONS = {
    "forces": "Total force of the clamps on the +x ends of the warp and on the +y ends of the weft, by component.",
    "currents": "Current of each probe.",
    "network": "Resistance Ry of a yarn segment between two crossings, and Rc of a crossing.",
}
FRAME = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title - ensemble - circuittex</title>
<style>$style</style>
</head>
<body>
<h1>$title: $members packings</h1>
$facts
$verdict
<h2>Bands against strain</h2>
<p>Line: median. Dark band: from the 25th to the 75th percentile, light band: from the 5th to the 95th, thin lines: the
members. Percentiles lie linearly between the ordered values (NumPy's method "linear"); with few members the outer ones
are close to the smallest and largest value found.</p>
$figures
<h2>Table</h2>
$table
<h2>Members</h2>
$list
<footer>Written by circuittex $version. The table is also in ensemble.csv, every member's numbers are in ensemble.json,
and its own report is in members.</footer>
</body>
</html>
"""


def page(ensemble: Ensemble, pictures: Mapping[str, bytes]) -> str:
    """The whole page as text; `pictures` are PNG files by the names of `band_figures`."""
    return Template(FRAME).substitute(
        style=STYLE,
        title=escape(ensemble.design.name),
        members=str(len(ensemble.seeds)),
        facts=_facts(ensemble),
        verdict=_verdict(ensemble),
        figures="".join(_figure(CAPTIONS[name], png) for name, png in pictures.items()),
        table=_bands(ensemble),
        list=_members(ensemble),
        version=escape(ensemble.version),
    )


def _facts(ensemble: Ensemble) -> str:
    packing = ensemble.design.packing
    facts = {
        "Design hash": ensemble.design_hash,
        "Seed": str(packing.seed),
        "Lateral offsets": f"{packing.lateral:.4g} mm",
        "Vertical offsets": f"{packing.vertical:.4g} mm",
        "Twist of the yarns": f"{1e3 * packing.twist:.4g} turns/m",
        "Phase of the yarns": f"{packing.phase:.4g} mm",
    }
    listed = "".join(f"<dt>{escape(key)}</dt><dd>{escape(value)}</dd>" for key, value in facts.items())
    return f"<dl>{listed}</dl><p>Offsets, twist and phase are standard deviations of normal distributions.</p>"


def _verdict(ensemble: Ensemble) -> str:
    """How many members are complete, and whether their routes agree, as a box that cannot be overlooked."""
    total, finished = len(ensemble.seeds), ensemble.finished
    sentences = [f"{finished} of {total} members have all their states."]
    if finished < total:
        sentences.append("The others count in the states that they have; the list of members says why they ended.")
    differing = sum(bool(states) for states in ensemble.disagreeing)
    if differing:
        sentences.append(f"In {differing} members the routes to the currents DISAGREE: do not trust these results.")
    kind = "good" if finished == total and not differing else "bad"
    return f'<div class="{kind}">' + "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences) + "</div>"


def _figure(caption: str, png: bytes) -> str:
    data = base64.b64encode(png).decode("ascii")
    image = f'<img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
    return f"<figure>{image}<figcaption>{escape(caption)}</figcaption></figure>"


def _bands(ensemble: Ensemble) -> str:
    parts = percentiles(ensemble.values, BANDS)
    rows = [
        [state, f"{quantity.name} ({quantity.unit})", *map(number, parts[:, s, q]), str(ensemble.count[s, q])]
        for s, state in enumerate(ensemble.states)
        for q, quantity in enumerate(ensemble.quantities)
    ]
    return table(["state", "quantity", *(f"{percent:g} %" for percent in BANDS), "members"], rows)


def _members(ensemble: Ensemble) -> str:
    rows = []
    for member, seed in enumerate(ensemble.seeds):
        outcome = ensemble.failures[member] or "all states"
        if ensemble.disagreeing[member]:
            outcome += "; routes DISAGREE in " + ", ".join(ensemble.disagreeing[member])
        rows.append([f"{member:04d}", str(seed), outcome])
    return table(["member", "seed", "outcome"], rows)
