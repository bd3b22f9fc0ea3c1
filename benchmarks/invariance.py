"""What the choice of solver and the order of the fibrils change: every state of a study once more, from the one before.

    python benchmarks/invariance.py results/paper [--solvers pardiso]

Each recorded state is reached again from the recorded state before it: with the fibrils shuffled, and with each solver
asked for. The tables give the largest difference of a clamp force, in parts of the largest, and of a probe current, in
parts of itself. A state where they are not small is a bifurcation: which branch is taken there hangs on round-off.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from measure import Table, arguments, publish

from circuittex.contact.extract import contacts_of
from circuittex.design import Design
from circuittex.fields import solve_probes
from circuittex.geometry.mesh import FibrilMesh, Floats, Ints
from circuittex.geometry.order import reordered
from circuittex.increment import advance
from circuittex.mech.configuration import Configuration
from circuittex.mech.linear import LinearSolver
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pardiso import PardisoSolver
from circuittex.plan import Step, plan
from circuittex.relaxation import Equilibrium, clamp_force, relax
from circuittex.results import Study
from circuittex.store import load_study

SOLVERS: dict[str, Callable[[], LinearSolver]] = {solver.name: solver for solver in (MultifrontalSolver, PardisoSolver)}
HEAD = ["state", "iterations", "recorded", "clamp force", "probe current"]


def again(design: Design, mesh: FibrilMesh, start: Configuration, step: Step, solver: LinearSolver) -> Equilibrium:
    """The equilibrium of a step once more."""
    if not step.previous:
        return relax(mesh, design, start, solver=solver)
    found = advance(mesh, design, start, step.before, step.after, free=step.free, solver=solver)
    return found.equilibrium


def rows(study: Study, mesh: FibrilMesh, nodes: Ints, solver: Callable[[], LinearSolver]) -> list[list[object]]:
    """A row for each state that is reached again on `mesh`, whose nodes have the numbers `nodes` in the study."""
    design, records, found = study.design, {record.name: record for record in study.records}, []
    for step in plan(design):
        record = records[step.name]
        before = records[step.previous].configuration if step.previous else study.initial
        state = again(design, mesh, Configuration(before.x[nodes]), step, solver())
        force = np.abs(clamp_force(mesh, state.reaction) - record.clamp_force).max() / np.abs(record.clamp_force).max()
        fields = solve_probes(contacts_of(design, mesh, state.configuration), design.terminals, design.probes)
        currents: Floats = np.array([field.currents[0] for field in fields])
        current = np.abs(currents / np.array(record.currents) - 1).max(initial=0.0)
        found.append([step.name, state.iterations, record.iterations, f"{force:.1e}", f"{current:.1e}"])
    return found


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("results", type=Path, help="folder of a study")
    parser.add_argument("--solvers", nargs="*", choices=tuple(SOLVERS), default=[], help="solvers to compare")
    options = parser.parse_args()
    study = load_study(options.results / "results.h5")
    mesh, seed = study.mesh, 1

    def tables() -> list[Table]:
        own = np.arange(mesh.n_nodes)
        other, nodes = reordered(mesh, np.random.default_rng(seed).permutation(mesh.n_fibrils))
        title = f"{study.design.name}: fibrils shuffled (seed {seed}), {MultifrontalSolver.name}:"
        made = [Table(title, HEAD, rows(study, other, nodes, MultifrontalSolver))]
        same = {f"{study.design.name}: {name}:": rows(study, mesh, own, SOLVERS[name]) for name in options.solvers}
        return [*made, *(Table(title, HEAD, found) for title, found in same.items())]

    publish(options, tables())


if __name__ == "__main__":
    main()
