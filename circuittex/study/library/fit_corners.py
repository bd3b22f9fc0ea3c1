"""Corners of an ensemble for the networks of Ry and Rc."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.study.library.levels import Levels
from circuittex.study.library.reduction import CORNERS


@frozen
class FitCorner:
    """The fitted networks of every state at a percentile of the ensemble."""

    end: str
    """Of the names of its sub-circuits."""
    packings: int
    """How many members it is found from."""
    levels: Levels
    """With Ry and Rc at that percentile."""


def fit_corners(known: Levels, members: Sequence[Levels]) -> tuple[FitCorner, ...]:
    """The 5th, 50th and 95th percentile of every Ry and Rc over M members; none where a member has no fit.

    Each resistor is at that percentile of its own at once, as in the corners of the ports.
    """
    if known.reason or not members or any(member.reason for member in members):
        return ()
    found = []
    for end, percentile in CORNERS.items():
        along = _percentile([member.along for member in members], percentile)
        across = _percentile([member.across for member in members], percentile)
        found.append(FitCorner(end, len(members), replace(known, along=along, across=across)))
    return tuple(found)


def _percentile(ohm: Sequence[Floats], percentile: float) -> Floats:
    """Resistances at a percentile of their conductances, which are 0 where nothing passes."""
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / np.percentile([1.0 / each for each in ohm], percentile, axis=0))
