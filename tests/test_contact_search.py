"""The candidate search cannot miss a pair, whatever the fibrils look like, for as long as the skin promises."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fabrics import contact_term, fibrils_through, reference_curve, renumbered, straight, tangle
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from circuittex.base.arrays import Floats
from circuittex.contact.curve import CurveTable, bezier, curve_table, curve_through
from circuittex.contact.hull import hulls
from circuittex.contact.search import CONTROL_MOTION, Candidates, bent_back, coupled_nodes, find_candidates
from circuittex.geometry.mesh import FibrilMesh

SAMPLES = 17  # points of an interval in the brute-force check

shapes = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 2**32 - 1),
        "fibrils": st.integers(2, 6),
        "elements": st.integers(3, 9),  # three elements over 2.5 mm at R = 0.02: long and thin
        "noise": st.sampled_from([0.0, 0.1, 0.5]),  # the last folds the fibrils up
        "radius": st.sampled_from([0.02, 0.15, 0.4]),
    }
)


def uneven(mesh: FibrilMesh, seed: int) -> FibrilMesh:
    """The mesh with radii between half and all of the given ones."""
    return replace(mesh, radius=mesh.radius * np.random.default_rng(seed).uniform(0.5, 1.0, mesh.n_fibrils))


def sampled(mesh: FibrilMesh, table: CurveTable, r: Floats) -> Floats:
    """(I, SAMPLES, 3) points of every interval by SciPy's spline."""
    t = np.linspace(0.0, 1.0, SAMPLES)
    at = np.arange(len(table.fibril)) - table.first_interval[table.fibril]
    return np.stack([reference_curve(mesh, r, f)(k + t) for k, f in zip(at, table.fibril, strict=True)])


def close_pairs(mesh: FibrilMesh, table: CurveTable, r: Floats, skin: float) -> set[tuple[int, int]]:
    """All pairs of intervals with sampled points within R + R' + skin: brute force."""
    points = sampled(mesh, table, r).reshape(-1, 3)
    n = len(table.fibril)
    distance = cdist(points, points).reshape(n, SAMPLES, n, SAMPLES).min(axis=(1, 3))
    radius = mesh.radius[table.fibril]
    near = distance <= radius[:, None] + radius[None, :] + skin
    return set(map(tuple, np.argwhere(near).tolist()))


def covered(found: Candidates) -> set[tuple[int, int]]:
    """The pairs of intervals that candidates stand for."""
    rows = zip(found.interval, found.first, found.last, strict=True)
    return {(int(i), j) for i, first, last in rows for j in range(first, last + 1)}


def rows(found: Candidates) -> set[tuple[int, ...]]:
    return set(map(tuple, np.stack([found.interval, found.fibril, found.first, found.last], axis=1).tolist()))


@given(shape=shapes, skin=st.sampled_from([0.0, 0.05, 0.5]))
def test_no_pair_within_reach_is_missed(shape: dict[str, float], skin: float) -> None:
    mesh = uneven(tangle(**shape), shape["seed"])
    table = curve_table(mesh)
    found = find_candidates(table, mesh.position, mesh.radius, skin)
    assert close_pairs(mesh, table, mesh.position, skin) <= covered(found)
    assert np.array_equal(table.fibril[found.first], found.fibril)
    assert np.array_equal(table.fibril[found.last], found.fibril)


def test_long_thin_elements_that_cross_far_from_their_middles() -> None:
    """Elements of 10 mm at R = 0.01 mm, crossing near a node: what a search on midpoints misses or drowns in."""
    lines = [straight([0, 0, 0], [40, 0, 0], 4), straight([0.2, -0.1, 0.015], [0.2, 39.9, 0.015], 4)]
    mesh = fibrils_through([*lines, straight([0, 5, 0], [40, 5, 0], 4)], radius=0.01)
    found = find_candidates(curve_table(mesh), mesh.position, mesh.radius, 0.0)
    across = {(0, 1, 4, 4), (4, 0, 0, 0), (4, 2, 8, 8), (8, 1, 4, 4)}
    own = {(i, i // 4, max(4 * (i // 4), i - 1), min(4 * (i // 4) + 3, i + 1)) for i in range(12)}
    assert rows(found) == across | own


def test_fibrils_apart_are_near_themselves_only() -> None:
    mesh = fibrils_through([straight([0, y, 0], [1, y, 0], 4) for y in (0, 1)])
    table = curve_table(mesh)
    found = find_candidates(table, mesh.position, mesh.radius, 0.05)
    assert np.array_equal(found.fibril, table.fibril[found.interval])
    assert not np.any(bent_back(table, found, turns(table, mesh.position), 0.01))
    pairs = coupled_nodes(table, found, np.zeros(len(found.interval), dtype=bool))
    assert np.all(np.abs(np.diff(pairs)) < 4)  # the windows alone


def turns(table: CurveTable, r: Floats) -> Floats:
    return hulls(curve_through(table, r)).turn


def test_turns_are_those_of_the_tangent() -> None:
    """An arc of 3 rad in a plane turns by as much, give or take its ends' parabolas; a straight fibril does not."""
    t = np.linspace(0.0, 3.0, 25)
    mesh = fibrils_through([np.stack([np.cos(t), np.sin(t), 0 * t], axis=1), straight([5, 0, 0], [6, 0, 0], 4)])
    turn = turns(curve_table(mesh), mesh.position)
    curve = reference_curve(mesh, mesh.position, 0)
    for k in range(24):
        a, b = curve(k, 1), curve(k + 1, 1)
        assert turn[k + 1] - turn[k] == pytest.approx(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b), rel=1e-9)
    assert turn[24] == pytest.approx(3.0, abs=0.02)
    assert np.all(np.diff(turn[24:]) == 0.0)


@given(seed=st.integers(0, 2**32 - 1))
def test_bounds_hold_at_every_point(seed: int) -> None:
    """Distance from the chord, speed and second derivative at samples of crumpled fibrils."""
    mesh = tangle(seed, fibrils=2, noise=0.2)
    table, r = curve_table(mesh), mesh.position
    hull = hulls(curve_through(table, r))
    chord = hull.points[:, 3] - hull.points[:, 0]
    for i, f in enumerate(table.fibril):
        curve, k = reference_curve(mesh, r, f), i - table.first_interval[f]
        assert hull.tangent[i + f] == pytest.approx(curve(k, 1), abs=1e-13)
        for t in np.linspace(0.0, 1.0, 9):
            from_chord = curve(k + t) - hull.points[i, 0] - t * chord[i]
            assert np.linalg.norm(from_chord) <= hull.bulge[i] + 1e-13
            assert np.linalg.norm(curve(k + t, 1)) >= hull.least_speed[i] - 1e-13
            piece = [np.polynomial.Polynomial(curve.c[::-1, k, c]).deriv(2)(t) for c in range(3)]
            assert np.linalg.norm(piece) <= hull.bend[i] + 1e-12


def test_room_is_made_before_a_fibril_touches_itself() -> None:
    """A hairpin closing from a gentle bend: the pattern is renewed, if no earlier, once a quarter turn is near."""

    def bent(angle: float) -> Floats:
        t = np.linspace(-angle / 2, angle / 2, 17)
        return np.stack([0.2 * np.sin(t), 0.2 * np.cos(t), 0.02 * t], axis=1)

    other = straight([99, 0, 0], [100, 0, 0], 4)
    term, q = contact_term(fibrils_through([bent(0.5), other]), skin=10.0)
    term.prepare(q)
    assert np.all(np.abs(np.diff(term.pairs()[1])) < 4)
    moved = q.reshape(-1, 9).copy()
    moved[:17, :3] = bent(6.0)
    assert term.prepare(moved.ravel())
    assert not term.prepare(moved.ravel())
    found = term.touching(moved.ravel())
    assert len(found.overlap) > 0
    assert np.abs(np.diff(term.pairs()[1])).max() == 16


@given(shape=shapes)
def test_candidates_do_not_depend_on_the_order_of_the_fibrils(shape: dict[str, float]) -> None:
    mesh = uneven(tangle(**shape), shape["seed"])
    order = np.random.default_rng(shape["seed"]).permutation(mesh.n_fibrils)
    other, _ = renumbered(mesh, order)
    mine, theirs = curve_table(mesh), curve_table(other)
    old = (
        mine.first_interval[order[theirs.fibril]] + np.arange(len(theirs.fibril)) - theirs.first_interval[theirs.fibril]
    )
    here = find_candidates(mine, mesh.position, mesh.radius, 0.05)
    there = find_candidates(theirs, other.position, other.radius, 0.05)
    renamed = Candidates(
        interval=old[there.interval], fibril=order[there.fibril], first=old[there.first], last=old[there.last]
    )
    assert rows(renamed) == rows(here)


@given(shape=shapes)
def test_both_sides_of_a_pair_are_candidates(shape: dict[str, float]) -> None:
    mesh = tangle(**shape)
    table = curve_table(mesh)
    found = find_candidates(table, mesh.position, mesh.radius, 0.05)
    fibrils = set(zip(table.fibril[found.interval].tolist(), found.fibril.tolist(), strict=True))
    assert fibrils == {(b, a) for a, b in fibrils}


def test_the_motion_of_bezier_points_is_bounded_and_the_bound_is_reached() -> None:
    """The largest motion for unit motions of the nodes is the largest sum of the weights' magnitudes."""
    mesh = fibrils_through([straight([0, 0, 0], [1, 0, 0], 6)])
    table = curve_table(mesh)
    weight = np.empty((4 * len(table.fibril), mesh.n_nodes))
    for node in range(mesh.n_nodes):
        unit = np.zeros((mesh.n_nodes, 3))
        unit[node, 0] = 1.0
        weight[:, node] = bezier(table, unit)[..., 0].ravel()
    assert np.abs(weight).sum(axis=1).max() == pytest.approx(CONTROL_MOTION, rel=1e-14)


@given(seed=st.integers(0, 2**32 - 1))
def test_no_bezier_point_moves_further_than_the_bound(seed: int) -> None:
    mesh = tangle(1, fibrils=3, elements=5)
    table = curve_table(mesh)
    rng = np.random.default_rng(seed)
    motion = rng.normal(size=mesh.position.shape) * rng.exponential(size=(mesh.n_nodes, 1))
    moved = bezier(table, mesh.position + motion) - bezier(table, mesh.position)
    largest = np.linalg.norm(motion, axis=1).max()
    assert np.linalg.norm(moved, axis=2).max() <= CONTROL_MOTION * largest * (1 + 1e-12)


@given(seed=st.integers(0, 2**32 - 1), share=st.sampled_from([0.5, 0.99]))
def test_candidates_hold_for_motions_within_the_skin(seed: int, share: float) -> None:
    """After the largest motion for which `prepare` keeps its candidates, none is missing."""
    skin = 0.1
    mesh = tangle(seed, fibrils=4, elements=6, radius=0.1)
    term, q = contact_term(mesh, skin=skin)
    assert term.prepare(q)
    r, table = term.positions(q), term.table
    kept = find_candidates(table, r, mesh.radius, skin)
    motion = np.random.default_rng(seed).normal(size=r.shape)
    motion *= share * skin / (2 * CONTROL_MOTION) / np.linalg.norm(motion, axis=1)[:, None]
    moved = q.reshape(-1, 9).copy()
    moved[:, :3] += motion
    held = term._held
    term.prepare(moved.ravel())  # a fibril that bends back may ask for more room in the pattern
    assert term._held is held
    assert close_pairs(mesh, table, r + motion, 0.0) <= covered(kept)


def test_candidates_are_renewed_beyond_the_skin() -> None:
    mesh = tangle(5)
    term, q = contact_term(mesh, skin=0.1)
    assert term.prepare(q)
    assert not term.prepare(q)
    moved = q.reshape(-1, 9).copy()
    moved[0, 0] += 1.001 * 0.05 / CONTROL_MOTION
    assert term.prepare(moved.ravel())
    assert not term.prepare(moved.ravel())


@given(seed=st.integers(0, 2**32 - 1))
def test_the_skin_does_not_change_the_contacts(seed: int) -> None:
    mesh = tangle(seed, elements=6)
    (thin, q), (thick, _) = contact_term(mesh, skin=0.01), contact_term(mesh, skin=0.5)
    energies = []
    for term in (thin, thick):
        term.prepare(q)
        energies.append(term.energy(q))
    assert energies[0] == pytest.approx(energies[1], rel=1e-12)


@given(seed=st.integers(0, 2**32 - 1), order=st.sampled_from([1, 2]))
def test_every_coupled_node_pair_is_announced(seed: int, order: int) -> None:
    """The pattern's promise: windows of a touching interval and of the closest point's interval are all paired."""
    mesh = tangle(seed, fibrils=4, elements=6 // order, order=order, radius=0.3)
    term, q = contact_term(mesh)
    term.prepare(q)
    table = term.table
    found = find_candidates(table, term.positions(q), mesh.radius, term.skin)
    pairs = coupled_nodes(table, found, np.zeros(len(found.interval), dtype=bool))
    announced = {frozenset(pair) for pair in pairs.tolist()}
    found = term.touching(q)
    last = np.diff(table.first_interval)[found.fibril_b] - 1
    b = table.first_interval[found.fibril_b] + np.minimum(found.position_b.astype(int), last)
    for i, j in zip(table.window[found.interval_a], table.window[b], strict=True):
        nodes = [*range(i, i + 4), *range(j, j + 4)]
        assert {frozenset((p, q)) for p in nodes for q in nodes if p != q} <= announced
