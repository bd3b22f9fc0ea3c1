"""How long the other states of a study will take, from those that the same run has finished."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from circuittex.study.forecast import Forecast, gigabytes

ENOUGH = 2
"""States that every worker must have finished, one with another, before anything is said about time: steps of a path
take anything from a third to three times their mean."""
LEAST = 5.0
"""Seconds that are not worth saying."""


@dataclass
class Rest:
    """Counts states as they are finished and adds to what is said meanwhile how many there are and, where it can be
    told, how long the others will take.

    Workers follow a loading path each, as long as there are paths to follow. What they have spent on the states that
    are finished gives the time for one; the longest path, or all states shared out, whichever takes longer, gives the
    time for the others. Work that has been begun counts as not done, so that the estimate errs on the long side. The
    relaxed state, where everything starts, has another length than the steps and does not count. A state that takes
    longer than was foreseen for all of them makes the estimate worthless: then nothing is said.

    Before, there is what was foreseen, if anything was: for the relaxed state, and for a step in the same proportion to
    what the relaxed state takes. Each of the first steps replaces its part of that.
    """

    left: Counter[str]
    """States to come on each loading path, '' for the relaxed one."""
    total: int
    """States of the study."""
    workers: int
    """Loading paths that are followed at the same time, at most."""
    say: Callable[[str], None]
    clock: Callable[[], float] = time.monotonic
    foreseen: Forecast | None = None
    partly: bool = False
    """Whether an earlier run did a part of the relaxed state, whose time then says nothing of the others."""
    since: float = field(init=False)
    """When the last state was finished, s."""
    spent: float = 0.0
    """What the workers have spent on `steps`, s."""
    steps: int = 0
    """States of paths that are finished."""
    pace: float = 1.0
    """What the relaxed state took, in parts of what was foreseen."""

    def __post_init__(self) -> None:
        self.since = self.clock()

    @property
    def kept(self) -> int:
        """States that are finished."""
        return self.total - self.left.total()

    def done(self, loading: str) -> None:
        """Count one more state, of that loading path."""
        now = self.clock()
        if loading:
            self.spent += (now - self.since) * self._busy()
            self.steps += 1
        elif self.foreseen is not None and not self.partly:
            self.pace = (now - self.since) / self.foreseen.first
        self.since = now
        self.left[loading] -= 1

    def __call__(self, text: str) -> None:
        """Say `text` with what is known of the others; a line that stays on the screen is said as it is."""
        self.say(text if text.endswith("\n") else f"{text}{self.words()}")

    def opening(self) -> str:
        """What is known before the first state: the line that a run begins with.

        >>> foreseen = Forecast(first=600.0, step=90.0, workers=1, memory=1.2e9)
        >>> Rest(Counter({"": 1, "stretch": 20}), 21, 1, print, lambda: 0.0, foreseen).opening()
        'about 40 min, 1.2 GB; 21 states'
        """
        many = self.left.total()
        states = "1 state" if many == 1 else f"{many} states"
        if self.foreseen is None:
            return f"under a minute; {states}"
        wanted, given = min(self.workers, self._paths()), self.foreseen.workers
        by = f", by {given} instead of {wanted} workers for want of memory" if given < wanted else ""
        return f"about {length(self.seconds())}, {gigabytes(self.foreseen.memory)}; {states}{by}"

    def words(self) -> str:
        """What is known of the states, such as '; 3/9, ~3 min left'; a terminal has little room.

        >>> ticks = iter([0.0, 60.0, 70.0, 90.0, 90.0])
        >>> rest = Rest(Counter({"": 1, "stretch": 4}), 5, 1, print, lambda: next(ticks))
        >>> rest.done(""), rest.done("stretch"), rest.done("stretch"), rest.words()
        (None, None, None, '; 3/5, ~30 s left')
        """
        if not self.kept < self.total or not (self.kept or self.foreseen):
            return ""
        count = f"; {self.kept}/{self.total}"
        seconds = self.seconds()
        return f"{count}, ~{length(seconds)} left" if seconds >= LEAST else count

    def seconds(self) -> float:
        """What the others will take, s; 0 where it cannot be told."""
        busy, elapsed, pace, first = self._busy(), self.clock() - self.since, self.pace, 0.0
        if self.foreseen is not None and self.left[""]:
            first = max(0.0, self.foreseen.first - elapsed)
            pace, elapsed = max(1.0, elapsed / self.foreseen.first), 0.0
        each = self._each(busy, pace)
        paths = [count for loading, count in self.left.items() if loading]
        return first + each * max(max(paths, default=0), sum(paths) / busy) - elapsed if each else 0.0

    def _each(self, busy: int, pace: float) -> float:
        """What a worker takes for a step, s; 0 where it cannot be told."""
        enough = ENOUGH * busy
        if self.steps >= enough:
            return self.spent / self.steps
        if self.foreseen is None:
            return 0.0
        return (self.spent + (enough - self.steps) * pace * self.foreseen.step) / enough

    def _busy(self) -> int:
        """Workers that have a path to follow, or will have when the relaxed state is there."""
        most = self.workers if self.foreseen is None else self.foreseen.workers
        return max(1, min(most, self._paths()))

    def _paths(self) -> int:
        """Loading paths with states to come."""
        return sum(count > 0 for loading, count in self.left.items() if loading)


def length(seconds: float) -> str:
    """A time in words, no finer than it can be known.

    >>> length(22.0), length(400.0), length(9000.0)
    ('20 s', '7 min', '2.5 h')
    """
    if seconds < 95.0:
        return f"{max(5, 10 * round(seconds / 10))} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400.0 else f"{seconds / 3600:.1f} h"
