"""Nodal analysis against lattices, closed forms, exact rational arithmetic, and the theorems of networks."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from electrical_cases import end, fibrils, grid_edges, network, touching
from electrical_reference import (
    CUBE,
    INFINITE_LATTICE_DIAGONAL,
    INFINITE_LATTICE_NEIGHBOUR,
    SQUARE_GRID_CORNER_TO_CORNER,
    WOVEN_CURRENTS,
    WOVEN_ROUNDING,
    WOVEN_RY,
)
from hypothesis import assume, example, given
from hypothesis import strategies as st

from circuittex.base.errors import CircuitError
from circuittex.electrical.network.circuit import build_circuit, reduced_circuit
from circuittex.electrical.network.nodal import port_basis, rounding_errors, solve_drives, solve_nodal
from circuittex.electrical.spice.ngspice import run_deck
from circuittex.netlist import deck

EXACT = 1e-12  # relative: what the solution promises


def between(edges, a, b):
    """Resistance between two nodes."""
    return 1.0 / solve_nodal(network(edges, [a, b]), {f"p{a}": 1.0, f"p{b}": 0.0}).port_current[0]


@pytest.mark.parametrize("n", [2, 3])
def test_square_grids_corner_to_corner(n):
    assert between(grid_edges(n, n), 0, n * n - 1) == pytest.approx(SQUARE_GRID_CORNER_TO_CORNER[n], rel=EXACT)


@pytest.mark.parametrize(("ends", "other"), [("edge", 1), ("face", 3), ("body", 7)])
def test_cube(ends, other):
    edges = [(a, a | bit, 1.0) for bit in (1, 2, 4) for a in range(8) if not a & bit]
    assert between(edges, 0, other) == pytest.approx(CUBE[ends], rel=EXACT)


@pytest.mark.parametrize(("step", "limit"), [((0, 1), INFINITE_LATTICE_NEIGHBOUR), ((1, 1), INFINITE_LATTICE_DIAGONAL)])
def test_infinite_lattice_is_the_limit_at_second_order(step, limit):
    errors = []
    for n in (11, 21, 41):
        middle = n // 2
        a, b = middle * n + middle, (middle + step[0]) * n + middle + step[1]
        errors.append(between(grid_edges(n, n), a, b) - limit)
    # A dipole's field falls as the square of the distance, and so does what the edge sends back.
    rates = np.log2(np.divide(errors[:-1], errors[1:])) / np.log2([21 / 11, 41 / 21])
    np.testing.assert_allclose(rates, 2.0, atol=0.25)
    assert errors[-1] < 2e-3


@pytest.mark.parametrize(("Ry", "Rc"), [(1.0, 1.0), (0.2829, 10.0), (3.0, 1e-3)])
def test_woven_two_by_two_is_a_ring(Ry, Rc):
    circuit = reduced_circuit((2, 2), Ry, Rc)
    around = 4 * (Ry + Rc)
    expected = {
        ("warp1_at_weft1", "weft1_at_warp1"): Rc * (around - Rc) / around,
        ("warp1_at_weft1", "warp1_at_weft2"): Ry * (around - Ry) / around,
        ("warp1_at_weft1", "warp2_at_weft1"): (2 * Rc + Ry) * (around - 2 * Rc - Ry) / around,
    }
    for pair, ohm in expected.items():
        probed = replace(circuit, ports=pair, port_node=np.array([circuit.node_names.index(name) for name in pair]))
        current = solve_nodal(probed, {pair[0]: 1.0, pair[1]: 0.0}).port_current[0]
        assert 1.0 / current == pytest.approx(ohm, rel=EXACT)


@pytest.mark.parametrize("Rc", WOVEN_CURRENTS)
def test_woven_four_by_four_of_the_paper(Rc):
    circuit = reduced_circuit((4, 4), WOVEN_RY, Rc)
    sources = ("warp2_minus", "warp3_minus", "weft2_plus")
    for source, expected in zip(sources, WOVEN_CURRENTS[Rc], strict=True):
        solution = solve_nodal(circuit, {source: 1.0, "warp2_plus": 0.0})
        assert solution.port_current[circuit.ports.index(source)] == pytest.approx(expected, abs=WOVEN_ROUNDING)


def test_coupled_rails_at_second_order():
    """Two conductors of r ohm/mm coupled by g S/mm: sqrt(2 r / g) / tanh(sqrt(2 r g) L), as many points approach it."""
    length, r, g = 8.0, 0.25, 0.4
    exact = np.sqrt(2 * r / g) / np.tanh(np.sqrt(2 * r * g) * length)
    errors = []
    for n in (20, 40, 80, 160):
        xi = (np.arange(n) + 0.5) * length / n
        rows = [(0, 1, x, x, g * length / n) for x in xi]
        circuit = build_circuit(touching(fibrils([length] * 2, [1 / r] * 2), rows), [end(1, -1), end(2, -1)])
        errors.append(1.0 / solve_nodal(circuit, {"y1m": 1.0, "y2m": 0.0}).port_current[0] - exact)
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.05)
    assert abs(errors[-1]) < 1e-4 * exact


@st.composite
def connected_networks(draw, most=7):
    """Random networks in one piece, resistances over twelve decades."""
    n = draw(st.integers(3, most))
    ohm = st.floats(-6.0, 6.0).map(lambda exponent: 10.0**exponent)
    edges = [(draw(st.integers(0, k - 1)), k, draw(ohm)) for k in range(1, n)]
    pairs = st.tuples(st.integers(0, n - 1), st.integers(0, n - 1), ohm)
    edges += [pair for pair in draw(st.lists(pairs, max_size=2 * n)) if pair[0] != pair[1]]
    return n, edges


def exact_current(n, edges, source, sink):
    """Current at 1 V in rational arithmetic."""
    rows = [[Fraction(0)] * (n + 1) for _ in range(n)]
    for i, j, ohm in edges:
        g = 1 / Fraction(ohm)
        rows[i][i] += g
        rows[j][j] += g
        rows[i][j] -= g
        rows[j][i] -= g
    rows[source][n] = Fraction(1)
    rows[sink] = [Fraction(k == sink) for k in range(n)] + [Fraction(0)]
    for k in range(n):
        pivot = next(i for i in range(k, n) if rows[i][k])
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(n):
            if i != k and rows[i][k]:
                rows[i] = [x - rows[i][k] * y for x, y in zip(rows[i], rows[k], strict=True)]
    return float(1 / rows[source][n])


@given(connected_networks())
def test_currents_have_all_their_digits_over_twelve_decades(case):
    n, edges = case
    current = solve_nodal(network(edges, [0, n - 1]), {"p0": 1.0, f"p{n - 1}": 0.0}).port_current
    assert current[0] == pytest.approx(exact_current(n, edges, 0, n - 1), rel=EXACT)


@given(connected_networks(), st.data())
def test_rayleigh_another_conductor_never_raises_a_resistance(case, data):
    n, edges = case
    i, j = data.draw(st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)))
    assume(i != j)
    ohm = 10.0 ** data.draw(st.floats(-6.0, 6.0))
    assert between([*edges, (i, j, ohm)], 0, n - 1) <= between(edges, 0, n - 1) * (1 + EXACT)


@given(connected_networks(), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_power_in_equals_power_lost(case, u, v):
    n, edges = case
    circuit = network(edges, [0, 1, n - 1])
    assume(n > 3 and abs(u) + abs(v) > 1e-3)
    solution = solve_nodal(circuit, {"p0": u, "p1": v, f"p{n - 1}": 0.0})
    delivered = solution.port_current @ solution.voltage[circuit.port_node]
    lost = np.diff(solution.voltage[circuit.resistor_nodes], axis=1)[:, 0] ** 2 / circuit.resistance
    # The currents of the three ports may be far larger than the power's share of each.
    scale = np.abs(solution.port_current) @ np.abs(solution.voltage[circuit.port_node])
    assert delivered == pytest.approx(lost.sum(), abs=1e-9 * scale + 1e-9 * lost.sum())
    assert abs(solution.port_current.sum()) <= EXACT * np.abs(solution.port_current).sum() * 10


@given(connected_networks())
@example((7, [(0, 1, 1.0), (1, 2, 1e-4), (0, 3, 1.0), (0, 4, 1.0), (2, 5, 1e-5), (0, 6, 1.0), (2, 6, 1e-5)]))
def test_reciprocity(case):
    n, edges = case
    assume(n > 3)
    circuit = network(edges, [0, 1, n - 1])
    forward = solve_nodal(circuit, {"p0": 1.0, "p1": 0.0, f"p{n - 1}": 0.0}).port_current[1]
    back = solve_nodal(circuit, {"p0": 0.0, "p1": 1.0, f"p{n - 1}": 0.0}).port_current[0]
    assert forward == pytest.approx(back, rel=EXACT)


def test_currents_at_inner_nodes_and_open_ports_sum_to_zero():
    circuit = reduced_circuit((3, 4), 0.3, 2.0)
    solution = solve_nodal(circuit, {"warp1_minus": 2.0, "weft4_plus": -1.0})
    i, j = circuit.resistor_nodes.T
    flow = (solution.voltage[i] - solution.voltage[j]) / circuit.resistance
    leaving = np.bincount(i, flow, circuit.n_nodes) - np.bincount(j, flow, circuit.n_nodes)
    injected = np.zeros(circuit.n_nodes)
    injected[circuit.port_node] = solution.port_current
    np.testing.assert_allclose(leaving, injected, atol=1e-13)
    assert np.count_nonzero(solution.port_current) == 2


def test_a_port_on_a_tiny_resistor_keeps_its_digits():
    edges = [(0, 1, 1e-9), (1, 2, 1e3), (2, 3, 2e-9)]
    assert between(edges, 0, 3) == pytest.approx(1e3 + 3e-9, rel=1e-15)


def test_drives_of_the_same_ports_share_a_solution_and_superpose():
    circuit = reduced_circuit((4, 4), 0.3, 5.0)
    one, two, both, other = solve_drives(
        circuit,
        [
            {"warp1_minus": 1.0, "warp1_plus": 0.0},
            {"warp1_plus": 1.0, "warp1_minus": 0.0},
            {"warp1_minus": 3.0, "warp1_plus": -2.0},
            {"weft1_minus": 1.0, "warp1_plus": 0.0},
        ],
    )
    np.testing.assert_allclose(both.voltage, 3 * one.voltage - 2 * two.voltage, atol=1e-14)
    alone = solve_nodal(circuit, {"weft1_minus": 1.0, "warp1_plus": 0.0})
    np.testing.assert_array_equal(other.voltage, alone.voltage)


def test_currents_of_a_three_terminal_star():
    star = network([(0, 3, 1.0), (1, 3, 2.0), (2, 3, 4.0)], [0, 1, 2])
    g, volts = np.array([1.0, 0.5, 0.25]), np.array([3.0, -1.0, 0.5])
    expected = (np.diag(g) - np.outer(g, g) / g.sum()) @ volts  # star-mesh transform
    solution = solve_nodal(star, {"p0": 3.0, "p1": -1.0, "p2": 0.5})
    np.testing.assert_allclose(solution.port_current, expected, rtol=EXACT)


@pytest.mark.parametrize("ohm", [1e3, 1e9, 1e13])
def test_two_yarns_on_poor_contacts_keep_their_digits(ohm):
    """A ladder whose rungs conduct up to sixteen decades less than its rails, against its continued fraction."""
    n = 200
    rails = [(2 * k + side, 2 * k + 2 + side, 1e-3) for k in range(n - 1) for side in (0, 1)]
    rungs = [(2 * k, 2 * k + 1, ohm) for k in range(n)]
    circuit = network(rails + rungs, [0, 1])
    current = solve_nodal(circuit, {"p0": 1.0, "p1": 0.0}).port_current
    r, g = 2e-3, 1.0 / ohm  # both rails of a cell in series; from the far end, one rung after the other
    seen = g
    for _ in range(n - 1):
        seen = g + 1.0 / (r + 1.0 / seen)
    np.testing.assert_allclose(current, [seen, -seen], rtol=1e-12)


def test_currents_that_break_kirchhoffs_law_are_refused():
    """A solution that has lost its digits is an error, not a number."""
    basis = port_basis(network([(0, 2, 1.0), (2, 1, 2.0)], [0, 1]), ["p0", "p1"])
    assert basis.solve({"p0": 1.0, "p1": 0.0}).port_current[0] == pytest.approx(1 / 3, rel=EXACT)
    wrong = replace(basis, flow=basis.flow * [1.0, 1.0 + 1e-7])
    with pytest.raises(CircuitError, match=r"port currents add up to .* between 1.0e\+00 and 2.0e\+00 ohm"):
        wrong.solve({"p0": 1.0, "p1": 0.0})


def test_rounding_errors_bound_what_ngspice_errs_by():
    """A ladder on poor contacts, against its closed form: within the estimate and not a thousandth of it."""
    n, ohm = 30, 1e7
    rails = [(2 * k + side, 2 * k + 2 + side, 1e-3 / 3.0) for k in range(n - 1) for side in (0, 1)]
    circuit = network(rails + [(2 * k, 2 * k + 1, ohm) for k in range(n)], [0, 1])
    drive = {"p0": 1.0, "p1": 0.0}
    exact = solve_nodal(circuit, drive)
    _, current = rounding_errors(circuit, drive)
    found = -run_deck(deck(circuit, drive)).plots[0].current("vn0")[0]
    assert 1e-4 * current[0] < abs(found - exact.port_current[0]) < current[0]


def test_a_circuit_of_driven_nodes_only():
    assert between([(0, 1, 4.0)], 0, 1) == pytest.approx(4.0, rel=EXACT)


@pytest.mark.parametrize(
    ("drive", "message"),
    [
        ({}, "no port is driven"),
        ({"nowhere": 1.0}, "port 'nowhere' does not exist"),
        ({"warp1_minus": np.nan, "warp1_plus": 0.0}, "not a finite voltage"),
        (
            {"warp1_minus": 1.0, "warp1_plus": 0.0},
            "no driven port .warp1_minus, warp1_plus. reaches the island of 4 nodes",
        ),
    ],
)
def test_drives_that_have_no_solution(drive, message):
    with pytest.raises(CircuitError, match=message):
        solve_nodal(reduced_circuit((2, 2), 1.0, np.inf), drive)


def test_two_driven_ports_on_one_node():
    circuit = replace(network([(0, 1, 1.0)], [0, 1]), port_node=np.array([0, 0]))
    with pytest.raises(CircuitError, match="the same node"):
        solve_nodal(circuit, {"p0": 1.0, "p1": 0.0})


@pytest.mark.parametrize("ohm", [-1.0, -5.0, 0.0, np.nan, np.inf, -np.inf])
def test_a_resistance_that_is_none_is_refused_by_name(ohm):
    """Negative ones gave currents of 0.2 and 1.0 A, zero and infinity nan, and nan an error of SciPy's."""
    good = reduced_circuit((1, 1), 2.0, 5.0)
    resistance = good.resistance.copy()
    resistance[1] = ohm
    with pytest.raises(CircuitError, match=f"resistor '{good.resistor_names[1]}': {ohm!r} ohm is not usable"):
        solve_nodal(replace(good, resistance=resistance), {"warp1_minus": 1.0, "weft1_plus": 0.0})


def test_resistances_too_far_apart_are_said_to_be() -> None:
    """Nothing of 1e30 ohm is left beside 1 ohm: SciPy's own words for the pivot of zero are no answer."""
    edges = [(0, 2, 1e30), (2, 3, 1.0), (3, 1, 1e30)]
    with pytest.raises(CircuitError, match="too far apart for a nodal solution"):
        solve_nodal(network(edges, [0, 1]), {"p0": 1.0, "p1": 0.0})
