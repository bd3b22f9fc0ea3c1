"""Standard streams as they may be: closed, or in an encoding that lacks characters."""

from __future__ import annotations

import io
import os
import sys
import warnings
from typing import TextIO

from circuittex.base.errors import CircuittexWarning

CLEAR = "\r\x1b[2K"
"""Has a terminal begin its line anew."""


def complain(kind: str, text: str) -> None:
    """One line on the standard error, in place of what a terminal shows of the work."""
    start = CLEAR if sys.stderr.isatty() else ""
    print(f"{start}circuittex: {kind}:", " ".join(text.split()), file=sys.stderr)


def usable_streams() -> None:
    """Give closed standard streams the null device, and let no character be one that a stream cannot write.

    A closed descriptor would be taken by the next file that is opened, and what is meant for the terminal be written
    into that.
    """
    for number, mode in enumerate(("r", "w", "w")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which is this one
        name = ("stdin", "stdout", "stderr")[number]
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, mode, encoding="utf-8", closefd=False))
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def write_utf8(stream: TextIO, text: str) -> None:
    """Write a text that will be a file: in UTF-8, whatever the encoding of the stream."""
    binary = getattr(stream, "buffer", None)
    if binary is None:
        stream.write(text)
        return
    stream.flush()
    binary.write(text.encode("utf-8"))
    binary.flush()


def show_notes() -> None:
    """Have circuittex's own warnings shown as one line each, once; others stay as they are."""
    usual = warnings.showwarning

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if issubclass(category, CircuittexWarning):
            complain("note", str(message))
        else:
            usual(message, category, filename, lineno, file, line)

    warnings.showwarning = show
