"""One writer to a results folder: a lock that the system releases, however its holder ends."""

from __future__ import annotations

import os
import socket
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from filelock import FileLock, Timeout

from circuittex.base.atomic import UNSUPPORTED
from circuittex.base.errors import CircuittexWarning, FolderError

LOCK = ".circuittex.lock"
"""The file that is locked; it stays when the lock is released, since to remove it would let two in at once."""
HOLDER = ".circuittex.holder"
"""Tells who holds the lock, for the message to others; the lock does not depend on it."""


@contextmanager
def locked(folder: str | Path) -> Iterator[None]:
    """Hold `folder` against other writers.

    Raises `FolderError` at once where another process writes there, and names it. On a file system without locks there
    is nothing to hold: a `CircuittexWarning` says so.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder, locked(folder):
    ...     sorted(path.name for path in Path(folder).iterdir())
    ['.circuittex.holder', '.circuittex.lock']
    """
    folder = Path(folder)
    lock, holder = FileLock(folder / LOCK), folder / HOLDER
    try:
        with warnings.catch_warnings(record=True) as said:
            lock.acquire(timeout=0)
        if said:  # filelock's own way out on some file systems: a file that only its own processes respect
            _note(folder, str(said[0].message))
    except Timeout:
        raise FolderError(
            f"{folder}: circuittex is writing there already ({_holder(holder)}); wait until it is done, or take "
            "another folder"
        ) from None
    except (OSError, NotImplementedError) as error:  # the latter is filelock's word for ENOSYS: no locks there, too
        if isinstance(error, OSError) and error.errno not in UNSUPPORTED:
            raise
        _note(folder, getattr(error, "strerror", None) or "not supported")
    try:
        with suppress(OSError):  # on a full disk nobody learns who holds the folder, but it is held
            since = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
            holder.write_text(f"process {os.getpid()} on {socket.gethostname()} since {since}", encoding="utf-8")
        yield
    finally:
        with suppress(OSError):
            holder.unlink(missing_ok=True)
        lock.release()


def _note(folder: Path, reason: str) -> None:
    warnings.warn(
        f"{folder}: its file system has no locks ({reason}); nothing keeps a second run out of this folder",
        CircuittexWarning,
        stacklevel=4,
    )


def _holder(path: Path) -> str:
    """Who holds the lock, as far as it is known."""
    try:
        return path.read_text(encoding="utf-8").strip() or "a process that has just started"
    except (OSError, UnicodeDecodeError):
        return "a process that has just started"
