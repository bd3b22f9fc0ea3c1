"""The results of an ensemble as arrays, and their percentiles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.results.records import INITIAL
from circuittex.study.ensemble.quantities import Quantity

BANDS = (5.0, 25.0, 50.0, 75.0, 95.0)
"""The percentiles that tables and figures show; 50 is the median."""


@frozen
class Ensemble:
    """M members, S states and Q quantities."""

    version: str
    """Version of circuittex that computed it."""
    design: Design
    """What was perturbed; its packing holds the amplitudes and the ensemble's seed."""
    design_hash: str
    """Hash of `design`."""
    seeds: tuple[int, ...]
    """(M,) seed of each member's packing: `[packing] seed` of a design that is that member."""
    failures: tuple[str, ...]
    """(M,) why a member has not all its states; empty where it has."""
    disagreeing: tuple[tuple[str, ...], ...]
    """(M,) names of the states of a member on which the routes to the currents disagree."""
    states: tuple[str, ...]
    """(S,) names, the relaxed state first."""
    loadings: tuple[str, ...]
    """(S,) name of the loading path of each state; empty for the relaxed state."""
    strains: Floats
    """(S,) the strain that labels each state."""
    quantities: tuple[Quantity, ...]
    """(Q,) what was measured."""
    values: Floats
    """(M, S, Q); nan where a member has no such state or the quantity is not determined."""
    start: str = INITIAL
    """Where the members' first relaxations start: 'initial', or of whose states."""

    @property
    def count(self) -> Ints:
        """(S, Q) members that have a value."""
        return np.asarray((~np.isnan(self.values)).sum(axis=0), dtype=np.int64)

    @property
    def finished(self) -> int:
        """Members that have all their states."""
        return sum(not failure for failure in self.failures)


def percentiles(values: Floats, percents: Sequence[float] = BANDS) -> Floats:
    """(P, ...) percentiles of `values` (M, ...) along the first axis, nan left out; nan where nothing is left.

    With n values x_1 <= ... <= x_n the percentile p lies at the place 1 + (n - 1) p / 100 among them, linearly between
    neighbours: definition 7 of Hyndman and Fan (1996), which is NumPy's method 'linear'. Infinite values count.

    >>> percentiles(np.array([3.0, 1.0, np.nan, 2.0, 4.0]), (0, 50, 75, 100))
    array([1.  , 2.5 , 3.25, 4.  ])
    """
    ordered = np.sort(values, axis=0)  # nan last
    count = (~np.isnan(values)).sum(axis=0)
    place = np.multiply.outer(np.asarray(percents, dtype=np.float64) / 100.0, np.maximum(count - 1, 0))
    below = np.floor(place).astype(np.int64)
    share = place - below
    low = _take(ordered, below)
    high = _take(ordered, np.minimum(below + 1, np.maximum(count - 1, 0)))
    with np.errstate(invalid="ignore"):  # inf - inf, where both neighbours are the same infinity
        between = low + share * (high - low)
    return np.where((share == 0.0) | (low == high), low, between)


def _take(ordered: Floats, places: Ints) -> Floats:
    """`ordered` (M, ...) at `places` (P, ...) along its first axis."""
    return np.stack([np.take_along_axis(ordered, place[None], axis=0)[0] for place in places])
