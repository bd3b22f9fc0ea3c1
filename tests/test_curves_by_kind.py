"""Ry of each kind of yarn and Rc of each pair of kinds, in figures, tables, summary and report."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from synthetic_study import synthetic_study

from circuittex.design import Material, Yarn
from circuittex.fit import network_names
from circuittex.geometry.weave import build_mesh
from circuittex.results.discretisation import ErrorEstimate, QuantityError
from circuittex.results.plot.curves import network_figure
from circuittex.results.records import Record, Study
from circuittex.results.report.page import page
from circuittex.results.store import load_study, write_study_start
from circuittex.results.summary import insulated_resistances, summary, table
from circuittex.study.ensemble.quantities import measure, quantities

NAMES = ("Ry good warp", "Ry poor warp", "Ry good weft", "Rc good x good", "Rc good x poor")
OHMS = np.array([0.3, 6.0, 0.31, 200.0, 5000.0])
FALL = np.array([0.0, 0.0, 0.1, 2.0, 4.0])
"""Share by which a resistance falls over a strain of 1."""


def ohms(record: Record) -> np.ndarray:
    return OHMS * (1.0 - FALL * record.strain)


def mixed() -> Study:
    """Warp yarns of a good and a poor conductor in turn, weft yarns of the good one but for one that insulates."""
    study = synthetic_study(3, contacts=5, rows=(1,), loadings=("stretch", "shear"))
    conductivity = {"good": 100.0, "poor": 5.0, "none": 0.0}
    good, poor, none = (
        Yarn(name, (1,), 0.15, 0.3, 0.3, (Material(name, 10.0, 0.0, 1.0, sigma, 1.0),))
        for name, sigma in conductivity.items()
    )
    weave = replace(study.design.weave, warp=(good, poor, good, poor), weft=(good, none, good, good))
    design = replace(study.design, weave=weave)
    records = []
    for record in study.records:
        values = ohms(record)
        crossings = np.where([[True], [False], [True], [False]], values[3], values[4]) * np.ones((4, 4))
        crossings[:, 1] = np.inf
        fit = replace(
            record.fit,
            method="all-pairs",
            Ry=np.nan,
            kinds=tuple(name[3:] for name in NAMES[:3]),
            kind_resistance=values[:3],
            pairs=tuple(name[3:] for name in NAMES[3:]),
            pair_resistance=values[3:],
            yarns=np.array([*values[[0, 1, 0, 1, 2]], np.inf, *values[[2, 2]]]),
            crossings=crossings,
        )
        records.append(replace(record, fit=fit))
    return replace(study, design=design, mesh=build_mesh(design), records=tuple(records))


STUDY = mixed()
INSULATED = {name: 2.0 / (sigma * np.pi * 0.15**2) for name, sigma in zip(NAMES, (100.0, 5.0, 100.0), strict=False)}
"""L / (sigma A) of a segment of one fibril, ohm."""


def curves(axes: Axes) -> dict[str, list[tuple[float, float]]]:
    """Legend -> the points of each curve."""
    lines = [line for line in axes.lines if len(line.get_xdata()) > 2 or line.get_linestyle() == "--"]
    return {str(line.get_label()): [tuple(map(float, point)) for point in line.get_xydata()] for line in lines}


def test_names_follow_from_the_design() -> None:
    assert network_names(STUDY.design) == (NAMES[:3], NAMES[3:])


def test_each_kind_and_each_pair_of_kinds_has_a_panel_with_its_own_curves() -> None:
    panels = network_figure(STUDY).axes
    assert [axes.get_title().replace("\n", ", ") for axes in panels] == [
        *("yarn segment, good warp", "yarn segment, poor warp", "yarn segment, good weft"),
        *("crossing, good x good", "crossing, good x poor"),
    ]
    assert [axes.get_ylabel() for axes in panels] == ["Ry (Ω)"] * 3 + ["Rc (Ω)"] * 2
    for number, (name, axes) in enumerate(zip(NAMES, panels, strict=True)):
        drawn = curves(axes)
        for loading in ("stretch", "shear"):
            shown = [r for r in STUDY.records if r.loading in ("", loading)]
            assert drawn[loading] == [(r.strain, pytest.approx(ohms(r)[number])) for r in shown]
        assert (f"insulated, {INSULATED.get(name, np.nan):.4g} Ω" in drawn) == (name in INSULATED)


def test_insulated_yarns_are_compared_kind_by_kind() -> None:
    assert insulated_resistances(STUDY.design, STUDY.mesh, NAMES) == pytest.approx(INSULATED)


def test_error_bars_stand_at_their_own_kind() -> None:
    rest = STUDY.records[0]
    force = rest.clamp_force[0, 0], rest.clamp_force[1, 1]
    names = ["Fx warp", "Fy weft", *(f"I {probe.name}" for probe in STUDY.design.probes), *NAMES]
    values = [*force, *rest.currents, *ohms(rest)]
    found = [
        QuantityError(name, "", v, v, v, v * (1 + 0.001 * k))
        for k, (name, v) in enumerate(zip(names, values, strict=True))
    ]
    estimate = ErrorEstimate(rest.name, (1, 2, 4), (4, 8), np.zeros(3), tuple(found), ())
    study = replace(STUDY, errors=(estimate,))
    for number, axes in enumerate(network_figure(study).axes):
        (bar,) = {
            tuple(line.get_ydata()) for line in axes.lines if line.get_zorder() == 1.9 and len(line.get_xdata()) == 2
        }
        half = 0.001 * (number + 5) * 1.25 * 4 / 3 * ohms(rest)[number]
        assert bar == pytest.approx((ohms(rest)[number] - half, ohms(rest)[number] + half))
    row = next(line for line in table(study).splitlines() if "estimated error" in line)
    assert row.split("±")[-1].split()[0] == f"{100 * 0.001 * 9 * 1.25 * 4 / 3:.2g}"


def test_table_summary_and_report_list_every_kind(tmp_path: Path) -> None:
    head, first = table(STUDY).splitlines()[:2]
    for name, ohm in zip(NAMES, OHMS, strict=True):
        assert f"{name} ohm" in head
        assert f"{ohm:#.4g}" in first
    network = json.loads(json.dumps(summary(STUDY)))["states"][1]["network"]
    assert list(network["Ry_ohm"].values()) == pytest.approx(ohms(STUDY.records[1])[:3])
    assert list(network["Rc_ohm"]) == ["good x good", "good x poor"]
    assert list(network["insulated_Ry_ohm"].values()) == pytest.approx(list(INSULATED.values()))
    text = page(STUDY, {})
    part = text[text.index("<h2>Reduced network") : text.index("<h2>Verification")]
    assert re.findall(r'<th scope="col">(R[yc] .*?)</th>', part) == [f"{name} (Ω)" for name in NAMES]
    assert "<td>0.3</td><td>6</td><td>0.31</td><td>200</td><td>5000</td>" in part
    assert "(poor warp)" in part
    write_study_start(tmp_path / "results.h5", STUDY)
    assert load_study(tmp_path / "results.h5").records[1].outcome.network == pytest.approx(ohms(STUDY.records[1]))


def test_an_ensemble_measures_every_kind() -> None:
    names = [quantity.name for quantity in quantities(STUDY.design)]
    assert names[-5:] == [name.replace(" ", "_") for name in NAMES]
    assert measure(STUDY.design, STUDY.records[0])[-5:] == pytest.approx(OHMS)
