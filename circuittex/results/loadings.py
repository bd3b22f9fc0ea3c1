"""A study loading by loading: which records belong together, and where one has come farthest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from circuittex.design.grid import starting_state
from circuittex.results.records import Record, Study


def by_loading(study: Study) -> dict[str, tuple[Record, ...]]:
    """Name of a loading path -> its records, that of the state where it starts first, whose strain is 0 there.

    A study of the relaxed state alone has one without a name.
    """
    names = dict.fromkeys(record.loading for record in study.records)
    own = {name: tuple(record for record in study.records if record.loading == name) for name in names}
    relaxed = own.pop("", ())
    start, loadings = dict[str, tuple[Record, ...]](), study.design.loading
    for number, loading in enumerate(loadings):
        if (place := starting_state(loadings, number)) and loading.name in own:
            start[loading.name] = (replace(own[loadings[place[0]].name][place[1]], strain=0.0),)
    return {name: start.get(name, relaxed) + records for name, records in own.items()} or {"": relaxed}


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
