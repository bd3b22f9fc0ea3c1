"""Every minimum of the distance counts, less the maxima between: against polynomial roots, closed forms and limits."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import groupby, pairwise

import numpy as np
import pytest
from fabrics import contact_term, fibrils_through, reference_curve, renumbered, straight, tangle
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.optimize import brentq, minimize_scalar
from test_contact_kernel import assembled, forces

from circuittex.base.arrays import Floats
from circuittex.contact.extract import contact_state
from circuittex.contact.penalty import PenaltyContact
from circuittex.contact.share import share, shares
from circuittex.contact.state import ContactState
from circuittex.design import ContactLaw
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.pattern import multiply

P, R = 5.0, 0.15
LAW = ContactLaw(P, 0.01, 0.1)


def crumpled(seed: int, *, fibrils: int = 4, order: int = 1) -> FibrilMesh:
    """Fibrils bent far tighter than R + R', with several minima and maxima from many points, their own included."""
    return tangle(seed, fibrils=fibrils, elements=12 // order, order=order, noise=0.12, radius=0.25)


def stationary(x: Floats, mesh: FibrilMesh, fibril: int) -> list[tuple[float, float, float]]:
    """(position, distance, sign) of every minimum (1) and maximum (-1) of the distance from x, by polynomial roots.

    Ends count where they are minima.
    """
    curve = reference_curve(mesh, mesh.position, fibril)
    places = []
    n = len(curve.x) - 1
    for k in range(n):
        piece = [Polynomial(curve.c[::-1, k, c]) for c in range(3)]
        slope = sum(((y - xc) * y.deriv() for y, xc in zip(piece, x, strict=True)), Polynomial([0.0]))
        # A double root is no place; a simple one has an imaginary part of round-off at the most.
        roots = [root.real for root in slope.roots() if abs(root.imag) < 1e-9 and 0.0 <= root.real < 1.0]
        places += [(k + root, np.sign(slope.deriv()(root))) for root in roots]
    start, stop = ((curve(s) - x) @ curve(s, 1) for s in (0.0, float(n)))
    places += [(0.0, 1.0)] * bool(start > 0) + [(float(n), 1.0)] * bool(stop < 0)
    return [(s, float(np.linalg.norm(curve(s) - x)), sign) for s, sign in sorted(places)]


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1), order=st.sampled_from([1, 2]))
def test_all_places_are_found_and_no_other(seed: int, order: int) -> None:
    mesh = crumpled(seed, fibrils=3, order=order)
    term, q = contact_term(mesh, per_element=1)
    found, table = term.touching(q), term.table
    for a, f in enumerate(table.fibril):
        k = a - table.first_interval[f]
        for t in term.points[k % len(term.points)]:
            if t < 0:
                continue
            x = reference_curve(mesh, mesh.position, f)(k + t)
            for g in range(mesh.n_fibrils):
                expected = [p for p in stationary(x, mesh, g) if p[1] < 0.5 and (f != g or abs(p[0] - k - t) > 1e-7)]
                rows = np.flatnonzero((found.interval_a == a) & (found.t_a == t) & (found.fibril_b == g))
                rows = rows[np.argsort(found.position_b[rows])]
                assert found.sign[rows].tolist() == [sign for _, _, sign in expected]
                # Where a minimum and a maximum are close, the distance is flat and the root of half its digits.
                assert found.position_b[rows] == pytest.approx([s for s, _, _ in expected], abs=1e-6)
                assert 0.5 - found.overlap[rows] == pytest.approx([d for _, d, _ in expected], abs=1e-12)


CASES = [crumpled(seed, order=order) for seed, order in ((0, 1), (1, 2), (5, 1))]


def test_the_cases_have_maxima_and_touch_themselves() -> None:
    for mesh in CASES:
        term, q = contact_term(mesh)
        found = term.touching(q)
        own = term.table.fibril[found.interval_a] == found.fibril_b
        assert np.count_nonzero(found.sign < 0) > 20
        assert np.count_nonzero(own & (found.sign > 0)) > 20


@pytest.mark.parametrize("mesh", CASES)
def test_gradient_is_the_slope_of_the_energy(mesh: FibrilMesh) -> None:
    term, q = contact_term(mesh, penalty=P)
    _, gradient, _, _ = assembled(term, q)
    rng = np.random.default_rng(0)
    step = 1e-7  # the energy's second derivative has no bound: small, so that its change matters little
    for _ in range(10):
        direction = rng.normal(size=len(q))
        slope = (term.energy(q + step * direction) - term.energy(q - step * direction)) / (2 * step)
        assert slope == pytest.approx(gradient @ direction, abs=1e-6 * np.abs(gradient).sum())


@pytest.mark.parametrize("mesh", CASES)
def test_tangent_is_the_slope_of_the_gradient(mesh: FibrilMesh) -> None:
    term, q = contact_term(mesh, penalty=P)
    _, _, pattern, data = assembled(term, q)
    rng = np.random.default_rng(1)
    step = 1e-8  # so small that no minimum appears or vanishes in between; round-off 1e-8 of the forces
    for _ in range(10):
        direction = rng.normal(size=len(q))
        ahead, behind = (assembled(term, q + s * direction)[1] for s in (step, -step))
        product = multiply(pattern, data, direction)
        assert np.abs((ahead - behind) / (2 * step) - product).max() < 1e-6 * np.abs(product).max()


@given(seed=st.integers(0, 2**32 - 1), order=st.sampled_from([1, 2]))
def test_forces_and_moments_sum_to_zero(seed: int, order: int) -> None:
    mesh = crumpled(seed, order=order)
    _, force = forces(mesh)
    size = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() <= 1e-13 * size
    # The lever d x n vanishes as well as the place is found: to half the digits where the distance is flat.
    assert np.abs(np.cross(mesh.position, force).sum(axis=0)).max() <= 1e-9 * size


@given(seed=st.integers(0, 2**32 - 1), place=st.permutations(range(4)), flip=st.sets(st.integers(0, 3)))
def test_renumbering_and_reversing_fibrils_changes_nothing(seed: int, place: Sequence[int], flip: set[int]) -> None:
    mesh = crumpled(seed)
    other, node = renumbered(mesh, place, sorted(flip))
    (energy, force), (same_energy, same_force) = forces(mesh), forces(other)
    assert same_energy == pytest.approx(energy, rel=1e-11)
    assert np.abs(same_force - force[node]).max() <= 1e-6 * np.abs(force).max()  # forces at a fold: half the digits


@given(seed=st.integers(0, 2**32 - 1))
def test_moving_and_turning_the_whole_changes_nothing(seed: int) -> None:
    mesh = crumpled(seed)
    turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    lines = [mesh.position[mesh.first_node[f] : mesh.first_node[f + 1]] @ turn.T + 3.0 for f in range(4)]
    (energy, force), (same_energy, same_force) = forces(mesh), forces(fibrils_through(lines, radius=0.25))
    assert same_energy == pytest.approx(energy, rel=1e-11)
    assert np.abs(same_force - force @ turn.T).max() <= 1e-6 * np.abs(force).max()


def hairpin(radius: float, legs: float, bend: int) -> Floats:
    """Equally spaced nodes along a leg at y = -radius, half a circle around the origin (`bend` intervals) and a leg at
    y = radius; the legs are about `legs` long."""
    step = np.pi * radius / bend
    leg = step * np.arange(-round(legs / step), 1)
    angle = np.linspace(-np.pi / 2, np.pi / 2, bend + 1)[1:-1]
    return np.concatenate(
        [
            np.stack([leg, 0 * leg - radius, 0 * leg], axis=1),
            np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1),
            np.stack([leg[::-1], 0 * leg + radius, 0 * leg], axis=1),
        ]
    )


def with_hairpin(line: Floats, other: Floats) -> FibrilMesh:
    """A hairpin whose natural length is that of as many intervals as it has, and another fibril."""
    intervals = len(line) - 1
    return fibrils_through(
        [line, other],
        radius=R,
        length=[intervals * np.linalg.norm(line[1] - line[0]), np.linalg.norm(other[-1] - other[0])],
    )


FAR = straight([9, 0, 0], [10, 0, 0], 4)


def state_of(mesh: FibrilMesh, per_element: int = 4) -> ContactState:
    return contact_state(mesh, initial_configuration(mesh), LAW, per_element=per_element)


def test_both_legs_of_a_hairpin_press_a_fibril_between_them() -> None:
    """P o L = 0.2 N on each, and a little from where the hairpin's points reach around the straight fibril's ends."""
    apart, half = 0.28, 1.0
    mesh = with_hairpin(hairpin(apart, 6.0, 18), straight([-half - 3.0, 0, 0], [half - 3.0, 0, 0], 40))
    state = state_of(mesh)
    force = state.line_load * state.weight
    on_hairpin = np.where(state.fibril_a == 0, state.xi_a, state.xi_b)
    lower, upper = (force[side].sum() for side in (on_hairpin < mesh.length[0] / 2, on_hairpin > mesh.length[0] / 2))
    # At s beyond an end the distance is sqrt(apart^2 + s^2); both ends, with the half weight of one side.
    beyond = np.sqrt(4 * R**2 - apart**2)
    at_ends = 2 * R * beyond - (2 * R * beyond + apart**2 * np.arcsinh(beyond / apart)) / 2
    expected = P * ((2 * R - apart) * 2 * half + at_ends)
    # Midpoint rule with spacing w: w^2 / 8 times the jump of slope where contact ends, beyond / 2 R, at both ends.
    w = mesh.length[0] / (mesh.first_node[1] - 1) / 4
    assert abs(lower - expected) < 2 * P * w**2 / 8 * beyond / (2 * R)
    assert upper == pytest.approx(lower, rel=1e-12)
    _, gradient = forces(mesh)
    assert np.abs(gradient[mesh.first_node[1] :, 1:].sum(axis=0)).max() < 1e-12


def coil(turns: int, pitch: float, radius: float, n: int) -> FibrilMesh:
    """A helix of n intervals a turn, and a fibril far away."""
    t = np.linspace(0.0, 2 * np.pi * turns, n * turns + 1)
    line = np.stack([radius * np.cos(t), radius * np.sin(t), pitch * t / (2 * np.pi)], axis=1)
    return fibrils_through([line, straight([9, 0, 0], [10, 0, 0], 4)], radius=R)


def test_the_turns_of_a_coil_touch() -> None:
    """From a point the distance to angle t is sqrt((2 a sin(t/2))^2 + (h t / 2 pi)^2), smallest near a whole turn."""
    pitch, radius, n = 0.27, 0.7, 48
    nearest = minimize_scalar(
        lambda t: (2 * radius * np.sin(t / 2)) ** 2 + (pitch * t / (2 * np.pi)) ** 2,
        bounds=(1.5 * np.pi, 2.5 * np.pi),
        method="bounded",
        options={"xatol": 1e-12},
    )
    assert np.sqrt(nearest.fun) < 2 * R
    term, q = contact_term(coil(3, pitch, radius, n), per_element=2)
    found = term.touching(q)
    at = found.interval_a + found.t_a
    inside = (found.position_b > 0) & (found.position_b < 3 * n)
    assert np.all(found.sign == 1.0)
    assert set(np.unique(at, return_counts=True)[1].tolist()) == {1, 2}
    # A point has a turn above it unless that is beyond the end, and one below likewise; two points an interval.
    whole_turn = n * nearest.x / (2 * np.pi)
    assert np.count_nonzero(inside) == pytest.approx(2 * 2 * (3 * n - whole_turn), abs=2 * 2)
    # Tangents too short by h^2/6 bring a chord's middle a h^4/48 nearer to the axis; the ends are parabolas.
    inner = (np.minimum(at, found.position_b) > 2) & (np.maximum(at, found.position_b) < 3 * n - 2)
    error = np.abs(2 * R - found.overlap[inner] - np.sqrt(nearest.fun)).max()
    assert error < 2 * radius * (2 * np.pi / n) ** 4 / 48


def test_a_gentle_bend_does_not_touch_itself() -> None:
    """Half circles of any radius above R, however fine the mesh: opposite legs are more than 2 R apart."""
    for radius in (1.01 * R, 0.3, 2.0):
        mesh = with_hairpin(hairpin(radius, 1.0, 24), FAR)
        assert state_of(mesh).n_contacts == 0


def test_legs_closer_than_two_radii_press_one_another() -> None:
    """The line load far from the bend is P (2 R - 2 y); into the bend it fades away."""
    y = 0.12
    line = hairpin(y, 2.0, 9)
    mesh = with_hairpin(line, FAR)
    _, gradient = forces(mesh)
    leg = (mesh.position[:, 0] < -1.0) & (mesh.position[:, 0] > -1.5) & (mesh.position[:, 1] < 0)
    piece = np.linalg.norm(line[1] - line[0])  # what a node stands for
    assert gradient[leg, 1] == pytest.approx(piece * P * (2 * R - 2 * y), rel=1e-9)
    state = state_of(mesh)
    far = np.abs(state.xi_a - mesh.length[0] / 2)
    # In the bend itself nothing touches; the load sets in where the leg does, at pi y / 2 from the middle, and grows.
    load = state.line_load * state.weight
    bins = [load[(far > f) & (far < f + 0.1)].sum() for f in np.pi * y / 2 + 0.1 * np.arange(3)]
    assert np.all(load[far < 0.9 * np.pi * y / 2] < bins[0] / 10)
    assert bins[0] < bins[1]
    assert bins[1] == pytest.approx(bins[2], rel=0.2)


BEND = hairpin(0.2, 1.2, 6)
BEND = BEND + 1e-3 * np.sin(np.arange(BEND.size)).reshape(BEND.shape)
"""A bend tighter than 2 R, with nothing symmetrical about it."""


def through_the_bend(x: float) -> tuple[PenaltyContact, Floats]:
    """A short fibril across the plane of the bend, pushed into it from between the legs."""
    across = straight([x, 0.013, -0.32], [x, 0.013, 0.31], 4)
    return contact_term(fibrils_through([BEND, across], radius=R), penalty=P, per_element=2)


def pattern_of_signs(x: float) -> tuple[float, ...]:
    term, q = through_the_bend(x)
    return tuple(term.touching(q).sign.tolist())


@cache
def changes() -> list[float]:
    """Places where minima or maxima within reach appear or vanish, by bisection."""
    grid = np.linspace(-0.12, 0.06, 120)
    known = [pattern_of_signs(x) for x in grid]
    found = []
    for (a, before), (b, after) in pairwise(zip(grid.tolist(), known, strict=True)):
        if before != after:
            found.append(
                brentq(lambda x, before=before: 1.0 if pattern_of_signs(x) == before else -1.0, a, b, xtol=1e-12)
            )
    return found


def test_energy_and_forces_are_continuous_where_minima_appear_and_vanish() -> None:
    """Across every change of the number of places, at distances h: energy differs by O(h), forces by O(sqrt h)."""
    kinds = set()
    for x in changes():
        jumps = []
        for h in (1e-6, 1e-8, 1e-10):
            (ea, fa, *_), (eb, fb, *_) = (assembled(*through_the_bend(x + s * h)) for s in (-1, 1))
            jumps.append((abs(ea - eb), np.abs(fa - fb).max()))
        ahead, behind = (len(pattern_of_signs(x + s * 1e-9)) for s in (1, -1))
        kinds.add(np.sign(ahead - behind))
        force = np.abs(assembled(*through_the_bend(x))[1]).max()
        assert jumps[2][0] < 1e-10  # N mm; 2 h times the force of the whole
        assert jumps[2][1] < 1e-4 * force
        assert jumps[2][1] < 1e-1 * jumps[0][1] + 1e-12  # four decades of h: a factor of 100 or more
    assert kinds == {-1, 1}


def test_some_of_these_changes_are_inside_the_reach() -> None:
    """Pairs of a minimum and a maximum that appear with an overlap of 0.05 mm or more: it would be a jump of energy."""
    inside = 0
    for x in changes():
        here = [term.touching(q) for term, q in map(through_the_bend, (x - 1e-9, x + 1e-9))]
        few, many = sorted(here, key=lambda found: len(found.sign))
        new = set(many.overlap.round(6).tolist()) - set(few.overlap.round(6).tolist())
        inside += len(many.sign) - len(few.sign) == 2 and bool(new) and min(new) > 0.05
    assert inside >= 3


def test_tangent_beside_a_change() -> None:
    """A millionth of the radius beside places where a minimum appears within reach the tangent is exact."""
    for x in changes()[::3]:
        for side in (-1, 1):
            term, q = through_the_bend(x + side * 1e-6 * R)
            _, _, pattern, data = assembled(term, q)
            direction = np.random.default_rng(2).normal(size=len(q))
            step = 1e-10  # a thousandth of the way; round-off of forces over it 1e-5
            ahead, behind = (assembled(term, q + s * direction)[1] for s in (step, -step))
            product = multiply(pattern, data, direction)
            assert np.abs((ahead - behind) / (2 * step) - product).max() < 1e-3 * np.abs(product).max()


overlaps = st.lists(st.floats(0.01, 1.0), min_size=1, max_size=5)


@given(tops=overlaps, saddles=st.lists(st.floats(0.001, 1.0), min_size=4, max_size=4))
def test_parts_add_up_and_are_fractions(tops: list[float], saddles: list[float]) -> None:
    """Overlaps times parts: those of the minima less those of the maxima."""
    overlap, sign = [tops[0]], [1.0]
    for before, top, depth in zip(tops, tops[1:], saddles, strict=False):
        overlap += [depth * min(before, top), top]
        sign += [-1.0, 1.0]
    o, s = np.array(overlap), np.array(sign)
    part = share(o, s)
    assert part @ o == pytest.approx(s @ o, rel=1e-12)
    assert np.all(part >= 0.0)
    assert np.all(part <= 1.0 + 1e-12)
    if np.diff(np.sort(o[s < 0])).min(initial=1.0) > 1e-6:  # of equal maxima the first is joined first
        assert share(o[::-1], s[::-1])[::-1] == pytest.approx(part, rel=1e-6, abs=1e-9)


def test_parts_at_birth_at_a_tie_and_apart() -> None:
    small = 1e-9
    assert share(np.array([0.3, 0.1, 0.1 + small]), np.array([1, -1, 1])) == pytest.approx([1, 0, 0], abs=1e-6)
    assert share(np.array([0.3, small, 0.2]), np.array([1, -1, 1])) == pytest.approx([1, 0, 1], abs=1e-6)
    assert share(np.array([0.3, 0.15, 0.3]), np.array([1, -1, 1])) == pytest.approx([0.75, 0, 0.75], rel=1e-12)
    # Beside the contact point itself there is one minimum only: it pays for the whole of the maximum.
    assert share(np.array([0.1, 0.2]), np.array([-1, 1])) == pytest.approx([0, 0.5], rel=1e-12)


def test_conductances_add_up_continuously_through_a_change() -> None:
    for x in changes()[::4]:
        total = []
        for s in (-1, 1):
            across = straight([x + s * 1e-9, 0.013, -0.32], [x + s * 1e-9, 0.013, 0.31], 4)
            total.append(state_of(fibrils_through([BEND, across], radius=R), 2).conductance.sum())
        assert total[0] == pytest.approx(total[1], rel=1e-3)  # sqrt of the overlap at 1e-9: 1e-4


def test_rows_of_a_state_are_the_minima() -> None:
    mesh = CASES[0]
    term, q = contact_term(mesh, penalty=P)
    found, state = term.touching(q), state_of(mesh)
    part = shares(found, term.table)
    assert np.all(part[found.sign < 0] == 0.0)
    assert state.n_contacts == np.count_nonzero(part)
    force = P * term.weight[term.table.fibril[found.interval_a]] * found.overlap * found.sign
    keys = zip(found.interval_a.tolist(), found.t_a.tolist(), found.fibril_b.tolist(), strict=True)
    groups = [len(list(rows)) for _, rows in groupby(keys)]
    assert max(groups) >= 3
    assert (state.line_load * state.weight).sum() == pytest.approx(force.sum(), rel=1e-12)
