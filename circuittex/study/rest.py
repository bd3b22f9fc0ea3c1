"""How long the other states of a study will take, from those that the same run has finished."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

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
    """

    left: Counter[str]
    """States to come on each loading path, '' for the relaxed one."""
    total: int
    """States of the study."""
    workers: int
    """Loading paths that are followed at the same time, at most."""
    say: Callable[[str], None]
    clock: Callable[[], float] = time.monotonic
    since: float = field(init=False)
    """When the last state was finished, s."""
    spent: float = 0.0
    """What the workers have spent on `steps`, s."""
    steps: int = 0
    """States of paths that are finished."""

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
        self.since = now
        self.left[loading] -= 1

    def __call__(self, text: str) -> None:
        """Say `text` with what is known of the others; a line that stays on the screen is said as it is."""
        self.say(text if text.endswith("\n") else f"{text}{self.words()}")

    def words(self) -> str:
        """What is known of the states, such as '; 3/9, ~3 min left'; a terminal has little room.

        >>> ticks = iter([0.0, 60.0, 70.0, 90.0, 90.0])
        >>> rest = Rest(Counter({"": 1, "stretch": 4}), 5, 1, print, lambda: next(ticks))
        >>> rest.done(""), rest.done("stretch"), rest.done("stretch"), rest.words()
        (None, None, None, '; 3/5, ~30 s left')
        """
        if not 0 < self.kept < self.total:
            return ""
        count = f"; {self.kept}/{self.total}"
        seconds = self._seconds()
        return f"{count}, ~{_length(seconds)} left" if seconds >= LEAST else count

    def _seconds(self) -> float:
        """What the others will take, s; 0 where it cannot be told."""
        busy = self._busy()
        if self.steps < ENOUGH * busy:
            return 0.0
        longest = max(max(self.left.values()), self.left.total() / busy)
        return self.spent / self.steps * longest - (self.clock() - self.since)

    def _busy(self) -> int:
        """Workers that have a path to follow."""
        return min(self.workers, sum(count > 0 for count in self.left.values()))


def _length(seconds: float) -> str:
    """A time in words, no finer than it can be known."""
    if seconds < 95.0:
        return f"{max(5, 10 * round(seconds / 10))} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400.0 else f"{seconds / 3600:.1f} h"
