"""A study whose probes warm what they go through: its circuits, ngspice, its netlists and what stays at 27 C."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import CircuittexWarning, DesignError
from circuittex.base.frozen import same
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.design import Design, Electrical, Probe, Terminal, design_hash, plain_weave
from circuittex.design.statement import LINEAR, NONLINEAR
from circuittex.electrical.fields import (
    Fields,
    at_temperatures,
    coefficients_of,
    cooling_of,
    solve_potentials,
    solve_steady,
)
from circuittex.electrical.spice.ngspice import run_deck
from circuittex.results.heating import fabric_area, heating, rated_currents
from circuittex.results.records import Study
from circuittex.results.report.page import page
from circuittex.results.soundness import doubts
from circuittex.results.store import load_study
from circuittex.results.summary import summary
from circuittex.study.kit import write_kit
from circuittex.study.library.export import export_library
from circuittex.study.run import run_study

pytestmark = pytest.mark.xdist_group("heated_study")  # what its fixtures make serves one worker

ROUTES = 1e-9
"""Relative: what routes may differ by (`AGREEMENT`), ngspice among them."""
METAL, ACROSS = 0.004, -0.001
"""1/K, of the fibrils and of the contacts."""
FALLING = 1.5
"""A: beyond where the voltage along these fibrils is largest (0.9 A, 1.3 V), if their resistance falls by `METAL`."""
DENSITY = 1e-3
"""W/mm2 of the fabric: 0.1 W/cm2."""


def weave(heating: str = NONLINEAR, **changes: float) -> Design:
    """Two by two single fibrils in air, some of which a probe warms by tens of kelvins."""
    design = plain_weave(yarns=2, rows=(1,))
    yarn = design.weave.warp[0]
    materials = tuple(replace(each, tc1=changes.get("tc1", METAL)) for each in yarn.materials)
    yarns = (replace(yarn, materials=materials),) * 2
    return replace(
        design,
        weave=replace(design.weave, warp=yarns, weft=yarns, amplitude=0.16),
        contact=replace(design.contact, tc1=changes.get("across", ACROSS)),
        electrical=Electrical(
            heat_loss=1e-5, emissivity=changes.get("emissivity", 0.9), thermal_ends=500.0, heating=heating
        ),
        numerics=replace(design.numerics, elements=8),
        terminals=(
            Terminal("left", (("warp1", -1), ("warp2", -1))),
            Terminal("right", (("warp1", 1), ("warp2", 1))),
            Terminal("top", (("weft1", 1),)),
        ),
        probes=(
            Probe("faint", "left", "right", 0.01),
            Probe("volts", "left", "right", 1.0),
            Probe("amperes", "left", "right", current=-0.4),
            Probe("watts", "left", "top", power_density=DENSITY),
        ),
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("heated")
    run_study(weave(), folder, branches=True)
    return folder


@pytest.fixture(scope="module")
def heated(folder: Path) -> Study:
    return load_study(folder)


@pytest.fixture(scope="module")
def linear() -> Study:
    return run_study(weave(LINEAR))


def test_all_routes_confirm_each_probe_at_its_temperatures(folder: Path, heated: Study) -> None:
    """Fields, nodal analysis and ngspice; ngspice also by the decks, whose currents are those that were stated."""
    (record,) = heated.records
    assert record.verification.ngspice_checked
    assert record.verification.agrees
    faint, volts, amperes, watts = record.fields
    assert volts.peak_temperature > 20.0
    assert amperes.currents[0] == pytest.approx(-0.4, rel=ROUTES)
    area = fabric_area(heated.mesh, record.configuration)
    assert watts.voltage * watts.currents[0] == pytest.approx(DENSITY * area, rel=ROUTES)
    for field in record.fields:
        assert field.heat_out + field.heat_lost == pytest.approx(field.voltage * field.currents[0], rel=ROUTES)
        deck = (folder / "netlists" / f"relaxed_{field.probe}.cir").read_text(encoding="ascii")
        assert "at the temperatures that the probe makes" in deck
        flowing = run_deck(deck).plots[0].current("vleft")[0]
        assert -flowing == pytest.approx(field.currents[0], rel=max(ROUTES, 2 * record.verification.merge_error))
    # Two probes between the same terminals have circuits of their own.
    resistance = [field.voltage / field.currents[0] for field in (faint, volts)]
    assert resistance[1] / resistance[0] > 1.05
    assert not any(doubt.kind == "drive" for doubt in doubts(heated, record))


def rises(field: Fields, fibril: Ints, xi: Floats) -> Floats:
    """At feet, which are nodes."""
    own = [field.fibril == f for f in fibril.tolist()]
    return np.array([np.interp(x, field.xi[o], field.temperature[o]) for x, o in zip(xi.tolist(), own, strict=True)])


def test_resistances_are_those_of_the_stored_temperatures(heated: Study) -> None:
    """Contacts by the two rises at their feet, fibrils by the mean rise: the largest and the smallest bound it."""
    (record,) = heated.records
    for field in record.fields:
        contacts = record.contacts
        feet = (contacts.fibril_a, contacts.xi_a), (contacts.fibril_b, contacts.xi_b)
        middle = 0.5 * sum(rises(field, *foot) for foot in feet)
        np.testing.assert_allclose(field.contact_resistivity, 1 + ACROSS * middle, rtol=1e-12)
        warmest = METAL * field.peak_temperature
        assert np.all(field.resistivity - 1 < warmest * (1 + 1e-12))
        assert np.all(field.resistivity - 1 > METAL * field.temperature.min())
        warm = at_temperatures(record.contacts, field)
        probe = next(each for each in heated.design.probes if each.name == field.probe).at(field.voltage)
        (plain,) = solve_potentials(warm, heated.design.terminals, [probe])
        assert plain.currents[0] == pytest.approx(field.currents[0], rel=ROUTES)


def test_what_belongs_to_no_probe_is_that_of_27_degrees(folder: Path, heated: Study, linear: Study) -> None:
    """Ry, Rc, ports, sub-circuits: the linear study's."""
    (record,), (cold,) = heated.records, linear.records
    assert same(record.ports, cold.ports)
    assert same(record.contacts, cold.contacts)
    assert (record.fit.Ry, record.fit.Rc) == pytest.approx((cold.fit.Ry, cold.fit.Rc), rel=ROUTES)
    assert all(len(field.resistivity) == 0 for field in cold.fields)
    faint, uncoupled = record.fields[0], cold.fields[0]
    assert faint.currents[0] == pytest.approx(uncoupled.currents[0], rel=1e-3)  # 0.01 V warm by 0.01 K
    detailed = (folder / "netlists" / "relaxed.sub").read_text(encoding="ascii")
    assert "resistances are those at 27 C" in detailed
    assert cold.fields[1].currents[0] > 1.05 * record.fields[1].currents[0]


def test_a_design_without_the_key_is_what_it_was(linear: Study) -> None:
    """Its hash, which leaves defaults out, and its losses, h and the linear part of radiation."""
    design = weave(LINEAR)
    stated = replace(design, electrical=Electrical(heat_loss=1e-5, emissivity=0.9, thermal_ends=500.0))
    assert design_hash(stated) == design_hash(design) == linear.design_hash
    assert design_hash(weave()) != design_hash(design)
    assert len(cooling_of(design, linear.mesh).radiating) == 0
    one, other = (cooling_of(each, linear.mesh) for each in (weave(NONLINEAR, emissivity=0.0), weave()))
    np.testing.assert_array_equal(one.loss, other.loss)
    assert len(one.radiating) == 0
    h = cooling_of(design, linear.mesh).loss - other.loss
    np.testing.assert_allclose(h, 4 * other.radiating * 300.0**3, rtol=1e-12)


def test_other_branches_are_told_apart_by_the_same_currents(heated: Study) -> None:
    """The state found once more is heated, too: else its currents would differ by what the temperature makes."""
    (check,) = heated.branches
    assert not check.bifurcation


def test_a_branch_check_of_a_mixed_fabric_warms_each_yarn_by_its_own_coefficients() -> None:
    """Its fibrils are in another order, and the materials of a design are not; the same currents but for round-off."""
    design = weave(emissivity=0.0)
    yarn = design.weave.warp[0]
    steady = replace(yarn, name="steady", materials=tuple(replace(m, name="steady", tc1=0.0) for m in yarn.materials))
    design = replace(design, weave=replace(design.weave, weft=(steady,) * 2), probes=design.probes[1:2])
    study = run_study(design, branches=True)
    (check,), (record,) = study.branches, study.records
    assert record.fields[0].resistivity.max() > 1.05  # what the order of coefficients decides
    assert check.again.currents == pytest.approx(record.currents, rel=ROUTES)


def test_what_a_current_warms_is_compared_at_the_temperatures_of_that_current() -> None:
    """Beyond the largest voltage that a falling resistance takes, the same voltage has another, cooler state."""
    design = weave(tc1=-METAL, emissivity=0.0)
    numerics = replace(design.numerics, contact_points=8)
    design = replace(design, numerics=numerics, probes=(Probe("amperes", "left", "right", current=FALLING),))
    study = run_study(design, error_estimate=True, branches=True)
    (record,) = study.records
    assert run_study(record.driven(design)).records[0].currents[0] < 0.5 * FALLING
    (check,), (estimate,) = study.branches, study.errors
    assert check.again.currents == pytest.approx(record.currents, rel=ROUTES)
    current = estimate.quantity("I amperes")
    assert current.value == pytest.approx(FALLING, rel=ROUTES)
    assert 0.0 < current.relative < 0.1
    assert not estimate.warnings


def test_ratings_are_those_of_the_temperatures(heated: Study, linear: Study) -> None:
    """For the design's rise, 10 K, at which radiation and resistances change by some per cent; summary and report."""
    warm, cold = (heating(study, study.records[0]) for study in (heated, linear))
    area = fabric_area(heated.mesh, heated.records[0].configuration)
    for one, other, field in zip(warm, cold, heated.records[0].fields, strict=True):
        assert one.rated_current == field.rated[1]
        assert one.rated_power_density == pytest.approx(100 * field.rated[2] / area, rel=ROUTES)
        assert 0.001 < abs(one.rated_current / other.rated_current - 1) < 0.1
    assert [each.rated_current for each in warm[:3]] == pytest.approx([warm[0].rated_current] * 3, rel=1e-8)  # one path
    told = summary(heated)["states"][0]["heating"][1]
    assert told["rated_power_W"] == warm[1].rated_power
    assert rated_currents(heated, 10.0).tolist() == [[each.rated_current for each in warm]]
    assert np.isnan(rated_currents(heated, 20.0)).all()
    assert "at the temperatures of that rise" in page(heated, {})
    assert "conductivities do not change" in page(linear, {})


def test_commands_go_on_with_a_stored_study(
    folder: Path, heated: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    undrawn(monkeypatch)
    assert main(["verify", str(folder)]) == ExitCode.DONE
    capsys.readouterr()
    deck = (folder / "netlists" / "relaxed_volts.cir").read_text(encoding="ascii")
    assert main(["netlist", str(folder), "--kind", "deck", "--probe", "volts"]) == ExitCode.DONE
    assert capsys.readouterr().out == deck
    with pytest.warns(CircuittexWarning, match="one state"):
        export_library(heated, tmp_path / "library")
    write_kit(heated, tmp_path / "kit")
    with pytest.raises(DesignError, match=r"rise: 20\.0 is not usable.*electrical\.rated_rise.*10"):
        export_library(heated, tmp_path / "other", rise=20.0)
    alike = tmp_path / "library" / "examples"
    assert (alike / "probe_volts_free.cir").read_text(encoding="ascii") == deck
    assert "those at 27 C" in (alike / "probe_volts_crimped.cir").read_text(encoding="ascii")


def test_runaway_names_probe_state_and_limit(heated: Study) -> None:
    """A resistance that falls, and a voltage that heats it without end."""
    design = replace(weave(tc1=-METAL), probes=(Probe("volts", "left", "right", 20.0),))
    with pytest.raises(DesignError, match=r"probes\.volts\.voltage: 20\.0 .*'relaxed'.*thermal runaway.*up to .* V"):
        run_study(design)
    (record,) = heated.records
    coefficients = coefficients_of(design, record.contacts)
    assert np.all(coefficients.fibril == [-METAL, 0.0])
    calm = design.probes[0].at(0.5)
    cooling = cooling_of(design, heated.mesh)
    assert solve_steady(record.contacts, design.terminals, calm, coefficients, cooling=cooling).currents[0] > 0.0


def test_the_key_wants_something_to_follow() -> None:
    with pytest.raises(DesignError, match=r"electrical\.heating: 'nonlinear'.*nothing of the design is nonlinear"):
        weave(tc1=0.0, across=0.0, emissivity=0.0)
    for changes in ({"tc1": METAL}, {"across": ACROSS}, {"emissivity": 0.5}):
        weave(**{"tc1": 0.0, "across": 0.0, "emissivity": 0.0, **changes})
    with pytest.raises(DesignError, match=r"electrical\.heating: 'quadratic'"):
        Electrical(heating="quadratic")
