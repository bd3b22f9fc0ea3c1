"""datasheet.html: one page with what each level of a library costs and errs, and what the part stands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.atomic import write_text
from circuittex.electrical.network.ports import resistances
from circuittex.results.records import Study
from circuittex.results.report.number import number
from circuittex.results.report.page import picture
from circuittex.results.report.template import render
from circuittex.study.library.accuracy import Errors
from circuittex.study.library.cell import Cell
from circuittex.study.library.facts import GOOD, Facts
from circuittex.study.library.figures import save_figures
from circuittex.study.library.network import Network, matrix_at
from circuittex.study.library.parts import Part
from circuittex.study.library.reactive import YarnReactances
from circuittex.study.library.reduction import CORNERS
from circuittex.study.library.resistivity import differs

CAPTIONS = {
    "errors_cell": "Largest error of the cell of Ry and Rc at each pair of pins, over all states.",
    "errors_ports_thin": "Largest error of the thinned ports at each pair of pins, over all states.",
    "strain": "Change of the resistance between two pins, all others open: computed states and what the cells answer.",
    "grid": "Change of the resistance between two pins, all others open, under two strains at once: computed states as "
    "points in the colour of their change, what the sub-circuits answer as the colour behind them.",
    "network": "Medians of Ry and Rc of the fitted cell.",
}
NO_GRID = {
    "Two strains at once": "not available: the states under both at once were not computed (a loading of kind 'grid')"
}
NO_CORNERS = {"Corners and Monte Carlo": "not available: the library is made of one study, not of an ensemble"}
NO_TEMPERATURE = {"Temperature coefficient": "not available: the design states no tc1, tc2"}
NO_REACTANCE = {"Capacitance, inductance": "not asked for: circuittex export --reactive"}
MISSING = {
    "Power rating": "the rated current squared times the resistance of the probe",
}


def write_datasheet(
    folder: Path,
    study: Study,
    known: Facts,
    cells: Sequence[Cell],
    networks: Mapping[str, Network],
    parts: Sequence[Part],
    yarns: YarnReactances | None,
) -> Path:
    """Draw the figures into ``folder/figures`` and write ``folder/datasheet.html``; returns its path."""
    pictures = save_figures(known, folder / "figures")
    path = folder / "datasheet.html"
    text = render(
        "datasheet.html",
        "circuittex.study.library",
        title=study.design.name,
        known=_facts(study, known),
        kind="good",
        sentences=[_recommendation(known)],
        errors=_errors(known),
        left_out=_left_out(known),
        cells=_cells(cells, networks),
        ratings=_ratings(study, known),
        rise=number(known.rise),
        cooling=_cooling(study),
        warmth=_warmth(parts),
        reactances=_reactances(known, yarns),
        missing=_missing(study, known) | (NO_REACTANCE if yarns is None else {}),
        figures=[picture(CAPTIONS[name], png) for name, png in pictures.items()],
        version=study.version,
    )
    write_text(path, str(text))
    return path


def _cooling(study: Study) -> str:
    """How heat leaves, in words."""
    electrical = study.design.electrical
    ends = electrical.thermal_ends
    how = (
        f"have {ends:g} K/W each"
        if not isinstance(ends, str)
        else f"are {'insulated' if ends == 'insulated' else 'cold'}"
    )
    if electrical.heat_loss or electrical.emissivity:
        h, e = electrical.heat_loss, electrical.emissivity
        return f"Heat leaves along the yarns (h = {h:g} W/(mm2 K), emissivity {e:g}) and at their ends, which {how}."
    if ends != "cold":
        return f"Heat leaves at the yarn ends alone, which {how}: air would take more away."
    return (
        "As in the paper's model, heat leaves through the fibril ends alone, all of which stay as cool as the "
        "surroundings: air would take more away, and warm ends less."
    )


def _missing(study: Study, known: Facts) -> dict[str, str]:
    corners = {} if any(each.end in CORNERS for each in known.reductions) else NO_CORNERS
    grids = {} if known.grids else NO_GRID
    return corners | grids | ({} if differs(study.design, "tc1", "tc2") else NO_TEMPERATURE) | MISSING


def _reactances(known: Facts, yarns: YarnReactances | None) -> dict[str, Any]:
    """Inductance of each yarn, its largest capacitance to another, and where they come to count beside resistance."""
    head = ["yarn", "inductance (nH)", "largest capacitance to another yarn (fF)", "to", "R / (2 pi L) (MHz)"]
    rows: list[list[str]] = []
    if yarns is None:
        return {"head": head, "rows": rows}
    names = [end.removesuffix("_minus") for end in yarns.ends[::2]]
    n = len(names)
    farad = np.array(yarns.farad).reshape(n, 2, n, 2).sum(axis=(1, 3))
    np.fill_diagonal(farad, 0.0)
    port = known.levels.ports[0]
    for k, name in enumerate(names):
        nearest, corner = int(np.argmax(farad[k])), "-"
        ends = [f"{name}_minus", f"{name}_plus"]
        if set(ends) <= set(port.ports):
            i, j = (port.ports.index(each) for each in ends)
            G = np.delete(np.delete(port.conductance, j, axis=0), j, axis=1)
            ohm = float(np.linalg.pinv(G)[i - (i > j), i - (i > j)])
            corner = number(1e-6 * ohm / (2 * np.pi * yarns.henry[k]), 3)
        capacitance = number(1e15 * farad[k, nearest], 3) if n > 1 else "-"
        rows.append([name, number(1e9 * yarns.henry[k], 3), capacitance, names[nearest] if n > 1 else "-", corner])
    return {"head": head, "rows": rows}


def _warmth(parts: Sequence[Part]) -> dict[str, Any]:
    """Resistance between the first two pins that are joined against temperature, by each part without strain."""
    kelvin = (-50.0, -25.0, 0.0, 25.0, 50.0)
    rows = []
    for part in parts:
        network = part.network
        if len(network.tc) and not part.path and not part.end and part.level != "detailed":
            tc1, tc2 = network.tc.T
            warm = [network.conductance[0] / (1 + tc1 * dT + tc2 * dT**2) for dT in kelvin]
            ohm = [resistances(matrix_at(network, each))[0] for each in warm]
            joined = int(np.flatnonzero(np.isfinite(ohm[0]) & (ohm[0] > 0.0))[0])
            drift = "" if np.isnan(part.drift) else f"{part.drift:.1e}"
            pins = f"{network.pins[0]}, {network.pins[joined]}"
            rows.append([part.name, pins, *(number(float(each[joined])) for each in ohm), drift])
    head = ["sub-circuit", "pins", *(f"{27 + dT:g} °C (Ω)" for dT in kelvin), "error of R(T)/R(27 °C), worst"]
    return {"head": head, "rows": rows}


def _facts(study: Study, known: Facts) -> dict[str, str]:
    return {
        "Design hash": study.design_hash,
        "Recorded states": str(len(study.records)),
        "Yarn ends": known.ends,
        "Pins": ", ".join(known.levels.pins),
        "Strain": "; ".join(
            [
                *(f"{path.word}: {_range(path.strain)}, {len(path.strain)} states" for path in known.paths),
                *(
                    f"{grid.axes[0]}: {_range(grid.first)}, with {grid.axes[1]}: {_range(grid.second)}, "
                    f"{len(grid.first)} x {len(grid.second)} states"
                    for grid in known.grids
                ),
            ]
        )
        or "one state only: strain is no input",
    } | _tolerance(known)


def _tolerance(known: Facts) -> dict[str, str]:
    if known.tolerance is None:
        return {}
    low, high = (number(100 * each, 3) for each in known.tolerance)
    return {"Tolerance": f"resistances between pins lie within {low} % and +{high} % of those stated (tmin, tmax)"}


def _range(strain: Floats) -> str:
    return f"{100 * strain[0]:.4g} % to {100 * strain[-1]:.4g} %"


def _recommendation(known: Facts) -> str:
    if known.recommended == "cell":
        return f"Recommended: cell. It errs by at most {100 * GOOD:g} % at every pair of pins in every state."
    why = known.levels.reason or f"the cell of Ry and Rc errs by more than {100 * GOOD:g} %"
    return f"Recommended: ports, which are exact; {why}."


def _errors(known: Facts) -> dict[str, Any]:
    head = ["level", "resistance, worst", "median", "change, worst", "median"]
    return {"head": head, "rows": [_row(level, errors) for level, errors in known.errors.items()]}


def _left_out(known: Facts) -> dict[str, Any]:
    head = ["path", "resistance, worst", "median", "change, worst", "median"]
    return {"head": head, "rows": [_row(word, errors) for word, errors in known.left_out.items()]}


def _row(name: str, errors: Errors) -> list[str]:
    (R, c), (Rm, cm) = errors.worst, errors.median
    return [name, *(f"{number(100 * each, 3)} %" for each in (R, Rm, c, cm))]


def _cells(cells: Sequence[Cell], networks: Mapping[str, Network]) -> dict[str, Any]:
    """The sub-circuits with what they cost: a transient's time goes with the number of resistors, or faster."""
    rows = []
    for name, network in networks.items():
        own = [cell for cell in cells if cell.name == name]
        if own:
            folders = ", ".join(cell.dialect for cell in own)
            rows.append([name, own[0].title, str(len(network.names)), folders])
    return {"head": ["sub-circuit", "what it is", "resistors", "folders"], "rows": rows}


def _ratings(study: Study, known: Facts) -> dict[str, Any]:
    """Smallest rated current of each probe over the states."""
    rows = []
    for probe, column in zip(study.design.probes, known.rated.T, strict=True):
        there = ~np.isnan(column)
        if there.any():
            k = int(np.flatnonzero(there)[np.argmin(column[there])])
            rows.append([probe.name, f"{number(float(column[k]))} A", study.records[k].name])
    return {"head": ["probe", "current", "in state"], "rows": rows}
