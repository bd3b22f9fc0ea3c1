"""The verdict on two ways to one state, and the sentences about many."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest

from circuittex.results.bifurcation import (
    BranchCheck,
    Verdict,
    branch_statement,
    current_difference,
    difference,
    force_difference,
)
from circuittex.results.outcome import Outcome

OUTCOME = Outcome(np.array([[2.0, 0.1, 0.0], [0.001, 0.5, 0.0]]), (1.0, 0.01), 0.3, 300.0, 0.4)
NOTHING = Outcome(np.full((2, 3), nan), (nan, nan), nan, nan, nan)


def off(force: float = 0.0, current: float = 0.0) -> Outcome:
    """The outcome with one small force `force` N and the small current `current` A away."""
    clamp_force = OUTCOME.clamp_force.copy()
    clamp_force[1, 0] -= force
    return replace(OUTCOME, clamp_force=clamp_force, currents=(1.0, 0.01 + current))


def check(
    again: Outcome, *, state: str = "a", settled: tuple[Outcome, ...] = (), trouble: str = "", moved: float = 0.0
) -> BranchCheck:
    return BranchCheck(state, OUTCOME, again, moved, settled, trouble)


def test_forces_are_measured_by_the_largest_and_each_current_by_itself() -> None:
    assert force_difference(OUTCOME, off(force=4e-6)) == pytest.approx(2e-6, rel=1e-9)
    assert current_difference(OUTCOME, off(force=4e-6)) == 0.0
    assert current_difference(OUTCOME, off(current=-4e-8)) == pytest.approx(4e-6, rel=1e-6)
    assert difference(OUTCOME, off(force=4e-6, current=4e-8)) == pytest.approx(4e-6, rel=1e-6)
    assert np.isnan(difference(OUTCOME, NOTHING))
    assert np.isnan(difference(OUTCOME, replace(OUTCOME, currents=(nan, 0.01))))


def test_nothing_of_nothing_is_no_difference() -> None:
    bare = replace(OUTCOME, clamp_force=np.zeros((2, 3)), currents=(0.0,))
    assert difference(bare, bare) == 0.0
    assert force_difference(bare, replace(bare, clamp_force=np.full((2, 3), 1e-9))) == inf
    assert current_difference(bare, replace(bare, currents=(-1e-9,))) == inf
    assert current_difference(replace(bare, currents=()), replace(bare, currents=())) == 0.0


@pytest.mark.parametrize(
    ("found", "verdict", "alarming"),
    [
        (check(off(force=1.9e-6)), Verdict.SAME, False),
        (check(off(current=0.9e-8)), Verdict.SAME, False),
        (check(off(force=2.1e-6)), Verdict.BIFURCATION, True),
        (check(off(current=1.1e-8)), Verdict.BIFURCATION, True),
        (check(off(force=1e-3), settled=(OUTCOME, off(force=1e-3))), Verdict.BIFURCATION, True),
        (check(off(force=1e-3), settled=(off(force=5e-4), off(force=5.01e-4))), Verdict.TOLERANCE, False),
        (check(off(force=1e-3), trouble="no equilibrium after 200"), Verdict.UNDECIDED, True),
        (check(NOTHING, trouble="no equilibrium after 200", moved=nan), Verdict.MISSING, True),
        (check(off(), moved=0.4), Verdict.SAME, False),  # an image of the state: other places, the same values
    ],
)
def test_the_verdict(found: BranchCheck, verdict: Verdict, alarming: bool) -> None:
    assert found.verdict is verdict
    assert found.alarming == alarming
    assert found.bifurcation == (verdict is Verdict.BIFURCATION)


def test_one_line_where_all_is_well() -> None:
    checks = [check(off(force=4e-8)), check(off(force=1e-8), state="b")]
    assert branch_statement(checks) == (
        "With the fibrils in another order 2 states keep their branch: clamp forces and currents change by at most "
        "2.0e-08.",
    )
    assert "the state keeps its branch" in branch_statement(checks[:1])[0]
    assert branch_statement(()) == ()


def test_every_finding_has_its_sentence_and_the_worst_comes_first() -> None:
    checks = [
        check(off(), state="good"),
        check(off(force=1e-3), state="loose", settled=(OUTCOME, OUTCOME)),
        check(off(force=1e-3), state="open", trouble="stuck"),
        check(NOTHING, state="lost", trouble="stuck"),
        check(off(force=1e-5), state="fork", settled=(OUTCOME, off(force=2e-2))),
        check(off(force=1e-2), state="other fork", settled=(OUTCOME, off(force=1e-4))),
    ]
    fork, lost, undecided, loose, good = branch_statement(checks)
    assert "BIFURCATION in fork, other fork: " in fork
    assert "up to 1.0e-02 apart; the report shows both" in fork
    assert "NO equilibrium was found in lost." in lost
    assert "NOT DECIDED in open: " in undecided
    assert "up to 5.0e-04 in loose, more than 1e-06" in loose
    assert "the state keeps its branch" in good
