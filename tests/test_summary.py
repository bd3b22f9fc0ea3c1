"""summary.json and the closing table."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic import fibrils
from synthetic_study import INSULATED, synthetic_study

import circuittex.results.summary as summary_module
from circuittex.base.frozen import same
from circuittex.results.effort import effort
from circuittex.results.records import Study
from circuittex.results.summary import insulated_resistance, ngspice_statement, summary, table, write_summary

STUDY = synthetic_study(3, contacts=40)


def written(study: Study, folder: Path) -> dict[str, Any]:
    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    write_summary(folder / "summary.json", study)
    content: dict[str, Any] = json.loads((folder / "summary.json").read_text("utf-8"), parse_constant=refuse)
    return content


def unchecked(study: Study, *names: str) -> Study:
    """The study as if ngspice had been missing for the states `names`."""
    lost = {"ngspice_checked": False, "routes": ("fields", "nodal"), "note": "ngspice was not found"}
    return replace(
        study,
        records=tuple(
            replace(r, verification=replace(r.verification, **lost)) if r.name in names else r for r in study.records
        ),
    )


def test_keys_that_the_documentation_promises(tmp_path: Path) -> None:
    content = written(STUDY, tmp_path)
    assert content["format"] == 2
    assert content["design_hash"] == STUDY.design_hash
    assert content["parameters"]["weave"]["pitch"] == 2.0
    assert len(content["states"]) == 3
    state, record = content["states"][1], STUDY.records[1]
    assert state["name"] == "stretch-0.0250"
    assert state["strain"] == 0.025
    assert state["residual_N"] == record.residual
    assert (state["newton_iterations"], state["parts"]) == (14, 1)
    assert state["clamp_force_N"] == {"x": record.clamp_force[0].tolist(), "y": record.clamp_force[1].tolist()}
    assert state["currents_A"] == [float(fields.currents[0]) for fields in record.fields]
    assert len(state["currents_A"]) == 3
    assert state["peak_temperature_K"] == record.peak_temperature
    assert (state["Ry_ohm"], state["Rc_ohm"]) == (record.fit.Ry, record.fit.Rc)
    assert state["fit_residual"] == record.fit.residual
    assert state["netlist"] == record.netlist
    assert state["verification"]["routes"] == ["fields", "nodal", "ngspice"]
    assert state["verification"]["max_voltage_difference_V"] == 4e-13
    assert state["verification"]["max_current_difference"] == 2e-12


def test_the_documentation_lists_every_key_of_a_state() -> None:
    text = (Path(__file__).parents[1] / "docs" / "results.md").read_text(encoding="utf-8")
    for key in summary(STUDY)["states"][0]:
        assert f"`{key}`" in text
        assert f"``{key}``" in str(summary_module.__doc__)


def test_undefined_numbers_are_null(tmp_path: Path) -> None:
    record = STUDY.records[0]
    fit = replace(record.fit, Rc=math.inf, covariance=np.full((2, 2), math.nan))
    hollow = replace(record, fit=fit, fields=(), verification=replace(record.verification, merge_error=math.nan))
    state = written(replace(STUDY, records=(hollow,)), tmp_path)["states"][0]
    assert state["Rc_ohm"] is None
    assert state["peak_temperature_K"] is None
    assert state["verification"]["merge_error"] is None


def test_study_is_not_changed() -> None:
    before = synthetic_study(3, contacts=40)
    summary(STUDY)
    assert same(before, STUDY)


def test_insulated_resistance_is_that_of_the_paper() -> None:
    assert insulated_resistance(STUDY.mesh) == pytest.approx(INSULATED, rel=1e-12)
    assert pytest.approx(0.2829, abs=5e-5) == INSULATED  # [57]
    assert insulated_resistance(fibrils([1.0], sigma=0.0)) == math.inf


def test_table_has_a_line_for_each_state() -> None:
    lines = table(STUDY).splitlines()
    assert [line[:15].rstrip() for line in lines[:5]] == ["state", "relaxed", "", "stretch-0.0250", "stretch-0.0500"]
    assert len({len(line) for line in lines[:5] if line}) == 1
    assert lines[4].split()[1:3] == [f"{STUDY.records[2].clamp_force[k, k]:#.4g}" for k in (0, 1)]
    assert lines[-1] == "ngspice confirmed every recorded state."


def test_what_the_equilibria_took_is_said() -> None:
    first, second, third = STUDY.records
    study = replace(STUDY, records=(first, replace(second, residual=7e-7), replace(third, parts=4, iterations=90)))
    assert effort(study) == (
        "3 equilibria in 156 iterations, at most 90 for one; the largest free force is 7.0e-07 N in "
        "stretch-0.0250 (2e-05 of the forces on its fibril is allowed).",
        "Increments too large to converge as a whole were halved: stretch-0.0500 in 4 parts.",
    )
    assert len(effort(STUDY)) == 1
    assert effort(replace(STUDY, records=())) == ()


def test_missing_ngspice_is_said_plainly() -> None:
    some = ngspice_statement(unchecked(STUDY, "relaxed"))
    assert some[0].startswith("ngspice did NOT check relaxed:")
    assert some[1:] == ("ngspice was not found",)
    every = table(unchecked(STUDY, *(record.name for record in STUDY.records)))
    assert "ngspice did NOT check any state" in every
    assert "confirmed" not in every


def disagreeing(study: Study, name: str, **values: float) -> Study:
    """The study with other differences between the routes in one state; ngspice has answered all the same."""
    own = {"reduced_difference": values.pop("reduced_difference")} if "reduced_difference" in values else {}
    return replace(
        study,
        records=tuple(
            replace(r, verification=replace(r.verification, **values), **own) if r.name == name else r
            for r in study.records
        ),
    )


@pytest.mark.parametrize(
    "values",
    [
        {"max_voltage_difference": 3e-8},
        {"max_current_difference": 3e-8},
        {"native_difference": 3e-8, "max_current_difference": 3e-8, "ngspice_limit": 1e-6},
    ],
)
def test_routes_that_disagree_are_not_called_confirmed(values: dict[str, float], tmp_path: Path) -> None:
    study = disagreeing(STUDY, "stretch-0.0250", **values)
    text = table(study)
    assert "The routes DISAGREE in stretch-0.0250, by up to 3.0e-08: do not trust the results." in text
    assert "confirmed" not in text
    states = written(study, tmp_path)["states"]
    assert [state["verification"]["confirmed"] for state in states] == [True, False, True]


def test_a_difference_that_ngspices_rounding_explains_is_none(tmp_path: Path) -> None:
    study = disagreeing(STUDY, "relaxed", max_current_difference=3e-8, ngspice_limit=2e-7)
    assert table(study).splitlines()[-2:] == [
        "ngspice confirmed every recorded state.",
        "ngspice's own rounding limits this check to 2.0e-07.",
    ]
    assert written(study, tmp_path)["states"][0]["verification"]["confirmed"]


def test_a_reduced_network_that_ngspice_did_not_check_is_named() -> None:
    study = disagreeing(STUDY, "relaxed", reduced_difference=math.nan)
    assert table(study).splitlines()[-1] == "ngspice did NOT check the reduced network of relaxed."


def test_a_badly_conditioned_reduced_network_is_no_disagreement() -> None:
    """The routes agree and ngspice did look: neither "DISAGREE" nor "did NOT check" would be true."""
    study = disagreeing(STUDY, "relaxed", reduced_difference=3e-5)
    sentence = table(study).splitlines()[-1]
    assert sentence.startswith("ngspice finds currents of the reduced network of relaxed that differ by up to 3.0e-05")
    assert "DISAGREE" not in table(study)
    assert "did NOT check" not in table(study)
