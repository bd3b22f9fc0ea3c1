"""ngspice: what it answers, and that nothing it does wrong passes for an answer."""

from __future__ import annotations

import errno
import os
import shutil
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from circuittex.base.errors import NgspiceError
from circuittex.electrical.spice.ngspice import estimated_seconds, feasible, find_ngspice, read_raw, run_deck, run_decks

DIVIDER = "* divider\nv1 top 0 1\nr1 top mid 1\nr2 mid 0 3\n.op\n.end\n"
Fake = Callable[[str], None]


@pytest.fixture
def fake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fake:
    """Puts a Python program in the place of ngspice."""

    def install(program: str) -> None:
        path = tmp_path / "fake-ngspice"
        path.write_text(f"#!{sys.executable}\n{program}", encoding="utf-8")
        path.chmod(0o755)
        monkeypatch.setenv("CIRCUITTEX_NGSPICE", str(path))

    return install


def raw_file(
    values: bytes, *, variables: int = 1, points: int = 1, flags: str = "real", mark: str = "Binary:"
) -> bytes:
    rows = "".join(f"\t{i}\tv(n{i})\tvoltage\n" for i in range(variables))
    head = f"Title: t\nPlotname: Operating Point\nFlags: {flags}\nNo. Variables: {variables}\nNo. Points: {points}\n"
    return f"{head}Variables:\n{rows}{mark}\n".encode() + values


# the real one


def test_ngspice_is_there() -> None:
    """Without it nothing here is verified: install ngspice (`make ngspice`)."""
    assert find_ngspice() is not None


def test_voltage_divider_to_the_last_digit() -> None:
    (plot,) = run_deck(DIVIDER).plots
    assert plot.name == "Operating Point"
    assert_allclose(plot.voltage(["top", "MID", "0"]), [[1.0, 0.75, 0.0]], rtol=1e-15)
    assert_allclose(plot.current("V1"), [-0.25], rtol=1e-15)


def test_several_analyses_of_one_deck() -> None:
    deck = DIVIDER.replace(".op", ".op\n.dc v1 0 2 0.5")
    plots = {plot.name: plot for plot in run_deck(deck).plots}
    assert set(plots) == {"Operating Point", "DC transfer characteristic"}
    assert_allclose(plots["DC transfer characteristic"].voltage(["mid"])[:, 0], 0.75 * np.arange(0, 2.5, 0.5))


def test_several_decks_in_one_process_are_told_apart() -> None:
    decks = [DIVIDER.replace("v1 top 0 1", f"v1 top 0 {v}.0") for v in (1, 2, 3)]
    found = run_decks(decks)
    assert [data.plots[0].voltage(["mid"]).item() for data in found] == pytest.approx([0.75, 1.5, 2.25], rel=1e-15)


def test_settings_of_the_user_have_no_influence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / ".spiceinit").write_text("set filetype=ascii\nquit\n", encoding="ascii")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SPICE_ASCIIRAWFILE", "1")
    monkeypatch.setenv("LC_ALL", "de_DE.UTF-8")
    assert run_deck(DIVIDER).plots[0].voltage(["mid"]).item() == 0.75
    assert sorted(p.name for p in tmp_path.iterdir()) == [".spiceinit"]


def test_words_of_a_title_are_no_complaint() -> None:
    assert run_deck(DIVIDER.replace("* divider", "* fatal error: singular matrix")).plots[0].values.shape == (1, 3)


@pytest.mark.parametrize(
    ("deck", "message"),
    [
        ("* floating\nv1 a 0 1\nr1 a 0 1\nr2 c d 1\n.op\n.end\n", "singular matrix"),
        ("* loop\nv1 a 0 1\nv2 a 0 2\nr1 a 0 1\n.op\n.end\n", "DC solution failed"),
        ("* syntax\nv1 a 0 1\nr1 a\nfoo bar\n.op\n.end\n", "[Ee]rror"),
        ("* not a number\nv1 a 0 nan\nr1 a 0 1\n.op\n.end\n", "[Ee]rror"),
        ("* no analysis\nv1 a 0 1\nr1 a 0 1\n.end\n", "ran no analysis"),
        ("", "ran no analysis"),
    ],
)
def test_unsound_decks_are_told_whatever_the_exit_status(deck: str, message: str) -> None:
    with pytest.raises(NgspiceError, match=message) as caught:
        run_deck(deck)
    assert "\n" not in str(caught.value)
    with pytest.raises(NgspiceError, match=message):  # and a sound neighbour does not answer for it
        run_decks([DIVIDER, deck, DIVIDER])


def test_values_that_are_not_there() -> None:
    plot = run_deck(DIVIDER).plots[0]
    with pytest.raises(NgspiceError, match=r"lacks 1 of 2 values, first v\(nowhere\)"):
        plot.voltage(["mid", "nowhere"])
    with pytest.raises(NgspiceError, match=r"i\(v9\)"):
        plot.current("v9")


# size


def test_infeasible_decks_are_refused_before_the_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    deck = "* chain\nv1 n0 0 1\n" + "".join(f"r{i} n{i} n{i + 1} 1\n" for i in range(200_000)) + ".op\n.end\n"
    monkeypatch.setattr("circuittex.electrical.spice.ngspice.subprocess.Popen", lambda *_, **__: pytest.fail("started"))
    with pytest.raises(NgspiceError, match=r"200000 resistors.*solve_nodal"):
        run_deck(deck)


def test_estimate_grows_faster_than_the_size() -> None:
    assert 2 * estimated_seconds(10_000) < estimated_seconds(20_000)
    assert feasible(1000)
    assert not feasible(1_000_000)


# missing, crashing, hanging, answering rubbish


def test_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("CIRCUITTEX_NGSPICE", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert find_ngspice() is None
    with pytest.raises(NgspiceError, match="not found"):
        run_deck(DIVIDER)


@pytest.mark.parametrize("value", ["", "/nowhere/ngspice", "/"])
def test_variable_that_names_nothing_that_runs(monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    monkeypatch.setenv("CIRCUITTEX_NGSPICE", value)
    assert find_ngspice() is None


def test_not_a_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "ngspice"
    path.write_bytes(b"\x7fELF rubbish")
    path.chmod(0o755)
    monkeypatch.setenv("CIRCUITTEX_NGSPICE", str(path))
    with pytest.raises(NgspiceError, match="could not be started"):
        run_deck(DIVIDER)


def test_crash(fake: Fake) -> None:
    fake("import os, signal\nprint('half way', flush=True)\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    with pytest.raises(NgspiceError, match=r"crashed \(SIGSEGV\); its log ends: half way"):
        run_deck(DIVIDER)


def test_silence(fake: Fake) -> None:
    fake("")
    with pytest.raises(NgspiceError, match=r"wrote no result .*; it said nothing"):
        run_deck(DIVIDER)


def test_hang_is_ended_with_everything_it_started(fake: Fake, tmp_path: Path) -> None:
    child = tmp_path / "child"
    fake(
        "import subprocess, sys, time\n"
        "p = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])\n"
        f"open({str(child)!r}, 'w').write(str(p.pid))\n"
        "print('busy', flush=True)\ntime.sleep(600)\n"
    )
    start = time.perf_counter()
    with pytest.raises(NgspiceError, match=r"no answer within 2 s.*busy"):
        run_deck(DIVIDER, timeout=2.0)
    assert time.perf_counter() - start < 20.0
    pid = int(child.read_text())
    for _ in range(100):
        if not alive(pid):
            break
        time.sleep(0.05)
    assert not alive(pid)


def alive(pid: int) -> bool:
    """Whether a process runs; one that only waits to be collected does not."""
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "ran no analysis"),
        (b"hello", "not a binary raw file"),
        (np.random.default_rng(0).bytes(1000), "not a binary raw file|damaged header"),
        (raw_file(b"", mark="Values:"), "not a binary raw file"),
        (raw_file(b"1234"), "cut short: 4 of 8 bytes"),
        (raw_file(b"", points=10**12), "cut short"),
        (raw_file(b"", points=0), "no values"),
        (raw_file(bytes(16), flags="complex"), "strange header"),
        (raw_file(bytes(8), variables=1).replace(b"Variables: 1", b"Variables: 2"), "strange header"),
        (raw_file(bytes(8), variables=1).replace(b"Points: 1", b"Points: one"), "damaged header"),
        (raw_file(struct.pack("<d", float("nan"))), "not finite"),
        (raw_file(struct.pack("<d", float("inf"))), "not finite"),
    ],
)
def test_rubbish(fake: Fake, content: bytes, message: str) -> None:
    fake(f"open('deck0.raw', 'wb').write({content!r})\n")
    with pytest.raises(NgspiceError, match=message):
        run_deck(DIVIDER)


def test_a_full_disk_is_no_failure_of_ngspice(fake: Fake, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study that meets it must stop and go on later, not record a state as unchecked for good."""
    fake("open('deck0.raw', 'wb').write(b'Title: cut sh')\n")
    usage = shutil.disk_usage("/")
    monkeypatch.setattr("circuittex.electrical.spice.ngspice.shutil.disk_usage", lambda _: usage._replace(free=1000))
    with pytest.raises(OSError, match="No space left on device"):
        run_deck(DIVIDER)
    monkeypatch.undo()
    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OSError, match="No space left on device"):
        run_deck(DIVIDER)


def full(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_answer_to_another_question(fake: Fake) -> None:
    fake(f"open('deck0.raw', 'wb').write({raw_file(bytes(8))!r})\n")
    with pytest.raises(NgspiceError, match=r"lacks 1 of 1 values, first v\(mid\)"):
        run_deck(DIVIDER).plots[0].voltage(["mid"])


def test_much_talk_is_no_trouble(fake: Fake) -> None:
    fake(f"print('x' * 10_000_000)\nopen('deck0.raw', 'wb').write({raw_file(bytes(8))!r})\n")
    assert len(run_deck(DIVIDER).log) <= 200_000


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(NgspiceError, match="wrote no result"):
        read_raw(tmp_path / "none.raw")
