"""How far a network is from the exact ports: between all pairs of pins, in all states, and in what strain changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.electrical.network.ports import PortMatrix, resistances

CHANGED = 0.01
"""A change of resistance counts from this part of the relaxed one on: less is no signal."""


@frozen
class Errors:
    """Relative errors of S states at all pairs of P pins; nan where there is nothing to compare."""

    pins: tuple[str, ...]
    """(P,)."""
    resistance: Floats
    """(S, P, P) of the resistance between two pins, all others open."""
    change: Floats
    """(S, P, P) of its change since the relaxed state, where that exceeds `CHANGED`."""

    @property
    def worst(self) -> tuple[float, float]:
        """Largest error in resistance and in change; nan where none is known."""
        return _over(self.resistance, np.max), _over(self.change, np.max)

    @property
    def median(self) -> tuple[float, float]:
        """Median error in resistance and in change."""
        return _over(self.resistance, np.median), _over(self.change, np.median)


def compared(exact: Sequence[PortMatrix], found: Sequence[PortMatrix]) -> Errors:
    """Errors of port matrices state by state; the first state is the relaxed one."""
    wanted = np.array([resistances(matrix) for matrix in exact])
    given = np.array([resistances(matrix) for matrix in found])
    joined = np.isfinite(wanted) & (wanted > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.where(joined, np.abs(given / wanted - 1.0), np.nan)
        change, other = wanted / wanted[0] - 1.0, given / given[0] - 1.0
        counts = joined & joined[0] & (np.abs(change) > CHANGED)
        moved = np.where(counts, np.abs(other / change - 1.0), np.nan)
    return Errors(exact[0].ports, off, moved)


def _over(values: Floats, how: np.ufunc | object) -> float:
    """A statistic of the values that are known."""
    known = values[~np.isnan(values)]
    return float(how(known)) if known.size else float("nan")  # type: ignore[operator]
