"""How far a motion may go before fibrils pass through one another: continuous collision detection of centre lines.

Contact sees where fibrils overlap at the end of a step and nothing of the way there. Here the centre lines are taken
as `CHORDS` chords of each interval of the contact curve, whose points move on straight lines while q goes to
q + dq. Their distance d(t) is bounded below from any time on, since it changes at most as fast as the ends of the
chords move against one another: with L the largest of those relative motions, d(t + s) >= d(t) - L s. Stepping by that
bound (conservative advancement: Mirtich, PhD thesis, Berkeley 1996) never leaps over a collision.

Two chords *collide* when their distance falls below `COLLISION` of the one they had, or of R + R' where they started
further apart than touch. A motion without collision is not limited at all. The same holds for two chords of one
fibril, unless they are neighbours along it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled
from circuittex.base.frozen import frozen
from circuittex.contact.curve import BASIS, CurveTable
from circuittex.contact.law import effective_modulus, hertz_penalty, pair_penalty
from circuittex.contact.search import CONTROL_MOTION
from circuittex.design import ContactLaw
from circuittex.geometry.mesh import FibrilMesh

CHORDS = 4
"""Chords of an interval: they leave the curve by a sixteenth of what the chord of the whole interval does."""
COLLISION = 1 / 4
"""Part of the first distance, or of R + R' if that is less, at which two centre lines count as having met. It leaves
room for the line search, which goes by energies, to come back."""
_WEIGHTS = np.einsum("kap,tp->kta", BASIS, np.linspace(0.0, 1.0, CHORDS + 1)[:, None] ** np.arange(4))
NEIGHBOURS = np.pi
"""Parts of R along a fibril from one of its chords to another below which they are neighbours, free to bend against one
another: the way round a hairpin whose legs touch."""
CLOSEST = 1 / 8
"""How close the advancement comes to the collision, in parts of it: it would never end at the place itself."""
MOST_ADVANCES = 200
"""Advances before a pair counts as colliding, where it is known to be safe until then. Chords that slide past one
another just outside a collision take the longest, some 32 L over their first distance."""
SOFT = 0.5
"""A penalty below this part of that of Hertz's theory is a likely cause."""
PRESSED = 1 / 50
"""Part of R + R' below which centre lines that still approach one another are not kept apart by contact any more."""


@frozen
class SafeStep:
    """The fraction of a motion that is safe, and the pair of fibrils that limits it."""

    fraction: float
    """From 0 to 1; 1: nothing collides."""
    fibrils: tuple[int, int]
    """The pair that limits it, the lower number first, or twice the one that collides with itself; meaningless where
    `fraction` is 1."""
    distance: float
    """The distance at the start of the chords of that pair that collide, mm."""


def chords(table: CurveTable, r: Floats) -> Floats:
    """(I, CHORDS + 1, 3) the points between the chords of every interval; r (N, 3) nodes."""
    points = np.empty((len(table.fibril), CHORDS + 1, 3))
    _evaluate(_WEIGHTS, table.kind, table.window, r, points)
    return points


@compiled
def _evaluate(weights: Any, kind: Any, window: Any, r: Any, points: Any) -> None:
    """Fill points (I, T, 3) with the curve where its nodes have the weights (kind, T, 4)."""
    for i in range(points.shape[0]):
        w, first = weights[kind[i]], window[i]
        for t in range(points.shape[1]):
            for k in range(3):
                points[i, t, k] = (
                    w[t, 0] * r[first, k]
                    + w[t, 1] * r[first + 1, k]
                    + w[t, 2] * r[first + 2, k]
                    + w[t, 3] * r[first + 3, k]
                )


def safe_step(table: CurveTable, radius: Floats, r: Floats, motion: Floats) -> SafeStep:
    """How much of `motion` (N, 3) the nodes r (N, 3) can make before two fibrils, or a fibril and itself, collide.

    radius (F,), mm.

    The order of the fibrils does not matter: every pair is followed to the end.

    >>> from circuittex.contact.curve import CurveTable
    >>> t = np.linspace(-1.0, 1.0, 4)[:, None]
    >>> r = np.vstack([t * [1.0, 0.0, 0.0], t * [0.0, 1.0, 0.0] + [0.0, 0.0, 0.5]])
    >>> table = CurveTable(np.array([0, 3, 6]), np.repeat([0, 1], 3), np.repeat([0, 4], 3), np.array([0, 1, 2] * 2))
    >>> down = np.repeat([[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]], 4, axis=0)
    >>> safe_step(table, np.array([0.3, 0.3]), r, down).fraction  # from 0.5 to a quarter of it
    0.375
    >>> safe_step(table, np.array([0.3, 0.3]), r, -down).fraction
    1.0
    """
    start, way = chords(table, r), chords(table, motion)
    found = np.array([1.0, 0.0, 0.0, np.inf])
    boxes = _boxes(start, start + way, COLLISION * radius[table.fibril])
    _sweep(*boxes, table.fibril, radius, start, way, _along(table.fibril, start), found)
    pair = sorted(found[1:3].astype(int).tolist())
    return SafeStep(float(found[0]), (pair[0], pair[1]), float(found[3]))


def clearance(table: CurveTable, radius: Floats, r: Floats) -> float:
    """Smallest distance of the chords of two fibrils, or of one that are not neighbours along it, mm; at most the
    smallest R + R'.

    Nodes may move by `free_motion` of it without a collision, wherever they go.
    """
    start = chords(table, r)
    found = np.array([2 * float(radius.min())])
    _approach(
        *_boxes(start, start, radius[table.fibril]), table.fibril, radius, start, _along(table.fibril, start), found
    )
    return float(found[0])


def free_motion(distance: float) -> float:
    """How far each node can go where chords are so far apart, mm: a point of a curve goes at most `CONTROL_MOTION`
    times as far, and two of them come closer by twice that."""
    return (1.0 - COLLISION) * distance / (2 * CONTROL_MOTION)


def _boxes(start: Floats, end: Floats, reach: Floats) -> tuple[Ints, Floats, Floats]:
    """The intervals by the lower end along the longest axis of the boxes (I, 3) that their chords sweep, widened by
    `reach` (I,); and, in that order and with that axis first, the boxes' lower and upper ends."""
    low = np.minimum(start, end).min(axis=1) - reach[:, None]
    high = np.maximum(start, end).max(axis=1) + reach[:, None]
    axis = int(np.argmax(np.ptp(low, axis=0)))
    rising = np.argsort(low[:, axis], kind="stable")
    turned = np.roll(np.arange(3), -axis)
    low, high = (np.ascontiguousarray(box[rising][:, turned]) for box in (low, high))
    return rising, low, high


def likely_cause(mesh: FibrilMesh, law: ContactLaw, first: int, second: int, modulus: float = 1.0) -> str:
    """Why contact by a law does not keep two fibrils apart, to end a sentence; `modulus` N/mm2 are one of the mesh."""
    one, other = np.array([first]), np.array([second])
    e, nu = mesh.youngs_modulus, mesh.poisson_ratio
    penalty = float(pair_penalty(mesh, law, one, other)[0])
    hertz = float(hertz_penalty(effective_modulus(e[one], nu[one], e[other], nu[other]))[0])
    if penalty < SOFT * hertz:
        return (
            f"the penalty of {modulus * penalty:.3g} N/mm2 is too soft for them: "
            f"Hertz's theory gives {modulus * hertz:.3g} N/mm2, "
            'which penalty = "hertz" asks for'
        )
    return "they are pressed together further than contact can hold: load them less, or in smaller steps"


@compiled
def _along(fibril: Any, start: Any) -> Any:
    """(I, CHORDS + 1) the way along each fibril from its beginning to the points between its chords."""
    along = np.zeros(start.shape[:2])
    for i in range(start.shape[0]):
        if i > 0 and fibril[i] == fibril[i - 1]:
            along[i, 0] = along[i - 1, -1]
        for a in range(1, start.shape[1]):
            p, q = start[i, a - 1], start[i, a]
            length = np.sqrt((q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2 + (q[2] - p[2]) ** 2)
            along[i, a] = along[i, a - 1] + length
    return along


@compiled
def segment_distance(p: Any, q: Any, r: Any, s: Any) -> float:
    """Smallest distance of the segments from p to q and from r to s; all (3,).

    The closest points of the lines, clamped to one segment, then to the other (Ericson, Real-Time Collision
    Detection, 5.1.9).
    """
    uu, vv, uv, uw, vw = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        u, v, w = q[k] - p[k], s[k] - r[k], p[k] - r[k]
        uu += u * u
        vv += v * v
        uv += u * v
        uw += u * w
        vw += v * w
    determinant = uu * vv - uv * uv
    a = 0.0
    if determinant > 1e-12 * uu * vv:
        a = min(1.0, max(0.0, (uv * vw - uw * vv) / determinant))
    b = (uv * a + vw) / vv if vv > 0.0 else 0.0
    if b < 0.0 or b > 1.0:
        b = min(1.0, max(0.0, b))
        a = min(1.0, max(0.0, (uv * b - uw) / uu)) if uu > 0.0 else 0.0
    total = 0.0
    for k in range(3):
        d = p[k] + a * (q[k] - p[k]) - r[k] - b * (s[k] - r[k])
        total += d * d
    return float(np.sqrt(total))


@compiled
def _distance_at(t: float, p: Any, u: Any, q: Any, v: Any, scratch: Any) -> float:
    """Distance of chords p and q (2, 3) after the part t of their motions u and v; scratch (4, 3)."""
    for e in range(2):
        for k in range(3):
            scratch[e, k] = p[e, k] + t * u[e, k]
            scratch[2 + e, k] = q[e, k] + t * v[e, k]
    return segment_distance(scratch[0], scratch[1], scratch[2], scratch[3])


@compiled
def _relative_motion(u: Any, v: Any) -> float:
    """Largest motion of a point of one chord against a point of the other: that of two ends, since it is bilinear."""
    largest = 0.0
    for i in range(2):
        for j in range(2):
            largest = max(largest, (u[i, 0] - v[j, 0]) ** 2 + (u[i, 1] - v[j, 1]) ** 2 + (u[i, 2] - v[j, 2]) ** 2)
    return float(np.sqrt(largest))


@compiled
def _safe_fraction(p: Any, u: Any, q: Any, v: Any, touch: float, scratch: Any, first: Any) -> float:
    """The safe part of the motion of two chords (`safe_step`); first (1,) receives their distance at its start."""
    d = _distance_at(0.0, p, u, q, v, scratch)
    first[0] = d
    scale, fastest = min(d, touch), _relative_motion(u, v)
    if fastest == 0.0 or d - fastest > COLLISION * scale:
        return 1.0
    t = 0.0
    for _ in range(MOST_ADVANCES):
        t += (d - COLLISION * scale) / fastest
        if t >= 1.0:
            return 1.0
        d = _distance_at(t, p, u, q, v, scratch)
        if d <= (1.0 + CLOSEST) * COLLISION * scale:
            break
    return t


@compiled
def _sweep(
    rising: Any, low: Any, high: Any, fibril: Any, radius: Any, start: Any, way: Any, along: Any, found: Any
) -> None:
    """The least safe part of all pairs of chords but neighbours, with the pair and its distance, in found (4,).

    rising (I,): the intervals by the lower end along the first axis of the boxes that they sweep; these boxes low, high
    (I, 3) stand in that order; along (I, CHORDS + 1) as `_along`.
    """
    scratch, first = np.empty((4, 3)), np.empty(1)
    for n in range(rising.shape[0]):
        i = rising[n]
        f, ends, x, y, z, w = fibril[i], high[n, 0], low[n, 1], high[n, 1], low[n, 2], high[n, 2]
        for m in range(n, rising.shape[0]):  # the interval itself among them: chords of one may meet, too
            if low[m, 0] > ends:
                break
            if low[m, 1] > y or high[m, 1] < x or low[m, 2] > w or high[m, 2] < z:
                continue
            j = rising[m]
            own, near = fibril[j] == f, NEIGHBOURS * radius[f]
            if own and max(along[j, -1] - along[i, 0], along[i, -1] - along[j, 0]) < near:
                continue
            touch = radius[f] + radius[fibril[j]]
            for a in range(start.shape[1] - 1):
                for b in range(start.shape[1] - 1):
                    p, u = start[i, a : a + 2], way[i, a : a + 2]
                    q, v = start[j, b : b + 2], way[j, b : b + 2]
                    if own and max(along[j, b] - along[i, a + 1], along[i, a] - along[j, b + 1]) < near:
                        continue
                    if not _may_meet(p, u, q, v, COLLISION * touch):
                        continue
                    fraction = _safe_fraction(p, u, q, v, touch, scratch, first)
                    if fraction < found[0]:
                        found[0], found[1], found[2], found[3] = fraction, f, fibril[j], first[0]


@compiled
def _approach(rising: Any, low: Any, high: Any, fibril: Any, radius: Any, start: Any, along: Any, found: Any) -> None:
    """Bring found (1,) down to the smallest distance of all pairs of chords but neighbours; as `_sweep`.

    Those of one fibril count from half the way along it on, since they may not be neighbours any more when it is used.
    """
    still = np.zeros((2, 3))
    for n in range(rising.shape[0]):
        i = rising[n]
        f, ends, x, y, z, w = fibril[i], high[n, 0], low[n, 1], high[n, 1], low[n, 2], high[n, 2]
        for m in range(n, rising.shape[0]):
            if low[m, 0] > ends:
                break
            if low[m, 1] > y or high[m, 1] < x or low[m, 2] > w or high[m, 2] < z:
                continue
            j = rising[m]
            own, near = fibril[j] == f, 0.5 * NEIGHBOURS * radius[f]
            for a in range(start.shape[1] - 1):
                for b in range(start.shape[1] - 1):
                    p, q = start[i, a : a + 2], start[j, b : b + 2]
                    if own and max(along[j, b] - along[i, a + 1], along[i, a] - along[j, b + 1]) < near:
                        continue
                    if _may_meet(p, still, q, still, found[0]):
                        found[0] = min(found[0], segment_distance(p[0], p[1], q[0], q[1]))


@compiled
def _may_meet(p: Any, u: Any, q: Any, v: Any, reach: float) -> bool:
    """Whether the boxes that two chords sweep come within `reach`."""
    for k in range(3):
        low = min(min(p[0, k], p[1, k]), min(p[0, k] + u[0, k], p[1, k] + u[1, k]))
        high = max(max(p[0, k], p[1, k]), max(p[0, k] + u[0, k], p[1, k] + u[1, k]))
        other = min(min(q[0, k], q[1, k]), min(q[0, k] + v[0, k], q[1, k] + v[1, k]))
        if other > high + reach:
            return False
        other = max(max(q[0, k], q[1, k]), max(q[0, k] + v[0, k], q[1, k] + v[1, k]))
        if other < low - reach:
            return False
    return True
