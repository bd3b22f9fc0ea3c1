"""Where circuittex runs: closed streams, encodings, read-only folders, network shares, other programs."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from small_design import BARE, NEVER, SMALL

import circuittex
from circuittex.command.exit_codes import ExitCode
from circuittex.design import load_design, starter

SECONDS = 300
"""Compilation anew included, on a machine that does other work as well."""


def shell(folder: Path, command: str, **environment: str | None) -> subprocess.CompletedProcess[bytes]:
    """What a shell command leaves, with `circuittex` for this package's command line."""
    variables = {**os.environ, "PYTHON": sys.executable, **environment}
    return subprocess.run(
        ["sh", "-c", re.sub("^circuittex", '"$PYTHON" -m circuittex', command)],
        cwd=folder,
        env={name: value for name, value in variables.items() if value is not None},
        capture_output=True,
        timeout=SECONDS,
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "small.toml").write_text(SMALL, encoding="utf-8")
    (tmp_path / "bare.toml").write_text(BARE, encoding="utf-8")
    (tmp_path / "never.toml").write_text(NEVER, encoding="utf-8")
    return tmp_path


# Of a module that it does not know matplotlib believes that it is there; of a notebook's it looks.
@pytest.mark.parametrize("backend", ["module://matplotlib_inline.backend_inline", "no_such_backend"])
def test_the_backend_of_a_notebook_that_is_not_installed_here(folder: Path, backend: str) -> None:
    done = shell(folder, "circuittex run small.toml --out o --quiet", MPLBACKEND=backend)
    assert (done.returncode, done.stderr) == (ExitCode.DONE, b"")


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", ">&- 2>&-"])
def test_closed_streams(folder: Path, closed: str) -> None:
    done = shell(folder, f"circuittex run bare.toml --out o {closed}")
    assert done.returncode == ExitCode.DONE
    assert (folder / "o" / "summary.json").exists()


@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "utf-8", "utf-16"])
def test_a_starter_design_is_utf8_whatever_the_encoding_of_the_terminal(folder: Path, encoding: str) -> None:
    done = shell(folder, "circuittex new > new.toml", PYTHONIOENCODING=encoding)
    assert (done.returncode, done.stderr) == (ExitCode.DONE, b"")
    assert (folder / "new.toml").read_text(encoding="utf-8") == starter()
    load_design(folder / "new.toml")


def test_names_that_the_terminal_cannot_show(folder: Path) -> None:
    done = shell(folder, "circuittex run bare.toml --out Köper", PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert done.returncode == ExitCode.DONE
    assert b"report: K\\xf6per" in done.stdout


def test_a_full_disk_behind_the_standard_output(folder: Path) -> None:
    done = shell(folder, "circuittex new > /dev/full")
    assert done.returncode == ExitCode.FILES
    assert done.stderr.count(b"\n") == 1


def test_no_equilibrium_and_a_bad_design_are_told_apart(folder: Path) -> None:
    assert shell(folder, "circuittex run never.toml --out o --quiet").returncode == ExitCode.NO_EQUILIBRIUM
    assert shell(folder, "circuittex run small.toml --out small.toml --quiet").returncode == ExitCode.DESIGN
    assert shell(folder, "circuittex walk").returncode == ExitCode.USAGE


UNDRAWN = """
import sys
from importlib import import_module
from circuittex.command.cli import main
import_module("circuittex.results.report.page").save_figures = lambda study, folder: {}
sys.exit(main())
"""
"""The command line, but for the pictures of a report."""


def test_a_simulator_that_is_absent_and_one_that_fails_are_told_apart(folder: Path) -> None:
    (folder / "undrawn.py").write_text(UNDRAWN, encoding="utf-8")
    broken = folder / "broken"
    broken.write_text("#!/bin/sh\nexit 3\n")
    broken.chmod(0o755)
    run = '"$PYTHON" undrawn.py run small.toml --quiet --out'
    assert shell(folder, f"{run} absent", CIRCUITTEX_NGSPICE="").returncode == ExitCode.DONE
    assert shell(folder, f"{run} failed", CIRCUITTEX_NGSPICE=str(broken)).returncode == ExitCode.SIMULATOR
    assert shell(folder, f"{run} there").returncode == ExitCode.DONE
    assert shell(folder, "circuittex verify there", CIRCUITTEX_NGSPICE="").returncode == ExitCode.NOT_CHECKED
    assert shell(folder, "circuittex verify there", CIRCUITTEX_NGSPICE=str(broken)).returncode == ExitCode.SIMULATOR


WITHOUT = """
import errno, fcntl, os, stat, sys
fsync = os.fsync

def no_folders(handle):
    if stat.S_ISDIR(os.fstat(handle).st_mode):
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
    return fsync(handle)

def refuse(handle, operation, *rest):
    raise OSError(code, os.strerror(code))

what, code = sys.argv[1], int(sys.argv[2])
if what in ("fsync", "both"):
    os.fsync = no_folders
if what in ("flock", "both"):
    fcntl.flock = fcntl.lockf = refuse
from importlib import import_module
from circuittex.command.cli import main
if what != "both":  # pictures are written as any other file: once is enough
    import_module("circuittex.results.report.page").save_figures = lambda study, folder: {}
sys.exit(main(["run", "small.toml", "--out", "o", "--quiet", "--workers", "1"]))
"""
"""As some FUSE, SMB and 9p mounts do, and NFS without its lock daemon."""


@pytest.mark.parametrize(
    ("what", "code", "notes"), [("fsync", 22, 1), ("flock", 37, 1), ("flock", 95, 1), ("flock", 38, 1), ("both", 37, 2)]
)
def test_a_network_share_completes_with_a_note(folder: Path, what: str, code: int, notes: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT, what, str(code)], cwd=folder, capture_output=True, text=True, timeout=SECONDS
    )
    assert done.returncode == ExitCode.DONE, done.stderr
    assert (folder / "o" / "report.html").exists()
    lines = done.stderr.splitlines()
    assert len(lines) == notes, "each note is said once"
    assert all(line.startswith("circuittex: note: o: its file system") for line in lines)


LOADING = """
from circuittex.command.figures import plain_figures
from circuittex.command.streams import show_notes

show_notes()
plain_figures()
import matplotlib.font_manager
from circuittex.base.workers import Pool
from circuittex.study.record import reach

pool = Pool(2, 1, print)
for name in ("first", "second"):
    pool.submit(name, reach)
for _ in range(2):
    try:
        pool.next()
    except TypeError:  # it got nothing to work on, but has loaded everything
        pass
pool.close()
"""
"""What a run with two worker processes loads, without the work."""


@pytest.mark.skipif(shutil.which("setpriv") is None, reason="needs util-linux to take root's rights away")
@pytest.mark.parametrize("foreign", [False, True])
def test_a_read_only_installation_without_a_home(folder: Path, foreign: bool) -> None:
    """Compiled functions are kept among the temporary files, unless somebody else could have put them there.

    One note, though worker processes compile as well and matplotlib finds no home either (which says so itself, where
    there is no private folder for it). What a run loads is loaded; to compile all of it anew would be long here.
    """
    package = Path(circuittex.__file__).parent
    for name in ("site", "home", "tmp"):
        (folder / name).mkdir()
    private = folder / "tmp" / f"circuittex-{os.getuid()}"
    if foreign:
        private.mkdir()
        private.chmod(0o777)
    (folder / "load.py").write_text(LOADING, encoding="utf-8")
    shutil.copytree(package, folder / "site" / "circuittex", ignore=shutil.ignore_patterns("__pycache__"))
    subprocess.run(["chmod", "-R", "a-w", "site", "home"], cwd=folder, check=True)
    rights = "-dac_override,-dac_read_search,-fowner"
    take = f"--bounding-set={rights} --inh-caps={rights}" if os.getuid() == 0 else ""
    done = shell(
        folder,
        f'setpriv {take} "$PYTHON" load.py',
        PYTHONPATH=str(folder / "site"),
        HOME=str(folder / "home"),
        XDG_CONFIG_HOME=None,
        XDG_CACHE_HOME=None,
        NUMBA_CACHE_DIR=None,
        MPLCONFIGDIR=None,
        TMPDIR=str(folder / "tmp"),
    )
    subprocess.run(["chmod", "-R", "u+w", "site", "home"], cwd=folder, check=True)
    assert done.returncode == 0, done.stderr.decode()
    lines = done.stderr.decode().splitlines()
    (note,) = lines if not foreign else [line for line in lines if "compiled functions" in line]
    assert note.startswith("circuittex: note: neither the installation nor the home folder can be written to: ")
    assert note.endswith("compiled anew in every process" if foreign else f"kept in {private}")
