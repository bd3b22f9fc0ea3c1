"""Netlists: golden text, round trips, hostile names, and ngspice's answers to what is written."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from electrical_cases import end, fibrils, network, touching
from electrical_reference import WOVEN_CURRENTS, WOVEN_ROUNDING, WOVEN_RY
from hypothesis import given
from hypothesis import strategies as st

from circuittex import __version__
from circuittex.base.errors import CircuitError
from circuittex.base.frozen import same
from circuittex.electrical.network.circuit import KINDS, Circuit, build_circuit, reached_part, reduced_circuit
from circuittex.electrical.network.names import safe_name, unique_names
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.spice.ngspice import run_deck, run_decks
from circuittex.netlist import (
    Header,
    deck,
    parse,
    pin_names,
    subcircuit,
    to_pyspice,
)

# ngspice solves a few dozen well-scaled resistors once, without refinement.
SIMULATED = 1e-12
PAPER_DRIVES = [{source: 1.0, "warp2_plus": 0.0} for source in ("warp2_minus", "warp3_minus", "weft2_plus")]


def two_fibrils() -> Circuit:
    contacts = touching(fibrils([8.0, 6.0, 1.0], [10.0, 0.5, 1.0]), [(0, 1, 3.0, 1.5, 0.02)])
    return build_circuit(contacts, [end(1, -1), end(2, +1)], dropped_contacts=4)


BODY = """\
* units: ohm, V, A; places of nodes in mm along the fibril
* nodes: 6
* resistors: 5
* merged feet: 0
* dropped contacts: 4
* fibrils left out: 1
* left out: 2
* pin: y1m "y1m"
* pin: y2p "y2p"
* node: y1m
* node: y2p
* node: yarn1_f01_3000um 0 3.0
* node: yarn1_f01_8000um 0 8.0
* node: yarn2_f01_0um 1 0.0
* node: yarn2_f01_1500um 1 1.5
"""
CARDS = """\
* kind: segment
Rs_yarn1_f01_0um y1m yarn1_f01_3000um 0.3
Rs_yarn1_f01_3000um yarn1_f01_3000um yarn1_f01_8000um 0.5
Rs_yarn2_f01_0um yarn2_f01_0um yarn2_f01_1500um 3.0
Rs_yarn2_f01_1500um yarn2_f01_1500um y2p 9.0
* kind: contact
Rc_yarn1_f01_yarn2_f01_3000um yarn1_f01_3000um yarn2_f01_1500um 50.0
"""


def exact(circuit: Circuit) -> Circuit:
    """With sections of pi R² = 1 up to rounding, resistances to the twelve digits that the golden text shows."""
    return replace(circuit, resistance=np.round(circuit.resistance, 12))


def test_golden_subcircuit():
    header = Header("two fibrils", design="demo", design_hash="ab12", state="relaxed", notes=("made by hand",))
    head = f"""\
* circuittex {__version__} netlist: "two fibrils"
* design: "demo"
* design hash: "ab12"
* state: "relaxed"
* note: "made by hand"
"""
    expected = head + BODY + ".subckt pair y1m y2p\n" + CARDS + ".ends pair\n"
    assert subcircuit(exact(two_fibrils()), "Pair", header).splitlines() == expected.splitlines()


def test_golden_deck():
    expected = f"""\
* circuittex {__version__} netlist: "resistor network"
{BODY}{CARDS}* sources
Vy1m y1m 0 1.0
Vy2p y2p 0 0.0
.op
.end
"""
    assert deck(exact(two_fibrils()), {"y1m": 1.0, "y2p": 0.0}).splitlines() == expected.splitlines()


def test_a_detailed_circuit_comes_back_bit_for_bit():
    circuit = two_fibrils()
    assert same(parse(subcircuit(circuit, "pair")), circuit)
    assert same(parse(deck(circuit, {"y1m": 1.0})), circuit)


TEXT = st.text(max_size=30) | st.sampled_from(
    ["\n.end\n", "a\n+ b", "$x;y*z", "0", "gnd", "GND", "R1 a b 0", "ünï", ""]
)


@st.composite
def circuits(draw) -> Circuit:
    """Circuits of any shape with any text in their names."""
    n = draw(st.integers(2, 6))
    node = st.integers(0, n - 1)
    edges = draw(st.lists(st.tuples(node, node, st.floats(1e-12, 1e15), st.integers(0, 2), TEXT), max_size=12))
    ports = draw(st.lists(node, max_size=n, unique=True))
    places = draw(st.lists(st.none() | st.tuples(st.integers(0, 99), st.floats(0, 10)), min_size=n, max_size=n))
    return Circuit(
        node_names=tuple(draw(st.lists(TEXT, min_size=n, max_size=n))),
        node_fibril=np.array([-1 if p is None else p[0] for p in places]),
        node_xi=np.array([np.nan if p is None else p[1] for p in places]),
        resistor_nodes=np.array([e[:2] for e in edges], dtype=np.int64).reshape(-1, 2),
        resistance=np.array([e[2] for e in edges], dtype=float),
        resistor_names=tuple(e[4] for e in edges),
        resistor_kind=np.array([e[3] for e in edges], dtype=np.int64),
        ports=tuple(draw(st.lists(TEXT, min_size=len(ports), max_size=len(ports), unique=True))),
        port_node=np.array(ports, dtype=np.int64),
        merged_feet=draw(st.integers(0, 9)),
        dropped_contacts=draw(st.integers(0, 9)),
        unreached=np.array(draw(st.lists(st.integers(0, 99), unique=True, max_size=40)), dtype=np.int64),
    )


@given(circuits(), TEXT, TEXT)
def test_any_circuit_survives_the_round_trip_with_its_names_made_safe(circuit, name, note):
    before = {key: np.copy(value) for key, value in vars(circuit).items() if isinstance(value, np.ndarray)}
    text = subcircuit(circuit, name, Header(note, note, note, note, (note,)))
    back = parse(text)
    safe = replace(
        circuit, node_names=unique_names(circuit.node_names), resistor_names=unique_names(circuit.resistor_names)
    )
    assert same(back, safe)
    assert subcircuit(back, name, Header(note, note, note, note, (note,))) == text
    assert all(np.array_equal(value, getattr(circuit, key), equal_nan=True) for key, value in before.items())


@given(circuits(), TEXT, TEXT)
def test_no_text_becomes_a_card(circuit, name, note):
    text = subcircuit(circuit, name, Header(note, note, note, note, (note,)))
    assert text.isascii()
    cards = [line for line in text.split("\n")[:-1] if not line.startswith("* ")]
    word = r"[a-z][a-z0-9_]*"
    resistors = [card for card in cards if re.fullmatch(rf"R{word} {word} {word} [0-9.e+-]+", card)]
    pins = [card for card in cards if re.fullmatch(rf"(\.subckt|\+)( {word})+", card)]
    assert len(resistors) == circuit.n_resistors
    assert re.fullmatch(rf"\.ends {word}", cards[-1])
    assert len(cards) == len(resistors) + len(pins) + 1
    names = [card.split()[0].lower() for card in resistors]
    assert len(set(names)) == len(names)


def test_unsafe_names_stay_apart():
    assert unique_names(["A", "a", "a_2", "ä", "a b", "a\nb", "0", "GND"]) == (
        "a",
        "a_3",
        "a_2",
        "n",
        "a_b",
        "a_b_2",
        "n_0",
        "n_gnd",
    )


def test_safe_names_that_repeat_get_the_first_free_numbers():
    assert unique_names(["a", "a_2", "a", "b", "a", "a_2"]) == ("a", "a_2", "a_3", "b", "a_4", "a_2_2")
    assert unique_names([]) == ()


def test_long_names_that_differ_late_stay_different():
    """All states of a design with a long title: the names of their sub-circuits are not cut to the same word."""
    title = "a weave of many words " * 6
    words = [safe_name(f"{title}{state}") for state in ("relaxed", "stretch-0.05", "stretch-0.1")]
    assert len(set(words)) == 3
    for word in words:
        assert len(word) <= 80
        assert word.startswith("a_weave_of_many_words_a_weave")
        assert safe_name(word) == word
    assert len(safe_name("9" * 100)) == 80
    names = [line for state in ("relaxed", "reduced") for line in subcircuit(two_fibrils(), title + state).splitlines()]
    heads, tails = ([line.split()[1] for line in names if line.startswith(key)] for key in (".subckt", ".ends"))
    assert heads == tails
    assert len(set(heads)) == 2


def test_numbers_have_all_their_digits_and_no_suffix():
    ohm = [0.1 + 0.2, 1e6, 1 / 3, 1e-12, 123456789012345680.0]
    text = deck(network([(0, 1, r) for r in ohm], [0, 1]), {"p0": 1.0, "p1": 0.0})
    written = [line.split()[3] for line in text.splitlines() if line.startswith("R")]
    assert written == ["0.30000000000000004", "1000000.0", "0.3333333333333333", "1e-12", "1.2345678901234568e+17"]


@pytest.mark.parametrize("ohm", [0.0, -1.0, np.inf, np.nan])
def test_resistances_that_ngspice_would_change_are_refused(ohm):
    with pytest.raises(CircuitError, match=r"resistor 'r0': .* must be positive and finite"):
        deck(network([(0, 1, ohm)], [0, 1]), {"p0": 1.0})


def test_long_pin_lists_are_continued():
    lines = subcircuit(reduced_circuit((9, 9), 1.0, 1.0), "panel").split("\n")
    first = next(i for i, line in enumerate(lines) if line.startswith(".subckt"))
    pins = lines[first].split()[2:]
    while lines[first + 1].startswith("+"):
        first += 1
        pins += lines[first].split()[1:]
    assert len(pins) == 36
    assert max(map(len, lines)) <= 100


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda text: "title\n" + text, "first line must be the title"),
        (lambda text: text.replace("9.0", "nine"), "line 22: 'Rs_yarn2_f01_1500um.* cannot be read"),
        (lambda text: text.replace("* node: y2p\n", ""), "cannot be read"),
        (lambda text: text.replace("* kind: contact", "* kind: magic"), "cannot be read"),
        (lambda text: re.sub("Rc_.*\n", "", text), "the header promises 5 resistors, the text holds 4"),
        (lambda text: text + ".subckt other a\n", "parse reads one circuit"),
        (lambda text: text.replace('"y2p"', "y2p"), "cannot be read"),
    ],
)
def test_text_that_cannot_be_read_is_refused_by_line(edit, message):
    with pytest.raises(CircuitError, match=message):
        parse(edit(subcircuit(exact(two_fibrils()), "pair")))


def test_what_no_driven_port_reaches_is_left_out_of_a_deck():
    text = deck(reduced_circuit((2, 2), 1.0, np.inf), {"warp1_minus": 1.0, "warp1_plus": 0.0})
    assert "warp2" not in text


@pytest.mark.parametrize("volts", [np.nan, np.inf])
def test_voltages_that_cannot_be_written(volts):
    with pytest.raises(CircuitError, match="not a finite voltage"):
        deck(two_fibrils(), {"y1m": volts})


def test_two_ports_on_one_node_have_no_netlist():
    circuit = replace(network([(0, 1, 1.0)], [0, 1]), port_node=np.array([0, 0]))
    with pytest.raises(CircuitError, match="one pin for each"):
        subcircuit(circuit, "x")


def test_ngspice_solves_two_touching_fibrils():
    plot = run_deck(deck(two_fibrils(), {"y1m": 1.0, "y2p": 0.0})).plots[-1]
    assert -plot.current("vy1m")[0] == pytest.approx(1 / (0.3 + 50 + 9), rel=SIMULATED)
    np.testing.assert_allclose(plot.voltage(["yarn1_f01_8000um"])[0], 1 - 0.3 / 59.3, rtol=SIMULATED)


@pytest.mark.parametrize("Rc", WOVEN_CURRENTS)
def test_ngspice_answers_all_probes_of_a_woven_cell(Rc):
    circuit = reduced_circuit((4, 4), WOVEN_RY, Rc)
    answers = run_decks([deck(circuit, drive) for drive in PAPER_DRIVES])
    for data, drive, published in zip(answers, PAPER_DRIVES, WOVEN_CURRENTS[Rc], strict=True):
        plot = data.plots[-1]
        current = -plot.current(f"v{next(iter(drive))}")[0]
        assert current == pytest.approx(published, abs=WOVEN_ROUNDING)
        solution = solve_nodal(circuit, drive)
        assert current == pytest.approx(solution.port_current.max(), rel=SIMULATED)
        np.testing.assert_allclose(plot.voltage(circuit.node_names)[0], solution.voltage, atol=SIMULATED)


def test_ngspice_takes_a_subcircuit_with_hostile_names():
    circuit = replace(
        network([(0, 1, 2.0), (1, 2, 6.0)], [0, 2]),
        node_names=("gnd", "0", ".end\n"),
        resistor_names=("1 a 0 1\n.end", "$;*"),
        ports=("x\nR9 1 0 1", "temper"),
    )
    text = subcircuit(circuit, ".ends\n", Header("*#quit\n.end", notes=("\n.control\nquit\n.endc",)))
    name = next(line for line in text.splitlines() if line.startswith(".subckt")).split()[1]
    plot = run_deck(f"{text}X1 a 0 {name}\nV1 a 0 4.0\n.op\n.end\n").plots[-1]
    assert -plot.current("v1")[0] == pytest.approx(0.5, rel=SIMULATED)


PYSPICE = """
import json, sys
from circuittex.electrical.network.circuit import reduced_circuit
from circuittex.netlist import to_pyspice
drive = {"warp3_minus": 1.0, "warp2_plus": 0.0}
circuit = to_pyspice(reduced_circuit((4, 4), 0.2829, 10.0), drive)
analysis = circuit.simulator().operating_point()
answer = {name: float(node[0]) for name, node in analysis.nodes.items()}
print(json.dumps([answer, float(analysis.branches["vwarp3_minus"][0])]))
"""


def test_pyspice_simulates_in_the_shared_library():
    # In a process of its own: the library allows one instance and keeps what it allocates.
    done = subprocess.run([sys.executable, "-c", PYSPICE], capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    voltages, source = json.loads(done.stdout.splitlines()[-1])
    circuit = reduced_circuit((4, 4), WOVEN_RY, 10.0)
    solution = solve_nodal(circuit, PAPER_DRIVES[1])
    assert -source == pytest.approx(WOVEN_CURRENTS[10.0][1], abs=WOVEN_ROUNDING)
    assert -source == pytest.approx(solution.port_current.max(), rel=SIMULATED)
    assert set(voltages) == set(circuit.node_names)
    found = [voltages[name] for name in circuit.node_names]
    np.testing.assert_allclose(found, solution.voltage, atol=SIMULATED)


SUBCIRCUIT = """
import json
from circuittex.electrical.network.circuit import reduced_circuit
from circuittex.netlist import to_pyspice_subcircuit
from PySpice.Spice.Netlist import Circuit
piece = reduced_circuit((26, 26), 0.25, 40.0)
circuit = Circuit("a large piece")
circuit.subcircuit(to_pyspice_subcircuit(piece, "panel"))
circuit.X("1", "panel", *(circuit.gnd if port == "weft26_plus" else port for port in piece.ports))
circuit.V("1", "warp1_minus", circuit.gnd, 1)
nodes = circuit.simulator().operating_point().nodes
print(json.dumps({name: float(volts[0]) for name, volts in nodes.items() if "." not in name}))
"""


def test_pyspice_takes_sub_circuits_of_any_size():
    done = subprocess.run([sys.executable, "-c", SUBCIRCUIT], capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    piece = reduced_circuit((26, 26), 0.25, 40.0)
    assert piece.n_resistors == 2080
    solution = solve_nodal(piece, {"warp1_minus": 1.0, "weft26_plus": 0.0})
    volts = dict(zip(piece.ports, solution.voltage[piece.port_node], strict=True))
    assert set(found) == set(piece.ports) - {"weft26_plus"}
    np.testing.assert_allclose(list(found.values()), [volts[port] for port in found], rtol=1e-9)


def test_pyspice_refuses_large_circuits():
    with pytest.raises(CircuitError, match="2080 resistors are too many for PySpice"):
        to_pyspice(reduced_circuit((26, 26), 1.0, 1.0), {"warp1_minus": 1.0})


def test_pins_are_the_words_of_the_port_nodes():
    part = reached_part(two_fibrils(), ["y1m"])
    assert pin_names(part) == ("y1m", "y2p")
    assert set(KINDS) == {"segment", "contact", "reduced"}
