"""Closest points between the contact points of one fibril and the centre line of another [24]."""

from __future__ import annotations

from typing import Any

import numpy as np

from circuittex.base.compiled import compiled
from circuittex.contact.curve import evaluate

MAX_STEPS = 60
"""Newton with bisection as its safeguard needs 4 or 5; bisection alone would need 52 for full precision."""


@compiled
def _nearest_chord(r: Any, x: Any, first_node: int, first: int, last: int, bulge: Any, base: int, found: Any) -> float:
    """Best starting position among the chords first..last, and a lower bound of the distance to the curve.

    found (1,) receives the position in nodes. Chord k joins nodes first_node + k and k + 1.
    """
    best, bound = np.inf, np.inf
    for k in range(first, last + 1):
        a = first_node + k
        along, length, t = 0.0, 0.0, 0.0
        for c in range(3):
            edge = r[a + 1, c] - r[a, c]
            along += edge * (x[c] - r[a, c])
            length += edge * edge
        t = min(1.0, max(0.0, along / length))
        distance = 0.0
        for c in range(3):
            distance += (x[c] - r[a, c] - t * (r[a + 1, c] - r[a, c])) ** 2
        distance = np.sqrt(distance)
        bound = min(bound, distance - bulge[base + k])
        if distance < best:
            best = distance
            found[0] = k + t
    return bound


@compiled
def _closest(basis: Any, r: Any, window: Any, kind: Any, base: int, n: int, x: Any, s: float, work: Any) -> float:
    """Position of the closest point of a fibril of n intervals (the first is `base`) to x, starting from s.

    Finds the root of phi'(s) = -(x - r).r' by Newton's method inside a bracket that bisection shrinks.
    work (4, 4): scratch for r, r', r'' and the weights.
    """
    low, high = max(0.0, np.floor(s) - 1.0), min(float(n), np.floor(s) + 2.0)
    for _ in range(MAX_STEPS):
        k = min(n - 1, int(s))
        b, w = basis[kind[base + k]], window[base + k]
        for order in range(3):
            evaluate(b, r, w, s - k, order, work[3], work[order])
        slope, bend = 0.0, 0.0
        for c in range(3):
            slope -= (x[c] - work[0, c]) * work[1, c]
            bend += work[1, c] * work[1, c] - (x[c] - work[0, c]) * work[2, c]
        if slope > 0.0:
            high = s
        else:
            low = s
        step = -slope / bend if bend > 0.0 else (1.0 if slope < 0.0 else -1.0)
        new = s + step
        if new < low or new > high:
            new = low if slope > 0.0 and low == 0.0 else (high if slope < 0.0 and high == n else 0.5 * (low + high))
            if new == s:
                return s
        if abs(new - s) <= 1e-14 * n:
            return new
        s = new
    return s


@compiled
def find_contacts(
    r: Any,
    radius: Any,
    basis: Any,
    window: Any,
    kind: Any,
    first_interval: Any,
    first_node: Any,
    fibril: Any,
    bulge: Any,
    points: Any,
    interval: Any,
    other: Any,
    first: Any,
    last: Any,
    position: Any,
    overlap: Any,
) -> None:
    """For every candidate and every contact point of its interval: closest position and overlap (<= 0: none).

    r (N, 3); points (T,) local coordinates t of the contact points of an interval, by interval parity
    (rows of a (2, T) table, padded with -1); interval, other, first, last: the candidates; position and
    overlap (candidates, T) are filled.
    """
    x, work, found = np.empty(4), np.empty((4, 4)), np.empty(1)
    for i in range(interval.shape[0]):
        a, g = interval[i], other[i]
        f = fibril[a]
        base = first_interval[g]
        reach = radius[f] + radius[g]
        parity = (a - first_interval[f]) % points.shape[0]
        for p in range(points.shape[1]):
            overlap[i, p] = -1.0
            t = points[parity, p]
            if t < 0.0:
                continue
            evaluate(basis[kind[a]], r, window[a], t, 0, work[3], x)
            bound = _nearest_chord(r, x, first_node[g], first[i] - base, last[i] - base, bulge, base, found)
            if bound >= reach:
                continue
            n = first_interval[g + 1] - base
            s = _closest(basis, r, window, kind, base, n, x, found[0], work)
            k = min(n - 1, int(s))
            evaluate(basis[kind[base + k]], r, window[base + k], s - k, 0, work[3], work[0])
            distance = np.sqrt((x[0] - work[0, 0]) ** 2 + (x[1] - work[0, 1]) ** 2 + (x[2] - work[0, 2]) ** 2)
            position[i, p] = s
            overlap[i, p] = reach - distance
