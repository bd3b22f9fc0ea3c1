"""Candidate search: which intervals can touch which fibrils. It cannot miss a pair.

Every interval lies inside the hull of its Bézier points, so inside their bounding sphere and box. Pairs
whose spheres or boxes are further apart than the reach cannot touch; all others are kept.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.contact.curve import CurveTable, bezier
from circuittex.mech.pattern import distinct
from circuittex.solvers.ranges import ranges

CONTROL_MOTION = 4 / 3
"""A Bézier point moves at most this times as far as the nodes that define it (the sum of its weights' magnitudes)."""


@frozen
class Candidates:
    """Rows (interval of one fibril, another fibril, the range of its intervals that may be in reach)."""

    interval: Ints
    fibril: Ints
    first: Ints
    last: Ints
    """last interval of the range, included."""


def find_candidates(table: CurveTable, r: Floats, radius: Floats, skin: float) -> Candidates:
    """All (interval, other fibril) that come within R + R' + skin of one another; both directions.

    r (N, 3) nodes, mm; radius (F,) mm; skin mm.
    """
    hull = bezier(table, r)
    low, high = hull.min(axis=1), hull.max(axis=1)
    centre = (low + high) / 2
    ball = np.sqrt(((hull - centre[:, None]) ** 2).sum(axis=2)).max(axis=1)
    thick = radius[table.fibril] + skin / 2
    pairs = cKDTree(centre).query_pairs(2 * float((ball + thick).max()), output_type="ndarray")
    i, j = pairs[:, 0], pairs[:, 1]
    near = table.fibril[i] != table.fibril[j]
    near &= ((centre[i] - centre[j]) ** 2).sum(axis=1) <= (ball[i] + ball[j] + thick[i] + thick[j]) ** 2
    i, j = i[near], j[near]
    apart = np.maximum(0.0, np.maximum(low[i] - high[j], low[j] - high[i]))
    near = (apart**2).sum(axis=1) <= (thick[i] + thick[j]) ** 2
    i, j = np.concatenate([i[near], j[near]]), np.concatenate([j[near], i[near]])
    order = np.lexsort((j, i))
    i, j = i[order], j[order]
    key = i * len(radius) + table.fibril[j]
    start = np.flatnonzero(np.diff(key, prepend=-1))
    if len(start) == 0:
        none = np.empty(0, dtype=np.int64)
        return Candidates(interval=none, fibril=none, first=none, last=none)
    end = np.append(start[1:], len(key)) - 1
    return Candidates(interval=i[start], fibril=table.fibril[j[start]], first=j[start], last=j[end])


def coupled_nodes(table: CurveTable, candidates: Candidates) -> Ints:
    """(P, 2) node pairs that contact between the candidates can couple, windows included."""
    window = table.window
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
