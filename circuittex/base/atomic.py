"""Files that are complete or not there: written beside their place, then put there in one step."""

from __future__ import annotations

import errno
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from circuittex.base.errors import CircuittexWarning

UNSUPPORTED = {errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EBADF, errno.ENOLCK}
"""What file systems answer, network shares among them, that lack a call."""
PARTIAL = ".partial"
"""What the name of a file ends with until it is complete."""


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """The path of a file to write, which takes the place of `path` when all has gone well.

    At every moment, a power cut included, `path` is the old file (or none) or the complete new one. Where the
    writing fails, the old file stays and what was written is removed.

    Raises OSError where the file cannot be written, on a full disk for example.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with replacing(Path(folder, "a.txt")) as partial:
    ...         _ = partial.write_text("all of it")
    ...     [(file.name, file.read_text()) for file in Path(folder).iterdir()]
    [('a.txt', 'all of it')]
    """
    path = Path(path)
    partial = path.with_name(path.name + PARTIAL)
    try:
        yield partial
        with partial.open("r+b") as file:
            os.fsync(file.fileno())
        partial.replace(path)
    except BaseException as error:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename is None:
            error.filename = str(path)  # a full disk is told without the name of the file
        raise
    _sync_folder(path.parent)


def write_text(path: str | Path, text: str, encoding: str = "utf-8") -> None:
    """Write a text file that is complete or not there."""
    with replacing(path) as partial:
        partial.write_text(text, encoding=encoding)


def _sync_folder(folder: Path) -> None:
    # The rename itself must survive a power cut; Windows has no such call and needs none.
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        except OSError as error:
            if error.errno not in UNSUPPORTED:
                raise
            _note(folder, error.strerror, os.fstat(handle).st_dev)
        finally:
            os.close(handle)


_noted: set[int] = set()
"""File systems of which it has been said."""


def _note(folder: Path, reason: str | None, device: int) -> None:
    if device not in _noted:
        _noted.add(device)
        warnings.warn(
            f"{folder}: its file system cannot be told to keep a renamed file ({reason}); what was written last may be "
            "lost in a power cut",
            CircuittexWarning,
            stacklevel=5,
        )
