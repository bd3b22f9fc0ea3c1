"""Error estimates as results: kept in the file, in the summary and the closing table, and in the report."""

from __future__ import annotations

import json
from dataclasses import replace
from math import nan
from pathlib import Path

import h5py
import numpy as np
import pytest
from synthetic_study import synthetic_study

from circuittex.base.errors import StoreError
from circuittex.base.frozen import same
from circuittex.results.discretisation import ErrorEstimate, QuantityError
from circuittex.results.records import Study
from circuittex.results.report.errors import error_section
from circuittex.results.report.page import page
from circuittex.results.store import append_examination, load_study, write_study_start
from circuittex.results.summary import summary, table, write_summary

NAMES = ("Fx warp N", "Fy weft N", "I straight A", "I parallel A", "I perpendicular A", "Ry ohm", "Rc ohm")


def made_up(state: str, *, fine: float = 1.9, warnings: tuple[str, ...] = ()) -> ErrorEstimate:
    names = [name.rsplit(" ", 1) for name in NAMES]
    quantities = tuple(QuantityError(name, unit, 2.0, 2.3, fine, 1.97) for name, unit in names)
    return ErrorEstimate(state, (10, 20, 40), (4, 8), np.array([0.01, 0.002, 0.001]), quantities, warnings)


STUDY = synthetic_study(3, contacts=5, rows=(1,))
FIRST, LAST = made_up("relaxed"), made_up("stretch-0.0500", fine=nan, warnings=("fibrils <rearrange>",))
STATES = ("relaxed", "stretch-0.0250", "stretch-0.0500")
ESTIMATED = replace(STUDY, errors=(FIRST, LAST))


def test_estimates_come_back_bit_for_bit_in_the_order_of_their_states(tmp_path: Path) -> None:
    path = tmp_path / "results.h5"
    write_study_start(path, STUDY)
    assert load_study(path).errors == ()
    append_examination(path, LAST)
    append_examination(path, FIRST)
    assert same(load_study(path), ESTIMATED)
    write_study_start(path, ESTIMATED)
    assert same(load_study(path), ESTIMATED)


def test_a_changed_estimate_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "results.h5"
    write_study_start(path, ESTIMATED)
    with h5py.File(path, "r+") as file:
        next(iter(file["errors"].values()))["quantities/0000"].attrs["value"] = 2.1
    with pytest.raises(StoreError, match=r"error estimate \S+ does not match its digest"):
        load_study(path)


def test_an_estimate_is_found_by_its_state() -> None:
    assert ESTIMATED.error_of("relaxed") is FIRST
    assert ESTIMATED.error_of("stretch-0.0250") is None


def test_the_summary_gives_the_numbers(tmp_path: Path) -> None:
    write_summary(tmp_path / "summary.json", ESTIMATED)
    first, middle, last = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["states"]
    assert middle["error_estimate"] is None
    estimate = first["error_estimate"]
    assert {key: estimate[key] for key in ("elements", "contact_points", "moved_mm", "warnings")} == {
        "elements": [10, 20, 40],
        "contact_points": [4, 8],
        "moved_mm": [0.01, 0.002, 0.001],
        "warnings": [],
    }
    assert [f"{quantity['name']} {quantity['unit']}" for quantity in estimate["quantities"]] == list(NAMES)
    quantity = estimate["quantities"][0]
    assert (quantity["value"], quantity["coarse"], quantity["fine"], quantity["more_points"]) == (2.0, 2.3, 1.9, 1.97)
    assert quantity["mesh_error"] == pytest.approx(1.25 * 0.15, rel=1e-12)
    assert quantity["contact_error"] == pytest.approx(0.05, rel=1e-12)
    assert quantity["error"] == pytest.approx(0.2375, rel=1e-12)
    assert quantity["relative_error"] == pytest.approx(0.11875, rel=1e-12)
    assert quantity["order"] == pytest.approx(np.log2(3), rel=1e-12)
    missing = last["error_estimate"]
    assert missing["warnings"] == ["fibrils <rearrange>"]
    assert [missing["quantities"][0][key] for key in ("error", "fine", "order")] == [None, None, None]


def test_the_documentation_lists_every_key() -> None:
    text = (Path(__file__).parents[1] / "docs" / "results.md").read_text(encoding="utf-8")
    state = summary(ESTIMATED)["states"][0]["error_estimate"]
    for key in (*state, *state["quantities"][0]):
        assert f"`{key}`" in text


def test_the_closing_table_shows_errors_below_their_values() -> None:
    lines = table(ESTIMATED).splitlines()
    place = {state: next(i for i, line in enumerate(lines) if line.startswith(f"{state} ")) for state in STATES}
    relaxed, middle, last = place.values()
    assert lines[relaxed + 1].split() == ["estimated", "error", *["±12", "%"] * len(NAMES)]
    assert not lines[middle + 1].startswith("  estimated")
    assert lines[last + 1].split() == ["estimated", "error", *["not", "known"] * len(NAMES)]
    assert "Error estimate of stretch-0.0500: fibrils <rearrange>." in lines
    # a column ends at the same place in every row
    end = lines[0].index("Fx warp N") + len("Fx warp N")
    assert all(lines[i][end - 1] != " " and lines[i][end] == " " for i in (0, relaxed, relaxed + 1, middle, last + 1))


def test_a_study_without_estimates_shows_none() -> None:
    assert "estimated error" not in table(STUDY)
    assert error_section(()) == ""
    assert "Discretisation errors" not in page(STUDY, {})


def rows_of(study: Study) -> str:
    text = page(study, {})
    return text[text.index("<h2>Discretisation errors") : text.index("<h2>Verification")]


def test_the_report_has_a_table_for_each_estimate() -> None:
    text = rows_of(ESTIMATED)
    assert text.index("<h3>relaxed") < text.index("<h3>stretch-0.0500")
    assert text.count('<th scope="row">Rc (ohm)</th>') == 2
    cells = ("2", "± 0.24", "12 %", "0.19", "0.05", "1.6", "2.3", "1.9", "1.97")
    assert '<th scope="row">Fx warp (N)</th>' + "".join(f"<td>{cell}</td>" for cell in cells) in text


def test_the_report_shows_warnings_and_what_is_missing() -> None:
    text = rows_of(ESTIMATED)
    assert '<p class="bad">fibrils &lt;rearrange&gt;</p>' in text
    cells = ("2", "not known", "–", "–", "0.05", "–", "2.3", "–", "1.97")
    assert "".join(f"<td>{cell}</td>" for cell in cells) in text
