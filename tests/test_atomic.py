"""Files that are complete or not there."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from circuittex.base.atomic import replacing, write_text


@pytest.fixture
def old(tmp_path: Path) -> Path:
    path = tmp_path / "a.txt"
    path.write_text("old", encoding="utf-8")
    return path


def test_who_reads_the_old_file_reads_it_to_its_end(old: Path) -> None:
    """The new file is another one, so that at no moment there is a mixture of both."""
    with old.open(encoding="utf-8") as reader:
        write_text(old, "something new")
        assert reader.read() == "old"
    assert old.read_text(encoding="utf-8") == "something new"


def test_until_it_is_complete_the_old_one_stays(old: Path) -> None:
    with replacing(old) as partial:
        partial.write_text("half", encoding="utf-8")
        assert old.read_text(encoding="utf-8") == "old"
        assert partial.parent == old.parent  # a rename works within one file system only
    assert list(old.parent.iterdir()) == [old]


def test_its_content_is_on_the_disk_before_its_name(old: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    events: list[str] = []
    fsync, replace = os.fsync, Path.replace
    monkeypatch.setattr(os, "fsync", lambda handle: (events.append("fsync"), fsync(handle))[1])
    monkeypatch.setattr(Path, "replace", lambda path, target: (events.append("replace"), replace(path, target))[1])
    write_text(old, "new")
    assert events[:2] == ["fsync", "replace"]


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_a_failure_leaves_the_old_file_alone(old: Path, error: BaseException) -> None:
    def write() -> None:
        with replacing(old) as partial:
            partial.write_text("half", encoding="utf-8")
            raise error

    with pytest.raises(type(error)):
        write()
    assert old.read_text(encoding="utf-8") == "old"
    assert list(old.parent.iterdir()) == [old]


def test_a_full_disk_is_told_with_the_name_of_the_file(old: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"No space left on device: .*a\.txt"):
        write_text(old, "new")
