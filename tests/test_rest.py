"""The estimate of how long a study will take: right where states are alike, silent where nothing can be known."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np
import pytest

from circuittex.study.rest import ENOUGH, LEAST, Rest

ROUNDED = 0.5
"""Minutes: what is said is rounded to whole ones."""


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def said(rest: Rest) -> float | None:
    """The estimate, min; None where none is given."""
    found = re.search(r"~([\d.]+) (s|min|h) left$", rest.words())
    return float(found[1]) * {"s": 1 / 60, "min": 1.0, "h": 60.0}[found[2]] if found else None


def study(paths: dict[str, int], workers: int) -> tuple[Rest, Clock]:
    """A study whose relaxed state, which takes long, has just been finished."""
    clock = Clock()
    rest = Rest(Counter({"": 1, **paths}), 1 + sum(paths.values()), workers, lambda _: None, clock)
    clock.now = 7200.0
    rest.done("")
    return rest, clock


def test_one_path_of_equal_states() -> None:
    rest, clock = study({"stretch": 20}, 1)
    for state in range(1, 20):
        clock.now += 180.0
        rest.done("stretch")
        expected = 3.0 * (20 - state) if state >= ENOUGH else None
        assert said(rest) == (None if expected is None else pytest.approx(expected, abs=ROUNDED))


def test_two_paths_whose_states_are_finished_almost_at_once() -> None:
    """Half a second between two ends says nothing about a state: each took ten minutes."""
    rest, clock = study({"stretch": 9, "shear": 9}, 2)
    begin = clock.now
    for state in range(1, 9):
        for path, late in (("stretch", 0.0), ("shear", 0.5)):
            clock.now = begin + 600.0 * state + late
            rest.done(path)
        # Both paths go on beside one another: the time for one of them.
        expected = None if state < ENOUGH else pytest.approx(10.0 * (9 - state), abs=ROUNDED)
        assert said(rest) == expected


def test_the_longest_path_counts_when_the_others_are_done() -> None:
    """Two workers, but a single path is left: nobody shares its states."""
    rest, clock = study({"stretch": 3, "shear": 13}, 2)
    for _ in range(3):
        clock.now += 600.0
        rest.done("stretch")
        rest.done("shear")
    assert said(rest) == pytest.approx(100.0, abs=60 * 0.05 + ROUNDED), (
        "ten states of ten minutes, in tenths of an hour"
    )


def test_more_paths_than_workers_are_shared_out() -> None:
    rest, clock = study(dict.fromkeys("abcd", 5), 2)
    for path in "aabb":
        clock.now += 300.0  # one of two workers finishes a state of ten minutes every five
        rest.done(path)
    assert said(rest) == pytest.approx(16 * 10.0 / 2, abs=ROUNDED)


def test_it_runs_down_and_ends_where_it_was_wrong() -> None:
    rest, clock = study({"stretch": 4}, 1)
    for _ in range(2):
        clock.now += 600.0
        rest.done("stretch")
    shown = []
    for _ in range(60):
        shown.append(said(rest))
        clock.now += 60.0
    known = [minutes for minutes in shown if minutes is not None]
    np.testing.assert_allclose(known, 20.0 - np.arange(len(known)), atol=ROUNDED)
    assert len(known) == 20, "a state that takes longer than two should is not known to end soon"
    assert shown[20:] == [None] * 40
    assert rest.words() == "; 3/5"


def test_nothing_is_known_at_first_nor_said_of_moments() -> None:
    clock = Clock()
    rest = Rest(Counter({"": 1, "stretch": 4}), 5, 1, lambda _: None, clock)
    assert rest.words() == ""
    clock.now = 1000.0
    rest.done("")
    assert rest.words() == "; 1/5"
    for _ in range(3):
        clock.now += 0.9 * LEAST
        rest.done("stretch")
    assert rest.words() == "; 4/5"
    rest.done("stretch")
    assert rest.words() == ""


def test_states_of_an_earlier_run_say_nothing_about_time() -> None:
    """A study of which seven states are there: only what this run finishes counts."""
    clock = Clock()
    texts: list[str] = []
    rest = Rest(Counter({"stretch": 3}), 10, 1, texts.append, clock)
    rest("stretch-0.08: iteration 1")
    for _ in range(2):
        clock.now += 60.0
        rest.done("stretch")
    rest("stretch-0.1: iteration 1")
    rest("7 states are there\n")
    assert texts == [
        "stretch-0.08: iteration 1; 7/10",
        "stretch-0.1: iteration 1; 9/10, ~60 s left",
        "7 states are there\n",
    ]
