"""Heat that leaves along the fibrils and through their ends: the fin equation, balances, and a heater in still air."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from synthetic import rails, woven

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.design import Electrical, Probe, Terminal, plain_weave
from circuittex.electrical.fields import COLD_ENDS, Cooling, cooling_of, solve_fields, solve_probes
from circuittex.electrical.fields.cooling import STEFAN_BOLTZMANN, outline
from circuittex.geometry.weave import build_mesh
from circuittex.results.heating import heating
from circuittex.results.records import Study
from circuittex.results.report.page import page
from circuittex.results.soundness import doubts
from circuittex.results.summary import summary
from circuittex.study.run import run_study

LENGTH, RADIUS, OHM, K = 8.0, 0.15, 0.5, 1.0
"""mm, mm, ohm/mm and W/(mm K) of the made-up fibrils."""
AREA = np.pi * RADIUS**2
ENDS = (Terminal("one", (("warp1", -1),)), Terminal("other", (("warp1", 1),)))
ALONG = Probe("along", "one", "other", 1.0)
SOURCE = 1.0 / (OHM * LENGTH**2)
"""W/mm: Joule heat of one volt along a fibril."""
LOSS = 0.05
"""W/(mm K): heat reaches 1 / m = sqrt(k A / g) = 1.2 mm, a seventh of the fibril."""
DECAY = np.sqrt(LOSS / (K * AREA))


def fin(x: Floats, end: float) -> Floats:
    """k A T'' - g T + q = 0, k A T' = -+ G T at the ends: q/g (1 - B cosh(m (x - L/2)))."""
    half = DECAY * LENGTH / 2
    through = 1.0 if np.isinf(end) else end  # the ratio of 1 is that of cold ends
    B = through / (through * np.cosh(half) + (0.0 if np.isinf(end) else K * AREA * DECAY * np.sinh(half)))
    return np.asarray(SOURCE / LOSS * (1 - B * np.cosh(DECAY * (x - LENGTH / 2))))


@pytest.mark.parametrize("end", [np.inf, 0.0, 0.02])
def test_one_fibril_is_a_fin(end: float) -> None:
    """Temperature and heat at the ends, at fourth order in the nodes of quadratic elements: 2^4 for half the length."""
    wrong = []
    for elements in (16, 32):
        state = rails(OHM, 0.0, LENGTH, 1, elements=elements)
        each = np.full(2, LOSS), np.empty(0) if np.isinf(end) else np.full(2, end)
        found = solve_fields(state, ENDS, ALONG, cooling=Cooling(*each), mesh="mechanical")
        own = found.fibril == 0
        wrong.append(np.abs(found.temperature[own] - fin(found.xi[own], end)).max() / (SOURCE / LOSS))
        assert found.heat == pytest.approx(SOURCE * LENGTH, rel=1e-12)
        assert found.heat_out + found.heat_lost == pytest.approx(found.heat, rel=1e-12)
        if not np.isinf(end):
            out = 2 * end * float(fin(np.zeros(1), end)[0])
            assert found.heat_out == pytest.approx(out, rel=1e-3, abs=1e-15)
    assert wrong[1] < 1e-4
    assert wrong[1] == 0.0 or wrong[0] / wrong[1] > 10 or wrong[0] < 1e-12


def test_insulated_ends_leave_one_temperature() -> None:
    """Everything leaves where it is released: T = q / g, and no heat flows along."""
    state = rails(OHM, 0.0, LENGTH, 1, elements=8)
    found = solve_fields(state, ENDS, ALONG, cooling=Cooling(np.full(2, LOSS), np.zeros(2)))
    np.testing.assert_allclose(found.temperature[found.fibril == 0], SOURCE / LOSS, rtol=1e-10)
    assert found.heat_out == 0.0


@pytest.mark.parametrize("part", [1e-9, 1e-12, 1e-15])
def test_however_little_leaves_it_is_what_is_released(part: float) -> None:
    """Surfaces that take 13 to 19 decades less than a segment conducts, and nothing else: still T = q / g."""
    state, g = rails(OHM, 0.0, LENGTH, 1, elements=500), part * LOSS
    found = solve_fields(state, ENDS, ALONG, cooling=Cooling(np.full(2, g), np.zeros(2)))
    np.testing.assert_allclose(found.temperature[found.fibril == 0], SOURCE / g, rtol=1e-9)
    assert found.heat_lost == pytest.approx(found.heat, rel=1e-12)


@pytest.mark.parametrize("end", [None, 0.0, 3e-3])
def test_what_is_fed_in_leaves_whatever_the_contacts(end: float | None) -> None:
    """V I = ends + surface, with contacts that heat and conduct heat."""
    state = woven(per_yarn=3, points=6, seed=2)
    n = state.mesh.n_fibrils
    terminals = (Terminal("left", (("warp1", -1),)), Terminal("top", (("weft2", 1),)))
    probe = Probe("across", "left", "top", 2.0)
    cooling = Cooling(np.linspace(1e-3, 2e-3, n), np.empty(0) if end is None else np.full(n, end))
    found = solve_fields(state, terminals, probe, cooling=cooling)
    assert found.heat == pytest.approx(2.0 * found.currents[0], rel=1e-9)
    assert found.heat_out + found.heat_lost == pytest.approx(found.heat, rel=1e-9)
    assert found.heat_lost > 0.0
    assert (found.heat_out > 0.0) == (end != 0.0)
    cold = solve_fields(state, terminals, probe)
    assert cold.heat_lost == 0.0
    if end is None:
        assert found.peak_temperature < cold.peak_temperature


def test_nothing_stated_is_the_papers_to_the_last_bit() -> None:
    design = plain_weave(yarns=2)
    mesh = build_mesh(design)
    assert same(cooling_of(design, mesh), COLD_ENDS)
    state = woven(per_yarn=2, points=6)
    terminals = (Terminal("left", (("warp1", -1),)), Terminal("right", (("warp1", 1),)))
    probes = [Probe("along", "left", "right", 1.0)]
    one, other = (solve_probes(state, terminals, probes, **given)[0] for given in ({}, {"cooling": COLD_ENDS}))
    assert same(one, other)


def test_a_yarn_hands_over_by_its_outline() -> None:
    """Rows of 3, 4, 3: 1.2 mm by 0.9 mm; the circumference of that ellipse by the integral, shared by ten."""
    design = plain_weave(yarns=2)
    h, emissivity = 1e-5, 0.9
    design = replace(design, electrical=Electrical(heat_loss=h, emissivity=emissivity, thermal_ends=50.0))
    t = (np.arange(20_000) + 0.5) * np.pi / 10_000
    around = float(np.sum(np.hypot(0.6 * np.sin(t), 0.45 * np.cos(t))) * np.pi / 10_000)
    assert outline(design.weave.warp[0]) == pytest.approx(around, rel=1e-6)
    cooling = cooling_of(design, build_mesh(design))
    total = h + 4 * emissivity * STEFAN_BOLTZMANN * 300.0**3
    np.testing.assert_allclose(cooling.loss, total * around / 10, rtol=1e-6)
    np.testing.assert_allclose(cooling.end, 1 / (50.0 * 10), rtol=1e-14)


def test_radiation_is_linear_for_small_rises() -> None:
    """Against T^4 along a fibril, by SciPy: 1.5 dT / 300 K of it, 1 % for a rise of 2 K."""
    perimeter, emissivity, T0 = 2 * np.pi * RADIUS, 0.8, 300.0
    heat = emissivity * STEFAN_BOLTZMANN * perimeter * ((T0 + 2.0) ** 4 - T0**4)

    def slopes(x: Floats, y: Floats) -> Floats:
        leaves = emissivity * STEFAN_BOLTZMANN * perimeter * ((T0 + y[0]) ** 4 - T0**4)
        return np.stack([y[1], (leaves - heat) / (K * AREA)])

    x = np.linspace(0.0, 300.0, 61)  # long beside 1 / m = 31 mm
    exact = solve_bvp(slopes, lambda a, b: np.array([a[0], b[0]]), x, np.ones((2, 61)), tol=1e-8)
    g = 4 * emissivity * STEFAN_BOLTZMANN * T0**3 * perimeter
    m = np.sqrt(g / (K * AREA))
    linear = heat / g * (1 - np.cosh(m * (x - 150.0)) / np.cosh(m * 150.0))
    np.testing.assert_allclose(linear, exact.sol(x)[0], rtol=0.0125, atol=1e-9)


SIDES = ((-1, "m"), (1, "p"))


@pytest.fixture(scope="module")
def heater() -> Study:
    """One fibril a yarn, insulated ends: the piece amid a larger heater, 10 W/(m2 K) from the outlines."""
    design = plain_weave(yarns=2, rows=(1,))
    electrical = Electrical(heat_loss=1e-5, thermal_ends="insulated")
    design = replace(design, weave=replace(design.weave, amplitude=0.16), electrical=electrical)
    left, right = (Terminal(f"end{sign}", (("warp1", side), ("warp2", side))) for side, sign in SIDES)
    return run_study(replace(design, terminals=(left, right), probes=(Probe("heat", "endm", "endp", 0.05),)))


def test_a_heater_in_still_air_warms_by_tens_of_kelvins(heater: Study) -> None:
    """All of V I leaves along the yarns, so that their mean rise is V I over h times their outlines; by the area of
    the fabric that is tens of kelvins for 0.05 to 0.2 W/cm2, as people measure."""
    (record,) = heater.records
    (each,) = heating(heater, record)
    volt, current = 0.05, record.currents[0]
    assert each.power == pytest.approx(volt * current, rel=1e-9)
    assert each.power_density == pytest.approx(100 * volt * current / 16.0, rel=1e-9)  # two pitches of 2 mm, squared
    assert each.along == pytest.approx(1.0, rel=1e-9)
    mean = each.power / (1e-5 * 2 * np.pi * RADIUS * 4 * 4.0)  # four yarns of 4 mm
    assert mean < each.rise < 2.0 * mean * (1 + 1e-9)  # twice: the weft would have none of it
    assert 0.05 * each.rise / each.power_density > 10.0
    assert 0.2 * each.rise / each.power_density < 500.0


def test_report_and_summary_tell_of_heat(heater: Study) -> None:
    (probe,) = summary(heater)["states"][0]["heating"]
    assert probe["power_density_W_cm2"] == heating(heater, heater.records[0])[0].power_density
    assert "W/cm²" in page(heater, {})
    cold = replace(heater, design=replace(heater.design, electrical=Electrical()))
    assert "W/cm²" not in page(cold, {})


@pytest.mark.parametrize(("loss", "balanced"), [(1e-20, False), (1e-12, True)])
def test_heat_that_is_not_balanced_is_a_doubt(heater: Study, loss: float, balanced: bool) -> None:
    """A surface that takes 17 decades less than the contacts hand over: there are no digits for that."""
    (record,), design = heater.records, heater.design
    design = replace(design, electrical=replace(design.electrical, heat_loss=loss))
    fields = solve_probes(
        record.contacts, design.terminals, design.probes, cooling=cooling_of(design, record.contacts.mesh)
    )
    kinds = [doubt.kind for doubt in doubts(replace(heater, design=design), replace(record, fields=fields))]
    assert ("balance" in kinds) != balanced
    assert not any(doubt.kind == "balance" for doubt in doubts(heater, record))


def test_heat_must_leave_somewhere() -> None:
    with pytest.raises(DesignError, match=r"electrical\.thermal_ends: 'insulated'.*heat must leave somewhere"):
        Electrical(thermal_ends="insulated")
    with pytest.raises(DesignError, match=r"electrical\.thermal_ends: 0\.0.*> 0"):
        Electrical(thermal_ends=0.0)
