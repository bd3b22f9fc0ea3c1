"""Where a fibril comes closest to the contact points of another, or of its own, and where in between it is furthest.

From a point x the distance to a fibril has a minimum at each place where they may touch, and between two neighbouring
minima a maximum. Both are roots of phi'(s) = (y(s) - x).y'(s), on each interval a polynomial of fifth degree. Where the
bounds of `Hull` show that phi' rises, its signs at both ends tell all. Elsewhere its Bernstein coefficients do: they
change sign at least as often as it has roots, and exactly once where it has one.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled
from circuittex.contact.curve import evaluate
from circuittex.contact.hull import QUARTER

MAX_STEPS = 60
"""Newton with bisection as its safeguard needs 4 or 5; bisection alone would need 52 for full precision."""
LEAST_PIECE = 2.0**-30
"""Part of an interval within which a minimum and a maximum are not told apart: between them the distance changes by the
cube of it, far below round-off, and so does what they add to the energy."""


class Fibrils(NamedTuple):
    """Tables of the fibrils, as compiled functions take them."""

    radius: Floats
    """(F,) R, mm."""
    first_node: Ints
    """(F + 1,) offsets into the nodes."""
    first_interval: Ints
    """(F + 1,) offsets into the intervals."""
    fibril: Ints
    """(I,) fibril of each interval."""


class Found(NamedTuple):
    """Room for what `find_contacts` finds: places where the distance is smallest or largest and within reach."""

    row: Ints
    """the candidate."""
    point: Ints
    """the contact point of its interval."""
    position: Floats
    """place on the other fibril, in nodes."""
    overlap: Floats
    """R + R' - |d| > 0, mm."""
    sign: Floats
    """1 where the distance is smallest, -1 where it is largest."""


class _Scratch(NamedTuple):
    x: Floats
    """(3,) the contact point."""
    place: Floats
    """(3, 3) y, y', y''."""
    weight: Floats
    """(4,) weights of the nodes."""
    pieces: Floats
    """(depth, 8) pieces of an interval still to be looked at: Bernstein coefficients, lower and upper end."""


class _Meeting(NamedTuple):
    row: int
    """the candidate."""
    point: int
    """the contact point of its interval."""
    base: int
    """first interval of the other fibril."""
    n: int
    """number of its intervals."""
    reach: float
    """R + R', mm."""
    quick: bool
    """Whether the powers of the local coordinate are followed, not the weights of the nodes."""


def find_contacts(
    curve: Any, hull: Any, fibrils: Any, points: Floats, rows: Any, room: int, *, quick: bool = False
) -> Found:
    """All places within reach, for every candidate and every contact point of its interval, in that order.

    `points` (parity, T) are the local coordinates of the contact points of an interval, rows padded with -1; `rows` are
    `Candidates`; `room` is the number of places expected: where there are more, they are found anew. `quick` places are
    the same but for rounding, at a third of the cost.
    """
    while True:
        row, point = np.empty((2, room), dtype=np.int64)
        position, overlap, sign = np.empty((3, room))
        found = Found(row, point, position, overlap, sign)
        count = int(_find(curve, hull, fibrils, points, rows, found, quick))
        if count <= room:
            return Found(row[:count], point[:count], position[:count], overlap[:count], sign[:count])
        room = count


@compiled
def _find(curve: Any, hull: Any, fibrils: Any, points: Any, rows: Any, found: Any, quick: bool) -> int:
    """Fill `found` as far as it reaches; the number of places there are."""
    scratch = _Scratch(np.empty(3), np.empty((3, 3)), np.empty(4), np.empty((64, 8)))
    # Taken out of their tuples once: to do so for every point would cost as much as the search.
    r, x, bulge, tangent, bend, speed = curve.r, scratch.x, hull.bulge, hull.tangent, hull.bend, hull.least_speed
    power, interval, other, first, last, turn = hull.power, rows.interval, rows.fibril, rows.first, rows.last, hull.turn
    fibril, radius, first_interval = fibrils.fibril, fibrils.radius, fibrils.first_interval
    count = 0
    for i in range(interval.shape[0]):
        a, g = interval[i], other[i]
        f = fibril[a]
        own = f == g
        if own and turn[last[i] + 1] - turn[a] < QUARTER and turn[a + 1] - turn[first[i]] < QUARTER:
            continue
        base, n, reach = first_interval[g], first_interval[g + 1] - first_interval[g], radius[f] + radius[g]
        node = fibrils.first_node[g]
        parity = (a - first_interval[f]) % points.shape[0]
        for p in range(points.shape[1]):
            t = points[parity, p]
            if t < 0.0:
                continue
            evaluate(curve.basis[curve.kind[a]], r, curve.window[a], t, 0, scratch.weight, x)
            meeting = _Meeting(i, p, base, n, reach, quick)
            known, slope, far = -1, 0.0, 0.0  # slope and square of the distance at the node `known`
            for j in range(first[i], last[i] + 1):
                k = j - base
                distance, start = _chord(r, x, node + k)
                if distance - bulge[j] >= reach:
                    continue
                if known != k:
                    slope, far = _at_node(r, tangent, x, node + k)
                next_slope, next_far = _at_node(r, tangent, x, node + k + 1)
                if k == 0 and not _negative(slope):
                    count = _record(curve, power, meeting, 0.0, 1.0, scratch, found, count)
                rises = (np.sqrt(max(far, next_far)) + bulge[j]) * bend[j] < speed[j] ** 2
                if own or not rises:
                    itself = t + a - j if own else -1.0
                    _coefficients(hull.points[j], x, scratch.pieces[0])
                    scratch.pieces[0, 0], scratch.pieces[0, 5] = slope, next_slope
                    count = _isolate(curve, power, meeting, k, itself, scratch, found, count)
                elif quick and _negative(slope) and not _negative(next_slope):
                    s = _quick_root(power[j], x, k, 1e-14 * n, k + start, float(k), k + 1.0, 1.0)
                    count = _keep(i, p, s, reach - _quick_distance(power[j], s - k, x), 1.0, found, count)
                elif _negative(slope) and not _negative(next_slope):
                    s = _root(curve, power, meeting, k + start, float(k), k + 1.0, 1.0, scratch)
                    count = _record(curve, power, meeting, s, 1.0, scratch, found, count)
                if k == n - 1 and _negative(next_slope):
                    count = _record(curve, power, meeting, float(n), 1.0, scratch, found, count)
                known, slope, far = k + 1, next_slope, next_far
    return count


@compiled
def _chord(r: Any, x: Any, a: int) -> tuple[float, float]:
    """Distance of x from the chord between the nodes a and a + 1, and where on it (0 to 1)."""
    along, length, square = 0.0, 0.0, 0.0
    for c in range(3):
        edge = r[a + 1, c] - r[a, c]
        along += edge * (x[c] - r[a, c])
        length += edge * edge
    t = min(1.0, max(0.0, along / length))
    for c in range(3):
        square += (x[c] - r[a, c] - t * (r[a + 1, c] - r[a, c])) ** 2
    return np.sqrt(square), t


@compiled
def _at_node(r: Any, tangent: Any, x: Any, node: int) -> tuple[float, float]:
    """phi' and the square of the distance at a node."""
    slope, square = 0.0, 0.0
    for c in range(3):
        u = r[node, c] - x[c]
        slope += u * tangent[node, c]
        square += u * u
    return slope, square


@compiled
def _negative(value: float) -> bool:
    """Below zero, or zero with a minus sign: so every value has one of two signs."""
    return bool(np.copysign(1.0, value) < 0.0)


@compiled
def _record(curve: Any, power: Any, meeting: Any, s: float, sign: float, scratch: Any, found: Any, count: int) -> int:
    """Keep the place s if it is within reach."""
    k = min(meeting.n - 1, int(s))
    x, y, interval = scratch.x, scratch.place[0], meeting.base + k
    if meeting.quick:
        distance = _quick_distance(power[interval], s - k, x)
    else:
        evaluate(curve.basis[curve.kind[interval]], curve.r, curve.window[interval], s - k, 0, scratch.weight, y)
        distance = np.sqrt((x[0] - y[0]) ** 2 + (x[1] - y[1]) ** 2 + (x[2] - y[2]) ** 2)
    return _keep(meeting.row, meeting.point, s, meeting.reach - distance, sign, found, count)


@compiled
def _keep(row: int, point: int, s: float, overlap: float, sign: float, found: Any, count: int) -> int:
    if overlap <= 0.0:
        return count
    if count < found.row.shape[0]:
        found.row[count], found.point[count] = row, point
        found.position[count], found.overlap[count], found.sign[count] = s, overlap, sign
    return count + 1


@compiled
def _root(curve: Any, power: Any, meeting: Any, s: float, low: float, high: float, sign: float, scratch: Any) -> float:
    """The root of sign phi', which rises from low to high (in nodes, on one interval), by Newton's method from s.

    Bisection keeps it between its bounds.
    """
    x, place, weight, r, k, close = scratch.x, scratch.place, scratch.weight, curve.r, int(low), 1e-14 * meeting.n
    if meeting.quick:
        return _quick_root(power[meeting.base + k], x, k, close, s, low, high, sign)
    basis, window = curve.basis[curve.kind[meeting.base + k]], curve.window[meeting.base + k]
    for _ in range(MAX_STEPS):
        for derivative in range(3):
            evaluate(basis, r, window, s - k, derivative, weight, place[derivative])
        slope, bend = 0.0, 0.0
        for c in range(3):
            slope -= (x[c] - place[0, c]) * place[1, c]
            bend += place[1, c] * place[1, c] - (x[c] - place[0, c]) * place[2, c]
        low, high, new = _step(s, sign * slope, sign * bend, low, high, close)
        if abs(new - s) <= close:
            return new
        s = new
    return s


@compiled
def _quick_root(power: Any, x: Any, k: int, close: float, s: float, low: float, high: float, sign: float) -> float:
    """The same by powers. Newton's method keeps to the weights, which its tangent has: from a symmetric start rounding
    decides which of its branches a weave takes, and the paper's cell would end in one that is 4 % higher in energy."""
    for _ in range(MAX_STEPS):
        slope, bend = _quick_slope(power, s - k, x)
        low, high, new = _step(s, sign * slope, sign * bend, low, high, close)
        if abs(new - s) <= close:
            return new
        s = new
    return s


@compiled
def _step(s: float, slope: float, bend: float, low: float, high: float, close: float) -> tuple[float, float, float]:
    """Bounds of the root that the slope at s leaves, and where to look next."""
    if slope > 0.0:
        high = s
    else:
        low = s
    new = s - slope / bend if bend > 0.0 else np.inf
    if new < low - close or new > high + close:
        new = 0.5 * (low + high)
    return low, high, min(high, max(low, new))


@compiled
def _quick_slope(power: Any, t: float, x: Any) -> tuple[float, float]:
    """phi' and phi'' at t of an interval by the coefficients of its powers: the same but for rounding, and quicker."""
    slope, bend = 0.0, 0.0
    for c in range(3):
        away, speed = _cubic(power, c, t) - x[c], power[1, c] + t * (2 * power[2, c] + t * 3 * power[3, c])
        slope += away * speed
        bend += speed * speed + away * (2 * power[2, c] + 6 * t * power[3, c])
    return slope, bend


@compiled
def _quick_distance(power: Any, t: float, x: Any) -> float:
    square = 0.0
    for c in range(3):
        square += (x[c] - _cubic(power, c, t)) ** 2
    return float(np.sqrt(square))


@compiled
def _cubic(power: Any, c: int, t: float) -> float:
    return float(power[0, c] + t * (power[1, c] + t * (power[2, c] + t * power[3, c])))


@compiled
def _isolate(curve: Any, power: Any, meeting: Any, k: int, itself: float, scratch: Any, found: Any, count: int) -> int:
    """All places on interval k of a fibril on which phi' may fall, in their order.

    The first of the scratch's pieces holds its Bernstein coefficients. `itself`: where the contact point itself lies,
    outside of 0 to 1 if elsewhere; that is not one of the places.
    """
    pieces = scratch.pieces
    pieces[0, 6], pieces[0, 7] = 0.0, 1.0
    top = 0
    # Before the point itself the distance falls, behind it it rises.
    if itself == 0.0:
        pieces[0, 0] = 0.0
    elif itself == 1.0:
        pieces[0, 5] = -0.0
    elif 0.0 < itself < 1.0:
        _split(pieces[0], pieces[1], itself)
        pieces[0, 0], pieces[1, 5] = 0.0, -0.0
        top = 1
    while top >= 0:
        piece = pieces[top]
        changes = 0
        for m in range(5):
            changes += _negative(piece[m]) != _negative(piece[m + 1])
        low, high, falling = piece[6], piece[7], _negative(piece[5])
        if changes > 1 and high - low > LEAST_PIECE:
            _split(piece, pieces[top + 1], 0.5)
            top += 1
            continue
        top -= 1
        if changes % 2 == 1:
            sign = -1.0 if falling else 1.0
            s = _root(curve, power, meeting, k + 0.5 * (low + high), k + low, k + high, sign, scratch)
            count = _record(curve, power, meeting, s, sign, scratch, found, count)
    return count


@compiled
def _coefficients(points: Any, x: Any, c: Any) -> None:
    """The Bernstein coefficients of phi' = (y - x).y' on an interval with the given Bézier points, into c (6,)."""
    for m in range(6):
        c[m] = 0.0
    for i in range(4):
        for j in range(3):
            dot = 0.0
            for axis in range(3):
                dot += (points[i, axis] - x[axis]) * (points[j + 1, axis] - points[j, axis])
            c[i + j] += 3.0 * dot * (1.0, 3.0, 3.0, 1.0)[i] * (1.0, 2.0, 1.0)[j]
    for m in range(6):
        c[m] /= (1.0, 5.0, 10.0, 10.0, 5.0, 1.0)[m]


@compiled
def _split(piece: Any, left: Any, t: float) -> None:
    """Cut a piece at t of its length: `left` becomes its first part, and itself the second (de Casteljau)."""
    middle = piece[6] + t * (piece[7] - piece[6])
    left[6], left[7], piece[6] = piece[6], middle, middle
    for m in range(6):
        left[m] = piece[0]
        for q in range(5 - m):
            piece[q] += t * (piece[q + 1] - piece[q])
