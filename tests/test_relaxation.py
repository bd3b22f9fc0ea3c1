"""Equilibria of small cells: what must vanish, what symmetry demands, and what must not matter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fabrics import mirrored, renumbered, small_cell

from circuittex.base.errors import ConvergenceError
from circuittex.base.frozen import same
from circuittex.contact.extract import contact_state
from circuittex.design import Design, plain_weave
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.linear import Solve
from circuittex.mech.minimise import predict
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pattern import Pattern
from circuittex.mech.scales import fibril_scales
from circuittex.mech.system import System
from circuittex.relaxation.relax import Equilibrium, clamp_force, force_terms, move, relax

TIGHT = 1e-9  # N; clamp forces are some 0.1 N, so that results agree to 1e-7 and better
AGREE = 1e-7  # of forces in N and positions in mm between runs that differ by round-off only


def solved(design: Design, mesh: FibrilMesh, start: Configuration | None = None) -> Equilibrium:
    return relax(mesh, design, start, solver=MultifrontalSolver())


@pytest.fixture(scope="module")
def cell() -> tuple[Design, FibrilMesh, Equilibrium]:
    """Three fibrils a yarn in two rows, relaxed."""
    design, mesh = small_cell((1, 2), elements=6, tolerance=f"{TIGHT} N")
    return design, mesh, solved(design, mesh)


Cell = tuple[Design, FibrilMesh, Equilibrium]


def free_nodes(mesh: FibrilMesh) -> np.ndarray:
    return np.setdiff1d(np.arange(mesh.n_nodes), np.concatenate([mesh.end_nodes(-1), mesh.end_nodes(+1)]))


def test_forces_balance(cell: Cell) -> None:
    design, mesh, equilibrium = cell
    assert equilibrium.residual <= design.numerics.force_tolerance
    assert np.abs(equilibrium.reaction[free_nodes(mesh)]).max() <= equilibrium.residual
    assert np.abs(equilibrium.reaction.sum(axis=0)).max() <= mesh.n_nodes * equilibrium.residual
    moment = np.cross(equilibrium.configuration.r, equilibrium.reaction).sum(axis=0)
    # Directors are free, so the clamps' forces alone must have no moment either, up to free moments of TIGHT.
    assert np.abs(moment).max() <= 10 * mesh.n_nodes * TIGHT


def test_history_tells_the_descent(cell: Cell) -> None:
    _, _, equilibrium = cell
    residual, potential = equilibrium.history[:, 0], equilibrium.history[:, 1]
    assert len(equilibrium.history) == equilibrium.iterations + 1
    assert residual[-1] == equilibrium.residual
    assert potential[-1] == equilibrium.energy
    assert np.all(np.diff(potential) <= 1e-12 * potential[0])
    # At the end Newton's method is quadratic, since the tangent is exact, until the least shift limits it.
    assert residual[-1] < 1e-4 * residual[-3]


def test_the_ends_stay_where_they_are_held(cell: Cell) -> None:
    _, mesh, equilibrium = cell
    for side in (-1, +1):
        ends = mesh.end_nodes(side)
        assert np.array_equal(equilibrium.configuration.r[ends], mesh.position[ends])


def test_yarns_are_in_contact_and_the_clamps_pull(cell: Cell) -> None:
    design, mesh, equilibrium = cell
    contacts = contact_state(mesh, equilibrium.configuration, design.contact, per_element=4)
    yarn = mesh.yarn
    assert np.any(mesh.yarn_axis[yarn[contacts.fibril_a]] != mesh.yarn_axis[yarn[contacts.fibril_b]])
    assert np.all(np.diag(clamp_force(mesh, equilibrium.reaction)) > 0.01)


def test_stored_energy_is_what_the_terms_hold(cell: Cell) -> None:
    design, mesh, equilibrium = cell
    space, beam, contact = force_terms(mesh, design)
    q = space.vector(equilibrium.configuration)
    assert beam.energy(q) + contact.energy(q) == pytest.approx(equilibrium.energy, rel=1e-12)


def test_section_forces_at_the_ends_are_the_clamp_forces() -> None:
    """Fibrils in uniaxial tension between clamps, nothing touching: section force = reaction, neo-Hookean with nu = 0.

    P = mu (s - 1/s) with mu = E / 2, at a stretch s = 1.1.
    """
    design, mesh = small_cell((1,), elements=4, tolerance=f"{TIGHT} N")
    design = replace(design, contact=replace(design.contact, penalty=1e-12))
    flat = mesh.position * [1.0, 1.0, 0.0]
    mesh = replace(mesh, position=flat, directors=_level_directors(mesh))
    stretched = move(initial_configuration(mesh), np.eye(2), np.diag([1.1, 1.0]))
    equilibrium = solved(design, mesh, stretched)
    pull = 5.0 * (1.1 - 1 / 1.1) * np.pi * 0.15**2
    warp = mesh.yarn_axis[mesh.yarn[mesh.element_fibril]] == 0
    assert equilibrium.section_force[warp] == pytest.approx(np.tile([pull, 0, 0], (warp.sum(), 1)), abs=1e-8)
    assert equilibrium.section_force[~warp] == pytest.approx(0.0, abs=1e-8)
    assert clamp_force(mesh, equilibrium.reaction)[0] == pytest.approx([2 * pull, 0, 0], abs=1e-8)


def _level_directors(mesh: FibrilMesh) -> np.ndarray:
    """Directors of straight yarns in the plane: across, and up."""
    along = np.eye(3)[mesh.yarn_axis[mesh.yarn[mesh.node_fibril]]]
    up = np.tile([0.0, 0.0, 1.0], (mesh.n_nodes, 1))
    return np.stack([np.cross(up, along), up], axis=1)


def test_both_directions_carry_the_same_tension(cell: Cell) -> None:
    """A quarter turn about z takes the plain weave of equal yarns to itself, warp to weft."""
    _, mesh, equilibrium = cell
    warp, weft = clamp_force(mesh, equilibrium.reaction)
    assert [warp[0], -warp[1], warp[2]] == pytest.approx([weft[1], weft[0], weft[2]], abs=AGREE)


def test_restart_from_the_equilibrium_takes_no_iteration(cell: Cell) -> None:
    design, mesh, equilibrium = cell
    again = solved(design, mesh, equilibrium.configuration)
    assert again.iterations == 0
    assert same(again.configuration, equilibrium.configuration)
    assert again.energy == pytest.approx(equilibrium.energy, rel=1e-13)


def test_the_same_run_gives_the_same_bits(cell: Cell) -> None:
    design, mesh, equilibrium = cell
    assert same(solved(design, mesh), equilibrium)


def test_electrical_and_thermal_laws_do_not_enter_mechanics(cell: Cell) -> None:
    design, mesh, equilibrium = cell
    law = replace(design.contact, conductivity=123.0, heat_transfer=0.0)
    other = replace(mesh, electrical_conductivity=0 * mesh.radius, thermal_conductivity=7 + mesh.radius)
    assert same(solved(replace(design, contact=law), other), equilibrium)


def test_stiffness_and_penalty_in_proportion_scale_forces_only(cell: Cell) -> None:
    """Twice E and twice P*: the same shape, twice the forces and energy."""
    design, mesh, equilibrium = cell
    law = replace(design.contact, penalty=2 * design.contact.penalty)
    stiff = solved(replace(design, contact=law), replace(mesh, youngs_modulus=2 * mesh.youngs_modulus))
    assert np.abs(stiff.configuration.r - equilibrium.configuration.r).max() < AGREE
    assert np.abs(stiff.reaction - 2 * equilibrium.reaction).max() < AGREE
    assert stiff.energy == pytest.approx(2 * equilibrium.energy, rel=1e-9)


@pytest.mark.parametrize("limit", [1, 3])
def test_an_unconverged_state_is_never_returned(limit: int) -> None:
    design, mesh = small_cell((1, 2), elements=6, max_iterations=limit)
    with pytest.raises(ConvergenceError, match=f"no equilibrium after {limit} iterations") as caught:
        solved(design, mesh)
    assert caught.value.history.shape == (limit + 1, 4)
    assert np.all(caught.value.history[:, 0] > design.numerics.force_tolerance)


def test_a_start_that_is_inside_out_is_an_error(cell: Cell) -> None:
    design, mesh, _ = cell
    x = initial_configuration(mesh).x.copy()
    x[:, 1] *= -1
    with pytest.raises(ConvergenceError, match="inside out"):
        solved(design, mesh, Configuration(x))


def test_progress_is_reported_for_every_iteration(cell: Cell) -> None:
    design, mesh, equilibrium = cell
    seen: list[tuple[int, float]] = []
    relax(mesh, design, solver=MultifrontalSolver(), report=lambda i, residual: seen.append((i, residual)))
    assert [i for i, _ in seen] == list(range(equilibrium.iterations + 1))
    assert [residual for _, residual in seen] == equilibrium.history[:, 0].tolist()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_mirror_image_relaxes_to_the_mirror_image(cell: Cell, axis: int) -> None:
    design, mesh, equilibrium = cell
    image = solved(design, mirrored(mesh, axis))
    sign = np.ones(3)
    sign[axis] = -1.0
    assert np.abs(image.configuration.r * sign - equilibrium.configuration.r).max() < AGREE
    assert np.abs(image.reaction * sign - equilibrium.reaction).max() < AGREE


def test_renumbering_and_reversing_fibrils_changes_nothing(cell: Cell) -> None:
    design, mesh, equilibrium = cell
    place = np.random.default_rng(4).permutation(mesh.n_fibrils)
    other, node = renumbered(mesh, place, flip=[0, 3, 7])
    result = solved(design, other)
    assert np.abs(result.configuration.r - equilibrium.configuration.r[node]).max() < AGREE
    assert np.abs(result.reaction - equilibrium.reaction[node]).max() < AGREE
    assert result.energy == pytest.approx(equilibrium.energy, rel=1e-10)


def test_stretching_raises_the_tension_along_it_and_back_restores_it(cell: Cell) -> None:
    design, mesh, equilibrium = cell
    stretch = np.diag([1.01, 1.0])
    away = solved(design, mesh, move(equilibrium.configuration, np.eye(2), stretch))
    back = solved(design, mesh, move(away.configuration, stretch, np.eye(2)))
    rest, pulled, restored = (clamp_force(mesh, each.reaction) for each in (equilibrium, away, back))
    assert pulled[0, 0] > 1.2 * rest[0, 0]
    assert np.abs(restored - rest).max() < AGREE


@pytest.mark.parametrize("after", [np.diag([1.1, 0.9]), np.array([[1.0, 0.0], [0.25, 1.0]])])
def test_move_is_affine_in_the_plane(cell: Cell, after: np.ndarray) -> None:
    start = cell[2].configuration
    before = np.array([[1.05, 0.02], [0.0, 1.0]])
    moved = move(start, before, after)
    expected = np.linalg.solve(before.T, after.T).T  # after . before^-1
    assert moved.r[:, :2] == pytest.approx(start.r[:, :2] @ expected.T, abs=1e-14)
    assert np.array_equal(moved.r[:, 2], start.r[:, 2])
    assert np.array_equal(moved.x[:, 1:], start.x[:, 1:])


def test_moves_compose(cell: Cell) -> None:
    start = cell[2].configuration
    one, two = np.diag([1.1, 1.0]), np.array([[1.0, 0.0], [0.2, 1.0]])
    steps = move(move(start, np.eye(2), one), one, two)
    assert steps.r == pytest.approx(move(start, np.eye(2), two).r, abs=1e-14)


def test_clamp_force_sums_the_plus_ends_of_either_direction(cell: Cell) -> None:
    _, mesh, _ = cell
    force = np.zeros((mesh.n_nodes, 3))
    force[mesh.end_nodes(+1), mesh.yarn_axis[mesh.yarn]] = 0.5
    force[mesh.end_nodes(-1)] = 100.0
    assert np.array_equal(clamp_force(mesh, force), [[3.0, 0, 0], [0, 3.0, 0]])


@pytest.mark.parametrize(("modulus", "density"), [(2000.0, 1.2e-3), (1.2e5, 8.9e-3)])
def test_stiff_and_light_materials_relax_to_the_same_shape(modulus: float, density: float) -> None:
    """With penalty and modulus scaled alike, nylon's and copper's equilibrium is the soft cell's."""
    soft = plain_weave(yarns=2, rows=(1, 2))
    soft = replace(soft, numerics=replace(soft.numerics, elements=10))
    yarn = soft.weave.warp[0]
    material = replace(yarn.materials[0], youngs_modulus=modulus, density=density)
    stiff_yarn = replace(yarn, materials=(material,) * len(yarn.materials))
    ratio = modulus / yarn.materials[0].youngs_modulus
    stiff = replace(
        soft,
        weave=replace(soft.weave, warp=(stiff_yarn,) * 2, weft=(stiff_yarn,) * 2),
        contact=replace(soft.contact, penalty=ratio * soft.contact.penalty),
    )
    energies = [relax(build_mesh(design), design).energy for design in (soft, stiff)]
    assert energies[1] / energies[0] == pytest.approx(ratio, rel=1e-6)  # residuals of 1e-6 of the forces


def test_a_prediction_is_of_second_order(cell: Cell) -> None:
    """Half the increment: a quarter of the distance to the equilibrium, where the affine start has half of it."""
    design, mesh, relaxed = cell
    space, beam, contact = force_terms(mesh, design)
    q, solver = space.vector(relaxed.configuration), MultifrontalSolver()
    scales = fibril_scales(space, design.weave.pitch)

    def distances(strain: float) -> np.ndarray:
        moved = move(relaxed.configuration, np.eye(2), np.diag([1 + strain, 1.0]))
        to = space.vector(moved)
        predicted = predict(System([beam, contact], scales, space.fixed, len(q)), solver, q, to)
        goal = relax(mesh, design, moved, before=relaxed.configuration, solver=solver).configuration.r
        return np.array([np.abs(r - goal).max() for r in (moved.r, space.configuration(predicted).r)])

    affine, predicted = np.log2(distances(2e-3) / distances(1e-3))
    # Contacts that open or close in the step blur the orders: half an order either way.
    assert affine == pytest.approx(1, abs=0.5)
    assert predicted == pytest.approx(2, abs=0.5)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_refused_factorisations_only_cost_iterations(cell: Cell, seed: int) -> None:
    """A solver that calls three of five matrices indefinite at random, early and late, leads to the same minimum.

    Five in a row at most: fourteen would use up all shifts, and once in a thousand times they would come.
    """
    design, mesh, relaxed = cell
    rng, inner = np.random.default_rng(seed), MultifrontalSolver()

    class Refusing:
        name = "refusing"
        in_a_row = 0

        def factor(self, pattern: Pattern, data: np.ndarray, *, rough: bool = False) -> Solve | None:
            self.in_a_row = self.in_a_row + 1 if rng.random() < 0.6 and self.in_a_row < 5 else 0
            return None if self.in_a_row else inner.factor(pattern, data, rough=rough)

        def forget(self) -> None:
            inner.forget()

    moved = move(relaxed.configuration, np.eye(2), np.diag([1.01, 1.0]))
    expected = solved(design, mesh, moved)
    found = relax(mesh, design, moved, solver=Refusing())
    assert found.iterations >= expected.iterations
    assert np.abs(found.reaction - expected.reaction).max() < AGREE
