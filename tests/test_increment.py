"""Increments of loading paths: every kind of loading, free lateral edges, and steps that halve themselves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fabrics import small_cell

from circuittex.base.arrays import Floats
from circuittex.base.errors import ConvergenceError, DesignError
from circuittex.base.frozen import same
from circuittex.design import Design, Gradient, Loading, biaxial, load_unload, plain_weave, shear, uniaxial
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.relaxation import increment
from circuittex.relaxation.increment import Increment, advance
from circuittex.relaxation.relax import Equilibrium, clamp_force, relax

TIGHT = 1e-8  # N
AREA = np.pi * 0.15**2  # mm2
E = 10.0  # MPa
REST = np.eye(2)


@pytest.fixture(scope="module")
def cell() -> tuple[Design, FibrilMesh, Equilibrium]:
    """Two by two yarns of one fibril, woven and relaxed; half a turn about x takes it to itself."""
    design, mesh = small_cell((1,), tolerance=f"{TIGHT} N")
    return design, mesh, relax(mesh, design, solver=MultifrontalSolver())


Cell = tuple[Design, FibrilMesh, Equilibrium]


def follow(cell: Cell, loading: Loading) -> list[Increment]:
    """The states of a loading, from the relaxed one."""
    design, mesh, relaxed = cell
    states, now, before = [], relaxed.configuration, REST
    for target in np.array(loading.gradients):
        states.append(advance(mesh, design, now, before, target, free_edges=loading.free, solver=MultifrontalSolver()))
        now, before = states[-1].equilibrium.configuration, target
    return states


def clamps(cell: Cell, state: Increment) -> Floats:
    return clamp_force(cell[1], state.equilibrium.reaction)


def straight_cell(**numerics: Any) -> tuple[Design, FibrilMesh]:
    """Two by two single fibrils of 4 mm, straight, the weft 10 mm above the warp, out of touch: closed forms hold."""
    design, mesh = small_cell((1,), tolerance=f"{TIGHT} N", **numerics)
    along = np.eye(3)[mesh.yarn_axis[mesh.yarn[mesh.node_fibril]]]
    up = np.tile([0.0, 0.0, 1.0], (mesh.n_nodes, 1))
    directors = np.stack([np.cross(up, along), up], axis=1)
    above = 10.0 * along[:, 1:2] * up
    under = replace(design.weave, draft=tuple((0,) * len(row) for row in design.weave.draft))
    return replace(design, weave=under), replace(
        mesh, position=mesh.position * [1.0, 1.0, 0.0] + above, directors=directors
    )


def pull(stretch: float) -> float:
    """Force in a straight fibril, neo-Hookean with nu = 0: mu (s - 1/s) A with mu = E / 2, N."""
    return E / 2 * (stretch - 1 / stretch) * AREA


def ends_along(mesh: FibrilMesh, axis: int) -> np.ndarray:
    along = mesh.yarn_axis[mesh.yarn] == axis
    return np.concatenate([mesh.end_nodes(-1)[along], mesh.end_nodes(+1)[along]])


def chords(mesh: FibrilMesh, r: Floats, axis: int) -> Floats:
    minus, plus = np.split(r[ends_along(mesh, axis)], 2)
    return np.linalg.norm(plus - minus, axis=1)


# ---- every kind of loading --------------------------------------------------------------------------------


@pytest.mark.parametrize("strain", [0.05, -0.005])
def test_a_biaxial_stretch_loads_both_directions_alike(cell: Cell, strain: float) -> None:
    """A quarter turn about z takes the cell to itself, warp to weft; less strain than makes it buckle."""
    (state,) = follow(cell, biaxial("b", [strain]))
    force, rest = clamps(cell, state), clamp_force(cell[1], cell[2].reaction)
    assert force[0, 0] == pytest.approx(force[1, 1], rel=1e-5)
    assert (force[0, 0] - rest[0, 0]) * strain > 0.0


def test_shear_to_either_side_gives_the_turned_forces(cell: Cell) -> None:
    """Half a turn about x takes y to -y and z to -z: shear by g to shear by -g."""
    there, back = (follow(cell, shear("s", [g]))[0].equilibrium.reaction for g in (0.05, -0.05))
    mesh = cell[1]
    warp, turned = (clamp_force(mesh, reaction)[0] for reaction in (there, back))
    assert warp[1] > 5e-4
    assert turned == pytest.approx(warp * [1.0, -1.0, -1.0], abs=1e-6)


def test_a_turned_cell_gives_turned_forces(cell: Cell) -> None:
    """Objectivity, along a path of any gradients: F = R U against F = U."""
    angle, stretch = 0.1, np.diag([1.03, 1.0])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    path = Loading("p", (_gradient(turn), _gradient(turn @ stretch)), (0.0, 0.03))
    turned = [state.equilibrium for state in follow(cell, path)]
    rest, stretched = cell[2], follow(cell, uniaxial("u", [0.03]))[0].equilibrium
    for here, there in zip((rest, stretched), turned, strict=True):
        assert there.energy == pytest.approx(here.energy, rel=1e-7)
        force = here.reaction.copy()
        force[:, :2] = force[:, :2] @ turn.T
        assert there.reaction == pytest.approx(force, abs=1e-6)


def _gradient(matrix: Floats) -> Gradient:
    (a, b), (c, d) = matrix.tolist()
    return (a, b), (c, d)


def test_unloading_restores_every_state_of_a_reversible_path(cell: Cell) -> None:
    """Small strains rearrange nothing: without friction the way back is the way there."""
    one, top, back, rest = follow(cell, load_unload(uniaxial("c", [0.005, 0.01])))
    assert clamps(cell, top)[0, 0] > clamps(cell, one)[0, 0]
    assert clamps(cell, back) == pytest.approx(clamps(cell, one), abs=1e-6)
    assert clamps(cell, rest) == pytest.approx(clamp_force(cell[1], cell[2].reaction), abs=1e-6)


def test_compression_buckles_the_fibrils_at_eulers_load() -> None:
    """Straight fibrils: elastic to the critical strain (pi R / 2 L)^2 = 0.35 %, then at P = pi^2 E I / L^2, pinned.

    Beyond, the load of an elastica grows by half of the further strain: 0.8 % here. Twelve elements are exact to that.
    """
    design, mesh = straight_cell(elements=12)
    start = initial_configuration(mesh)

    def warp_force(strain: float) -> float:
        state = advance(mesh, design, start, REST, np.diag([1 + strain, 1.0]), solver=MultifrontalSolver())
        return float(clamp_force(mesh, state.equilibrium.reaction)[0, 0]) / 2

    assert warp_force(-0.002) == pytest.approx(pull(0.998), rel=1e-6)
    euler = np.pi**2 * E * (np.pi * 0.15**4 / 4) / 4.0**2
    assert warp_force(-0.02) == pytest.approx(-euler, rel=0.02)


# ---- free lateral edges -----------------------------------------------------------------------------------


@pytest.mark.parametrize("free", ["x", "y"])
def test_straight_free_yarns_take_their_natural_length_back(free: str) -> None:
    """Stretched by a tenth both ways and let go along one: 4 mm there, a neo-Hookean pull along the other."""
    design, mesh = straight_cell(elements=4)
    start = initial_configuration(mesh)
    state = advance(mesh, design, start, REST, 1.1 * REST, free_edges=free, solver=MultifrontalSolver())
    loose, held = (0, 1) if free == "x" else (1, 0)
    equilibrium = state.equilibrium
    assert chords(mesh, equilibrium.configuration.r, loose) == pytest.approx(4.0, abs=1e-6)
    assert chords(mesh, equilibrium.configuration.r, held) == pytest.approx(4.4, abs=1e-12)
    assert np.abs(equilibrium.reaction[ends_along(mesh, loose)]).max() <= equilibrium.residual <= TIGHT
    assert clamp_force(mesh, equilibrium.reaction)[held, held] == pytest.approx(2 * pull(1.1), abs=1e-6)


def test_two_crossings_cannot_hold_a_free_yarn(cell: Cell) -> None:
    """One yarn above it and one below only turn it out of the weave: the warp is pulled straight, the weft is slack."""
    design, mesh, _ = cell
    rest, stretched = follow(cell, Loading("f", (_gradient(REST), ((1.05, 0.0), (0.0, 1.0))), (0.0, 0.05), "y"))
    assert rest.equilibrium.energy == pytest.approx(0.0, abs=1e-6)
    for state, force in ((rest, 0.0), (stretched, 2 * pull(1.05))):
        assert clamps(cell, state)[0, 0] == pytest.approx(force, abs=1e-5)
        assert clamps(cell, state)[1] == pytest.approx([0.0, 0.0, 0.0], abs=1e-5)
        assert chords(mesh, state.equilibrium.configuration.r, 1) == pytest.approx(4.0, abs=1e-4)
        assert np.abs(state.equilibrium.reaction[ends_along(mesh, 1)]).max() <= design.numerics.force_tolerance


def test_three_crossings_hold_a_free_yarn_crimped() -> None:
    """Free ends lower the energy at every strain, carry no force, and let the yarn draw in; clamps balance."""
    design = plain_weave(yarns=3, rows=(1,))
    design = replace(design, numerics=replace(design.numerics, elements=8))
    mesh = build_mesh(design)
    relaxed = relax(mesh, design, solver=MultifrontalSolver())
    strip = follow((design, mesh, relaxed), uniaxial("strip", [0.05, 0.1], free="y"))
    clamped = follow((design, mesh, relaxed), uniaxial("held", [0.05, 0.1]))
    drawn_in = []
    for loose, held in zip(strip, clamped, strict=True):
        equilibrium = loose.equilibrium
        assert equilibrium.energy < held.equilibrium.energy
        assert np.abs(equilibrium.reaction[ends_along(mesh, 1)]).max() <= equilibrium.residual <= 1e-6
        assert np.abs(equilibrium.reaction.sum(axis=0)).max() <= mesh.n_nodes * 1e-6
        drawn_in.append(6.0 - chords(mesh, equilibrium.configuration.r, 1).min())
        assert drawn_in[-1] > 0.05
    first, second = (clamp_force(mesh, s.equilibrium.reaction)[0, 0] for s in strip)
    assert 3 * pull(1.05) < first < second


def test_what_can_be_free_is_named() -> None:
    design, mesh = straight_cell()
    with pytest.raises(DesignError, match=r"^free_edges: 'z' .*'x', 'y'"):
        advance(mesh, design, initial_configuration(mesh), REST, REST, free_edges="z")


# ---- steps that halve themselves --------------------------------------------------------------------------


def test_halves_lead_where_the_whole_step_leads(cell: Cell) -> None:
    design, mesh, relaxed = cell
    limited = replace(design, numerics=replace(design.numerics, max_iterations=2))
    said: list[str] = []
    target = np.diag([1.02, 1.0])
    halved = advance(mesh, limited, relaxed.configuration, REST, target, solver=MultifrontalSolver(), say=said.append)
    whole = advance(mesh, design, relaxed.configuration, REST, target, solver=MultifrontalSolver())
    assert whole.parts == 1
    assert whole.iterations == whole.equilibrium.iterations > 2
    assert halved.parts == 1 + len(said) > 1
    assert said[0].startswith("the step did not converge (no equilibrium after 2 iterations: ")
    assert said[0].endswith("; trying it in 2 halves")
    assert halved.equilibrium.reaction == pytest.approx(whole.equilibrium.reaction, abs=1e-6)


def test_a_step_that_starts_inside_out_is_halved() -> None:
    """Fibrils turned by 140 degrees have their directors behind them, even as predicted; half way they do not."""
    # Half way they buckle and touch themselves: how many more halves that takes is chance.
    design, mesh = straight_cell(yarns=1, elements=4)
    angle = np.deg2rad(140)
    target = 1.2 * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    said: list[str] = []
    start = initial_configuration(mesh)
    state = advance(mesh, design, start, REST, target, solver=MultifrontalSolver(), say=said.append)
    assert state.parts > 1
    assert "inside out" in said[0]
    force = clamp_force(mesh, state.equilibrium.reaction)
    assert force[0, :2] == pytest.approx(pull(1.2) * target[:, 0] / 1.2, abs=1e-5)


Tried = list[tuple[float, float]]


@pytest.fixture
def brittle(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[Increment, Tried, list[str]]]:
    """`advance` from strain 0 to 1 with a `relax` that fails as it is told, each of its tries costing 5 iterations."""

    def run(fails: Callable[[float, float], bool]) -> tuple[Increment, Tried, list[str]]:
        tried: Tried = []
        said: list[str] = []

        def relax(mesh: FibrilMesh, design: Design, start: Configuration, **_: object) -> Equilibrium:
            before = tried[-1][1] if tried and not fails(*tried[-1]) else (tried[-1][0] if tried else 0.0)
            tried.append((before, round(float(start.x[0, 0, 0]) - 1.0, 12)))
            if fails(*tried[-1]):
                raise ConvergenceError("too far", np.zeros((6, 4)))
            none = np.zeros((1, 3))
            return Equilibrium(start, none, none, 0.0, 0.0, 5, np.zeros((6, 4)))

        monkeypatch.setattr(increment, "relax", relax)
        monkeypatch.setattr(increment, "check_sides", lambda *_: None)
        design, mesh = small_cell((1,))
        start = Configuration(np.ones((1, 3, 3)))
        return advance(mesh, design, start, REST, np.diag([2.0, 1.0]), say=said.append), tried, said

    return run


def test_parts_grow_again_after_the_hard_stretch(brittle: Callable[..., Any]) -> None:
    """Only steps over 0.3 of more than 0.1 fail: halves where it is hard, in the order of the path."""
    result, tried, said = brittle(lambda before, after: before < 0.3 < after and after - before > 0.1)
    assert [each for each in tried if not (each[0] < 0.3 < each[1] and each[1] - each[0] > 0.1)] == [
        *[(0.0, 0.25), (0.25, 0.3125), (0.3125, 0.375), (0.375, 0.5), (0.5, 1.0)]
    ]
    assert (result.parts, result.iterations) == (5, 5 * len(tried))
    assert len(said) == len(tried) - 5
    assert said == [
        "the step did not converge (too far); trying it in 2 halves",
        "the step from 0 to 1/2 of its length did not converge (too far); trying it in 2 halves",
        "the step from 1/4 to 1/2 of its length did not converge (too far); trying it in 2 halves",
        "the step from 1/4 to 3/8 of its length did not converge (too far); trying it in 2 halves",
    ]


def test_a_path_that_cannot_be_followed_says_how_far_it_came(brittle: Callable[..., Any]) -> None:
    with pytest.raises(ConvergenceError) as caught:
        brittle(lambda before, after: after > 0.305)
    assert str(caught.value) == (
        "the loading path was followed up to F = [[1.296875, 0.0], [0.0, 1.0]], 19/64 of the step; "
        "the next 1/64 of the step did not converge: too far"
    )
    assert caught.value.history.shape == (6, 4)
    with pytest.raises(ConvergenceError, match="up to the state before the step; the next 1/64"):
        brittle(lambda before, after: True)


def test_an_interruption_is_no_reason_to_halve(cell: Cell) -> None:
    design, mesh, relaxed = cell

    def interrupt(iteration: int, _: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        advance(mesh, design, relaxed.configuration, REST, 1.1 * REST, report=interrupt)


def test_a_step_of_no_length_changes_nothing(cell: Cell) -> None:
    design, mesh, relaxed = cell
    state = advance(mesh, design, relaxed.configuration, REST, REST, solver=MultifrontalSolver())
    assert (state.parts, state.iterations) == (1, 0)
    assert same(state.equilibrium.configuration, relaxed.configuration)
