"""The first relaxation of a study on the disk until it is finished: what it reached, beside the results.

A file holds the last checkpoint of its descent by gradients and what it is of: version, design, start and solver. It is
complete or not there, and goes when the relaxed state is recorded. It saves time and nothing else depends on it: what
cannot be read, or is of something else, is not used, and where it cannot be written the relaxation goes on.
"""

from __future__ import annotations

import hashlib
import warnings
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from circuittex.base.atomic import PARTIAL, replacing
from circuittex.base.errors import CircuittexWarning
from circuittex.mech.checkpoint import Checkpoint, Checkpoints
from circuittex.results.records import Study

UNFINISHED = ".circuittex.relaxation.npz"
"""The name of the file, which nobody else uses."""
AGAIN = "the first relaxation starts from its beginning"
_KEYS = tuple(each.name for each in fields(Checkpoint))
_SPOILT = (OSError, ValueError, KeyError, EOFError, RuntimeError, zipfile.BadZipFile)
"""What a damaged file makes NumPy raise."""


def unfinished(folder: Path, study: Study, solver: str, say: Callable[[str], None]) -> Checkpoints:
    """What the first relaxation of the study goes on from in `folder`, if anything, and what keeps it there.

    `solver` is the name of the linear solver. `say` is told where it goes on. A `CircuittexWarning` tells of a file
    that is not used, and of one that cannot be written.
    """
    path, marks = folder / UNFINISHED, _marks(study, solver)
    reached = _read(path, marks, study.initial.x.size)
    if reached is not None:
        say(f"the first relaxation goes on from iteration {reached.iteration}\n")
    return Checkpoints(reached, lambda checkpoint: _keep(path, marks, checkpoint))


def remove_unfinished(folder: Path) -> None:
    """Remove what is of no use once the relaxed state is recorded, or where all starts again."""
    for name in (UNFINISHED, UNFINISHED + PARTIAL):
        with suppress(OSError):  # it may stay: it is of no harm, and the next run tries again
            (folder / name).unlink(missing_ok=True)


def _marks(study: Study, solver: str) -> dict[str, str]:
    """What a relaxation must have in common with another one to take the same steps."""
    start = hashlib.sha256(study.initial.x.tobytes()).hexdigest()
    return {"version": study.version, "design": study.design_hash, "start": start, "solver": solver}


def _read(path: Path, marks: dict[str, str], unknowns: int) -> Checkpoint | None:
    """The checkpoint in the file, if there is one with these marks and so many unknowns."""
    if not path.exists():
        return None
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            found = {name: str(arrays[name]) for name in marks}
            values = {name: arrays[name] for name in _KEYS} if found == marks else {}
    except _SPOILT as error:
        _note(f"{path}: it cannot be read ({error}), and {AGAIN}")
        return None
    if others := [name for name in marks if found[name] != marks[name]]:
        _note(f"{path}: it is of another {' and another '.join(others)}, and {AGAIN}")
        return None
    scalars = {name: value.item() for name, value in values.items() if value.ndim == 0}
    checkpoint = Checkpoint(**values | scalars)
    wanted = (len(checkpoint.curvatures), unknowns)
    if (checkpoint.steps.shape, checkpoint.turns.shape, checkpoint.q.shape) != (wanted, wanted, wanted[1:]):
        _note(f"{path}: it has {checkpoint.q.size} unknowns in place of {unknowns}, and {AGAIN}")
        return None
    return checkpoint


def _keep(path: Path, marks: dict[str, str], checkpoint: Checkpoint) -> None:
    values: dict[str, Any] = marks | {name: getattr(checkpoint, name) for name in _KEYS}
    try:
        with replacing(path) as partial, partial.open("wb") as file:
            np.savez(file, **values)
    except OSError as error:
        _note(f"{path}: {error.strerror or error}; should this run be interrupted, {AGAIN} or an earlier place")


def _note(words: str) -> None:
    warnings.warn(words, CircuittexWarning, stacklevel=4)
