"""The set-up of `make run` and `make test` says what it does and nothing else, unless it fails."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PYTHON = """#!/bin/sh
case "$*" in
    *version_info*) echo 3.11 ;;
    *"-m venv"*) for last; do :; done; mkdir -p "$last/bin"; cp "$0" "$last/bin/python" ;;
    *"-m pip"*) echo "Collecting numpy"; echo "WARNING: a new release of pip is there" >&2; exit $PIP ;;
esac
"""
"""Stands in for an interpreter whose pip talks on both streams and ends with the code in PIP."""
APT = """#!/bin/sh
echo "Reading package lists..."
echo "debconf: delaying package configuration" >&2
exit $APT
"""
pytestmark = pytest.mark.skipif(shutil.which("bash") is None, reason="the set-up is a bash script")


@pytest.fixture
def tools(tmp_path: Path) -> Path:
    """A folder for PATH with an interpreter, apt-get and sudo that install nothing, and no ngspice."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name, text in {"python": PYTHON, "apt-get": APT, "sudo": '#!/bin/sh\nshift\nexec "$@"\n'}.items():
        (folder / name).write_text(text, encoding="ascii")
        (folder / name).chmod(0o755)
    for name in ("bash", "sh", "env", "dirname", "mktemp", "cat", "rm", "touch", "mkdir", "cp", "id"):
        (folder / name).symlink_to(str(shutil.which(name)))
    return folder


def set_up(tools: Path, what: str, pip: int = 0, apt: int = 0) -> tuple[int, list[str]]:
    """Exit code of `.ci/setup` and the lines that it shows."""
    environment = {
        "PATH": str(tools),
        "PYTHON": str(tools / "python"),
        "VENV": str(tools.parent / "venv"),
        "TMPDIR": str(tools.parent),
        "PIP": str(pip),
        "APT": str(apt),
    }
    done = subprocess.run(
        [str(tools / "bash"), str(ROOT / ".ci" / "setup"), what],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
        text=True,
        timeout=60,
    )
    return done.returncode, done.stdout.splitlines()


def test_the_environment_is_one_line(tools: Path) -> None:
    code, lines = set_up(tools, "environment")
    assert code == 0
    (line,) = lines
    assert line.startswith("setup: making the environment ")
    assert (tools.parent / "venv" / ".ready").exists()


def test_what_pip_says_is_shown_where_it_fails(tools: Path) -> None:
    code, lines = set_up(tools, "environment", pip=1)
    assert code != 0
    assert "Collecting numpy" in lines
    assert not (tools.parent / "venv" / ".ready").exists()


def test_what_apt_says_is_shown_where_it_fails(tools: Path) -> None:
    """There is no ngspice before or after: the set-up says what that means, and what apt-get said only if it failed."""
    code, lines = set_up(tools, "ngspice")
    assert code == 0, "a run goes on without ngspice"
    assert all(line.startswith("setup: ") for line in lines)
    assert lines[0] == "setup: installing ngspice libngspice0 with apt-get"
    code, lines = set_up(tools, "ngspice", apt=1)
    assert code == 0
    assert lines.count("Reading package lists...") == 1
