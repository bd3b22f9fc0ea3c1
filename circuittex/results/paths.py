"""A study path by path: which records belong together, and where a path has come farthest."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from circuittex.results.records import Record, Study


def loading_paths(study: Study) -> dict[str, tuple[Record, ...]]:
    """The records of each loading path, the relaxed state first: every path starts there.

    A study of the relaxed state alone has one path without a name.
    """
    start = tuple(record for record in study.records if not record.path)
    names = dict.fromkeys(record.path for record in study.records if record.path)
    return {name: start + tuple(r for r in study.records if r.path == name) for name in names} or {"": start}


def farthest(records: Sequence[Record]) -> Record:
    """The record with the largest magnitude of strain; the first of them, before a path turns back."""
    return max(records, key=lambda record: abs(record.strain))


def turns(strains: Sequence[float]) -> list[int]:
    """Indices at which a path changes the direction of its strain, without its two ends.

    >>> turns([0.0, 0.1, 0.2, 0.1, 0.0, -0.1]), turns([0.0, 0.1, 0.1, 0.2])
    ([2], [])
    """
    found, direction = [], 0.0
    for index, (before, after) in enumerate(pairwise(strains)):
        step = after - before
        if step * direction < 0.0:
            found.append(index)
        if step:
            direction = step
    return found
