"""The native solution of panels against closed forms, the continuum, ngspice, differences, and the laws of networks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from circuittex.base.arrays import Floats
from circuittex.electrical.network.circuit import reached_part, reduced_circuit
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.network.ports import port_matrix
from circuittex.electrical.spice.ngspice import run_deck
from circuittex.netlist import parse, pin_names
from circuittex.solvers import laplacian
from circuittex.study.panel.cells import CellResistances
from circuittex.study.panel.circuit import panel_circuit, panel_netlists, ports_circuit
from circuittex.study.panel.gradient import panel_gradient
from circuittex.study.panel.solution import PanelSolution, solve_panel
from circuittex.study.panel.statement import Cut, Electrode, Panel, Seam

EXACT = 1e-12
"""Relative difference of two direct solutions of some hundred unknowns: some thousand roundings."""
SOLVED = 1e-9
"""Relative difference of a solution whose equations hold to 1e-10, with a factor for how far errors carry."""
LEFT = Electrode("left", edge="left", voltage=1.0)
RIGHT = Electrode("right", edge="right", voltage=0.0)


def cells(Ry: Any = 0.28, Rc: Any = 3.0, strain: tuple[float, ...] = (0.0,)) -> CellResistances:
    return CellResistances(Ry, Ry, Rc, strain)


def panel(shape: tuple[int, int] = (5, 7), law: CellResistances | None = None, **more: Any) -> Panel:
    electrodes = more.pop("electrodes", (LEFT, RIGHT))
    return Panel(shape, law or cells(), electrodes, **more)


def between(solution: PanelSolution, a: str = "left", b: str = "right") -> float:
    return float(solution.resistance[solution.electrodes.index(a), solution.electrodes.index(b)])


def end_electrodes(n: int, m: int, volts: Floats | None = None) -> tuple[Electrode, ...]:
    """One electrode for each yarn end, in the order of the ports of `reduced_circuit`."""
    words = [f"{way}{k + 1}" for way, count in (("warp", n), ("weft", m)) for k in range(count)]
    names = [(f"{word}_{side}", f"{word}{sign}") for word in words for side, sign in (("minus", "-"), ("plus", "+"))]
    return tuple(
        Electrode(name, ends=(end,), voltage=None if volts is None else float(volts[k]))
        for k, (name, end) in enumerate(names)
    )


def wild(seed: int = 0, shape: tuple[int, int] = (5, 7)) -> Panel:
    """A panel with everything: strain, a cut, a hole, seams, an insulating yarn, five electrodes of all kinds."""
    rng = np.random.default_rng(seed)
    law = CellResistances(
        np.array([0.2, 0.3, 0.35])[:, None, None] * rng.uniform(1.0, 2.0, (2, 1)),
        np.array([0.4, 0.5, 0.55])[:, None, None] * rng.uniform(1.0, 2.0, (1, 3)),
        np.array([9.0, 4.0, 3.0])[:, None, None] * rng.uniform(1.0, 2.0, (2, 3)),
        (0.0, 0.05, 0.1),
    )
    electrodes = (
        Electrode("left", edge="left", voltage=2.0),
        Electrode("pad", rectangle=(8.1, 5.9, 11.9, 8.1), current=0.3),
        Electrode("sense", ends=("weft2+",)),
        Electrode("right", ends=("warp1..2+",), voltage=-1.0),
        Electrode("tap", ends=("weft6..7-",), current=-0.2),
    )
    return Panel(
        shape,
        law,
        electrodes,
        strain=rng.uniform(0.005, 0.095, shape),
        pitch=2.0,
        cuts=(Cut(line=((4.0, 1.0), (4.0, 6.0))), Cut(rectangle=(5.5, 0.5, 7.5, 1.5))),
        seams=(Seam(0.7, rectangle=(0.0, 6.0, 4.0, 10.0)), Seam(2.0, crossings=((1, 1), (3, 2)))),
        insulating=("warp4",),
    )


# Closed forms


@pytest.mark.parametrize("Rc", [np.inf, 3.0, 1e-9])
def test_yarns_in_parallel_whatever_the_crossings(Rc: float) -> None:
    """Equal yarns between two bars: their potentials are alike, so no current passes a crossing: R = Ry m / n."""
    n, m, Ry = 5, 7, 0.28
    found = solve_panel(panel((n, m), cells(Ry, Rc)))
    assert between(found) == pytest.approx(Ry * m / n, rel=1e-9)
    assert found.current == pytest.approx([n / (Ry * m), -n / (Ry * m)])
    drop = (np.arange(m) + 0.5) / m
    np.testing.assert_allclose(found.warp_voltage, np.tile(1.0 - drop, (n, 1)), rtol=1e-9)


def test_perfect_crossings_in_a_square_between_adjacent_edges() -> None:
    """Rc -> 0 with Rx = Ry makes a square grid, and by its symmetry the current halves.

    One crossing with four arms Ry/2 and Rc: from warp- to weft- is Ry/2 + Rc + Ry/2. With 2 x 2 crossings that conduct
    perfectly, warp1- to weft2+ (the corners of a square of four resistors Ry): Ry/2 + Ry + Ry/2, two ways of 2 Ry.
    """
    Ry = 0.5
    ends = (Electrode("a", ends=("warp1-",), voltage=1.0), Electrode("b", ends=("weft2+",), voltage=0.0))
    found = solve_panel(panel((2, 2), cells(Ry, 1e-9), electrodes=ends))
    assert between(found, "a", "b") == pytest.approx(2.0 * Ry, rel=1e-8)
    one = solve_panel(panel((1, 1), cells(Ry, 3.0), electrodes=(ends[0], replace(ends[1], ends=("weft1+",)))))
    assert between(one, "a", "b") == pytest.approx(Ry + 3.0, rel=EXACT)


def test_ladder_of_two_yarns() -> None:
    """Two warp yarns of m segments, rungs of Rr = 2 Rc + Ry through the wefts, fed at their left ends.

    The difference V_k of the rails obeys V_(k+1) - 2 V_k + V_(k-1) = (2 Rx / Rr) V_k: cosh(theta) = 1 + Rx / Rr. With
    an open right end V_k is in proportion to cosh((m - k - 1/2) theta) at rung k = 0..m-1.
    """
    m, Rx, Ry, Rc = 9, 0.3, 0.2, 1.5
    rung = 2.0 * Rc + Ry
    ends = (Electrode("a", ends=("warp1-",), voltage=1.0), Electrode("b", ends=("warp2-",), voltage=0.0))
    found = solve_panel(panel((2, m), CellResistances(Rx, Ry, Rc), electrodes=ends))
    theta = np.arccosh(1.0 + Rx / rung)
    shape = np.cosh((m - np.arange(m) - 0.5) * theta)
    current = shape.sum() / rung  # through all rungs, for voltages `shape`
    resistance = shape[0] / current + Rx  # one arm Rx / 2 on either rail
    assert between(found, "a", "b") == pytest.approx(resistance, rel=EXACT)
    drop = found.warp_voltage[0] - found.warp_voltage[1]
    np.testing.assert_allclose(drop / drop[0], shape / shape[0], rtol=1e-11)


@pytest.mark.parametrize("n", [4, 16])
def test_the_reduced_network_of_a_cell_is_a_panel(n: int) -> None:
    """All 16 or 64 yarn ends, with an Ry of each yarn and an Rc of each crossing, reduced by other code."""
    rng = np.random.default_rng(1)
    Ry, Rc = rng.uniform(0.2, 0.4, 2 * n), rng.uniform(1.0, 9.0, (n, n))
    law = CellResistances(Ry[None, :n, None], Ry[None, None, n:], Rc)
    found = solve_panel(panel((n, n), law, electrodes=end_electrodes(n, n)))
    wanted = port_matrix(reduced_circuit((n, n), Ry, Rc))
    assert found.ports.ports == wanted.ports
    np.testing.assert_allclose(found.ports.conductance, wanted.conductance, rtol=1e-11, atol=1e-15)


# The continuum


def closed_form(width: float, height: float, Rx: float, Ry: float, rho: float, terms: int = 20_000) -> float:
    """Conductance between the lower and the upper half of the left edge of two layers, the other edges open.

    The warp sheet conducts along x, -(1/Rx) dV/dx [A/mm]; the weft sheet along y, -(1/Ry) dU/dy; between them flow
    (V - U) / rho [A/mm2], rho = Rc p^2. For cos(k y), k = q pi / H, the weft has u = v / (1 + rho k^2 / Ry), so that
    v'' = v / lambda^2 with the transfer length lambda^2 = (Ry / k^2 + rho) / Rx, and an open right edge gives
    v' = -v tanh(W / lambda) / lambda on the left. +-1/2 V on the halves is the sum of 2 / (q pi) (+-) cos(k y), q odd.
    """
    q = np.arange(1, 2 * terms, 2)
    k = q * np.pi / height
    transfer = np.sqrt((Ry / k**2 + rho) / Rx)
    power = (2.0 / (q * np.pi)) ** 2 * (height / 2.0) * np.tanh(width / transfer) / (Rx * transfer)
    rest = 4.0 / np.pi**2 * (height / 2.0) / np.sqrt(Rx * rho) / (4.0 * terms)  # of the terms beyond, for k -> oo
    return float(power.sum() + rest)


def halves(n: int) -> tuple[Electrode, Electrode]:
    return (
        Electrode("low", ends=(f"warp1..{n // 2}-",), voltage=0.5),
        Electrode("high", ends=(f"warp{n // 2 + 1}..{n}-",), voltage=-0.5),
    )


def test_a_fine_panel_is_two_coupled_layers() -> None:
    """Ever finer panels of 12 x 8 mm with the same sheets converge to the closed form with the order 2.

    The cells are finite volumes with fluxes at their faces, second order in the pitch; the jump of the voltage lies on
    a face. On the coarsest panel the transfer length of the fast modes, sqrt(rho / Rx) = 1.2 mm, is 2.4 pitches.
    """
    width, height, Rx, Ry, rho = 12.0, 8.0, 0.5, 0.8, 0.72
    exact = closed_form(width, height, Rx, Ry, rho)
    errors = []
    for n in (16, 32, 64, 128):
        pitch = height / n
        law = CellResistances(Rx, Ry, rho / pitch**2)
        found = solve_panel(panel((n, round(width / pitch)), law, electrodes=halves(n), pitch=pitch))
        errors.append(1.0 / between(found, "low", "high") / exact - 1.0)
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(order, 2.0, atol=0.1)
    assert errors[-1] == pytest.approx(0.0, abs=1e-3)
    assert (4.0 * errors[-1] - errors[-2]) / 3.0 == pytest.approx(0.0, abs=5e-6)  # extrapolated to no pitch


def test_the_transfer_length_of_a_mode() -> None:
    """A wide panel driven by cos(pi y / H) on its left yarn ends falls off as exp(-x / lambda).

    lambda^2 = (Ry / k^2 + Rc p^2) / Rx is exact for sheets; for yarns k^2 is (2 - 2 cos(k p)) / p^2, and
    2 cosh(p / lambda) - 2 = Rx / (Ry / (2 - 2 cos(k p)) + Rc).
    """
    n, m, Rx, Ry, Rc = 8, 120, 0.5, 0.8, 6.0
    k = np.pi / n
    ends = tuple(Electrode(f"e{i}", ends=(f"warp{i + 1}-",), voltage=float(np.cos(k * (i + 0.5)))) for i in range(n))
    found = solve_panel(panel((n, m), CellResistances(Rx, Ry, Rc), electrodes=ends))
    decay = np.arccosh(1.0 + 0.5 * Rx / (Ry / (2.0 - 2.0 * np.cos(k)) + Rc))
    np.testing.assert_allclose(found.warp_voltage[0, 1:40] / found.warp_voltage[0, :39], np.exp(-decay), rtol=1e-6)
    sheets = np.sqrt((Ry / k**2 + Rc) / Rx)
    assert 1.0 / decay == pytest.approx(sheets, rel=0.01)  # (k p)^2 / 12 = 1.3 % of one of its two terms


# Laws of networks


def test_heat_is_the_power_fed_in() -> None:
    found = solve_panel(wild())
    assert found.heat.sum() == pytest.approx(found.power, rel=EXACT)
    assert found.heat.min() >= 0.0


def test_currents_are_what_the_electrodes_say() -> None:
    found = solve_panel(wild())
    assert found.current[1:3] == pytest.approx([0.3, 0.0], abs=EXACT)
    assert found.current[4] == pytest.approx(-0.2, rel=1e-11)
    assert found.voltage[[0, 3]].tolist() == [2.0, -1.0]
    assert found.current.sum() == pytest.approx(0.0, abs=EXACT)


def test_kirchhoff_holds_at_every_node_of_the_circuit() -> None:
    """The panel as a `Circuit`, solved by the package's other nodal solver with the voltages that were found."""
    found = solve_panel(wild())
    circuit = panel_circuit(found.wiring)
    drive = dict(zip(found.electrodes, found.voltage.tolist(), strict=True))
    other = solve_nodal(reached_part(circuit, drive), drive)
    np.testing.assert_allclose(other.port_current, found.current, rtol=1e-10, atol=1e-12)
    names = dict(zip(circuit.node_names, other.voltage.tolist(), strict=True))
    assert names["warp2_at_weft5"] == pytest.approx(float(found.warp_voltage[1, 4]), rel=1e-11)
    assert names["weft5_at_warp2"] == pytest.approx(float(found.weft_voltage[1, 4]), rel=1e-11)


def test_the_reduction_to_the_electrodes_is_exact() -> None:
    found = solve_panel(wild())
    wanted = port_matrix(panel_circuit(found.wiring))
    np.testing.assert_allclose(found.ports.conductance, wanted.conductance, rtol=1e-11)
    drive = dict(zip(found.electrodes, found.voltage.tolist(), strict=True))
    np.testing.assert_allclose(solve_nodal(ports_circuit(found.ports), drive).port_current, found.current, atol=EXACT)


def test_reciprocity_and_passivity() -> None:
    """Voltage at b for a current at a is that at a for the same current at b; no drive takes power out."""
    one = wild()
    sense = {}
    for source, other in (("pad", "tap"), ("tap", "pad")):
        electrodes = tuple(
            Electrode(each.name, each.ends, each.edge, each.rectangle, voltage=0.0)
            if each.name == "left"
            else Electrode(each.name, each.ends, each.edge, each.rectangle, current=float(each.name == source))
            for each in one.electrodes
        )
        found = solve_panel(replace(one, electrodes=electrodes))
        sense[source] = float(found.voltage[found.electrodes.index(other)])
    assert sense["pad"] == pytest.approx(sense["tap"], rel=1e-11)
    G = solve_panel(one).ports.conductance
    assert np.linalg.eigvalsh(G).min() > -EXACT * np.abs(G).max()
    assert (G - np.diag(np.diag(G)) <= 0.0).all()
    np.testing.assert_array_equal(G, G.T)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    seed=st.integers(0, 10**6),
    seam=st.tuples(st.integers(1, 5), st.integers(1, 7)),
    ohm=st.floats(1e-3, 1e3),
)
def test_adding_a_conductor_never_raises_a_resistance(seed: int, seam: tuple[int, int], ohm: float) -> None:
    """Rayleigh's law, for a seam at any crossing, and for a cut that is sewn up again (left out)."""
    one = wild(seed)
    before = solve_panel(one).resistance
    sewn = solve_panel(replace(one, seams=(*one.seams, Seam(ohm, crossings=(seam,))))).resistance
    whole = solve_panel(replace(one, cuts=())).resistance
    for after in (sewn, whole):
        assert (after <= before * (1.0 + EXACT)).all()


def test_scaling_resistances_scales_the_panel() -> None:
    """Twice every resistance: the same voltages between voltage electrodes, half the currents, to the last bit."""
    one = panel((6, 9), cells(0.25, 2.0), electrodes=(LEFT, Electrode("end", ends=("weft3+",), voltage=0.0)))
    twice = replace(one, cells=cells(0.5, 4.0))
    a, b = solve_panel(one), solve_panel(twice)
    np.testing.assert_array_equal(a.warp_voltage, b.warp_voltage)
    np.testing.assert_array_equal(a.current, 2.0 * b.current)


# The gradient


@pytest.mark.parametrize("pair", [("left", "right"), ("pad", "sense"), ("tap", "pad")])
def test_gradient_against_central_differences(pair: tuple[str, str]) -> None:
    """Every cell's strain; differences of step h err by h^2 times third derivatives and rounding over h: 1e-7 of R."""
    one = wild(3, (5, 7))
    gradient = panel_gradient(solve_panel(one), *pair)
    h, scale = 1e-5, np.abs(gradient.strain).max()
    assert gradient.resistance == pytest.approx(between(solve_panel(one), *pair))
    for i, j in np.ndindex(one.shape):
        sides = []
        for step in (h, -h):
            strain = np.array(one.strain)
            strain[i, j] += step
            sides.append(between(solve_panel(replace(one, strain=strain)), *pair))
        assert gradient.strain[i, j] == pytest.approx((sides[0] - sides[1]) / (2.0 * h), abs=1e-5 * scale)


def test_gradient_with_every_resistance_of_a_cell() -> None:
    """Rc, and Ry of both yarns, of single cells that are stated one by one; h is relative."""
    rng = np.random.default_rng(5)
    shape = (4, 5)
    values = {kind: rng.uniform(0.5, 2.0, shape) for kind in ("warp", "weft", "crossing")}
    ends = (Electrode("a", ends=("warp1..2-",)), Electrode("b", rectangle=(3.4, 2.4, 4.6, 3.6)))
    seam = Seam(1.0, rectangle=(0.0, 0.0, 2.0, 2.0))

    def solved(changed: dict[str, Floats]) -> PanelSolution:
        return solve_panel(Panel(shape, CellResistances(**changed), ends, seams=(seam,)))

    gradient = panel_gradient(solved(values), "a", "b")
    h = 1e-5
    for kind, exact in (("warp", gradient.warp), ("weft", gradient.weft), ("crossing", gradient.crossing)):
        for place in np.ndindex(shape):
            step = np.zeros(shape)
            step[place] = h
            up, down = (solved({**values, kind: values[kind] + sign * step}) for sign in (1.0, -1.0))
            slope = (between(up, "a", "b") - between(down, "a", "b")) / (2.0 * h)
            assert exact[place] == pytest.approx(slope, abs=1e-6 * np.abs(exact).max())
    # R is homogeneous of degree 1 in all resistances (Euler), the seam's share apart.
    share = sum(float((values[kind] * getattr(gradient, kind)).sum()) for kind in values)
    assert share < gradient.resistance


def test_gradient_adds_up_to_the_resistance() -> None:
    """Euler: R is homogeneous of degree 1 in all Ry and Rc."""
    one = panel((5, 6), electrodes=(Electrode("a", ends=("warp2-",)), Electrode("b", ends=("weft4+", "weft5+"))))
    gradient = panel_gradient(solve_panel(one), "a", "b")
    total = 0.28 * (gradient.warp.sum() + gradient.weft.sum()) + 3.0 * gradient.crossing.sum()
    assert total == pytest.approx(gradient.resistance, rel=1e-11)


def test_clamped_cells_have_no_slope() -> None:
    law = cells([0.2, 0.3], [5.0, 3.0], (0.0, 0.1))
    strain = np.full((3, 4), 0.05)
    strain[1, 2] = 0.2
    found = solve_panel(panel((3, 4), law, strain=strain, outside="clamp"))
    gradient = panel_gradient(found, "left", "right")
    assert gradient.strain[1, 2] == 0.0
    assert np.count_nonzero(gradient.strain) == 11
    assert any("1 cells lie beyond what is known, 0 to 0.1" in note for note in found.notes)


# Netlists


def test_ngspice_agrees_on_a_panel_with_everything() -> None:
    found = solve_panel(wild())
    netlists = panel_netlists(found)
    (plot,) = run_deck(netlists.deck).plots
    assert -float(plot.current("vleft")[0]) == pytest.approx(found.current[0], rel=SOLVED)
    assert -float(plot.current("vright")[0]) == pytest.approx(found.current[3], rel=SOLVED)
    for k, name in enumerate(found.electrodes):
        assert float(plot.voltage([name])[0, 0]) == pytest.approx(found.voltage[k], rel=SOLVED)


def test_the_netlist_of_the_reduction_has_the_same_pins_and_name() -> None:
    found = solve_panel(wild())
    netlists = panel_netlists(found)
    (whole,) = [line for line in netlists.whole.splitlines() if line.startswith(".subckt")]
    (ports,) = [line for line in netlists.ports.splitlines() if line.startswith(".subckt")]
    assert whole == ports == ".subckt panel_panel left pad sense right tap"
    assert netlists.ports.count("\nR") == 10
    again = parse(netlists.whole)
    assert again.n_resistors == found.n_resistors
    np.testing.assert_array_equal(np.sort(again.resistance), np.sort(found.wiring.resistance))


def test_electrodes_called_like_ground_or_a_quantity_are_ordinary_nodes() -> None:
    """ngspice would join 'gnd' to node 0, and take 'time' in an expression for the time; here 'gnd' is at 2 V."""
    ends = (
        Electrode("gnd", edge="left", voltage=2.0),
        Electrode("time", edge="right", voltage=-1.0),
        *(Electrode(name, ends=(f"weft{k + 1}+",)) for k, name in enumerate(("temp", "TEMPER", "hertz", "ground"))),
        Electrode("n_time", ends=("weft5-",)),  # what 'time' is called instead
    )
    found = solve_panel(panel((4, 6), cells(0.28, [3.0]), electrodes=ends))
    netlists = panel_netlists(found)
    pins = pin_names(panel_circuit(found.wiring))
    assert len(set(pins)) == len(ends)
    assert not {"gnd", "ground", "time", "temp", "temper", "hertz", "0"} & set(pins)
    for text in (netlists.whole, netlists.ports):
        assert f".subckt panel_panel {' '.join(pins)}\n" in text
    sources = netlists.deck[netlists.deck.index("Xpanel") :]
    for text in (netlists.whole, netlists.ports):
        (plot,) = run_deck("* panel\n" + text + sources).plots
        np.testing.assert_allclose(plot.voltage(pins)[0], found.voltage, rtol=SOLVED, atol=SOLVED)


# What is left out


def test_an_island_is_reported_and_left_out() -> None:
    """Four lines cut all around a rectangle free its inside: two yarns at each of its 2 x 3 crossings."""
    around = tuple(Cut(line=line) for line in (((2, 1), (5, 1)), ((2, 3), (5, 3)), ((2, 1), (2, 3)), ((5, 1), (5, 3))))
    found = solve_panel(panel((5, 7), cuts=around))
    inside = np.zeros((5, 7), dtype=bool)
    inside[1:3, 2:5] = True
    np.testing.assert_array_equal(np.isnan(found.warp_voltage), inside)
    assert any("no electrode reaches 12 places" in note for note in found.notes)
    assert np.isfinite(found.heat).all()


def test_a_floating_electrode_is_reported() -> None:
    """Without crossings each yarn is by itself: an open electrode on a weft has no potential."""
    open_end = Electrode("open", ends=("weft3+",))
    found = solve_panel(panel((4, 5), cells(0.28, np.inf), electrodes=(LEFT, open_end, RIGHT)))
    assert np.isnan(found.voltage[1])
    assert np.isnan(found.weft_voltage[:, 2]).all()
    assert np.isfinite(found.warp_voltage).all()
    assert any("open: no driven electrode reaches" in note for note in found.notes)
    (plot,) = run_deck(panel_netlists(found).deck).plots  # which has no answer where a part floats
    assert -float(plot.current("vleft")[0]) == pytest.approx(found.current[0], rel=SOLVED)
    assert np.isinf(found.resistance[0, 1])


def test_a_hole_has_no_current() -> None:
    found = solve_panel(panel((6, 8), cuts=(Cut(rectangle=(2.1, 2.1, 4.9, 3.9)),)))
    assert found.heat[2:4, 2:5].max() == 0.0
    whole = solve_panel(panel((6, 8)))
    assert between(found) > between(whole)


def test_insulating_yarns_are_not_there() -> None:
    """Three of five warp yarns between the bars: R = Ry m / 3."""
    found = solve_panel(panel((5, 7), insulating=("warp2..3", "weft1")))
    assert between(found) == pytest.approx(0.28 * 7 / 3, rel=1e-11)
    assert np.isnan(found.warp_voltage[1]).all()


def test_strain_maps_to_the_resistances() -> None:
    """Uniform strain between two known ones at which only Ry changes: ln R is monotone, at the known ones exact."""
    law = CellResistances([0.2, 0.3, 0.5], [1.0] * 3, [9.0] * 3, (0.0, 0.1, 0.2))
    found = [between(solve_panel(panel((3, 4), law, strain=e))) * 3 / 4 for e in (0.0, 0.05, 0.1, 0.13, 0.2)]
    assert found[::2] == pytest.approx([0.2, 0.3, 0.5], rel=1e-12)
    assert np.all(np.diff(found) > 0.0)


# Methods


def test_multigrid_agrees_with_the_factorisation() -> None:
    one = wild(shape=(60, 70))
    direct, multigrid = solve_panel(one, "direct"), solve_panel(one, "multigrid")
    assert (direct.method, multigrid.method) == ("direct", "multigrid")
    assert multigrid.residual < 1e-10
    np.testing.assert_allclose(multigrid.ports.conductance, direct.ports.conductance, rtol=SOLVED)
    np.testing.assert_allclose(multigrid.warp_voltage, direct.warp_voltage, rtol=SOLVED)


def test_64_electrodes_beyond_a_factorisation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no factor fits, multigrid solves for every electrode: the reduction is as exact, symmetric and passive."""
    n, group = 48, 3
    ends = tuple(
        Electrode(f"{way}{side}{k}", ends=(f"{way}{k * group + 1}..{(k + 1) * group}{sign}",))
        for way in ("warp", "weft")
        for side, sign in (("a", "-"), ("b", "+"))
        for k in range(n // group)
    )
    one = panel((n, n), cuts=(Cut(line=((10, 5), (30, 40))),), electrodes=ends)
    exact = solve_panel(one, "direct").ports.conductance
    monkeypatch.setattr(laplacian, "LARGEST_DIRECT", 1000)
    found = solve_panel(one)
    conductance = found.ports.conductance
    assert (found.method, conductance.shape) == ("multigrid", (64, 64))
    assert found.residual < laplacian.TOLERANCE
    np.testing.assert_array_equal(conductance, conductance.T)
    assert conductance[~np.eye(64, dtype=bool)].max() <= 0.0
    size = np.diag(conductance).max()
    np.testing.assert_allclose(conductance.sum(axis=1), 0.0, atol=EXACT * size)
    np.testing.assert_allclose(conductance, exact, rtol=0.0, atol=SOLVED * size)


def test_a_panel_in_which_nothing_flows_is_not_refused() -> None:
    """Two parts at one voltage each, with open electrodes on them: all that is left is rounding."""
    ends = (
        Electrode("a", ends=("warp1..2-",), voltage=5.0),
        Electrode("b", ends=("warp4..5-",), voltage=0.0),
        Electrode("open", rectangle=(3.0, 0.0, 4.0, 2.0)),
    )
    found = solve_panel(panel((5, 7), insulating=("warp3",), cuts=(Cut(line=((0, 2.5), (7, 2.5))),), electrodes=ends))
    assert found.voltage == pytest.approx([5.0, 0.0, 5.0])
    assert np.abs(found.current).max() < 1e-13
    assert np.isinf(found.resistance[0, 1])
