"""Which fibril passes over which: counted from the centre lines alone, whatever they were moved through.

In a projection every place where two lines cross has a sign, that of the turn from the one drawn first to the other.
The sum of the signs of those crossings at which the first is the upper one,

    n(f, g) = sum of sign(u_f x u_g)  over crossings with f above g,

cannot change while the lines move, unless one is drawn through the other or an end passes over or under a line. Lines
that run on straight for ever have no ends, so n tells whether they passed through one another, by its value before and
after and by nothing in between: half of what is called the linking number of closed lines. Two fibrils that cross, as
warp and weft, are seen from above, where n is 1 or 0 as the draft says. Parallel ones are seen along a direction across
them. The directions are askew, so that no symmetry of a weave puts a crossing on a node.
"""

from __future__ import annotations

from math import cos, sin
from typing import Any

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled
from circuittex.base.frozen import frozen

ASKEW = 0.0123, 0.0071
"""Slopes dx/dz and dy/dz of the direction in which crossings of warp and weft are seen: almost from above."""
ACROSS = 1.0
"""Angle about the axis of parallel fibrils, from the normal of the fabric, of the direction in which they are seen."""
BEYOND = 10.0
"""How far lines run on beyond their ends, in parts of the largest extent of all."""


@frozen
class Lines:
    """F centre lines as polylines, line after line."""

    points: Floats
    """(P, 3) mm."""
    first: Ints
    """(F + 1,) offsets into the points."""
    axis: Ints
    """(F,) 0 for a line along x, 1 along y."""


@frozen
class Windings:
    """The sums n(f, g) of the pairs for which they are not 0."""

    pairs: Ints
    """(K, 2) fibrils, in rising order; f is the warp fibril of two that cross, else the lower number."""
    number: Ints
    """(K,) n(f, g)."""


def windings(lines: Lines) -> Windings:
    """n(f, g) for all pairs: of different axes seen from above, of one axis seen across it.

    A warp line over a weft line counts 1, under it 0:

    >>> t = np.linspace(-1.0, 1.0, 5)[:, None]
    >>> over = np.vstack([t * [1.0, 0.0, 0.0] + [0.0, 0.0, 0.1], t * [0.0, 1.0, 0.0]])
    >>> windings(Lines(over, np.array([0, 5, 10]), np.array([0, 1]))).number
    array([1])
    >>> len(windings(Lines(over * [1.0, 1.0, -1.0], np.array([0, 5, 10]), np.array([0, 1]))).number)
    0
    """
    points, first = _run_on(lines)
    line = np.repeat(np.arange(len(lines.axis)), np.diff(first))
    segments = np.flatnonzero(line[:-1] == line[1:])
    found = []
    for across, view in ((True, _from_above(points)), (False, _along_the_fabric(points, lines.axis[line]))):
        low = np.minimum(view[segments, 0], view[segments + 1, 0])
        order = segments[np.argsort(low, kind="stable")]
        count = _find(view, line, lines.axis, order, across, np.empty((0, 3), dtype=np.int64))
        hits = np.empty((count, 3), dtype=np.int64)
        _find(view, line, lines.axis, order, across, hits)
        found.append(hits)
    return _summed(np.concatenate(found))


def changed(before: Windings, after: Windings) -> Ints:
    """(K, 2) the pairs whose n differs.

    >>> one = Windings(np.array([[0, 1], [0, 2]]), np.array([1, 1]))
    >>> changed(one, Windings(np.array([[0, 1], [1, 2]]), np.array([1, -1])))
    array([[0, 2],
           [1, 2]])
    """
    hits = [np.column_stack([w.pairs, sign * w.number]) for w, sign in ((after, 1), (before, -1))]
    return _summed(np.concatenate(hits)).pairs


def drafted(draft: Ints, yarn: Ints) -> Windings:
    """n(f, g) that a draft (warp yarns, weft yarns) asks of the warp and weft fibrils in the yarns `yarn` (F,).

    Pairs of one axis have none here.

    >>> drafted(np.array([[1, 0]]), np.array([0, 1, 2])).pairs
    array([[0, 1]])
    """
    n_warp = len(draft)
    warp, weft = np.flatnonzero(yarn < n_warp), np.flatnonzero(yarn >= n_warp)
    f, g = np.nonzero(draft[yarn[warp][:, None], yarn[weft] - n_warp])
    return _summed(np.column_stack([warp[f], weft[g], np.ones(len(f), dtype=np.int64)]))


def _summed(hits: Ints) -> Windings:
    """The sums of hits (H, 3), of a pair and a number each, that are not 0."""
    pairs, place = np.unique(hits[:, :2], axis=0, return_inverse=True)
    number = np.zeros(len(pairs), dtype=np.int64)
    np.add.at(number, place.reshape(-1), hits[:, 2])
    return Windings(pairs[number != 0], number[number != 0])


def _run_on(lines: Lines) -> tuple[Floats, Ints]:
    """The points and offsets of lines that run on along their axes at both ends."""
    points, head, tail = lines.points, lines.first[:-1], lines.first[1:] - 1
    outward = np.eye(3)[lines.axis] * np.sign(points[tail, lines.axis] - points[head, lines.axis])[:, None]
    far = BEYOND * float(np.ptp(points, axis=0).max()) * outward
    # Between two lines the tail of the one comes before the head of the other.
    at, more = np.concatenate([tail + 1, head]), np.concatenate([points[tail] + far, points[head] - far])
    return np.insert(points, at, more, axis=0), lines.first + 2 * np.arange(len(lines.first))


def _from_above(points: Floats) -> Floats:
    """(P, 3) two coordinates of the view from above and the height along it."""
    return np.column_stack([points[:, :2] - points[:, 2:] * np.array(ASKEW), points[:, 2]])


def _along_the_fabric(points: Floats, axis: Ints) -> Floats:
    """(P, 3) the same for the view across the lines' own axes (P,)."""
    rows = np.arange(len(points))
    along, other, up = points[rows, axis], points[rows, 1 - axis], points[:, 2]
    return np.column_stack([along, cos(ACROSS) * other - sin(ACROSS) * up, sin(ACROSS) * other + cos(ACROSS) * up])


@compiled
def _left_of(view: Any, a: int, b: int, c: int) -> bool:
    """Whether point c lies left of the line from a to b, or on it.

    Segments that share the point c ask this in the same words: a line that passes through it is crossed once.
    """
    return bool(
        (view[b, 0] - view[a, 0]) * (view[c, 1] - view[a, 1]) >= (view[b, 1] - view[a, 1]) * (view[c, 0] - view[a, 0])
    )


@compiled
def _upper(view: Any, p: int, q: int) -> bool:
    """Whether the segment from point p is above that from point q where the two cross."""
    u0, u1 = view[p + 1, 0] - view[p, 0], view[p + 1, 1] - view[p, 1]
    v0, v1 = view[q + 1, 0] - view[q, 0], view[q + 1, 1] - view[q, 1]
    w0, w1 = view[q, 0] - view[p, 0], view[q, 1] - view[p, 1]
    turn = u0 * v1 - u1 * v0
    s, t = (w0 * v1 - w1 * v0) / turn, (w0 * u1 - w1 * u0) / turn
    height = view[p, 2] + s * (view[p + 1, 2] - view[p, 2])
    return bool(height > view[q, 2] + t * (view[q + 1, 2] - view[q, 2]))


@compiled
def _find(view: Any, line: Any, axis: Any, order: Any, across: bool, hits: Any) -> int:
    """Number of crossings in the view at which the first line is the upper one; fills hits (H, 3): first, second, sign.

    order (S,): the segments, each by its first point, by the lower end of their first coordinate. `across`: pairs of
    lines of different axes, else of the same.
    """
    count = 0
    for n in range(order.shape[0]):
        high = max(view[order[n], 0], view[order[n] + 1, 0])
        for m in range(n + 1, order.shape[0]):
            i, j = order[n], order[m]
            if min(view[j, 0], view[j + 1, 0]) > high:
                break
            if line[i] == line[j] or (axis[line[i]] != axis[line[j]]) != across:
                continue
            if max(view[i, 1], view[i + 1, 1]) < min(view[j, 1], view[j + 1, 1]):
                continue
            if max(view[j, 1], view[j + 1, 1]) < min(view[i, 1], view[i + 1, 1]):
                continue
            first = axis[line[i]] < axis[line[j]] if across else line[i] < line[j]
            p, q = (i, j) if first else (j, i)
            left = _left_of(view, q, q + 1, p)
            if left == _left_of(view, q, q + 1, p + 1) or _left_of(view, p, p + 1, q) == _left_of(
                view, p, p + 1, q + 1
            ):
                continue
            if _upper(view, p, q):
                if count < hits.shape[0]:
                    hits[count, 0], hits[count, 1], hits[count, 2] = line[p], line[q], 1 if left else -1
                count += 1
    return count
