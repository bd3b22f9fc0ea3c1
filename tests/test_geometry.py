"""Geometry: the paper's start in closed form, its symmetries, other drafts, the mesh and the overlaps."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.design import Design, Numerics, plain_weave
from circuittex.geometry import FibrilMesh, build_mesh
from circuittex.geometry.centre_lines import centre_lines, yarn_height
from circuittex.geometry.overlap import check_overlaps, near_pairs, segment_distance

H, PITCH, CELL = 0.525, 2.0, 8.0  # mm, the paper's cell
ROWS = ((-0.3, 3), (0.0, 4), (0.3, 3))  # vertical offset and number of fibrils of each row
AXES = (-3.0, -1.0, 1.0, 3.0)  # mm, places of the yarns
ROUNDING = 1e-14  # mm; a few units in the last place of coordinates up to 4 mm


def woven(draft: list[list[int]], **changes: Any) -> Design:
    """The paper's yarns in another draft, without probes."""
    base = plain_weave()
    kind = base.weave.warp[0]
    weave = dataclasses.replace(
        base.weave,
        draft=tuple(map(tuple, draft)),
        warp=(kind,) * len(draft),
        weft=(kind,) * len(draft[0]),
        **changes,
    )
    return dataclasses.replace(base, weave=weave, terminals=(), probes=())


def fibrils(mesh: FibrilMesh) -> Floats:
    """(F, K, 3) nodes fibril by fibril."""
    return mesh.position.reshape(mesh.n_fibrils, -1, 3)


# ---- the cell of the paper --------------------------------------------------------------------------------


@pytest.mark.parametrize(("elements", "order"), [(20, 2), (20, 1), (7, 2), (33, 1)])
def test_the_paper_s_start(elements: int, order: int) -> None:
    """r = axis + lateral + row offset, z = +-H sin(pi s / 2) + row offset, sign alternating from yarn to yarn."""
    design = dataclasses.replace(plain_weave(), numerics=Numerics(elements=elements, order=order))
    mesh = build_mesh(design)
    s = np.linspace(-4.0, 4.0, order * elements + 1)
    signs = set()
    fibril = 0
    for direction in (0, 1):
        for number, place in enumerate(AXES):
            crest = np.sign(mesh.position[mesh.first_node[fibril] + np.argmin(abs(s + 3)), 2])
            for z, count in ROWS:
                for j in range(count):
                    nodes = slice(mesh.first_node[fibril], mesh.first_node[fibril + 1])
                    r = mesh.position[nodes]
                    sign = (-1) ** (number + direction + 1)
                    np.testing.assert_allclose(r[:, direction], s, atol=ROUNDING)
                    lateral = place + (j - (count - 1) / 2) * 0.3
                    np.testing.assert_allclose(r[:, 1 - direction], lateral, atol=ROUNDING)
                    np.testing.assert_allclose(r[:, 2], sign * H * np.sin(np.pi * s / 2) + z, atol=ROUNDING)
                    np.testing.assert_allclose(mesh.xi[nodes], s + 4.0, atol=ROUNDING)
                    fibril += 1
            signs.add((direction, number, int(crest)))
    assert fibril == mesh.n_fibrils == 80


def test_warp_and_weft_lie_on_opposite_sides_of_every_crossing() -> None:
    """Where the draft says 1 the warp is at +H and the weft at -H, and the other way round."""
    design = plain_weave()
    lines = centre_lines(design.weave, 65)  # 16 steps a crossing: crossings are places 8, 24, 40, 56
    axis = lines.position.reshape(8, 10, 65, 3)[:, [4, 5]].mean(axis=1)  # the middle row's inner two
    for i in range(4):
        for j in range(4):
            side = 1 if design.weave.draft[i][j] else -1
            warp, weft = axis[i, 8 + 16 * j], axis[4 + j, 8 + 16 * i]
            np.testing.assert_allclose(warp, [AXES[j], AXES[i], side * H], atol=ROUNDING)
            np.testing.assert_allclose(weft, [AXES[j], AXES[i], -side * H], atol=ROUNDING)


def test_fibril_ends_lie_on_the_edges_of_the_cell() -> None:
    mesh = build_mesh(plain_weave())
    for side in (-1, 1):
        ends = mesh.position[mesh.end_nodes(side)]
        axis = mesh.yarn_axis[mesh.yarn]
        np.testing.assert_array_equal(ends[np.arange(80), axis], side * CELL / 2)
        offsets = np.tile(np.repeat([z for z, _ in ROWS], [n for _, n in ROWS]), 8)
        np.testing.assert_allclose(ends[:, 2], offsets, atol=ROUNDING)


def test_turning_the_cell_by_a_quarter_and_over_changes_nothing() -> None:
    """(x, y, z) -> (y, x, -z) maps warp i onto weft i, and rows onto mirrored rows."""
    r = fibrils(build_mesh(plain_weave())).reshape(2, 4, 10, -1, 3)
    mirrored = r[0][..., [1, 0, 2]] * [1, 1, -1]
    order = [7, 8, 9, 3, 4, 5, 6, 0, 1, 2]  # fibrils of a yarn with its rows upside down
    np.testing.assert_allclose(mirrored[:, order], r[1], atol=ROUNDING)


def test_reversing_a_yarn_turns_it_over() -> None:
    """The wave is odd in s: z(-s) = -z(s)."""
    r = fibrils(build_mesh(plain_weave())).reshape(8, 10, -1, 3)
    axis = r.mean(axis=1)
    np.testing.assert_allclose(axis[..., 2], -axis[:, ::-1, 2], atol=ROUNDING)


def test_neighbouring_yarns_are_opposite() -> None:
    r = fibrils(build_mesh(plain_weave())).reshape(2, 4, 10, -1, 3).mean(axis=2)[..., 2]
    np.testing.assert_allclose(r[:, 1:], -r[:, :-1], atol=ROUNDING)


# ---- directors --------------------------------------------------------------------------------------------


def test_directors_are_an_orthonormal_right_handed_frame_with_the_tangent() -> None:
    mesh = build_mesh(plain_weave())
    g1, g2 = mesh.directors[:, 0], mesh.directors[:, 1]
    axis = mesh.yarn_axis[mesh.yarn][mesh.node_fibril]
    s = mesh.xi - CELL / 2
    number = mesh.yarn[mesh.node_fibril] % 4
    slope = (-1.0) ** (number + axis + 1) * H * np.pi / 2 * np.cos(np.pi * s / 2)  # of H sin(pi s / 2)
    tangent = np.zeros_like(g1)
    tangent[np.arange(len(s)), axis] = 1.0
    tangent[:, 2] = slope
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    frame = np.stack([g1, g2, tangent], axis=-1)
    identity = np.broadcast_to(np.eye(3), frame.shape)
    np.testing.assert_allclose(np.swapaxes(frame, 1, 2) @ frame, identity, atol=ROUNDING)
    np.testing.assert_allclose(np.linalg.det(frame), 1.0, atol=ROUNDING)
    np.testing.assert_array_equal(g1[:, 2], 0.0)


# ---- the mesh ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("elements", "order"), [(20, 2), (20, 1), (5, 2)])
def test_mesh_tables(elements: int, order: int) -> None:
    mesh = build_mesh(dataclasses.replace(plain_weave(), numerics=Numerics(elements=elements, order=order)))
    assert mesh.order == order
    assert mesh.n_nodes == 80 * (order * elements + 1)
    assert mesh.elements.shape == (80 * elements, order + 1)
    np.testing.assert_array_equal(np.unique(mesh.elements), np.arange(mesh.n_nodes))
    np.testing.assert_array_equal(mesh.node_fibril[mesh.elements], mesh.element_fibril[:, None] + np.zeros(order + 1))
    np.testing.assert_array_equal(np.diff(mesh.first_element), elements)
    step = np.diff(mesh.xi[mesh.elements], axis=1)  # equal: mid-nodes are in the middle, neighbours share an end
    np.testing.assert_allclose(step, CELL / (elements * order), rtol=1e-12)
    np.testing.assert_array_equal(mesh.xi[mesh.end_nodes(-1)], 0.0)
    np.testing.assert_array_equal(mesh.xi[mesh.end_nodes(+1)], mesh.length)
    np.testing.assert_array_equal(mesh.yarn, np.repeat(np.arange(8), 10))
    assert mesh.yarn_names == ("warp1", "warp2", "warp3", "warp4", "weft1", "weft2", "weft3", "weft4")
    np.testing.assert_array_equal(mesh.yarn_axis, [0, 0, 0, 0, 1, 1, 1, 1])
    for name, value in (("radius", 0.15), ("length", 8.0), ("youngs_modulus", 10.0), ("electrical_conductivity", 10.0)):
        np.testing.assert_array_equal(getattr(mesh, name), value)


def test_properties_follow_the_fibril() -> None:
    base = plain_weave()
    kind = base.weave.warp[0]
    core = dataclasses.replace(kind.materials[0], name="core", electrical_conductivity=0.0, density=2.0)
    other = dataclasses.replace(kind, name="core", radius=0.1, rows=(2, 1), materials=(core, kind.materials[0], core))
    weave = dataclasses.replace(base.weave, warp=(kind, other, kind, kind))
    mesh = build_mesh(dataclasses.replace(base, weave=weave))
    assert mesh.n_fibrils == 73
    mine = mesh.yarn == 1
    np.testing.assert_array_equal(mesh.electrical_conductivity[mine], [0.0, 10.0, 0.0])
    np.testing.assert_array_equal(mesh.density[mine], [2.0, 1.0, 2.0])
    np.testing.assert_array_equal(mesh.radius[mine], 0.1)
    np.testing.assert_array_equal(mesh.radius[~mine], 0.15)
    np.testing.assert_array_equal(mesh.electrical_conductivity[~mine], 10.0)


def test_a_rectangular_cell() -> None:
    """Two warp yarns cross three weft yarns: the warp is 6 mm long, the weft 4 mm."""
    mesh = build_mesh(woven([[1, 0, 1], [0, 1, 0]]))
    np.testing.assert_array_equal(mesh.length, np.repeat([6.0, 4.0], [20, 30]))
    low, high = mesh.position.min(axis=0), mesh.position.max(axis=0)
    np.testing.assert_allclose([low[:2], high[:2]], [[-3, -2], [3, 2]], atol=ROUNDING)
    assert mesh.yarn_names == ("warp1", "warp2", "weft1", "weft2", "weft3")


# ---- any draft --------------------------------------------------------------------------------------------


def test_a_twill_floats_level_over_two_crossings() -> None:
    """2/2 twill: between two crossings on one side the yarn is straight at that side's height."""
    u = np.linspace(-0.5, 3.5, 81)[None]
    z, slope = yarn_height(u, np.array([[1, 1, -1, -1]]))
    np.testing.assert_allclose(z[(u >= 0) & (u <= 1)], 1.0, atol=ROUNDING)
    np.testing.assert_allclose(z[(u >= 2) & (u <= 3)], -1.0, atol=ROUNDING)
    change = (u >= 1) & (u <= 2)
    np.testing.assert_allclose(z[change], np.cos(np.pi * (u[change] - 1)), atol=ROUNDING)
    np.testing.assert_allclose(z[0, [0, -1]], 0.0, atol=ROUNDING)  # the mid-plane at the edges
    np.testing.assert_allclose(slope[0, [0, -1]], np.pi, rtol=1e-12)
    edge = u <= 0
    np.testing.assert_allclose(z[edge], np.cos(np.pi * u[edge]), atol=ROUNDING)


sides = st.lists(st.sampled_from([-1, 1]), min_size=1, max_size=12)


@given(sides, st.floats(0.0, 1.0))
def test_any_yarn_passes_its_crossings_and_stays_between(pattern: list[int], fraction: float) -> None:
    n = len(pattern)
    crossings, _ = yarn_height(np.arange(n, dtype=float)[None], np.array([pattern]))
    np.testing.assert_allclose(crossings[0], pattern, atol=ROUNDING)
    u = np.array([[-0.5 + fraction * n]])
    z, slope = yarn_height(u, np.array([pattern]))
    assert abs(z[0, 0]) <= 1 + ROUNDING
    turned, turned_slope = yarn_height(n - 1 - u, np.array([pattern[::-1]]))
    # reversed yarns are mirror images; near a crossing the two may use different pieces, which join smoothly
    np.testing.assert_allclose([turned[0, 0], turned_slope[0, 0]], [z[0, 0], -slope[0, 0]], atol=1e-12)


@given(sides, st.floats(0.001, 0.999))
def test_slope_is_the_derivative_of_the_height(pattern: list[int], fraction: float) -> None:
    h = 1e-5
    u = -0.5 + h + fraction * (len(pattern) - 2 * h)
    (z,), (slope,) = yarn_height(np.array([[u - h, u, u + h]]), np.array([pattern]))
    # central difference: pi^3 h^2 / 6 + rounding 1e-16 / h; h times the jump pi^2 of the curvature where a float begins
    assert (z[2] - z[0]) / (2 * h) == pytest.approx(slope[1], abs=1e-4)


@pytest.mark.parametrize(
    "draft",
    [
        [[1]],
        [[0]],
        [[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1], [1, 0, 0, 1]],  # 2/2 twill
        [[1, 0, 0, 0, 0], [0, 0, 1, 0, 0], [0, 0, 0, 0, 1], [0, 1, 0, 0, 0], [0, 0, 0, 1, 0]],  # satin
    ],
)
def test_other_drafts_make_a_mesh(draft: list[list[int]]) -> None:
    mesh = build_mesh(woven(draft))
    assert mesh.n_fibrils == 10 * (len(draft) + len(draft[0]))
    assert np.isfinite(mesh.position).all()


# ---- overlaps ---------------------------------------------------------------------------------------------


def closest(p: Floats, q: Floats, r: Floats, s: Floats) -> float:
    """Distance of two segments by constrained minimisation of a convex function."""

    def squared(t: Floats) -> float:
        return float(np.sum((p + t[0] * (q - p) - r - t[1] * (s - r)) ** 2))

    best = minimize(squared, [0.5, 0.5], bounds=[(0, 1), (0, 1)], options={"ftol": 1e-15, "gtol": 1e-10})
    return float(np.sqrt(best.fun))


def test_segment_distance_against_minimisation() -> None:
    ends = np.random.default_rng(3).uniform(-1, 1, (4, 60, 3))
    expected = [closest(*ends[:, k]) for k in range(60)]
    np.testing.assert_allclose(segment_distance(*ends), expected, atol=1e-6)  # what the minimiser resolves


@pytest.mark.parametrize(
    ("points", "distance"),
    [
        ([[0, 0, 0], [2, 0, 0], [1, -1, 0.5], [1, 1, 0.5]], 0.5),  # crossing
        ([[0, 0, 0], [2, 0, 0], [0, 1, 0], [2, 1, 0]], 1.0),  # parallel, side by side
        ([[0, 0, 0], [1, 0, 0], [4, 4, 0], [5, 4, 0]], 5.0),  # parallel, apart: 3-4-5
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 0, 0]], 1.0),  # in one line
        ([[0, 0, 0], [2, 0, 0], [1, 0, 0], [5, 0, 0]], 0.0),  # in one line, overlapping
        ([[0, 0, 0], [1, 0, 0], [4, 4, 0], [4, 9, 0]], 5.0),  # end to end
        ([[0, 0, 0], [2, 0, 0], [1, 3, 0], [1, 9, 0]], 3.0),  # end to middle
    ],
)
def test_segment_distance_in_known_cases(points: list[list[float]], distance: float) -> None:
    x = np.array(points, dtype=float)[:, None]
    assert segment_distance(*x)[0] == pytest.approx(distance, abs=1e-12)
    assert segment_distance(*x[[3, 2, 0, 1]])[0] == pytest.approx(distance, abs=1e-12)


def test_the_paper_s_start_overlaps_a_little_and_is_allowed() -> None:
    """Fibrils of neighbouring rows, (0.15, 0.3) mm apart, come closest where the yarn rises through z = 0.

    There the points at s = t/2 of the lower and -t/2 of the upper fibril are t apart along the yarn, 0.15 mm across
    and 0.3 - 2 H sin(pi t / 4) in height; the smallest distance over t is found on a fine grid.
    """
    weave = plain_weave().weave
    check_overlaps(weave)
    t = np.linspace(0.0, 0.5, 5001)
    smallest = np.sqrt(t**2 + 0.15**2 + (0.3 - 2 * H * np.sin(np.pi * t / 4)) ** 2).min()
    assert 0.02 < 0.3 - smallest < 0.15
    two_yarns = plain_weave(yarns=2).weave  # the same waves on a smaller cell
    found = near_pairs(centre_lines(two_yarns, 513).position, 0.3)
    deepest = max(float(np.max(0.3 - distance)) for _, _, distance in found)
    assert deepest == pytest.approx(0.3 - smallest, abs=3e-6)  # chords of 1/128 mm: 1.4e-6 too far apart


def test_near_pairs_misses_none() -> None:
    """Against all pairs of segments."""
    position = np.random.default_rng(5).uniform(0, 1, (6, 5, 3))
    (first, second, distance), *rest = near_pairs(position, 0.2)
    assert not rest
    pairs = {(int(f), int(g)) for f, g in zip(first, second, strict=True)}
    found = {(f, g): float(distance[(first == f) & (second == g)].min()) for f, g in pairs}
    for f in range(6):
        for g in range(f + 1, 6):
            a, b = (np.repeat(np.arange(4), 4), np.tile(np.arange(4), 4))
            x, y = position[f], position[g]
            nearest = float(segment_distance(x[a], x[a + 1], y[b], y[b + 1]).min())
            if nearest < 0.2:
                assert found[f, g] == pytest.approx(nearest, abs=1e-12)


@pytest.mark.parametrize("key", ["spacing", "row_spacing"])
def test_the_limit_is_one_radius(key: str) -> None:
    """Two fibrils on a straight yarn: their overlap is 2 R - distance, allowed up to R = 0.15 mm."""
    base = woven([[1]], amplitude=0.5).weave
    straight = dataclasses.replace(
        base.warp[0],
        rows=(2,) if key == "spacing" else (1, 1),
        materials=base.warp[0].materials[:2],
    )
    for distance, allowed in ((0.1501, True), (0.15, True), (0.1499, False)):
        kind = dataclasses.replace(straight, **{key: distance})
        single = dataclasses.replace(kind, name="single", rows=(1,), materials=kind.materials[:1])
        # one wide crossing: the yarn rises by 0.5 mm over 2000 mm, so that 1 - cos a = 8e-8
        weave = dataclasses.replace(base, warp=(kind,), weft=(single,), pitch=4000.0)
        if allowed:
            check_overlaps(weave)
        else:
            with pytest.raises(DesignError, match="fibril 1 of warp1 and fibril 2 of warp1") as caught:
                check_overlaps(weave)
            assert caught.value.field == f"yarns.conductive.{key}"
            assert "start 0.1501 mm inside one another, at most 0.15 mm" in str(caught.value)


def test_the_depth_is_that_of_the_deepest_point() -> None:
    """Two single fibrils of radii R and R' that cross at the heights +-H: overlap R + R' - 2 H."""
    # the chords that stand for the curves come 0.0002 mm closer
    base = woven([[1]]).weave
    thick = dataclasses.replace(base.warp[0], name="thick", rows=(1,), materials=base.warp[0].materials[:1], radius=0.3)
    thin = dataclasses.replace(thick, name="thin", radius=0.2)
    for amplitude, allowed in ((0.151, True), (0.149, False)):
        weave = dataclasses.replace(base, warp=(thick,), weft=(thin,), amplitude=amplitude)
        if allowed:  # 0.198 mm, below the smaller radius
            check_overlaps(weave)
        else:
            with pytest.raises(DesignError, match=r"start 0\.202\d mm inside one another, at most 0\.2 mm") as caught:
                check_overlaps(weave)
            assert caught.value.field == "weave.amplitude"


def test_overlaps_do_not_depend_on_the_mesh() -> None:
    """The coarsest mesh that is allowed is judged by the same centre lines as a fine one."""
    for elements in (4, 100):
        build_mesh(dataclasses.replace(plain_weave(), numerics=Numerics(elements=elements)))
