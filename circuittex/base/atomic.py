"""Files that are complete or not there: written beside their place, then put there in one step."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

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
        finally:
            os.close(handle)
