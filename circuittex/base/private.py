"""A folder that belongs to this user alone, for what may be lost but must not come from somebody else."""

from __future__ import annotations

import os
import stat
import tempfile
from functools import cache
from pathlib import Path


@cache
def private_folder() -> Path | None:
    """A folder of this user among the temporary files, the same for every process; None where there can be none.

    Whoever can write there could have this user run code of theirs, so one that others own or can write to is refused.
    """
    folder = Path(tempfile.gettempdir(), f"circuittex-{os.getuid() if hasattr(os, 'getuid') else 'private'}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()  # of a link, not of what it leads to
    except OSError:
        return None
    own = stat.S_ISDIR(status.st_mode) and not status.st_mode & 0o022 and os.access(folder, os.W_OK)
    own = own and (not hasattr(os, "getuid") or status.st_uid == os.getuid())
    return folder if own else None


def writable(folder: Path) -> bool:
    """Whether files can be written in `folder`, which may have to be made.

    >>> writable(Path(tempfile.gettempdir(), "a", "b")), writable(Path(os.devnull, "a"))
    (True, False)
    """
    there = next(place for place in (folder, *folder.parents) if place.exists())
    return there.is_dir() and os.access(there, os.W_OK)
