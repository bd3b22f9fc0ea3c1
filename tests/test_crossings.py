"""Sides of fibrils: those of the draft, unchanged by any motion that passes nothing, changed by one that does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fabrics import small_cell, straight
from hypothesis import given, settings
from hypothesis import strategies as st
from plan_view import side

from circuittex.base.arrays import Floats
from circuittex.base.errors import PenetrationError
from circuittex.design import Design, Numerics, plain_weave
from circuittex.geometry.crossings import Lines, against_draft, beside, changed, woven
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.relaxation.sides import check_sides, passed_through

REST = np.eye(2)
seeds = st.integers(0, 2**32 - 1)

DRAFTS = {
    "plain": [[0, 1, 0, 1], [1, 0, 1, 0]],
    "twill": [[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1], [1, 0, 0, 1]],
    "satin": [[1, 0, 0, 0, 0], [0, 0, 1, 0, 0], [0, 0, 0, 0, 1], [0, 1, 0, 0, 0], [0, 0, 0, 1, 0]],
    "one": [[1]],
}


def drafted(name: str, rows: tuple[int, ...] = (1, 2)) -> tuple[Design, FibrilMesh]:
    draft = tuple(map(tuple, DRAFTS[name]))
    base = plain_weave(yarns=1, rows=rows)
    yarn = base.weave.warp[0]
    weave = replace(base.weave, draft=draft, warp=(yarn,) * len(draft), weft=(yarn,) * len(draft[0]))
    design = replace(base, weave=weave, numerics=Numerics(elements=12))
    return design, build_mesh(design)


def lines_of(mesh: FibrilMesh, r: Floats | None = None) -> Lines:
    return Lines(mesh.position if r is None else r, mesh.first_node, mesh.yarn_axis[mesh.yarn])


# ---- woven fibrils ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", DRAFTS)
def test_a_woven_start_has_the_order_of_its_draft(name: str) -> None:
    design, mesh = drafted(name)
    found = woven(lines_of(mesh))
    draft = np.array(design.weave.draft)
    assert len(found.pairs) == 9 * draft.size
    assert np.all(found.total == 1)
    yarn = mesh.yarn[found.pairs]
    np.testing.assert_array_equal(found.above, draft[yarn[:, 0], yarn[:, 1] - len(draft)])
    wrong, gone = against_draft(found, draft, mesh.yarn)
    assert len(wrong) == len(gone) == 0
    turned = against_draft(found, 1 - draft, mesh.yarn)[0]
    assert len(turned) == 9 * draft.size


@given(seeds)
def test_above_is_what_the_independent_check_counts(seed: int) -> None:
    """Two crooked lines of nine segments, which cross in plan several times or not at all."""
    rng = np.random.default_rng(seed)
    warp, weft = (np.cumsum(rng.normal(size=(10, 3)), axis=0) for _ in range(2))
    lines = Lines(np.vstack([warp, weft]), np.array([0, 10, 20]), np.array([0, 1]))
    found = woven(lines)
    from_above = np.array([0.0123, 0.0071, 0.0])  # the view is that askew
    warp, weft = (line - line[:, 2:] * from_above for line in (warp, weft))
    assert int(found.above.sum()) == side(warp, weft)
    low = warp - np.array([0.0, 0.0, 1e3])
    assert int(found.total.sum()) == -side(weft, low)


def test_a_crossing_that_falls_on_nodes_is_counted_once() -> None:
    """Straight from above the crossing is a node of both lines, and still is when the lines are askew to the view."""
    for tilt in (0.0, 0.3):
        warp = straight([-1, 0, 0], [1, 0, tilt], 4)
        weft = straight([0, -1, 0.1 + tilt / 2], [0, 1, 0.1 + tilt / 2], 4)
        found = woven(Lines(np.vstack([warp, weft]), np.array([0, 5, 10]), np.array([0, 1])))
        assert (found.total.tolist(), found.above.tolist()) == ([1], [0])


def pushed(mesh: FibrilMesh, fibril: int, along: float, width: float, by: Floats) -> Floats:
    """(N, 3) nodes with one fibril drawn aside by `by` (3,) around a place along it."""
    r = mesh.position.copy()
    own = mesh.node_fibril == fibril
    axis = mesh.yarn_axis[mesh.yarn[fibril]]
    r[own] += np.exp(-(((r[own, axis] - along) / width) ** 2))[:, None] * by
    return r


def test_a_fibril_drawn_through_another_is_caught_and_named() -> None:
    """The warp fibril under weft1 of a single-fibril cell is lifted through it, by more than twice the amplitude."""
    design, mesh = small_cell((1,), elements=12)
    place = -1.0 if design.weave.draft[0][0] == 0 else 1.0
    r = pushed(mesh, 0, place, 0.3, np.array([0.0, 0.0, 2.5]))
    weft = 2 if place < 0 else 3
    wrong, gone = passed_through(mesh, design, r, REST)
    assert wrong.tolist() == [[0, weft]]
    assert len(gone) == 0
    with pytest.raises(PenetrationError, match=f"fibril 1 of warp1 and fibril 1 of weft{weft - 1} have passed through"):
        check_sides(mesh, design, r, REST)
    check_sides(mesh, design, pushed(mesh, 0, place, 0.3, np.array([0.0, 0.0, -2.5])), REST)  # away from it


def test_a_fibril_that_left_the_end_of_another_is_caught_and_named() -> None:
    """A weft fibril drawn aside to beyond the warp's ends crosses them no more; with free ends that may be."""
    design, mesh = small_cell((1,), elements=12)
    r = pushed(mesh, 3, 0.0, 3.0, np.array([4.0, 0.0, 0.0]))
    with pytest.raises(PenetrationError, match=r"do not cross any more: one has slipped off .* \(and 1 other pairs\)"):
        check_sides(mesh, design, r, REST)
    check_sides(mesh, design, r, REST, free_edges="x")


# ---- parallel fibrils -------------------------------------------------------------------------------------


def pair_of(middle: Floats) -> Lines:
    """A straight line along x, and one whose nodes in the middle are elsewhere: beside it by 0.3 mm at the ends."""
    one = straight([-1, 0, 0], [1, 0, 0], 8)
    other = straight([-1, 0.3, 0], [1, 0.3, 0], 8)
    other[3:6] = middle
    return Lines(np.vstack([one, other]), np.array([0, 9, 18]), np.array([0, 0]))


def winding(heights: list[float]) -> Lines:
    """The second line goes to the other side of the first and back, at heights before, there and after."""
    x = np.array([-0.25, 0.0, 0.25])
    return pair_of(np.column_stack([x, [0.0, -0.3, 0.0], heights]))


def test_parallel_fibrils_that_wind_about_one_another_are_told_from_those_that_do_not() -> None:
    """Over and back over is no winding, nor is under and under; over and back under is, in one sense or the other."""
    apart = beside(pair_of(straight([-0.25, 0.3, 0], [0.25, 0.3, 0], 2)))
    for heights in ([0.3, 0.3, 0.3], [-0.3, -0.3, -0.3]):
        assert len(changed(apart, beside(winding(heights)))) == 0
    for heights in ([0.3, 0.0, -0.3], [-0.3, 0.0, 0.3]):
        assert changed(apart, beside(winding(heights))).tolist() == [[0, 1]]


# ---- motions that pass nothing ----------------------------------------------------------------------------


@settings(deadline=None, max_examples=40)
@given(seeds, st.sampled_from(["plain", "twill"]), st.floats(-0.4, 0.6), st.floats(-0.5, 0.5))
def test_no_motion_of_space_changes_sides(seed: int, name: str, stretch: float, shear: float) -> None:
    """Shears x_i += f(x_j, x_k), one after another, are one-to-one: they draw nothing through anything.

    f vanishes at the edges, so that ends move along their own yarns at the most; an affine motion in the plane comes on
    top, as a loading has it.
    """
    design, mesh = drafted(name)
    rng, r = np.random.default_rng(seed), mesh.position.copy()
    half = np.array([np.ptp(r[:, 0]), np.ptp(r[:, 1])]) / 2
    for i in rng.integers(0, 3, 6):
        j, k = (axis for axis in range(3) if axis != i)
        wave = rng.uniform(-0.3, 0.3) * np.sin(rng.uniform(0.5, 3) * r[:, j] + rng.uniform(0.5, 3) * r[:, k])
        for axis in {j, k} - {2}:
            wave *= np.clip(1 - (r[:, axis] / half[axis]) ** 2, 0.0, None) ** 2
        r[:, i] += wave
    gradient = np.array([[1 + stretch, 0.0], [shear, 1.0]])
    r[:, :2] = r[:, :2] @ gradient.T
    wrong, _ = passed_through(mesh, design, r, gradient)
    assert len(wrong) == 0
