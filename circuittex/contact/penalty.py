"""Penalty contact between fibrils as a force term [21, 24-28, 35]."""

from __future__ import annotations

from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import cores, share_out, side_by_side
from circuittex.base.errors import PenetrationError
from circuittex.base.frozen import frozen
from circuittex.contact.closest import Fibrils, Found, find_contacts
from circuittex.contact.conductance import check_laws
from circuittex.contact.curve import CurveTable, curve_table, curve_through
from circuittex.contact.hull import QUARTER, hulls
from circuittex.contact.kernels import Rows, Sums, Touches, add_contacts, add_forces
from circuittex.contact.law import pair_penalty
from circuittex.contact.passing import PRESSED, clearance, free_motion, likely_cause, safe_step
from circuittex.contact.search import CONTROL_MOTION, Candidates, bent_back, coupled_nodes, find_candidates
from circuittex.design import ContactLaw
from circuittex.geometry.mesh import FibrilMesh, pair_label
from circuittex.mech.pattern import Pattern

WORTH_A_THREAD = 2000
"""Contacts that are worth a thread of their own."""
SKIN = 8 / 15
"""How far candidates reach beyond touch, in parts of the smallest radius: they last for as long as nothing moves by
about a quarter of it."""
WANDER = 4
"""How much further candidates reach where only forces are asked for: no pattern needs room for them, most are
refused at a glance, and they last for as long as nothing moves by R or so."""
LIKELY = 2 / 3 * QUARTER
"""Where a fibril turns by as much on its way from one stretch of it to another, the pattern has room for their contact:
it can come only once that has become a quarter."""
SHORT = 0.1
"""Parts of the smallest radius up to which a motion is short: it pays to know how far all nodes can go, since several
motions as short as that are free then."""
CHUNKS = 16
"""Candidates are searched in this many pieces, whatever the number of threads."""


@frozen
class Touching:
    """The C active contact points of one configuration, in a fixed order."""

    interval_a: Ints
    """(C,) interval that carries the contact point."""
    t_a: Floats
    """(C,) its local coordinate in [0, 1]."""
    fibril_b: Ints
    """(C,) the other fibril, or the same."""
    position_b: Floats
    """(C,) place on it, in nodes, where the distance has a minimum or a maximum."""
    overlap: Floats
    """(C,) R + R' - |d| > 0, mm [26]."""
    sign: Floats
    """(C,) 1 at a minimum of the distance, -1 at a maximum."""


def contact_points(mesh: FibrilMesh, per_element: int) -> Floats:
    """(order, T) local coordinates of equally spaced contact points in each interval of an element [4.4].

    Rows are padded with -1 where an interval has fewer points than another.
    """
    at = (np.arange(per_element) + 0.5) / per_element * mesh.order
    interval = np.minimum(at.astype(int), mesh.order - 1)
    rows = [at[interval == k] - k for k in range(mesh.order)]
    table = np.full((mesh.order, max(map(len, rows))), -1.0)
    for k, row in enumerate(rows):
        table[k, : len(row)] = row
    return table


def _farthest(motion: Floats) -> float:
    """The longest of motions (N, 3), mm."""
    return float(np.sqrt(np.einsum("nk,nk->n", motion, motion).max()))


def _lasts(known: tuple[Candidates, Floats] | None, r: Floats, skin: float) -> TypeGuard[tuple[Candidates, Floats]]:
    """Whether since a search no Bézier point moved by half its skin."""
    if known is None:
        return False
    moved = float(np.sqrt(((r - known[1]) ** 2).sum(axis=1).max()))
    return CONTROL_MOTION * moved <= skin / 2


class PenaltyContact:
    """Energy sum over contact points of 1/2 P* w o^2; both fibrils of a pair carry points, with half weight.

    A point counts with each minimum of the distance to a fibril, its own included, less the maxima between them: so
    that the energy stays smooth where minima appear, merge and vanish.

    `law` gives P* of each pair (`pair_penalty`), `per_element` is the number of contact points of an element, `skin`
    (mm) how far candidates reach beyond touch so that they last several iterations, by default `SKIN`; `part` of the
    penalty is what counts.
    """

    def __init__(
        self, mesh: FibrilMesh, *, law: ContactLaw, per_element: int, skin: float | None = None, part: float = 1.0
    ) -> None:
        check_laws(law)  # here, since no long work begins without
        self.mesh, self.law, self.part = mesh, law, part
        self.skin = SKIN * float(mesh.radius.min()) if skin is None else skin
        self.table: CurveTable = curve_table(mesh)
        self.points = contact_points(mesh, per_element)
        size = mesh.length / np.diff(mesh.first_element) / per_element
        self.weight = size / 2  # half: the pair is integrated from both sides
        self.fibrils = Fibrils(mesh.radius, mesh.first_node, self.table.first_interval, self.table.fibril)
        self.modulus = 1.0
        """N/mm2 in one unit of modulus: what messages multiply by where the fibrils are in units of their own."""
        self._held: tuple[Candidates, Floats] | None = None
        """What the pattern has room for, and the nodes (N, 3) for which it was searched."""
        self._tried: tuple[Candidates, Floats] | None = None
        """The same for a trial outside the reach of what is held."""
        self._wide: tuple[Candidates, Floats] | None = None
        """The same for gradients alone, with `WANDER` times the skin."""
        self._own: NDArray[np.bool_] = np.empty(0, dtype=np.bool_)
        """(rows,) the stretches of its own fibril that the pattern has room for, of those held."""
        self._last: tuple[Floats, Touching] | None = None
        self._clear: tuple[Floats, float] | None = None
        """Nodes (N, 3), and how far each may go from there in any direction without a collision, mm."""

    def positions(self, q: Floats) -> Floats:
        """(N, 3) centre-line nodes."""
        return np.ascontiguousarray(q.reshape(-1, 9)[:, :3])

    def prepare(self, q: Floats) -> bool:
        """Renew the candidates once a Bézier point may have moved by half the skin, or a fibril bends back anew."""
        r = self.positions(q)
        held = self._near(r)
        turn = hulls(curve_through(self.table, r)).turn
        renewed = held is not self._held or bool(np.any(bent_back(self.table, held[0], turn, QUARTER) & ~self._own))
        if renewed:
            self._held, self._own = held, bent_back(self.table, held[0], turn, LIKELY)
        return renewed

    def forget(self) -> None:
        """The next candidates are searched around where they are asked for."""
        self._held = self._tried = self._wide = self._last = self._clear = None
        self._own = np.empty(0, dtype=np.bool_)

    def _near(self, r: Floats) -> tuple[Candidates, Floats]:
        """Candidates that hold every pair in touch at r: since their search no Bézier point moved by half the skin."""
        for known in (self._held, self._tried):
            if _lasts(known, r, self.skin):
                return known
        self._tried = find_candidates(self.table, r, self.mesh.radius, self.skin), r
        return self._tried

    def _around(self, r: Floats) -> tuple[Candidates, Floats]:
        """The same, from a search further around."""
        if not _lasts(self._wide, r, WANDER * self.skin):
            self._wide = find_candidates(self.table, r, self.mesh.radius, WANDER * self.skin), r
        return self._wide

    def pairs(self) -> tuple[Ints, Ints]:
        """Node pairs that the present candidates can couple, positions only."""
        assert self._held is not None, "prepare comes first"
        return np.empty((0, 2), dtype=np.int64), coupled_nodes(self.table, self._held[0], self._own)

    def touching(self, q: Floats) -> Touching:
        """All contact points that overlap at q; candidates are searched for it if q lies outside their reach."""
        if self._last is not None and np.array_equal(self._last[0], q):
            return self._last[1]
        r = self.positions(q)
        found = self._search(self._near(r)[0], r, quick=False)
        self._last = q.copy(), found
        return found

    def energy(self, q: Floats) -> float:
        """Contact energy, N mm."""
        found = self.touching(q)
        return float(0.5 * np.sum(self._stiffness(found) * found.overlap**2))

    def _search(self, candidates: Candidates, r: Floats, *, quick: bool) -> Touching:
        """The places of all candidates, in pieces on all cores; the result does not depend on their number."""
        table, points = self.table, self.points
        curve = curve_through(table, r)
        hull = hulls(curve)
        edges = np.linspace(0, len(candidates.interval), CHUNKS + 1).astype(int)

        def piece(k: int) -> Found:
            first, last = edges[k], edges[k + 1]
            rows = Candidates(*(column[first:last] for column in candidates))
            found = find_contacts(
                curve, hull, self.fibrils, points, rows, points.shape[1] * (last - first), quick=quick
            )
            return found._replace(row=found.row + first)

        pieces = share_out(piece, CHUNKS, cores())
        found = Found(*map(np.concatenate, zip(*pieces, strict=True)))
        interval = candidates.interval[found.row]
        first = table.first_interval[table.fibril[interval]]
        return Touching(
            interval_a=interval,
            t_a=points[(interval - first) % len(points), found.point],
            fibril_b=candidates.fibril[found.row],
            position_b=found.position,
            overlap=found.overlap,
            sign=found.sign,
        )

    def _stiffness(self, found: Touching) -> Floats:
        """(C,) P* w of each contact point, N/mm; negative at a maximum of the distance."""
        a = self.table.fibril[found.interval_a]
        penalty = self.part * pair_penalty(self.mesh, self.law, a, found.fibril_b)
        return np.asarray(found.sign * penalty * self.weight[a])

    def longest(self, q: Floats, direction: Floats) -> float:
        """The part of `direction` that the centre lines can go without colliding (`safe_step`).

        Raises `PenetrationError` where a pair that limits it is pressed together as if there were no contact.
        """
        mesh, r, motion = self.mesh, self.positions(q), self.positions(direction)
        if self._clears(r, motion):
            return 1.0
        step = safe_step(self.table, mesh.radius, r, motion)
        if step.fraction < 1.0 and step.distance < PRESSED * mesh.radius[list(step.fibrils)].sum():
            what = f"{pair_label(mesh, *step.fibrils)} are pressed through one another"
            raise PenetrationError(f"{what}; {likely_cause(mesh, self.law, *step.fibrils, self.modulus)}")
        return step.fraction

    def _clears(self, r: Floats, motion: Floats) -> bool:
        """Whether the motion (N, 3) of nodes r (N, 3) is so short that nothing collides, whatever moves where."""
        longest, radius = _farthest(motion), self.mesh.radius
        if longest > SHORT * float(radius.min()):
            return False
        if self._clear is None or _farthest(r - self._clear[0]) + longest > self._clear[1]:
            self._clear = r, free_motion(clearance(self.table, radius, r))
        return _farthest(r - self._clear[0]) + longest <= self._clear[1]

    def _touches(self, found: Touching) -> Touches:
        """The contact points as compiled functions take them."""
        table = self.table
        last = table.first_interval[found.fibril_b + 1] - table.first_interval[found.fibril_b]
        k = np.minimum(found.position_b.astype(np.int64), last - 1)
        return Touches(
            interval_a=found.interval_a,
            t_a=found.t_a,
            interval_b=table.first_interval[found.fibril_b] + k,
            t_b=found.position_b - k,
            at_end=(found.position_b <= 0) | (found.position_b >= last),
            overlap=found.overlap,
            stiffness=self._stiffness(found),
        )

    def add_gradient(self, q: Floats, gradient: Floats) -> float:
        """Add the gradient in place; return the energy."""
        r = self.positions(q)
        found = self._search(self._around(r)[0], r, quick=True)
        touches = self._touches(found)
        add_forces(curve_through(self.table, r), touches, gradient)
        return float(0.5 * np.sum(touches.stiffness * found.overlap**2))

    def assemble(self, q: Floats, pattern: Pattern, gradient: Floats, data: Floats, softening: Floats) -> float:
        """Add gradient and tangent in place, the turning of the contact force to `softening`; return the energy."""
        found = self.touching(q)
        touches = self._touches(found)
        shares = self._shares(self.table.window[touches.interval_a], self.table.window[touches.interval_b])
        rows = Rows(pattern.indptr, pattern.neighbour_start, pattern.neighbour, pattern.point_offset)
        sums = Sums(gradient, data, softening)
        side_by_side(add_contacts, shares, curve_through(self.table, self.positions(q)), touches, rows, sums)
        return float(0.5 * np.sum(touches.stiffness * found.overlap**2))

    def _shares(self, window_a: Ints, window_b: Ints) -> list[int]:
        """Nodes that part the rows of the matrix into as many pieces as there are cores for, of much the same work."""
        n = self.mesh.n_nodes
        pieces = min(cores(), 1 + len(window_a) // WORTH_A_THREAD)
        # The rows of the lower window hold the blocks of both, those of the higher only its own.
        low, high = np.minimum(window_a, window_b), np.maximum(window_a, window_b)
        cost = np.cumsum(3 * np.bincount(low, minlength=n) + np.bincount(high, minlength=n))
        inner = np.searchsorted(cost, cost[-1] * np.arange(1, pieces) / pieces) + 1
        return [0, *np.minimum(inner, n).tolist(), n]
