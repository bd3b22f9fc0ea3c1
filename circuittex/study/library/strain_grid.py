"""The grids of two strains on which a study has every state: there both can be inputs of one part."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.results.records import Study

AXES = {"stretch_x": (0, 0), "stretch_y": (1, 1), "shear": (1, 0)}
"""Word of a strain, which is that of its parameter or pin -> where it stands in F - I."""
DIGITS = 12
"""Decimals to which strains are told apart: 1.05 - 1 is no 0.05."""
NAMED = 6
"""Missing states that a sentence names."""


@frozen
class StrainGrid:
    """The states at every pair of strains along two axes, all other strains being 0."""

    axes: tuple[str, str]
    """Two words of `AXES`."""
    first: Floats
    """(n,) rising."""
    second: Floats
    """(m,) rising."""
    records: Ints
    """(n, m) the record of the study at each pair."""

    @property
    def word(self) -> str:
        """For names: both axes."""
        return "_".join(self.axes)


def grids(study: Study, combine: Sequence[str] = ()) -> tuple[StrainGrid, ...]:
    """The grids of a study that are complete; `combine` names the two axes of one that must be.

    Raises `DesignError` that names the missing states where that one is not complete.
    """
    if combine and (len(set(combine)) != 2 or not set(combine) <= set(AXES)):
        raise DesignError("combine", ",".join(combine), f"it must be two of {', '.join(AXES)}")
    found = []
    for axes in combinations(AXES, 2):
        grid = _grid(study, axes)
        if isinstance(grid, StrainGrid):
            found.append(grid)
        elif set(combine) == set(axes):
            raise DesignError("combine", ",".join(axes), grid)
    return tuple(found)


def _grid(study: Study, axes: tuple[str, str]) -> StrainGrid | str:
    """The grid of two axes, or why there is none.

    Its lines are those on which a state with both strains lies, and those of no strain; of several states at the same
    strains the first counts. States with free edges are none: their strains are not those of the fabric.
    """
    free = {loading.name for loading in study.design.loading if loading.free}
    places = [AXES[axis] for axis in axes]
    states: dict[tuple[float, float], int] = {}
    for number, record in enumerate(study.records):
        offset = np.round(record.gradient - np.eye(2), DIGITS) + 0.0
        first, second = (float(offset[place]) for place in places)
        rest = offset.copy()
        rest[tuple(zip(*places, strict=True))] = 0.0
        if record.loading not in free and not rest.any():
            states.setdefault((first, second), number)
    lines = [state for state in states if all(state)] or list(states)
    strains = [sorted({0.0, *(line[k] for line in lines)}) for k in (0, 1)]
    for axis, along in zip(axes, strains, strict=True):
        if len(along) == 1:
            return f"no state has {axis} alone or with the other"
    missing = [pair for pair in product(*strains) if pair not in states]
    if missing:
        words = [" with ".join(f"{axis} {e:.6g}" for axis, e in zip(axes, pair, strict=True)) for pair in missing]
        more = f" and {len(words) - NAMED} more" if len(words) > NAMED else ""
        return f"no state is recorded at {'; '.join(words[:NAMED])}{more}: a loading of kind 'grid' has them all"
    records = np.array([[states[a, b] for b in strains[1]] for a in strains[0]])
    return StrainGrid(axes, np.array(strains[0]), np.array(strains[1]), records)
