"""A study as a whole: however it is interrupted, the same call ends with the same numbers, bit for bit."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from canned import Canned, canned_study, files, report, untimed
from fabrics import small_cell

from circuittex.base.compiled import available_cores
from circuittex.base.errors import ConvergenceError, DesignError, FolderError, PenetrationError, StoreError
from circuittex.base.frozen import same
from circuittex.base.lock import locked
from circuittex.design import Design, equal_steps, shear, uniaxial
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.results.store import load_study
from circuittex.results.store.archive import Digests
from circuittex.results.store.journal import snapshot
from circuittex.study.run import run_study

STUDY = canned_study(2)
PATIENCE = 600.0
"""Seconds that a state may take where its kernels have to be compiled first and the machine is busy."""


def cell() -> Design:
    """Four fibrils, stretched and sheared, without probes: as little as can be computed in a second or two."""
    design, _ = small_cell((1,), elements=4, order=1, section_degree=6)
    loading = (uniaxial("stretch", equal_steps(0.1, 8)), shear("shear", equal_steps(0.2, 8), free="y"))
    return replace(design, terminals=(), probes=(), loading=loading)


# Kills, at any moment


class Killed(BaseException):
    """The end of a process as the disk sees it: nothing is written or removed any more."""


class Disk:
    """Counts what changes the disk, and from the `last` change on refuses."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, error: Callable[[], BaseException]) -> None:
        self.changes, self.last, self._error = 0, sys.maxsize, error
        for owner, name in ((os, "fsync"), (Path, "replace"), (Path, "unlink"), (Path, "mkdir")):
            self._watch(monkeypatch, owner, name)

    def _watch(self, monkeypatch: pytest.MonkeyPatch, owner: object, name: str) -> None:
        original = getattr(owner, name)

        def watched(*arguments: object, **options: object) -> object:
            # The lock is the system's to release; its file is none of the results.
            if not any(".circuittex." in str(argument) for argument in arguments):
                self.changes += 1
                if self.changes > self.last:
                    raise self._error()
            return original(*arguments, **options)

        monkeypatch.setattr(owner, name, watched)


@pytest.mark.parametrize("part", [0.02, 0.19, 0.3, 0.42, 0.5, 0.73, 0.84, 0.97])
def test_killed_between_any_two_changes_of_the_disk(
    part: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    canned = Canned(STUDY).install(monkeypatch)
    disk = Disk(monkeypatch, Killed)
    run_study(STUDY.design, tmp_path / "whole", workers=1)
    whole, disk.last, disk.changes = files(tmp_path / "whole"), int(part * disk.changes), 0
    with pytest.raises(Killed):
        run_study(STUDY.design, tmp_path / "killed", workers=1)
    disk.last = sys.maxsize
    first, canned.reached = canned.reached[len(STUDY.records) :], []
    if (tmp_path / "killed" / "results.h5").exists():
        kept = [record.name for record in load_study(tmp_path / "killed" / "results.h5").records]
        assert kept in (first, first[:-1])  # at most the state that was being written is computed again
    else:
        kept = []
    assert same(run_study(STUDY.design, tmp_path / "killed", workers=1), STUDY)
    assert canned.reached == [record.name for record in STUDY.records if record.name not in kept]
    assert files(tmp_path / "killed") == whole
    for name in whole - {"results.h5", "results.h5.partial"}:
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


RUN = """
import signal
import sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # jobs in the background of a shell ignore it
sys.path.insert(0, sys.argv[1])
import time
import circuittex.study.folder
import circuittex.study.run
import test_study
from canned import report
circuittex.study.folder.write_report = report
keep = circuittex.study.run.keep_record
def slowly(*arguments):
    study = keep(*arguments)
    time.sleep(0.5)  # for the signal to come before the end, however busy the machine is
    return study
circuittex.study.run.keep_record = slowly
circuittex.study.run.run_study(test_study.cell(), sys.argv[2], workers=int(sys.argv[3]))
"""


def start(folder: Path, workers: int) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", RUN, str(Path(__file__).parent), str(folder), str(workers)])


def states(folder: Path) -> int:
    """How many states are there: a look that costs the computing processes little."""
    if not (folder / "results.h5").exists():
        return 0
    # As the run changes pages meanwhile, h5py alone could meet half a change.
    with h5py.File(snapshot(folder / "results.h5"), "r") as file:
        return len(file["states"])


def test_interrupted_then_killed_then_completed_by_other_numbers_of_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = 0
    for workers, end in ((2, signal.SIGINT), (2, signal.SIGKILL)):
        deadline = time.monotonic() + PATIENCE
        with start(tmp_path, workers) as process:
            while states(tmp_path) == kept:
                assert process.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.01)
            process.send_signal(end)
            assert process.wait(PATIENCE) != 0
        assert states(tmp_path) > kept  # no state that was there is lost
        kept = states(tmp_path)
    monkeypatch.setattr("circuittex.study.folder.write_report", report)
    run_study(cell(), tmp_path, workers=1)
    found, whole = untimed(load_study(tmp_path / "results.h5")), untimed(run_study(cell(), workers=1))
    assert same(found, whole)
    assert Digests()(found) == Digests()(whole)  # also the sign of zeros


# Solvers, workers


def test_the_solver_is_made_anew_for_every_relaxation() -> None:
    made: list[MultifrontalSolver] = []

    def make() -> MultifrontalSolver:
        made.append(MultifrontalSolver())
        return made[-1]

    run_study(replace(cell(), loading=(shear("shear", (0.05,)),)), solver=make, workers=2)
    assert len(made) == 2


@pytest.mark.parametrize("workers", [0, -1, 1.5, "2"])
def test_workers_are_a_whole_number(workers: object, tmp_path: Path) -> None:
    with pytest.raises(DesignError, match="workers"):
        run_study(STUDY.design, tmp_path / "out", workers=workers)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_one_path_needs_no_other_process(monkeypatch: pytest.MonkeyPatch) -> None:
    study = canned_study(3, ("stretch",))
    Canned(study).install(monkeypatch)
    monkeypatch.setattr("circuittex.study.run.Pool", None)
    assert same(run_study(study.design, workers=8), study)
    assert available_cores() >= 1


def test_a_path_that_does_not_converge_keeps_the_rest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    canned = Canned(STUDY).install(monkeypatch)

    def fail(name: str) -> None:
        if name.startswith("stretch"):
            raise ConvergenceError(f"{name}: no equilibrium")

    canned.before = fail
    with pytest.raises(ConvergenceError, match=r"stretch-0\.025: no equilibrium"):
        run_study(STUDY.design, tmp_path, workers=1)
    assert [r.name for r in load_study(tmp_path / "results.h5").records] == ["relaxed", "shear-0.025"]
    assert not (tmp_path / "report.html").exists()


def test_an_equilibrium_that_is_not_found_ends_in_what_to_change(monkeypatch: pytest.MonkeyPatch) -> None:
    """One sentence: out of iterations, stuck before that; fibrils pressed through one another say their own."""
    design = replace(cell(), loading=())
    short = replace(design, numerics=replace(design.numerics, max_iterations=1))
    with pytest.raises(ConvergenceError, match=r"^relaxed: .*; raise numerics\.max_iterations above 1 or [^\n.]*$"):
        run_study(short, workers=1)

    def stuck(error: type[ConvergenceError]) -> Callable[..., object]:
        def relax(*_: object, **__: object) -> object:
            raise error("stuck", np.zeros((3, 4)))

        return relax

    monkeypatch.setattr("circuittex.study.record.relax", stuck(ConvergenceError))
    with pytest.raises(ConvergenceError, match=r"^relaxed: stuck; try another number of numerics\.elements than 4, "):
        run_study(design, workers=1)
    monkeypatch.setattr("circuittex.study.record.relax", stuck(PenetrationError))
    with pytest.raises(PenetrationError, match=r"^relaxed: stuck$"):
        run_study(design, workers=1)


# Folders


def test_a_folder_in_use_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Canned(STUDY).install(monkeypatch)
    with locked(tmp_path), pytest.raises(FolderError, match=f"writing there already .process {os.getpid()}"):
        run_study(STUDY.design, tmp_path)
    assert files(tmp_path) == set()


@pytest.mark.parametrize("part", [0.1, 0.5, 0.95])
def test_a_full_disk_keeps_every_state_and_says_so(
    part: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Canned(STUDY).install(monkeypatch)
    with monkeypatch.context() as patch:
        disk = Disk(patch, lambda: OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
        run_study(STUDY.design, tmp_path / "whole", workers=1)
        disk.last, disk.changes = int(part * disk.changes), 0
        with pytest.raises(StoreError) as told:
            run_study(STUDY.design, tmp_path / "full", workers=1)
    kept = len(load_study(tmp_path / "full" / "results.h5").records)
    assert "No space left on device" in str(told.value)
    assert f"{kept} of 3 states are kept in {tmp_path / 'full'}" in str(told.value)
    assert same(run_study(STUDY.design, tmp_path / "full", workers=1), STUDY)
    assert files(tmp_path / "full") == files(tmp_path / "whole")
