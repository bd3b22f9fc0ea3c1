"""The detailed and the reduced circuit: structure, values, names, islands."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
from electrical_cases import end, fibrils, touching
from electrical_reference import FOUR_DIGITS, INSULATED_SEGMENT_OHM, INSULATED_YARN_CURRENT
from synthetic import woven

from circuittex.base.errors import CircuitError
from circuittex.base.frozen import same
from circuittex.design import Terminal, plain_weave
from circuittex.electrical.network.circuit import (
    CONTACT,
    SEGMENT,
    build_circuit,
    build_circuits,
    islands,
    port_nodes,
    reached_part,
    reduced_circuit,
    to_networkx,
    yarn_end_terminals,
)
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.geometry.weave import build_mesh

ROUNDING = 1e-12  # relative; a handful of additions and one small solve


def resistance(circuit, source, sink):
    solution = solve_nodal(circuit, {source: 1.0, sink: 0.0})
    return 1.0 / solution.port_current[circuit.ports.index(source)]


def test_two_touching_fibrils_of_different_conductivity():
    contacts = touching(fibrils([8.0, 6.0], [10.0, 0.5]), [(0, 1, 3.0, 1.5, 0.02)])
    circuit = build_circuit(contacts, [end(1, -1), end(2, +1)])
    expected = 3.0 / 10.0 + 1 / 0.02 + 4.5 / 0.5
    assert resistance(circuit, "y1m", "y2p") == pytest.approx(expected, rel=ROUNDING)


def test_structure_and_names_of_two_touching_fibrils():
    contacts = touching(fibrils([8.0, 6.0], [10.0, 0.5]), [(0, 1, 3.0, 1.5, 0.02)])
    circuit = build_circuit(contacts, [end(1, -1), end(2, +1)])
    assert circuit.ports == ("y1m", "y2p")
    assert circuit.node_names == (
        "y1m",
        "y2p",
        "yarn1_f01_3000um",
        "yarn1_f01_8000um",
        "yarn2_f01_0um",
        "yarn2_f01_1500um",
    )
    assert circuit.node_fibril.tolist() == [-1, -1, 0, 0, 1, 1]
    np.testing.assert_array_equal(circuit.node_xi, [np.nan, np.nan, 3.0, 8.0, 0.0, 1.5])
    assert circuit.resistor_names == (
        "s_yarn1_f01_0um",
        "s_yarn1_f01_3000um",
        "s_yarn2_f01_0um",
        "s_yarn2_f01_1500um",
        "c_yarn1_f01_yarn2_f01_3000um",
    )
    assert circuit.resistor_nodes.tolist() == [[0, 2], [2, 3], [4, 5], [5, 1], [2, 5]]
    np.testing.assert_allclose(circuit.resistance, [0.3, 0.5, 3.0, 9.0, 50.0], rtol=ROUNDING)
    assert circuit.resistor_kind.tolist() == [SEGMENT] * 4 + [CONTACT]
    assert (circuit.merged_feet, circuit.dropped_contacts, circuit.unreached.size) == (0, 0, 0)


def test_segments_integrate_a_factor_that_jumps_between_elements():
    # Four elements of 2 mm; the feet at 1 and 5 mm lie inside elements, the one at 6 mm on a boundary.
    factor = [1.0, 2.0, 4.0, 8.0]
    rows = [(0, 1, xi, xi, 0.1) for xi in (1.0, 5.0, 6.0)]
    contacts = touching(fibrils([8.0, 8.0], [0.5, 1.0], elements=4), rows, factor + [1.0] * 4)
    circuit = build_circuit(contacts, [end(1, -1)])
    segments = circuit.resistance[circuit.resistor_kind == SEGMENT]
    expected = [1 / 0.5, (1 + 2 / 2 + 1 / 4) / 0.5, 1 / 4 / 0.5, 2 / 8 / 0.5]
    np.testing.assert_allclose(segments[:4], expected, rtol=ROUNDING)
    np.testing.assert_allclose(segments[4:], [1.0, 4.0, 1.0, 2.0], rtol=ROUNDING)


def test_short_segments_far_from_the_start_keep_their_digits():
    near = 8.0 - 1e-8
    contacts = touching(fibrils([8.0, 8.0], [1.0, 1.0], elements=20), [(0, 1, near, 4.0, 1.0)], [0.7] * 40)
    circuit = build_circuit(contacts, [end(1, -1)])
    assert circuit.node_xi[circuit.resistor_nodes[1]].tolist() == [near, 8.0]
    assert circuit.resistance[1] == pytest.approx((8.0 - near) / 0.7, rel=1e-15)


def test_insulated_yarn_of_the_paper():
    design = plain_weave()
    mesh = build_mesh(design)
    circuit = build_circuit(touching(mesh, []), yarn_end_terminals(mesh)[2:4])
    ohm = resistance(circuit, "warp2_minus", "warp2_plus")
    assert ohm == pytest.approx(8.0 / (10 * np.pi * 0.15**2 * 10.0), rel=ROUNDING)
    assert 1.0 / ohm == pytest.approx(INSULATED_YARN_CURRENT, abs=FOUR_DIGITS)
    assert ohm / 4 == pytest.approx(INSULATED_SEGMENT_OHM, abs=FOUR_DIGITS)
    assert circuit.unreached.tolist() == [f for f in range(80) if mesh.yarn[f] != 1]


def test_resistance_is_that_of_the_reference_frame_whatever_the_stretch():
    mesh = fibrils([2.0], [1.0])
    assert resistance(build_circuit(touching(mesh, []), [end(1, -1), end(1, 1)]), "y1m", "y1p") == pytest.approx(2.0)
    stretched = touching(mesh, [], [1 / 1.2**2])
    assert resistance(build_circuit(stretched, [end(1, -1), end(1, 1)]), "y1m", "y1p") == pytest.approx(2.0 * 1.44)


def test_equal_feet_share_a_node_and_are_counted():
    rows = [(0, 1, 3.0, 3.0, 1.0), (1, 0, 3.0, 3.0, 1.0), (0, 1, 8.0, 5.0, 1.0)]
    circuit = build_circuit(touching(fibrils([8.0, 8.0], [1.0, 1.0]), rows), [end(1, -1)])
    assert circuit.n_nodes == 3 + 4
    # Two feet shared at 3 mm on each fibril, and one with the end at 8 mm: two + one.
    assert circuit.merged_feet == 3


def test_feet_that_rounding_keeps_apart_share_a_node():
    """Feet a few bits apart, and a bit away from both ends, make the circuit of feet that are equal."""
    ulp = 2.0**-50
    rows = [
        (0, 1, 3.0, 5.0, 1.0),
        (1, 0, 5.0 + 2 * ulp, 3.0 - ulp, 1.0),
        (0, 1, ulp, 8.0 - 4 * ulp, 2.0),
        (0, 1, 3.0 + 1e-7, 5.0, 1.0),  # far beyond rounding: a node of its own
    ]
    contacts = touching(fibrils([8.0, 8.0], [1.0, 1.0]), rows)
    circuit = build_circuit(contacts, [end(1, -1), end(2, -1)])
    assert circuit.node_xi[2:].tolist() == [3.0 - ulp, 3.0 + 1e-7, 8.0, 5.0, 8.0]
    assert circuit.merged_feet == 5  # one of two at 3, two of three at 5, and one at an end of either fibril
    assert circuit.resistance.min() == pytest.approx(1e-7, rel=1e-6)


def test_conductances_below_zero_are_refused_however_small():
    """The tolerance of a coordinate, in mm, is none for a conductance."""
    with pytest.raises(CircuitError, match="contact 0: conductance is -1e-13"):
        build_circuit(touching(fibrils([8.0, 8.0], [1.0, 1.0]), [(0, 1, 3.0, 3.0, -1e-13)]), [end(1, -1)])


def test_a_foot_may_miss_the_end_of_its_own_fibril_by_rounding_only():
    mesh = fibrils([8.0, 8e6], [1.0, 1.0])
    circuit = build_circuit(touching(mesh, [(0, 1, -1e-12, 3.0, 1.0)]), [end(1, -1)])
    assert np.nanmin(circuit.node_xi) == 0.0
    with pytest.raises(CircuitError, match="xi_a is -1e-09"):
        build_circuit(touching(mesh, [(0, 1, -1e-9, 3.0, 1.0)]), [end(1, -1)])


def test_contacts_without_current_are_left_out_and_counted():
    rows = [
        (0, 1, 1.0, 1.0, 0.0),  # no conductance
        (0, 2, 2.0, 2.0, 1.0),  # to an insulating fibril
        (0, 1, 8.0, 8.0, 1.0),  # between two ends of one terminal
        (0, 1, 4.0, 4.0, 1.0),
    ]
    mesh = fibrils([8.0, 8.0, 8.0], [1.0, 1.0, 0.0])
    joined = Terminal("both", (("yarn1", 1), ("yarn2", 1)))
    circuit = build_circuit(touching(mesh, rows), [end(1, -1), joined], dropped_contacts=2)
    assert circuit.dropped_contacts == 5
    assert np.sum(circuit.resistor_kind == CONTACT) == 1
    assert 2 not in circuit.node_fibril
    assert circuit.unreached.size == 0


def test_a_fibril_that_touches_itself():
    circuit = build_circuit(touching(fibrils([3.0], [1.0]), [(0, 0, 1.0, 2.0, 1.0)]), [end(1, -1), end(1, 1)])
    assert resistance(circuit, "y1m", "y1p") == pytest.approx(2.5, rel=ROUNDING)


def test_circuits_of_several_terminals_are_the_same_as_one_by_one():
    state = woven(per_yarn=2, points=4)
    ends = yarn_end_terminals(state.mesh)
    choices = [ends[:2], ends[3:5], ends]
    for choice, circuit in zip(choices, build_circuits(state, choices, dropped_contacts=3), strict=True):
        assert same(circuit, build_circuit(state, choice, dropped_contacts=3))
        assert circuit.ports == tuple(terminal.name for terminal in choice)


def test_islands_are_left_out_and_listed():
    mesh = fibrils([4.0] * 5, [1.0] * 5)
    rows = [(0, 1, 1.0, 1.0, 1.0), (2, 3, 1.0, 1.0, 1.0)]
    circuit = build_circuit(touching(mesh, rows), [end(1, -1), end(2, 1)])
    assert circuit.unreached.tolist() == [2, 3, 4]
    assert set(circuit.node_fibril.tolist()) == {-1, 0, 1}
    assert np.unique(islands(circuit)).tolist() == [0]


def test_every_island_of_a_circuit_with_all_ends_as_ports_stays():
    mesh = fibrils([4.0] * 3, [1.0] * 3)
    whole = build_circuit(touching(mesh, []), yarn_end_terminals(mesh))
    assert whole.ports == ("yarn1_minus", "yarn1_plus", "yarn2_minus", "yarn2_plus", "yarn3_minus", "yarn3_plus")
    assert len(np.unique(islands(whole))) == 3
    part = reached_part(whole, ["yarn2_minus"])
    assert part.ports == ("yarn2_minus", "yarn2_plus")
    assert resistance(part, "yarn2_minus", "yarn2_plus") == pytest.approx(4.0)


def test_places_in_one_micrometre_get_different_names():
    rows = [(0, 1, 1.0001 + 1e-5 * k, 2.0, 1.0) for k in range(4)]
    circuit = build_circuit(touching(fibrils([8.0, 8.0], [1.0, 1.0]), rows), [end(1, -1)])
    assert len(set(circuit.node_names)) == circuit.n_nodes
    assert len(set(circuit.resistor_names)) == circuit.n_resistors
    assert {"yarn1_f01_1000um", "yarn1_f01_1000um_2", "yarn1_f01_1000um_4"} <= set(circuit.node_names)


def test_whole_micrometres_are_not_rounded_away():
    contacts = touching(fibrils([8.0, 8.0], [1.0, 1.0]), [(0, 1, 0.57, 2.0, 1.0)])
    assert "yarn1_f01_570um" in build_circuit(contacts, [end(1, -1)]).node_names  # 0.57 * 1000 = 569.99...


def test_fibrils_count_from_one_within_their_yarn():
    mesh = fibrils([1.0] * 4, [1.0] * 4, yarn=[0, 0, 1, 1])
    names = build_circuit(touching(mesh, []), yarn_end_terminals(mesh)[:1]).node_names
    assert names == ("yarn1_minus", "yarn1_f01_1000um", "yarn1_f02_1000um")


def test_terminals_with_odd_names_do_not_collide_with_nodes():
    mesh = fibrils([1.0], [1.0])
    circuit = build_circuit(touching(mesh, []), [end(1, -1, "yarn1_f01_1000um")])
    assert circuit.node_names == ("yarn1_f01_1000um", "yarn1_f01_1000um_2")


@pytest.mark.parametrize(
    ("terminals", "message"),
    [
        ([end(1, -1), Terminal("both", (("yarn2", 1), ("yarn1", -1)))], "'y1m' and 'both' share the end"),
        ([end(1, -1), end(1, 1, "y1m")], "names repeat"),
        ([end(7, 1)], "no yarn end"),
    ],
)
def test_terminals_that_cannot_be_used(terminals, message):
    with pytest.raises(CircuitError, match=message):
        build_circuit(touching(fibrils([1.0, 1.0], [1.0, 1.0]), []), terminals)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ((0, 1, 0.5, 0.5, np.nan), "conductance is"),
        ((0, 1, 0.5, 0.5, -1.0), "conductance is"),
        ((0, 1, -0.5, 0.5, 1.0), "xi_a is"),
        ((0, 1, 0.5, 1.5, 1.0), "lies at xi = 1.5 on a fibril that ends at 1.0"),
    ],
)
def test_contacts_that_cannot_be_used(row, message):
    with pytest.raises(CircuitError, match=message):
        build_circuit(touching(fibrils([1.0, 1.0], [1.0, 1.0]), [row]), [end(1, -1)])


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan])
def test_axial_factors_that_cannot_be_used(factor):
    with pytest.raises(CircuitError, match="axial_factor of element 0"):
        build_circuit(touching(fibrils([1.0], [1.0]), [], [factor]), [end(1, -1)])


def test_swapping_the_sides_of_contacts_changes_no_resistance():
    rng = np.random.default_rng(1)
    mesh = fibrils([5.0] * 6, rng.uniform(0.5, 2.0, 6), elements=3)
    rows = [(a, b, *rng.uniform(0, 5, 2), rng.uniform(0.1, 1)) for a in range(6) for b in range(a)]
    contacts = touching(mesh, rows, rng.uniform(0.5, 1.0, 18))
    swapped = replace(
        contacts,
        fibril_a=contacts.fibril_b,
        fibril_b=contacts.fibril_a,
        xi_a=contacts.xi_b,
        xi_b=contacts.xi_a,
    )
    ends = [end(1, -1), end(4, 1)]
    ohm = [resistance(build_circuit(state, ends), "y1m", "y4p") for state in (contacts, swapped)]
    assert ohm[1] == pytest.approx(ohm[0], rel=ROUNDING)


def test_twenty_thousand_contacts():
    mesh = build_mesh(plain_weave())
    rng = np.random.default_rng(0)
    n = 20_000
    a, step = rng.integers(0, 80, n), rng.integers(1, 80, n)
    table = np.stack([a, (a + step) % 80, *rng.uniform(0.0, 8.0, (2, n)), rng.uniform(1e-5, 1e-4, n)], axis=1)
    contacts = touching(mesh, table)
    circuit = build_circuit(contacts, yarn_end_terminals(mesh))
    assert circuit.n_nodes == 2 * n + 16
    assert circuit.n_resistors == 2 * n + 80 + n
    assert len(set(circuit.node_names)) == circuit.n_nodes


def test_networkx_knows_the_same_circuit():
    contacts = touching(fibrils([8.0, 6.0], [10.0, 0.5]), [(0, 1, 3.0, 1.5, 0.02), (0, 1, 3.0, 1.5, 0.02)])
    circuit = build_circuit(contacts, [end(1, -1), end(2, +1)])
    graph = to_networkx(circuit)
    assert (graph.number_of_nodes(), graph.number_of_edges()) == (circuit.n_nodes, circuit.n_resistors)
    assert graph.nodes["y1m"]["port"] == "y1m"
    assert graph.nodes["yarn1_f01_3000um"] == {"fibril": 0, "xi": 3.0}
    assert nx.resistance_distance(nx.Graph(graph), "y1m", "yarn1_f01_3000um", "resistance") == pytest.approx(0.3)
    between = graph["yarn1_f01_3000um"]["yarn2_f01_1500um"]
    assert [edge["kind"] for edge in between.values()] == ["contact", "contact"]
    assert all(edge["conductance"] == pytest.approx(0.02) for edge in between.values())


@pytest.mark.parametrize("shape", [(1, 1), (2, 3), (4, 4)])
def test_reduced_network_has_the_cells_of_the_model(shape):
    n, m = shape
    circuit = reduced_circuit(shape, 0.3, 7.0)
    assert len(circuit.ports) == 2 * (n + m)
    values, counts = np.unique(circuit.resistance, return_counts=True)
    expected = {0.15: 2 * (n + m), 0.3: n * (m - 1) + m * (n - 1), 7.0: n * m}
    assert dict(zip(values.tolist(), counts.tolist(), strict=True)) == {k: v for k, v in expected.items() if v}
    # Along each warp yarn the crossings follow in the order of the weft.
    graph = to_networkx(circuit)
    chain = ["warp1_minus", *(f"warp1_at_weft{j + 1}" for j in range(m)), "warp1_plus"]
    assert all(graph.has_edge(*step) for step in pairwise(chain))
    assert all(
        graph.has_edge(f"warp{i + 1}_at_weft{j + 1}", f"weft{j + 1}_at_warp{i + 1}") for i, j in np.ndindex(n, m)
    )


@pytest.mark.parametrize(("Ry", "Rc"), [(0.0, 1.0), (-1.0, 1.0), (np.inf, 1.0), (1.0, 0.0), (1.0, np.nan)])
def test_reduced_networks_that_cannot_be_used(Ry, Rc):
    with pytest.raises(CircuitError, match="must be positive"):
        reduced_circuit((2, 2), Ry, Rc)


def test_unknown_ports_are_named():
    with pytest.raises(CircuitError, match="port 'nowhere' does not exist; the circuit has warp1_minus"):
        port_nodes(reduced_circuit((1, 1), 1.0, 1.0), ["nowhere"])
