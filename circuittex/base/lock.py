"""One writer to a results folder: a lock that the system releases, however its holder ends."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from filelock import FileLock, Timeout

from circuittex.base.errors import FolderError

LOCK = ".circuittex.lock"
"""The file that is locked; it stays when the lock is released, since to remove it would let two in at once."""
HOLDER = ".circuittex.holder"
"""Tells who holds the lock, for the message to others; the lock does not depend on it."""


@contextmanager
def locked(folder: str | Path) -> Iterator[None]:
    """Hold `folder` against other writers.

    Raises `FolderError` at once where another process writes there, and names it.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder, locked(folder):
    ...     sorted(path.name for path in Path(folder).iterdir())
    ['.circuittex.holder', '.circuittex.lock']
    """
    folder = Path(folder)
    lock, holder = FileLock(folder / LOCK), folder / HOLDER
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise FolderError(
            f"{folder}: circuittex is writing there already ({_holder(holder)}); wait until it is done, or take "
            "another folder"
        ) from None
    try:
        with suppress(OSError):  # on a full disk nobody learns who holds the folder, but it is held
            since = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
            holder.write_text(f"process {os.getpid()} on {socket.gethostname()} since {since}", encoding="utf-8")
        yield
    finally:
        with suppress(OSError):
            holder.unlink(missing_ok=True)
        lock.release()


def _holder(path: Path) -> str:
    """Who holds the lock, as far as it is known."""
    try:
        return path.read_text(encoding="utf-8").strip() or "a process that has just started"
    except (OSError, UnicodeDecodeError):
        return "a process that has just started"
