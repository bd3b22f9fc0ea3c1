"""Legal designs in which next to nothing conducts: a whole study computes them, and says so."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fabrics import small_cell

from circuittex.base.frozen import same
from circuittex.design import Design, Yarn, plain_weave
from circuittex.results.records import Study
from circuittex.results.store import load_study
from circuittex.results.summary import table
from circuittex.study.run import run_study


def tiny() -> Design:
    """Two by two yarns of one fibril with few elements: relaxed in a second."""
    design = plain_weave(yarns=2, rows=(1,))
    return replace(design, numerics=replace(design.numerics, elements=4))


def insulating(yarn: Yarn) -> Yarn:
    materials = tuple(replace(m, name="insulating", electrical_conductivity=0.0) for m in yarn.materials)
    return replace(yarn, name="insulating", materials=materials)


def without_probes() -> Design:
    return replace(tiny(), probes=())


def with_an_insulating_yarn() -> Design:
    """That of the common sink of all probes: all currents are rounding."""
    design = tiny()
    (((name, _),),) = {terminal.ends for terminal in design.terminals if terminal.name == design.probes[0].sink}
    at = int(name.removeprefix("warp")) - 1
    warp = tuple(insulating(yarn) if i == at else yarn for i, yarn in enumerate(design.weave.warp))
    return replace(design, weave=replace(design.weave, warp=warp))


def of_insulating_yarns() -> Design:
    design = tiny()
    weave = design.weave
    yarns = {"warp": tuple(map(insulating, weave.warp)), "weft": tuple(map(insulating, weave.weft))}
    return replace(design, weave=replace(weave, **yarns))


def without_contact_conduction() -> Design:
    """sigma_c = 0 with the probes across yarns only."""
    design = tiny()
    return replace(design, contact=replace(design.contact, conductivity=0.0), probes=design.probes[1:])


def computed(design: Design, folder: Path) -> tuple[Study, dict[str, Any]]:
    study = run_study(design, folder)
    assert same(load_study(folder / "results.h5"), study)
    assert "</html>" in (folder / "report.html").read_text("utf-8")
    content = json.loads((folder / "summary.json").read_text("utf-8"), parse_constant=pytest.fail)
    return study, content["states"][0]


def test_a_design_without_probes(tmp_path: Path) -> None:
    study, state = computed(without_probes(), tmp_path)
    assert state["currents_A"] == []
    assert (state["Ry_ohm"], state["Rc_ohm"]) == (None, None)
    assert not state["verification"]["confirmed"]
    assert table(study).endswith("The design has no probes: there are no currents to confirm.")
    report = (tmp_path / "report.html").read_text("utf-8")
    assert 'class="bad"' in report
    assert "DISAGREE" not in report


@pytest.mark.parametrize(
    ("design", "Ry", "Rc", "warning"),
    [
        (with_an_insulating_yarn, np.nan, np.nan, "the probe currents say nothing"),
        (of_insulating_yarns, np.nan, np.nan, "no yarn conducts"),
        (without_contact_conduction, np.nan, np.inf, "the crossings do not conduct"),
    ],
)
def test_a_design_in_which_no_probe_carries_current(
    design: Any, Ry: float, Rc: float, warning: str, tmp_path: Path
) -> None:
    study, state = computed(design(), tmp_path)
    (record,) = study.records
    np.testing.assert_array_equal([record.fit.Ry, record.fit.Rc], [Ry, Rc])
    assert np.abs(record.currents).max() < 1e-15
    assert warning in state["fit_warnings"][0]
    assert (state["Ry_ohm"], state["Rc_ohm"]) == (None, None)
    assert "DISAGREE" not in table(study)


@pytest.mark.parametrize("conductivity", [1e-4, 1e-5])
def test_poor_contacts_are_confirmed_to_the_rounding_of_ngspice(conductivity: float) -> None:
    """ngspice solves without refinement: what it loses is told from routes that disagree."""
    design, _ = small_cell(elements=4)
    design = replace(design, contact=replace(design.contact, conductivity=conductivity))
    study = run_study(design)
    (check,) = (record.verification for record in study.records)
    assert check.native_difference <= 1e-9
    assert max(check.max_voltage_difference, check.max_current_difference) > 1e-9  # else the limit is not needed
    assert max(check.max_voltage_difference, check.max_current_difference) <= check.ngspice_limit
    assert check.note == f"ngspice's own rounding limits this check to {check.ngspice_limit:.1e}."
    assert "ngspice confirmed every recorded state." in table(study)
    assert check.note in table(study)
