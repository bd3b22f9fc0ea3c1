"""What is shown while a command works: one line on a terminal, some lines elsewhere, and notes in between."""

from __future__ import annotations

import io
import re
import warnings

import pytest

from circuittex.base.errors import CircuittexWarning
from circuittex.command.progress import Progress
from circuittex.command.streams import complain, show_notes


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_is_one_updating_line_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "20")
    stream = Terminal()
    with Progress(stream) as progress:
        progress("first")
        progress("second " * 10)
    text = stream.getvalue()
    assert "\n" not in text
    assert text.split("\r\x1b[2K") == ["", "first", ("second " * 10)[:19], ""]


def test_a_usual_line_fits_a_usual_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eighty columns hold state, iteration, residual and rest; what is narrower keeps the rest and no half a number."""
    line = "stretch-0.025: iteration 12, largest free force 3.1e-09 N; 12/21, ~20 min left"
    for columns, shown in ((80, line), (60, "stretch-0.025: iteration 12; 12/21, ~20 min left")):
        monkeypatch.setenv("COLUMNS", str(columns))
        stream = Terminal()
        Progress(stream)(line)
        assert stream.getvalue() == f"\r\x1b[2K{shown}"


def test_progress_is_plain_lines_elsewhere() -> None:
    stream = io.StringIO()
    with Progress(stream) as progress:
        progress("first")
        progress("second\n")
    assert stream.getvalue() == "first\nsecond\n"


def test_a_log_gets_a_line_now_and_then_also_of_two_paths_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred iterations a second on each of two paths, for 25 s: a line at the start and one every ten seconds."""
    now = 0.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    stream = io.StringIO()
    progress = Progress(stream)
    for iteration in range(2500):
        now = iteration / 100
        progress(f"stretch-0.1: iteration {iteration}")
        progress(f"shear-0.1: iteration {iteration}")
    lines = stream.getvalue().splitlines()
    assert lines == [f"{path}-0.1: iteration {i}" for i in (0, 1000, 2000) for path in ("stretch", "shear")]


def test_a_note_and_a_complaint_take_the_place_of_the_line_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Terminal()
    monkeypatch.setattr("sys.stderr", stream)
    with warnings.catch_warnings():  # restores how warnings are shown
        warnings.simplefilter("always")
        show_notes()
        with Progress(stream) as progress:
            progress("relaxed: iteration 1")
            warnings.warn("no locks", CircuittexWarning, stacklevel=1)
            progress("relaxed: iteration 2")
            complain("error", "no\nequilibrium")
    shown = [re.sub(r".*\r\x1b\[2K", "", line) for line in stream.getvalue().split("\n")[:-1]]
    assert shown == ["circuittex: note: no locks", "circuittex: error: no equilibrium"]


def test_what_ends_with_a_line_break_stays_on_the_terminal() -> None:
    stream = Terminal()
    with Progress(stream) as progress:
        progress("first")
        progress("3 of 21 states are there already\n")
        progress("second")
    start = "\r\x1b[2K"
    assert stream.getvalue() == f"{start}first{start}3 of 21 states are there already\n{start}second{start}"
