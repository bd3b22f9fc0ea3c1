"""Small designs at scales far from the paper's, which went wrong as long as tolerances, shifts and masses had units."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import pi
from pathlib import Path

import numpy as np
import pytest
from beams import rest, rod
from scipy.optimize import brentq

from circuittex.base.errors import ConvergenceError
from circuittex.base.frozen import same
from circuittex.contact.extract import contacts_of
from circuittex.design import ContactLaw, Design, Material, Numerics, Yarn, load_design, plain_weave
from circuittex.electrical.fields import solve_probes
from circuittex.fit import Fit, fit_network
from circuittex.geometry.weave import build_mesh
from circuittex.mech.beam import Beam
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.space import beam_space
from circuittex.relaxation.increment import advance
from circuittex.relaxation.relax import Equilibrium, clamp_force, relax

FOLDER = Path(__file__).parent / "cases"
CLOSE = 1e-4
"""What the tolerance and the section's rule leave in forces and resistances, relative, is far less."""
ROUNDED = 1e-14
"""Some tens of roundings of factors, relative."""
PRINTED = 6e-4
"""Half a unit of the last of the four digits to which some of the values are known."""


@cache
def found(name: str) -> tuple[Design, Equilibrium, Fit]:
    """A case's design, its equilibrium with the default tolerance, and the reduced network."""
    design = load_design(FOLDER / f"{name}.toml")
    mesh = build_mesh(design)
    equilibrium = relax(mesh, design)
    fields = solve_probes(contacts_of(design, mesh, equilibrium.configuration), design.terminals, design.probes)
    return design, equilibrium, fit_network([each.currents[0] for each in fields], design)


def pull(name: str) -> tuple[float, float]:
    """Clamp force of the warp along x and of the weft along y, N."""
    design, equilibrium, _ = found(name)
    force = clamp_force(build_mesh(design), equilibrium.reaction)
    return float(force[0, 0]), float(force[1, 1])


def with_density(design: Design, density: float) -> Design:
    def kinds(yarns: tuple[Yarn, ...]) -> tuple[Yarn, ...]:
        return tuple(replace(y, materials=tuple(replace(m, density=density) for m in y.materials)) for y in yarns)

    return replace(design, weave=replace(design.weave, warp=kinds(design.weave.warp), weft=kinds(design.weave.weft)))


def test_fibrils_of_a_micrometre_are_relaxed_and_touch() -> None:
    """A hundredth of a cell of 0.15 mm fibrils relaxed to 1e-8 N, where F = 4.7200975e-3 N and Rc = 9490.46 ohm.

    F goes with s^2, Rc with 1/s^2, and with 1/s where sigma_c goes with 1/s. Ry = L / (n sigma A).
    """
    s = 0.01
    assert pull("fine_scale") == pytest.approx([4.7200975e-3 * s**2] * 2, rel=CLOSE)
    fit = found("fine_scale")[2]
    assert fit.Ry == pytest.approx(20e-3 / (2 * 10 * pi * 1.5e-3**2), rel=CLOSE)
    assert fit.Rc == pytest.approx(9490.46 / s**2, rel=CLOSE)
    assert found("fine_scale_contact")[2].Rc == pytest.approx(9490.46 / s, rel=CLOSE)
    assert same(found("fine_scale_contact")[1], found("fine_scale")[1])


def test_steel_is_in_equilibrium_where_its_forces_say_so() -> None:
    """With a tolerance of 1e-4 N the clamps were known to carry 2032 N, and Rc to be 4399 ohm."""
    assert pull("large_forces") == pytest.approx([2032.0] * 2, rel=PRINTED)
    fit = found("large_forces")[2]
    assert fit.Ry == pytest.approx(2 / (3 * 10 * pi * 0.15**2), rel=CLOSE)
    assert fit.Rc == pytest.approx(4399, rel=PRINTED)


def test_thick_steel_is_as_easy() -> None:
    """All lengths times 10 on half as many elements: forces a hundred times as large, up to what the mesh changes."""
    thin, thick = pull("large_forces"), pull("large_forces_thick")
    assert thick == pytest.approx(100 * np.array(thin), rel=1e-2)
    assert found("large_forces_thick")[2].Ry == pytest.approx(20 / (3 * 10 * pi * 1.5**2), rel=CLOSE)


def test_carbon_is_in_equilibrium_when_its_residual_says_so() -> None:
    """After 6 or 7 iterations, not after as many as chance asks for: a spin has no stiffness, whatever its mass."""
    _, equilibrium, fit = found("small_mass")
    assert equilibrium.iterations <= 7
    assert pull("small_mass") == pytest.approx([0.7183] * 2, rel=PRINTED)
    assert fit.Ry == pytest.approx(0.04655 / (3 * 10 * pi * 0.0035**2), rel=CLOSE)
    assert fit.Rc == pytest.approx(7.251e6, rel=PRINTED)


@pytest.mark.parametrize("density", [0.9e-3, 20e-3, 1.0, 1000.0])
def test_an_equilibrium_does_not_depend_on_density(density: float) -> None:
    design, equilibrium, _ = found("small_mass")
    other = with_density(design, density)
    assert same(relax(build_mesh(other), other), equilibrium)


def test_a_hundredth_of_a_cell_is_the_cell() -> None:
    """F goes with s^2, Ry with 1/s, Rc with 1/s^2 up to a thousandth, the part of Ry in it, in as many iterations."""
    s = 0.01
    assert found("small")[1].iterations == found("cell")[1].iterations
    assert pull("small") == pytest.approx(s**2 * np.array(pull("cell")), rel=CLOSE)
    large, small = found("cell")[2], found("small")[2]
    assert small.Ry == pytest.approx(large.Ry / s, rel=1e-3)
    assert small.Rc == pytest.approx(large.Rc / s**2, rel=1e-3)


def test_steel_is_the_cell_of_a_thousandth_of_its_modulus() -> None:
    """The same shape and half-widths, so the same Rc; a thousandth of the forces, in as many iterations."""
    assert found("steel_scaled")[1].iterations == found("steel")[1].iterations
    assert pull("steel_scaled") == pytest.approx(1e-3 * np.array(pull("steel")), rel=CLOSE)
    assert found("steel_scaled")[2].Rc == pytest.approx(found("steel")[2].Rc, rel=CLOSE)


@pytest.mark.parametrize(
    ("radius", "modulus", "density"),
    [(2.5e-3, 2e5, 7.8e-3), (3.5e-3, 2.3e5, 1.8e-3), (1.0, 0.1, 0.9e-3), (1.0, 4e5, 20e-3), (2.5e-3, 0.1, 20e-3)],
)
def test_real_fibrils_relax_as_the_papers_do(radius: float, modulus: float, density: float) -> None:
    """Whatever the ratio: in units of the fibrils' own the numbers are the same to the last bit, and so is the way."""

    def relaxed(R: float, E: float, rho: float) -> tuple[float, int]:
        s, m = R / 0.15, E / 10.0
        design = plain_weave(yarns=2, rows=(1, 2))
        design = replace(design, numerics=replace(design.numerics, elements=10))
        weave, yarn = design.weave, design.weave.warp[0]
        material = replace(yarn.materials[0], youngs_modulus=E, density=rho)
        yarn = replace(yarn, radius=R, spacing=0.3 * s, row_spacing=0.3 * s, materials=(material,) * 3)
        design = replace(
            design,
            weave=replace(weave, warp=(yarn,) * 2, weft=(yarn,) * 2, pitch=2.0 * s, amplitude=0.3 * s),
            contact=replace(design.contact, penalty=5.0 * m),
        )
        equilibrium = relax(build_mesh(design), design)
        return equilibrium.energy / (m * s**3), equilibrium.iterations

    energy, iterations = relaxed(0.15, 10.0, 1.0)
    there, took = relaxed(radius, modulus, density)
    assert there == pytest.approx(energy, rel=ROUNDED)
    assert took == iterations


@pytest.mark.parametrize("warp", [0.1, 4e5])
def test_the_soft_and_the_stiff_share_a_cell(warp: float) -> None:
    """0.1 MPa and 400 GPa: each fibril is in equilibrium by its own forces, so a sharper tolerance changes neither."""
    design = plain_weave(yarns=2, rows=(1, 2))
    weave, yarn = design.weave, design.weave.warp[0]

    def kind(modulus: float) -> Yarn:
        material = replace(yarn.materials[0], name=f"m{modulus:.0f}", youngs_modulus=modulus)
        return replace(yarn, name=f"y{modulus:.0f}", materials=(material,) * 3)

    warps, wefts = (kind(warp),) * 2, (kind(4e4 / warp),) * 2
    design = replace(
        design,
        weave=replace(weave, warp=warps, weft=wefts, amplitude=0.35),
        contact=replace(design.contact, penalty="hertz"),
        numerics=replace(design.numerics, elements=12),
    )
    sharp = replace(design, numerics=replace(design.numerics, tolerance=1e-8))
    mesh = build_mesh(design)
    rough = relax(mesh, design)
    fine = relax(mesh, sharp, rough.configuration)
    for axis in (0, 1):
        ends = mesh.end_nodes(+1)[mesh.yarn_axis[mesh.yarn] == axis]
        largest = np.abs(fine.reaction[ends]).max()
        assert np.abs(rough.reaction[ends] - fine.reaction[ends]).max() < 1e-3 * largest


def test_nothing_to_do_ends_at_once() -> None:
    """Straight, free of stress and apart: round-off is all there is, and it counts as no force."""
    design = plain_weave(yarns=2, rows=(1,))
    design = replace(design, weave=replace(design.weave, amplitude=0.2))
    mesh = build_mesh(design)
    apart = mesh.position * [1.0, 1.0, 0.0] + np.where(mesh.yarn_axis[mesh.yarn[mesh.node_fibril]] == 0, 0.2, -0.2)[
        :, None
    ] * [0.0, 0.0, 1.0]
    along = np.eye(3)[mesh.yarn_axis[mesh.yarn[mesh.node_fibril]]]
    up = np.tile([0.0, 0.0, 1.0], (mesh.n_nodes, 1))
    mesh = replace(mesh, position=apart, directors=np.stack([np.cross(up, along), up], axis=1))
    equilibrium = relax(mesh, design)
    assert equilibrium.iterations == 0
    assert equilibrium.residual < 1e-13 * 10.0 * pi * 0.15**2  # of E A


def test_a_refusal_for_forces_gives_a_force_and_the_limit_below_it() -> None:
    design = plain_weave(yarns=2, rows=(1,))
    design = replace(design, numerics=replace(design.numerics, elements=4, max_iterations=1))
    with pytest.raises(ConvergenceError, match=r"a free force of .* N is left, above the limit of") as caught:
        relax(build_mesh(design), design)
    words = str(caught.value).split()
    left, limit = (float(words[words.index(word) + 2]) for word in ("force", "limit"))
    assert left > limit


def test_a_refusal_for_a_saddle_says_so() -> None:
    """A straight bar, compressed far beyond Euler's load: its forces balance, and it is about to buckle."""
    mesh = rod(4.0, 8, 2, radius=0.15)
    space = beam_space(mesh)
    start = Configuration(initial_configuration(mesh).x * [[0.9], [1.0], [1.0]])
    with pytest.raises(ConvergenceError, match="the forces balance, but the tangent is not positive definite"):
        rest(Beam(space), start, space.fixed, tolerance=1e-9, max_iterations=0)


def test_wires_that_nothing_holds_any_more_are_at_rest() -> None:
    """Copper pulled straight between wefts whose ends are free: those touch nothing any more, and nothing holds them.

    Round-off of 1e-9 N turned them in every iteration by what stretches them, to second order, with 1e-7 N, far above
    what counts as nothing there. The warp is a straight wire then: its force is A dpsi/dlambda of [1] at the stretch of
    its length, the stress across it being zero.
    """
    material = Material("copper", 120e3, 0.34, 9e-3, 6e4, 0.4)
    yarn = Yarn("wire", (1,), 0.025, 0.0525, 0.0525, (material,))
    design = plain_weave(yarns=2, rows=(1,))
    design = replace(
        design,
        weave=replace(design.weave, warp=(yarn,) * 2, weft=(yarn,) * 2, amplitude=0.03),
        contact=ContactLaw("hertz", 0.01, 0.1),
        numerics=Numerics(elements="auto", contact_points="auto"),
    )
    mesh = build_mesh(design)
    now, gradient = relax(mesh, design).configuration, np.eye(2)
    for strain in (0.005, 0.01, 0.02):
        pulled = np.diag([1.0 + strain, 1.0])
        step = advance(mesh, design, now, gradient, pulled, free_edges="y")
        assert step.parts == 1
        now, gradient = step.equilibrium.configuration, pulled
    assert step.iterations <= 20
    force = clamp_force(mesh, step.equilibrium.reaction)
    along = 1.02 * 4.0 / mesh.length[0]
    E, nu = 120e3, 0.34
    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))

    def across(width: float) -> float:
        return float(mu * (width - 1 / width) + lam * np.log(along * width**2) / width)

    width = brentq(across, 0.9, 1.1)
    stress = mu * (along - 1 / along) + lam * np.log(along * width**2) / along
    assert force[0, 0] == pytest.approx(2 * pi * 0.025**2 * stress, rel=CLOSE)
