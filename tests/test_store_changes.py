"""Changes of the results file: complete or not there, whatever ends the process, and nothing written twice."""

from __future__ import annotations

import errno
import io
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_study import synthetic_study

from circuittex.base.errors import StoreError
from circuittex.base.frozen import same
from circuittex.results.store import append_record, complete_change, journal, load_study, write_study_start
from circuittex.results.store.journal import PAGE
from circuittex.study.folder import open_study

STUDY = synthetic_study(2, contacts=40)
ANOTHER = replace(STUDY.records[0], name="another")


class KilledError(BaseException):
    """Stands for the end of the process."""


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    path = tmp_path / "results.h5"
    write_study_start(path, STUDY)
    return path


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_full_disk_leaves_the_old_file(stored: Path, monkeypatch: pytest.MonkeyPatch, step: str) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    before = stored.read_bytes()
    monkeypatch.setattr(*((os, "fsync") if step == "fsync" else (Path, "replace")), full)
    with pytest.raises(StoreError, match="No space left"):
        append_record(stored, ANOTHER)
    assert stored.read_bytes() == before
    assert [file.name for file in stored.parent.iterdir()] == ["results.h5"]


CHILD = """
import sys
from dataclasses import replace
from pathlib import Path
from circuittex.results.store import append_record, load_study
path = Path(sys.argv[1])
record = load_study(path).records[0]
for count in range(1000):
    append_record(path, replace(record, name=f"again-{count}"))
    print(count + 1, flush=True)
"""


@pytest.mark.parametrize("delay", [0.0, 0.013, 0.031])
def test_killed_while_appending(tmp_path: Path, delay: float) -> None:
    path = tmp_path / "results.h5"
    write_study_start(path, replace(STUDY, records=STUDY.records[:1]))
    with subprocess.Popen([sys.executable, "-c", CHILD, str(path)], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "1\n"
        time.sleep(delay)
        child.kill()
        acknowledged = 1 + len(child.stdout.readlines())
    loaded = load_study(path)
    assert len(loaded.records) - 1 in (acknowledged, acknowledged + 1)
    assert all(same(replace(record, name="relaxed"), STUDY.records[0]) for record in loaded.records)
    append_record(path, STUDY.records[1])  # whatever the kill left behind is no obstacle
    assert same(load_study(path).records[-1], STUDY.records[1])


def test_reading_and_appending_do_not_hinder_each_other(stored: Path) -> None:
    """Whoever looks at results while a run adds to them reads on what is there, and the run goes on."""
    with h5py.File(stored, "r", locking=False) as reader:
        append_record(stored, ANOTHER)
        load = reader["states/relaxed/contacts/line_load"][()]
    assert np.array_equal(load, STUDY.records[0].contacts.line_load)
    assert len(load_study(stored).records) == len(STUDY.records) + 1


def test_a_reader_beside_a_run_sees_one_state_more_at_a_time(tmp_path: Path) -> None:
    """`load_study` never fails and never sees less than before, however often the file changes meanwhile."""
    path = tmp_path / "results.h5"
    write_study_start(path, replace(STUDY, records=STUDY.records[:1]))
    seen = [1]
    with subprocess.Popen([sys.executable, "-c", CHILD, str(path)], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "1\n"
        until = time.monotonic() + 1.0
        while time.monotonic() < until:
            seen.append(len(load_study(path).records))
        child.kill()
    assert seen == sorted(seen)
    assert seen[-1] > 5


@given(pauses=st.lists(st.integers(0, 4), min_size=12, max_size=12))
def test_a_snapshot_is_one_version(tmp_path_factory: pytest.TempPathFactory, pauses: list[int]) -> None:
    """However the steps of a change fall between those of a reader, it has the old version or the new one whole."""
    path = tmp_path_factory.mktemp("snapshot") / "results.h5"
    old = bytes([1]) * (3 * PAGE) + bytes([2]) * 100
    path.write_bytes(old)
    with path.open("rb") as file:
        changed = journal.overlay(path, file)
        for place in (10, 2 * PAGE + 7, len(old) + 5):
            changed.seek(place)
            changed.write(b"new")
        changed.seek(0)
        new = changed.read(-1)
    beside = journal._journal(path)

    def change() -> Iterator[None]:
        with path.open("ab") as file:
            file.write(changed.tail)
        yield
        journal._write_journal(beside, changed)
        for offset, page in changed.pages.items():
            yield
            journal._apply(path, {offset: page})
        yield
        beside.unlink()

    steps, left = change(), iter(pauses)
    for _ in range(next(left)):
        next(steps, None)

    def pausing(function: Callable[..., Any]) -> Callable[..., Any]:
        def paused(*arguments: Any) -> Any:
            for _ in range(next(left, 0)):
                next(steps, None)
            return function(*arguments)

        return paused

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(journal, "PIECE", PAGE)
        for name in ("_pages", "_reads", "_lay"):
            patch.setattr(journal, name, pausing(getattr(journal, name)))
        taken = journal.snapshot(path).read(-1)
    assert taken == new or taken[: len(old)] == old


def test_what_is_there_is_not_written_again(tmp_path: Path) -> None:
    """A large file grows by what is new: all but a few pages of the old one stay as they are."""
    study = synthetic_study(3, contacts=3000)
    path = tmp_path / "results.h5"
    write_study_start(path, replace(study, records=study.records[:2]))
    before = path.read_bytes()
    append_record(path, study.records[2])
    after = path.read_bytes()
    changed = sum(before[k : k + PAGE] != after[k : k + PAGE] for k in range(0, len(before), PAGE))
    assert changed * PAGE < len(before) / 10
    assert same(load_study(path), study)


@pytest.mark.parametrize("step", ["tail", "half a journal", "journal", "half the pages", "pages"])
def test_killed_at_each_step_of_a_change(stored: Path, monkeypatch: pytest.MonkeyPatch, step: str) -> None:
    """Without the whole journal the file is the old version, with it the new one; the next change goes on there."""

    write, apply = journal._write_journal, journal._apply

    def die_writing(path: Path, changed: journal.Overlay) -> None:
        if step == "half a journal":
            write(path, changed)
            path.write_bytes(path.read_bytes()[:-100])
        raise KilledError

    def die_applying(path: Path, pages: dict[int, bytes]) -> None:
        done = {"journal": 0, "half the pages": len(pages) // 2, "pages": len(pages)}[step]
        apply(path, dict(sorted(pages.items())[:done]))
        raise KilledError

    early = step in ("tail", "half a journal")
    monkeypatch.setattr(journal, *(("_write_journal", die_writing) if early else ("_apply", die_applying)))
    with pytest.raises(KilledError):
        append_record(stored, ANOTHER)
    monkeypatch.undo()
    assert len(load_study(stored).records) == len(STUDY.records) + (not early)
    if early:
        append_record(stored, ANOTHER)
    append_record(stored, replace(ANOTHER, name="one more"))
    assert len(load_study(stored).records) == len(STUDY.records) + 2
    with h5py.File(stored) as file:  # for HDF5 alone, too
        assert len(file["states"]) == len(STUDY.records) + 2
    assert [file.name for file in stored.parent.iterdir()] == ["results.h5"]


def test_killed_before_any_call_to_the_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever the process ends, the states that were there are there, and with a journal the new one as well."""

    real = {(os, "fsync"): os.fsync, (Path, "replace"): Path.replace, (Path, "unlink"): Path.unlink}
    real[Path, "open"] = Path.open
    found = []
    for last in range(1000):
        path = tmp_path / str(last) / "results.h5"
        path.parent.mkdir()
        write_study_start(path, replace(STUDY, records=STUDY.records[:1]))
        calls = iter(range(last))

        def dying(call: Callable[..., Any], calls: Iterator[int] = calls) -> Callable[..., Any]:
            def wrapped(*args: Any, **options: Any) -> Any:
                if next(calls, None) is None:
                    raise KilledError
                return call(*args, **options)

            return wrapped

        with monkeypatch.context() as patch:
            for (owner, name), call in real.items():
                patch.setattr(owner, name, dying(call))
            try:
                append_record(path, STUDY.records[1])
            except KilledError:
                killed = True
            else:
                killed = False
        found.append(len(load_study(path).records))
        complete_change(path)
        with h5py.File(path) as file:
            assert len(file["states"]) == found[-1]
        if not killed:
            break
    assert found == sorted(found)
    assert found.count(1) > 5  # before the journal is in its place
    assert found.count(2) > 3  # after it
    assert same(load_study(path), replace(STUDY, records=STUDY.records[:2]))


def test_the_next_run_makes_the_file_whole_for_other_programs(stored: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that finds all states there and adds nothing."""

    def die(path: Path, pages: dict[int, bytes]) -> None:
        raise KilledError

    with monkeypatch.context() as patch:
        patch.setattr(journal, "_apply", die)
        with pytest.raises(KilledError):
            append_record(stored, replace(STUDY.records[1], name="stretch-0.05"))
    with h5py.File(stored) as file:
        assert "stretch-0.05" not in file["states"]
    assert len(open_study(stored.parent, STUDY, lambda study: study).records) == len(STUDY.records) + 1
    with h5py.File(stored) as file:
        assert "stretch-0.05" in file["states"]
    assert [file.name for file in stored.parent.iterdir()] == ["results.h5"]


def test_a_journal_of_another_file_means_nothing(stored: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A copy that was put in the place of a file whose change a kill had left half-made, or a new file there."""
    copy = stored.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(journal, "finish", lambda path: None)
        append_record(stored, ANOTHER)
    left = tmp_path / "results.h5.journal"
    kept = left.read_bytes()
    stored.write_bytes(copy)
    assert same(load_study(stored), STUDY)
    append_record(stored, ANOTHER)
    assert len(load_study(stored).records) == len(STUDY.records) + 1
    stored.unlink()
    left.write_bytes(kept)
    write_study_start(stored, STUDY)
    assert not left.exists()
    assert same(load_study(stored), STUDY)


@given(st.lists(st.tuples(st.integers(0, 60), st.binary(max_size=30)), max_size=8), st.binary(max_size=50))
def test_an_overlay_reads_what_was_written(writes: list[tuple[int, bytes]], content: bytes) -> None:
    """The same as a file in memory, whatever is written where."""
    usual, changed = io.BytesIO(content), journal.Overlay(io.BytesIO(content), len(content))
    for place, data in writes:
        for file in (usual, changed):
            file.seek(place)
            file.write(data)
    for place in (0, 3, 40, 70):
        usual.seek(place), changed.seek(place)
        assert usual.read() == changed.readall()
