"""One writer to a folder at a time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from circuittex.base.errors import FolderError
from circuittex.base.lock import locked

HOLD = """
import sys
from circuittex.base.lock import locked
with locked(sys.argv[1]):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_the_second_is_refused_until_the_first_is_killed(tmp_path: Path) -> None:
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(FolderError) as refused, locked(tmp_path):
            pass
        assert str(tmp_path) in str(refused.value)
        assert f"process {holder.pid} on {os.uname().nodename}" in str(refused.value)
        holder.kill()
    with locked(tmp_path):  # the system has released it, whatever the killed process left there
        pass


def test_a_process_cannot_use_a_folder_twice(tmp_path: Path) -> None:
    with locked(tmp_path), pytest.raises(FolderError, match=f"process {os.getpid()}"), locked(tmp_path):
        pass
    with locked(tmp_path):
        pass


def test_the_lock_does_not_depend_on_knowing_its_holder(tmp_path: Path) -> None:
    with locked(tmp_path):
        (tmp_path / ".circuittex.holder").unlink()
        with pytest.raises(FolderError, match="a process that has just started"), locked(tmp_path):
            pass


def test_a_failure_inside_releases_it(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), locked(tmp_path):
        raise ZeroDivisionError
    with locked(tmp_path):
        assert {path.name for path in tmp_path.iterdir()} == {".circuittex.lock", ".circuittex.holder"}
