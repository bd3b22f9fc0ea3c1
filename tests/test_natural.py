"""Natural length and shape: crimp that is woven in, and bends that are set."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from test_scaling import Scale, differing, job

from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.contact.extract import contacts_of
from circuittex.design import Design, Packing, Yarn, plain_weave
from circuittex.electrical.fields import solve_probes
from circuittex.electrical.network.circuit import build_circuit, yarn_end_terminals
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.network.ports import port_matrix
from circuittex.fit import fit_network
from circuittex.geometry.permutation import permuted
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import initial_configuration
from circuittex.relaxation.relax import Equilibrium, clamp_force, force_terms, relax
from circuittex.results.records import Study
from circuittex.results.store import load_study, write_study_start

H, PITCH, R, E = 0.1501, 2.0, 0.15, 10.0
"""A cell of one fibril a yarn that starts a hair's breadth apart: amplitude, pitch, radius in mm; MPa, nu = 0."""
AREA, INERTIA = pi * R**2, pi * R**4 / 4
SUMMED = 1e-9
"""Relative: what the sums along the path leave, by their fourth order in 1/256 of a crossing."""
SLENDER = 4e-3
"""Relative: of a bent fibril's energy a beam theory of slender ones leaves (R kappa)^2 / 4 = 1e-3, four times that for
twenty quadratic elements."""


def cell(
    crimp: float | str = 0.0, heat_set: float = 0.0, amplitude: float = H, packing: Packing | None = None
) -> Design:
    design = plain_weave(yarns=2, rows=(1,))

    def kinds(yarns: tuple[Yarn, ...]) -> tuple[Yarn, ...]:
        return tuple(replace(yarn, crimp=crimp, heat_set=heat_set) for yarn in yarns)

    weave = design.weave
    weave = replace(weave, warp=kinds(weave.warp), weft=kinds(weave.weft), amplitude=amplitude)
    return replace(design, weave=weave, packing=packing or Packing())


def woven_length(amplitude: float = H) -> float:
    """Arc length of z = H sin(pi s / pitch) over two pitches, by quadrature."""
    k = pi / PITCH
    return quad(lambda s: float(np.sqrt(1 + (amplitude * k * np.cos(k * s)) ** 2)), 0, 2 * PITCH, epsabs=1e-13)[0]


def bending_energy() -> float:
    """E I / 2 times the integral of the square of the path's curvature, over the four fibrils, N mm."""
    k = pi / PITCH

    def density(s: float) -> float:
        slope, bend = H * k * np.cos(k * s), -H * k**2 * np.sin(k * s)
        return float(bend**2 / (1 + slope**2) ** 2.5)

    return 4 * E * INERTIA / 2 * quad(density, 0, 2 * PITCH, epsabs=1e-13)[0]


def started(design: Design) -> float:
    """Elastic energy of the start, N mm."""
    mesh = build_mesh(design)
    space, beam, _ = force_terms(mesh, design)
    return beam.energy(space.vector(initial_configuration(mesh)))


def pull(found: Equilibrium, design: Design) -> float:
    return float(clamp_force(build_mesh(design), found.reaction)[0, 0])


def test_a_path_is_as_long_as_it_is() -> None:
    np.testing.assert_allclose(build_mesh(cell("path")).length, woven_length(), rtol=SUMMED)
    np.testing.assert_allclose(build_mesh(cell(0.07)).length, 1.07 * 2 * PITCH, rtol=1e-15)


def test_a_path_of_random_fibrils_is_as_long_as_a_fine_polyline() -> None:
    """Chords of 4000 pieces a fibril: short of the arc by (kappa l)^2 / 24, some 1e-8."""
    packing = Packing(seed=2, lateral=0.02, vertical=0.01, twist=0.01, phase=0.05)
    mesh = build_mesh(cell("path", 0.5, amplitude=0.2, packing=packing))
    fine = cell("path", amplitude=0.2, packing=packing)
    fine = replace(fine, numerics=replace(fine.numerics, elements=2000))
    line = build_mesh(fine).position.reshape(4, -1, 3)
    chords = np.linalg.norm(np.diff(line, axis=1), axis=-1)
    np.testing.assert_allclose(mesh.length, chords.sum(axis=1), rtol=1e-7)
    np.testing.assert_allclose(chords, np.broadcast_to(chords.mean(axis=1)[:, None], chords.shape), rtol=1e-6)


@pytest.mark.parametrize("packing", [Packing(), Packing(seed=5, lateral=0.004, vertical=0.0, phase=0.02)])
def test_a_fabric_set_in_its_weave_is_at_rest(packing: Packing) -> None:
    """Nothing touches and nothing is bent beside its nature: no force, no energy, not one iteration."""
    design = cell("path", 1.0, amplitude=0.16, packing=packing)
    found = relax(build_mesh(design), design)
    assert found.iterations == 0
    assert found.energy < 1e-28 * E * AREA * PITCH
    assert np.abs(found.reaction).max() < 1e-13 * E * AREA


def test_a_fabric_as_long_as_its_path_is_bent_and_not_stretched() -> None:
    """The work of bending alone; a part f of the bends that is set leaves (1 - f)^2 of it."""
    whole = bending_energy()
    assert started(cell("path")) == pytest.approx(whole, rel=SLENDER)
    for part in (0.25, 0.5, 0.9):
        assert started(cell("path", part)) == pytest.approx((1 - part) ** 2 * whole, rel=SLENDER)


def test_what_is_too_long_for_a_set_path_is_compressed_and_not_bent() -> None:
    """A scaled image of the path: uniform stretch, psi = E/4 (l^2 - 1 - 2 ln l) of a neo-Hookean solid with nu = 0."""
    crimp = 0.03
    stretch = woven_length() / (1.03 * 2 * PITCH)
    scaled = E / 4 * (stretch**2 - 1 - 2 * np.log(stretch))
    assert started(cell(crimp, 1.0)) == pytest.approx(4 * AREA * 1.03 * 2 * PITCH * scaled, rel=SLENDER)


@pytest.mark.parametrize("crimp", [-0.05, -0.2])
def test_thin_yarns_pull_by_what_they_are_short_of(crimp: float) -> None:
    """N = E A / 2 (l - 1/l) each, the stretch l between that of the span and that of the path, 0.2 % more."""
    thin = 0.05
    design = cell(crimp, amplitude=1.001 * thin)
    weave = design.weave
    yarn = replace(weave.warp[0], radius=thin)
    design = replace(design, weave=replace(weave, warp=(yarn, yarn), weft=(yarn, yarn)))
    least, most = 1 / (1 + crimp), woven_length(1.001 * thin) / (2 * PITCH) / (1 + crimp)
    force = 2 * E * pi * thin**2 / 2 * np.array([least - 1 / least, most - 1 / most])
    assert force[0] < pull(relax(build_mesh(design), design), design) < force[1]


def test_setting_a_yarn_takes_its_pull_and_a_part_takes_a_part() -> None:
    """Of the same length as the path: the more is set, the less it presses on the clamps, in proportion."""
    pulls = []
    for part in (0.0, 0.5, 1.0):
        design = cell("path", part)
        pulls.append(pull(relax(build_mesh(design), design), design))
    assert pulls[0] < pulls[1] < -1e-6
    assert pulls[1] == pytest.approx(pulls[0] / 2, rel=0.2)  # the rest follows from large turns
    assert abs(pulls[2]) < 1e-12


def test_a_yarn_resists_along_its_natural_length() -> None:
    """L / (n sigma A) with L = (1 + c) times the span; fields, circuit and closed form."""
    design = cell(0.08, 1.0)
    design = replace(design, contact=replace(design.contact, conductivity=0.0))
    mesh = build_mesh(design)
    contacts = contacts_of(design, mesh, initial_configuration(mesh))
    probe = design.probes[0]
    current = solve_probes(contacts, design.terminals, [probe])[0].currents[0]
    ohm = 1.08 * 2 * PITCH / (10.0 * AREA)
    assert probe.voltage / current == pytest.approx(ohm, rel=1e-12)
    circuit = build_circuit(contacts, [t for t in design.terminals if t.name in (probe.source, probe.sink)])
    nodal = solve_nodal(circuit, {probe.source: probe.voltage, probe.sink: 0.0})
    assert abs(nodal.port_current).max() == pytest.approx(probe.voltage / ohm, rel=1e-12)


def test_one_kind_as_long_as_two_paths_has_a_resistance_in_either_direction() -> None:
    """Insulated yarns of the lengths of both waves, and the network that is fitted to the cell by default."""
    design = cell("path", amplitude=0.25)
    design = replace(
        design,
        weave=replace(design.weave, weft_amplitude=0.06),
        contact=replace(design.contact, conductivity=0.0),
    )
    mesh = build_mesh(design)
    contacts = contacts_of(design, mesh, initial_configuration(mesh))
    matrix = port_matrix(build_circuit(contacts, yarn_end_terminals(mesh)))
    fit = fit_network(np.zeros(len(design.probes)), design, matrix)
    ohm = [woven_length(each) / 2 / (10.0 * AREA) for each in (0.25, 0.06)]
    assert fit.kinds == ("conductive warp", "conductive weft")
    assert fit.kind_resistance == pytest.approx(ohm, rel=1e-9)
    assert ohm[0] > 1.03 * ohm[1]


def test_one_kind_with_crimp_leaves_the_other_as_it_was() -> None:
    plain = build_mesh(cell())
    design = cell()
    long, other = replace(design.weave.warp[0], name="long", crimp=0.05), design.weave.warp[1]
    mesh = build_mesh(replace(design, weave=replace(design.weave, warp=(long, other))))
    nodes = plain.node_fibril
    assert np.array_equal(mesh.position[nodes > 0], plain.position[nodes > 0])
    assert np.array_equal(mesh.xi[nodes > 0], plain.xi[nodes > 0])
    assert mesh.length.tolist() == [pytest.approx(4.2), 4.0, 4.0, 4.0]


def test_another_scale_takes_the_same_way_bit_for_bit() -> None:
    design = cell(0.02, 0.5)
    assert differing(job(design, Scale()), job(design, Scale(s=-7, m=9, d=3))) == []


def test_the_order_of_the_fibrils_changes_nothing_that_is_natural() -> None:
    mesh = build_mesh(cell("path", 0.3))
    other, nodes = permuted(mesh, np.array([2, 0, 3, 1]))
    assert np.array_equal(other.natural, mesh.natural[nodes])


def test_a_study_keeps_the_natural_shape(tmp_path: Path) -> None:
    design = cell("path", 1.0)
    mesh = build_mesh(design)
    study = Study("0.1.0", design, "0", mesh, initial_configuration(mesh), ())
    write_study_start(tmp_path / "results.h5", study)
    known = load_study(tmp_path)
    assert same(known.mesh, mesh)
    assert same(known.design, design)
    assert len(known.mesh.natural) == mesh.n_nodes


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("crimp", "woven", ".path."),
        ("crimp", -0.5, ">= -0.3"),
        ("crimp", 4.0, "<= 3"),
        ("heat_set", 1.2, "<= 1"),
        ("heat_set", "yes", "number"),
    ],
)
def test_what_no_yarn_has_is_refused(key: str, value: object, words: str) -> None:
    yarn = plain_weave().weave.warp[0]
    with pytest.raises(DesignError, match=f"yarns.conductive.{key}.*{words}"):
        replace(yarn, **{key: value})  # type: ignore[arg-type]
