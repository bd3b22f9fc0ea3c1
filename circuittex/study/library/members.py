"""The members of an ensemble, for the corners of its library."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from circuittex.base.errors import StoreError
from circuittex.results.records import Study
from circuittex.results.store import RESULTS, load_study
from circuittex.study.plan import plan

MEMBERS = "members"
"""Folder of the members' folders in that of an ensemble."""


def is_ensemble(folder: Path) -> bool:
    """Whether a folder of results is that of an ensemble."""
    return (folder / MEMBERS).is_dir() and not (folder / RESULTS).exists()


def complete_members(folder: str | Path) -> Iterator[Study]:
    """The members of an ensemble that have all their states, one at a time, in their order: they are large.

    Raises `StoreError` where there is none.
    """
    found = 0
    for path in sorted((Path(folder) / MEMBERS).glob(f"*/{RESULTS}")):
        study = load_study(path)
        if len(study.records) == len(plan(study.design)):
            found += 1
            yield study
    if not found:
        raise StoreError(f"{folder}: no member of the ensemble has all its states")
