"""Resistances that follow their temperatures, and radiation with T^4: closed forms, SciPy, balances and runaway."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from synthetic import fibrils, rails, touching, woven

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal, plain_weave
from circuittex.electrical.fields import (
    COLD_ENDS,
    Coefficients,
    Cooling,
    Fields,
    at_temperatures,
    coefficients_of,
    solve_potentials,
    solve_probes,
    solve_steady,
    steady,
)
from circuittex.electrical.fields.cooling import STEFAN_BOLTZMANN
from circuittex.geometry.weave import build_mesh
from circuittex.study.library.resistivity import scaled, warmer

LENGTH, RADIUS, OHM, K = 8.0, 0.15, 0.5, 1.0
"""mm, mm, ohm/mm and W/(mm K) of the made-up fibrils."""
KA = K * np.pi * RADIUS**2
WHOLE = OHM * LENGTH
"""ohm, of a cold fibril."""
ENDS = (Terminal("one", (("warp1", -1),)), Terminal("other", (("warp1", 1),)))
SURFACE = 2 * np.pi * RADIUS * LENGTH
"""mm2."""
H, RADIATES = 2e-5, 0.9 * STEFAN_BOLTZMANN
"""W/(mm2 K), still air's, and W/(mm2 K4)."""
ROUNDING = 1e-9
"""Relative. What one fibril of one temperature is known to: equations that elements represent exactly."""
DRIVES = {"voltage": 0.25, "current": -0.06, "power_density": 0.015}
"""V, A and, for an area of 1 mm2, W: what warms one fibril by some 70 K."""
HOT = {"voltage": 50.0, "current": 0.04, "power_density": 2.0}
"""The same for the contacts of a cell, by some 40 K."""


def along(**drive: float) -> Probe:
    return Probe("along", "one", "other", **drive)


def following(state: ContactState, tc1: float, tc2: float = 0.0, across: float = 0.0) -> Coefficients:
    """The same coefficients for all fibrils, and tc1 = `across` for all contacts."""
    return Coefficients(np.tile([tc1, tc2], (state.mesh.n_fibrils, 1)), np.tile([across, 0.0], (state.n_contacts, 1)))


def surfaces(state: ContactState, h: float = H, radiates: float = 0.0, end: float | None = 0.0) -> Cooling:
    """Losses along all fibrils, and ends of one conductance, W/K; None for cold ones."""
    n, outline = state.mesh.n_fibrils, 2 * np.pi * RADIUS
    radiating = np.full(n, radiates * outline) if radiates else np.empty(0)
    return Cooling(np.full(n, h * outline), np.empty(0) if end is None else np.full(n, end), radiating)


def straight(elements: int = 4) -> ContactState:
    return rails(OHM, 0.0, LENGTH, 1, elements=elements)


def leaves(T: float, h: float = H, radiates: float = RADIATES) -> float:
    """W, from a fibril of one temperature."""
    return SURFACE * (h * T + radiates * ((300.0 + T) ** 4 - 300.0**4))


@pytest.mark.parametrize("stated", DRIVES)
@pytest.mark.parametrize(("tc1", "tc2"), [(0.004, 1e-6), (-0.002, 0.0), (0.0, 0.0)])
def test_a_fibril_of_one_temperature(stated: str, tc1: float, tc2: float) -> None:
    """Ends insulated: what a resistor of its temperature releases leaves by h and T^4, an equation for one number."""
    state, drive = straight(), DRIVES[stated]
    released: dict[str, Callable[[float], float]] = {
        "voltage": lambda R: drive**2 / R,
        "current": lambda R: drive**2 * R,
        "power_density": lambda R: drive,
    }
    T = brentq(
        lambda T: leaves(T) - released[stated](WHOLE * (1 + tc1 * T + tc2 * T**2)), 0.0, 400.0, xtol=1e-12, rtol=1e-14
    )
    found = solve_steady(
        state,
        ENDS,
        along(**{stated: drive}),
        following(state, tc1, tc2),
        cooling=surfaces(state, H, RADIATES),
        area=1.0,
    )
    assert T > 20.0  # radiation is some per cent off linear there, resistances up to a third off cold ones
    np.testing.assert_allclose(found.temperature[found.fibril == 0], T, rtol=ROUNDING)
    R = WHOLE * (1 + tc1 * T + tc2 * T**2)
    assert found.voltage / found.currents[0] == pytest.approx(R, rel=ROUNDING)
    assert found.heat_lost == pytest.approx(leaves(T), rel=ROUNDING)
    assert found.heat_out == 0.0
    if stated == "current":
        assert found.currents[0] == pytest.approx(drive, rel=ROUNDING)


@pytest.mark.parametrize("stated", DRIVES)
def test_a_fibril_of_one_temperature_however_little_leaves(stated: str) -> None:
    """Surfaces that take 16 decades less than a segment conducts, and as much less power: no runaway, but that rise."""
    part, state = 1e-12, straight(elements=500)
    drive = DRIVES[stated] * (1.0 if stated == "power_density" else np.sqrt(part))
    found = solve_steady(
        state,
        ENDS,
        along(**{stated: drive}),
        following(state, 0.004),
        cooling=surfaces(state, part * H),
        area=part,
        rise=10.0,
    )
    power = found.voltage * found.currents[0]
    T = power / (SURFACE * part * H)
    assert T > 20.0
    np.testing.assert_allclose(found.temperature[found.fibril == 0], T, rtol=ROUNDING)
    assert found.voltage / found.currents[0] == pytest.approx(WHOLE * (1 + 0.004 * T), rel=ROUNDING)
    assert found.rated[2] == pytest.approx(SURFACE * part * H * 10.0, rel=ROUNDING)


def test_a_coated_fibril_of_one_temperature() -> None:
    """Core and shell side by side, of which the shell carries a third when cold: each resists as it is warm."""
    state, (tc1, tc2), (shell1, shell2), w, volts = straight(), (0.005, 0.0), (-0.003, 4e-6), 1 / 3, DRIVES["voltage"]

    def resistance(T: float) -> float:
        return WHOLE / ((1 - w) / (1 + tc1 * T + tc2 * T**2) + w / (1 + shell1 * T + shell2 * T**2))

    T = brentq(lambda T: leaves(T) - volts**2 / resistance(T), 0.0, 400.0, xtol=1e-12, rtol=1e-14)
    n = state.mesh.n_fibrils
    given = replace(
        following(state, tc1, tc2), shell=np.tile([shell1, shell2], (n, 1)), in_shell=np.full(n, w, dtype=np.float64)
    )
    found = solve_steady(state, ENDS, along(voltage=volts), given, cooling=surfaces(state, H, RADIATES))
    np.testing.assert_allclose(found.temperature[found.fibril == 0], T, rtol=ROUNDING)
    assert volts / found.currents[0] == pytest.approx(resistance(T), rel=ROUNDING)


def test_fibrils_follow_the_coefficients_of_exported_parts() -> None:
    """Of bare and of coated yarns, as a library has them at 50 K."""
    design = plain_weave(yarns=2, rows=(1,))
    bare = design.weave.warp[0]
    core, shell = (
        replace(bare.materials[0], name=name, tc1=tc1, tc2=tc2, electrical_conductivity=sigma)
        for name, tc1, tc2, sigma in (("core", 0.006, 1e-6, 5.0), ("shell", 0.001, 3e-6, 20.0))
    )
    plated = replace(bare, name="plated", materials=(core,), shell=shell, shell_thickness=0.2 * bare.radius)
    design = replace(design, weave=replace(design.weave, warp=(plated, plated)))
    mesh, none = build_mesh(design), np.zeros(0)
    state = ContactState(mesh, none.astype(int), none.astype(int), *[none] * 8, np.ones(len(mesh.elements)))
    f, _ = coefficients_of(design, state).resistivity(np.arange(4), np.full((4, 1), 50.0))
    warm = scaled(design, state, warmer(50.0)).mesh.electrical_conductivity
    np.testing.assert_allclose(f[:, 0], mesh.electrical_conductivity / warm, rtol=1e-14)
    assert abs(f[0, 0] - 1.0) > 0.01
    assert f[2, 0] == 1.0


def by_scipy(volts: float, tc1: float, tc2: float, h: float, radiates: float) -> Any:
    """(T, T', U) along a fibril with cold ends, and the current, a parameter: kA T'' = leaves - i^2 rho, U' = i rho."""

    def slopes(x: Floats, y: Floats, p: Floats) -> Floats:
        rho = OHM * (1 + tc1 * y[0] + tc2 * y[0] ** 2)
        lost = 2 * np.pi * RADIUS * (h * y[0] + radiates * ((300.0 + y[0]) ** 4 - 300.0**4))
        return np.stack([y[1], (lost - p[0] ** 2 * rho) / KA, p[0] * rho])

    x = np.linspace(0.0, LENGTH, 41)
    guess = np.stack([np.sin(np.pi * x / LENGTH), 0 * x, volts * x / LENGTH])
    return solve_bvp(
        slopes, lambda a, b, p: np.array([a[0], b[0], a[2], b[2] - volts]), x, guess, p=[volts / WHOLE], tol=1e-9
    )


@pytest.mark.parametrize("tc1", [0.004, -0.002])
def test_a_fibril_with_cold_ends_against_scipy(tc1: float) -> None:
    """Temperatures and current, at second order in the elements of which each has its mean resistivity."""
    volts, tc2, h = 4.0, 1e-6, 2e-3
    exact = by_scipy(volts, tc1, tc2, h, RADIATES)
    assert exact.success
    wrong = []
    for elements in (8, 16):
        state = straight(elements)
        found = solve_steady(
            state,
            ENDS,
            along(voltage=volts),
            following(state, tc1, tc2),
            cooling=surfaces(state, h, RADIATES, None),
            mesh="mechanical",
        )
        own = found.fibril == 0
        T = exact.sol(found.xi[own])[0]
        wrong.append(
            (
                float(np.abs(found.temperature[own] - T).max() / T.max()),
                abs(found.currents[0] / float(exact.p[0]) - 1.0),
            )
        )
    assert T.max() > 30.0
    for coarse, fine in zip(*wrong, strict=True):
        assert fine < 2e-3
        assert 3.0 < coarse / fine < 6.0  # 2^2, approached as elements become short


def test_the_hottest_point_between_cold_ends_follows_from_the_voltage_alone() -> None:
    """Kohlrausch's relation, V^2 / 8 = integral of k rho dT from the ends to the middle: whatever the shape."""
    volts, tc1, tc2 = 6.0, 0.004, 2e-6
    T = brentq(lambda T: KA * OHM * (T + tc1 * T**2 / 2 + tc2 * T**3 / 3) - volts**2 / 8, 0.0, 1000.0)
    peaks = []
    for elements in (8, 16):
        state = straight(elements)
        found = solve_steady(state, ENDS, along(voltage=volts), following(state, tc1, tc2), cooling=COLD_ENDS)
        peaks.append(abs(found.peak_temperature / T - 1.0))
    assert T > 100.0
    assert peaks[1] < 1e-3
    assert 3.0 < peaks[0] / peaks[1] < 6.0


TOUCHING = (Terminal("left", (("warp1", -1),)), Terminal("top", (("weft2", 1),)))


@pytest.fixture(scope="module")
def cell() -> ContactState:
    return woven(yarns=2, per_yarn=3, points=6, seed=2)


@pytest.mark.parametrize("stated", DRIVES)
@pytest.mark.parametrize("end", [None, 3e-3])
def test_what_is_fed_in_leaves_and_the_circuit_carries_it(cell: ContactState, stated: str, end: float | None) -> None:
    """V I = ends + surfaces, with contacts that heat, conduct heat and change; and the fields of the contacts at these
    temperatures, which know nothing of heat, carry the same currents."""
    drive = HOT[stated] * (1.0 if end else 16.0 if stated == "power_density" else 4.0)  # cold ends take more
    probe = Probe("across", "left", "top", **{stated: drive})
    cooling = surfaces(cell, 1e-4, RADIATES, end)
    found = solve_steady(cell, TOUCHING, probe, following(cell, 0.004, 1e-6, -0.001), cooling=cooling, area=1.0)
    assert found.peak_temperature > 30.0
    assert found.heat == pytest.approx(found.voltage * found.currents[0], rel=ROUNDING)
    assert found.heat_out + found.heat_lost == pytest.approx(found.heat, rel=ROUNDING)
    assert found.heat_lost > 0.0
    assert found.heat_out > 0.0
    known = {
        "voltage": found.voltage,
        "current": found.currents[0],
        "power_density": found.voltage * found.currents[0],
    }
    assert known[stated] == pytest.approx(drive, rel=ROUNDING)
    (plain,) = solve_potentials(at_temperatures(cell, found), TOUCHING, [probe.at(found.voltage)])
    assert plain.currents[0] == pytest.approx(found.currents[0], rel=ROUNDING)
    (cold,) = solve_potentials(cell, TOUCHING, [probe.at(found.voltage)])
    assert abs(cold.currents[0] / found.currents[0] - 1.0) > 0.005


def test_nothing_that_changes_is_the_linear_solution(cell: ContactState) -> None:
    """To rounding: no coefficient, no T^4."""
    probe = Probe("across", "left", "top", 2.0)
    cooling = surfaces(cell, 1e-4, 0.0, 3e-3)
    found = solve_steady(cell, TOUCHING, probe, following(cell, 0.0), cooling=cooling)
    (linear,) = solve_probes(cell, TOUCHING, [probe], cooling=cooling)
    assert found.currents[0] == pytest.approx(linear.currents[0], rel=ROUNDING)
    np.testing.assert_allclose(found.temperature, linear.temperature, rtol=0, atol=ROUNDING * linear.peak_temperature)
    np.testing.assert_allclose(np.concatenate([found.resistivity, found.contact_resistivity]), 1.0, rtol=1e-15)
    assert at_temperatures(cell, linear) is cell
    with pytest.raises(DesignError, match=r"cooling\.radiating.*solve_steady"):
        solve_probes(cell, TOUCHING, [probe], cooling=surfaces(cell, 1e-4, RADIATES))


def test_small_coefficients_change_the_current_by_the_mean_rise() -> None:
    """I = I0 (1 - tc1 <T>) + O(tc1^2), <T> = V^2 / (12 kA rho) of the linear solution between cold ends: the rest goes
    down by 4 for half the coefficient."""
    state, volts = straight(), 2.0
    mean, rest = volts**2 / (12 * KA * OHM), []
    for tc1 in (2e-3, 1e-3):
        found = solve_steady(state, ENDS, along(voltage=volts), following(state, tc1), cooling=COLD_ENDS)
        rest.append(found.currents[0] * WHOLE / volts - (1 - tc1 * mean))
    assert 0.0 < rest[0] < (2e-3 * mean) ** 2 * 2
    assert rest[0] / rest[1] == pytest.approx(4.0, rel=0.05)  # 2^2, and 2^3 of the next order by 2 % of it


def test_newton_converges_at_second_order(cell: ContactState, monkeypatch: pytest.MonkeyPatch) -> None:
    """Corrections d with d3 = O(d2^2), which a tangent that leaves anything out would not give."""
    sizes: list[float] = []
    inner = steady._correction

    def spied(*given: Any) -> tuple[Floats, float] | None:
        found = inner(*given)
        assert found is not None
        sizes.append(float(np.abs(found[0]).max()))
        return found

    monkeypatch.setattr(steady, "_correction", spied)
    n = cell.mesh.n_fibrils
    for stated, drive in HOT.items():
        sizes.clear()
        probe = Probe("across", "left", "top", **{stated: drive})
        cooling = surfaces(cell, 1e-4, RADIATES, 3e-3)
        plated = {"shell": np.tile([-0.002, 2e-6], (n, 1)), "in_shell": np.full(n, 0.3)}
        given = replace(following(cell, 0.004, 1e-6, -0.001), **plated)
        solve_steady(cell, TOUCHING, probe, given, cooling=cooling, area=1.0)
        first, second, third = sizes[:3]
        assert second < 0.3 * first
        assert third < 3 * second * (second / first) ** 2  # at first order: second * (second / first)


FALLING = -0.004
"""1/K, of carbon or a semiconductor."""
FOLD = np.sqrt(H * SURFACE / (4 * -FALLING) * WHOLE)
"""V: V^2 / R0 = h S T (1 - a T) has its largest value h S / (4 a) at T = 1 / (2 a)."""


def uniform(probe: Probe, tc1: float) -> Fields:
    state = straight()
    return solve_steady(state, ENDS, probe, following(state, tc1), cooling=surfaces(state))


def test_below_the_fold_a_voltage_has_the_colder_of_two_states() -> None:
    """T = (1 - sqrt(1 - V^2 / fold^2)) / (2 a)."""
    for part in (0.5, 0.9, 0.999):
        found = uniform(along(voltage=part * FOLD), FALLING)
        T = (1 - np.sqrt(1 - part**2)) / (2 * -FALLING)
        assert found.peak_temperature == pytest.approx(
            T, rel=1e-8
        )  # near the fold rounding counts 1 / sqrt(2e-3) times


@pytest.mark.parametrize("times", [1.002, 50.0, 1e5])
def test_past_the_fold_a_voltage_is_refused(times: float) -> None:
    """And the error says where the fold is: it lies within four of the shortest steps, 0.1 % of the square each."""
    with pytest.raises(DesignError, match=r"probes\.along\.voltage.*thermal runaway") as refused:
        uniform(along(voltage=times * FOLD), FALLING)
    most = float(refused.value.allowed.split()[-2])
    assert 0.998 * FOLD < most < 1.0001 * FOLD


def test_a_current_keeps_what_a_voltage_would_not() -> None:
    """i^2 R0 = h S T / (1 - a T): the same fibril as hot as 0.9 / a, where a voltage has its fold at half of 1 / a."""
    T = 0.9 / -FALLING
    found = uniform(along(current=np.sqrt(H * SURFACE * T / (1 + FALLING * T) / WHOLE)), FALLING)
    assert found.peak_temperature == pytest.approx(T, rel=ROUNDING)
    assert T > 1 / (2 * -FALLING)


def test_a_current_through_a_metal_runs_away() -> None:
    """T = c / (1 - c tc1), c = i^2 R0 / (h S), has no bound at c tc1 = 1, and what solves it beyond is below zero."""
    tc1 = 0.004
    most = np.sqrt(H * SURFACE / (tc1 * WHOLE))
    found = uniform(along(current=0.9 * most), tc1)
    assert found.peak_temperature == pytest.approx(0.81 / tc1 / (1 - 0.81), rel=ROUNDING)
    with pytest.raises(DesignError, match=r"probes\.along\.current: 0\.\d+ is not usable.*thermal runaway"):
        uniform(along(current=1.1 * most), tc1)


@pytest.mark.parametrize("times", [1.5, 2.5])
def test_a_metal_between_cold_ends_runs_away(times: float) -> None:
    """T = (cos(m (x - L/2)) / cos(m L/2) - 1) / tc1, m^2 = i^2 rho tc1 / kA, has no bound at m L = pi. Beyond, what
    solves the equations is below zero somewhere, with resistances that are not positive."""
    state, tc1 = straight(8), 0.004
    most = np.pi / LENGTH * np.sqrt(KA / (OHM * tc1))
    with pytest.raises(DesignError, match=r"thermal runaway") as refused:
        solve_steady(state, ENDS, along(current=times * most), following(state, tc1), cooling=COLD_ENDS)
    # Elements of an eighth, of which each has one heat: (pi / 8)^2 / 24 = 0.6 % off; and the shortest steps.
    assert float(refused.value.allowed.split()[-2]) == pytest.approx(most, rel=0.01)


@pytest.mark.parametrize(("load", "held"), [(34.0, True), (36.0, False), (45.0, False)])
def test_a_colder_state_is_not_jumped_over(load: float, held: bool) -> None:
    """V^2 / R0 = h S T f(T), f = 1 - 0.009 T + 2.5e-5 T^2: T f goes up to 35.3 at 87 K, down to 31.9 and up again. So
    34 has three states, the coldest of which is reached, and 36 and 45 have one that is not, at 188 and 211 K."""
    tc1, tc2 = -0.009, 2.5e-5
    state = straight()
    probe = along(voltage=np.sqrt(load * H * SURFACE * WHOLE))
    roots = np.roots([tc2, tc1, 1.0, -load])
    given = following(state, tc1, tc2)
    if held:
        found = solve_steady(state, ENDS, probe, given, cooling=surfaces(state))
        assert found.peak_temperature == pytest.approx(float(roots.real.min()), rel=ROUNDING)
        return
    assert np.sum(np.abs(roots.imag) < 1e-9) == 1
    with pytest.raises(DesignError, match=r"thermal runaway"):
        solve_steady(state, ENDS, probe, given, cooling=surfaces(state))


@pytest.mark.parametrize("tc1", [0.004, FALLING])
def test_the_rated_current_of_a_fibril_of_one_temperature(tc1: float) -> None:
    """I^2 R0 f(T) = leaves(T) at the rise that is asked for, whatever the drive: past the fold of a voltage as well."""
    state, T = straight(), 0.9 / -FALLING
    cooling = surfaces(state, H, RADIATES)
    for probe in (along(voltage=1e-3), along(current=0.02)):
        found = solve_steady(state, ENDS, probe, following(state, tc1), cooling=cooling, rise=T)
        assert found.rated.tolist() == pytest.approx(
            [T, np.sqrt(leaves(T) / (WHOLE * (1 + tc1 * T))), leaves(T)], rel=ROUNDING
        )
    if tc1 < 0.0:  # 1 + tc1 T is negative there
        beyond = solve_steady(state, ENDS, along(voltage=1e-3), following(state, tc1), cooling=cooling, rise=-1.1 / tc1)
        assert np.isnan(beyond.rated[1:]).all()
    idle = (ENDS[0], Terminal("far", (("warp2", 1),)))
    nothing = Probe("apart", "one", "far", 1.0)
    assert np.isnan(solve_steady(state, idle, nothing, following(state, tc1), cooling=cooling, rise=T).rated[1:]).all()


def test_a_rating_is_of_the_hottest_point_inside_an_element() -> None:
    """Which a cool neighbour moves off the middle: what a current does beside the one it is rated for says the same."""
    mesh = fibrils([LENGTH, LENGTH], elements=3, sigma=1.0 / (OHM * np.pi * RADIUS**2))
    state = touching(mesh, 0, 2.9, 1, 2.9, conductance=0.0, heat_conductance=0.05)
    given = following(state, 0.004)
    faint = solve_steady(state, ENDS, along(voltage=1e-3), given, cooling=COLD_ENDS, rise=50.0)
    found = solve_steady(state, ENDS, along(current=faint.rated[1]), given, cooling=COLD_ENDS)
    assert found.peak_temperature == pytest.approx(50.0, rel=1e-8)  # sought to 1e-9
    assert found.temperature.max() < 0.999 * found.peak_temperature


def test_the_rated_current_makes_the_rated_rise(cell: ContactState) -> None:
    """With contacts, and whatever drives what is rated."""
    given = following(cell, 0.004, 1e-6, -0.001)
    for end in (None, 3e-3):
        cooling = surfaces(cell, 1e-4, RADIATES, end)
        faint = solve_steady(cell, TOUCHING, Probe("across", "left", "top", 0.1), given, cooling=cooling, rise=30.0)
        rise, current, power = faint.rated.tolist()
        found = solve_steady(cell, TOUCHING, Probe("across", "left", "top", current=current), given, cooling=cooling)
        assert rise == 30.0
        assert found.peak_temperature == pytest.approx(30.0, rel=1e-8)  # sought to 1e-9
        assert found.voltage * current == pytest.approx(power, rel=1e-8)


def test_a_power_by_area_needs_the_area() -> None:
    state = straight()
    with pytest.raises(DesignError, match=r"area: 0\.0 is not usable.*power"):
        solve_steady(state, ENDS, along(power_density=1.0), following(state, 0.0), cooling=COLD_ENDS)


def test_what_carries_no_current_cannot_be_driven_by_one() -> None:
    state = straight()
    apart = (ENDS[0], Terminal("far", (("warp2", 1),)))
    with pytest.raises(DesignError, match=r"probes\.apart\.current.*no current flows"):
        solve_steady(state, apart, Probe("apart", "one", "far", current=1.0), following(state, 0.0), cooling=COLD_ENDS)
    idle = solve_steady(state, apart, Probe("apart", "one", "far", 1.0), following(state, 0.004), cooling=COLD_ENDS)
    assert idle.peak_temperature == 0.0


def test_any_scale_is_the_same_iteration(cell: ContactState) -> None:
    """Currents and heats 2^20 times as large, and all conductances and losses: the same temperatures, to rounding."""
    probe = Probe("across", "left", "top", HOT["voltage"])
    found = []
    for times in (1.0, 2.0**20):
        mesh = replace(
            cell.mesh,
            electrical_conductivity=times * cell.mesh.electrical_conductivity,
            thermal_conductivity=times * cell.mesh.thermal_conductivity,
        )
        state = replace(
            cell, mesh=mesh, conductance=times * cell.conductance, heat_conductance=times * cell.heat_conductance
        )
        cooling = surfaces(state, times * 1e-4, times * RADIATES, times * 3e-3)
        found.append(solve_steady(state, TOUCHING, probe, following(cell, 0.004, 1e-6, -0.001), cooling=cooling))
    np.testing.assert_allclose(found[1].temperature, found[0].temperature, rtol=1e-12)
    assert found[1].currents[0] == pytest.approx(2.0**20 * found[0].currents[0], rel=1e-12)
