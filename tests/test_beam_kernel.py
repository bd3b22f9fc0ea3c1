"""The compiled beam against its scikit-fem form, differences, rigid motions, and closed forms of energy and mass."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest
from beams import assembled, dense, rod, stiffness
from fabrics import fibrils_through, small_cell, straight
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from circuittex.base.arrays import Floats
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.beam import Beam
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.form import BeamForm
from circuittex.mech.pattern import multiply
from circuittex.mech.space import BeamSpace, beam_space

ROUND_OFF = 1e-13
"""Relative difference of two orders of summation over a few hundred terms."""
ORDERS = [1, 2]
POISSON = [0.0, 0.3]


def pair(order: int, nu: float, *, other_radius: float = 0.2) -> FibrilMesh:
    """Two fibrils of different length, direction, material and, by default, radius."""
    lines = [straight((0, 0, 0), (1, 0, 0), 3, order), straight((0, 1, 0), (0, 1.5, 2), 2, order)]
    return fibrils_through(lines, order=order, radius=[0.15, other_radius], modulus=[10.0, 20.0], poisson=[nu, nu / 2])


def shaken(space: BeamSpace, seed: int, size: float = 0.04) -> Floats:
    """(n_dofs,) the initial configuration with noise on all unknowns, no section inside out."""
    q = space.vector(initial_configuration(space.mesh))
    return np.asarray(q + size * np.random.default_rng(seed).uniform(-1, 1, len(q)))


def moved(space: BeamSpace, q: Floats, rotation: Rotation, shift: Floats) -> Floats:
    """The same state elsewhere: positions turned and shifted, directors turned."""
    x = space.configuration(q).x @ rotation.as_matrix().T
    x[:, 0] += shift
    return space.vector(Configuration(x))


def turned(space: BeamSpace, vector: Floats, rotation: Rotation) -> Floats:
    return moved(space, vector, rotation, np.zeros(3))


CASES = {
    "equal radii": (0.15, False, 3),
    "unequal radii": (0.2, False, 3),
    "finer section": (0.2, False, 5),
    "naturally bent": (0.2, True, 3),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("nu", POISSON)
def test_kernel_is_the_scikit_fem_form(case: str, order: int, nu: float) -> None:
    other_radius, bent, degree = CASES[case]
    mesh = pair(order, nu, other_radius=other_radius)
    space = beam_space(mesh)
    natural = space.configuration(shaken(space, 1)) if bent else None
    q = shaken(space, 2)
    form = BeamForm(mesh, degree=degree, natural=natural)
    energy, gradient, pattern, data = assembled(Beam(space, degree=degree, natural=natural), q)
    residual, tangent = form.residual(q), form.tangent(q).toarray()
    assert energy == pytest.approx(form.energy(q), rel=ROUND_OFF)
    assert np.abs(gradient - residual).max() < ROUND_OFF * np.abs(residual).max()
    assert np.abs(dense(pattern, data) - tangent).max() < ROUND_OFF * np.abs(tangent).max()


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("nu", POISSON)
def test_energy_alone_is_that_of_the_assembly(order: int, nu: float) -> None:
    space = beam_space(pair(order, nu))
    beam, q = Beam(space), shaken(space, 3)
    assert beam.energy(q) == pytest.approx(assembled(beam, q)[0], rel=ROUND_OFF)


@pytest.mark.parametrize("pieces", [2, 5])
def test_number_of_threads_changes_no_bit(pieces: int, monkeypatch: pytest.MonkeyPatch) -> None:
    _, mesh = small_cell((1, 2), elements=3)
    space = beam_space(mesh)
    q, beam = shaken(space, 13), Beam(space)
    monkeypatch.setattr("circuittex.mech.beam.WORTH_A_THREAD", 1)
    found: list[list[Floats]] = []
    for cores in (1, pieces):
        monkeypatch.setattr("circuittex.mech.beam.cores", lambda cores=cores: cores)
        energy, gradient, _, data = assembled(beam, q)
        found.append([np.array([energy, beam.energy(q)]), gradient, data, beam.section_force(q)])
    assert all(np.array_equal(a, b) for a, b in zip(*found, strict=True))


@pytest.mark.parametrize("nu", [0.0, 0.4])
@pytest.mark.parametrize("stretch", [0.3, 0.79, 0.81, 1.24, 1.26, 4.0])
def test_energy_of_a_large_stretch(nu: float, stretch: float) -> None:
    """E A L of a rod with held section: F = diag(1, 1, s), with lambda in full since no section turns; s on both
    sides of the limits of the logarithm's series."""
    R, L, E = 0.15, 3.0, 10.0
    mesh = rod(L, 2, 2, radius=R, modulus=E, poisson=nu)
    space, x = beam_space(mesh), initial_configuration(mesh).x.copy()
    x[:, 0] *= stretch
    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    density = mu / 2 * (stretch**2 - 1) - mu * np.log(stretch) + lam / 2 * np.log(stretch) ** 2
    assert Beam(space).energy(space.vector(Configuration(x))) == pytest.approx(density * pi * R**2 * L, rel=1e-13)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("nu", POISSON)
def test_gradient_and_tangent_are_slopes(order: int, nu: float) -> None:
    """Central differences with step 1e-5: truncation (1e-5 / 0.1)^2 = 1e-8, round-off 1e-16 / 1e-5 = 1e-11."""
    space = beam_space(pair(order, nu))
    beam, q, step = Beam(space), shaken(space, 4), 1e-5
    _, gradient, pattern, data = assembled(beam, q)
    rng = np.random.default_rng(5)
    for _ in range(5):
        direction = rng.uniform(-1, 1, len(q))
        ahead, behind = q + step * direction, q - step * direction
        slope = (beam.energy(ahead) - beam.energy(behind)) / (2 * step)
        assert slope == pytest.approx(gradient @ direction, abs=1e-7 * np.abs(gradient).sum())
        change = (assembled(beam, ahead)[1] - assembled(beam, behind)[1]) / (2 * step)
        product = multiply(pattern, data, direction)
        assert np.abs(change - product).max() < 1e-6 * np.abs(product).max()


@pytest.mark.parametrize("order", ORDERS)
def test_multiply_is_the_dense_product(order: int) -> None:
    space = beam_space(pair(order, 0.3))
    _, _, pattern, data = assembled(Beam(space), shaken(space, 6))
    x = np.random.default_rng(7).normal(size=space.n_dofs)
    expected = dense(pattern, data) @ x
    assert np.abs(multiply(pattern, data, x) - expected).max() < ROUND_OFF * np.abs(expected).max()


@given(seed=st.integers(0, 2**32 - 1), order=st.sampled_from(ORDERS), nu=st.sampled_from(POISSON))
def test_rigid_motion_gives_no_force(seed: int, order: int, nu: float) -> None:
    space = beam_space(pair(order, nu))
    rotation = Rotation.random(rng=np.random.default_rng(seed))
    q = space.vector(initial_configuration(space.mesh))
    energy, gradient, _, _ = assembled(Beam(space), moved(space, q, rotation, np.array([1.0, -2.0, 0.5])))
    stiff = 20.0 * pi * 0.2**2  # E A, N: the force of a strain of one
    assert abs(energy) < 1e-27 * stiff
    assert np.abs(gradient).max() < 1e-14 * stiff


@given(seed=st.integers(0, 2**32 - 1), order=st.sampled_from(ORDERS), nu=st.sampled_from(POISSON))
def test_forces_turn_with_the_body(seed: int, order: int, nu: float) -> None:
    space = beam_space(pair(order, nu))
    rng = np.random.default_rng(seed)
    rotation, beam, q = Rotation.random(rng=rng), Beam(space), shaken(space, seed)
    energy, gradient, pattern, data = assembled(beam, q)
    same, turned_gradient, _, turned_data = assembled(beam, moved(space, q, rotation, rng.normal(size=3)))
    assert same == pytest.approx(energy, rel=1e-12)
    assert np.abs(turned_gradient - turned(space, gradient, rotation)).max() < 1e-12 * np.abs(gradient).max()
    direction = rng.normal(size=len(q))
    product = turned(space, multiply(pattern, data, direction), rotation)
    turned_product = multiply(pattern, turned_data, turned(space, direction, rotation))
    assert np.abs(turned_product - product).max() < 1e-12 * np.abs(product).max()


@given(seed=st.integers(0, 2**32 - 1), order=st.sampled_from(ORDERS), nu=st.sampled_from(POISSON))
def test_forces_and_moments_of_each_fibril_sum_to_zero(seed: int, order: int, nu: float) -> None:
    space = beam_space(pair(order, nu))
    q = shaken(space, seed)
    x, f = (space.configuration(v).x for v in (q, assembled(Beam(space), q)[1]))
    for fibril in range(2):
        own = space.mesh.node_fibril == fibril
        assert np.abs(f[own, 0].sum(axis=0)).max() < 1e-12 * np.abs(f).max()
        assert np.abs(np.cross(x[own], f[own]).sum(axis=(0, 1))).max() < 1e-12 * np.abs(f).max()


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("nu", POISSON)
@pytest.mark.parametrize("elements", [1, 2, 7])
def test_a_free_fibril_has_six_rigid_modes_and_no_other(order: int, nu: float, elements: int) -> None:
    """The softest elastic mode, bending, is (R / L)^2 / n = 1e-5 of the stiffest; zero is round-off, 1e-16."""
    _, K = stiffness(rod(8.0, elements, order, radius=0.15, poisson=nu))
    eigenvalue = np.linalg.eigvalsh(K) / np.abs(K).max()
    assert np.abs(eigenvalue[:6]).max() < 1e-13
    assert eigenvalue[6] > 1e-7


@pytest.mark.parametrize("order", ORDERS)
def test_a_section_inside_out_costs_infinite_energy(order: int) -> None:
    mesh = rod(1.0, 2, order, radius=0.15)
    space, x = beam_space(mesh), initial_configuration(mesh).x
    mirrored = x.copy()
    mirrored[:, 1] *= -1
    kinked = x.copy()
    kinked[:, 1, 0] = -10.0 * mesh.xi  # the stretch 1 - 10 xi1 is -0.06 at the section point xi1 = R / sqrt 2
    for inside_out in (mirrored, kinked):
        q = space.vector(Configuration(inside_out))
        assert Beam(space).energy(q) == inf
        assert assembled(Beam(space), q)[0] == inf


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("strain", [1e-3, 1e-6, 1e-9, -1e-9])
def test_energy_of_a_small_strain_keeps_its_digits(order: int, strain: float) -> None:
    """1/2 E A e^2 L (nu = 0), though the terms of the density are of order one and the strain itself has
    1e-16 / e of relative round-off; the next term of the series is of order e."""
    R, L, E = 0.15, 3.0, 10.0
    mesh = rod(L, 4, order, radius=R, modulus=E)
    space, x = beam_space(mesh), initial_configuration(mesh).x.copy()
    x[:, 0] *= 1 + strain
    energy = Beam(space).energy(space.vector(Configuration(x)))
    expected = 0.5 * E * pi * R**2 * strain**2 * L
    assert energy == pytest.approx(expected, rel=2 * abs(strain) + 1e-14 / abs(strain), abs=0)


@pytest.mark.parametrize("order", ORDERS)
def test_kinetic_energy_of_rigid_motions_is_that_of_a_solid_cylinder(order: int) -> None:
    """1/2 m v^2, and 1/2 I w^2 with I = m R^2 / 2 about the axis and m (3 R^2 + L^2) / 12 across it."""
    R, L, rho = 0.4, 3.0, 1.7
    straight_rod = rod(L, 3, order, radius=R)
    mesh = replace(straight_rod, density=np.array([rho]))
    space = beam_space(mesh)
    beam = Beam(space)
    _, _, pattern, _ = assembled(beam, space.vector(initial_configuration(mesh)))
    mass_matrix = beam.mass(pattern)
    mass = rho * pi * R**2 * L
    x = initial_configuration(mesh).x - [[L / 2, 0, 0], [0, 0, 0], [0, 0, 0]]

    def twice_the_energy(velocity: Floats) -> float:
        v = space.vector(Configuration(velocity))
        return float(v @ multiply(pattern, mass_matrix, v))

    for axis, inertia in zip(np.eye(3), mass * np.array([R**2 / 2, *2 * [(3 * R**2 + L**2) / 12]]), strict=True):
        shift = np.zeros_like(x)
        shift[:, 0] = axis
        assert twice_the_energy(shift) == pytest.approx(mass, rel=ROUND_OFF)
        assert twice_the_energy(np.cross(axis, x)) == pytest.approx(inertia, rel=ROUND_OFF)
