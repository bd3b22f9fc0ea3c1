"""No motion that is called safe leads fibrils through one another, and what passes nobody is not limited."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fabrics import contact_term, fibrils_through, reference_curve, renumbered, small_cell, straight, tangle
from hypothesis import example, given, settings
from hypothesis import strategies as st

from circuittex.base.arrays import Floats
from circuittex.base.errors import PenetrationError
from circuittex.contact.curve import curve_table
from circuittex.contact.passing import (
    CHORDS,
    CLOSEST,
    COLLISION,
    NEIGHBOURS,
    SafeStep,
    chords,
    clearance,
    free_motion,
    safe_step,
    segment_distance,
)
from circuittex.design import ContactLaw
from circuittex.geometry import overlap
from circuittex.geometry.mesh import FibrilMesh
from circuittex.relaxation.relax import relax

R = 0.15
ROUND_OFF = 1e-12
TIMES = 60  # moments at which the brute-force check looks

seeds = st.integers(0, 2**32 - 1)


def step(mesh: FibrilMesh, motion: Floats) -> SafeStep:
    return safe_step(curve_table(mesh), mesh.radius, mesh.position, motion)


def crossing(gap: float, *, elements: int = 6) -> FibrilMesh:
    """A fibril along x, and one along y that lies `gap` above it."""
    return fibrils_through([straight([-1, 0, 0], [1, 0, 0], elements), straight([0, -1, gap], [0, 1, gap], elements)])


def lowered(mesh: FibrilMesh, by: float) -> Floats:
    """(N, 3) the motion of the second fibril alone, downwards."""
    return (mesh.node_fibril == 1)[:, None] * np.array([0.0, 0.0, -by])


def curl(gap: float) -> FibrilMesh:
    """One fibril that goes along x, turns round, and comes back along y, `gap` above itself where it crosses."""
    turn = np.linspace(-np.pi / 2, np.pi, 25)[1:-1]
    arc = np.column_stack([1.0 + np.cos(turn), 1.0 + np.sin(turn), gap * (turn / np.pi + 0.5) / 1.5])
    return fibrils_through(
        [np.vstack([straight([-1, 0, 0], [1, 0, 0], 10), arc, straight([0, 1, gap], [0, -1, gap], 10)])]
    )


def chord_distances(mesh: FibrilMesh, r: Floats) -> tuple[Floats, Floats]:
    """Distances of all chords but neighbours, by the code that judges starts, and the pairs' fibrils (n, 2).

    Which of one fibril are neighbours is told by the start, that of the mesh.
    """
    table = curve_table(mesh)
    points, start = chords(table, r), chords(table, mesh.position)
    p, q = points[:, :-1].reshape(-1, 3), points[:, 1:].reshape(-1, 3)
    fibril = np.repeat(table.fibril, CHORDS)
    behind = np.cumsum(np.linalg.norm(np.diff(start, axis=1), axis=2).ravel())
    before = np.concatenate([[0.0], behind[:-1]])
    apart = before[None, :] - behind[:, None] >= NEIGHBOURS * mesh.radius[fibril][:, None]
    i, j = np.nonzero((fibril[:, None] < fibril) | ((fibril[:, None] == fibril) & apart))
    return overlap.segment_distance(p[i], q[i], p[j], q[j]), np.column_stack([fibril[i], fibril[j]])


# ---- the pieces -------------------------------------------------------------------------------------------


@given(seeds, st.sampled_from([1.0, 1e-3, 0.0]))
def test_the_distance_of_segments_is_that_of_the_other_code(seed: int, skew: float) -> None:
    """That of `geometry.overlap` takes the least of four ends and the common normal; skew 0: parallel."""
    rng = np.random.default_rng(seed)
    p, q, r = rng.uniform(-1, 1, (3, 3))
    s = r + rng.uniform(0.1, 2) * (q - p) + skew * rng.uniform(-1, 1, 3)
    (expected,) = overlap.segment_distance(p[None], q[None], r[None], s[None])
    assert segment_distance(p, q, r, s) == pytest.approx(expected, abs=1e-7)  # both lose half the digits if parallel


def test_chords_join_points_of_the_contact_curve() -> None:
    mesh = tangle(3, fibrils=3, elements=4, order=2)
    table = curve_table(mesh)
    points = chords(table, mesh.position)
    for f in range(mesh.n_fibrils):
        own = points[table.fibril == f]
        expected = reference_curve(mesh, mesh.position, f)(np.linspace(0, len(own), CHORDS * len(own) + 1))
        np.testing.assert_allclose(np.vstack([own[:, :-1].reshape(-1, 3), own[-1:, -1]]), expected, atol=1e-12)


# ---- known answers ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [0.05, 0.2, 2 * R, 1.0])
def test_a_fibril_is_stopped_before_it_falls_through_another(gap: float) -> None:
    """The least distance is a quarter of the first one, or of touch; the advancement ends at most an eighth before."""
    mesh, way = crossing(gap), 3.0
    found = step(mesh, lowered(mesh, way))
    least = COLLISION * min(gap, 2 * R)
    assert (gap - (1 + CLOSEST) * least) / way - ROUND_OFF <= found.fraction <= (gap - least) / way + ROUND_OFF
    assert found.fibrils == (0, 1)
    assert found.distance == pytest.approx(gap, rel=1e-9)


def test_what_ends_just_outside_is_not_limited() -> None:
    gap = 2 * R
    mesh = crossing(gap)
    assert step(mesh, lowered(mesh, (1 - (1 + CLOSEST) * COLLISION) * gap - 1e-9)).fraction == 1.0
    assert step(mesh, lowered(mesh, gap)).fraction < 1.0


@pytest.mark.parametrize("gap", [0.05, 0.2, 2 * R, 0.5])
def test_a_fibril_is_stopped_before_it_falls_through_itself(gap: float) -> None:
    mesh, way = curl(gap), 3.0
    last = mesh.xi > mesh.length[0] - 1.6  # of the way back, more than half
    found = step(mesh, last[:, None] * np.array([0.0, 0.0, -way]))
    least = COLLISION * min(gap, 2 * R)
    assert (gap - (1 + CLOSEST) * least) / way - ROUND_OFF <= found.fraction <= (gap - least) / way + ROUND_OFF
    assert found.fibrils == (0, 0)
    assert found.distance == pytest.approx(gap, rel=1e-9)
    assert step(mesh, last[:, None] * np.array([0.0, 0.0, way])).fraction == 1.0


def test_a_hairpin_may_close_until_its_legs_touch() -> None:
    """From a bend of radius 2 R to one of R: what is next to the bend is free to fold, and the legs end at 2 R."""
    legs, bend = np.linspace(0.0, 1.0, 11), np.linspace(0.0, np.pi, 13)[1:-1]

    def pin(radius: float) -> Floats:
        arc = np.column_stack([1.0 + radius * np.sin(bend), -radius * np.cos(bend), 0.0 * bend])
        lower, upper = ([[x, y, 0.0] for x in way] for way, y in ((legs, -radius), (legs[::-1], radius)))
        return np.vstack([lower, arc, upper])

    mesh = fibrils_through([pin(2 * R)])
    assert step(mesh, pin(R) - mesh.position).fraction == 1.0
    assert step(mesh, pin(-R) - mesh.position).fraction < 1.0


@pytest.mark.parametrize("motion", ["apart", "along", "together", "past the end"])
def test_harmless_motions_are_not_limited(motion: str) -> None:
    """However far: apart, along itself, with the other, and down beyond the other's end."""
    mesh = crossing(0.2)
    upper = (mesh.node_fibril == 1)[:, None]
    way = {
        "apart": upper * np.array([0.0, 0.0, 50.0]),
        "along": upper * np.array([0.0, 50.0, 0.0]),
        "together": np.full((mesh.n_nodes, 3), 50.0),
        "past the end": upper * np.array([50.0, 0.0, -1.0]),
    }[motion]
    assert step(mesh, way).fraction == 1.0


def test_parallel_fibrils_of_a_yarn_do_not_pass_either() -> None:
    mesh = fibrils_through([straight([-1, y, 0], [1, y, 0], 6) for y in (0.0, 2 * R)])
    found = step(mesh, (mesh.node_fibril == 1)[:, None] * np.array([0.0, -4 * R, 0.0]))
    assert found.fraction == pytest.approx(0.5 * (1 - COLLISION), abs=0.5 * CLOSEST * COLLISION + ROUND_OFF)


def test_of_several_collisions_the_first_counts_whatever_the_order() -> None:
    mesh = tangle(11, fibrils=6)
    motion = np.random.default_rng(0).normal(size=(mesh.n_nodes, 3))
    found = step(mesh, motion)
    assert found.fraction < 1.0
    order = [4, 2, 0, 5, 1, 3]
    other, node = renumbered(mesh, order)
    again = step(other, motion[node])
    assert again.fraction == found.fraction
    assert sorted(order[f] for f in again.fibrils) == sorted(found.fibrils)


@pytest.mark.parametrize("power", [-12, 10])
def test_a_scaled_motion_has_the_same_part_to_the_last_bit(power: int) -> None:
    mesh, scale = tangle(12, fibrils=6), 2.0**power
    motion = np.random.default_rng(1).normal(size=(mesh.n_nodes, 3))
    scaled = replace(mesh, position=scale * mesh.position, radius=scale * mesh.radius)
    assert step(scaled, scale * motion).fraction == step(mesh, motion).fraction < 1.0


# ---- against brute force ----------------------------------------------------------------------------------


@settings(deadline=None, max_examples=40)
@example(85, 2.0, 0.05)  # two chords of one interval
@given(seeds, st.sampled_from([0.05, 0.3, 2.0]), st.sampled_from([0.05, 0.15]))
def test_a_safe_part_is_safe_at_every_moment(seed: int, size: float, radius: float) -> None:
    """Looked at in many moments, no two chords are nearer than the collision that they are kept from."""
    mesh = tangle(seed, fibrils=4, elements=4, radius=radius)
    rng = np.random.default_rng(seed)
    smooth = np.cumsum(rng.normal(size=(mesh.n_nodes, 3)), axis=0) / 3
    motion = size * (rng.normal(size=(mesh.n_fibrils, 3))[mesh.node_fibril] + smooth)
    part = step(mesh, motion).fraction
    first, fibrils = chord_distances(mesh, mesh.position)
    least = COLLISION * np.minimum(first, mesh.radius[fibrils].sum(axis=1))
    for t in part * np.linspace(0.0, 1.0, TIMES):
        now, _ = chord_distances(mesh, mesh.position + t * motion)
        assert (now - least).min() >= -ROUND_OFF
    if part < 1.0:  # and it is a collision that limits it
        now, _ = chord_distances(mesh, mesh.position + part * motion)
        assert (now - (1 + CLOSEST) * least).min() <= ROUND_OFF


# ---- motions that need not be followed --------------------------------------------------------------------


@pytest.mark.parametrize("gap", [0.05, 0.2, 2 * R, 1.0])
def test_how_far_all_nodes_may_go(gap: float) -> None:
    """Head on, two straight fibrils collide when each has gone 3/8 of the gap, 4/3 of what is free: that counts on
    curves whose points outrun their nodes. Far apart, chords count that are half as far along as is no neighbour."""
    mesh = crossing(gap)
    distance = clearance(curve_table(mesh), mesh.radius, mesh.position)
    if gap <= NEIGHBOURS / 2 * R:
        assert distance == pytest.approx(gap, rel=ROUND_OFF)
    else:
        assert NEIGHBOURS / 2 * R <= distance <= 2 * R
    towards = np.where((mesh.node_fibril == 1)[:, None], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0])
    assert step(mesh, free_motion(distance) * towards).fraction == 1.0
    if gap <= NEIGHBOURS / 2 * R:
        assert step(mesh, 1.34 * free_motion(distance) * towards).fraction < 1.0


@settings(deadline=None, max_examples=40)
@given(seeds, st.sampled_from([0.05, 0.15]))
def test_whatever_moves_no_further_is_safe(seed: int, radius: float) -> None:
    mesh = tangle(seed, fibrils=4, elements=4, radius=radius)
    distance = clearance(curve_table(mesh), mesh.radius, mesh.position)
    first, fibrils = chord_distances(mesh, mesh.position)
    touch = mesh.radius[fibrils].sum(axis=1)
    assert 0.0 < distance <= np.minimum(first, touch).min(initial=2 * radius) + ROUND_OFF
    way = np.random.default_rng(seed).normal(size=(mesh.n_nodes, 3))
    way *= free_motion(distance) / np.linalg.norm(way, axis=1, keepdims=True)
    assert step(mesh, way).fraction == 1.0


@settings(deadline=None, max_examples=20)
@given(seeds)
def test_contact_answers_as_if_every_motion_were_followed(seed: int) -> None:
    """Short motions one after another, some of them free and some not, until fibrils are far from where they were."""
    mesh, rng = tangle(seed, fibrils=4, elements=4, radius=0.15), np.random.default_rng(seed)
    term, _ = contact_term(mesh)
    r = mesh.position.copy()
    for _ in range(12):
        motion = 10 ** rng.uniform(-3, -1) * rng.normal(size=r.shape)
        expected = safe_step(curve_table(mesh), mesh.radius, r, motion)
        if expected.fraction < 1.0:
            motion *= 0.5 * expected.fraction
            expected = safe_step(curve_table(mesh), mesh.radius, r, motion)
        q, direction = (np.pad(x, ((0, 0), (0, 6))).ravel() for x in (r, motion))
        assert term.longest(q, direction) == expected.fraction
        r = r + motion


# ---- contact ----------------------------------------------------------------------------------------------


def test_fibrils_pressed_through_one_another_are_an_error_with_its_cause() -> None:
    """At a hundredth of R + R' and still on the way: E = 10 MPa, nu = 0 has P* = E*/2 = 2.5 by Hertz."""
    mesh = crossing(0.003)
    term, q = contact_term(mesh, penalty=0.1)
    way = np.zeros((mesh.n_nodes, 9))
    way[:, :3] = lowered(mesh, 1.0)
    with pytest.raises(
        PenetrationError, match=r"fibril 1 of warp1 and fibril 1 of warp2 are pressed through"
    ) as caught:
        term.longest(q, way.ravel())
    assert "the penalty of 0.1 N/mm2 is too soft for them: Hertz's theory gives 2.5 N/mm2" in str(caught.value)
    assert term.longest(q, -way.ravel()) == 1.0


def test_a_relaxation_with_a_penalty_far_too_soft_ends_at_once() -> None:
    """Case 01: E = 3 GPa by the paper's 5 N/mm2; 750 N/mm2 by Hertz. By that it relaxes in a few iterations."""
    design, mesh = small_cell((1,))
    stiff = replace(mesh, youngs_modulus=300.0 * mesh.youngs_modulus)
    with pytest.raises(PenetrationError, match=r"fibril 1 of .* too soft for them: Hertz's theory gives 750 N/mm2"):
        relax(stiff, design)
    hertz = relax(stiff, replace(design, contact=ContactLaw("hertz", 0.01, 0.1)))
    assert hertz.residual <= design.numerics.relative_tolerance * np.abs(hertz.reaction).max()
