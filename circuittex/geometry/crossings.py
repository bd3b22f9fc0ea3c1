"""Which fibril passes over which: counted from the centre lines alone, whatever they were moved through.

In a projection every place where two lines cross has a sign, that of the turn from the one drawn first to the other.
The sums of the signs of all their crossings, and of those alone at which the first is the upper one,

    total(f, g) = sum of sign(u_f x u_g),   above(f, g) = the same where f is above g,

do not change while the lines move, unless one is drawn through the other or an end passes over or under a line: of
closed lines, `above` would be the linking number. So they tell whether two fibrils passed through one another by their
values before and after, and by nothing in between. Warp and weft are seen from above, where `total` is 1, and `above`
is 1 or 0 as the draft says. Parallel fibrils are seen along a direction across them. The directions are askew, so that
no symmetry of a weave puts a crossing on a node.
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
class Crossings:
    """The K pairs of lines that cross in a projection."""

    pairs: Ints
    """(K, 2) the first and the second line, in rising order: of warp and weft the warp is the first."""
    total: Ints
    """(K,) sum of the signs of their crossings."""
    above: Ints
    """(K,) sum of the signs of those at which the first is the upper one."""


def woven(lines: Lines) -> Crossings:
    """The crossings of lines along x with lines along y, seen from above.

    >>> t = np.linspace(-1.0, 1.0, 5)[:, None]
    >>> over = np.vstack([t * [1.0, 0.0, 0.0] + [0.0, 0.0, 0.1], t * [0.0, 1.0, 0.0]])
    >>> found = woven(Lines(over, np.array([0, 5, 10]), np.array([0, 1])))
    >>> found.total, found.above
    (array([1]), array([1]))
    """
    points = lines.points
    view = np.column_stack([points[:, :2] - points[:, 2:] * np.array(ASKEW), points[:, 2]])
    return _crossings(lines, view, across=True)


def beside(lines: Lines) -> Crossings:
    """The crossings of lines of one axis with one another, seen across them.

    >>> t = np.linspace(-1.0, 1.0, 5)[:, None]
    >>> apart = np.vstack([t * [1.0, 0.0, 0.0] + [0.0, 0.0, 0.1], t * [1.0, 0.0, 0.0]])
    >>> len(beside(Lines(apart, np.array([0, 5, 10]), np.array([0, 0]))).pairs)
    0
    """
    rows, points = np.arange(len(lines.points)), lines.points
    axis = np.repeat(lines.axis, np.diff(lines.first))
    along, other, up = points[rows, axis], points[rows, 1 - axis], points[:, 2]
    view = np.column_stack([along, cos(ACROSS) * other - sin(ACROSS) * up, sin(ACROSS) * other + cos(ACROSS) * up])
    return _crossings(lines, view, across=False)


def against_draft(found: Crossings, draft: Ints, yarn: Ints) -> tuple[Ints, Ints]:
    """The pairs (K, 2) of warp and weft fibrils on the wrong side of one another, and those that do not cross any more.

    draft (warp yarns, weft yarns): 1 where the warp is above; yarn (F,) of each fibril, the warp's first. Fibrils that
    cross more than once must do so on one side; those that do not cross, as one has left the other's end, are on none.

    >>> one = Crossings(np.array([[0, 1]]), np.array([1]), np.array([1]))
    >>> [len(against_draft(one, np.array([[over]]), np.array([0, 1]))[0]) for over in (1, 0)]
    [0, 1]
    >>> against_draft(one, np.array([[1, 0]]), np.array([0, 1, 2]))[1]
    array([[0, 2]])
    """
    over = draft[yarn[found.pairs[:, 0]], yarn[found.pairs[:, 1]] - len(draft)]
    wrong = found.pairs[found.above != over * found.total]
    warp, weft = np.flatnonzero(yarn < len(draft)), np.flatnonzero(yarn >= len(draft))
    crosses = np.zeros((len(yarn), len(yarn)), dtype=np.bool_)
    held = found.pairs[found.total != 0]
    crosses[held[:, 0], held[:, 1]] = True
    f, g = np.nonzero(~crosses[np.ix_(warp, weft)])
    return wrong, np.column_stack([warp[f], weft[g]])


def changed(before: Crossings, after: Crossings) -> Ints:
    """(K, 2) the pairs that changed sides: another `above` with the same `total`, so that no end was passed.

    >>> none = np.empty((0, 2), dtype=np.int64)
    >>> wound = Crossings(np.array([[0, 2]]), np.array([0]), np.array([1]))
    >>> changed(Crossings(none, none[:, 0], none[:, 0]), wound)
    array([[0, 2]])
    """
    counts = [np.column_stack([c.total, c.above]) * sign for c, sign in ((after, 1), (before, -1))]
    pairs, difference = _summed(np.concatenate([after.pairs, before.pairs]), np.concatenate(counts))
    return np.asarray(pairs[(difference[:, 0] == 0) & (difference[:, 1] != 0)])


def _summed(pairs: Ints, numbers: Ints) -> tuple[Ints, Ints]:
    """The different ones of pairs (H, 2), in rising order, and the sums of their numbers (H, N)."""
    found, place = np.unique(pairs, axis=0, return_inverse=True)
    total = np.zeros((len(found), numbers.shape[1]), dtype=np.int64)
    np.add.at(total, place.reshape(-1), numbers)
    return found, total


def _crossings(lines: Lines, view: Floats, across: bool) -> Crossings:
    """The crossings in a view: two coordinates and the height of every point."""
    line = np.repeat(np.arange(len(lines.axis)), np.diff(lines.first))
    segments = np.flatnonzero(line[:-1] == line[1:])
    rising = segments[np.argsort(np.minimum(view[segments, 0], view[segments + 1, 0]), kind="stable")]
    hits = np.empty((0, 4), dtype=np.int64)
    count = _find(view, line, lines.axis, rising, across, hits)
    hits = np.empty((count, 4), dtype=np.int64)
    _find(view, line, lines.axis, rising, across, hits)
    pairs, numbers = _summed(hits[:, :2], hits[:, 2:])
    return Crossings(pairs, numbers[:, 0], numbers[:, 1])


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
def _find(view: Any, line: Any, axis: Any, rising: Any, across: bool, hits: Any) -> int:
    """Number of crossings in the view; fills hits (H, 4): first and second line, sign, sign where the first is above.

    rising (S,): the segments, each by its first point, by the lower end of their first coordinate. `across`: pairs of
    lines of different axes, else of the same.
    """
    count = 0
    for n in range(rising.shape[0]):
        high = max(view[rising[n], 0], view[rising[n] + 1, 0])
        for m in range(n + 1, rising.shape[0]):
            i, j = rising[n], rising[m]
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
            if count < hits.shape[0]:
                sign = 1 if left else -1
                hits[count, 0], hits[count, 1], hits[count, 2] = line[p], line[q], sign
                hits[count, 3] = sign if _upper(view, p, q) else 0
            count += 1
    return count
