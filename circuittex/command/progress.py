"""What is shown while a command works."""

from __future__ import annotations

import shutil
import time
from typing import TextIO

from circuittex.command.streams import CLEAR

OCCASIONALLY = 10.0
"""Seconds between lines about the same thing where the output is no terminal."""


class Progress:
    """Shows what is being done: one updating line on a terminal, plain lines now and then elsewhere.

    A text that ends with a line break stays on the terminal. Elsewhere a text is left out that begins like a line that
    was written some seconds ago or less, up to its colon: a log needs no line for each iteration, whether one path is
    followed or several beside one another.
    """

    def __init__(self, stream: TextIO, *, show: bool = True) -> None:
        self._stream, self._show = stream, show
        self._updating = stream.isatty()
        self._written: dict[str, float] = {}

    def __call__(self, text: str) -> None:
        """Show `text`, which is one line."""
        if not self._show:
            return
        if self._updating and not text.endswith("\n"):
            width = shutil.get_terminal_size().columns - 1
            self._stream.write(f"{CLEAR}{_fitted(text, width)}")
        elif text.endswith("\n") or self._due(text):
            start = CLEAR if self._updating else ""
            self._stream.write(f"{start}{text.rstrip()}\n")
        self._stream.flush()

    def _due(self, text: str) -> bool:
        about, now = text.partition(":")[0], time.monotonic()
        if now - self._written.get(about, float("-inf")) < OCCASIONALLY:
            return False
        self._written[about] = now
        return True

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._show and self._updating:
            self._stream.write(CLEAR)
            self._stream.flush()


def _fitted(text: str, width: int) -> str:
    """The text on one line: what stands behind its last semicolon is kept, and parts before it go as a whole.

    >>> _fitted("relaxed: iteration 3, largest free force 1.2e-03 N; 2/9", 50)
    'relaxed: iteration 3; 2/9'
    """
    head, mark, end = text.rpartition("; ")
    while len(head) + len(mark) + len(end) > width and ", " in head:
        head = head.rpartition(", ")[0]  # a number that is cut would be read as another one
    return f"{head}{mark}{end}"[:width]
