"""Does round-off choose the branch of a state? The state once more, from the same start, its fibrils in another order.

Only the order of unknowns, contacts and sums differs: the round-off, and with it the start from which a way out of a
saddle point is looked for. That suffices to show a state whose branch hangs on such things; it is no search for other
equilibria.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import nan

import numpy as np

from circuittex.base.arrays import Ints
from circuittex.base.errors import ConvergenceError
from circuittex.base.workers import Job
from circuittex.design import Design
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.permutation import permuted
from circuittex.mech.configuration import Configuration
from circuittex.mech.linear import LinearSolver
from circuittex.relaxation.relax import Equilibrium, relax
from circuittex.results.bifurcation import ALLOWED, SETTLED, BranchCheck, difference
from circuittex.results.outcome import Outcome
from circuittex.results.records import Record, Study
from circuittex.study.plan import Step, plan
from circuittex.study.record import outcome_of, reach

SEED = 1
"""Of the permutation; any will do, and a fixed one makes the check repeatable."""

Solver = Callable[[], LinearSolver]
Say = Callable[[str], None]


def another_permutation(n: int) -> Ints:
    """(n,) the numbers below n in an order that is always the same one and, from two on, not their own.

    >>> another_permutation(5).tolist(), another_permutation(2).tolist()
    ([4, 0, 1, 2, 3], [1, 0])
    """
    permutation = np.random.default_rng(SEED).permutation(n)
    return permutation if np.any(permutation != np.arange(n)) else permutation[::-1]


def without_check(study: Study) -> tuple[Record, ...]:
    """The recorded states whose branch has not been checked."""
    known = {check.state for check in study.branches}
    return tuple(record for record in study.records if record.name not in known)


def branch_checks(study: Study, solver: Solver) -> list[Job]:
    """The tasks that check the branch of each state that `without_check` names."""
    steps = {step.name: step for step in plan(study.design)}
    found = {record.name: record.configuration for record in study.records} | {"": study.initial}
    head = replace(study, records=(), errors=(), branches=())
    jobs: list[Job] = []
    for record in without_check(study):
        step = steps[record.name]
        jobs.append((record.name, check_branch, (head, step, found[step.previous], record, solver)))
    return jobs


def check_branch(
    study: Study, step: Step, start: Configuration, record: Record, solver: Solver, say: Say
) -> BranchCheck:
    """The state `step` reached once more from `start`, where its `record` was reached from, in another order.

    Of `study` only design, mesh and initial configuration are read. Where the two differ by more than `ALLOWED` and
    one of them has a residual that could explain it, both are relaxed on until it cannot (`SETTLED`). A repeat without
    equilibrium is a result and no error. `solver` makes the linear solver of each relaxation; `say` is told of the
    progress.
    """
    mesh, design = study.mesh, study.design
    other, nodes = permuted(mesh, another_permutation(mesh.n_fibrils))
    shuffled = replace(study, mesh=other, initial=Configuration(study.initial.x[nodes]))
    try:
        found = reach(
            shuffled, step, Configuration(start.x[nodes]), solver, lambda text: say(f"branch check, {text}")
        ).equilibrium
        again = outcome_of(design, mesh, _in_order(found, nodes), record)
    except ConvergenceError as error:
        nothing = Outcome(np.full((2, 3), nan), (nan,) * len(design.probes), nan, nan, nan)
        return BranchCheck(record.name, record.outcome, nothing, nan, (), str(error))
    moved = float(np.linalg.norm(found.configuration.r - record.configuration.r[nodes], axis=1).max())
    settled: tuple[Outcome, ...] = ()
    trouble = ""
    least = SETTLED * ALLOWED * float(np.abs(record.clamp_force).max())
    if difference(record.outcome, again) > ALLOWED and max(record.residual, found.residual) > least:
        say(f"branch check, {record.name}: relaxing both states further")
        try:
            one = _settled(design, mesh, record.configuration, step, least, solver())
            two = _settled(design, other, found.configuration, step, least, solver())
            settled = tuple(outcome_of(design, mesh, each, record) for each in (one, _in_order(two, nodes)))
        except ConvergenceError as error:
            trouble = str(error)
    return BranchCheck(record.name, record.outcome, again, moved, settled, trouble)


def _in_order(found: Equilibrium, nodes: Ints) -> Equilibrium:
    """An equilibrium of the fibrils in another order, in which `nodes` (N,) were numbered so, in their own order; its
    sections are left out.

    A design states its materials in that order, and contacts do not know of another.
    """
    x, reaction = np.empty_like(found.configuration.x), np.empty_like(found.reaction)
    x[nodes], reaction[nodes] = found.configuration.x, found.reaction
    return replace(found, configuration=Configuration(x), reaction=reaction, section_force=np.empty((0, 3)))


def _settled(
    design: Design, mesh: FibrilMesh, state: Configuration, step: Step, tolerance: float, solver: LinearSolver
) -> Equilibrium:
    """The state relaxed on to a smaller tolerance (N).

    Raises `ConvergenceError` where round-off does not allow that.
    """
    if tolerance == 0.0:
        raise ConvergenceError("the clamps carry no force that the residual could be measured by")
    sharp = replace(design, numerics=replace(design.numerics, tolerance=f"{tolerance!r} N"))
    return relax(
        mesh, sharp, state, gradient=step.after, free_edges=step.free_edges, gripped=step.gripped, solver=solver
    )
