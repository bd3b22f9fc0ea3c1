"""What is shown while a command works."""

from __future__ import annotations

import shutil
import time
from typing import TextIO

OCCASIONALLY = 10.0
"""Seconds between lines about the same thing where the output is no terminal."""


class Progress:
    """Shows what is being done: one updating line on a terminal, plain lines now and then elsewhere.

    A text that ends with a line break stays on the terminal. Elsewhere a text is left out that begins like the last
    line, up to its colon, unless some seconds have passed: a log needs no line for each iteration.
    """

    def __init__(self, stream: TextIO, *, show: bool = True) -> None:
        self._stream, self._show = stream, show
        self._updating = stream.isatty()
        self._last = ("", float("-inf"))

    def __call__(self, text: str) -> None:
        """Show `text`, which is one line."""
        if not self._show:
            return
        if self._updating and not text.endswith("\n"):
            width = shutil.get_terminal_size().columns - 1
            self._stream.write(f"\r\x1b[2K{text[:width]}")
        elif text.endswith("\n") or self._due(text):
            start = "\r\x1b[2K" if self._updating else ""
            self._stream.write(f"{start}{text.rstrip()}\n")
        self._stream.flush()

    def _due(self, text: str) -> bool:
        about, now = text.partition(":")[0], time.monotonic()
        if about == self._last[0] and now - self._last[1] < OCCASIONALLY:
            return False
        self._last = about, now
        return True

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._show and self._updating:
            self._stream.write("\r\x1b[2K")
            self._stream.flush()
