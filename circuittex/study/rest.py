"""How long the rest of a study will take, from the states that the same run has finished."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

ENOUGH = 2
"""Finished states before anything is said: the first of a run holds start-up, and often takes the longest."""


@dataclass
class Rest:
    """Counts states as they are finished and adds an estimate to what is said meanwhile.

    Nothing is said before `ENOUGH` states are finished: steps of a path take anything from a third to three times their
    mean, and an estimate from nothing would be none.
    """

    total: int
    """States of the study."""
    kept: int
    """States that are finished."""
    say: Callable[[str], None]
    clock: Callable[[], float] = time.monotonic
    finished: list[float] = field(default_factory=list)
    """When states were finished, s."""

    def done(self) -> None:
        """Count one more state."""
        self.kept += 1
        self.finished.append(self.clock())

    def __call__(self, text: str) -> None:
        """Say `text`, with the estimate where there is one; a line that stays on the screen is said as it is."""
        words = "" if text.endswith("\n") else self.words()
        self.say(f"{text}{words}")

    def words(self) -> str:
        """The estimate, such as '; about 3 min left'.

        >>> ticks = iter([0.0, 10.0, 20.0])
        >>> rest = Rest(5, 0, print, lambda: next(ticks))
        >>> rest.done(); rest.done(); rest.words()
        '; 2 of 5 states, about 30 s left'
        """
        if len(self.finished) < ENOUGH or self.kept >= self.total:
            return ""
        seconds = (self.finished[-1] - self.finished[0]) / (len(self.finished) - 1) * (self.total - self.kept)
        length = f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min" if seconds < 6000 else ""
        return f"; {self.kept} of {self.total} states, about {length or f'{seconds / 3600:.1f} h'} left"
