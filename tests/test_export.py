"""Netlists of a state: their names and headers, and the use that the documentation shows, in ngspice."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from fabrics import small_cell
from synthetic_study import with_network

from circuittex.contact.extract import contacts_of
from circuittex.contact.state import ContactState
from circuittex.design import Design
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.spice.ngspice import find_ngspice, read_raw
from circuittex.fit import Fit
from circuittex.mech.configuration import initial_configuration
from circuittex.relaxation.relax import move
from circuittex.results.records import Study
from circuittex.study.circuits import StateCircuits, state_circuits
from circuittex.study.export import detailed_netlist, probe_netlist, reduced_netlist, simplified
from circuittex.study.run import run_study

pytestmark = pytest.mark.xdist_group("export")  # what its fixtures make serves one worker

PAGE = Path(__file__).parents[1] / "docs" / "netlist.md"
FIT = with_network(Fit(0.3, 200.0, 0.0, np.zeros((2, 2)), "relative", (), np.zeros(3)), (4, 4))


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Study]:
    """The cell of the documentation's example, on fewer elements."""
    folder = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        undrawn(patch)
        return folder, run_study(small_cell(yarns=4, elements=4)[0], folder)


@pytest.fixture(scope="module")
def pressed() -> tuple[Design, ContactState]:
    """The cell pushed together in its plane, which needs no relaxation to touch."""
    design, mesh = small_cell()
    state = contacts_of(design, mesh, move(initial_configuration(mesh), np.eye(2), np.diag([0.9, 0.9])))
    assert state.n_contacts > 100
    return design, state


def built(design: Design, contacts: ContactState) -> StateCircuits:
    return state_circuits(simplified(design, contacts), design.terminals, design.probes)


def blocks(text: str) -> list[str]:
    """The indented code blocks of a page."""
    found = re.findall(r"(?:^    .*\n)+", text, flags=re.MULTILINE)
    return [re.sub("^    ", "", block, flags=re.MULTILINE) for block in found]


def subcircuit_name(text: str) -> str:
    return next(line.split()[1] for line in text.splitlines() if line.startswith(".subckt"))


def test_the_documented_include_runs(finished: tuple[Path, Study]) -> None:
    """The text of the page as it stands, beside the files that the run wrote."""
    folder, study = finished
    (bench,) = (block for block in blocks(PAGE.read_text(encoding="utf-8")) if ".include" in block)
    where = folder / "netlists"
    (where / "bench.cir").write_text(bench, encoding="ascii")
    program = find_ngspice()
    assert program is not None
    done = subprocess.run(
        [program, "-b", "-r", "bench.raw", "bench.cir"], cwd=where, capture_output=True, text=True, timeout=60
    )
    assert "rror" not in done.stdout + done.stderr
    current = -float(read_raw(where / "bench.raw")[0].current("v1")[0])
    circuit = built(study.design, study.records[0].contacts).yarn_ends
    drive = {"warp2_minus": 1.0, "warp2_plus": 0.0}
    expected = solve_nodal(circuit, drive).port_current[circuit.ports.index("warp2_minus")]
    assert current == pytest.approx(expected, rel=1e-9)
    assert current > 3 * np.pi * 0.15**2 * 10.0 / 8.0  # Rayleigh: more than the yarn of three fibrils alone


def test_sub_circuits_of_a_long_title_differ(pressed: tuple[Design, ContactState]) -> None:
    """A word of a netlist has at most 80 characters, a title 200."""
    design = replace(pressed[0], name="long title " * 15)
    circuits = built(design, pressed[1])
    states = ("relaxed", "stretch-0.05", "stretch--0.05")
    names = [subcircuit_name(detailed_netlist(design, state, circuits)) for state in states]
    names += [subcircuit_name(reduced_netlist(design, state, FIT)) for state in states]
    assert len(set(names)) == 6
    beginnings = ("relaxed_long", "stretch_0_05_long", "stretch_minus_0_05_long")
    beginnings += ("relaxed_reduced_long", "stretch_0_05_reduced_long", "stretch_minus_0_05_reduced_long")
    assert all(name.startswith(beginning) for name, beginning in zip(names, beginnings, strict=True))


def test_the_header_states_how_the_contacts_were_simplified(pressed: tuple[Design, ContactState]) -> None:
    design, contacts = pressed
    design = replace(design, numerics=replace(design.numerics, merge_length=0.25, snap_length=0.05, drop_fraction=0.4))
    circuits = built(design, contacts)
    simple = circuits.simple
    assert min(simple.merged_contacts, simple.merged_feet, simple.dropped_contacts) > 0
    notes = [
        f'* note: "contact points of two fibrils in the same bin of 0.25 mm are one: {simple.merged_contacts} were ',
        f'* note: "feet on a fibril closer than 0.05 mm share a node: {simple.merged_feet} were moved ',
        f'* note: "contacts below 0.4 of the largest conductance are left out: {simple.dropped_contacts} were"',
    ]
    for text in (
        detailed_netlist(design, "relaxed", circuits),
        probe_netlist(design, "relaxed", circuits, design.probes[0]),
    ):
        lines = text.splitlines()
        assert all(any(line.startswith(note) for line in lines) for note in notes)


def test_the_header_states_that_contacts_were_left_alone(pressed: tuple[Design, ContactState]) -> None:
    design, contacts = pressed
    design = replace(design, numerics=replace(design.numerics, merge_length=0.0, snap_length=0.0))
    lines = detailed_netlist(design, "relaxed", built(design, contacts)).splitlines()
    assert '* note: "contact points are not merged"' in lines
    assert '* note: "feet are not snapped"' in lines
