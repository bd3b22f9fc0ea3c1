"""The order of a study's tasks: whatever finishes when, the same study in the same order, and nothing lost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from canned import Canned, canned_study
from hypothesis import given, settings
from hypothesis import strategies as st
from library_cases import grid_study

from circuittex.base.errors import CircuittexError, ConvergenceError
from circuittex.base.frozen import same
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.results.records import Study
from circuittex.study import schedule
from circuittex.study.plan import plan
from circuittex.study.record import Recorded
from circuittex.study.schedule import compute

STUDY = canned_study(4)
NAMES = [record.name for record in STUDY.records]
GRID = grid_study(contacts=10)


class Shuffled:
    """`size` computers at once, which finish in the order that `pick` chooses."""

    def __init__(self, size: int, pick: Callable[[int], int]) -> None:
        self.size, self._pick = size, pick
        self._running: list[tuple[str, Any]] = []

    def submit(self, key: str, task: Callable[..., Any], *arguments: object) -> None:
        assert len(self._running) < self.size
        try:
            self._running.append((key, task(*arguments, print)))
        except CircuittexError as error:
            self._running.append((key, error))

    def next(self) -> tuple[str, Any]:
        return self._running.pop(self._pick(len(self._running)))

    def close(self) -> None:
        pass


def run(
    known: list[str], size: int, pick: Callable[[int], int], fails: tuple[str, ...] = (), whole: Study = STUDY
) -> tuple[Any, list[str]]:
    """The study or the error, and the names of the records in the order in which they were kept."""
    canned, kept = Canned(whole), list(known)
    previous = {step.name: step.previous for step in plan(whole.design)}

    def fail(name: str) -> None:
        if name in fails:
            raise ConvergenceError(f"{name}: no equilibrium", name)

    def keep(study: Study, recorded: Recorded) -> Study:
        record = recorded.record
        assert previous[record.name] in ("", *kept)
        assert record.contacts.mesh is study.mesh
        kept.append(record.name)
        return Study(**vars(study) | {"records": (*study.records, record)})

    canned.before = fail
    start = Study(**vars(whole) | {"records": tuple(r for r in whole.records if r.name in known)})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(schedule, "reach", canned.reach)
        patch.setattr(schedule, "record_state", canned.record_state)
        try:
            result: Any = compute(start, Shuffled(size, pick), MultifrontalSolver, keep)
        except CircuittexError as error:
            result = error
    assert len(canned.reached) == len(set(canned.reached))
    return result, kept


@given(st.data(), st.integers(1, 4), st.integers(0, 3), st.integers(0, 3), st.booleans())
def test_any_order_of_events_gives_the_same_study(
    data: st.DataObject, size: int, stretched: int, sheared: int, relaxed: bool
) -> None:
    known = [*NAMES[1 : 1 + stretched], *NAMES[4 : 4 + sheared]] if relaxed else []
    study, kept = run(["relaxed", *known] if relaxed else [], size, lambda n: data.draw(st.integers(0, n - 1)))
    assert same(study, STUDY)
    assert sorted(kept) == sorted(NAMES)


@given(st.data(), st.integers(1, 4), st.sampled_from(NAMES[1:4]))
def test_a_path_that_fails_keeps_its_states_and_the_other_path(data: st.DataObject, size: int, failing: str) -> None:
    error, kept = run([], size, lambda n: data.draw(st.integers(0, n - 1)), (failing,))
    assert isinstance(error, ConvergenceError)
    assert str(error) == f"{failing}: no equilibrium"
    assert sorted(kept) == sorted([*NAMES[: NAMES.index(failing)], *NAMES[4:]])


def test_all_failures_are_told_in_the_order_of_the_states() -> None:
    error, kept = run([], 3, lambda n: n - 1, (NAMES[2], NAMES[4]))
    assert str(error) == f"{NAMES[2]}: no equilibrium; {NAMES[4]}: no equilibrium"
    assert error.history == NAMES[2]
    assert sorted(kept) == sorted(NAMES[:2])


def test_without_a_relaxed_state_there_is_nothing() -> None:
    error, kept = run([], 2, lambda n: 0, ("relaxed",))
    assert (str(error), kept) == ("relaxed: no equilibrium", [])


def test_one_computer_follows_a_path_to_its_end() -> None:
    assert run([], 1, lambda n: 0)[1] == NAMES


@settings(max_examples=10)
@given(st.data(), st.integers(1, 4))
def test_the_lines_of_a_grid_go_on_beside_one_another_from_the_states_of_the_first(
    data: st.DataObject, size: int
) -> None:
    """Each state is reached from the one it starts from, which `Canned` checks, and where one fails the lines that
    start from it are lost and no others."""
    names = [step.name for step in plan(GRID.design)]
    study, kept = run([], size, lambda n: data.draw(st.integers(0, n - 1)), whole=GRID)
    assert same(study, GRID)
    assert sorted(kept) == sorted(names)
    error, kept = run([], size, lambda n: data.draw(st.integers(0, n - 1)), ("pull-x-0.06",), GRID)
    assert isinstance(error, ConvergenceError)
    assert set(names) - set(kept) == {"pull-x-0.06", "pull-x0p06-shear--0.01", "pull-x0p06-shear--0.04"}
