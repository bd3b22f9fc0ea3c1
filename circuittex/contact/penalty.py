"""Penalty contact between fibrils as a force term [21, 24-28, 35]."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import cores, side_by_side
from circuittex.base.errors import PenetrationError
from circuittex.base.frozen import frozen
from circuittex.contact.closest import find_contacts
from circuittex.contact.curve import BASIS, CurveTable, bezier, curve_table
from circuittex.contact.kernels import add_contacts
from circuittex.contact.law import pair_penalty
from circuittex.contact.passing import PRESSED, likely_cause, safe_step
from circuittex.contact.search import CONTROL_MOTION, Candidates, coupled_nodes, find_candidates
from circuittex.design import ContactLaw
from circuittex.geometry.mesh import FibrilMesh, pair_label
from circuittex.mech.pattern import Pattern

WORTH_A_THREAD = 2000
"""Contacts that are worth a thread of their own."""
SKIN = 8 / 15
"""How far candidates reach beyond touch, in parts of the smallest radius: they last for as long as nothing moves by
about a quarter of it."""
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
    """(C,) the other fibril."""
    position_b: Floats
    """(C,) closest position on it, in nodes."""
    overlap: Floats
    """(C,) R + R' - |d| > 0, mm [26]."""


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


class PenaltyContact:
    """Energy sum over contact points of 1/2 P* w o^2; both fibrils of a pair carry points, with half weight.

    `law` gives P* of each pair (`pair_penalty`), `per_element` is the number of contact points of an element, `skin`
    (mm) how far candidates reach beyond touch so that they last several iterations, by default `SKIN`.
    """

    def __init__(self, mesh: FibrilMesh, *, law: ContactLaw, per_element: int, skin: float | None = None) -> None:
        self.mesh, self.law = mesh, law
        self.skin = SKIN * float(mesh.radius.min()) if skin is None else skin
        self.table: CurveTable = curve_table(mesh)
        self.points = contact_points(mesh, per_element)
        size = mesh.length / np.diff(mesh.first_element) / per_element
        self.weight = size / 2  # half: the pair is integrated from both sides
        self._held: tuple[Candidates, Floats] | None = None
        """What the pattern has room for, and the nodes (N, 3) for which it was searched."""
        self._tried: tuple[Candidates, Floats] | None = None
        """The same for a trial outside the reach of what is held."""
        self._last: tuple[Floats, Touching] | None = None

    def positions(self, q: Floats) -> Floats:
        """(N, 3) centre-line nodes."""
        return np.ascontiguousarray(q.reshape(-1, 9)[:, :3])

    def prepare(self, q: Floats) -> bool:
        """Renew the candidates once a Bézier point may have moved by half the skin."""
        held = self._near(self.positions(q))
        renewed, self._held = held is not self._held, held
        return renewed

    def _near(self, r: Floats) -> tuple[Candidates, Floats]:
        """Candidates that hold every pair in touch at r: since their search no Bézier point moved by half the skin."""
        for known in (self._held, self._tried):
            if known is not None:
                moved = float(np.sqrt(((r - known[1]) ** 2).sum(axis=1).max()))
                if CONTROL_MOTION * moved <= self.skin / 2:
                    return known
        self._tried = find_candidates(self.table, r, self.mesh.radius, self.skin), r
        return self._tried

    def pairs(self) -> tuple[Ints, Ints]:
        """Node pairs that the present candidates can couple, positions only."""
        assert self._held is not None, "prepare comes first"
        return np.empty((0, 2), dtype=np.int64), coupled_nodes(self.table, self._held[0])

    def touching(self, q: Floats) -> Touching:
        """All contact points that overlap at q; candidates are searched for it if q lies outside their reach."""
        if self._last is not None and np.array_equal(self._last[0], q):
            return self._last[1]
        r = self.positions(q)
        found = _search(self.mesh, self.table, self.points, self._near(r)[0], r)
        self._last = q.copy(), found
        return found

    def energy(self, q: Floats) -> float:
        """Contact energy, N mm."""
        found = self.touching(q)
        return float(0.5 * np.sum(self._stiffness(found) * found.overlap**2))

    def _stiffness(self, found: Touching) -> Floats:
        """(C,) P* w of each contact point, N/mm."""
        a = self.table.fibril[found.interval_a]
        return np.asarray(pair_penalty(self.mesh, self.law, a, found.fibril_b) * self.weight[a])

    def longest(self, q: Floats, direction: Floats) -> float:
        """The part of `direction` that the centre lines can go without colliding (`safe_step`).

        Raises `PenetrationError` where a pair that limits it is pressed together as if there were no contact.
        """
        mesh = self.mesh
        step = safe_step(self.table, mesh.radius, self.positions(q), self.positions(direction))
        if step.part < 1.0 and step.distance < PRESSED * mesh.radius[list(step.fibrils)].sum():
            what = f"{pair_label(mesh, *step.fibrils)} are pressed through one another"
            raise PenetrationError(f"{what}; {likely_cause(mesh, self.law, *step.fibrils)}")
        return step.part

    def assemble(self, q: Floats, pattern: Pattern, gradient: Floats, data: Floats, softening: Floats) -> float:
        """Add gradient and tangent in place, the turning of the contact force to `softening`; return the energy."""
        found, table = self.touching(q), self.table
        last = table.first_interval[found.fibril_b + 1] - table.first_interval[found.fibril_b]
        k = np.minimum(found.position_b.astype(np.int64), last - 1)
        b = table.first_interval[found.fibril_b] + k
        stiffness = self._stiffness(found)
        window_a, window_b = table.window[found.interval_a], table.window[b]
        side_by_side(
            add_contacts,
            self._shares(window_a, window_b),
            self.positions(q),
            BASIS,
            window_a,
            table.kind[found.interval_a],
            found.t_a,
            window_b,
            table.kind[b],
            found.position_b - k,
            (found.position_b <= 0) | (found.position_b >= last),
            found.overlap,
            stiffness,
            pattern.indptr,
            pattern.neighbour_start,
            pattern.neighbour,
            pattern.point_offset,
            gradient,
            data,
            softening,
        )
        return float(0.5 * np.sum(stiffness * found.overlap**2))

    def _shares(self, window_a: Ints, window_b: Ints) -> list[int]:
        """Nodes that part the rows of the matrix into as many pieces as there are cores for, of much the same work."""
        n = self.mesh.n_nodes
        pieces = min(cores(), 1 + len(window_a) // WORTH_A_THREAD)
        # The rows of the lower window hold the blocks of both, those of the higher only its own.
        low, high = np.minimum(window_a, window_b), np.maximum(window_a, window_b)
        work = np.cumsum(3 * np.bincount(low, minlength=n) + np.bincount(high, minlength=n))
        inner = np.searchsorted(work, work[-1] * np.arange(1, pieces) / pieces) + 1
        return [0, *np.minimum(inner, n).tolist(), n]


def _search(mesh: FibrilMesh, table: CurveTable, points: Floats, candidates: Candidates, r: Floats) -> Touching:
    """Closest points of all candidates, in pieces on all cores; the result does not depend on their number."""
    hull = bezier(table, r)
    thirds = hull[:, :1] + np.array([[1.0], [2.0]]) / 3 * (hull[:, 3:] - hull[:, :1])
    bulge = 0.75 * np.sqrt(((hull[:, 1:3] - thirds) ** 2).sum(axis=2)).max(axis=1)
    shape = (len(candidates.interval), points.shape[1])
    position, overlap = np.zeros(shape), np.empty(shape)

    def piece(part: slice) -> None:
        find_contacts(
            r,
            mesh.radius,
            BASIS,
            table.window,
            table.kind,
            table.first_interval,
            mesh.first_node,
            table.fibril,
            bulge,
            points,
            candidates.interval[part],
            candidates.fibril[part],
            candidates.first[part],
            candidates.last[part],
            position[part],
            overlap[part],
        )

    edges = np.linspace(0, shape[0], CHUNKS + 1).astype(int)
    with ThreadPoolExecutor(cores()) as pool:
        list(pool.map(piece, map(slice, edges[:-1], edges[1:])))
    row, p = np.nonzero(overlap > 0)
    interval = candidates.interval[row]
    first = table.first_interval[table.fibril[interval]]
    return Touching(
        interval_a=interval,
        t_a=points[(interval - first) % len(points), p],
        fibril_b=candidates.fibril[row],
        position_b=position[row, p],
        overlap=overlap[row, p],
    )
