"""The files of an exported library: what every reader of them stumbles over, and that all of them can be read."""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from gnucap import GNUCAP, needs_gnucap
from hypothesis import given, settings
from hypothesis import strategies as st
from library_cases import CARD, pins_of, study, with_both

from circuittex.electrical.network.names import safe_name
from circuittex.electrical.spice.ngspice import TROUBLE, Plot, find_ngspice, read_raw, run_deck
from circuittex.study.library.cell import DIALECTS, Cell, Pin
from circuittex.study.library.export import export_library
from circuittex.study.library.network import Network
from circuittex.study.library.subcircuit import library_text

pytestmark = pytest.mark.xdist_group("library_files")  # what its fixtures make serves one worker

SECONDS = 60
NUMBER = r"[0-9]+(?:\.[0-9]+)?(?:e[+-]?[0-9]+)?"
WORD = r"[a-z][a-z0-9_]*"
FORBIDDEN = {"gnd", "ground", "0", "temp", "temper", "time", "hertz"}
FUNCTIONS = {
    "ngspice": {"exp", "min", "max", "V"},
    "ltspice": {"exp", "min", "max", "if", "V"},
    "xyce": {"exp", "min", "max", "IF", "V"},
    "gnucap": {"exp", "min", "max", "if"},
}
"""Of the manuals: ngspice on `.param` and B sources, LTspice's help on B sources, Xyce's reference on expressions.
gnucap runs all of its own."""
SUFFIXES = {"m": "e-3", "u": "e-6", "n": "e-9", "p": "e-12"}
"""Of gnucap's numbers."""


@pytest.fixture(autouse=True)
def _nothing_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for what the module's fixtures export."""
    undrawn(monkeypatch)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("library")
    export_library(with_both(study()), folder, thin=0.02, members=[with_both(study()), with_both(study())])
    return folder


def files(library: Path) -> list[tuple[str, str]]:
    """Dialect and text of every file."""
    found = [(path.parent.name, path.read_bytes().decode("ascii")) for path in sorted(library.glob("*/*.lib"))]
    assert {dialect for dialect, _ in found} == set(DIALECTS)
    return found


def cards(text: str) -> list[str]:
    """All lines that are no comments."""
    return [line for line in text.splitlines() if not line.startswith("*")]


def test_library_json_lists_every_file(library: Path) -> None:
    listed = json.loads((library / "library.json").read_text("ascii"))
    assert {cell["file"] for cell in listed["cells"]} == {
        path.relative_to(library).as_posix() for path in library.glob("*/*.lib")
    }
    for cell in listed["cells"]:
        text = (library / cell["file"]).read_text("ascii")
        (card,) = CARD.findall(text)
        assert card[0] == cell["name"] == Path(cell["file"]).stem
        assert pins_of(text) == [pin["name"] for pin in cell["pins"]]
        assert cell["file"].startswith(f"{cell['dialect']}/")


def test_one_sub_circuit_on_one_line_and_nothing_outside(library: Path) -> None:
    for _, text in files(library):
        lines = cards(text)
        (card,) = CARD.findall(text)
        assert lines[0].startswith(".subckt ")
        assert lines[-1] == f".ends {card[0]}"
        assert sum(line.startswith(".subckt") for line in lines) == sum(line.startswith(".ends") for line in lines) == 1
        assert not any(line.startswith("+") for line in text.splitlines())


def test_pins_are_told_inside_the_sub_circuit(library: Path) -> None:
    for _, text in files(library):
        inside = text[text.index("\n.subckt") : text.index("\n.ends")]
        assert re.findall(r"^\* pin: (\S+) ", inside, re.MULTILINE) == pins_of(text)
        assert "* pin:" not in text[: text.index("\n.subckt")]


def test_files_are_ascii_with_line_feeds_and_end_with_one(library: Path) -> None:
    written = [path for path in library.rglob("*") if path.suffix in (".lib", ".cir")]
    assert len(written) > 50
    for path in written:
        data = path.read_bytes()
        assert data.isascii()
        assert b"\r" not in data
        assert data.endswith(b"\n")
        assert not data.endswith(b"\n\n")


def test_only_xyce_has_the_colon_at_which_readers_stop(library: Path) -> None:
    for dialect, text in files(library):
        (card,) = re.findall(r"^\.subckt .*", text, re.MULTILINE)
        if "=0" in card:
            assert (" PARAMS: st" in card) == (dialect == "xyce")
        assert (":" in card) == (dialect == "xyce" and "=0" in card)


def test_no_node_has_a_name_that_means_something_else(library: Path) -> None:
    """Ground's names, and the quantities of expressions; ground itself only under what drives and flags strain."""
    for _, text in files(library):
        for pin in pins_of(text):
            assert re.fullmatch(WORD, pin)
            assert pin not in FORBIDDEN
        for line in cards(text)[1:-1]:
            if line.startswith(".param"):
                continue
            name, a, b = line.split()[:3]
            assert a not in FORBIDDEN
            assert b not in FORBIDDEN - {"0"}
            strains = "strain|stretch_x|shear"
            assert b != "0" or re.match(rf"(R({strains})|B({strains})_used|Blog_[0-9]+|[BV]out_of_range)$", name), line


def test_a_terminal_called_like_a_quantity_gets_another_word() -> None:
    assert {safe_name(name) for name in ("time", "TEMP", "gnd", "0")} == {"n_time", "n_temp", "n_gnd", "n_0"}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_cards_are_those_of_the_manuals(library: Path, dialect: str) -> None:
    """R, V and B cards and `.param`, with values without suffixes and expressions of the dialect's own functions."""
    body = r"[A-Za-z0-9_.()<>?:+\-*/, ]+"
    brace = rf"\{{({body})\}}"
    source = brace if dialect == "xyce" else f"({body})"
    allowed = {
        "R": rf"R{WORD} {WORD} (?:{WORD}|0) (?:{NUMBER}|{brace})",
        "V": rf"V{WORD} {WORD} 0 {brace}",
        "B": rf"B{WORD} {WORD} (?:{WORD}|0) [VI]={source}",
        ".": rf"\.param {WORD}={brace}",
    }
    for own, text in files(library):
        if own != dialect:
            continue
        for line in cards(text)[1:-1]:
            match = re.fullmatch(allowed[line[0]], line)
            assert match, line[:200]
            assert dialect != "gnucap" or line[0] != "B"
            for expression in filter(None, match.groups()):
                assert set(re.findall(r"([A-Za-z]\w*)\(", expression)) <= FUNCTIONS[dialect]
                assert ("?" in expression) <= (dialect == "ngspice")
                assert expression.count("(") == expression.count(")")
                assert re.sub(NUMBER, "", expression).count("{") == 0


def test_dialects_say_the_same(library: Path) -> None:
    """The same pins, resistors and numbers in the same order, whatever stands around them."""
    numbers = {}
    for path in sorted(library.glob("*/*.lib")):
        text = path.read_text("ascii")
        numbers.setdefault(path.name, set()).add(tuple(re.findall(NUMBER, " ".join(cards(text)))))
    assert all(len(each) == 1 for each in numbers.values())


def test_the_content_has_its_hash(library: Path) -> None:
    for _, text in files(library):
        body = text[text.index("\n.subckt") + 1 :].rstrip("\n")
        (written,) = re.findall(r"^\* content: sha256 (\w+)$", text, re.MULTILINE)
        assert written == hashlib.sha256(body.encode("ascii")).hexdigest()


def test_names_are_the_same_for_another_state_and_study(library: Path, tmp_path: Path) -> None:
    other = with_both(study(3))
    export_library(other, tmp_path, state="shear-0.025", thin=0.02, members=[other])
    assert {p.relative_to(tmp_path) for p in tmp_path.glob("*/*.lib")} == {
        p.relative_to(library) for p in library.glob("*/*.lib")
    }


def test_ngspice_reads_every_file(library: Path) -> None:
    """All sub-circuits in one deck, each called once; ngspice complains of what it does not know."""
    lines = ["* every file"]
    for number, path in enumerate(sorted((library / "ngspice").glob("*.lib"))):
        pins = pins_of(path.read_text("ascii"))
        nodes = ["a", "0", *(f"n{number}_{k}" for k in range(len(pins) - 2))]
        lines += [f".include {path}", f"X{number} {' '.join(nodes)} {path.stem}"]
    plot = run_deck("\n".join([*lines, "V1 a 0 1", ".op", ".end"]) + "\n").plots[-1]
    assert plot.current("v1")[0] < 0.0


def test_a_file_may_be_included_twice(library: Path) -> None:
    path = library / "ngspice" / "fabric_unit.lib"
    deck = f"* twice\n.include {path}\n.include {path}\nX1 a b 0 c fabric_unit\nV1 a 0 1\n.op\n.end\n"
    assert run_deck(deck).plots[-1].current("v1")[0] < 0.0


def examples(library: Path, dialect: str) -> list[Path]:
    return sorted((library / "examples").glob(f"{dialect}_*.cir"))


def test_ngspice_runs_every_example(library: Path) -> None:
    decks = [*examples(library, "ngspice"), *sorted((library / "examples").glob("probe_*.cir"))]
    assert len(decks) > 20
    for deck in decks:
        done = subprocess.run(
            [str(find_ngspice()), "-n", "-b", deck.name],
            cwd=deck.parent,
            capture_output=True,
            text=True,
            timeout=SECONDS,
        )
        said = [line for line in (done.stdout + done.stderr).splitlines() if not line.startswith(("Circuit:", "* "))]
        assert done.returncode == 0
        assert not [line for line in said if TROUBLE.search(line)], deck.name
        assert deck.name.startswith("probe") or "i_stretched" in done.stdout or "v1#branch" in done.stdout


@cache
def own(library: Path, name: str) -> Plot:
    """What ngspice answers to an example in its own dialect."""
    text = (library / "examples" / name).read_text("ascii")
    return run_deck(text.replace("../", f"{library}/")).plots[-1]


@pytest.mark.parametrize("dialect", ["ltspice", "xyce"])
def test_ngspice_that_follows_ltspice_runs_the_examples_of_others(
    library: Path, dialect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ngspice's mode for LTspice and PSpice knows if(), braces in sources and PARAMS: as these do.

    Not the programs themselves, but no reader of ours either; the answers are those of the files for ngspice.
    """
    (tmp_path / ".spiceinit").write_text("set ngbehavior=ltpsa\n", encoding="ascii")
    monkeypatch.setenv("HOME", str(tmp_path))
    # One loading is like the other.
    decks = [deck for deck in examples(library, dialect) if not re.search(r"(?<!stretch_x)_shear", deck.name)]
    assert len(decks) > 15
    for deck in decks:
        raw = tmp_path / f"{deck.stem}.raw"
        command = [str(find_ngspice()), "-b", "-r", str(raw), deck.name]
        done = subprocess.run(command, cwd=deck.parent, capture_output=True, text=True, timeout=SECONDS)
        assert "Compatibility modes selected: ps lt" in done.stdout + done.stderr
        found, wanted = read_raw(raw)[-1], own(library, deck.name.replace(dialect, "ngspice"))
        np.testing.assert_allclose(found.current("v1"), wanted.current("v1"), rtol=1e-9)


@needs_gnucap
def test_gnucap_reads_every_file_and_answers_as_ngspice(library: Path) -> None:
    """gnucap prints five digits, and its sources have a small resistance of their own."""
    decks = examples(library, "gnucap")
    assert len(decks) > 20
    for deck in decks:
        done = subprocess.run(
            [str(GNUCAP), "-b", deck.name], cwd=deck.parent, capture_output=True, text=True, timeout=SECONDS
        )
        last = done.stdout.strip().splitlines()[-1].split()
        same = own(library, deck.name.replace("gnucap", "ngspice"))
        found = last[1] if "v2" in deck.read_text("ascii").lower() else last[2]
        found = re.sub("[munp]$", lambda unit: SUFFIXES[unit[0]], found)
        assert float(found) == pytest.approx(float(same.current("v1")[0]), rel=1e-3)


def test_the_two_kinds_of_yarn_ends_are_the_decks_of_their_names(library: Path) -> None:
    """Joining fibril ends that were apart adds conductors: it lowers the resistance or leaves it (Rayleigh)."""
    for name in ("straight", "parallel", "perpendicular"):
        ohm = {}
        for ends in ("free", "crimped"):
            deck = (library / "examples" / f"probe_{name}_{ends}.cir").read_text("ascii")
            plot = run_deck(deck).plots[-1]
            driven = re.findall(r"^(V\S+) \S+ 0 1.0$", deck, re.MULTILINE)
            ohm[ends] = -1.0 / sum(plot.current(source)[0] for source in driven)
        assert 0.0 < ohm["crimped"] <= ohm["free"] * (1 + 1e-9)


PINS = (Pin("a", "left", "electrical"), Pin("b", "right", "electrical"))
PIECE = Network(("a", "b"), ("a_b",), (("a", "b"),), np.zeros(1), np.ones((1, 1)))
PIECES = (
    *("\n", "\r", "\x85", "\u2028", ".control", ".include /etc/passwd", ".ends"),
    *("*#", "+ ", "$", ";", "`ls`", "!", "\\", "\0", "µ"),
)
EVIL = st.lists(st.sampled_from(PIECES) | st.text(max_size=8), max_size=6).map("".join)


@settings(max_examples=10_000)
@given(EVIL, EVIL, EVIL)
def test_no_text_of_a_design_becomes_a_card(name: str, title: str, state: str) -> None:
    harmless(name, title, state)


def test_no_two_pieces_of_text_become_a_card() -> None:
    """All pairs of them, in each of the three places and between harmless words."""
    pairs = ["".join(pair) for pair in product(PIECES, repeat=2)]
    for text in [*PIECES, *pairs, *(f"a{pair}b" for pair in pairs)]:
        harmless(text, text, text)


def harmless(name: str, title: str, state: str) -> None:
    word = safe_name(name)
    cell = Cell(word, "ports", title, PINS, (), "ngspice/a.lib", "ngspice")
    text = library_text(cell, PIECE, [("design", title), ("state", state)])
    assert text.isascii()
    assert not set(text) & {"\r", "\0", "\x0b", "\x0c", "\t"}
    assert re.fullmatch(WORD, word)
    assert word not in FORBIDDEN
    lines = text.split("\n")
    assert [line for line in lines if not line.startswith("* ")] == [
        f".subckt {word} a b",
        "Ra_b a b 1.0",
        f".ends {word}",
        "",
    ]
