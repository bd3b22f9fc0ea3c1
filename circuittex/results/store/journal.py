"""Changes of a file that are complete or not there, without writing the file anew.

A change is made on an `Overlay`, which keeps what is written to it in memory. `commit` appends what lies beyond the
old end, which nobody reads yet; writes the few pages inside that change to a journal beside the file; then changes the
pages and removes the journal. Whatever ends the process, the file with its journal, if there is one, is the new
version, and without one the old version: `overlay` reads it so, and `finish` ends what was begun. A journal knows how
long its file is; beside any other one, such as a copy that was put there since, it means nothing.
"""

from __future__ import annotations

import hashlib
import io
import os
import struct
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from circuittex.base.atomic import replacing

PAGE = 4096
"""Bytes that are changed together."""
PIECE = 4096 * PAGE
"""Bytes that are compared at once."""
SUFFIX = ".journal"
MAGIC = b"circuittex journal 1\n"
_HEAD, _ENTRY = struct.Struct("<QQ"), struct.Struct("<QI")  # size of the file, number of pages; offset, length


class Overlay(io.RawIOBase):
    """A file to read and write whose file on disk stays as it is."""

    def __init__(self, file: BinaryIO | None, size: int, pages: dict[int, bytes] | None = None) -> None:
        super().__init__()
        self._file, self.size = file, size
        self.pages = {
            offset: bytearray(page) + self._after(offset + len(page)) for offset, page in (pages or {}).items()
        }
        self.tail = bytearray()
        self._place = 0

    def _after(self, place: int) -> bytes:
        """The rest of the page from there on: what was appended behind a last page that was not full."""
        if place % PAGE == 0 or place >= self.size or self._file is None:
            return b""
        self._file.seek(place)
        return self._file.read(min(self.size, place - place % PAGE + PAGE) - place)

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._place

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        base = {os.SEEK_SET: 0, os.SEEK_CUR: self._place, os.SEEK_END: self.size + len(self.tail)}[whence]
        self._place = base + offset
        return self._place

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        view = memoryview(buffer).cast("B")
        done = 0
        while done < len(view):
            piece = self._read(self._place, len(view) - done)
            if not piece:
                break
            view[done : done + len(piece)] = piece
            done += len(piece)
            self._place += len(piece)
        return done

    def _read(self, place: int, count: int) -> bytes:
        """Some bytes from there on, at least one unless the end is reached."""
        if place >= self.size:
            return bytes(self.tail[place - self.size : place - self.size + count])
        offset = place - place % PAGE
        if offset in self.pages:
            return bytes(self.pages[offset][place - offset : place - offset + count])
        # As far as no page on the way has changed.
        stop = min([self.size, place + count, *(page for page in self.pages if offset < page < place + count)])
        assert self._file is not None, "a file without one on disk has nothing before its end"
        self._file.seek(place)
        return self._file.read(stop - place)

    def write(self, data: bytes | memoryview) -> int:  # type: ignore[override]
        view = memoryview(data).cast("B")
        done = 0
        while done < len(view) and self._place < self.size:
            offset = self._place - self._place % PAGE
            if offset not in self.pages:
                length = min(PAGE, self.size - offset)
                assert self._file is not None
                self._file.seek(offset)
                self.pages[offset] = bytearray(self._file.read(length))
            page, start = self.pages[offset], self._place - offset
            piece = view[done : done + len(page) - start]
            page[start : start + len(piece)] = piece
            done += len(piece)
            self._place += len(piece)
        if done < len(view):
            start = self._place - self.size
            self.tail.extend(bytes(max(0, start - len(self.tail))))
            self.tail[start : start + len(view) - done] = view[done:]
            self._place += len(view) - done
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        size = self._place if size is None else size
        if size >= self.size:
            del self.tail[size - self.size :]
            self.tail.extend(bytes(size - self.size - len(self.tail)))
        return size


def overlay(path: Path, file: BinaryIO) -> Overlay:
    """The file at `path`, open as `file`, as it is to be read: with the changes of a journal that was left there."""
    size = file.seek(0, os.SEEK_END)
    return Overlay(file, size, _pages(_journal(path), size))


def snapshot(path: Path) -> Overlay:
    """The file at `path` as it is at one moment, in memory, while others change it.

    A page has the same content before and after that moment, at which the journal is read: so it had it then, and the
    pages that the journal holds are taken from there. HDF5 must not be let near pages of two versions: 1.14.2 crashes.
    """
    while True:
        taken = Overlay(None, 0)
        taken.tail = bytearray(path.stat().st_size)
        with path.open("rb") as file:
            file.readinto(taken.tail)
        pages = _pages(_journal(path), len(taken.tail))
        _lay(pages, taken.tail, 0)
        if _reads(path, taken.tail, pages):
            return taken


def _reads(path: Path, content: bytearray, pages: Mapping[int, bytes]) -> bool:
    """Whether the file at `path` with these pages laid over it reads so, at some moment for each part."""
    view = memoryview(content)
    with path.open("rb") as file:
        for start in range(0, len(content), PIECE):
            piece = bytearray(file.read(PIECE))
            _lay(pages, piece, start)
            if piece != view[start : start + PIECE]:
                return False
        return not file.read(1)


def _lay(pages: Mapping[int, bytes], piece: bytearray, start: int) -> None:
    """Lay pages over the piece of a file that begins at `start`: a page lies in it whole or not at all."""
    for offset, page in pages.items():
        if 0 <= offset - start < len(piece):
            piece[offset - start : offset - start + len(page)] = page


def finish(path: Path) -> None:
    """Make the changes of a journal that was left beside the file at `path`, before others are begun."""
    journal = _journal(path)
    if journal.exists():
        if path.exists():
            _apply(path, _pages(journal, path.stat().st_size))
        journal.unlink()


def commit(path: Path, changed: Overlay) -> None:
    """Bring the changes that were made on an overlay of the file at `path` into it; no journal is there (`finish`).

    Raises OSError where that fails, on a full disk for example; the file is read as the old version then. With the
    journal in its place the change is made: should the pages not be changed now, the next change begins with them.
    """
    journal = _journal(path)
    with path.open("r+b") as file:
        try:
            file.seek(changed.size)
            file.write(changed.tail)
            file.flush()
            os.fsync(file.fileno())
            _write_journal(journal, changed)
        except OSError:
            if not journal.exists():
                file.truncate(changed.size)
                raise
    with suppress(OSError):
        finish(path)


def _apply(path: Path, pages: Mapping[int, bytes | bytearray]) -> None:
    with path.open("r+b") as file:
        for offset, page in pages.items():
            file.seek(offset)
            file.write(page)
        file.flush()
        os.fsync(file.fileno())


def _journal(path: Path) -> Path:
    return path.with_name(path.name + SUFFIX)


def _write_journal(path: Path, changed: Overlay) -> None:
    content = bytearray(_HEAD.pack(changed.size + len(changed.tail), len(changed.pages)))
    for offset, page in sorted(changed.pages.items()):
        content += _ENTRY.pack(offset, len(page)) + page
    with replacing(path) as partial:
        partial.write_bytes(MAGIC + hashlib.blake2b(content, digest_size=32).digest() + content)


def _pages(path: Path, size: int) -> dict[int, bytes]:
    """The pages of the journal of a file of that size; none where there is no journal, it is of another file, or it is
    damaged, which a kill cannot do."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return {}
    start = len(MAGIC) + 32
    content = data[start:]
    if data[: len(MAGIC)] != MAGIC or hashlib.blake2b(content, digest_size=32).digest() != data[len(MAGIC) : start]:
        return {}
    whole, count = _HEAD.unpack_from(content)
    if whole != size:
        return {}
    place, pages = _HEAD.size, {}
    for _ in range(count):
        offset, length = _ENTRY.unpack_from(content, place)
        place += _ENTRY.size
        pages[offset] = content[place : place + length]
        place += length
    return pages
