"""Other starts than the initial weave: what is laid out where, what stays, and where the descent from there ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fabrics import small_cell
from hypothesis import given
from hypothesis import strategies as st

from circuittex.base.errors import ConvergenceError, DesignError
from circuittex.design import Clamps, Design, Packing, Weave
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.relaxation.relax import Equilibrium, relax
from circuittex.relaxation.starts import check_start, from_state, laid_out, repeat, repeated_cell, tiled

pytestmark = pytest.mark.xdist_group("starts")  # what its fixtures make serves one worker

SAME = 1e-7
"""Relative: energies of two equilibria that are one, each within the tolerance of 2e-5 of the forces, which enters an
energy squared."""
CLOSE = 1e-3
"""Parts of R: nodes of two such equilibria."""


def with_draft(design: Design, draft: tuple[tuple[int, ...], ...]) -> Design:
    """The design with another draft of yarns of the same kind."""
    yarn = design.weave.warp[0]
    weave = replace(design.weave, draft=draft, warp=(yarn,) * len(draft), weft=(yarn,) * len(draft[0]))
    return replace(design, weave=weave, terminals=(), probes=())


def single(yarns: int, elements: int) -> tuple[Design, FibrilMesh]:
    """Yarns of one fibril that touch: their equilibrium is one of a kind."""
    design, _ = small_cell((1,), yarns=yarns, elements=elements)
    design = replace(design, weave=replace(design.weave, amplitude=0.2))
    return design, build_mesh(design)


@pytest.fixture(scope="module")
def small() -> tuple[Design, FibrilMesh, Equilibrium]:
    design, mesh = single(2, 8)
    return design, mesh, relax(mesh, design)


drafts = st.integers(1, 6).flatmap(
    lambda n: st.lists(st.lists(st.integers(0, 1), min_size=n, max_size=n).map(tuple), min_size=1, max_size=6)
)


@given(drafts.map(tuple), st.integers(1, 3), st.integers(1, 3))
def test_the_repeat_is_the_smallest_that_makes_the_draft(
    tile: tuple[tuple[int, ...], ...], down: int, across: int
) -> None:
    """Against all smaller tilings, tried one by one."""
    draft = np.tile(np.array(tile), (down, across))
    design, _ = small_cell((1,))
    weave: Weave = with_draft(replace(design, numerics=replace(design.numerics, elements=40)), draft.tolist()).weave
    fits = [
        (warp, weft)
        for warp in range(1, draft.shape[0] + 1)
        for weft in range(1, draft.shape[1] + 1)
        if draft.shape[0] % warp == 0
        and draft.shape[1] % weft == 0
        and np.array_equal(np.tile(draft[:warp, :weft], (draft.shape[0] // warp, draft.shape[1] // weft)), draft)
    ]
    assert repeat(weave) == min(fits, key=lambda size: size[0] * size[1])


def test_yarns_of_other_kinds_do_not_repeat() -> None:
    design, _ = small_cell((1,), yarns=4)
    other = replace(design.weave.warp[0], name="other", radius=0.1, spacing=0.2, row_spacing=0.2)
    one = design.weave.warp[0]
    assert repeat(replace(design.weave, warp=(one, other, one, other))) == (2, 2)
    assert repeat(replace(design.weave, warp=(one, one, other, one))) == (4, 2)


def test_copies_are_moved_like_the_cell_and_meet_in_the_middle() -> None:
    """Random displacements of a 2 x 1 cell on a weave of 4 x 3 yarns, node by node."""
    base, _ = small_cell((1, 2))
    design = with_draft(base, ((0,) * 3, (1,) * 3) * 2)
    cell_design = with_draft(base, ((0,), (1,)))
    # Warp fibrils cross three yarns in 12 elements, one in the cell's 4; wefts four in 12, two in the cell's 4.
    mesh = build_mesh(replace(design, numerics=replace(design.numerics, elements=12)))
    cell = build_mesh(replace(cell_design, numerics=replace(design.numerics, elements=4)))
    moved = np.random.default_rng(1).normal(size=(cell.n_nodes, 3, 3))
    found = laid_out(Configuration(moved), cell, mesh).x - initial_configuration(mesh).x
    warps = found[: 4 * 3 * 25].reshape(2, 2, 3, 25, 3, 3)  # copy, yarn of the cell, fibril, node
    own = moved[: 2 * 3 * 9].reshape(2, 3, 9, 3, 3)
    for copy in range(2):
        for part in range(3):
            inner = warps[copy, :, :, 8 * part + 1 : 8 * part + 8]
            np.testing.assert_allclose(inner, own[:, :, 1:-1], rtol=0, atol=1e-14)
        for edge in (8, 16):
            np.testing.assert_allclose(warps[copy, :, :, edge], (own[:, :, 0] + own[:, :, -1]) / 2, rtol=0, atol=1e-14)
        np.testing.assert_allclose(warps[copy, :, :, 0], own[:, :, 0], rtol=0, atol=1e-14)
        np.testing.assert_allclose(warps[copy, :, :, 24], own[:, :, -1], rtol=0, atol=1e-14)
    # Twelve elements for two copies of four: every third place of a copy, in units of a quarter of an element.
    wefts = found[4 * 3 * 25 :].reshape(3, 3, 25, 3, 3)
    own = moved[2 * 3 * 9 :].reshape(3, 9, 3, 3)
    for yarn in range(3):
        np.testing.assert_allclose(wefts[yarn, :, [3, 6, 9]], own[:, [2, 4, 6]].swapaxes(0, 1), rtol=0, atol=1e-14)
        np.testing.assert_allclose(wefts[yarn, :, 12], (own[:, 0] + own[:, -1]) / 2, rtol=0, atol=1e-14)


def test_clamped_ends_stay_and_nothing_moved_is_the_initial_weave(
    small: tuple[Design, FibrilMesh, Equilibrium],
) -> None:
    _, cell, found = small
    _, mesh = single(4, 12)  # no multiple of the cell's elements
    woven = initial_configuration(mesh)
    assert np.array_equal(laid_out(Configuration(np.zeros((cell.n_nodes, 3, 3))), cell, mesh).x, woven.x)
    moved = Configuration(found.configuration.x - initial_configuration(cell).x)
    start = laid_out(moved, cell, mesh)
    assert np.array_equal(start.r[mesh.ends], woven.r[mesh.ends])
    assert np.abs(start.r - woven.r).max() > 0.01 * float(mesh.radius[0])


def test_copies_of_single_fibrils_are_the_equilibrium(small: tuple[Design, FibrilMesh, Equilibrium]) -> None:
    """A wave of single fibrils turned by half a turn about a clamp is the same wave: a place midway between crossings
    stays where it is, and the larger cell is four of the small one, in energy as well."""
    design, mesh = single(4, 16)
    start = tiled(mesh, design)
    direct, found = relax(mesh, design), relax(mesh, design, start)
    assert found.energy == pytest.approx(4 * small[2].energy, rel=SAME)
    assert found.energy == pytest.approx(direct.energy, rel=SAME)
    radius = float(mesh.radius[0])
    assert np.abs(found.configuration.r - direct.configuration.r).max() < CLOSE * radius
    assert np.abs(start.r - direct.configuration.r).max() < CLOSE * radius
    assert found.iterations <= 1 < direct.iterations


def test_a_start_of_copies_leads_to_an_equilibrium_in_fewer_iterations() -> None:
    """Three fibrils a yarn, where the small cell's clamps and edges matter to the copies."""
    design, mesh = small_cell((1, 2), yarns=4, elements=8)
    direct, found = relax(mesh, design), relax(mesh, design, tiled(mesh, design))
    assert found.iterations < direct.iterations
    assert found.energy <= direct.energy * (1 + SAME)


def test_a_design_of_another_size_has_the_same_start() -> None:
    design, mesh = single(4, 8)
    yarn = replace(design.weave.warp[0], radius=0.3, spacing=0.6, row_spacing=0.6)
    weave = replace(design.weave, warp=(yarn,) * 4, weft=(yarn,) * 4, pitch=4.0, amplitude=0.4)
    large = replace(design, weave=weave)
    start, other = tiled(mesh, design), tiled(build_mesh(large), large)
    assert np.array_equal(other.r, 2 * start.r)
    assert np.array_equal(other.g2, start.g2)


@pytest.mark.parametrize(("what", "factor"), [("penalty", 3.0), ("youngs_modulus", 2.0)])
def test_a_state_of_a_similar_design_leads_to_the_same_equilibrium(
    small: tuple[Design, FibrilMesh, Equilibrium], what: str, factor: float
) -> None:
    design, mesh, source = small
    if what == "penalty":
        design = replace(design, contact=replace(design.contact, penalty=factor * 5.0))
    else:
        yarn = design.weave.warp[0]
        yarn = replace(yarn, materials=(replace(yarn.materials[0], youngs_modulus=factor * 10.0),))
        design = replace(design, weave=replace(design.weave, warp=(yarn,) * 2, weft=(yarn,) * 2))
    design = replace(design, numerics=replace(design.numerics, elements=12))
    finer = build_mesh(design)
    start = from_state(finer, design, source.configuration, mesh)
    direct, found = relax(finer, design), relax(finer, design, start)
    assert found.energy == pytest.approx(direct.energy, rel=SAME)
    assert np.abs(found.configuration.r - direct.configuration.r).max() < CLOSE * float(mesh.radius[0])
    assert found.energy != pytest.approx(source.energy, rel=100 * SAME)


def test_a_state_moves_the_nodes_of_another_weave_as_its_own(small: tuple[Design, FibrilMesh, Equilibrium]) -> None:
    design, mesh, source = small
    higher = replace(design, weave=replace(design.weave, amplitude=0.21))
    there = build_mesh(higher)
    start = from_state(there, higher, source.configuration, mesh)
    moved, own = (of.r - initial_configuration(on).r for of, on in ((start, there), (source.configuration, mesh)))
    np.testing.assert_allclose(moved, own, rtol=0, atol=1e-14)
    assert np.array_equal(start.r[there.ends], there.position[there.ends])


def test_a_state_whose_clamps_slid_is_a_start_under_forces_alone() -> None:
    """A similar design under the same forces begins with its clamps where the state has them, and ends where the
    initial weave leads; one with held clamps cannot."""
    design, mesh = small_cell((1, 2), elements=8)
    loose = replace(design, clamps=Clamps(0.2, 0.0))
    source = relax(mesh, loose).configuration
    softer = replace(
        loose, contact=replace(design.contact, penalty=4.0), numerics=replace(design.numerics, elements=12)
    )
    there = build_mesh(softer)
    start = from_state(there, softer, source, mesh)
    far = there.end_nodes(1)
    assert np.abs(start.r - there.position)[far].max() > 0.01
    np.testing.assert_allclose(start.r[far], source.r[mesh.end_nodes(1)], rtol=0, atol=1e-14)
    direct, found = relax(there, softer), relax(there, softer, start)
    assert found.iterations < direct.iterations
    assert found.energy == pytest.approx(direct.energy, rel=1e-4)  # the work of clamps that slide is of first order
    assert np.abs(found.configuration.r - direct.configuration.r).max() < 0.01 * float(mesh.radius[0])
    for held in (design, replace(design, clamps=Clamps(warp_force=0.2))):
        with pytest.raises(DesignError, match="or have slid under a force that this design gives as well"):
            from_state(mesh, held, source, mesh)
    askew = source.x.copy()
    askew[mesh.end_nodes(1)[0], 0, 0] += 1e-6  # one fibril of the yarn
    with pytest.raises(DesignError, match="or have slid"):
        from_state(mesh, loose, Configuration(askew), mesh)


def test_what_has_no_smaller_cell_is_refused() -> None:
    design, mesh = small_cell((1,), yarns=2)
    with pytest.raises(DesignError, match=r"start: 'tiled' is not usable; the draft of 2 x 2 yarns is no whole number"):
        tiled(mesh, design)
    design, _ = small_cell((1,), yarns=4)
    with pytest.raises(DesignError, match="no cell repeats in a random packing"):
        repeated_cell(replace(design, packing=Packing(seed=1, lateral=0.01)))


def test_the_error_of_a_cell_without_equilibrium_says_whose_it_is() -> None:
    design, mesh = single(4, 8)
    with pytest.raises(ConvergenceError, match=r"the smaller cell of the start: .*1 iteration"):
        tiled(mesh, replace(design, numerics=replace(design.numerics, max_iterations=1)))


def test_states_of_other_yarns_or_under_strain_are_refused(small: tuple[Design, FibrilMesh, Equilibrium]) -> None:
    design, mesh, source = small
    other, there = small_cell((1, 2))
    with pytest.raises(DesignError, match=r"this design's, warp and weft: \[1, 1\] and \[1, 1\], \[3, 3\] and"):
        from_state(there, other, source.configuration, mesh)
    tall, wide = (with_draft(design, draft) for draft in (((0,), (1,), (0,)), ((0, 1, 0),)))
    ends = initial_configuration(build_mesh(wide))  # of four yarns as well, but of one warp and three weft
    with pytest.raises(DesignError, match=r"warp and weft: \[1\] and \[1, 1, 1\], \[1, 1, 1\] and \[1\]"):
        from_state(build_mesh(tall), tall, ends, build_mesh(wide))
    strained = source.configuration.x.copy()
    strained[:, 0, 0] *= 1.01
    with pytest.raises(DesignError, match="a relaxed state, without strain"):
        from_state(mesh, design, Configuration(strained), mesh)


def test_a_start_on_the_wrong_sides_or_inside_out_is_refused(small: tuple[Design, FibrilMesh, Equilibrium]) -> None:
    design, mesh, source = small
    check_start(mesh, design, source.configuration, "state")
    through = source.configuration.x.copy()
    through[:, 0, 2] *= -1.0
    with pytest.raises(
        DesignError, match=r"in it fibril 1 of warp1 and fibril 1 of weft1 have passed through .*other pairs"
    ):
        check_start(mesh, design, Configuration(through), "state")
    turned = source.configuration.x.copy()
    turned[:, 1] *= -1.0
    with pytest.raises(DesignError, match="inside out"):
        check_start(mesh, design, Configuration(turned), "state")
