"""A study loading by loading: which records belong together, and where one has come farthest."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from circuittex.results.records import Record, Study


def by_loading(study: Study) -> dict[str, tuple[Record, ...]]:
    """Name of a loading path -> its records, the relaxed state first: every loading starts there.

    A study of the relaxed state alone has one without a name.
    """
    start = tuple(record for record in study.records if not record.loading)
    names = dict.fromkeys(record.loading for record in study.records if record.loading)
    return {name: start + tuple(r for r in study.records if r.loading == name) for name in names} or {"": start}


def farthest(records: Sequence[Record]) -> Record:
    """The record with the largest magnitude of strain; the first of them, before a loading turns back."""
    return max(records, key=lambda record: abs(record.strain))


def turns(strains: Sequence[float]) -> list[int]:
    """Indices at which a loading changes the direction of its strain, without its two ends.

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
