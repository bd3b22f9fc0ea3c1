"""The three routes against one another, and what is said where one of them fails."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from synthetic import fibrils, rails, touching, woven

from circuittex.contact.merge import simplify
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal
from circuittex.electrical.fields import solve_fields, solve_probes
from circuittex.electrical.network.circuit import build_circuit
from circuittex.electrical.network.nodal import NodalSolution, solve_nodal
from circuittex.study import verify as module
from circuittex.study.verify import _relative, verify

TERMINALS = (
    Terminal("left", (("warp2", -1),)),
    Terminal("right", (("warp2", 1),)),
    Terminal("parallel", (("warp3", -1),)),
    Terminal("perpendicular", (("weft2", 1),)),
)
PROBES = (
    Probe("straight", "left", "right", 1.0),
    Probe("parallel", "parallel", "right", -2.0),
    Probe("perpendicular", "perpendicular", "right", 1e-3),
)
RAILS = (Terminal("one", (("warp1", -1),)), Terminal("other", (("warp2", -1),)))
ROUNDING = "ngspice's own rounding limits this check"
"""What is said where that may exceed 1e-9; it comes near that in these states."""
BETWEEN = Probe("between", "one", "other", 1.0)


def simplified(state: ContactState) -> ContactState:
    return simplify(state, merge_length=1.0, snap_length=1e-3, drop_fraction=1e-6).contacts


def fake_ngspice(folder: Path, program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = folder / "fake-ngspice"
    path.write_text(f"#!{sys.executable}\n{program}", encoding="utf-8")
    path.chmod(0o755)
    monkeypatch.setenv("CIRCUITTEX_NGSPICE", str(path))


@pytest.mark.parametrize("seed", [1, 2])
def test_three_routes_agree(seed: int) -> None:
    state = woven(per_yarn=2, points=6, seed=seed)
    found = verify(state, simplified(state), TERMINALS, PROBES)
    assert found.routes == ("fields", "nodal", "ngspice")
    assert found.ngspice_checked
    assert found.agrees
    assert not found.note or found.note.startswith(ROUNDING)
    assert 0 < found.max_voltage_difference < 1e-9
    assert 0 < found.max_current_difference < 1e-9
    assert 0 < found.merge_error < 1e-2
    assert 0 < found.field_difference < 1e-2
    assert min(found.fields_seconds, found.nodal_seconds, found.ngspice_seconds) > 0


def test_conduction_that_varies_and_fibrils_that_do_not_conduct() -> None:
    """Every complication at once: insulating fibrils, islands, an axial factor for each element."""
    state = woven(per_yarn=3, points=6, seed=4)
    mesh = state.mesh
    factor = np.random.default_rng(0).uniform(0.5, 1.5, len(mesh.elements))
    sigma = np.where(np.arange(mesh.n_fibrils) % 3 == 2, 0.0, mesh.electrical_conductivity)
    alone = (state.fibril_a == 10) | (state.fibril_b == 10)
    hard = replace(
        state,
        mesh=replace(mesh, electrical_conductivity=sigma),
        axial_factor=factor,
        conductance=np.where(alone, 0.0, state.conductance),
    )
    found = verify(hard, simplified(hard), TERMINALS, PROBES)
    assert found.ngspice_checked
    assert found.agrees
    assert not found.note or found.note.startswith(ROUNDING)
    assert max(found.max_voltage_difference, found.max_current_difference) < 1e-9
    fields = solve_fields(hard, TERMINALS, PROBES[1])
    circuit = build_circuit(hard, TERMINALS[1:3])
    assert fields.unreached.tolist() == circuit.unreached.tolist() == [10]


def test_insulated_contacts_leave_two_probes_without_current() -> None:
    """sigma_c = 0: probe 1 carries what its yarn does, the others nothing, and nothing is divided by that."""
    state = woven(per_yarn=2, points=4)
    state = replace(state, conductance=np.zeros(state.n_contacts))
    found = verify(state, simplified(state), TERMINALS, PROBES)
    assert found.ngspice_checked
    assert found.note == ""
    assert max(found.max_current_difference, found.merge_error, found.field_difference) < 1e-12


def test_what_rounding_makes_of_no_current_is_no_difference() -> None:
    """ngspice's 4e-16 A at a terminal without a conductor, where a yarn carries 5e-6 A, was a difference of 100 %."""
    yarn = np.array([5e-6, 5e-6])
    assert _relative([0.0, 1e-6], [-4e-16, 1e-6], yarn) == pytest.approx(4e-10, rel=1e-12)
    assert _relative([0.0], [-4e-16], yarn[:1]) == pytest.approx(8e-11, rel=1e-12)
    assert _relative([0.0], [-4e-9], yarn[:1]) == pytest.approx(8e-4, rel=1e-12)
    assert _relative([2e-6], [1e-6], yarn[:1]) == pytest.approx(1.0, rel=1e-12)


def test_without_probes_nothing_is_called_verified() -> None:
    state = rails(0.5, 0.02, 8.0, 16)
    assert solve_probes(state, RAILS, []) == ()
    found = verify(state, state, RAILS, [])
    assert not found.ngspice_checked
    assert found.routes == ()
    assert "no probes" in found.note


def test_no_probe_carries_anything() -> None:
    state = touching(fibrils([8.0, 8.0]))
    found = verify(state, state, RAILS, [BETWEEN])
    assert found.max_current_difference == found.merge_error == found.field_difference == 0.0


def test_reported_errors_are_the_real_ones() -> None:
    """Merge and field errors against two solutions of the closed form's problem, made one by one."""
    fine = rails(0.5, 0.02, 8.0, 64)
    coarse = simplified(fine)
    found = verify(fine, coarse, RAILS, [BETWEEN])
    exact, merged = (solve_fields(s, RAILS, BETWEEN).currents[0] for s in (fine, coarse))
    rough = solve_fields(fine, RAILS, BETWEEN, mesh="mechanical").currents[0]
    assert_allclose(found.merge_error, abs(merged / exact - 1), rtol=1e-8)
    assert_allclose(found.field_difference, abs(rough / exact - 1), rtol=1e-8)
    assert found.merge_error > 1e-4
    assert found.field_difference > 1e-4


def test_fields_that_are_there_already_are_used() -> None:
    state = woven(per_yarn=2, points=4)
    known = solve_probes(state, TERMINALS, PROBES)
    bent = [replace(f, currents=1.001 * f.currents) for f in known]
    assert verify(state, state, TERMINALS, PROBES, fields=known).agrees
    found = verify(state, state, TERMINALS, PROBES, fields=bent)
    assert_allclose(found.max_current_difference, 1e-3, rtol=1e-6)
    assert "disagree" in found.note


def test_a_route_that_errs_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(*arguments: object) -> NodalSolution:
        solution = solve_nodal(*arguments)  # type: ignore[arg-type]
        return replace(solution, voltage=solution.voltage + 1e-6)

    monkeypatch.setattr(module, "solve_nodal", wrong)
    state = rails(0.5, 0.02, 8.0, 16)
    found = verify(state, state, RAILS, [BETWEEN])
    assert_allclose(found.max_voltage_difference, 1e-6, rtol=1e-6)
    assert found.note.startswith("the routes disagree: 1.0e-06 V per V")


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        ("import os, signal\nos.kill(os.getpid(), signal.SIGABRT)\n", "crashed"),
        ("import time\ntime.sleep(600)\n", "no answer within 2 s"),
        ("print('all is well')\n", "wrote no result"),
        ("import os\nopen('deck0.raw', 'wb').write(os.urandom(5000))\n", "result"),
    ],
)
def test_ngspice_that_fails_does_not_count_as_a_check(
    program: str, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake_ngspice(tmp_path, program, monkeypatch)
    state = rails(0.5, 0.02, 8.0, 16)
    found = verify(state, state, RAILS, [BETWEEN], timeout=2.0)
    assert not found.ngspice_checked
    assert found.routes == ("fields", "nodal")
    assert found.note.startswith("ngspice did not check this state: ")
    assert reason in found.note
    assert np.isnan(found.ngspice_seconds)
    assert found.max_current_difference < 1e-9


def test_missing_ngspice_is_said_plainly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CIRCUITTEX_NGSPICE", "")
    state = rails(0.5, 0.02, 8.0, 16)
    found = verify(state, state, RAILS, [BETWEEN])
    assert not found.ngspice_checked
    assert "was not found" in found.note


def test_size_beyond_ngspice_is_said_plainly() -> None:
    state = woven(per_yarn=2, points=6)
    found = verify(state, state, TERMINALS, PROBES, timeout=1e-3)
    assert not found.ngspice_checked
    assert "resistors" in found.note


def test_a_check_that_rounding_drowns_is_none() -> None:
    """Yarns on contacts of 1e-14 S float within the digits: nobody may say that ngspice confirmed that."""
    state = woven(per_yarn=2, points=6, seed=1)
    faint = replace(state, conductance=1e-13 * state.conductance)
    found = verify(faint, simplified(faint), TERMINALS, PROBES)
    assert not found.ngspice_checked
    assert found.agrees
    assert "too coarse" in found.note or "no route checks" in found.note


def test_merging_that_changes_currents_is_noted() -> None:
    state = woven(per_yarn=2, points=6, seed=1)
    found = verify(
        state, simplify(state, merge_length=8.0, snap_length=1e-3, drop_fraction=0.95).contacts, TERMINALS, PROBES
    )
    assert found.merge_error > module.MERGED
    assert "merging contacts changes a probe current" in found.note
