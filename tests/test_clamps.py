"""Clamps under a given force: closed forms, the dual problem, the slope of the energy, and what contradicts them."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from fabrics import small_cell
from small_design import SMALL
from test_increment import AREA, E, pull, straight_cell
from test_natural import cell as natural_cell
from test_scaling import Scale, differing, mechanics, scaled

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.design import Clamps, Design, Packing, biaxial, parse_design, plain_weave, strain_grid, uniaxial
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.motions import Motions
from circuittex.relaxation.increment import advance
from circuittex.relaxation.relax import Equilibrium, relax
from circuittex.relaxation.starts import tiled
from circuittex.results.clamps import extensions, tensions
from circuittex.results.store import load_study, write_study_start
from circuittex.results.summary import table, write_summary
from circuittex.study.error_estimate import estimate_error
from circuittex.study.run import run_study

pytestmark = pytest.mark.xdist_group("clamps")  # what its fixtures make serves one worker

REST = np.eye(2)
TIGHT = 1e-9  # N; forces are some 0.1 N, compliances below 10 mm/N: lengths to 1e-8 mm
STRAIGHT = 1e-8  # N, that of `straight_cell`
ROUNDED = 1e-12  # relative, of small dense matrices of moderate condition


def under(design: Design, warp: float | str = "held", weft: float | str = "held") -> Design:
    return replace(design, clamps=Clamps(warp, weft))


@pytest.fixture(scope="module")
def bulky() -> tuple[Design, FibrilMesh, Equilibrium]:
    """Three fibrils a yarn in a random packing, nothing alike, under 0.2 N a warp and 0.1 N a weft yarn."""
    design, _ = small_cell((1, 2), tolerance=f"{TIGHT} N")
    design = replace(under(design, 0.2, 0.1), packing=Packing(seed=1, lateral=0.01, vertical=0.01, phase=0.05))
    mesh = build_mesh(design)
    return design, mesh, relax(mesh, design)


Cell = tuple[Design, FibrilMesh, Equilibrium]


# ---- the mechanics: q = T p + b -------------------------------------------------------------------------------


def dense_case(shift: float) -> tuple[Floats, Floats, Motions, np.ndarray]:
    """A matrix (8, 8), its T (8, 6) and the motions in it: 2 and 3 apart, 6 and 7 together, half of them with 2."""
    rng = np.random.default_rng(3)
    a = rng.standard_normal((8, 8))
    matrix = a @ a.T + shift * np.eye(8)
    unknown, motion, part = (2, 3, 6, 7, 6), (0, 0, 1, 1, 0), (1.0, -1.0, 1.0, 1.0, 0.5)
    motions = Motions(np.array(unknown), np.array(motion), np.array(part), np.array([2, 7]))
    free = np.array([0, 1, 4, 5])
    together = np.hstack([np.eye(8)[:, free], motions.matrix(8).toarray()])
    return matrix, together, motions, free


def solver(matrix: Floats, free: np.ndarray, motions: Motions):  # type: ignore[no-untyped-def]
    held = np.eye(8)
    held[np.ix_(free, free)] = matrix[np.ix_(free, free)]
    mask = np.isin(np.arange(8), free)
    return motions.solve(lambda b: np.linalg.solve(held, b), sp.csr_array(np.triu(matrix)), mask)


def test_motions_are_columns_of_t() -> None:
    """Against the dense T (T^T K T)^-1 T^T f."""
    matrix, together, motions, free = dense_case(1.0)
    f = np.random.default_rng(4).standard_normal(8)
    force = np.zeros(8)
    force[free], force[motions.leader] = f[free], motions.forces(f)
    np.testing.assert_allclose(motions.forces(f), (together.T @ f)[4:], rtol=ROUNDED)
    expected = together @ np.linalg.solve(together.T @ matrix @ together, together.T @ f)
    solve = solver(matrix, free, motions)
    np.testing.assert_allclose(solve(force), expected, rtol=0, atol=ROUNDED * np.abs(expected).max())


def test_a_tangent_that_only_the_motions_make_indefinite_is_refused() -> None:
    matrix, together, motions, free = dense_case(1.0)
    matrix[2, 2] -= 100.0
    assert (
        np.linalg.eigvalsh(matrix[np.ix_(free, free)])[0] > 0.0 > np.linalg.eigvalsh(together.T @ matrix @ together)[0]
    )
    assert solver(matrix, free, motions) is None


# ---- straight yarns: closed forms --------------------------------------------------------------------------------


def stretch_under(force: float, modulus: float = E) -> float:
    """s of mu A (s - 1/s) = F, neo-Hookean with nu = 0, mu = E / 2."""
    f = force / (modulus / 2 * AREA)
    return float(f + np.sqrt(f * f + 4)) / 2


def test_a_straight_yarn_stretches_by_force_over_stiffness() -> None:
    """u = F L / (E A), to the next order in F / (E A) = 1e-5, which is half of that: (s - 1/s) / 2 = e - e^2 / 2."""
    design, mesh = straight_cell(elements=4)
    force = 1e-5 * E * AREA
    design = replace(under(design, force), numerics=replace(design.numerics, tolerance=f"{1e-9 * force} N"))
    found = relax(mesh, design)
    np.testing.assert_allclose(extensions(mesh, found.configuration)[:2], force / (E * AREA), rtol=1e-5)
    assert np.abs(extensions(mesh, found.configuration)[2:]).max() == 0.0


@pytest.mark.parametrize("force", [0.1, 0.5])
def test_a_straight_yarn_stretches_far(force: float) -> None:
    design, mesh = straight_cell(elements=4)
    found = relax(mesh, under(design, force, 0.0))
    stretch = 1 + extensions(mesh, found.configuration)
    assert stretch[:2] == pytest.approx(stretch_under(force), abs=1e-7)
    assert stretch[2:] == pytest.approx(1.0, abs=1e-7)  # no axial force: as long as it is by nature
    assert tensions(mesh, found.reaction) == pytest.approx([force, force, 0.0, 0.0], abs=STRAIGHT)
    assert pull(stretch[0]) == pytest.approx(force, abs=STRAIGHT)
    middle = found.configuration.r[mesh.end_nodes(-1)] + found.configuration.r[mesh.end_nodes(+1)]
    assert np.abs(middle[:2, 0]).max() < 1e-12  # either clamp moves as far


def test_unequal_fibrils_share_the_force_and_end_side_by_side() -> None:
    """Springs side by side: sum of E_i / 2 A (s - 1/s) = F, and the stiffer one carries more of it."""
    design, mesh = small_cell((2,), elements=4, tolerance=f"{TIGHT} N")
    up = np.tile([0.0, 0.0, 1.0], (mesh.n_nodes, 1))
    along = np.eye(3)[mesh.yarn_axis[mesh.yarn[mesh.node_fibril]]]
    flat = mesh.position * [1.0, 1.0, 0.0] + 10.0 * along[:, 1:2] * up
    moduli = np.tile([5.0, 20.0], 4)
    mesh = replace(mesh, position=flat, directors=np.stack([np.cross(up, along), up], axis=1), youngs_modulus=moduli)
    found = relax(mesh, under(design, 0.3))
    stretch = stretch_under(0.3, moduli[:2].sum())
    assert 1 + extensions(mesh, found.configuration)[:2] == pytest.approx(stretch, abs=1e-8)
    ends = found.configuration.r[mesh.end_nodes(+1)[:4], 0]
    assert ends[0] == ends[1]
    assert ends[2] == ends[3]
    shares = found.reaction[mesh.end_nodes(+1)[:2], 0]
    assert shares == pytest.approx(0.3 * moduli[:2] / moduli[:2].sum(), abs=TIGHT)


def test_a_sheared_yarn_stretches_along_itself() -> None:
    """F lays the warp along (1, g); its length under a force does not know of that, and the weft is only displaced."""
    design, mesh = straight_cell(elements=4)
    design, g = under(design, 0.2), 0.2
    rest, gradient = relax(mesh, design), np.array([[1.0, 0.0], [g, 1.0]])
    sheared = advance(mesh, design, rest.configuration, REST, gradient).equilibrium
    assert 1 + extensions(mesh, sheared.configuration)[:2] == pytest.approx(stretch_under(0.2), abs=1e-7)
    apart = sheared.configuration.r[mesh.end_nodes(+1)] - sheared.configuration.r[mesh.end_nodes(-1)]
    assert apart[:2, 1] == pytest.approx(g * apart[:2, 0], abs=1e-12)
    assert tensions(mesh, sheared.reaction, gradient)[:2] == pytest.approx(0.2, abs=STRAIGHT)


# ---- weaves ------------------------------------------------------------------------------------------------------


def test_clamps_pull_with_the_given_force(bulky: Cell) -> None:
    """Their two forces add up to twice the tension, to what the solver left; crossing yarns push the yarn along, so
    that in a random packing neither of them alone does."""
    _, mesh, found = bulky
    given = np.array([0.2, 0.2, 0.1, 0.1])
    assert found.residual <= TIGHT
    assert np.abs(tensions(mesh, found.reaction) - given).max() <= found.residual
    plus = [found.reaction[mesh.end_nodes(+1)][mesh.yarn == yarn, mesh.yarn_axis[yarn]].sum() for yarn in range(4)]
    assert np.abs(plus - given).max() > 100 * TIGHT
    assert np.abs(found.reaction.sum(axis=0)).max() <= mesh.n_nodes * TIGHT
    inside = np.setdiff1d(np.arange(mesh.n_nodes), mesh.ends)
    assert np.abs(found.reaction[inside]).max() <= found.residual


def test_clamps_move_along_their_yarn_alone(bulky: Cell) -> None:
    _, mesh, found = bulky
    for side in (-1, +1):
        ends = mesh.end_nodes(side)
        moved = found.configuration.r[ends] - mesh.position[ends]
        axis = mesh.yarn_axis[mesh.yarn]
        assert np.abs(np.delete(moved.T, 2, axis=0)[1 - axis, np.arange(len(axis))]).max() == 0.0
        assert np.abs(moved[:, 2]).max() == 0.0
        own = moved[np.arange(len(axis)), axis].reshape(4, 3)
        assert np.abs(own - own[:, :1]).max() < 1e-14  # rounding of positions of some mm
        assert np.abs(own).min() > 1e-3
    assert np.ptp(extensions(mesh, found.configuration)[:2]) > 1e-6  # each yarn by its own length


def test_the_potential_falls_to_a_minimum(bulky: Cell) -> None:
    _, mesh, found = bulky
    potential = found.history[:, 1]
    assert np.all(np.diff(potential) <= 1e-12 * np.abs(potential).max())
    work = 2.0 * (tensions(mesh, found.reaction) * extensions(mesh, found.configuration)).sum() * 2.0  # 4 mm a yarn
    assert found.energy - work == pytest.approx(potential[-1], abs=1e-6)  # forces to TIGHT; chords of bent packings


@pytest.fixture(scope="module")
def single() -> Cell:
    """One fibril a yarn, whose equilibrium is the only one near; the warp under 0.05 N, the weft held."""
    design, mesh = small_cell((1,), elements=8, tolerance=f"{TIGHT} N")
    design = under(design, 0.05)
    return design, mesh, relax(mesh, design)


def held_at(single: Cell, further: float = 0.0) -> Equilibrium:
    """The cell from its start with all clamps held, those of the warp where the force took them, or `further` (mm)."""
    design, mesh, found = single
    x, ends = initial_configuration(mesh).x.copy(), mesh.ends
    warp = mesh.yarn_axis[mesh.yarn] == 0
    ratio = 1 + extensions(mesh, found.configuration)[0]
    along = warp[mesh.node_fibril]
    x[along, 0, 0] *= ratio
    x[ends, 0] = found.configuration.x[ends, 0]
    x[mesh.end_nodes(+1)[warp], 0, 0] += further
    x[mesh.end_nodes(-1)[warp], 0, 0] -= further
    return relax(mesh, under(design), Configuration(x))


def test_the_displacement_that_came_out_gives_the_force_back(single: Cell) -> None:
    """Duality: held where they went, the clamps carry the force, and all fibrils are where they were."""
    _, mesh, found = single
    again = held_at(single)
    assert tensions(mesh, again.reaction)[:2] == pytest.approx(0.05, abs=100 * TIGHT)
    assert np.abs(again.configuration.r - found.configuration.r).max() < 1e-6
    assert again.energy == pytest.approx(found.energy, rel=1e-8)


def test_the_force_is_the_slope_of_the_energy_of_held_cells(single: Cell) -> None:
    """Castigliano: dU / d(distance of the clamps), from two cells held h to either side: to second order in h."""

    def slope(h: float) -> float:
        return (held_at(single, h).energy - held_at(single, -h).energy) / (2 * 2 * 2 * h)  # two yarns, either clamp

    coarse, fine = (slope(h) - 0.05 for h in (0.005, 0.0025))
    assert abs(fine) < 1e-4 * 0.05
    assert coarse / fine == pytest.approx(4.0, rel=0.1)


def test_off_the_loom_no_yarn_has_a_tension() -> None:
    """And the cell, which held clamps keep in tension, shrinks."""
    design, mesh = small_cell((1, 2), tolerance=f"{TIGHT} N")
    found = relax(mesh, under(design, 0.0, 0.0))
    assert np.abs(tensions(mesh, found.reaction)).max() <= found.residual <= TIGHT
    assert extensions(mesh, found.configuration).max() < -0.01
    assert found.energy < relax(mesh, design).energy


def test_a_fabric_set_in_its_weave_stays_as_it_is_off_the_loom() -> None:
    design = natural_cell("path", 1.0, amplitude=0.16)
    design = under(design, 0.0, 0.0)
    mesh = build_mesh(design)
    found = relax(mesh, design)
    assert found.iterations == 0
    assert same(found.configuration, initial_configuration(mesh))


def test_a_start_from_copies_of_a_cell_has_its_clamps_where_they_were_laid_out() -> None:
    """Copies meet where they are held; from there the clamps of the whole slide."""
    design, mesh = small_cell((1,), yarns=4, elements=12, tolerance=f"{TIGHT} N")
    design = under(design, 0.03, 0.0)
    start = tiled(mesh, design)
    assert np.array_equal(start.r[mesh.ends], mesh.position[mesh.ends])
    found = relax(mesh, design, start)
    assert np.abs(tensions(mesh, found.reaction) - np.repeat([0.03, 0.0], 4)).max() <= TIGHT


# ---- with loadings ----------------------------------------------------------------------------------------------


def test_one_direction_is_stretched_and_the_other_keeps_its_force() -> None:
    """Crimp goes over: the weft, under its force, is drawn in; there is no friction, so the way back ends at rest."""
    design, mesh = small_cell((1,), elements=8, tolerance=f"{TIGHT} N")
    design, pulled = under(design, "held", 0.02), np.diag([1.1, 1.0])
    rest = relax(mesh, design)
    there = advance(mesh, design, rest.configuration, REST, pulled, gripped="x").equilibrium
    back = advance(mesh, design, there.configuration, pulled, REST, gripped="x").equilibrium
    for state in (rest, there, back):
        assert np.abs(tensions(mesh, state.reaction)[2:] - 0.02).max() <= TIGHT
    assert extensions(mesh, there.configuration)[:2] == pytest.approx(0.1, abs=1e-12)
    assert extensions(mesh, there.configuration)[2] < extensions(mesh, rest.configuration)[2] - 1e-4
    assert np.abs(back.configuration.r - rest.configuration.r).max() < 1e-6


def test_a_stretch_grips_the_clamps_where_their_force_took_them() -> None:
    design, mesh = small_cell((1,), elements=8, tolerance=f"{TIGHT} N")
    design = under(design, 0.05, 0.02)
    rest = relax(mesh, design)
    still = advance(mesh, design, rest.configuration, REST, REST, gripped="xy").equilibrium
    assert np.abs(tensions(mesh, still.reaction) - [0.05, 0.05, 0.02, 0.02]).max() <= TIGHT
    there = advance(mesh, design, rest.configuration, REST, 1.02 * REST, gripped="xy").equilibrium
    ratio = (1 + extensions(mesh, there.configuration)) / (1 + extensions(mesh, rest.configuration))
    assert ratio == pytest.approx(1.02, abs=1e-12)
    assert tensions(mesh, there.reaction).min() > 0.021


# ---- scales -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [Scale(s=-1), Scale(s=-12, m=3), Scale(s=10, m=-7)], ids=str)
def test_the_same_at_every_scale(scale: Scale, scale_free: dict[str, object]) -> None:
    assert differing(both(scale), scale_free) == []


@pytest.fixture(scope="module")
def scale_free() -> dict[str, object]:
    return both(Scale())


def both(scale: Scale) -> dict[str, object]:
    """A relaxed and a stretched state at the scale, which is then taken out."""
    design, _ = small_cell((2,), elements=6)
    force = 2.0**scale.m * 4.0**scale.s
    there = under(scaled(replace(design, weave=replace(design.weave, amplitude=0.3)), scale), 0.2 * force, 0.0)
    mesh = build_mesh(there)
    rest = relax(mesh, there)
    gradient = np.array([[1.0, 0.0], [0.05, 1.02]])
    pulled = advance(mesh, there, rest.configuration, REST, gradient, gripped="y").equilibrium
    return {
        f"{key} {name}": value
        for name, state in (("relaxed", rest), ("pulled", pulled))
        for key, value in mechanics(state, scale).items()
    }


def test_a_weave_seven_times_as_large_slides_by_seven_times_as_much() -> None:
    """The first descent is made in the fibrils' own units, in which both have the same numbers."""

    def slid(s: float) -> tuple[Floats, Floats]:
        design = plain_weave(yarns=2, rows=(1,))
        yarn, weave = design.weave.warp[0], design.weave
        yarn = replace(yarn, radius=s * 0.15, spacing=s * 0.3, row_spacing=s * 0.3)
        weave = replace(weave, pitch=s * 2.0, amplitude=s * 0.2, warp=(yarn, yarn), weft=(yarn, yarn))
        design = under(replace(design, weave=weave, numerics=replace(design.numerics, elements=6)), s * s * 0.05)
        mesh = build_mesh(design)
        found = relax(mesh, design)
        return extensions(mesh, found.configuration), tensions(mesh, found.reaction) / (s * s)

    (slide, tension), (known, force) = slid(7.0), slid(1.0)
    np.testing.assert_allclose(slide, known, rtol=0, atol=1e-12)
    np.testing.assert_allclose(tension, force, rtol=0, atol=1e-12)


# ---- designs ----------------------------------------------------------------------------------------------------

SLACK = SMALL + '\n[clamps]\nwarp_force = "20 mN"\nweft_force = 0\n'


def test_a_design_states_it_in_any_unit_of_force() -> None:
    assert parse_design(tomllib.loads(SLACK)).clamps.forces == (0.02, 0.0)
    assert parse_design(tomllib.loads(SMALL)).clamps.held


def test_what_cannot_be_is_refused_at_once() -> None:
    design = plain_weave(yarns=2, rows=(1,))
    with pytest.raises(DesignError, match=r"^clamps\.warp_force: -1\.0 .*>= 0"):
        Clamps(-1.0)
    with pytest.raises(DesignError, match=r"^clamps\.weft_force: 'loose' .*'held'"):
        Clamps(0.0, "loose")
    with pytest.raises(DesignError, match=r"^clamps\.weft_force: 'loose' .* in N .* or 'held'"):
        parse_design(tomllib.loads(SMALL + '[clamps]\nweft_force = "loose"\n'))
    with pytest.raises(DesignError, match=r"^clamps\.weft_force: 1\.0 .*at most 0\.7069 N"):
        under(design, 0.0, 1.0)
    strip = (uniaxial("strip", (0.1,), free="y"),)
    with pytest.raises(DesignError, match=r"^loading\.strip\.free: 'y' .*cannot be let go"):
        under(replace(design, loading=strip), "held", 0.1)
    under(replace(design, loading=strip), "held", 0.0)  # no force, and let go to the sides as well
    with pytest.raises(DesignError, match=r"^loading\..*\.start: .*relaxed one"):
        under(replace(design, loading=strain_grid("both", "x", (0.1,), "y", (0.1,))), 0.1)
    under(replace(design, loading=(biaxial("both", (0.1,)),)), 0.1, 0.0)


def test_a_study_tells_force_and_slide_and_comes_back(tmp_path: Path) -> None:
    design = parse_design(tomllib.loads(SLACK))
    design = replace(design, loading=(uniaxial("pull", (0.02,), axis="x"),))
    study = run_study(design, branches=True, workers=1)
    relaxed, pulled = study.records
    strain = extensions(study.mesh, relaxed.configuration)
    assert tensions(study.mesh, relaxed.reaction) == pytest.approx([0.02, 0.02, 0.0, 0.0], abs=1e-5)
    gripped = (1 + extensions(study.mesh, pulled.configuration)) / (1 + strain)
    assert gripped[:2] == pytest.approx(1.02, abs=1e-12)
    assert np.abs(tensions(study.mesh, pulled.reaction)[2:]).max() < 1e-5
    write_study_start(tmp_path / "results.h5", study)
    assert same(load_study(tmp_path / "results.h5"), study)
    again = relax(study.mesh, design, relaxed.configuration)
    assert again.iterations == 0
    assert not any(check.bifurcation for check in study.branches)
    text = table(study)
    assert f"Under 0.02 N a yarn (reached: {0.02:.4g} to {0.02:.4g} N) the clamps of the warp" in text
    assert f"slid by {100 * strain[2]:+.3g}" in text
    estimate = estimate_error(design, study.mesh, pulled)
    assert not estimate.warnings
    assert next(each for each in estimate.quantities if each.name == "Fy weft").absolute < 1e-4
    write_summary(tmp_path / "summary.json", study)
    assert '"extension"' in (tmp_path / "summary.json").read_text()
