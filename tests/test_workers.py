"""Worker processes: what they answer, and that none outlives whoever started it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from circuittex.base.errors import ConvergenceError, DesignError, WorkerError
from circuittex.base.workers import GRACE, THREADS, Computers, Here, Pool
from circuittex.mech.configuration import Configuration

PATIENCE = 60.0
"""Seconds within which a process must have ended on a machine that is busy."""

Say = Callable[[str], None]


def double(value: int, say: Say) -> int:
    print("libraries may print what they like")
    say(f"doubling {value}")
    return 2 * value


def array(say: Say) -> np.ndarray:
    return np.arange(3.0)


def configuration(say: Say) -> Configuration:
    return Configuration(np.zeros((2, 3, 3)))


class Unknown:
    """Something that another process cannot build."""

    def __reduce__(self) -> tuple[object, ...]:
        return int, ("no number",)


def environment(say: Say) -> list[str]:
    return [os.environ[name] for name in THREADS]


def refuse(say: Say) -> None:
    raise DesignError("yarns", 0, "there must be some")


def diverge(say: Say) -> None:
    raise ConvergenceError("no equilibrium", np.ones((2, 4)))


def divide(say: Say) -> float:
    return 1 / 0


def die(say: Say) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def spin(folder: str, say: Say) -> None:
    Path(folder, str(os.getpid())).touch()
    while True:
        pass


@pytest.fixture
def said() -> list[str]:
    return []


@pytest.fixture
def pool(said: list[str]) -> Iterator[Pool]:
    pool = Pool(2, 3, said.append)
    yield pool
    pool.close()


@pytest.fixture(params=["here", "pool"])
def computers(request: pytest.FixtureRequest, said: list[str]) -> Iterator[Computers]:
    some: Computers = Here(said.append) if request.param == "here" else Pool(1, 1, said.append)
    yield some
    some.close()


def test_tasks_answer_tell_and_fail_alike_here_and_elsewhere(computers: Computers, said: list[str]) -> None:
    computers.submit("a", double, 4)
    assert computers.next() == ("a", 8)
    assert said == ["doubling 4"]
    computers.submit("b", refuse)
    key, error = computers.next()
    assert (key, type(error), error.field, str(error)) == (
        "b",
        DesignError,
        "yarns",
        "yarns: 0 is not usable; there must be some",
    )
    computers.submit("c", diverge)
    _, error = computers.next()
    np.testing.assert_array_equal(error.history, np.ones((2, 4)))
    computers.submit("d", divide)
    with pytest.raises(ZeroDivisionError):
        computers.next()


def test_workers_share_the_cores(pool: Pool, monkeypatch: pytest.MonkeyPatch) -> None:
    pool.submit("a", array)
    pool.submit("b", double, 1)
    answers = dict(pool.next() for _ in range(2))
    np.testing.assert_array_equal(answers["a"], [0.0, 1.0, 2.0])
    assert answers["b"] == 2


def test_results_from_another_process_are_locked(pool: Pool) -> None:
    pool.submit("a", configuration)
    _, found = pool.next()
    with pytest.raises(ValueError, match="read-only"):
        found.x[0] = 1.0


def test_a_task_that_cannot_be_built_is_told(pool: Pool) -> None:
    pool.submit("a", double, Unknown())
    with pytest.raises(ValueError, match="no number") as told:
        pool.next()
    assert "in a worker process" in told.value.__notes__[0]


def test_threads_are_set_before_the_libraries_load_unless_the_user_has_set_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in THREADS[1:]:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(THREADS[0], "7")
    pool = Pool(1, 3, print)
    pool.submit("a", environment)
    assert pool.next() == ("a", ["7", "3", "3", "3"])
    pool.close()


def test_a_worker_that_dies_is_reported(pool: Pool) -> None:
    pool.submit("shear-0.1", die)
    with pytest.raises(WorkerError, match=r"died while it computed shear-0\.1"):
        pool.next()


def pids(folder: Path, count: int) -> list[int]:
    """The processes that have left their number in `folder`, once there are `count`."""
    deadline = time.monotonic() + PATIENCE
    while len(found := [int(path.name) for path in folder.iterdir()]) < count:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return found


def gone(pid: int) -> bool:
    """Whether a process has ended, though perhaps nobody has asked how."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


def test_closing_ends_what_is_going_on(pool: Pool, tmp_path: Path) -> None:
    pool.submit("a", spin, str(tmp_path))
    pool.submit("b", spin, str(tmp_path))
    busy = pids(tmp_path, 2)
    pool.close()
    assert all(map(gone, busy))


PARENT = """
import sys
sys.path.insert(0, sys.argv[1])
import test_workers
from circuittex.mech.configuration import Configuration
from circuittex.base.workers import Pool
pool = Pool(2, 1, print)
pool.submit("a", test_workers.spin, sys.argv[2])
pool.submit("b", test_workers.spin, sys.argv[2])
pool.next()
"""


def test_workers_end_with_a_killed_parent(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", PARENT, str(Path(__file__).parent), str(tmp_path)]) as parent:
        busy = pids(tmp_path, 2)
        parent.kill()
    deadline = time.monotonic() + GRACE + PATIENCE
    while not all(map(gone, busy)):
        assert time.monotonic() < deadline, "orphans go on computing"
        time.sleep(0.05)
