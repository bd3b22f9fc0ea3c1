"""The ways along which strain is an input: the states of a loading, there and back."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.design.experiment import REST
from circuittex.electrical.network.names import unique_names
from circuittex.results.records import Study


@frozen
class StrainPath:
    """States of one loading whose strains rise or fall all the way."""

    word: str
    """For names: that of the loading, with '_load' or '_unload' where it turns back."""
    loading: str
    """Name of the loading in the design."""
    strain: Floats
    """(K,) rising."""
    records: Ints
    """(K,) the record of the study that each strain belongs to."""


def paths(study: Study) -> tuple[StrainPath, ...]:
    """The paths of all loadings of which at least one state beside the relaxed one is recorded, in their order.

    A loading that starts from a strained state has none: its strain is not all that it does to the fabric.
    """
    found = []
    words = unique_names([loading.name for loading in study.design.loading])
    for loading, word in zip(study.design.loading, words, strict=True):
        own = [k for k, record in enumerate(study.records) if record.loading == loading.name]
        if not own or study.records[0].loading or loading.start != REST:
            continue
        states = np.array([0, *own])
        strain = np.array([study.records[k].strain for k in states])
        ways = branches(strain)
        for number, way in enumerate(ways):
            rising = way if strain[way[-1]] > strain[way[0]] else way[::-1]
            name = word if len(ways) == 1 else f"{word}_{_way(number)}"
            found.append(StrainPath(name, loading.name, strain[rising], states[rising]))
    return tuple(found)


def branches(strain: Sequence[float] | Floats) -> list[Ints]:
    """The places (n,) of each part of a history in which strain only rises or only falls; a turn belongs to both.

    >>> [each.tolist() for each in branches([0.0, 0.1, 0.2, 0.1, 0.0])]
    [[0, 1, 2], [2, 3, 4]]
    """
    step = np.sign(np.diff(strain))
    turns = [0, *(np.flatnonzero(step[1:] != step[:-1]) + 1).tolist(), len(step)]
    ways = [np.arange(first, last + 1) for first, last in pairwise(turns)]
    return [way for way in ways if len(way) > 1 and step[way[0]] != 0.0]


def _way(number: int) -> str:
    """'load', 'unload', 'load_2', ... of the parts of a history."""
    again = number // 2 + 1
    return ("unload" if number % 2 else "load") + (f"_{again}" if again > 1 else "")
