"""Coated fibrils: closed forms along the axis and at the contact, published clad wires, and limits that are exact."""

from __future__ import annotations

import copy
import tomllib
from dataclasses import fields, replace
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from beams import arc, rod
from skfem import Basis, BilinearForm, ElementQuad2, Functional, MeshQuad, condense, solve
from small_design import SMALL

from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.contact.extract import contacts_of
from circuittex.design import Design, Material, Yarn, design_hash, parse_design
from circuittex.design.coating import coated
from circuittex.design.declaration import keys
from circuittex.design.restated import restated
from circuittex.electrical.network.matching import groups
from circuittex.geometry.permutation import permuted
from circuittex.geometry.weave import build_mesh
from circuittex.mech.beam import Beam
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.form import BeamForm
from circuittex.mech.space import beam_space
from circuittex.results.records import Study
from circuittex.results.soundness import widest_on_shell
from circuittex.results.store import load_study
from circuittex.results.verification import AGREEMENT
from circuittex.study.library.resistivity import at_end, scaled, warmer

ROUNDING = 1e-12
"""Relative, of a few products and roots."""
NYLON = Material("nylon", 3e3, 0.3, 1.14e-3, 0.0, 0.25e-3)
SILVER = Material("silver", 80e3, 0.3, 10.5e-3, 9e3, 0.4)


def stated(yarn: dict[str, Any], **materials: dict[str, Any]) -> Design:
    """The small cell with a yarn of nylon in silver."""
    mapping = copy.deepcopy(tomllib.loads(SMALL))
    mapping["weave"]["amplitude"] = 0.14  # fibrils start a little inside one another
    mapping["materials"]["shell"] = mapping["materials"]["fibril"] | {"youngs_modulus": "20 MPa"}
    for label, changes in materials.items():
        mapping["materials"][label] |= changes
        mapping["materials"][label] = {k: v for k, v in mapping["materials"][label].items() if v is not None}
    mapping["yarns"]["conductive"] |= {"shell": "shell"} | yarn
    mapping["yarns"]["conductive"] = {k: v for k, v in mapping["yarns"]["conductive"].items() if v is not None}
    return parse_design(mapping)


def ohm_per_metre(design: Design) -> float:
    """Of the yarn, by the segment from crossing to crossing that the reduced network starts from."""
    return float(groups(design, each_crossing=False).start[0]) / design.weave.pitch * 1e3


# Along the axis


def test_silver_plated_nylon_has_its_resistance_in_a_shell_of_a_hundredth_of_the_radius() -> None:
    """117 dtex, 17 filaments, two plies, 269 ohm/m: 34 filaments, each a tube of r' = 34 x 0.269 ohm/mm."""
    R = sqrt(234e-7 / (34 * 1.14e-3 * pi))  # of the nylon
    t = 0.01 * R
    sigma = 1 / (34 * 0.269 * pi * ((R + t) ** 2 - R**2))
    yarn = {"rows": None, "radius": None, "filaments": 34, "core_linear_density": "234 dtex", "shell_thickness": t}
    silver = {"electrical_conductivity": sigma, "density": 10.5e-3}
    nylon = {"electrical_conductivity": 0, "density": 1.14e-3}
    design = stated(yarn | {"spacing": None}, fibril=nylon, shell=silver)
    assert design.weave.warp[0].radius == pytest.approx(R + t, rel=ROUNDING, abs=0)
    assert ohm_per_metre(design) == pytest.approx(269.0, rel=ROUNDING, abs=0)
    assert 5e3 < sigma < 20e3, "a third to a tenth of silver's 6.2e4 S/mm: plating is porous"
    mesh = build_mesh(design)
    assert (mesh.surface == sigma).all()
    assert mesh.electrical_conductivity == pytest.approx(178, rel=0.01), "as if it were all through: 182 in the nylon"


@pytest.mark.parametrize(("share", "ohm", "least", "density"), [(0.15, 3.79, 64.4, 0.131), (0.10, 3.91, 62.9, 0.120)])
def test_copper_clad_aluminium_is_as_its_maker_says(share: float, ohm: float, least: float, density: float) -> None:
    """MWS Wire Industries, copper clad aluminum, for 15 and 10 % of copper by volume: AWG 14 (4109 circular mils) in
    ohm per 1000 ft, the least conductivity in % of copper's, and lb/in3. Aluminium for conductors has 61 % of copper's
    58 S/um."""
    area = 4109 * pi / 4 * 25.4e-3**2  # circular mils to mm2
    published = 304.8 / (ohm * 1e-3 * area)
    assert published > least / 100 * 58e3, "the table is read rightly"
    copper = Material("copper", 117e3, 0.34, 8.89e-3, 58e3, 0.4)
    aluminium = Material("aluminium", 69e3, 0.33, 2.70e-3, 0.61 * 58e3, 0.235)
    thickness = 0.8 * (1 - sqrt(1 - share))
    wire = Yarn("wire", (1,), 0.8, 1.6, 1.6, (aluminium,), copper, thickness).fibrils[0]
    # Three printed digits, of wires that are drawn to 1 %.
    assert wire.electrical_conductivity == pytest.approx(published, rel=0.01)
    assert wire.density == pytest.approx(density * 453.59237 / 16387.064, rel=0.01)


def test_current_splits_as_in_a_section_that_is_resolved() -> None:
    """A wire of radius R and length 6 R whose shell alone is held at its ends, in r and z by finite elements.

    Away from the ends the current lies as sigma A of the two parts, and the voltage falls as along the fibril of one
    dimension; what the ends disturb fades with exp(-3.8 z / R) or faster, 1e-5 in the middle.
    """
    R, t, core, shell = 0.5, 0.1, 2.0, 7.0
    r = np.concatenate([np.linspace(0, R - t, 9), np.linspace(R - t, R, 5)[1:]])
    basis = Basis(MeshQuad.init_tensor(r, np.linspace(0, 6 * R, 37)), ElementQuad2())

    def sigma(x: np.ndarray) -> np.ndarray:
        return np.where(x[0] < R - t, core, shell) * 2 * pi * x[0]

    @BilinearForm
    def conduction(u: Any, v: Any, w: Any) -> Any:
        return sigma(w.x) * (u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1])

    ends = basis.get_dofs(lambda x: (x[0] > R - t - 1e-9) & ((x[1] < 1e-9) | (x[1] > 6 * R - 1e-9))).flatten()
    held = np.zeros(basis.N)
    held[ends] = basis.doflocs[1, ends] < R
    voltage = basis.interpolate(solve(*condense(conduction.assemble(basis), x=held, D=ends)))

    def between(low: float, high: float) -> float:
        """Current along the middle slices within two radii, A: its mean over their thickness."""

        @Functional
        def flow(w: Any) -> Any:
            inside = (np.abs(w.x[1] - 3 * R) < R / 3) & (w.x[0] > low) & (w.x[0] < high)
            return inside * -sigma(w.x) * w.V.grad[1]

        return float(flow.assemble(basis, V=voltage)) / (2 * R / 3)

    parts = np.array([between(0, R - t), between(R - t, R)])
    drop = -float(Functional(lambda w: (np.abs(w.x[1] - 3 * R) < R / 3) * w.V.grad[1]).assemble(basis, V=voltage))
    gradient = drop / (R * 2 * R / 3)
    material, other = (Material(name, 1.0, 0.0, 1.0, own, 1.0) for name, own in (("core", core), ("shell", shell)))
    fibril = Yarn("wire", (1,), R, 2 * R, 2 * R, (material,), other, t).fibrils[0]
    assert parts.sum() == pytest.approx(fibril.electrical_conductivity * pi * R**2 * gradient, rel=1e-4)
    assert parts[1] / parts.sum() == pytest.approx(
        shell * (1 - 0.8**2) / (shell * (1 - 0.8**2) + core * 0.8**2), rel=1e-4
    )


def test_all_that_adds_up_adds_up() -> None:
    """E A, rho A, sigma A and k A of two rods side by side; tc1 and tc2 of two resistors in parallel."""
    R, t = 0.014, 0.0014
    areas = np.array([pi * (R - t) ** 2, pi * R**2 - pi * (R - t) ** 2])
    core = replace(NYLON, electrical_conductivity=2e3, tc1=-1e-3, tc2=3e-6, tolerance=0.1)
    shell = replace(SILVER, tc1=4e-3, tc2=1e-6, tolerance=0.05)
    fibril = Yarn("plated", (1,), R, 2 * R, 2 * R, (core,), shell, t).fibrils[0]
    for key in ("youngs_modulus", "density", "electrical_conductivity", "thermal_conductivity"):
        both = np.array([getattr(core, key), getattr(shell, key)])
        assert getattr(fibril, key) * pi * R**2 == pytest.approx(both @ areas, rel=ROUNDING, abs=0), key

    conductance = np.array([core.electrical_conductivity, shell.electrical_conductivity]) * areas

    def resistance(kelvin: float) -> float:
        warm = [1 + each.tc1 * kelvin + each.tc2 * kelvin**2 for each in (core, shell)]
        return float(1 / (conductance / warm).sum())

    h = 0.1  # K: differences of second order, whose next term is some (tc1 h)^2 = 1e-7
    first = (resistance(h) - resistance(-h)) / (2 * h * resistance(0))
    second = (resistance(h) - 2 * resistance(0) + resistance(-h)) / (2 * h**2 * resistance(0))
    assert fibril.tc1 == pytest.approx(first, rel=1e-6, abs=0)
    assert fibril.tc2 == pytest.approx(second, rel=1e-4, abs=0), "rounding, 1e-16 / (tc2 h^2)"


def test_exported_parts_are_warmed_as_what_they_are_made_of() -> None:
    """A plated core that insulates follows the shell's tc1, and a contact that of the pair that touches."""
    mapping = tomllib.loads(SMALL)
    mapping["weave"]["amplitude"] = 0.14
    mapping["materials"]["shell"] = mapping["materials"]["fibril"] | {"tc1": "0.004 1/K"}
    mapping["materials"]["fibril"] |= {"electrical_conductivity": 0, "tc1": "-0.001 1/K"}
    mapping["yarns"]["conductive"] |= {"shell": "shell", "shell_thickness": "5 um"}
    mapping["contact"] |= {"pairs": [{"materials": ["shell", "shell"], "tc1": "0.002 1/K"}]}
    design = parse_design(mapping)
    mesh = build_mesh(design)
    cold = contacts_of(design, mesh, initial_configuration(mesh))
    warm = scaled(design, cold, warmer(50.0))
    assert warm.mesh.electrical_conductivity * 1.2 == pytest.approx(mesh.electrical_conductivity, rel=ROUNDING, abs=0)
    assert warm.conductance * 1.1 == pytest.approx(cold.conductance, rel=ROUNDING, abs=0)


def test_coated_fibrils_at_the_ends_of_tolerances_are_core_and_shell_at_theirs() -> None:
    """Two resistors in parallel, each with its own: a core with 61 % of the current that is 30 % better leaves 79 % of
    the resistance, and not 82 %, so that none of a part lies outside what is said of it."""
    design = stated(
        {"shell_thickness": "5 um"},
        fibril={"tolerance": 0.3, "tc1": "0.009 1/K"},
        shell={"tc1": "-0.009 1/K", "electrical_conductivity": "90 S/mm"},
    )
    mesh = build_mesh(design)
    cold = contacts_of(design, mesh, initial_configuration(mesh))
    R, t = design.weave.warp[0].radius, design.weave.warp[0].shell_thickness
    core, shell = 10.0 * (R - t) ** 2 / R**2, 90.0 * (1 - (R - t) ** 2 / R**2)
    assert mesh.electrical_conductivity == pytest.approx(core + shell, rel=ROUNDING, abs=0)
    for factor, of_core, of_shell in ((at_end(-1.0), 0.7, 1.0), (at_end(1.0), 1.3, 1.0), (warmer(50.0), 1.45, 0.55)):
        found = scaled(design, cold, factor).mesh.electrical_conductivity
        assert found == pytest.approx(core / of_core + shell / of_shell, rel=ROUNDING, abs=0)


def test_every_number_of_a_material_has_one_for_coated_fibrils() -> None:
    """One that `coated` forgot would have its default there, whatever core and shell say."""
    assert set(coated(NYLON, SILVER, 0.1)) == set(keys(Material))


def test_python_is_told_what_a_shell_is() -> None:
    with pytest.raises(DesignError, match=r"yarns\.plated\.shell: 'silver' is not usable; it must be a Material"):
        Yarn("plated", (1,), 1.0, 2.0, 2.0, (NYLON,), "silver", 0.1)  # type: ignore[arg-type]


# Bending


def test_a_coated_beam_bends_with_the_sum_of_e_i() -> None:
    """A straight beam bent into an arc stores E I kappa^2 L / 2; stretched, E A eps^2 L / 2."""
    R, t, L = 0.01, 0.002, 1.0
    plated = Yarn(
        "plated", (1,), R, 2 * R, 2 * R, (replace(NYLON, poisson_ratio=0.0),), replace(SILVER, poisson_ratio=0.0), t
    )
    inner = R - t
    EI = pi / 4 * (3e3 * inner**4 + 80e3 * (R**4 - inner**4))
    EA = pi * (3e3 * inner**2 + 80e3 * (R**2 - inner**2))
    mesh = rod(L, 8, 2, radius=R, modulus=plated.fibrils[0].youngs_modulus)
    mesh = replace(mesh, bending_radius=np.array(plated.bending_radii))
    beam, space = Beam(beam_space(mesh)), beam_space(mesh)

    curvature, strain = 1e-2, 1e-4  # what is beyond are their squares, of sections of R kappa = 1e-4
    bent = beam.energy(space.vector(arc(mesh.xi, curvature)))
    longer = space.vector(initial_configuration(mesh)).reshape(-1, 9)
    longer[:, 0] += strain * mesh.xi
    shorter = longer - 2 * np.eye(9)[0] * (strain * mesh.xi)[:, None]
    pulled = (beam.energy(longer.ravel()) + beam.energy(shorter.ravel())) / 2  # what is odd in the strain drops out
    # The readable form of the same energy (docs/numerics.md) has the same section.
    assert BeamForm(mesh).energy(longer.ravel()) == pytest.approx(beam.energy(longer.ravel()), rel=1e-6, abs=0)
    assert BeamForm(mesh).energy(space.vector(arc(mesh.xi, curvature))) == pytest.approx(bent, rel=1e-6, abs=0)
    assert bent / (EI * curvature**2 / 2) == pytest.approx(1.0, rel=1e-5)
    assert pulled / (EA * strain**2 / 2) == pytest.approx(1.0, rel=1e-5)


# Limits


def test_no_shell_is_the_core_bit_for_bit() -> None:
    bare, thin = stated({"shell": None}), stated({"shell_thickness": 0.0})
    assert same(build_mesh(bare), build_mesh(thin))
    assert design_hash(bare) == design_hash(parse_design(tomllib.loads(SMALL.replace("0.2 mm", "0.14 mm"))))
    assert bare.weave.warp[0].fibrils is bare.weave.warp[0].materials


def test_a_shell_of_the_core_s_own_numbers_is_the_core_bit_for_bit() -> None:
    bare = build_mesh(stated({"shell": None}))
    alike = build_mesh(stated({"shell_thickness": "20 um"}, shell={"youngs_modulus": "10 MPa"}))
    changed = {"material_names", "surface_conductivity", "bending_radius", "shell_thickness", "core_conductivity"}
    assert all(same(getattr(bare, f.name), getattr(alike, f.name)) for f in fields(bare) if f.name not in changed)
    assert same(alike.surface, bare.electrical_conductivity)
    assert same(alike.section_radius, bare.radius)


def test_a_coat_has_no_scale_of_its_own() -> None:
    """Lengths by two and moduli by four, both exact: the mesh is the same in these units, bit for bit."""
    design = stated({"shell_thickness": "15 um"})
    one, other = build_mesh(design), build_mesh(restated(design, 2.0, 4.0))
    assert same(one.bending_radius, 2.0 * other.bending_radius)
    assert same(one.youngs_modulus, 4.0 * other.youngs_modulus)
    assert same(one.electrical_conductivity, other.electrical_conductivity)


# At the contact, and through all three routes


def test_an_insulating_shell_conducts_along_and_not_across() -> None:
    design = stated({"shell_thickness": "15 um"}, shell={"electrical_conductivity": 0})
    mesh = build_mesh(design)
    assert mesh.electrical_conductivity == pytest.approx(10 * 0.9**2, rel=ROUNDING, abs=0)
    contacts = contacts_of(design, mesh, initial_configuration(mesh))
    assert contacts.n_contacts > 0
    assert (contacts.conductance == 0.0).all()
    assert (contacts.heat_conductance > 0.0).all(), "heat passes through it"


@pytest.mark.parametrize("law", ["paper", "holm"])
def test_contacts_meet_the_shell(law: str) -> None:
    """The same load and width as of bare fibrils; how the current of `holm` spreads in shells: tests/test_shells.py."""

    def contacts(yarn: dict[str, Any], core: float, shell: float) -> Any:
        moduli = {"youngs_modulus": "10 MPa"}
        design = stated(
            yarn, fibril=moduli | {"electrical_conductivity": core}, shell=moduli | {"electrical_conductivity": shell}
        )
        design = replace(design, contact=replace(design.contact, law=law))
        mesh = build_mesh(design)
        return contacts_of(design, mesh, initial_configuration(mesh))

    plated = contacts({"shell_thickness": "1.5 um"}, 10.0 if law == "holm" else 0.0, 10.0)
    bare = contacts({"shell": None}, 10.0, 0.0)
    assert plated.conductance == pytest.approx(bare.conductance, rel=ROUNDING, abs=0)
    assert (plated.conductance > 0.0).any()


@pytest.mark.parametrize(
    ("law", "core", "shell", "doubted"),
    [("holm", 2.0, 10.0, True), ("crossed", 2.0, 10.0, False), ("holm", 2.0, 1.0, False), ("holm", 0.0, 10.0, False)],
)
def test_touches_wider_than_their_shell_is_thick_are_doubted(
    law: str, core: float, shell: float, doubted: bool
) -> None:
    """Where the law knows how current spreads in a shell alone and in a half space, and the truth lies between."""
    design = stated(
        {"shell_thickness": "1 um"}, fibril={"electrical_conductivity": core}, shell={"electrical_conductivity": shell}
    )
    design = replace(design, contact=replace(design.contact, law=law))
    mesh = build_mesh(design)
    start = initial_configuration(mesh)
    study = Study(version="", design=design, design_hash="", mesh=mesh, initial=start, records=())
    contacts = contacts_of(design, mesh, start)
    expected = contacts.width.max() / 1e-3 if doubted else 0.0
    assert contacts.width.max() > 1e-3
    assert widest_on_shell(study, contacts) == pytest.approx(expected, rel=ROUNDING, abs=0)


def test_pairs_name_what_touches() -> None:
    mapping = {**tomllib.loads(SMALL)}
    mapping["materials"]["shell"] = mapping["materials"]["fibril"]
    mapping["yarns"]["conductive"] |= {"shell": "shell", "shell_thickness": "1 um"}
    mapping["contact"]["pairs"] = [{"materials": ["shell", "shell"], "conductivity": 0.0}]
    design = parse_design(mapping)
    mesh = build_mesh(design)
    assert mesh.material_names == ("shell",)
    assert (contacts_of(design, mesh, initial_configuration(mesh)).conductance == 0.0).all()
    mapping["contact"]["pairs"] = [{"materials": ["fibril", "shell"]}]
    with pytest.raises(DesignError, match="touch with: 'shell'"):
        parse_design(mapping)


def test_fields_circuit_and_ngspice_agree_on_plated_yarns(tmp_path: Path) -> None:
    """And Ry of the study is that of the tubes; what they are made of is in the results as it was stated."""
    text = SMALL.replace('material = "fibril"', 'material = "fibril"\nshell = "metal"\nshell_thickness = "3 um"')
    metal = SMALL[SMALL.index("[materials.fibril]") : SMALL.index("[yarns")].replace("fibril", "metal")
    text = text.replace('"10 S/mm"', '"0 S/mm"') + metal.replace('"10 S/mm"', '"250 S/mm"')
    (tmp_path / "cell.toml").write_text(text, encoding="utf-8")
    assert main(["run", str(tmp_path / "cell.toml"), "--out", str(tmp_path / "out"), "--quiet"]) == ExitCode.DONE
    study = load_study(tmp_path / "out")
    (record,) = study.records
    assert record.verification.ngspice_checked
    assert record.verification.agrees
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert all(said in report for said in ("Material metal", "shell thickness", "0.003"))
    assert record.verification.max_current_difference < AGREEMENT
    tube = 250 * pi * (0.15**2 - 0.147**2)
    assert record.currents[0] == pytest.approx(tube / 4.0, rel=1e-3), "contacts add some parts in ten thousand"
    shell = study.design.weave.warp[0].shell
    assert shell is not None
    assert (shell.name, shell.electrical_conductivity) == ("metal", 250.0)


def test_a_permutation_takes_the_coats_along() -> None:
    mesh = build_mesh(stated({"rows": [2], "shell_thickness": "5 um"}))
    number = np.arange(float(mesh.n_fibrils))
    mesh = replace(mesh, surface_conductivity=number, bending_radius=number)
    order = np.arange(mesh.n_fibrils)[::-1]
    other, _ = permuted(mesh, order)
    assert same((other.surface, other.section_radius), (number[order], number[order]))


# Units of the trade


def test_two_of_the_four_sizes_are_enough() -> None:
    """A yarn by its counts before and after plating, by count and thickness, by radius and count."""
    bare = {"rows": None, "radius": None, "spacing": None, "filaments": 7}
    heavy = {"density": "10 g/cm3"}
    light = {"density": "1 g/cm3"}
    R, t = 0.05, 0.002
    before = 7 * pi * (R - t) ** 2 * 1e-3
    after = before + 7 * pi * (R**2 - (R - t) ** 2) * 1e-2
    sizes = {"radius": R, "shell_thickness": t, "linear_density": after, "core_linear_density": before}
    for given in (
        ("radius", "shell_thickness"),
        ("radius", "core_linear_density"),
        ("linear_density", "shell_thickness"),
        ("linear_density", "core_linear_density"),
        ("core_linear_density", "shell_thickness"),
    ):
        yarn = stated(bare | {key: sizes[key] for key in given}, fibril=light, shell=heavy).weave.warp[0]
        assert (yarn.radius, yarn.shell_thickness) == pytest.approx((R, t), rel=1e-10), given  # differences of radii


@pytest.mark.parametrize("unknown", ["fibril", "shell"])
def test_the_resistance_states_the_part_whose_conductivity_is_not(unknown: str) -> None:
    yarn = {"shell_thickness": "15 um", "resistance": "1 ohm/mm"}
    known = "shell" if unknown == "fibril" else "fibril"
    design = stated(yarn, **{unknown: {"electrical_conductivity": None}, known: {"electrical_conductivity": 1.0}})
    assert ohm_per_metre(design) == pytest.approx(1e3, rel=ROUNDING, abs=0)
    both = {"material": design.weave.warp[0].materials[0], "shell": design.weave.warp[0].shell}
    areas = {"fibril": pi * 0.135**2, "shell": pi * (0.15**2 - 0.135**2)}
    found = both["material" if unknown == "fibril" else "shell"]
    assert found is not None
    assert found.electrical_conductivity == pytest.approx((1 - areas[known]) / areas[unknown], rel=ROUNDING, abs=0)


@pytest.mark.parametrize(
    ("yarn", "field", "allowed"),
    [
        ({"shell_thickness": "150 um"}, "yarns.conductive.shell_thickness", "less than the radius of 0.15 mm"),
        ({"shell_thickness": "-1 um"}, "yarns.conductive.shell_thickness", ">= 0 mm"),
        ({"shell": None, "shell_thickness": "1 um"}, "yarns.conductive.shell_thickness", "it needs a shell"),
        ({"shell": "gold", "shell_thickness": "1 um"}, "yarns.conductive.shell", "one of 'fibril', 'shell'"),
        ({}, "yarns.conductive", "two of radius, linear_density, core_linear_density, shell_thickness"),
        ({"linear_density": "1 tex"}, "yarns.conductive", "of radius and linear_density one at most"),
        ({"shell": None, "core_linear_density": "1 tex"}, "yarns.conductive.core_linear_density", "before it got a"),
        ({"core_linear_density": "1 kg/m"}, "yarns.conductive.radius", "more than the core"),
        (
            {"radius": None, "core_linear_density": "2 tex", "linear_density": "1 tex"},
            "yarns.conductive.linear_density",
            "at least the core_linear_density",
        ),
        ({"shell_thickness": "1 um", "resistance": "1 ohm/m"}, "materials.shell.electrical_conductivity", "states it"),
    ],
)
def test_what_cannot_be_is_refused(yarn: dict[str, Any], field: str, allowed: str) -> None:
    with pytest.raises(DesignError) as refused:
        stated(yarn)
    assert field in str(refused.value)
    assert allowed in str(refused.value)


def test_a_core_that_has_less_than_the_yarn_is_refused() -> None:
    yarn = {"shell_thickness": "15 um", "resistance": "10 ohm/mm"}
    with pytest.raises(DesignError, match=r"resistance: '10 ohm/mm' .* the core alone has less: 1747 ohm/m"):
        stated(yarn, shell={"electrical_conductivity": None})
