"""Cells whose branch hangs on the order of the fibrils, cells whose branch does not, and the checks of a whole run."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from canned import Canned, canned_study, undrawn
from fabrics import small_cell
from synthetic_study import synthetic_study

import circuittex.study.branch_check as module
from circuittex.base.errors import CircuitError, ConvergenceError
from circuittex.base.frozen import same
from circuittex.command.cli import main
from circuittex.design import Design, Loading, starter, uniaxial
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.mech.linear import LinearSolver
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.relaxation.increment import Increment
from circuittex.relaxation.relax import Equilibrium
from circuittex.results.bifurcation import ALLOWED, BranchCheck, Verdict
from circuittex.results.discretisation import ErrorEstimate
from circuittex.results.records import Record, Study
from circuittex.results.store import load_study
from circuittex.study.branch_check import another_permutation, check_branch
from circuittex.study.plan import Step, plan
from circuittex.study.record import reach
from circuittex.study.run import run_study

Say = Callable[[str], None]
PRESS = Loading("press", (((1.2, 0.0), (0.0, 1.2)), ((0.8, 0.0), (0.0, 1.2))), (0.2, -0.2))
"""Both directions stretched, and then the straight warp pressed by a third: it buckles to one side or the other."""


@pytest.mark.parametrize("n", range(2, 40))
def test_the_other_order_is_another_one(n: int) -> None:
    permutation = another_permutation(n)
    assert sorted(permutation) == list(range(n))
    assert list(permutation) != list(range(n))
    assert np.array_equal(permutation, another_permutation(n))


def test_a_cell_that_keeps_its_branch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In two processes, each with the mesh and the states that it is sent, and kept in a file."""
    undrawn(monkeypatch)
    design, _ = small_cell((1, 2), elements=4, tolerance="1e-8 N")
    design = replace(design, loading=(uniaxial("stretch", (0.05,)),))
    study = run_study(design, tmp_path, branches=True, workers=2)
    assert [check.state for check in study.branches] == ["relaxed", "stretch-0.05"]
    for check, record in zip(study.branches, study.records, strict=True):
        assert check.verdict is Verdict.SAME
        assert same(check.recorded, record.outcome)
        assert 0.0 < check.difference < 1e-3 * ALLOWED  # round-off differs, and nothing else
        assert 0.0 < check.moved < 1e-9
        assert check.again.energy == pytest.approx(record.energy, rel=1e-12)
        assert (check.again.Ry, check.again.Rc) == pytest.approx((record.fit.Ry, record.fit.Rc), rel=1e-6)
    assert same(load_study(tmp_path / "results.h5"), study)


def test_a_warp_that_may_buckle_to_either_side_is_a_bifurcation() -> None:
    """A warp fibril of 0.15 mm radius lies more than a millimetre away in the other branch, at another energy."""
    design, _ = small_cell((1,), elements=8, order=1, section_degree=6, tolerance="1e-8 N")
    study = run_study(replace(design, loading=(PRESS,)), branches=True, workers=1)
    assert [check.verdict for check in study.branches] == [Verdict.SAME, Verdict.SAME, Verdict.BIFURCATION]
    found, record = study.branches[-1], study.records[-1]
    assert found is study.bifurcation_of(record.name)
    assert study.bifurcation_of("relaxed") is None
    assert found.moved > 1.0
    assert abs(found.again.energy / found.recorded.energy - 1.0) > 1e-4
    assert found.difference > 1e-3
    assert (found.settled, found.trouble) == ((), "")  # the tolerance is too small to explain that
    # Both carry the press, nearly alike.
    for outcome in (found.recorded, found.again):
        assert outcome.clamp_force[0, 0] < -1e-3
    assert found.again.clamp_force[0, 0] == pytest.approx(found.recorded.clamp_force[0, 0], rel=0.1)


# One state, reached again in other ways


@pytest.fixture(scope="module")
def loose() -> Study:
    """A cell relaxed to a tolerance of a hundredth of its clamp forces."""
    design, _ = small_cell((1, 2), elements=4, tolerance="1e-3 N")
    return run_study(replace(design, loading=()), workers=1)


def sharper(study: Study, step: Step, start: Configuration, solver: Callable[[], LinearSolver], say: Say) -> Increment:
    """Stands for a descent that stops elsewhere within the tolerance."""
    numerics = replace(study.design.numerics, tolerance="1e-6 N")
    return reach(replace(study, design=replace(study.design, numerics=numerics)), step, start, solver, say)


def checked(study: Study, say: Say = lambda _: None) -> BranchCheck:
    (step,) = plan(study.design)
    return check_branch(study, step, study.initial, study.records[0], MultifrontalSolver, say)


def test_what_the_tolerance_leaves_is_no_branch(loose: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    assert checked(loose).verdict is Verdict.SAME  # the same steps but for round-off
    monkeypatch.setattr(module, "reach", sharper)
    said: list[str] = []
    found = checked(loose, said.append)
    assert found.difference > 10 * ALLOWED
    assert found.verdict is Verdict.TOLERANCE
    assert "branch check, relaxed: relaxing both states further" in said
    assert all(text.startswith("branch check, relaxed: ") for text in said)


def test_what_cannot_be_relaxed_further_is_not_decided(loose: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(mesh: FibrilMesh, design: Design, *_: object, **__: object) -> Equilibrium:
        largest = np.abs(loose.records[0].clamp_force).max()
        assert design.numerics.force_tolerance == pytest.approx(1e-7 * largest, rel=1e-12)
        raise ConvergenceError("round-off")

    monkeypatch.setattr(module, "reach", sharper)
    monkeypatch.setattr(module, "relax", refuse)
    found = checked(loose)
    assert (found.verdict, found.trouble) == (Verdict.UNDECIDED, "round-off")
    assert np.isfinite(found.again.energy)


def test_no_equilibrium_the_second_time_is_a_finding(loose: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> Increment:
        raise ConvergenceError("relaxed: no equilibrium after 200 iterations")

    monkeypatch.setattr(module, "reach", refuse)
    found = checked(loose)
    assert (found.verdict, found.trouble) == (Verdict.MISSING, "relaxed: no equilibrium after 200 iterations")
    assert np.isnan([found.again.energy, found.again.Ry, found.moved, *found.again.currents]).all()
    assert len(found.again.currents) == len(loose.design.probes)


# The checks of a run


def made_up(study: Study, step: Step, start: Configuration, record: Record, solver: object, say: Say) -> BranchCheck:
    """Stands for a check, without its time."""
    say(f"branch check, {record.name}")
    assert study.records == ()
    assert step.name == record.name
    return BranchCheck(record.name, record.outcome, record.outcome, 0.0, (), "")


@pytest.fixture
def canned(monkeypatch: pytest.MonkeyPatch) -> Study:
    """A study of two paths whose states and checks take no time."""
    study = canned_study(3)
    Canned(study).install(monkeypatch)
    monkeypatch.setattr(module, "check_branch", made_up)
    return study


STATES = ["relaxed", "stretch-0.025", "stretch-0.05", "shear-0.025", "shear-0.05"]


def checks_said(said: list[str]) -> list[str]:
    return [text.removeprefix("branch check, ") for text in said if text.startswith("branch check, ")]


def test_every_state_starts_from_the_recorded_one_before_it(canned: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    starts = {}

    def note(study: Study, step: Step, start: Configuration, record: Record, solver: object, say: Say) -> BranchCheck:
        starts[step.name] = start
        return made_up(study, step, start, record, solver, say)

    monkeypatch.setattr(module, "check_branch", note)
    study = run_study(canned.design, branches=True, workers=1)
    found = {record.name: record.configuration for record in study.records}
    before = [study.initial, found["relaxed"], found["stretch-0.025"], found["relaxed"], found["shear-0.025"]]
    assert list(starts) == STATES
    assert all(same(start, expected) for start, expected in zip(starts.values(), before, strict=True))
    assert run_study(canned.design, workers=1).branches == ()


def test_a_finished_run_gets_its_checks_later_and_only_once(canned: Study, tmp_path: Path) -> None:
    assert run_study(canned.design, tmp_path, workers=1).branches == ()
    said: list[str] = []
    study = run_study(canned.design, tmp_path, branches=True, workers=1, progress=said.append)
    assert checks_said(said) == STATES
    said.clear()
    again = run_study(canned.design, tmp_path, branches=True, workers=1, progress=said.append)
    assert same(again, study)
    assert checks_said(said) == []
    states = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["states"]
    assert [state["branch_check"]["verdict"] for state in states] == ["same branch"] * len(STATES)


def test_an_interrupted_check_goes_on_with_those_that_are_missing(canned: Study, tmp_path: Path) -> None:
    def interrupt(text: str) -> None:
        if text == "branch check, stretch-0.05":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(canned.design, tmp_path, branches=True, workers=1, progress=interrupt)
    assert [check.state for check in load_study(tmp_path / "results.h5").branches] == STATES[:2]
    assert not (tmp_path / "report.html").exists()  # it would not know all checks
    said: list[str] = []
    study = run_study(canned.design, tmp_path, branches=True, workers=1, progress=said.append)
    assert checks_said(said) == STATES[2:]
    assert [check.state for check in study.branches] == STATES
    assert (tmp_path / "report.html").exists()


def test_checks_and_error_estimates_in_one_run(canned: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def estimate(design: Design, mesh: FibrilMesh, record: Record, solver: object, say: Say) -> ErrorEstimate:
        return ErrorEstimate(record.name, (10, 20, 40), (4, 8), np.zeros(3), (), ())

    monkeypatch.setattr("circuittex.study.error_estimate.estimate_error", estimate)
    study = run_study(canned.design, tmp_path, branches=True, error_estimate=True, workers=1)
    assert [check.state for check in study.branches] == STATES
    assert [found.state for found in study.errors] == ["relaxed", "stretch-0.05", "shear-0.05"]
    assert same(load_study(tmp_path / "results.h5"), study)


def test_what_is_no_matter_of_convergence_ends_the_run(canned: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> BranchCheck:
        raise CircuitError("no currents")

    monkeypatch.setattr(module, "check_branch", fail)
    with pytest.raises(CircuitError, match="no currents"):
        run_study(canned.design, branches=True, workers=1)


@pytest.mark.parametrize("asked", [[], ["--branches"]])
def test_the_command_line_asks_for_checks(asked: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def fake(design: Design, out: Path, *, branches: bool, **_: object) -> Study:
        seen.append(branches)
        return synthetic_study(1, contacts=1, rows=(1,))

    monkeypatch.setattr("circuittex.study.run.run_study", fake)
    (tmp_path / "weave.toml").write_text(starter(), encoding="utf-8")
    assert main(["run", str(tmp_path / "weave.toml"), "--out", str(tmp_path / "out"), "--quiet", *asked]) == 0
    assert seen == [bool(asked)]
