"""What the choice of solver and the order of the fibrils change: every state of a study once more, from the one before.

    python benchmarks/invariance.py results/paper [--solvers pardiso]

Each recorded state is reached again from the recorded state before it: with the fibrils shuffled, and with each solver
asked for. The tables give the largest difference of a clamp force, in parts of the largest, and of a probe current, in
parts of itself. A state where they are not small is a bifurcation: which branch is taken there hangs on round-off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from measure import Table, arguments, publish

from circuittex.base.arrays import Ints
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.permutation import permuted
from circuittex.mech.configuration import Configuration
from circuittex.mech.linear import LinearSolver
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pardiso import PardisoSolver
from circuittex.results.bifurcation import current_difference, force_difference
from circuittex.results.records import Study
from circuittex.results.store import load_study
from circuittex.study.branch_check import SEED, another_permutation
from circuittex.study.plan import plan
from circuittex.study.record import outcome_of, reach

SOLVERS: dict[str, Callable[[], LinearSolver]] = {solver.name: solver for solver in (MultifrontalSolver, PardisoSolver)}
HEAD = ["state", "iterations", "recorded", "clamp force", "probe current"]


def rows(study: Study, mesh: FibrilMesh, nodes: Ints, solver: Callable[[], LinearSolver]) -> list[list[object]]:
    """A row for each state that is reached again on `mesh`, whose nodes have the numbers `nodes` in the study."""
    records, found = {record.name: record for record in study.records}, []
    other = replace(study, mesh=mesh, initial=Configuration(study.initial.x[nodes]))
    for step in plan(study.design):
        record = records[step.name]
        before = records[step.previous].configuration if step.previous else study.initial
        state = reach(other, step, Configuration(before.x[nodes]), solver, lambda _: None)
        outcome = outcome_of(study.design, mesh, state.equilibrium, record)
        differences = force_difference(record.outcome, outcome), current_difference(record.outcome, outcome)
        found.append([step.name, state.iterations, record.iterations, *(f"{value:.1e}" for value in differences)])
    return found


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("results", type=Path, help="folder of a study")
    parser.add_argument("--solvers", nargs="*", choices=tuple(SOLVERS), default=[], help="solvers to compare")
    options = parser.parse_args()
    study = load_study(options.results / "results.h5")
    mesh = study.mesh

    def tables() -> list[Table]:
        own = np.arange(mesh.n_nodes)
        other, nodes = permuted(mesh, another_permutation(mesh.n_fibrils))
        title = f"{study.design.name}: fibrils shuffled (seed {SEED}), {MultifrontalSolver.name}:"
        made = [Table(title, HEAD, rows(study, other, nodes, MultifrontalSolver))]
        same = {f"{study.design.name}: {name}:": rows(study, mesh, own, SOLVERS[name]) for name in options.solvers}
        return [*made, *(Table(title, HEAD, found) for title, found in same.items())]

    publish(options, tables())


if __name__ == "__main__":
    main()
