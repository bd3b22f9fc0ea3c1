"""The beam against closed forms and published values; the mesh of each benchmark is stated with it."""

from __future__ import annotations

from math import cos, pi, radians, sin

import numpy as np
import pytest
from beams import (
    MODULUS,
    SLENDER,
    arc,
    bending_stiffness,
    dofs,
    elastica_cantilever,
    elastica_column,
    moment,
    observed_order,
    rest,
    rod,
    stiffness,
    tip_load,
    turned,
)
from numpy.typing import ArrayLike
from reference import (
    BEND_LOAD,
    BEND_MODULUS,
    BEND_RADIUS,
    BEND_SECTION_RADIUS,
    BEND_TIP,
    ELASTICA_CANTILEVER,
    ELASTICA_COLUMN,
    FIVE_DIGITS,
    FOUR_DIGITS,
    HALF_PERCENT,
)
from scipy.optimize import brentq

from circuittex.base.arrays import Floats
from circuittex.mech.beam import Beam
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.space import BeamSpace, beam_space

MESH = {1: 128, 2: 16}
"""Order of the elements: how many of them the elastica gets."""
ORDERS = sorted(MESH)
POISSON = [0.0, 0.15, 0.3, 0.45]
DESIGN_ORDER = {1: 1.8, 2: 3.8}
"""Order of convergence to be seen at least: second with linear elements, fourth with quadratic ones. The latter shows
once elements are shorter than some ten radii, the length over which a section's own stretch fades."""
EXACT = 1e-9
"""For what every mesh represents exactly: round-off times the condition of the stiffness, which is below 1e7."""


def tip_of_elastica(
    load: ArrayLike, elements: int, order: int, *, radius: float = SLENDER, bent: float = 0.0
) -> Configuration:
    """The clamped beam of length 1 under a dead tip load in units of E I, from an arc of the given tip angle."""
    mesh = rod(1.0, elements, order, radius=radius)
    space, EI = beam_space(mesh), bending_stiffness(radius)
    tip = tip_load(space, EI * np.asarray(load))
    found, _ = rest(Beam(space), arc(mesh.xi, bent), dofs(space, 0), tip, tolerance=1e-7 * EI)
    return found


@pytest.mark.parametrize("alpha", ELASTICA_CANTILEVER)
def test_the_cantilever_in_elliptic_integrals_is_the_published_one(alpha: float) -> None:
    assert elastica_cantilever(alpha) == pytest.approx(ELASTICA_CANTILEVER[alpha], abs=FIVE_DIGITS)


@pytest.mark.parametrize("degrees", ELASTICA_COLUMN)
def test_the_column_in_elliptic_integrals_is_the_published_one(degrees: float) -> None:
    assert elastica_column(radians(degrees)) == pytest.approx(ELASTICA_COLUMN[degrees], abs=FOUR_DIGITS)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("alpha", ELASTICA_CANTILEVER)
def test_cantilever_under_a_dead_transverse_load(order: int, alpha: float) -> None:
    found = tip_of_elastica([0.0, alpha, 0.0], MESH[order], order)
    angle = np.arctan2(-found.g1[-1, 0], found.g1[-1, 1])
    measured = (angle, found.r[-1, 1], 1 - found.r[-1, 0])
    assert measured == pytest.approx(ELASTICA_CANTILEVER[alpha], rel=HALF_PERCENT)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("degrees", ELASTICA_COLUMN)
def test_column_under_a_dead_axial_load(order: int, degrees: float) -> None:
    """The load is that of the closed form: at 20 degrees four published digits of it leave 0.2 % of the tip open."""
    load = elastica_column(radians(degrees))[0] * pi**2 / 4
    found = tip_of_elastica([-load, 0.0, 0.0], MESH[order], order, bent=0.5)
    assert found.r[-1, :2] == pytest.approx(ELASTICA_COLUMN[degrees][1:], rel=HALF_PERCENT)


@pytest.mark.parametrize("order", ORDERS)
def test_a_column_below_its_critical_load_stays_straight(order: int) -> None:
    load = 0.98 * pi**2 / 4
    found = tip_of_elastica([-load, 0.0, 0.0], MESH[order], order, bent=0.1)
    assert np.abs(found.r[:, 1]).max() < 1e-4


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("load", [(0.0, 5.0, 0.0), (-2.841, 0.0, 0.0)])
def test_order_of_convergence_of_the_elastica(order: int, load: tuple[float, float, float]) -> None:
    """With R/L = 0.02, so that all three quadratic meshes resolve the sections' stretch."""
    meshes = {1: (32, 64, 128), 2: (4, 8, 16)}[order]
    tips = [tip_of_elastica(load, n, order, radius=0.02, bent=0.5).r[-1, 1] for n in meshes]
    assert observed_order(tips) > DESIGN_ORDER[order]


def rolled_up(angle: float, elements: int, order: int) -> tuple[Floats, float]:
    """Tip (3,) and end moment over E I of a beam of length 1 whose last section is turned by `angle`, its place free.

    It is kept in its plane: in space two full turns come undone without turning the ends (Dirac's belt).
    """
    mesh = rod(1.0, elements, order, radius=SLENDER)
    space, EI = beam_space(mesh), bending_stiffness(SLENDER)
    out_of_plane = np.arange(2, space.n_dofs, 3)
    fixed = np.unique(np.concatenate([dofs(space, 0), dofs(space, -1, [1, 2]), out_of_plane]))
    found = initial_configuration(mesh)
    steps = round(angle / (pi / 4))
    for step in range(1, steps + 1):
        x = found.x.copy()
        x[-1, 1:] = np.eye(3)[1:] @ turned(angle * step / steps, 2).T
        found, minimum = rest(Beam(space), Configuration(x), fixed, tolerance=1e-6 * EI)
    return found.r[-1], float(moment(space, minimum, -1)[2]) / EI


@pytest.mark.parametrize(
    ("turns", "elements", "order"), [(0.25, 16, 2), (0.5, 16, 2), (1, 16, 2), (2, 32, 2), (1, 96, 1)]
)
def test_roll_up_by_an_end_moment(turns: float, elements: int, order: int) -> None:
    """Pure bending: M = E I t / L, and the axis is a circle; a moment of 4 pi E I / L winds twice."""
    t = 2 * pi * turns
    tip, end_moment = rolled_up(t, elements, order)
    assert end_moment == pytest.approx(t, rel=HALF_PERCENT)
    assert tip == pytest.approx([sin(t) / t, (1 - cos(t)) / t, 0.0], abs=HALF_PERCENT / t)  # of the circle's radius


@pytest.mark.parametrize("order", ORDERS)
def test_order_of_convergence_of_the_roll_up(order: int) -> None:
    meshes = {1: (16, 32, 64), 2: (4, 8, 16)}[order]
    assert observed_order([rolled_up(pi, n, order)[1] for n in meshes]) > DESIGN_ORDER[order]


def bend(elements: int, order: int) -> tuple[Floats, Floats]:
    """Tip (3,) and section forces (M, 3) of the 45-degree bend."""
    mesh = rod(BEND_RADIUS * pi / 4, elements, order, radius=BEND_SECTION_RADIUS, modulus=BEND_MODULUS)
    space, natural = beam_space(mesh), arc(mesh.xi, 1 / BEND_RADIUS)
    beam = Beam(space, natural=natural)
    found, minimum = rest(beam, natural, dofs(space, 0), tip_load(space, (0, 0, BEND_LOAD)), tolerance=1e-8 * BEND_LOAD)
    return found.r[-1], beam.section_force(minimum.q)


@pytest.mark.parametrize(("elements", "order"), [(16, 1), (8, 2)])
def test_45_degree_bend(elements: int, order: int) -> None:
    assert bend(elements, order)[0] == pytest.approx(BEND_TIP, rel=HALF_PERCENT)


@pytest.mark.parametrize("order", ORDERS)
def test_order_of_convergence_of_the_bend(order: int) -> None:
    meshes = (8, 16, 32)
    assert observed_order([bend(n, order)[0][2] for n in meshes]) > DESIGN_ORDER[order]


@pytest.mark.parametrize("order", ORDERS)
def test_section_force_of_a_cantilever_is_its_dead_tip_load(order: int) -> None:
    """Statically determinate: the same force in every section, however the beam bends and was bent before."""
    _, force = bend(8, order)
    assert np.abs(force - [0.0, 0.0, BEND_LOAD]).max() < 1e-6 * BEND_LOAD


def linear_cantilever(space: BeamSpace, K: Floats, load: Floats) -> Floats:
    """(n_dofs,) small displacements under a load with the first node clamped."""
    free = np.setdiff1d(np.arange(space.n_dofs), dofs(space, 0))
    u = np.zeros(space.n_dofs)
    u[free] = np.linalg.solve(K[np.ix_(free, free)], load[free])
    return u


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("nu", POISSON)
def test_bending_does_not_lock_for_any_poisson_ratio(order: int, nu: float) -> None:
    """A small end couple turns the tip by M L / (E I) on any mesh: no Poisson locking, no shear locking."""
    R, L = 0.15, 8.0
    space, K = stiffness(rod(L, 5, order, radius=R, poisson=nu))
    couple = np.zeros(space.n_dofs)
    couple[dofs(space, -1, [1])] = -1.0, 0.0, 0.0  # a force -x on g1 = y is a moment of 1 N mm about z
    turn = -space.configuration(linear_cantilever(space, K, couple)).g1[-1, 0]
    assert turn == pytest.approx(L / bending_stiffness(R), rel=EXACT)


@pytest.mark.parametrize("nu", POISSON)
def test_small_deflection_of_a_cantilever_is_timoshenkos(nu: float) -> None:
    """P L^3 / (3 E I) + P L / (G A), the shear stress being uniform; exact at the nodes of quadratic elements.

    Linear elements with one point miss 1 / (4 n^2) of the bending part.
    """
    R, L, n = 0.15, 8.0, 5
    shear = L / (MODULUS / (2 * (1 + nu)) * pi * R**2)
    bending = L**3 / (3 * bending_stiffness(R))
    for order, missing in ((2, 0.0), (1, 1 / (4 * n**2))):
        space, K = stiffness(rod(L, n, order, radius=R, poisson=nu))
        load = tip_load(space, (0, 1, 0)).force
        deflection = space.configuration(linear_cantilever(space, K, load)).r[-1, 1]
        assert deflection == pytest.approx(bending * (1 - missing) + shear, rel=EXACT)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("nu", POISSON)
def test_small_torsion_is_coulombs_for_any_poisson_ratio(order: int, nu: float) -> None:
    """T = G J theta / L at both ends for a small twist; what is missing is of the order of theta^2 = 1e-6."""
    R, L, theta, n = 0.15, 3.0, 1e-3, 4
    mesh = rod(L, n, order, radius=R, poisson=nu)
    space, x = beam_space(mesh), initial_configuration(mesh).x.copy()
    x[-1, 1:] = x[-1, 1:] @ turned(theta, 0).T
    fixed = np.concatenate([dofs(space, 0), dofs(space, -1, [1, 2])])
    torque = MODULUS / (2 * (1 + nu)) * pi * R**4 / 2 * theta / L
    _, minimum = rest(Beam(space), Configuration(x), fixed, tolerance=1e-7 * torque)
    for node, sign in ((0, -1), (-1, 1)):
        assert moment(space, minimum, node) == pytest.approx([sign * torque, 0, 0], abs=1e-5 * torque)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("stretch", [0.7, 0.95, 1.2, 2.0])
@pytest.mark.parametrize("nu", POISSON)
def test_uniaxial_stretch_is_the_neo_hookean_closed_form(order: int, stretch: float, nu: float) -> None:
    """Lateral stress mu (t - 1/t) + lambda ln(s t^2) / t = 0 gives the lateral stretch t; N = A P(s, t)."""
    R, L = 0.15, 1.0
    mu = MODULUS / (2 * (1 + nu))
    lam = MODULUS * nu / ((1 + nu) * (1 - 2 * nu))
    t = brentq(lambda t: mu * (t - 1 / t) + lam * np.log(stretch * t * t) / t, 0.3, 2.0, xtol=1e-14)
    axial = pi * R**2 * (mu * (stretch - 1 / stretch) + lam * np.log(stretch * t * t) / stretch)

    mesh = rod(L, 3, order, radius=R, poisson=nu)
    space, x = beam_space(mesh), initial_configuration(mesh).x.copy()
    x[:, 0] *= stretch
    beam = Beam(space)
    across = np.concatenate([dofs(space, node, [0])[1:] for node in range(mesh.n_nodes)])  # no buckling
    ends = [dofs(space, end, [0]) for end in (0, -1)]
    found, minimum = rest(beam, Configuration(x), np.unique(np.concatenate([across, *ends])), tolerance=1e-12)
    assert space.configuration(minimum.gradient).r[-1] == pytest.approx([axial, 0, 0], abs=1e-9)
    assert beam.section_force(minimum.q) == pytest.approx(np.tile([axial, 0, 0], (3, 1)), abs=1e-9)
    assert np.linalg.norm(found.x[:, 1:], axis=2) == pytest.approx(np.full((mesh.n_nodes, 2), t), abs=1e-9)


@pytest.mark.parametrize("order", ORDERS)
def test_a_very_slender_cantilever_still_finds_its_equilibrium(order: int) -> None:
    """R/L = 0.001: the energy of bending is a millionth of what stretching would cost, and must keep its digits."""
    found = tip_of_elastica([0.0, 1.0, 0.0], 16, order, radius=1e-3)
    assert found.r[-1, 1] == pytest.approx(ELASTICA_CANTILEVER[1.0][1], rel=HALF_PERCENT)
