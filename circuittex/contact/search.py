"""Candidate search: which intervals can touch which fibrils. It cannot miss a pair.

Every interval lies inside the hull of its Bézier points, so inside their bounding sphere and box. Pairs
whose spheres or boxes are further apart than the reach cannot touch; all others are kept.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from circuittex.base.arrays import Floats, Ints
from circuittex.contact.curve import CurveTable, bezier
from circuittex.mech.pattern import distinct
from circuittex.solvers.ranges import ranges

CONTROL_MOTION = 4 / 3
"""A Bézier point moves at most this times as far as the nodes that define it (the sum of its weights' magnitudes)."""


class Candidates(NamedTuple):
    """Rows (interval of one fibril, another or the same one, a range of its intervals that may be in reach).

    Where an interval is near several stretches of a fibril, each has a row.
    """

    interval: Ints
    fibril: Ints
    first: Ints
    last: Ints
    """last interval of the range, included."""


def find_candidates(table: CurveTable, r: Floats, radius: Floats, skin: float) -> Candidates:
    """All (interval, fibril) that come within R + R' + skin of one another; both directions.

    r (N, 3) nodes, mm; radius (F,) mm; skin mm. Each interval is near itself.
    """
    hull = bezier(table, r)
    low, high = hull.min(axis=1), hull.max(axis=1)
    centre = (low + high) / 2
    ball = np.sqrt(((hull - centre[:, None]) ** 2).sum(axis=2)).max(axis=1)
    thick = radius[table.fibril] + skin / 2
    pairs = cKDTree(centre).query_pairs(2 * float((ball + thick).max()), output_type="ndarray")
    i, j = pairs[:, 0], pairs[:, 1]
    near = ((centre[i] - centre[j]) ** 2).sum(axis=1) <= (ball[i] + ball[j] + thick[i] + thick[j]) ** 2
    i, j = i[near], j[near]
    apart = np.maximum(0.0, np.maximum(low[i] - high[j], low[j] - high[i]))
    near = (apart**2).sum(axis=1) <= (thick[i] + thick[j]) ** 2
    itself = np.arange(len(hull))
    i, j = np.concatenate([i[near], j[near], itself]), np.concatenate([j[near], i[near], itself])
    permutation = np.lexsort((j, i))
    i, j = i[permutation], j[permutation]
    fibril = table.fibril[j]
    start = np.flatnonzero(
        (np.diff(i, prepend=-1) != 0) | (np.diff(j, prepend=-2) != 1) | (np.diff(fibril, prepend=0) != 0)
    )
    end = np.append(start[1:], len(i)) - 1
    return Candidates(interval=i[start], fibril=fibril[start], first=j[start], last=j[end])


def bent_back(table: CurveTable, candidates: Candidates, turn: Floats, angle: float) -> NDArray[np.bool_]:
    """(rows,) where a fibril may turn by `angle` or more between an interval and a stretch of its own.

    turn (I + 1,) as `Hull.turn`. Where it turns by less than a quarter it cannot touch itself.
    """
    i, first, last = candidates.interval, candidates.first, candidates.last
    most = np.maximum(turn[last + 1] - turn[i], turn[i + 1] - turn[first])
    return np.asarray((table.fibril[i] == candidates.fibril) & (most >= angle))


def coupled_nodes(table: CurveTable, candidates: Candidates, own: NDArray[np.bool_]) -> Ints:
    """(P, 2) node pairs that contact between the candidates can couple, windows included.

    own (rows,): which of the stretches of an interval's own fibril are to be coupled.
    """
    window = table.window
    rows = np.flatnonzero(own | (table.fibril[candidates.interval] != candidates.fibril))
    candidates = Candidates(*(column[rows] for column in candidates))
    start, stop = window[candidates.first], window[candidates.last] + 4
    count = stop - start
    n = int(window.max()) + 4
    # windows of one, nodes of the other
    key = distinct(np.repeat(window[candidates.interval], count) * n + ranges(start, count))
    mine, other = np.repeat(key // n, 4) + np.tile(np.arange(4), len(key)), np.repeat(key % n, 4)
    between = np.stack([mine, other], axis=1)
    i, j = np.triu_indices(4, 1)
    within = distinct(window)[:, None, None] + np.stack([i, j], axis=1)
    return np.concatenate([between, within.reshape(-1, 2)])
