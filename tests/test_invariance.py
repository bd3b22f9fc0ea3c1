"""What must not matter: the number of threads, bit for bit; the solver and the order of fibrils, up to round-off."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from fabrics import renumbered, small_cell

from circuittex.base.arrays import Floats
from circuittex.contact.extract import contacts_of
from circuittex.design import Design
from circuittex.electrical.fields import solve_fields
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.linear import LinearSolver
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pardiso import PardisoSolver
from circuittex.relaxation.relax import Equilibrium, clamp_force, move, relax


def usable() -> dict[str, type]:
    """Every solver that can be loaded here, by its name."""
    try:
        PardisoSolver()
    except (ImportError, OSError):
        return {MultifrontalSolver.name: MultifrontalSolver}
    return {solver.name: solver for solver in (MultifrontalSolver, PardisoSolver)}


SOLVERS = usable()
ALLOWED = 1e-6
"""Relative, of clamp forces to the largest and of each current to itself: what the project promises."""
TOLERANCE = 1e-8  # N; clamp forces are some 0.1 N, so the residual leaves a tenth of ALLOWED

# ---- Threads ----------------------------------------------------------------------------------------------

PROGRAM = """
import sys
import numpy as np
from fabrics import small_cell
from test_invariance import SOLVERS
from circuittex.mech.pattern import build_pattern, diagonal
from circuittex.relaxation.relax import relax

side = 28
node = np.arange(side * side).reshape(side, side)
neighbours = np.stack([np.r_[node[:-1].ravel(), node[:, :-1].ravel()], np.r_[node[1:].ravel(), node[:, 1:].ravel()]], 1)
pattern = build_pattern(side * side, neighbours, np.random.default_rng(0).integers(0, side * side, (60, 2)))
design, mesh = small_cell((1, 2), elements=4)
found = {}
for name, kind in SOLVERS.items():
    rng, solver = np.random.default_rng(1), kind()
    for k in range(3):
        data = rng.uniform(-1, 1, pattern.nnz)
        data[diagonal(pattern)] = 60.0
        found[f"{name} solution {k}"] = solver.factor(pattern, data)(rng.normal(size=pattern.n_dofs))
    state = relax(mesh, design, solver=solver)
    for part in ("reaction", "section_force", "history"):
        found[f"{name} {part}"] = getattr(state, part)
    found[f"{name} x"] = state.configuration.x
np.savez(sys.argv[1], **found)
"""
"""With every solver: three systems of 7,056 unknowns coupled as a cloth's nodes are, large enough for a factorisation
to be shared out between threads; and the relaxation of a cell, with every iteration of the descent."""


def results(folder: Path, threads: int) -> dict[str, Floats]:
    """What `PROGRAM` computes in a process of its own with so many threads."""
    variables = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    environment = {**os.environ, **dict.fromkeys(variables, str(threads)), "MKL_DYNAMIC": "FALSE"}
    environment["PYTHONPATH"] = str(Path(__file__).parent)
    file = folder / f"{threads}.npz"
    command = [sys.executable, "-c", PROGRAM, str(file)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=600)
    assert done.returncode == 0, done.stderr
    with np.load(file) as stored:
        return dict(stored)


def test_the_number_of_threads_changes_no_bit(tmp_path: Path) -> None:
    """Of solutions, and of equilibria and all iterations on the way to them."""
    one, two = (results(tmp_path, threads) for threads in (1, 2))
    assert len(one) == 7 * len(SOLVERS)
    assert one.keys() == two.keys()
    assert [name for name in one if one[name].tobytes() != two[name].tobytes()] == []


# ---- Solvers, and the order of fibrils --------------------------------------------------------------------

STRETCHED = np.diag([1.05, 1.0])


def states(design: Design, mesh: FibrilMesh, start: Configuration, solver: LinearSolver) -> list[Equilibrium]:
    """The cell relaxed and then stretched by 5 %."""
    rest = relax(mesh, design, start, solver=solver)
    return [rest, relax(mesh, design, move(rest.configuration, np.eye(2), STRETCHED), solver=solver)]


def currents(design: Design, mesh: FibrilMesh, state: Equilibrium) -> Floats:
    """(3,) current of each probe, A."""
    contacts = contacts_of(design, mesh, state.configuration)
    return np.array([solve_fields(contacts, design.terminals, probe).currents[0] for probe in design.probes])


@cache
def cell() -> tuple[Design, FibrilMesh, list[Equilibrium]]:
    design, mesh = small_cell((1, 2), elements=4, tolerance=f"{TOLERANCE} N")
    return design, mesh, states(design, mesh, initial_configuration(mesh), MultifrontalSolver())


def assert_same_results(found: list[Equilibrium], mesh: FibrilMesh) -> None:
    design, original, expected = cell()
    for one, other in zip(expected, found, strict=True):
        force = clamp_force(original, one.reaction)
        assert np.abs(clamp_force(mesh, other.reaction) - force).max() < ALLOWED * np.abs(force).max()
        assert currents(design, mesh, other) == pytest.approx(currents(design, original, one), rel=ALLOWED)
        assert other.energy == pytest.approx(one.energy, rel=1e-10)  # its error is of second order


@pytest.mark.parametrize("solver", [name for name in SOLVERS if name != MultifrontalSolver.name])
def test_the_choice_of_solver_does_not_show(solver: str) -> None:
    design, mesh, _ = cell()
    assert_same_results(states(design, mesh, initial_configuration(mesh), SOLVERS[solver]()), mesh)


@pytest.mark.parametrize("seed", [0, 1])
def test_the_order_of_fibrils_does_not_show(seed: int) -> None:
    """Fibrils of all yarns shuffled: unknowns, contacts, factor and circuit are numbered otherwise."""
    design, mesh, expected = cell()
    place = np.random.default_rng(seed).permutation(mesh.n_fibrils)
    other, node = renumbered(mesh, place)
    assert np.any(np.diff(other.yarn) < 0)
    found = states(design, other, initial_configuration(other), MultifrontalSolver())
    assert_same_results(found, other)
    for one, shuffled in zip(expected, found, strict=True):
        scale = np.abs(one.reaction).max()
        assert np.abs(shuffled.reaction - one.reaction[node]).max() < ALLOWED * scale


@pytest.mark.parametrize("yarns", [[1, 0, 3, 2], [2, 0, 3, 1]])
def test_the_order_of_yarns_does_not_show(yarns: list[int]) -> None:
    """Whole yarns in another order, names and fibrils along with them."""
    design, mesh, _ = cell()
    place = np.concatenate([np.flatnonzero(mesh.yarn == yarn) for yarn in yarns])
    other, _ = renumbered(mesh, place)
    number = np.argsort(yarns)
    other = replace(
        other,
        yarn=number[other.yarn],
        yarn_axis=mesh.yarn_axis[yarns],
        yarn_names=tuple(mesh.yarn_names[yarn] for yarn in yarns),
    )
    assert np.all(np.diff(other.yarn) >= 0)
    assert_same_results(states(design, other, initial_configuration(other), MultifrontalSolver()), other)
