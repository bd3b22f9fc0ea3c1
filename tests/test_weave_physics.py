"""What the physics demands of whole woven cells, from the design to ngspice, whatever the discretisation."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from fabrics import Cell, fibrils_through, renumbered, small_cell, straight

from circuittex.base.arrays import Floats
from circuittex.base.frozen import same
from circuittex.contact.extract import contact_state
from circuittex.contact.law import hertz_width
from circuittex.contact.merge import snap_feet
from circuittex.contact.state import ContactState
from circuittex.design import ContactLaw, Probe, Terminal, plain_weave, uniaxial
from circuittex.electrical.fields import Fields, solve_probes
from circuittex.electrical.network.circuit import CONTACT, build_circuit
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.spice.ngspice import run_deck
from circuittex.fit import fit_network
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.netlist import deck, parse
from circuittex.relaxation.relax import clamp_force, move, relax
from circuittex.results.records import Study
from circuittex.results.store import load_study
from circuittex.results.summary import summary
from circuittex.study.run import run_study

pytestmark = pytest.mark.xdist_group("weave_physics")  # what its fixtures make serves one worker

STRETCHED = np.diag([1.05, 1.0])


@pytest.fixture(scope="module")
def cell() -> Cell:
    """Two by two yarns of three fibrils, at rest and stretched by 5 %."""
    design, mesh = small_cell()
    relaxed = relax(mesh, design)
    return Cell(design, mesh, relaxed, relax(mesh, design, move(relaxed.configuration, np.eye(2), STRETCHED)))


def contacts_of(mesh: FibrilMesh, configuration: Configuration, law: ContactLaw, per_element: int = 4) -> ContactState:
    return contact_state(mesh, configuration, law, per_element=per_element)


def currents(fields: Sequence[Fields]) -> Floats:
    return np.array([f.currents[0] for f in fields])


def circuit_current(contacts: ContactState, terminals: Sequence[Terminal], probe: Probe) -> tuple[float, float]:
    """Current into the source by nodal analysis and by ngspice, A."""
    ends = [t for t in terminals if t.name in (probe.source, probe.sink)]
    circuit = build_circuit(contacts, ends)
    drive = {probe.source: probe.voltage, probe.sink: 0.0}
    nodal = solve_nodal(circuit, drive).port_current[circuit.ports.index(probe.source)]
    return float(nodal), -float(run_deck(deck(circuit, drive)).plots[0].current(f"v{probe.source}")[0])


# ---- Contacts that do not conduct -------------------------------------------------------------------------


def test_without_contact_conduction_the_currents_know_nothing_of_the_deformation(cell: Cell) -> None:
    """[58-60]: probe 1 carries sigma A n / L in every state, the others nothing."""
    law = replace(cell.design.contact, conductivity=0.0)
    states = [
        contacts_of(cell.mesh, c, law)
        for c in (initial_configuration(cell.mesh), cell.relaxed.configuration, cell.stretched.configuration)
    ]
    found = [currents(solve_probes(s, cell.design.terminals, cell.design.probes)) for s in states]
    assert states[1].n_contacts > 0
    assert states[1].line_load.sum() != states[2].line_load.sum()  # the states do differ
    yarn = 3 * np.pi * 0.15**2 * 10.0 / 4.0
    for straight_, *across in found:
        assert straight_ == pytest.approx(found[0][0], rel=1e-12)
        assert straight_ == pytest.approx(yarn, rel=1e-12)
        assert np.abs(across).max() < 1e-15 * yarn


def test_the_circuit_without_contact_conduction_is_cut_between_the_yarns(cell: Cell) -> None:
    law = replace(cell.design.contact, conductivity=0.0)
    contacts = contacts_of(cell.mesh, cell.stretched.configuration, law)
    _, parallel, _ = cell.design.probes
    circuit = build_circuit(contacts, [t for t in cell.design.terminals if t.name in (parallel.source, parallel.sink)])
    assert not np.any(circuit.resistor_kind == CONTACT)
    assert circuit.dropped_contacts == contacts.n_contacts
    solution = solve_nodal(circuit, {parallel.source: 1.0, parallel.sink: 0.0})
    assert np.abs(solution.port_current).max() < 1e-15


def test_contacts_that_conduct_carry_current_and_feel_the_deformation(cell: Cell) -> None:
    """The counterpart: the two tests above can fail."""
    relaxed, stretched = (
        currents(
            solve_probes(
                contacts_of(cell.mesh, s.configuration, cell.design.contact), cell.design.terminals, cell.design.probes
            )
        )
        for s in (cell.relaxed, cell.stretched)
    )
    assert np.all(relaxed > 0.0)
    assert np.all(np.abs(stretched / relaxed - 1)[1:] > 1e-2)
    assert relaxed[0] > 3 * np.pi * 0.15**2 * 10.0 / 4.0  # Rayleigh: a conductor more


# ---- Symmetry ---------------------------------------------------------------------------------------------


def test_stretching_the_weft_instead_is_the_turned_experiment(cell: Cell) -> None:
    """A quarter turn about z takes the 1/1 cell into itself; at rest `test_relaxation` checks it."""
    start = move(cell.relaxed.configuration, np.eye(2), np.diag([1.0, 1.05]))
    turned = relax(cell.mesh, cell.design, start)
    along_x, along_y = (clamp_force(cell.mesh, s.reaction) for s in (cell.stretched, turned))
    assert along_x[0, 0] > 1.1 * along_x[1, 1]  # warp and weft do differ
    assert along_y[1, 1] == pytest.approx(along_x[0, 0], rel=1e-5)
    assert along_y[0, 0] == pytest.approx(along_x[1, 1], rel=1e-5)


@pytest.mark.parametrize("seed", [0, 1])
def test_numbers_and_directions_of_fibrils_do_not_show_in_the_currents(cell: Cell, seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh, x = cell.mesh, cell.relaxed.configuration.x
    backwards = rng.permutation(len(mesh.yarn_names))[:2]  # whole yarns: an end of a yarn is one end of all its fibrils
    flip = np.flatnonzero(np.isin(mesh.yarn, backwards)).tolist()
    order = rng.permutation(mesh.n_fibrils)
    other, node = renumbered(mesh, order, flip)
    turned = x[node].copy()
    turned[np.isin(order[other.node_fibril], flip), 1] *= -1  # as `renumbered` turns the directors
    names = {mesh.yarn_names[y] for y in backwards}
    terminals = [
        replace(t, ends=tuple((yarn, -side if yarn in names else side) for yarn, side in t.ends))
        for t in cell.design.terminals
    ]
    here = contacts_of(mesh, cell.relaxed.configuration, cell.design.contact)
    there = contacts_of(other, Configuration(turned), cell.design.contact)
    assert there.n_contacts == here.n_contacts
    before = solve_probes(here, cell.design.terminals, cell.design.probes)
    after = solve_probes(there, terminals, cell.design.probes)
    np.testing.assert_allclose(currents(after), currents(before), rtol=1e-9)
    for a, b in zip(after, before, strict=True):
        assert a.peak_temperature == pytest.approx(b.peak_temperature, rel=1e-9)
    for probe, f in zip(cell.design.probes, before, strict=True):
        nodal, ngspice = circuit_current(there, terminals, probe)
        assert nodal == pytest.approx(f.currents[0], rel=1e-9)
        assert ngspice == pytest.approx(f.currents[0], rel=1e-9)


# ---- Two fibrils, closed form ------------------------------------------------------------------------------


def rails_resistance(r1: float, r2: float, g: float, L: float) -> float:
    """Two parallel conductors, r ohm/mm, joined by g S/mm over L; in at 0 of the first, out at L of the second.

    u = V1 - V2 obeys u'' = (r1 + r2) g u with u'(0) = -r1 I and u'(L) = r2 I, and r2 V1 + r1 V2 falls by r1 r2 I L.
    """
    k = np.sqrt((r1 + r2) * g)
    a, b = (r2 + r1 * np.cosh(k * L)) / (k * np.sinh(k * L)), -r1 / k
    start, stop = a, a * np.cosh(k * L) + b * np.sinh(k * L)
    return float(start + (r1 * r2 * L - r2 * (start - stop)) / (r1 + r2))


RAILS_LAW = ContactLaw(penalty=5.0, conductivity=20.0, heat_transfer=0.1)
RAILS_ENDS = (Terminal("near", (("warp1", -1),)), Terminal("far", (("warp2", +1),)))
RAILS_PROBE = Probe("through", "near", "far", 2.0)


def rails(sigma: tuple[float, float], per_element: int) -> tuple[ContactState, float]:
    """Two parallel fibrils pressed together by 0.02 mm over 3 mm, and their exact resistance, ohm."""
    L, R, overlap = 3.0, 0.15, 0.02
    y = 2 * R - overlap
    mesh = fibrils_through([straight([0, 0, 0], [L, 0, 0], 12), straight([0, y, 0], [L, y, 0], 12)], sigma=sigma)
    contacts = contacts_of(mesh, initial_configuration(mesh), RAILS_LAW, per_element)
    np.testing.assert_allclose(contacts.gap, -overlap, rtol=1e-9)
    width = hertz_width(np.array(RAILS_LAW.penalty * overlap), np.array(R / 2), np.array(5.0))  # E* = E / 2, nu = 0
    r1, r2 = (1.0 / (s * np.pi * R**2) for s in sigma)
    return contacts, rails_resistance(r1, r2, RAILS_LAW.conductivity * float(width), L)


@pytest.mark.parametrize("sigma", [(10.0, 2.0), (1.0, 30.0)])
def test_two_touching_fibrils_of_different_conductivity(sigma: tuple[float, float]) -> None:
    """From centre lines to all three routes; a potential form that loses sigma on one side fails here."""
    errors = []
    for per_element in (4, 8, 16):
        contacts, exact = rails(sigma, per_element)
        snapped, _ = snap_feet(contacts, 1e-6)  # as for every netlist; see the next test
        fields = solve_probes(snapped, RAILS_ENDS, [RAILS_PROBE])[0]
        assert fields.heat == pytest.approx(RAILS_PROBE.voltage * fields.currents[0], rel=1e-10)
        errors.append(abs(RAILS_PROBE.voltage / fields.currents[0] / exact - 1))
        for current in circuit_current(snapped, RAILS_ENDS, RAILS_PROBE):
            assert current == pytest.approx(fields.currents[0], rel=1e-9)
    assert errors[-1] < 1e-3
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.1)


def test_feet_that_differ_by_rounding_share_a_node() -> None:
    """Both sides of a contact between parallel fibrils have their feet at the same two places."""
    contacts, exact = rails((10.0, 2.0), 16)
    for current in circuit_current(contacts, RAILS_ENDS, RAILS_PROBE):
        assert current == pytest.approx(RAILS_PROBE.voltage / exact, rel=1e-3)


# ---- The insulated yarn of the paper -----------------------------------------------------------------------


def test_the_insulated_yarn_through_fields_circuit_ngspice_and_fit() -> None:
    """[57]: 0.2829 ohm a segment, 1.1318 ohm a yarn, 0.8836 A."""
    design = plain_weave("paper-code")
    mesh = build_mesh(design)
    contacts = contacts_of(mesh, initial_configuration(mesh), replace(design.contact, conductivity=0.0))
    exact = 10 * np.pi * 0.15**2 * 10.0 / 8.0
    assert round(exact, 4) == 0.8836
    probe = design.probes[0]
    found = solve_probes(contacts, design.terminals, design.probes)
    for current in (found[0].currents[0], *circuit_current(contacts, design.terminals, probe)):
        assert current == pytest.approx(exact, rel=1e-9)
    fit = fit_network(currents(found), design)
    assert fit.Ry == pytest.approx(1.0 / exact / 4, rel=1e-9)
    assert round(fit.Ry, 4) == 0.2829
    assert fit.Rc == np.inf


# ---- The whole way, and back from the file -----------------------------------------------------------------


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Study]:
    design, _ = small_cell(elements=4)
    folder = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        undrawn(patch)
        return folder, run_study(replace(design, loading=(uniaxial("stretch", (0.05,)),)), folder)


def test_a_study_reloads_from_its_file_as_it_was(finished: tuple[Path, Study]) -> None:
    folder, study = finished
    again = load_study(folder / "results.h5")
    assert [record.name for record in again.records] == ["relaxed", "stretch-0.05"]
    assert same(again, study)
    assert summary(again) == summary(study)
    assert summary(again) == json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def test_reloaded_contacts_give_the_recorded_currents(finished: tuple[Path, Study]) -> None:
    again = load_study(finished[0] / "results.h5")
    for record in again.records:
        solved = solve_probes(record.contacts, again.design.terminals, again.design.probes)
        assert currents(solved).tolist() == list(record.currents)


def test_every_record_is_an_equilibrium_that_ngspice_confirmed(finished: tuple[Path, Study]) -> None:
    for state in summary(finished[1])["states"]:
        assert state["residual_N"] <= 1e-6
        check = state["verification"]
        assert check["routes"] == ["fields", "nodal", "ngspice"]
        assert check["ngspice_checked"]
        assert max(check["max_voltage_difference_V"], check["max_current_difference"]) <= 1e-9
        assert check["reduced_difference"] <= 1e-9


def test_the_written_decks_give_the_recorded_currents_in_ngspice(finished: tuple[Path, Study]) -> None:
    """The files themselves, as a user would run them; they differ from the record by the merging of contacts."""
    folder, study = finished
    for record in study.records:
        for probe, current in zip(study.design.probes, record.currents, strict=True):
            text = (folder / "netlists" / f"{record.name}_{probe.name}.cir").read_text(encoding="ascii")
            found = -float(run_deck(text).plots[0].current(f"v{probe.source}")[0])
            assert found == pytest.approx(current, rel=record.verification.merge_error + 1e-9)


def test_the_written_sub_circuits_run_in_ngspice_as_they_parse(finished: tuple[Path, Study]) -> None:
    folder, study = finished
    for record in study.records:
        text = (folder / record.netlist).read_text(encoding="ascii")
        circuit = parse(text)
        held = {"warp1_minus": 1.0, "warp1_plus": 0.0, "weft2_plus": 0.25}
        name = next(line.split()[1] for line in text.splitlines() if line.startswith(".subckt"))
        sources = [f"V{port} {port} 0 {volts!r}" for port, volts in held.items()]
        bench = ["* bench", *text.splitlines(), f"X1 {' '.join(circuit.ports)} {name}", *sources, ".op", ".end", ""]
        plot = run_deck("\n".join(bench)).plots[0]
        expected = solve_nodal(circuit, held)
        for port in held:
            current = expected.port_current[circuit.ports.index(port)]
            assert -float(plot.current(f"v{port}")[0]) == pytest.approx(current, rel=1e-9)
