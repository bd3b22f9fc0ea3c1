"""Branch checks as results: kept in the file, in the summary and the closing table, in the report and on the curves."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from math import nan
from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib.axes import Axes
from synthetic_study import synthetic_study

from circuittex.base.errors import StoreError
from circuittex.base.frozen import same
from circuittex.results.bifurcation import BranchCheck
from circuittex.results.outcome import Outcome
from circuittex.results.plot import FIGURES
from circuittex.results.plot.curves import conductance_figure, force_figure, network_figure
from circuittex.results.plot.style import COLOURS
from circuittex.results.records import Record, Study, with_examination
from circuittex.results.report.page import page
from circuittex.results.store import append_examination, load_study, write_study_start
from circuittex.results.summary import summary, table, write_summary

STUDY = synthetic_study(3, contacts=5, rows=(1,), loadings=("stretch", "shear"))
REST, FIRST, FORK, LOST, LAST = STUDY.records
NOTHING = Outcome(np.full((2, 3), nan), (nan,) * 3, nan, nan, nan)


def scaled(record: Record, factor: float) -> Outcome:
    one = record.outcome
    currents = tuple(factor * current for current in one.currents)
    return Outcome(factor * one.clamp_force, currents, one.Ry / factor, one.Rc / factor, factor * one.energy)


KEPT = BranchCheck(REST.name, REST.outcome, scaled(REST, 1.0 + 4e-8), 1e-7, (), "")
OTHER = BranchCheck(FORK.name, FORK.outcome, scaled(FORK, 1.25), 0.31, (), "")
NONE = BranchCheck(LOST.name, LOST.outcome, NOTHING, nan, (), "no <equilibrium>")
LOOSE = BranchCheck(LAST.name, LAST.outcome, scaled(LAST, 1.001), 1e-4, (LAST.outcome, scaled(LAST, 1.0 + 2e-9)), "")
CHECKED = replace(STUDY, branches=(KEPT, OTHER, NONE, LOOSE))
GOOD = replace(STUDY, branches=(KEPT, LOOSE))


def test_checks_come_back_bit_for_bit_in_the_order_of_their_states(tmp_path: Path) -> None:
    path = tmp_path / "results.h5"
    write_study_start(path, STUDY)
    for check in (LOOSE, NONE, KEPT, OTHER):
        append_examination(path, check)
    with h5py.File(path, "r") as file:
        assert set(file["branches"]) == {check.state for check in CHECKED.branches}
    assert same(load_study(path), CHECKED)
    write_study_start(path, CHECKED)
    assert same(load_study(path), CHECKED)


def test_a_changed_check_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "results.h5"
    write_study_start(path, CHECKED)
    with h5py.File(path, "r+") as file:
        file[f"branches/{LOOSE.state}"].attrs["moved"] = 0.0
    with pytest.raises(StoreError, match=rf"branch check {re.escape(LOOSE.state)} does not match its digest"):
        load_study(path)


def test_a_check_is_found_by_its_state() -> None:
    assert CHECKED.check_of(LOST.name) is NONE
    assert CHECKED.check_of(FIRST.name) is None
    assert [CHECKED.bifurcation_of(record.name) for record in STUDY.records] == [None, None, OTHER, None, None]
    assert same(with_examination(with_examination(STUDY, LOOSE), KEPT), GOOD)


# ---- Summary and closing table ----------------------------------------------------------------------------


def test_the_summary_gives_the_other_branch(tmp_path: Path) -> None:
    write_summary(tmp_path / "summary.json", CHECKED)
    states = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["states"]
    checks = [state["branch_check"] for state in states]
    assert checks[1] is None
    assert [check["verdict"] for check in checks if check] == [
        *("same branch", "bifurcation", "no equilibrium", "same branch, within the tolerance"),
    ]
    assert [check["bifurcation"] for check in checks if check] == [False, True, False, False]
    fork = checks[2]
    assert fork["clamp_force_N"]["x"] == pytest.approx((1.25 * FORK.clamp_force[0]).tolist())
    assert fork["clamp_force_N"]["y"] == pytest.approx((1.25 * FORK.clamp_force[1]).tolist())
    assert fork["currents_A"] == pytest.approx([1.25 * current for current in FORK.currents])
    assert (fork["Ry_ohm"], fork["Rc_ohm"]) == pytest.approx((FORK.fit.Ry / 1.25, FORK.fit.Rc / 1.25))
    assert fork["stored_energy_N_mm"] == pytest.approx(1.25 * FORK.energy)
    assert fork["energy_difference_N_mm"] == pytest.approx(0.25 * FORK.energy)
    assert (fork["clamp_force_difference"], fork["current_difference"]) == pytest.approx((0.25, 0.25))
    assert (fork["moved_mm"], fork["settled_difference"], fork["trouble"]) == (0.31, None, "")
    assert checks[4]["settled_difference"] == pytest.approx(2e-9, rel=1e-6)
    assert checks[3]["trouble"] == "no <equilibrium>"
    assert [checks[3][key] for key in ("moved_mm", "Ry_ohm", "clamp_force_difference")] == [None, None, None]
    assert checks[3]["currents_A"] == [None, None, None]


def test_the_documentation_lists_every_key() -> None:
    text = (Path(__file__).parents[1] / "docs" / "results.md").read_text(encoding="utf-8")
    part = text[text.index("Each `branch_check`") : text.index("Each `verification`")]
    check = summary(CHECKED)["states"][0]["branch_check"]
    for key in check:
        assert f"`{key}`" in part
    for other in CHECKED.branches:
        assert f"`{other.verdict}`" in part


def test_the_closing_table_says_what_was_found() -> None:
    lines = table(CHECKED).splitlines()
    assert sum(line.startswith(f"BIFURCATION in {FORK.name}: ") for line in lines) == 1
    assert any(line.endswith(f"NO equilibrium was found in {LOST.name}.") for line in lines)
    assert sum("in another order" in line for line in table(replace(STUDY, branches=(KEPT,))).splitlines()) == 1
    assert "another order" not in table(STUDY)


# ---- Report -----------------------------------------------------------------------------------------------


def section(study: Study) -> str:
    text = page(study, {})
    return text[text.index("<h2>Branches") : text.index("<h2>Verification")]


def test_the_report_has_a_row_for_each_check() -> None:
    text = section(CHECKED)
    head = re.findall(r'<th scope="col">(.*?)</th>', text)[:7]
    assert head == [
        *("state", "clamp forces (relative)", "currents (relative)", "relaxed further (relative)", "energy (N mm)"),
        *("largest distance (mm)", "verdict"),
    ]
    for check, cells in (
        (KEPT, ("4e-08", "4e-08", "–", "1.6e-08", "1e-07", "same branch")),
        (NONE, ("–", "–", "–", "–", "–", "no equilibrium")),
        (LOOSE, ("0.001", "0.001", "2e-09", "0.001", "0.0001", "same branch, within the tolerance")),
    ):
        assert f'<th scope="row">{check.state}</th>' + "".join(f"<td>{cell}</td>" for cell in cells) in text
    assert f'<p class="bad">{LOST.name}: no equilibrium (no &lt;equilibrium&gt;)</p>' in text


def test_both_branches_of_a_bifurcation_stand_side_by_side() -> None:
    (box,) = re.findall(r'<div class="bad"><h3>.*?</table>', section(CHECKED), re.DOTALL)
    assert f"Bifurcation in {FORK.name}" in box
    assert "up to 0.31 mm apart" in " ".join(box.split())
    own, other = FORK.outcome, OTHER.again
    for name, values in (
        ("warp +x Fx (N)", (own.clamp_force[0, 0], other.clamp_force[0, 0])),
        ("weft +y Fz (N)", (own.clamp_force[1, 2], other.clamp_force[1, 2])),
        ("I parallel (A)", (own.currents[1], other.currents[1])),
        ("Ry (Ω)", (own.Ry, other.Ry)),
        ("Rc (Ω)", (own.Rc, other.Rc)),
        ("stored energy (N mm)", (own.energy, other.energy)),
    ):
        cells = "".join(f"<td>{value:.8g}</td>" for value in values)
        assert f'<th scope="row">{name}</th>{cells}</tr>' in box


def test_branches_that_part_when_relaxed_further_show_that_too() -> None:
    parted = replace(OTHER, settled=(scaled(FORK, 2.0), scaled(FORK, 3.0)))
    text = section(replace(STUDY, branches=(parted,)))
    assert '<th scope="col">other, relaxed further</th>' in text
    cells = "".join(f"<td>{factor * FORK.energy:.8g}</td>" for factor in (1.0, 1.25, 2.0, 3.0))
    assert f'<th scope="row">stored energy (N mm)</th>{cells}</tr>' in text


def test_the_head_of_the_page_names_what_must_be_known() -> None:
    head = page(CHECKED, {}).split("<h2>")[0]
    assert f'<div class="bad"><p>BIFURCATION in {FORK.name}: ' in head
    assert "keeps its branch" not in head
    assert 'class="bad"' not in page(GOOD, {})


def test_a_study_without_checks_shows_none() -> None:
    assert "Branches" not in page(STUDY, {})
    assert "diamond" not in page(GOOD, dict.fromkeys(FIGURES, b""))
    assert page(CHECKED, dict.fromkeys(FIGURES, b"")).count("Open diamonds: the other branch of a bifurcation.") == 6


# ---- Curves -----------------------------------------------------------------------------------------------


def diamonds(axes: Axes) -> list[tuple[str, float, float]]:
    """Colour and place of each open diamond."""
    lines = [line for line in axes.lines if line.get_marker() == "D" and line.get_markerfacecolor() == "none"]
    return [(str(line.get_color()), *map(float, point)) for line in lines for point in line.get_xydata()]


def test_the_other_branch_is_on_the_curves() -> None:
    x, other = FORK.strain, OTHER.again
    panels = force_figure(CHECKED).axes
    for side, axes in enumerate(panels[:2]):
        assert diamonds(axes) == [(COLOURS[k], x, float(other.clamp_force[side, k])) for k in range(3)]
    assert [diamonds(axes) for axes in panels[2:]] == [[], []]
    for number, axes in enumerate(conductance_figure(CHECKED).axes):
        assert diamonds(axes) == [(COLOURS[number], x, other.currents[number])]
    left, right = network_figure(CHECKED).axes
    assert (diamonds(left), diamonds(right)) == ([(COLOURS[0], x, other.Ry)], [(COLOURS[1], x, other.Rc)])


def test_the_legend_names_the_other_branch_only_where_there_is_one() -> None:
    for draw in (force_figure, conductance_figure, network_figure):
        (legend,) = draw(CHECKED).legends
        assert [text.get_text() for text in legend.get_texts()] == ["other branch of a bifurcation"]
        assert draw(GOOD).legends == []
