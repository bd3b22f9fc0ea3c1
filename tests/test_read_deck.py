"""Decks of others: what is read from them, against ngspice on the same text, and what is refused, by its words."""

from __future__ import annotations

import os
import random
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from spicelib import SpiceEditor

from circuittex.base.errors import CircuitError, NgspiceError
from circuittex.electrical.network.circuit import reduced_circuit
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.spice.expression import RESERVED
from circuittex.electrical.spice.ngspice import Plot, find_ngspice, read_raw, run_deck
from circuittex.netlist import Deck, deck, pin_names, read_deck

# ngspice solves a few dozen resistors within some decades of one another once, without refinement.
SIMULATED = 1e-9


def read(text: str, folder: Path) -> Deck:
    path = folder / "deck.cir"
    path.write_text(text, encoding="utf-8")
    return read_deck(path)


def ngspice(folder: Path) -> Plot:
    """What ngspice answers to the deck in `folder`, run there so that it finds what is included."""
    subprocess.run(
        [str(find_ngspice()), "-n", "-b", "-r", "out.raw", "deck.cir"], cwd=folder, check=True, capture_output=True
    )
    (plot,) = read_raw(folder / "out.raw")
    return plot


def assert_same(found: Deck, plot: Plot) -> None:
    """Every voltage and every source current as ngspice has them, at least as many nodes as it has."""
    solution = solve_nodal(found.circuit, found.drive)
    nodes = found.circuit.node_names
    assert {f"v({node})" for node in nodes if node != "0"} == {v for v in plot.variables if v.startswith("v(")}
    largest = np.abs(solution.voltage).max()
    assert_allclose(solution.voltage, plot.voltage(nodes)[0], rtol=SIMULATED, atol=SIMULATED * largest)


FEATURES = """\
R1 the title is no card
* a comment
.PARAM a=2k b={a*2} c='b+1' d = 2*3
.param  e = {max(a, 3)/min(4, 5) + sqrt(16) - abs(-2)} f={(2^3)*ln(exp(2)) + LOG(exp(1))} g={-2**2 + 2**-1 + 9}
V1 In 0 DC 5
V2 0 low 3 ; three volts below ground
vthird third gnd dc = {d/2}
R1 IN 2 1kohm
r2 2 0
* between a card and what goes on
+
+ {a} $ and so on
R3 2 GND R=1.5Meg
R4 2 4 r = {B}
R5 4 0 'c/2'
R6 4 low 2mil
R7 4 third 4.7KOHM
R8 third 4 {f+g+e}
R9 4 low 100m
X1 in 4 pair
x2 in 4 PAIR PARAMS: r={d*100}
X3 in 4 pair r=5k s=1
X4 2 low tree w = {a}
.subckt pair p q PARAMS: r=1k s={r*2}
.param t={s + a}
Ra p mid {s}
Rb mid q {t}
Rc mid 0 1t
.ends pair
.SUBCKT tree p q w=1
.subckt leaf a b params: v=1
R1 a b {v*w}
.ends
X1 p m leaf v=2
X2 m q leaf v={w/1k}
R1 m 0 3g
.ends tree
.options reltol=1e-6
.op
.print dc v(2)
.end
* and that is all
"""


def test_a_deck_with_every_feature_is_what_ngspice_reads(tmp_path: Path) -> None:
    found = read(FEATURES, tmp_path)
    assert found.drive == {"ground": 0.0, "in": 5.0, "low": -3.0, "third": 3.0}
    assert_same(found, ngspice(tmp_path))


def test_source_currents_are_those_of_ngspice(tmp_path: Path) -> None:
    found = read(FEATURES, tmp_path)
    plot = ngspice(tmp_path)
    current = dict(zip(found.circuit.ports, solve_nodal(found.circuit, found.drive).port_current, strict=True))
    assert_allclose(current["in"], -plot.current("v1")[0], rtol=SIMULATED)
    assert_allclose(current["low"], plot.current("v2")[0], rtol=SIMULATED)


def test_includes_inside_the_folder(tmp_path: Path) -> None:
    (tmp_path / "parts" / "more").mkdir(parents=True)
    (tmp_path / "parts" / "a.inc").write_text("R1 in mid 1k\n.include more/B.inc\n", encoding="utf-8")
    (tmp_path / "parts" / "more" / "B.inc").write_text(".subckt s p q\nR1 p q 3k\n.ends\n", encoding="utf-8")
    found = read('t\nV1 in 0 1\n.include "parts/a.inc"\nX1 mid 0 s\n.op\n.end\n', tmp_path)
    assert_same(found, ngspice(tmp_path))


def test_round_trip_through_a_deck_of_ours(tmp_path: Path) -> None:
    """deck -> circuit -> deck -> ngspice: the voltages that ngspice has for the first deck."""
    found = read(FEATURES, tmp_path)
    words = [word for word in run_deck(deck(found.circuit, found.drive)).plots[0].variables if word.startswith("v(")]
    second = run_deck(deck(found.circuit, found.drive)).plots[0]
    first = ngspice(tmp_path)
    assert len(words) == found.circuit.n_nodes
    assert_allclose(
        np.sort(second.values[0, [second.variables.index(word) for word in words]]),
        np.sort(first.voltage(found.circuit.node_names)[0]),
        rtol=SIMULATED,
        atol=SIMULATED,
    )


def test_our_own_decks_are_read_too(tmp_path: Path) -> None:
    circuit = reduced_circuit((2, 3), 0.3, 200.0)
    drive = {"warp1_minus": 1.0, "weft2_plus": -0.25}
    found = read(deck(circuit, drive), tmp_path)
    ours = dict(zip(pin_names(circuit), solve_nodal(circuit, drive).port_current, strict=True))
    theirs = dict(zip(found.circuit.ports, solve_nodal(found.circuit, found.drive).port_current, strict=True))
    assert found.circuit.resistance.tolist() == circuit.resistance.tolist()
    assert_allclose(theirs["warp1_minus"], ours["warp1_minus"], rtol=1e-12)


SUFFIX = {"T": 1e12, "g": 1e9, "Meg": 1e6, "K": 1e3, "": 1.0, "m": 1e-3, "U": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15}


@st.composite
def decks(draw: st.DrawFn) -> str:
    """A ladder of sub-circuits, each calling those after it, with values that resistors within six decades have."""
    levels = draw(st.integers(1, 4))

    def value(name: str) -> str:
        suffix = draw(st.sampled_from(sorted(SUFFIX)))
        size = draw(st.floats(1.0, 1e6)) / SUFFIX[suffix]
        number = f"{size!r}{suffix}{draw(st.sampled_from(['', 'ohm']))}"
        return draw(st.sampled_from([number, f"{{{number}}}", f"{{{name} * 3 + {number}}}", f"R={{{number}/2}}"]))

    lines = ["random", ".param top=12k", f"V1 in 0 {draw(st.floats(-5.0, 5.0))!r}", "V2 0 b 1"]
    lines += [f"R1 in 0 {value('top')}", f"X1 in b s{levels}", f"X2 b in s{levels} PARAMS: r={{top}}"]
    for level in range(1, levels + 1):
        lines += [f".subckt s{level} a z params: r={draw(st.integers(1, 9))}k q={{r + top}}"]
        lines += [f"Ra a m {value('r')}", f"+ ; {level}", f"Rb m z {value('q')}", f"Rc z 0 {value('top')}"]
        lines += [f"X{k} m a s{level - 1} r={{q/{k}}}" for k in range(1, draw(st.integers(1, 3))) if level > 1]
        lines += [".ends"]
    return "\n".join([*lines, ".op", ".end", ""])


NAMES = [
    *("and", "or", "not", "mod", "div", "defined", "if", "table", "pwl", "stp", "ddt", "var", "vec", "u"),
    *("pi", "e", "c", "kelvin", "echarge", "boltz", "yes", "no", "true", "false", "nan", "inf", "temp", "gmin", "tnom"),
    *("i", "v", "x", "r", "l", "w", "m", "k", "t", "g", "meg", "mil", "params", "dc", "begin", "end", "while", "for"),
]
"""Words of ngspice's expressions and controls, its constants, its multiplier, letters of elements, suffixes."""


@pytest.mark.parametrize("name", NAMES)
def test_a_parameter_of_any_other_name_is_what_ngspice_reads(name: str, tmp_path: Path) -> None:
    """Names that stand for something in ngspice's expressions, unless it lets a parameter have them, are refused."""
    inner = f".subckt s p {name}=2k\nR1 p 0 {{{name}+1}}\n.ends"
    found = read(
        f"t\n.param {name}=3k\nV1 a 0 1\nR1 a b {{{name}*2}}\nX1 b s {name}={{{name}}}\n{inner}\n.op\n", tmp_path
    )
    assert_same(found, ngspice(tmp_path))


def test_no_reserved_name_is_a_parameter_in_ngspice(tmp_path: Path) -> None:
    """The list of them holds nothing that could be read."""
    for name in sorted(RESERVED):
        text = f"t\n.param {name}=3k\nV1 a 0 1\nR1 a b 1k\nR2 b 0 {{{name}+1}}\n.op\n.end\n"
        (tmp_path / "deck.cir").write_text(text, encoding="ascii")
        (tmp_path / "out.raw").unlink(missing_ok=True)
        try:
            found = ngspice(tmp_path).voltage(["b"])[0, 0]
        except (NgspiceError, subprocess.CalledProcessError):
            continue
        assert abs(found - 3001 / 4001) > 1e-6, name


@given(text=decks())
def test_random_decks_are_what_ngspice_reads(text: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("random")
    assert_same(read(text, folder), ngspice(folder))


def mistyped(seed: int) -> str:
    """The deck with every feature, with one or two typing errors."""
    rng = random.Random(seed)
    lines = FEATURES.split("\n")
    for _ in range(rng.randint(1, 2)):
        i = rng.randrange(1, len(lines) - 1)
        k = rng.randrange(len(lines[i]) + 1)
        words = lines[i].split(" ")
        words[rng.randrange(len(words))] = rng.choice(FEATURES.split())
        other = rng.choice("abkmg019.+-*/^(){}'=;$, \t")
        lines[i] = rng.choice(
            [
                lines[i][:k] + lines[i][k + 1 :],
                lines[i][:k] + other + lines[i][k:],
                " ".join(words),
                f"+ {lines[i]}",
                "",
            ]
        )
    return "\n".join(lines)


@pytest.mark.parametrize("first", range(0, 400, 100))
def test_a_mistyped_deck_is_refused_or_what_ngspice_reads(first: int, tmp_path: Path) -> None:
    """Nothing is read in silence as something else; what ngspice itself refuses says nothing."""
    compared = 0
    for seed in range(first, first + 100):
        (tmp_path / "out.raw").unlink(missing_ok=True)
        try:
            found = read(mistyped(seed), tmp_path)
            solution = solve_nodal(found.circuit, found.drive)
            expected = ngspice(tmp_path).voltage(found.circuit.node_names)[0]
        except (CircuitError, NgspiceError, subprocess.CalledProcessError):
            continue
        compared += 1
        assert_allclose(solution.voltage, expected, rtol=SIMULATED, atol=5 * SIMULATED, err_msg=f"seed {seed}")
    assert compared > 10


# refusals

BASE = "t\nV1 a 0 1\nR9 a 0 1\n"


@pytest.mark.parametrize(
    ("cards", "says"),
    [
        ("C1 a 0 1n", "allowed are R, V and X cards"),
        ("L1 a 0 1n", "allowed are"),
        ("B1 a 0 v=1", "allowed are"),
        ("I1 a 0 1", "allowed are"),
        (".control\nshell rm x\n.endc", "line 4: '.control' cannot be read: allowed are"),
        (".global b", "allowed are"),
        (".model m r", "allowed are"),
        (".func f(x)={x}", "allowed are"),
        (".options rshunt=1k", "allowed are"),
        ("R1 a 0 0", "line 4: 'r1 a 0 0' cannot be read: a resistance of 0.0 ohm is not positive"),
        ("R1 a 0 -1k", "-1000.0 ohm is not positive"),
        ("R1 a 0 {1-2}", "-1.0 ohm is not positive"),
        ("R1 a 0 2k2", "no number"),
        ("R1 a 0 mymodel", "no number"),
        ("R1 a 0 1k tc1=0.1", "models and coefficients are not read"),
        ("R1 a 0", "a resistor is"),
        ("R9 b 0 1", "there is a 'r9' already"),
        ("R1 a 0 {x}", "there is no parameter 'x'"),
        ("R1 a 0 (1)", "'\\(1\\)' is not expected|is not expected"),
        ("R1 a 0 {1", "is not expected"),
        ("R1 a $b 1k", "is a comment for some simulators"),
        (".param p={1}q={2}", "cannot be read"),
        ("R1 a 0\n; a comment\n+ 1k", "line 6: '\\+ 1k' cannot be read: between it and its card is a comment"),
        ("R1 a ground 1", "give it another name"),
        ("R1 a b\u00e4 1", "only printable ASCII"),
        (".param p={q} q={p}\nR1 a 0 {p}", "follows from itself"),
        (".param p=1\n.param P=2", "there is a parameter 'p' already"),
        (".param p=1 p=2", "given twice"),
        (".param p = 1 + 2", "'1 \\+ 2' must stand in braces"),
        (".param p", "a .param is followed by"),
        (".param temper=3", "'temper' means something else to simulators"),
        (".subckt s p SQRT=3\nR1 p 0 {sqrt}\n.ends", "'sqrt' means something else to simulators"),
        ("R1 a 0 {2mil*1meg}", "'2mil': in expressions, simulators disagree about mil"),
        (".param p=-8\nR1 a 0 {p**3+10k}", "a power of -8.0, which is negative: simulators disagree"),
        (".subckt s p qPARAMS: r=1\n.ends", "'qparams:' is no node"),
        ("V2 b c 1", "against node 0"),
        ("V2 0 gnd 1", "against node 0"),
        ("V2 0 a 1", "another source drives the node 'a' already"),
        ("V2 b 0 sin(0 1 50)", "is not expected"),
        ("V2 b 0 dc 1 ac 1", "wave forms are not read"),
        ("X1 a 0 s", "there is no sub-circuit 's' here"),
        (".subckt s p q\nR1 p q 1\n.ends\nX1 a s", "'s' has 2 pins, and the call has 1 nodes"),
        (".subckt s p q\nR1 p q 1\n.ends\nX1 a 0 s r=1", "'s' has no parameter 'r'"),
        (".subckt s p q\nR1 p q 1\n.ends\n.subckt S p\nR1 p 0 1\n.ends", "there is a sub-circuit 's' already"),
        (".subckt s p p\n.ends", "its pins must differ"),
        (".subckt s p 0\n.ends", "none can be ground"),
        (".subckt s", "has a name and pins"),
        (".subckt s p\nR1 p 0 1", "its .ends is missing"),
        (".subckt s p\n.ends t", "is open is 's'"),
        (".ends", "no .subckt before it"),
        (".subckt s p\nX1 p s\n.ends\nX1 a s", "calls itself"),
        (".subckt s p\nX1 p t\n.ends\n.subckt t p\nX1 p s\n.ends\nX1 a s", "calls itself"),
        (
            ".subckt in p\nR1 p 0 {w}\n.ends\n.subckt out p w=1\nX1 p in\n.ends\nX1 a out",
            "'w' is a parameter of the sub-circuit 'out' that calls this one; simulators disagree",
        ),
        (".subckt s p\nR1 p m 1\nR2 m 0 1\n.ends\nX1 a s\nR1 x1.m 0 1", "could be inside the call 'x1'"),
        (".end\nR1 a 0 1", "comes after .end"),
        (".include", "name of one file"),
        (".lib a.lib typical", "sections of libraries are not read"),
        (".include nothing.inc", "there is no file 'nothing.inc'"),
        (".include /etc/passwd", "inside the deck's folder"),
        (".include C:/x.inc", "inside the deck's folder"),
        (".include ..\\x.inc", "inside the deck's folder"),
        (".include ~/x.inc", "inside the deck's folder"),
        (".include ../x.inc", "leads out of the deck's folder"),
        (".include deck.cir", "includes itself"),
    ],
)
def test_refusals(cards: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(CircuitError, match=says) as caught:
        read(BASE + cards + "\n.end\n", tmp_path)
    assert str(caught.value).startswith("deck.cir, line ")
    assert "\n" not in str(caught.value)


def test_a_card_to_go_on_with_must_be_there(tmp_path: Path) -> None:
    with pytest.raises(CircuitError, match=r"deck.cir, line 2: .* no card before it"):
        read("t\n+ 1k\n", tmp_path)


def test_a_deck_without_resistors(tmp_path: Path) -> None:
    with pytest.raises(CircuitError, match="no resistors"):
        read("t\nV1 a 0 1\n", tmp_path)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(CircuitError, match="there is no such file"):
        read_deck(tmp_path / "none.cir")


def test_links_out_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "secret.inc").write_text("R1 a 0 1\n", encoding="utf-8")
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "link.inc").symlink_to(tmp_path / "secret.inc")
    (inside / "folder").symlink_to(tmp_path)
    for name in ("link.inc", "folder/secret.inc"):
        with pytest.raises(CircuitError, match="leads out of the deck's folder"):
            read(f"{BASE}.include {name}\n", inside)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="a kind of file that only POSIX has")
def test_a_pipe_is_no_file_to_wait_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.inc")
    with pytest.raises(CircuitError, match=r"there is no file 'pipe.inc'"):
        read(f"{BASE}.include pipe.inc\n", tmp_path)


def test_includes_in_a_circle_and_too_many(tmp_path: Path) -> None:
    (tmp_path / "a.inc").write_text(".include b.inc\n", encoding="utf-8")
    (tmp_path / "b.inc").write_text(".include a.inc\n", encoding="utf-8")
    with pytest.raises(CircuitError, match=r"b.inc, line 1: .*'a.inc' includes itself"):
        read(f"{BASE}.include a.inc\n", tmp_path)
    for k in range(20):
        (tmp_path / f"c{k}.inc").write_text(f".include c{k + 1}.inc\n" * 2, encoding="utf-8")
    (tmp_path / "c20.inc").write_text("* nothing\n", encoding="utf-8")
    with pytest.raises(CircuitError, match="at most 1000 files"):
        read(f"{BASE}.include c0.inc\n", tmp_path)


@pytest.mark.parametrize("inner", ["R1 p 0 1", "* nothing"])
def test_a_bomb_is_refused_before_it_expands(inner: str, tmp_path: Path) -> None:
    """10^40 resistors, and 10^40 calls of nothing at all: both would take for ever."""
    lines = [f".subckt s0 p\n{inner}\n.ends"]
    for level in range(1, 41):
        lines += [f".subckt s{level} p", *(f"X{k} p s{level - 1}" for k in range(10)), ".ends"]
    with pytest.raises(CircuitError, match="more than 2000000 resistors, sources and calls"):
        read("\n".join(["t", "V1 a 0 1", "R9 a 0 1", *lines, "X1 a s40", ""]), tmp_path)


def test_calls_too_deep(tmp_path: Path) -> None:
    lines = [".subckt s0 p\nR1 p 0 1\n.ends"]
    lines += [f".subckt s{level} p\nX1 p s{level - 1}\n.ends" for level in range(1, 80)]
    with pytest.raises(CircuitError, match="nested deeper than 50"):
        read("\n".join([BASE, *lines, "X1 a s79", ""]), tmp_path)


def test_parameters_that_follow_from_too_many(tmp_path: Path) -> None:
    chain = "\n".join(f".param p{k}={{p{k + 1}*2}}" for k in range(5000))
    with pytest.raises(CircuitError, match="more than 50 parameters follow from one another"):
        read(f"{BASE}{chain}\n.param p5000=1\nR1 a 0 {{p0}}\n", tmp_path)


@given(text=st.text(alphabet="rvx.subcktendparmi =+{}()'\"*;$0123456789\n\t\x0b\x85\u2028", max_size=200))
def test_any_text_is_read_or_refused_in_one_sentence(text: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    said = ""
    try:
        read(f"t\n{text}", tmp_path_factory.mktemp("any"))
    except CircuitError as error:
        said = str(error)
    assert "\n" not in said


# other programs


def test_round_trip_with_spicelib(tmp_path: Path) -> None:
    """Our deck is opened in spicelib, which sees our resistors, changes one, and writes a deck that is read here."""
    circuit = reduced_circuit((2, 2), 0.3, 200.0)
    path = tmp_path / "ours.cir"
    path.write_text(deck(circuit, {"warp1_minus": 1.0, "weft2_plus": 0.0}), encoding="ascii")
    editor = SpiceEditor(str(path))
    names = editor.get_components("R")
    seen = {name.lower(): float(editor.get_component_value(name)) for name in names}
    assert seen == {f"r{name}": ohm for name, ohm in zip(circuit.resistor_names, circuit.resistance, strict=True)}
    editor.set_component_value("Rrc_1_1", "1.5k")
    editor.save_netlist(str(tmp_path / "theirs.cir"))
    found = read_deck(tmp_path / "theirs.cir")
    assert dict(zip(found.circuit.resistor_names, found.circuit.resistance, strict=True)) == seen | {"rrc_1_1": 1500.0}
    assert found.drive == {"ground": 0.0, "warp1_minus": 1.0, "weft2_plus": 0.0}
