"""Symbols of an exported library: read by programs of others, and netlisted and run as KiCad and LTspice would."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from hypothesis import given, settings
from hypothesis import strategies as st
from kicad_netlist import card, fields, netlist, pins
from kiutils.schematic import Schematic
from kiutils.symbol import SymbolLib
from kiutils.utils.sexpr import parse_sexp
from library_cases import CELLS, answer, direct, listed, pins_of, resistor_matrix, study
from spicelib.editor.asy_reader import AsyReader

from circuittex.electrical.spice.ngspice import run_deck
from circuittex.study.library.cell import Cell, Pin
from circuittex.study.library.export import export_library
from circuittex.study.library.symbols.expression import one_line
from circuittex.study.library.symbols.kicad import symbol_library
from circuittex.study.library.symbols.layout import layout
from circuittex.study.library.symbols.ltspice import asy
from circuittex.study.library.symbols.project import Divider, example_project

pytestmark = pytest.mark.xdist_group("symbols")  # what its fixtures make serves one worker

SAME = 1e-9
"""Relative: the same numbers through the same program, and a raw file's digits."""
NAME = 'the "weave" (a) \\'


@pytest.fixture(autouse=True)
def _nothing_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for what the module's fixtures export."""
    undrawn(monkeypatch)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("library")
    made = study(3)
    export_library(replace(made, design=replace(made.design, name=NAME)), folder, thin=0.02)
    return folder


@pytest.fixture(scope="module")
def symbols(library: Path) -> dict[str, object]:
    """What kiutils reads, by name."""
    read = SymbolLib.from_file(str(library / "kicad" / "fabric.kicad_sym"))
    assert int(read.version) == 20220914
    return {each.entryName: each for each in read.symbols}


def test_kiutils_reads_a_symbol_of_each_cell(library: Path, symbols: dict[str, object]) -> None:
    cells = listed(library, "ngspice")
    assert list(symbols) == [cell["name"] for cell in cells]
    for cell in cells:
        found = fields(symbols[cell["name"]])
        names = [pin["name"] for pin in cell["pins"]]
        assert found["Reference"] == "X"
        assert found["Value"] == found["Sim.Name"] == cell["name"]
        assert found["Sim.Device"] == "SUBCKT"
        assert found["Sim.Library"] == cell["file"]
        assert (library / found["Sim.Library"]).is_file()
        assert (library / found["Datasheet"]).is_file()
        assert found["Sim.Pins"].split() == [f"{k}={name}" for k, name in enumerate(names, 1)]
        assert found.get("Sim.Params", "") == ("strain=0" if cell["parameters"] else "")
        drawn = {pin.number: pin for pin in pins(symbols[cell["name"]])}
        assert {number: pin.name for number, pin in drawn.items()} == {str(k): n for k, n in enumerate(names, 1)}
        types = {"electrical": "passive", "control": "input", "flag": "output"}
        assert [pin.electricalType for pin in drawn.values()] == [types[pin["kind"]] for pin in cell["pins"]]


def test_pins_are_on_the_grid_on_the_side_that_is_theirs(symbols: dict[str, object]) -> None:
    """KiCad's y goes up in symbols; warp1 is the lowest, weft1 the leftmost, and a yarn's two ends face each other."""
    for name, symbol in symbols.items():
        at = {pin.name: (pin.position.X, pin.position.Y, pin.position.angle) for pin in pins(symbol)}
        assert len({place[:2] for place in at.values()}) == len(at)
        for x, y, _ in at.values():
            assert abs(x / 2.54 - round(x / 2.54)) + abs(y / 2.54 - round(y / 2.54)) < 1e-6
        if "warp1_minus" in at:
            for k in range(1, 5):
                (x0, y0, a0), (x1, y1, a1) = at[f"warp{k}_minus"], at[f"warp{k}_plus"]
                assert (x0 < x1, y0 == y1, a0, a1) == (True, True, 0, 180)
                (x0, y0, a0), (x1, y1, a1) = at[f"weft{k}_minus"], at[f"weft{k}_plus"]
                assert (x0 == x1, y0 < y1, a0, a1) == (True, True, 90, 270)
            assert at["warp1_minus"][1] < at["warp2_minus"][1]
            assert at["weft1_minus"][0] < at["weft2_minus"][0]
        if name.endswith("_v"):
            yarns = [place for pin, place in at.items() if pin not in ("strain", "out_of_range")]
            inner = max(x for x, _, angle in yarns if angle in (90, 270))
            assert at["strain"][2] == 90
            assert inner + 2.54 < at["strain"][0] < at["out_of_range"][0]


def test_spicelib_reads_a_symbol_of_each_file_for_ltspice(library: Path) -> None:
    cells = listed(library, "ltspice")
    assert {path.stem for path in (library / "ltspice").glob("*.asy")} == {cell["name"] for cell in cells}
    for cell in cells:
        path = library / "ltspice" / f"{cell['name']}.asy"
        read = AsyReader(path)
        assert read.symbol_type == "CELL"
        assert (read.attributes["Prefix"], read.attributes["SpiceModel"]) == ("X", cell["name"])
        assert "Value" not in read.attributes, "it would stand behind the name in the netlist"
        assert (path.parent / read.attributes["ModelFile"]).name == Path(cell["file"]).name
        assert read.attributes.get("SpiceLine", "") == ("strain=0" if cell["parameters"] else "")
        told = [dict(word.split("=") for word in pin.text.strip(";").split(";")) for pin in read.pins]
        order = sorted(told, key=lambda pin: int(pin["SpiceOrder"]))
        assert [int(pin["SpiceOrder"]) for pin in order] == list(range(1, len(order) + 1))
        assert [pin["PinName"] for pin in order] == pins_of((path.parent / read.attributes["ModelFile"]).read_text())
        places = {(pin.coord.X, pin.coord.Y) for pin in read.pins}
        assert len(places) == len(read.pins)
        assert all(x % 16 == 0 and y % 16 == 0 for x, y in places)
        (body,) = read.shapes
        (x0, y0), (x1, y1) = ((point.X, point.Y) for point in body.points)
        on_edge = [line for line in read.lines if {(line.V1.X, line.V1.Y), (line.V2.X, line.V2.Y)} & places]
        assert len(on_edge) == len(places)
        assert all(not (x0 < x < x1 and y0 < y < y1) for x, y in places)


@pytest.mark.parametrize("end", CELLS)
def test_a_symbol_in_kicad_is_the_sub_circuit(library: Path, symbols: dict[str, object], end: str) -> None:
    """Wires go to what a symbol shows; the netlist goes by numbers and `Sim.Pins`."""
    name = f"fabric_{end}"
    nets = {pin.number: f"net_{pin.name}" for pin in pins(symbols[name])}
    line = card("X1", fields(symbols[name]), nets, library)
    np.testing.assert_allclose(answer(library, name, line), direct(library, name), rtol=SAME, atol=1e-12)


@pytest.mark.parametrize("end", CELLS)
def test_two_swapped_pins_are_noticed(library: Path, end: str) -> None:
    """The comparison above can fail: with the numbers of two drawn pins exchanged it does, by far."""
    name = f"fabric_{end}"
    text = (library / "kicad" / "fabric.kicad_sym").read_text("utf-8")
    start = text.index(f'(symbol "{name}_1_1"')
    head, own = text[:start], text[start:]
    own = own.replace('(number "1"', '(number "?"', 1).replace('(number "3"', '(number "1"', 1)
    broken = library / f"swapped_{end}.kicad_sym"
    broken.write_text(head + own.replace('(number "?"', '(number "3"', 1), "utf-8")
    (symbol,) = [each for each in SymbolLib.from_file(str(broken)).symbols if each.entryName == name]
    nets = {pin.number: f"net_{pin.name}" for pin in pins(symbol)}
    found = answer(library, name, card("X1", fields(symbol), nets, library))
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(found, direct(library, name), rtol=1e-3)


def test_an_ltspice_symbol_is_the_sub_circuit(library: Path) -> None:
    """The line of LTspice's help, `<name> <nodes> <SpiceModel> <SpiceLine>`, on the same file for ngspice."""
    for end in CELLS:
        name = f"fabric_{end}"
        read = AsyReader(library / "ltspice" / f"{name}.asy")
        told = [dict(word.split("=") for word in pin.text.strip(";").split(";")) for pin in read.pins]
        nodes = [f"net_{pin['PinName']}" for pin in sorted(told, key=lambda pin: int(pin["SpiceOrder"]))]
        line = " ".join(["X1", *nodes, read.attributes["SpiceModel"], read.attributes.get("SpiceLine", "")])
        np.testing.assert_allclose(answer(library, name, line), direct(library, name), rtol=SAME, atol=1e-12)


def example(library: Path) -> tuple[Path, Schematic]:
    folder = library / "kicad" / "example"
    assert (
        json.loads((folder / "fabric_example.kicad_pro").read_text())["meta"]["filename"] == "fabric_example.kicad_pro"
    )
    table = (folder / "sym-lib-table").read_text()
    (uri,) = re.findall(r'\(uri "\$\{KIPRJMOD\}/([^"]*)"\)', table)
    assert (folder / uri).is_file()
    return folder, Schematic.from_file(str(folder / "fabric_example.kicad_sch"))


def test_the_example_project_runs(library: Path) -> None:
    """A divider written by hand, with the same fabric, gives the same transient."""
    folder, sheet = example(library)
    lines = netlist(sheet, folder)
    assert [line.split()[0] for line in lines if line[0] in "XVR"] == ["X1", "V1", "R1", "V2"]
    plot = run_deck("\n".join(["* example", *lines, ".end", ""])).plots[-1]
    name = "fabric_ports_stretch_v"
    path = library / "ngspice" / f"{name}.lib"
    names, G = resistor_matrix((library / "ngspice" / "fabric_ports.lib").read_text("ascii"))
    inverse = np.linalg.inv(G[1:, 1:])  # the first pin at ground
    farthest = names[1 + int(np.argmax(np.diag(inverse)))]
    by_hand = {"warp1_minus": "sense", farthest: "0", "strain": "strain", "out_of_range": "out_of_range"}
    nodes = " ".join(by_hand.get(pin, f"open_{pin}") for pin in pins_of(path.read_text("ascii")))
    (source,) = [line for line in lines if line.startswith("V2 ")]
    (sine,) = re.findall(r"SIN\((.*)\)", source)
    ohm = f"{np.diag(inverse).max():.1g}"
    own = ["* hand", f".include {path}", "V1 supply 0 3.3", f"R1 supply sense {ohm}", f"X1 {nodes} {name}"]
    own += [f"Vs strain 0 SIN({sine})", ".tran 1m 100m", ".end", ""]
    wanted = run_deck("\n".join(own)).plots[-1]
    shown = ["supply", "sense", "strain", "out_of_range"]
    np.testing.assert_allclose(plot.voltage(shown)[-1], wanted.voltage(shown)[-1], rtol=1e-6, atol=1e-9)
    sense, strain = plot.voltage(["sense"])[:, 0], plot.voltage(["strain"])[:, 0]
    assert 0.0 < sense.min() < 0.9 * sense.max() < 0.9 * 3.3, "a designer sees what strain does"
    assert strain.min() == pytest.approx(0.0, abs=1e-9)
    assert strain.max() > 0.02
    assert abs(plot.voltage(["out_of_range"])).max() < 1e-9


@pytest.mark.parametrize("states", [1, 3])
@pytest.mark.filterwarnings("ignore:the study has one state")
def test_the_netlist_of_the_example_is_that_of_its_sheet(tmp_path: Path, states: int) -> None:
    """Line by line but for the names of open pins and the order, as KiCad's own exporter makes it of the sheet."""
    export_library(study(states), tmp_path, dialects=("ngspice",))
    folder, sheet = example(tmp_path)
    title, include, *lines, end = (folder / "fabric_example.cir").read_text("ascii").splitlines()
    assert title.startswith("* ")
    assert end == ".end"
    wanted_include, *wanted = netlist(sheet, folder)
    assert (folder / include.split()[1]).resolve() == Path(wanted_include.split()[1])
    is_open = re.compile(r"(?<= )(nc_x1_\d+|X1_\w+)(?= )")
    given = [word for line in lines for word in is_open.findall(line)]
    assert len(set(given)) == len(given) > 10
    lines = [line for line in lines if not line.startswith(".print ")]  # KiCad shows what is asked for on the screen
    assert sorted(is_open.sub("open", line) for line in lines) == sorted(is_open.sub("open", line) for line in wanted)


def test_the_example_of_one_state_runs(tmp_path: Path) -> None:
    with pytest.warns(match="one state"):
        export_library(study(1), tmp_path, dialects=("ngspice",))
    folder, sheet = example(tmp_path)
    plot = run_deck("\n".join(["* example", *netlist(sheet, folder), ".end", ""])).plots[-1]
    supply, sense = plot.voltage(["supply", "sense"])[-1]
    assert supply == pytest.approx(3.3)
    assert 0.0 < sense < 3.3
    assert not (tmp_path / "ltspice").exists()


def test_the_example_of_a_wide_fabric_joins_nothing_else(tmp_path: Path) -> None:
    """One net for each pin that is open, however many there are: nothing of the fabric reaches the sources."""
    yarns = [
        Pin(f"warp{k}_{end}", side, "electrical") for k in range(70) for end, side in (("a", "left"), ("b", "right"))
    ]
    yarns += [
        Pin(f"weft{k}_{end}", side, "electrical") for k in range(70) for end, side in (("a", "bottom"), ("b", "top"))
    ]
    wide = replace(cell("wide", "ngspice"), pins=(*yarns, *PINS[2:]))
    folder = tmp_path / "kicad" / "example"
    for path in (folder, tmp_path / "ngspice"):
        path.mkdir(parents=True)
    (tmp_path / wide.file).write_text(f".subckt piece {' '.join(pin.name for pin in wide.pins)}\n.ends piece\n")
    shown = replace(SHOWN, ends=("warp0_a", "warp0_b"))
    text = example_project(wide, "D", "fabric.kicad_sym", shown)["fabric_example.kicad_sch"]
    (folder / "wide.kicad_sch").write_text(text, "utf-8")
    (line,) = [line for line in netlist(Schematic.from_file(str(folder / "wide.kicad_sch")), folder) if line[0] == "X"]
    nets = line.split()[1:-1]
    assert nets[:2] == ["sense", "0"]
    assert nets[-1] == "strain"
    assert len({net for net in nets if net.startswith("nc_")}) == len(nets) - 3


@pytest.mark.filterwarnings("ignore:no cell of Ry and Rc")
def test_terminals_of_free_ends_have_pins(tmp_path: Path) -> None:
    export_library(study(2), tmp_path, ends="free", dialects=("ngspice", "ltspice"))
    for each in SymbolLib.from_file(str(tmp_path / "kicad" / "fabric_free.kicad_sym")).symbols:
        name = each.entryName
        nets = {pin.number: f"net_{pin.name}" for pin in pins(each)}
        line = card("X1", fields(each), nets, tmp_path)
        np.testing.assert_allclose(answer(tmp_path, name, line), direct(tmp_path, name), rtol=SAME, atol=1e-12)
        assert len(AsyReader(tmp_path / "ltspice" / f"{name}.asy").pins) == len(nets)


def test_ids_of_the_example_differ(library: Path) -> None:
    text = (library / "kicad" / "example" / "fabric_example.kicad_sch").read_text("utf-8")
    ids = re.findall(r"\(uuid ([0-9a-f-]{36})\)", text)
    assert len(ids) > 30
    assert len(set(ids)) == len(ids)


def test_a_library_without_these_programs_has_no_symbols(tmp_path: Path) -> None:
    with pytest.warns(match="one state"):
        export_library(study(1), tmp_path, dialects=("xyce",))
    assert not [path for path in tmp_path.rglob("*") if path.suffix in (".asy", ".kicad_sym", ".kicad_sch")]


WORD = re.compile(r'[^\s()"]+')
ESCAPES = {"n": "\n", "r": "\r", "t": "\t"}


def parse(text: str) -> list[object]:
    """An S-expression by the rules of KiCad's reader: quoted strings are ('text',), other words are plain."""
    stack: list[list[object]] = [[]]
    position = 0
    while position < len(text):
        letter = text[position]
        if letter == "(":
            stack.append([])
        elif letter == ")":
            inner = stack.pop()
            stack[-1].append(inner)
        elif letter == '"':
            found, position = "", position + 1
            while text[position] != '"':
                if text[position] == "\\":
                    position += 1
                    found += ESCAPES.get(text[position], text[position])
                else:
                    assert text[position] not in "\r\n", "a string ends on its line"
                    found += text[position]
                position += 1
            stack[-1].append((found,))
        elif not letter.isspace():
            stack[-1].append(WORD.match(text, position).group())
            position += len(stack[-1][-1]) - 1
        position += 1
    assert len(stack) == 1, "brackets match"
    return stack[0]


PINS = (Pin("a", "left", "electrical"), Pin("b", "right", "electrical"), Pin("strain", "bottom", "control"))
SHOWN = Divider(("a", "b"), "100", 0.0, 0.1)
EVIL = st.lists(
    st.sampled_from(
        ['"', "\\", ")", "(", '")', '(symbol "b"', "\n", "\r", "\\n", "\0", "\u2028", "${X}", "µ", "\ud800"]
    )
    | st.text(max_size=6),
    max_size=6,
).map("".join)


def shape(expression: object) -> object:
    """The structure without its quoted strings."""
    return (
        tuple(map(shape, expression)) if isinstance(expression, list) else isinstance(expression, tuple) or expression
    )


def strings(expression: object) -> list[str]:
    if isinstance(expression, list):
        return [text for part in expression for text in strings(part)]
    return [expression[0]] if isinstance(expression, tuple) else []


def cell(title: str, dialect: str) -> Cell:
    return Cell("piece", "ports", title, PINS, (), f"{dialect}/piece.lib", dialect)


PLAIN = parse(symbol_library([cell("T", "ngspice")] * 2, "D"))


@settings(max_examples=500, deadline=None)
@given(EVIL, EVIL)
def test_no_text_of_a_design_changes_a_symbol(title: str, design: str) -> None:
    text = symbol_library([cell(title, "ngspice")] * 2, design)
    text.encode("utf-8")
    found = parse(text)
    assert shape(found) == shape(PLAIN)
    told = one_line(f"{title}; design: {design}")
    assert strings(found) == [told if each == "T; design: D" else each for each in strings(PLAIN)]
    lines = asy(cell(title, "ltspice"))
    assert lines.isascii()
    own = [line for line in lines.split("\n") if not line.startswith("SYMATTR Description ")]
    assert own == [
        line for line in asy(cell("T", "ltspice")).split("\n") if not line.startswith("SYMATTR Description ")
    ]
    assert len(lines.splitlines()) == len(lines.split("\n")) - 1


@settings(max_examples=200, deadline=None)
@given(EVIL, EVIL)
def test_kiutils_reads_symbols_of_any_text(title: str, design: str) -> None:
    read = SymbolLib.from_sexpr(parse_sexp(symbol_library([cell(title, "ngspice")] * 2, design)))
    assert [each.entryName for each in read.symbols] == ["piece", "piece"]
    assert [len(pins(each)) for each in read.symbols] == [3, 3]
    assert all(fields(each)["Sim.Pins"] == "1=a 2=b 3=strain" for each in read.symbols)


def sheet(design: str) -> list[object]:
    files = example_project(cell("T", "ngspice"), design, "fabric.kicad_sym", SHOWN)
    return parse(files["fabric_example.kicad_sch"])


SHEET = shape(sheet("D"))


@settings(max_examples=200, deadline=None)
@given(EVIL)
def test_no_text_of_a_design_changes_the_example(design: str) -> None:
    found = sheet(design)
    assert shape(found) == SHEET
    assert one_line(f"{design}: a piece of fabric in a divider") in strings(found)


@given(st.integers(0, 9), st.integers(0, 9), st.integers(1, 5), st.integers(0, 40))
def test_no_two_pins_are_in_one_place(warp: int, weft: int, apart: int, letters: int) -> None:
    yarns = [(f"w{k}" + "x" * letters, side) for k in range(warp) for side in ("left", "right")]
    yarns += [(f"v{k}", side) for k in range(weft) for side in ("bottom", "top")]
    named = [Pin(f"{name}_{side}", side, "electrical") for name, side in yarns]
    named += [Pin(f"c{k}", "bottom", "control") for k in range(apart)]
    found = layout(replace(cell("T", "ngspice"), pins=tuple(named)))
    assert [place.pin for place in found.places] == named
    assert len({(place.x, place.y) for place in found.places}) == len(named)
    assert all(place.x in (-1, found.width + 1) or place.y in (-1, found.height + 1) for place in found.places)
    assert all(place.x < found.width for place in found.places if place.side == "bottom")
