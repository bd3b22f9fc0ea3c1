"""Backward Euler against its own closed forms, and dynamic relaxation against the equilibrium."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from fabrics import fibrils_through, small_cell, straight

from circuittex.base.arrays import Floats
from circuittex.base.errors import ConvergenceError, DesignError
from circuittex.design import Design
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.beam import Beam
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.dynamics import Body, Rest, affine_velocity, damping_matrix, march, relax_dynamically
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.scales import fibril_scales
from circuittex.mech.space import BeamSpace, beam_space
from circuittex.mech.terms import ForceTerm
from circuittex.relaxation.relax import clamp_force, force_terms, move, relax

E, RHO, R = 10.0, 1.0, 0.15  # MPa, g/mm3, mm
RHO_N = 1e-6 * RHO  # N s2/mm4, since 1 N = 1e6 g mm/s2
GAMMA = 1e-4  # N s/mm4: the paper's 0.1 N s/m for every mm3
SPAN = 2.0  # mm, the pitch of the cell
TIGHT = 1e-8  # N, where results are compared to 1e-6 of a clamp force of 0.1 N


def body(space: BeamSpace, beam: Beam, *others: ForceTerm, gamma: float) -> Body:
    """Beams and what else acts on them, with their mass, damped by `gamma`."""
    scales, damping = fibril_scales(space, SPAN), damping_matrix(space, gamma)
    return Body([beam, *others], scales, beam.mass, damping, space.fixed)


def bar(length: float = 4.0, elements: int = 8) -> tuple[BeamSpace, Beam, Floats]:
    """One straight fibril of linear elements along x."""
    mesh = fibrils_through([straight([0, 0, 0], [length, 0, 0], elements)], radius=R, modulus=E)
    space = beam_space(mesh)
    return space, Beam(space), space.vector(initial_configuration(mesh))


@pytest.mark.parametrize("gamma", [0.0, GAMMA])
def test_free_flight_coasts_and_drag_slows_it_by_a_known_factor(gamma: float) -> None:
    """No forces: v stays; with drag each step divides it by 1 + dt gamma / rho. Kinetic energy 1/2 m v^2."""
    space, beam, q = bar()
    velocity = np.zeros((space.mesh.n_nodes, 9))
    velocity[:, :3] = [300.0, -200.0, 100.0]
    dt, steps = 1e-3, 5
    instants = list(
        islice(
            march(
                body(space, beam, gamma=gamma)._replace(fixed=np.empty(0, dtype=np.int64)),
                q,
                velocity.ravel(),
                solver=MultifrontalSolver(),
                dt=dt,
                tolerance=1e-12,
            ),
            steps,
        )
    )
    left = (1 + dt * gamma / RHO_N) ** -np.arange(1, steps + 1)
    mass = RHO_N * np.pi * R**2 * 4.0
    speed2 = 300.0**2 + 200.0**2 + 100.0**2
    assert [each.kinetic for each in instants] == pytest.approx(0.5 * mass * speed2 * left**2, rel=1e-8)
    travelled = (instants[-1].q - q).reshape(-1, 9)[:, :3]
    assert travelled == pytest.approx(np.tile([300.0, -200.0, 100.0], (9, 1)) * dt * left.sum(), rel=1e-7)
    assert [each.time for each in instants] == pytest.approx(dt * np.arange(1, steps + 1))


@pytest.mark.parametrize("gamma", [0.0, 2e-4])
def test_an_axial_wave_has_its_frequency_and_its_numerical_damping(gamma: float) -> None:
    """The first axial mode of a clamped bar of linear elements, step for step.

    Its nodal values sin(pi k / n) are an eigenvector of stiffness and consistent mass with
    omega^2 = 6 E / (rho h^2) (2 - 2 cos t) / (4 + 2 cos t), t = pi / n. Backward Euler then gives
    x1 = ((1 + c) x0 + dt v0) / (1 + c + omega^2 dt^2), c = dt gamma / rho, v1 = (x1 - x0) / dt: for c = 0 the energy
    falls by 1 / (1 + omega^2 dt^2) a step. At strains of 1e-3 the material's curvature changes this by 1e-6.
    """
    length, n, amplitude = 4.0, 8, 1e-3
    space, beam, q = bar(length, n)
    shape = np.sin(np.pi * np.arange(n + 1) / n)
    t, h = np.pi / n, length / n
    omega = np.sqrt(6 * E / (RHO_N * h**2) * (2 - 2 * np.cos(t)) / (4 + 2 * np.cos(t)))
    assert omega == pytest.approx(np.pi / length * np.sqrt(E / RHO_N), rel=0.01)  # the continuous bar's
    dt = 0.3 / omega
    start = q.reshape(-1, 9).copy()
    start[:, 0] += amplitude * shape
    states = march(
        body(space, beam, gamma=gamma),
        start.ravel(),
        np.zeros_like(q),
        solver=MultifrontalSolver(),
        dt=dt,
        tolerance=1e-8,
    )
    x, v, c = amplitude, 0.0, dt * gamma / RHO_N
    for instant in islice(states, 25):
        new = ((1 + c) * x + dt * v) / (1 + c + (omega * dt) ** 2)
        x, v = new, (new - x) / dt
        moved = (instant.q - q).reshape(-1, 9)[:, 0]
        assert 2 / n * moved @ shape == pytest.approx(x, abs=1e-5 * amplitude)
        stored = 0.25 * E * np.pi * R**2 * np.pi**2 / length * (np.sin(t / 2) / (t / 2)) ** 2 * x**2
        moving = 0.5 * instant.velocity.reshape(-1, 9)[:, 0] @ shape * 2 / n
        assert 2 * moving == pytest.approx(v, abs=1e-5 * amplitude * omega)
        assert instant.energy == pytest.approx(
            stored, abs=5e-3 * 0.25 * E * np.pi * R**2 * np.pi**2 / length * amplitude**2
        )


def test_kinetic_energy_of_a_spinning_fibril_has_the_rotary_term() -> None:
    """Spin w about the axis: 1/2 rho I_p L w^2 with I_p = pi R^4 / 2 [34]."""
    space, beam, q = bar()
    x = q.reshape(-1, 3, 3)
    spin = np.zeros_like(x)
    spin[:, 1:] = np.cross([1.0, 0.0, 0.0], x[:, 1:]) * 100.0
    states = march(
        body(space, beam, gamma=0.0),
        q,
        spin.ravel(),
        solver=MultifrontalSolver(),
        dt=1e-6,
        tolerance=1e-9,
    )
    expected = 0.5 * RHO_N * np.pi * R**4 / 2 * 4.0 * 100.0**2
    assert next(states).kinetic == pytest.approx(expected, rel=1e-3)  # one step: spin slows by about (w dt)^2


@pytest.fixture(scope="module")
def cell() -> tuple[Design, FibrilMesh]:
    return small_cell((1, 2), elements=6, tolerance=f"{TIGHT} N")


def settle(cell: tuple[Design, FibrilMesh], **options: object) -> tuple[BeamSpace, Rest]:
    design, mesh = cell
    space, beam, contact = force_terms(mesh, design)
    settings = {"q": space.vector(initial_configuration(mesh)), "dt": 1e-2, "t_relax": 1.0, **options}
    rest = relax_dynamically(
        body(space, beam, contact, gamma=GAMMA),
        solver=MultifrontalSolver(),
        tolerance=TIGHT,
        **settings,
    )
    return space, rest


def test_dynamic_relaxation_ends_in_the_equilibrium(cell: tuple[Design, FibrilMesh]) -> None:
    design, mesh = cell
    static = relax(mesh, design, solver=MultifrontalSolver())
    space, rest = settle(cell)
    expected = clamp_force(mesh, static.reaction)
    found = clamp_force(mesh, space.configuration(rest.gradient).r)
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()
    assert rest.energy == pytest.approx(static.energy, rel=1e-8)
    assert rest.residual <= TIGHT


def test_energy_only_falls_while_damped(cell: tuple[Design, FibrilMesh]) -> None:
    _, rest = settle(cell)
    time, potential, kinetic, residual = rest.history.T
    assert np.all(np.diff(time) > 0)
    total = potential + kinetic
    assert np.all(np.diff(total) <= 1e-12 * total[0])
    assert kinetic[-1] < 1e-9 * potential[-1]
    assert residual[-1] == rest.residual == residual.min()


def test_algorithm_1_moves_and_relaxes_to_the_next_equilibrium(cell: tuple[Design, FibrilMesh]) -> None:
    """Strain rate 1/s for 25 ms, then damping: the equilibrium at 2.5 % stretch, with the ends where they belong."""
    design, mesh = cell
    space, first = settle(cell)
    rate = np.array([[1.0, 0.0], [0.0, 0.0]])
    _, rest = settle(cell, q=first.q, velocity=affine_velocity(space, first.q, rate), t_step=0.025)
    stretched = np.eye(2) + 0.025 * rate
    start = move(space.configuration(first.q), np.eye(2), stretched)
    ends = np.concatenate([mesh.end_nodes(-1), mesh.end_nodes(+1)])
    assert np.abs(space.configuration(rest.q).r[ends] - start.r[ends]).max() < 1e-14
    static = relax(mesh, design, start, solver=MultifrontalSolver())
    expected = clamp_force(mesh, static.reaction)
    found = clamp_force(mesh, space.configuration(rest.gradient).r)
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()
    assert expected[0, 0] > 1.5 * clamp_force(mesh, space.configuration(first.gradient).r)[0, 0]


def test_affine_velocity_is_in_plane_and_leaves_directors_alone(cell: tuple[Design, FibrilMesh]) -> None:
    _, mesh = cell
    space = beam_space(mesh)
    start = initial_configuration(mesh)
    velocity = space.configuration(affine_velocity(space, space.vector(start), np.array([[0.0, 0.0], [2.0, 0.0]])))
    assert np.array_equal(velocity.r, np.stack([0 * start.r[:, 0], 2 * start.r[:, 0], 0 * start.r[:, 0]], axis=1))
    assert np.all(velocity.x[:, 1:] == 0.0)


def test_too_little_time_is_an_error_with_history(cell: tuple[Design, FibrilMesh]) -> None:
    with pytest.raises(ConvergenceError, match="not at rest") as caught:
        settle(cell, t_relax=2e-2)
    assert caught.value.history.shape == (2, 4)
    assert caught.value.history[-1, 3] > TIGHT


def test_an_unsolved_step_is_an_error(cell: tuple[Design, FibrilMesh]) -> None:
    with pytest.raises(ConvergenceError, match="no equilibrium after 1 iterations"):
        settle(cell, max_iterations=1)


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"dt": 0.0}, "dt"),
        ({"dt": float("nan")}, "dt"),
        ({"t_relax": 0.0}, "t_relax"),
        ({"t_step": 1.0}, "t_step"),
        ({"t_step": 0.0, "velocity": np.zeros(1)}, "t_step"),
    ],
)
def test_impossible_times_are_refused(cell: tuple[Design, FibrilMesh], options: dict[str, object], field: str) -> None:
    with pytest.raises(DesignError, match=f"^{field}: "):
        settle(cell, **options)


@pytest.mark.parametrize("gamma", [-1.0, float("nan"), float("inf")])
def test_impossible_damping_is_refused(gamma: float) -> None:
    with pytest.raises(DesignError, match=r"^gamma: "):
        damping_matrix(bar()[0], gamma)
