"""Probes driven by a current or a power for each area, and their ratings: resistance and fin of one fibril."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from canned import undrawn
from small_design import SMALL

from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.design import (
    Clamps,
    Design,
    Electrical,
    Probe,
    Terminal,
    design_hash,
    parse_design,
    plain_weave,
    uniaxial,
)
from circuittex.electrical.fields import Fields, cooling_of, solve_fields, solve_probes
from circuittex.electrical.spice.ngspice import run_deck
from circuittex.results.heating import fabric_area, heating
from circuittex.results.records import Record, Study
from circuittex.results.report.page import page
from circuittex.results.soundness import doubts
from circuittex.results.store import load_study
from circuittex.results.summary import summary, table
from circuittex.study.drive import at_voltages
from circuittex.study.ensemble.quantities import measure, quantities
from circuittex.study.kit import write_kit
from circuittex.study.library.export import export_library
from circuittex.study.run import run_study

pytestmark = pytest.mark.xdist_group("drive")  # what its fixtures make serves one worker

EXACT = 1e-12
"""Relative: one linear solution in double precision, of some hundred unknowns whose conductances are alike."""
ROUTES = 1e-9
"""Relative: what routes may differ by (`AGREEMENT`), ngspice among them."""

SIGMA, K, RADIUS, SPAN, STRETCH = 10.0, 1.0, 0.15, 4.0, 0.25
SECTION = np.pi * RADIUS**2
OHM = SPAN / (SIGMA * SECTION)
"""Of one fibril from end to end, whatever the weave does to it: sigma is constant in the reference frame."""
LOSS = 0.05
"""W/(mm2 K), so that heat reaches a third of the span along the fibril: neither end nor surface are all of it."""
PERIMETER = 2 * np.pi * RADIUS
DECAY = np.sqrt(LOSS * PERIMETER / (K * SECTION))
AMPERE, DENSITY, RISE = -0.03, 2e-4, 40.0
BEFORE = "800b9998e6b3582cb619be7064263446b5a739e683c7593547828d4177283361"
"""Hash of the small design in the last version whose probes were driven by voltages alone."""
FIN = 2e-5
"""Relative error of quadratic elements: (DECAY h)^4 / 100 or so at the middle, with 20 of them, 0.2 mm long."""


def peak(current: float) -> float:
    """K A T'' - g T + I^2 / (sigma A) = 0 with cold ends, in the middle: q / g (1 - 1 / cosh(m L / 2))."""
    return current**2 / (SIGMA * SECTION) / (LOSS * PERIMETER) * (1 - 1 / np.cosh(DECAY * SPAN / 2))


def weave(conductivity: float) -> Design:
    """Two by two single fibrils, stretched by a quarter along x."""
    design = plain_weave(yarns=2, rows=(1,), loading=(uniaxial("stretch", (STRETCH,)),))
    return replace(
        design,
        weave=replace(design.weave, amplitude=0.16),
        contact=replace(design.contact, conductivity=conductivity, heat_transfer=10.0 * conductivity),
        electrical=Electrical(heat_loss=LOSS, rated_rise=RISE),
        terminals=(
            Terminal("left", (("warp1", -1),)),
            Terminal("right", (("warp1", 1),)),
            Terminal("top", (("weft2", 1),)),
        ),
        probes=(
            Probe("volts", "left", "right", 0.5),
            Probe("amperes", "left", "right", current=AMPERE),
            Probe("watts", "left", "right", power_density=DENSITY),
            Probe("across", "left", "top", current=1e-3),
        ),
    )


@pytest.fixture(scope="module")
def alone() -> Study:
    """Fibrils that touch and hand over neither current nor heat: each is a fin, and no current flows across."""
    return run_study(weave(0.0))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cell whose contacts conduct, so that its resistances change with the stretch; its netlists merge none."""
    place, design = tmp_path_factory.mktemp("driven"), weave(0.01)
    all_contacts = replace(design.numerics, merge_length=0.0, snap_length=0.0, drop_fraction=0.0)
    run_study(replace(design, numerics=all_contacts), place)
    return place


@pytest.fixture(scope="module")
def cell(folder: Path) -> Study:
    return load_study(folder)


def probed(record: Record) -> dict[str, Fields]:
    return {field.probe: field for field in record.fields}


def test_a_current_or_a_power_along_one_fibril(alone: Study) -> None:
    """U = I R and U = sqrt(p S R), with the area of the fabric as it is in the state; temperatures are the fin's."""
    for record, area in zip(alone.records, (SPAN**2, (1 + STRETCH) * SPAN**2), strict=True):
        found = probed(record)
        assert found["volts"].currents[0] == pytest.approx(0.5 / OHM, rel=EXACT)
        assert found["amperes"].voltage == pytest.approx(AMPERE * OHM, rel=EXACT)
        assert found["amperes"].currents == pytest.approx(np.array([AMPERE, -AMPERE]), rel=EXACT)
        watts = DENSITY * area
        assert found["watts"].voltage == pytest.approx(np.sqrt(watts * OHM), rel=EXACT)
        assert found["watts"].heat == pytest.approx(watts, rel=EXACT)
        for field in (found[name] for name in ("volts", "amperes", "watts")):
            assert field.peak_temperature == pytest.approx(peak(float(field.currents[0])), rel=FIN)
            assert np.nanmax(np.abs(field.potential)) == abs(field.voltage)
    assert found["amperes"].peak_temperature / found["volts"].peak_temperature == pytest.approx(
        (AMPERE * OHM / 0.5) ** 2, rel=EXACT
    )


def test_the_area_of_the_fabric_is_that_between_its_clamps_and_edges() -> None:
    """Clamps slide under a force, and free edges draw in: power and W/cm2 are of what lies between the yarns' ends."""
    stretch, strip = uniaxial("stretch", (STRETCH / 10,)), uniaxial("strip", (STRETCH / 10,), free="y")
    design = replace(weave(0.01), clamps=Clamps(0.1, 0.0), loading=(stretch, strip))
    study = run_study(replace(design, probes=design.probes[2:3], numerics=replace(design.numerics, elements=8)))
    for record, state in zip(study.records, summary(study)["states"], strict=True):
        warp, weft = np.array(state["extension"]).reshape(2, 2).mean(axis=1)
        area = SPAN**2 * (1 + warp) * (1 + weft)
        assert abs(area / (SPAN**2 * np.linalg.det(record.gradient)) - 1) > 0.01  # what clamps and edges have moved
        (field,), (heat,) = record.fields, state["heating"]
        assert field.heat == pytest.approx(DENSITY * area, rel=ROUTES)
        assert heat["power_density_W_cm2"] == pytest.approx(100 * DENSITY, rel=ROUTES)
        assert heat["rated_power_density_W_cm2"] == pytest.approx(100 * heat["rated_power_W"] / area, rel=ROUTES)
        assert not any(doubt.kind == "drive" for doubt in doubts(study, record))


def test_ratings_of_one_fibril(alone: Study) -> None:
    """The same current whatever the probe is driven by, from the fin; power and W/cm2 are R I^2."""
    current = np.sqrt(RISE / peak(1.0))
    for record, area in zip(alone.records, (SPAN**2, (1 + STRETCH) * SPAN**2), strict=True):
        for each in heating(alone, record)[:3]:
            assert each.rated_current == pytest.approx(current, rel=FIN)
            assert each.rated_power == pytest.approx(OHM * current**2, rel=2 * FIN)
            assert each.rated_power_density == pytest.approx(100 * OHM * current**2 / area, rel=2 * FIN)


def test_where_no_current_flows_nothing_is_driven_and_it_is_said(alone: Study) -> None:
    """One volt, no current, no heat; a doubt about the state, null in the summary, a dash in the report."""
    for record, state in zip(alone.records, summary(alone)["states"], strict=True):
        idle = probed(record)["across"]
        assert (idle.voltage, idle.currents.tolist(), idle.peak_temperature) == (1.0, [0.0, 0.0], 0.0)
        (doubt,) = (each for each in doubts(alone, record) if each.kind == "drive")
        assert "across (0.001 A)" in doubt.text
        assert doubt.text in state["doubts"]
        told = state["heating"][3]
        assert [told[f"rated_{key}"] for key in ("current_A", "power_W", "power_density_W_cm2")] == [None] * 3
        assert record.verification.ngspice_checked
        assert record.verification.agrees
    assert "no voltage that there can be drives as stated" in table(alone)
    text = page(alone, {})
    assert "nan" not in re.sub(r"<[^>]*>|[a-z]*nan[a-z]+|[a-z]+nan", "", text)


def test_all_that_is_told_of_a_state_agrees(cell: Study, folder: Path) -> None:
    """Fields, summary, table and report; ngspice confirms the state and answers the decks with what is stated."""
    driven = []
    for record, state in zip(cell.records, summary(cell)["states"], strict=True):
        assert record.verification.ngspice_checked
        assert record.verification.agrees
        assert not any(doubt.kind == "drive" for doubt in doubts(cell, record))
        found = probed(record)
        area = SPAN**2 * np.linalg.det(record.gradient)
        assert [found[name].currents[0] for name in ("amperes", "across")] == pytest.approx([AMPERE, 1e-3], rel=ROUTES)
        assert found["watts"].voltage * found["watts"].currents[0] == pytest.approx(DENSITY * area, rel=ROUTES)
        assert state["currents_A"] == list(record.currents)
        assert [each["voltage_V"] for each in state["heating"]] == [field.voltage for field in record.fields]
        assert state["heating"][2]["power_density_W_cm2"] == pytest.approx(100 * DENSITY, rel=ROUTES)
        for field in record.fields:
            deck = (folder / "netlists" / f"{record.name}_{field.probe}.cir").read_text(encoding="ascii")
            (source,) = (name for name in re.findall(r"^(V\S+) .* (?!0\.0$)\S+$", deck, re.MULTILINE | re.IGNORECASE))
            assert -run_deck(deck).plots[0].current(source.lower())[0] == pytest.approx(field.currents[0], rel=ROUTES)
            assert ("drives the probe in this state" in deck) == (field.probe != "volts")
            assert cell.design_hash in deck
        driven.append(found["across"].voltage)
        assert f"{driven[-1]:#.4g}" in table(cell)
    assert abs(driven[1] / driven[0] - 1) > 0.01  # the stretch shows in the voltage
    assert "U across (V)" in page(cell, {})
    assert "0.02 W/cm2" in page(cell, {})


def test_an_ensemble_measures_the_voltage_that_follows(cell: Study) -> None:
    """Of a probe that is driven by a current it is all there is to know; names and values go together."""
    names = [quantity.column for quantity in quantities(cell.design)]
    assert [name for name in names if name.endswith("_V")] == [f"voltage_{n}_V" for n in ("amperes", "watts", "across")]
    for record in cell.records:
        values = dict(zip(names, measure(cell.design, record), strict=True))
        found = probed(record)
        assert values["voltage_across_V"] == found["across"].voltage
        assert values["current_watts_A"] == found["watts"].currents[0]
        assert values["Rc_ohm"] == record.fit.Rc


def test_a_state_is_that_of_its_voltages_to_the_last_bit(cell: Study) -> None:
    """No other solution than for a probe whose voltage is stated; such designs are what they were."""
    record = cell.records[1]
    volts = record.driven(cell.design)
    assert [probe.voltage for probe in volts.probes] == [field.voltage for field in record.fields]
    assert at_voltages(volts, record.contacts, 1.0) is volts
    assert record.driven(volts) is volts
    found = solve_probes(
        record.contacts, volts.terminals, volts.probes, cooling=cooling_of(cell.design, record.contacts.mesh)
    )
    assert same(found, record.fields)


def test_what_is_rated_is_reached(cell: Study) -> None:
    """Driven by the rated current, or by the rated power, the hottest point rises by what was asked for."""
    for record in cell.records:
        for number, each in enumerate(heating(cell, record)):
            own = cell.design.probes[number]
            probe = Probe(own.name, own.source, own.sink, **drive(each))
            area = fabric_area(cell.mesh, record.configuration)
            design = at_voltages(replace(cell.design, probes=(probe,)), record.contacts, area)
            cooling = cooling_of(design, cell.mesh)
            (field,) = solve_probes(record.contacts, design.terminals, design.probes, cooling=cooling)
            assert field.peak_temperature == pytest.approx(RISE, rel=ROUTES)


def drive(each: Any) -> dict[str, float]:
    """By power or by current, every other one."""
    if each.probe in ("volts", "across"):
        return {"power_density": each.rated_power_density / 100}
    return {"current": each.rated_current}


def test_a_stored_study_goes_on(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Commands on results know the voltages; libraries rate for the rise that the design states."""
    undrawn(monkeypatch)
    assert main(["verify", str(folder)]) == ExitCode.DONE
    capsys.readouterr()
    deck = (folder / "netlists" / "relaxed_amperes.cir").read_text(encoding="ascii")
    assert main(["netlist", str(folder), "--state", "relaxed", "--kind", "deck", "--probe", "amperes"]) == ExitCode.DONE
    assert capsys.readouterr().out == deck
    study = load_study(folder)
    export_library(study, tmp_path / "library")
    assert f"by {RISE:g} K" in (tmp_path / "library" / "datasheet.html").read_text(encoding="utf-8")
    for ends in ("free", "crimped"):  # yarns are single fibrils here
        alike = (tmp_path / "library" / "examples" / f"probe_amperes_{ends}.cir").read_text(encoding="ascii")
        assert repr(study.records[0].fields[1].voltage) in alike
    write_kit(study, tmp_path / "kit")


def test_errors_and_branches_show_in_currents_at_the_voltages_of_the_state() -> None:
    """Else a stated current would be without error, and the same on every branch."""
    design = replace(weave(0.01), loading=(), numerics=replace(weave(0.01).numerics, elements=8))
    study = run_study(design, error_estimate=True, branches=True)
    (estimate,), (check,) = study.errors, study.branches
    assert estimate.quantity("I across").value == pytest.approx(1e-3, rel=ROUTES)
    assert estimate.quantity("I across").absolute > 0.0
    assert not check.bifurcation


def small(**changes: object) -> Design:
    design = tomllib.loads(SMALL)
    design["probes"][0] = {"name": "straight", "source": "straight", "sink": "common", **changes}
    return parse_design(design)


def test_one_volt_where_nothing_is_stated_and_hashes_of_other_days() -> None:
    """Results of a design from before there were currents and powers are still its results: the hash that it had."""
    assert design_hash(small()) == design_hash(small(voltage="1000 mV")) == BEFORE
    assert small(current="20 mA").probes[0].current == 0.02
    assert small(power_density="0.1 W/cm2").probes[0].power_density == 0.001
    hashes = [design_hash(small(**{key: 1})) for key in ("voltage", "current", "power_density")]
    assert len(set(hashes)) == 3


@pytest.mark.parametrize(
    ("changes", "field", "allowed"),
    [
        ({"voltage": 1, "current": 1}, "probes.straight.current", "one of voltage, current and power_density"),
        ({"current": 1, "power_density": 1}, "probes.straight.power_density", "one of voltage, current"),
        ({"current": 0}, "probes.straight.current", "must not be 0 A"),
        ({"current": "1 V"}, "probes.straight.current", "in A"),
        ({"power_density": -1}, "probes.straight.power_density", "> 0 W/mm2"),
        ({"power_density": "1 W"}, "probes.straight.power_density", "in W/mm2"),
    ],
)
def test_drives_that_cannot_be(changes: dict[str, object], field: str, allowed: str) -> None:
    with pytest.raises(DesignError) as caught:
        small(**changes)
    assert caught.value.field == field
    assert allowed in str(caught.value)


def test_insulating_yarns_take_no_current() -> None:
    """Refused with the design, before anything is relaxed; a voltage may be applied to anything."""
    design = weave(0.01)
    yarn = design.weave.warp[0]
    insulator = replace(yarn.materials[0], name="insulator", electrical_conductivity=0.0)
    bare = replace(yarn, name="bare", materials=(insulator,))
    bare_weave = replace(design.weave, weft=(bare, bare))
    with pytest.raises(DesignError, match=r"probes\.across\.current: '0\.001 A'.*'top' conducts"):
        replace(design, weave=bare_weave)
    replace(design, weave=bare_weave, probes=(Probe("across", "left", "top", 1.0),))


def test_fields_want_a_voltage(cell: Study) -> None:
    with pytest.raises(DesignError, match=r"probes\.amperes\.current: '-0\.03 A'.*Record\.driven"):
        solve_fields(cell.records[0].contacts, cell.design.terminals, cell.design.probes[1])
