"""Laws of contact conductance against closed forms: Hertz's ellipse, Holm's constriction, films, a plane field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fabrics import fibrils_through, straight
from pressed import FILM, FORCE, FOUND, SIGMA, SPOT, STAR, E, R, force_of, per_touch, pressed
from scipy.special import ellipe, ellipk
from skfem import Basis, BilinearForm, ElementTriP2, LinearForm, MeshTri, condense, solve
from skfem.helpers import dot, grad

from circuittex.base.errors import DesignError
from circuittex.contact.conductance import PER_LENGTH, PER_TOUCH, Touches, film, in_series
from circuittex.contact.constriction import spot_of_ellipse, spot_of_strip
from circuittex.contact.ellipse import Ellipse, hertz_ellipse
from circuittex.contact.extract import contact_state
from circuittex.contact.patches import patch_of
from circuittex.contact.transition import LONG, LONGEST, SHORTEST, departure, straight_length
from circuittex.design import ContactLaw, MaterialPair
from circuittex.design.contact_laws import PROVIDED
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import initial_configuration

ROUND_OFF = 1e-12


# ---- Hertz ------------------------------------------------------------------------------------------------


def test_the_ellipse_satisfies_hertz_equations_by_complete_elliptic_integrals() -> None:
    """Johnson, Contact Mechanics, 1985, 4.26: A = p0 b (K - E) / (E* e^2 a^2), B = p0 b (E a^2/b^2 - K) / (E* e^2 a^2).

    A and B from the principal curvatures of the two cylinders, with the angle between their axes. K - E loses digits as
    e^2 -> 0, so angles are not those of near circles.
    """
    angle = np.radians([80.0, 60.0, 30.0, 10.0, 3.0])
    one, other, force = np.full(5, 0.1), np.full(5, 0.23), np.full(5, 0.02)
    long, short = hertz_ellipse(force, np.sin(angle), one, other, np.full(5, STAR))
    m = 1 - (short / long) ** 2
    K, second, peak = ellipk(m), ellipe(m), 1.5 * force / (np.pi * long * short)
    common = peak * short / (STAR * m * long**2)
    A, B = common * (K - second), common * (second * (long / short) ** 2 - K)
    curvature = 1 / one + 1 / other
    difference = np.sqrt(1 / one**2 + 1 / other**2 + 2 * np.cos(2 * angle) / (one * other))
    assert np.allclose(A + B, curvature / 2, rtol=1e-9, atol=0.0)
    assert np.allclose(B - A, difference / 2, rtol=1e-9, atol=0.0)


def test_a_long_ellipse_is_the_strip_of_its_load() -> None:
    """p = 3 F/(4 a) (1 - x^2/a^2) makes half-widths sqrt(4 R* p / (pi E*)), to the order of (b/a)^2 log(a/b)."""
    one = np.ones(1)
    long, short = hertz_ellipse(1e-3 * one, 1e-3 * one, one, 3 * one, one)
    assert short == pytest.approx(np.sqrt(4 * 0.75 * (0.75e-3 / long) / np.pi), rel=1e-3)


def test_conductances_of_one_crossing_by_hand() -> None:
    """Radius (3 F R/(4 E*))^(1/3) = R/10 at a right angle: sigma_c pi a^2, 2 sigma a, and both in series."""
    by_film, constriction = FILM * np.pi * SPOT**2, 2 * SIGMA * SPOT
    expected = {"crossed": by_film, "holm": constriction, "film": 1 / (1 / by_film + 1 / constriction)}
    for law, value in expected.items():
        assert pressed(law).conductance.sum() == pytest.approx(value, rel=FOUND)
    by_power = pressed("power", reference_conductance=3.0, reference_force=FORCE / 8, exponent=1 / 3)
    assert by_power.conductance.sum() == pytest.approx(6.0, rel=FOUND)


def test_a_strip_is_twice_the_paper() -> None:
    paper, strip = pressed("paper"), pressed("strip")
    assert np.array_equal(strip.conductance, 2 * paper.conductance)
    assert np.array_equal(strip.heat_conductance, 2 * paper.heat_conductance)


def test_heat_passes_through_the_area_of_the_touch() -> None:
    for law in ("crossed", "holm", "film"):
        assert pressed(law).heat_conductance.sum() == pytest.approx(0.1 * np.pi * SPOT**2, rel=FOUND)


# ---- What the penalty and the points must not change ------------------------------------------------------


@pytest.mark.parametrize("law", ["crossed", "holm"])
@pytest.mark.parametrize("angle", [90.0, 30.0])
def test_under_a_given_force_the_penalty_does_not_matter(law: str, angle: float) -> None:
    """P* from 1/4 to 16 times Hertz's, E*/2; below 2 % is asked for."""
    total = [pressed(law, angle=angle, penalty=factor * STAR / 2).conductance.sum() for factor in (0.25, 1.0, 16.0)]
    assert total == pytest.approx([total[1]] * 3, rel=FOUND)


def test_with_the_strip_it_does() -> None:
    """G goes with P*^(-1/6) (docs/model.md): the test above can fail."""
    soft, hard = (pressed("strip", penalty=factor * STAR / 2, points=800) for factor in (0.25, 16.0))
    assert soft.conductance.sum() / hard.conductance.sum() == pytest.approx(64 ** (1 / 6), rel=0.02)


@pytest.mark.parametrize("law", ["crossed", "holm"])
@pytest.mark.parametrize("penalty", [STAR / 8, 8 * STAR])
def test_under_a_given_force_the_number_of_points_does_not_matter(law: str, penalty: float) -> None:
    """From 4 to 64 points of either fibril across the touch; with a single one its length is hardly known: 0.5 %."""
    every = [(wanted, pressed(law, **per_touch(wanted, penalty))) for wanted in (1, 4, 8, 64)]
    for wanted, state in every:
        assert abs(np.count_nonzero(state.fibril_a == 0) - wanted) <= max(1, wanted / 4)
    total = [state.conductance.sum() for _, state in every]
    assert total[1:] == pytest.approx([total[-1]] * 3, rel=FOUND)
    assert total[0] == pytest.approx(total[-1], rel=0.005)


def test_points_conduct_in_proportion_to_what_they_carry() -> None:
    state = pressed("holm", points=400)
    carried = state.line_load * state.weight
    assert state.conductance / carried == pytest.approx(np.full(len(carried), 2 * SIGMA * SPOT / FORCE), rel=FOUND)


def test_two_touches_of_one_pair_are_two() -> None:
    """A wave over a straight fibril touches it at three crests: each is a touch with a third of the force."""
    x = np.linspace(0.0, 6.0, 121)
    wave = np.stack([x, 0 * x, 0.3 + 0.29 - 0.3 * np.cos(2 * np.pi * (x - 1.0) / 2.0)], axis=1)
    mesh = fibrils_through([straight([0, 0, 0], [6, 0, 0], 120), wave], radius=R, modulus=E)
    at = initial_configuration(mesh)
    power = {"law": "power", "reference_conductance": 1.0, "reference_force": 1.0, "exponent": 0.5}
    state = contact_state(mesh, at, ContactLaw(5.0, FILM, 0.1, **power), per_element=4)  # type: ignore[arg-type]
    assert state.conductance.sum() == pytest.approx(3 * np.sqrt(force_of(state) / 3), rel=1e-6)


def test_points_of_one_touch_follow_one_another_on_both_fibrils() -> None:
    """A coil over a fibril: at the same place of one, but of the other a turn apart."""
    xi = np.array([[0.0, 0.0], [0.1, 0.1], [0.05, 3.0], [0.1, 3.1], [0.2, 0.2]])
    assert patch_of(np.zeros(5, dtype=int), xi, np.full(5, 0.1)).tolist() == [0, 0, 1, 1, 0]
    assert patch_of(np.array([0, 1, 0]), np.zeros((3, 2)), np.ones(3)).tolist() == [0, 1, 0]


# ---- Crossings and long parallel touches ------------------------------------------------------------------


def test_parallel_fibrils_touch_in_a_strip() -> None:
    """Length l, half-width b = sqrt(4 R* F / (pi E* l)): sigma_c 2 b l; and the constriction of two cylinders."""
    length = 4.0
    half = np.sqrt(4 * (R / 2) * FORCE / (np.pi * STAR * length))
    area = pressed("crossed", angle=0.0, length=length).conductance.sum()
    assert area == pytest.approx(FILM * 2 * half * length, rel=FOUND)
    spread = 2 * (np.log(2 * R / half) + 1 / 8) / (np.pi * SIGMA * length)
    assert pressed("holm", angle=0.0, length=length).conductance.sum() == pytest.approx(1 / spread, rel=FOUND)


def test_the_part_of_a_strip_is_continuous_and_monotone() -> None:
    """Of a touch 20 R long under a given force: along a bent fibril, with its axis at a right angle, it is a strip; at
    the angles for which that is the length it is a crossing; and parallel fibrils have a strip."""
    angle = np.radians(np.geomspace(90.0, 1e-4, 4001))
    one = np.ones(len(angle))
    straight = straight_length(FORCE * one, np.sin(angle), 2 * R * one, STAR / 2 * one)
    shorter, part = departure(20 * R * one, 0 * one, straight)
    crossing = np.flatnonzero(part == 0.0)
    assert part[[0, -1]].tolist() == [1.0, 1.0]
    assert np.all(np.diff(part[: crossing[0] + 1]) <= 0.0)
    assert np.all(part[crossing[0] : crossing[-1]] == 0.0)
    assert np.all(np.diff(part[crossing[-1] :]) >= 0.0)
    times = 20 * R / straight  # from step to step by 0.23 %
    assert times[crossing[[0, -1]]] == pytest.approx([LONG, 1.0], rel=0.003)
    assert times[np.flatnonzero(part < 1.0)[[0, -1]]] == pytest.approx([LONGEST, 1 / SHORTEST], rel=0.003)
    steepest = 1.5 / np.log(LONGEST / LONG)  # of y^2 (3 - 2 y), in log x
    assert np.abs(np.diff(part)).max() <= steepest * np.abs(np.diff(np.log(times))).max() * (1 + ROUND_OFF)
    assert np.all(np.diff(shorter) >= 0.0)


@pytest.mark.parametrize("law", ["crossed", "holm"])
def test_from_crossing_to_parallel_nothing_jumps(law: str) -> None:
    """Fibrils 20 R long: steps of the angle by a factor change the conductance by less than the same factor."""
    step = 20 ** (1 / 10)
    found = [pressed(law, angle=0.2 / step**k, length=20 * R, points=60).conductance.sum() for k in range(11)]
    assert np.abs(np.diff(np.log(found))).max() < np.log(step)


@pytest.mark.parametrize("law", ["crossed", "holm"])
def test_more_force_conducts_better_all_the_way_from_crossing_to_strip(law: str) -> None:
    """The touch of fibrils 20 R long at 0.04 degrees becomes a strip as it is pressed, with Hertz's penalty."""
    forces = FORCE * np.geomspace(0.01, 20, 10)
    found = [pressed(law, angle=0.04, force=F, length=20 * R, points=60).conductance.sum() for F in forces]
    assert np.all(np.diff(found) > 0.0)


def test_straight_fibrils_touch_over_the_straight_length() -> None:
    """What tells a crossing is measured right: 6/5 (∫ p)^2 / ∫ p^2 of a crossing is its length, at any angle."""
    for angle in (90.0, 20.0):
        state = pressed("crossed", angle=angle, points=400)
        carried = state.line_load * state.weight
        length = 1.2 * carried.sum() ** 2 / np.sum(carried * state.line_load)
        one = np.ones(1)
        expected = straight_length(FORCE * one, np.sin(np.radians(angle)) * one, 2 * R * one, STAR / 2 * one)
        assert length == pytest.approx(expected[0], rel=0.01)  # overlaps of R/100


# ---- Constriction -----------------------------------------------------------------------------------------


def test_a_strip_on_a_cylinder_against_a_plane_field() -> None:
    """Finite elements on the section: 0 on the strip, an even source inside; their mean potential over the current.

    The closed form is for narrow strips: it errs by the order of (b/R)^2.
    """
    half = 0.2
    mesh = MeshTri.init_circle(4)
    for _ in range(3):
        x, y = mesh.p[:, mesh.t].mean(axis=1)
        mesh = mesh.refined(np.flatnonzero(np.hypot(np.hypot(x - 1, y), half) < 2 * half))
    basis = Basis(mesh, ElementTriP2())
    stiffness = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis)
    load = LinearForm(lambda v, w: 1.0 * v).assemble(basis)
    x, y = basis.doflocs
    edge = basis.get_dofs().flatten()
    u = solve(*condense(stiffness, load, D=edge[(np.abs(y[edge]) < np.sin(half)) & (x[edge] > 0)]))
    one = np.ones(1)
    assert 1 / (4 * spot_of_strip(one, half * one, one)) == pytest.approx(load @ u / load.sum() ** 2, rel=0.02)


def test_ellipses_constrict_as_holm_has_it() -> None:
    """Circle: a. Long ellipses: pi/2 a / ln(4 a/b) (Holm, Electric Contacts, 1967, section 3)."""
    one = np.ones(1)
    assert spot_of_ellipse(Ellipse(one, one)) == pytest.approx(1.0, rel=ROUND_OFF)
    assert spot_of_ellipse(Ellipse(one, 1e-4 * one)) == pytest.approx(np.pi / 2 / np.log(4e4), rel=1e-6)


def test_an_insulating_fibril_takes_no_current_by_any_law() -> None:
    lines = [straight([-1, 0, 0], [1, 0, 0], 40), straight([0, -1, 0.29], [0, 1, 0.29], 40)]
    mesh = fibrils_through(lines, sigma=[0.0, 10.0])
    at = initial_configuration(mesh)
    constants = {"reference_conductance": 1.0, "reference_force": 1.0, "exponent": 0.5}
    for law in PROVIDED:
        state = contact_state(mesh, at, ContactLaw(5.0, 1.0, 0.1, law=law, **constants), per_element=4)  # type: ignore[arg-type]
        assert np.all(state.conductance == 0.0)
        assert state.heat_conductance.sum() > 0.0


def test_different_bulks_constrict_in_series() -> None:
    lines = [straight([-1, 0, 0], [1, 0, 0], 40), straight([0, -1, 0.29], [0, 1, 0.29], 40)]
    law = ContactLaw(5.0, 1.0, 0.1, law="holm")
    one, other, both = (
        contact_state(mesh, initial_configuration(mesh), law, per_element=4).conductance.sum()
        for mesh in (fibrils_through(lines, sigma=sigma) for sigma in ([10.0, 10.0], [0.1, 0.1], [10.0, 0.1]))
    )
    assert both == pytest.approx(2 / (1 / one + 1 / other), rel=ROUND_OFF)


# ---- Choice, scale, one's own -----------------------------------------------------------------------------


def test_every_law_that_a_design_can_name_is_there() -> None:
    assert {*PER_LENGTH, *PER_TOUCH} >= set(PROVIDED)


def three_materials() -> FibrilMesh:
    """Three fibrils of two materials, all touching: a on top of b, b on top of the other a."""
    lines = [straight([-1, y, 0], [1, y, 0], 40) for y in (-0.5, 0.5)] + [straight([0, -1, 0.29], [0, 1, 0.29], 40)]
    return replace(fibrils_through(lines), material=np.array([0, 1, 0]), material_names=("a", "b"))


def test_each_pair_of_materials_has_its_law() -> None:
    mesh = three_materials()
    at = initial_configuration(mesh)
    pair = MaterialPair(5.0, 0.3, 0.1, ("b", "a"), law="holm")
    mixed = contact_state(mesh, at, ContactLaw(5.0, 0.3, 0.1, (pair,), law="crossed"), per_element=4)
    holm, crossed = (
        contact_state(mesh, at, ContactLaw(5.0, 0.3, 0.1, law=law), per_element=4) for law in ("holm", "crossed")
    )
    with_b = (mixed.fibril_a == 1) | (mixed.fibril_b == 1)
    assert np.array_equal(mixed.conductance, np.where(with_b, holm.conductance, crossed.conductance))
    assert 0 < np.count_nonzero(with_b) < len(with_b)


def test_lengths_and_moduli_of_another_scale_have_the_same_digits() -> None:
    """Lengths times 2^-7, moduli times 2^5: areas go with the square of lengths, spots with lengths, bit for bit."""
    lines = [straight([-1, 0, 0], [1, 0.2, 0], 40), straight([0, -1, 0.29], [0.3, 1, 0.29], 40)]
    s, m = 2.0**-7, 2.0**5
    for law, power in (("crossed", 2), ("holm", 1), ("strip", 2)):
        found = []
        for by, stiffer in ((1.0, 1.0), (s, m)):
            mesh = fibrils_through([by * line for line in lines], radius=[0.15 * by, 0.16 * by], modulus=10.0 * stiffer)
            contact = ContactLaw(5.0 * stiffer, 0.3, 0.1, law=law)
            found.append(contact_state(mesh, initial_configuration(mesh), contact, per_element=4).conductance)
        assert np.array_equal(found[1], found[0] * s**power)


def test_a_law_that_nobody_knows_is_refused_before_any_work() -> None:
    mesh = three_materials()
    with pytest.raises(DesignError, match=r"contact\.law: 'soldering' .* the laws known here are 'paper'"):
        contact_state(mesh, initial_configuration(mesh), ContactLaw(5.0, 0.3, 0.1, law="soldering"), per_element=4)


def test_the_law_power_asks_for_its_constants() -> None:
    with pytest.raises(
        DesignError, match=r"contact\.reference_force: 0\.0 .* must be > 0 where contact\.law is 'power'"
    ):
        ContactLaw(5.0, 0.3, 0.1, law="power", reference_conductance=1.0, exponent=0.5)


def test_the_film_law_has_both_limits() -> None:
    """Much film: the film alone; no film to speak of: the constriction alone."""
    one = np.ones(1)
    told = dict.fromkeys(("force", "sine", "length", "radius_a", "radius_b", "modulus", "exponent"), one)
    told |= dict.fromkeys(("reference_conductance", "reference_force"), one)
    for sigma_c in (1e-9, 1e9):
        touches = Touches(**told, area=3 * one, spot=0.5 * one, bulk_a=one, bulk_b=3 * one, film=sigma_c * one)
        assert film(touches) == pytest.approx(min(3 * sigma_c, 4 * 0.5 * 0.75), rel=1e-8)
    assert in_series(one, 0 * one) == 0.0
