"""Stopwatches around the force terms and the solver of a relaxation, which itself knows nothing of them."""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass, field, replace

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import ConvergenceError
from circuittex.contact.penalty import PenaltyContact
from circuittex.design import plain_weave
from circuittex.mech.beam import Beam
from circuittex.mech.linear import LinearSolver, Solve
from circuittex.mech.minimise import minimise
from circuittex.mech.pattern import Pattern
from circuittex.mech.scales import fibril_scales
from circuittex.mech.space import BeamSpace
from circuittex.mech.terms import ForceTerm

SEARCH, CLOSEST, ENERGY = "candidate search", "closest points, contact energy", "beam energy"
BEAM, CONTACT, PATTERN, METRIC = "beam assembly", "contact assembly", "pattern", "metric"
ANALYSIS, FACTOR, REFUSED = "analysis and first factorisation", "factorisation", "factorisation, not positive"
SOLVE, REST = "solution", "the rest (vectors)"
PARTS = (SEARCH, CLOSEST, ENERGY, BEAM, CONTACT, PATTERN, METRIC, ANALYSIS, FACTOR, REFUSED, SOLVE, REST)

PITCH = plain_weave().weave.pitch
"""That of every weave that is measured, mm."""


@dataclass
class Stopwatch:
    """Seconds of every call in every iteration; the report of an iteration closes it."""

    iterations: list[dict[str, list[float]]] = field(default_factory=list)
    residual: float = np.inf
    asked: float = np.inf
    """When the first term was asked for its couplings, for a pattern that is being built."""
    _now: dict[str, list[float]] = field(default_factory=dict)
    _clock: float = 0.0

    def add(self, part: str, clock: float) -> None:
        """One call of a part ends that began at `clock`."""
        self._now.setdefault(part, []).append(time.perf_counter() - clock)

    def report(self, iteration: int, residual: float) -> None:
        """The tangent of this iteration is assembled: what follows belongs to the next."""
        if iteration > 0:
            rest = time.perf_counter() - self._clock - sum(map(sum, self._now.values()))
            self.iterations.append({**self._now, REST: [rest]})
        self.residual, self._now, self._clock = residual, {}, time.perf_counter()

    def calls(self, part: str) -> list[float]:
        """Seconds of all calls of a part."""
        return [seconds for iteration in self.iterations for seconds in iteration.get(part, [])]

    def per_iteration(self, *parts: str) -> Floats:
        """Seconds that the parts take together in each iteration."""
        return np.array([sum(sum(i.get(part, [])) for part in parts) for i in self.iterations])


@dataclass
class WatchedTerm:
    """A force term whose calls are timed; keeps the unknowns it was last prepared for."""

    term: ForceTerm
    watch: Stopwatch
    parts: tuple[str, str, str]
    """What its search, energy and assembly are called."""
    q: Floats = field(default_factory=lambda: np.empty(0))

    def prepare(self, q: Floats) -> bool:
        self.q, clock = q, time.perf_counter()
        changed = self.term.prepare(q)
        if changed:
            self.watch.add(self.parts[0], clock)
        return changed

    def forget(self) -> None:
        self.term.forget()

    def pairs(self) -> tuple[Ints, Ints]:
        self.watch.asked = min(self.watch.asked, time.perf_counter())
        return self.term.pairs()

    def energy(self, q: Floats) -> float:
        clock = time.perf_counter()
        energy = self.term.energy(q)
        self.watch.add(self.parts[1], clock)
        return energy

    def add_gradient(self, q: Floats, gradient: Floats) -> float:
        clock = time.perf_counter()
        energy = self.term.add_gradient(q, gradient)
        self.watch.add(self.parts[1], clock)
        return energy

    def longest(self, q: Floats, direction: Floats) -> float:
        clock = time.perf_counter()
        part = self.term.longest(q, direction)
        self.watch.add(self.parts[1], clock)
        return part

    def assemble(self, q: Floats, pattern: Pattern, gradient: Floats, data: Floats, softening: Floats) -> float:
        clock = time.perf_counter()
        energy = self.term.assemble(q, pattern, gradient, data, softening)
        self.watch.add(self.parts[2], clock)
        return energy


@dataclass
class WatchedSolver:
    """A solver whose calls are timed, apart for a new pattern and for matrices that it refuses.

    It keeps the last matrix that it did not refuse.
    """

    solver: LinearSolver
    watch: Stopwatch
    name: str = "watched"
    matrix: tuple[Pattern, Floats] | None = None
    _pattern: Pattern | None = None

    def factor(self, pattern: Pattern, data: Floats, *, rough: bool = False) -> Solve | None:
        clock = time.perf_counter()
        solve = self.solver.factor(pattern, data, rough=rough)
        part = ANALYSIS if pattern is not self._pattern else (REFUSED if solve is None else FACTOR)
        self.watch.add(part, clock)
        self._pattern = pattern
        if solve is None:
            return None
        self.matrix = pattern, data
        return self._timed(solve)

    def forget(self) -> None:
        self.solver.forget()

    def _timed(self, solve: Solve) -> Solve:
        def timed(b: Floats) -> Floats:
            clock = time.perf_counter()
            x = solve(b)
            self.watch.add(SOLVE, clock)
            return x

        return timed


def descend(
    terms: tuple[BeamSpace, Beam, PenaltyContact],
    q: Floats,
    solver: LinearSolver,
    iterations: int,
    tolerance: float = 0.0,
) -> tuple[Floats, Stopwatch, tuple[Pattern, Floats]]:
    """The unknowns after that many iterations from q or at that tolerance (N), what they took, and the last matrix."""
    space, beam, contact = terms
    watch = Stopwatch()
    watched, watched_solver = WatchedTerm(contact, watch, (SEARCH, CLOSEST, CONTACT)), WatchedSolver(solver, watch)

    scales = fibril_scales(space, PITCH)

    def metric(pattern: Pattern) -> Floats:
        watch.add(PATTERN, watch.asked)
        watch.asked, clock = np.inf, time.perf_counter()
        values = scales.metric(pattern)
        watch.add(METRIC, clock)
        return values

    with contextlib.suppress(ConvergenceError):  # it is not meant to converge in so few
        minimise(
            [WatchedTerm(beam, watch, (SEARCH, ENERGY, BEAM)), watched],
            q,
            scales=replace(scales, metric=metric),
            fixed=space.fixed,
            solver=watched_solver,
            tolerance=0.0,
            force_tolerance=tolerance,
            max_iterations=iterations,
            report=watch.report,
        )
    assert watched_solver.matrix is not None, "at least one iteration is needed"
    return watched.q, watch, watched_solver.matrix
