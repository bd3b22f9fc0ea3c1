"""The kit for other simulators: they agree with what it expects, in every form, and a digit that differs is found."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from gnucap import needs_gnucap
from scipy.io import mmread
from scipy.sparse.linalg import spsolve
from synthetic_study import synthetic_study

from circuittex.base.errors import CircuitError
from circuittex.electrical.spice.ngspice import find_ngspice
from circuittex.netlist import read_deck, to_pyspice
from circuittex.study.kit import FILES, small_circuit, write_kit

pytestmark = pytest.mark.xdist_group("kit")  # what its fixtures make serves one worker

CIRCUITS = ("small", "medium", "cell")


@pytest.fixture(scope="module")
def kit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_kit(synthetic_study(), tmp_path_factory.mktemp("kit") / "kit")


def run_compare(kit: Path, circuit: str, answer: Path, *options: str) -> tuple[int, str]:
    """The runner in a bare process, as a user calls it, without any package."""
    command = [sys.executable, "-I", "-S", "compare.py", f"{circuit}/expected.csv", str(answer), *options]
    done = subprocess.run(command, cwd=kit, capture_output=True, text=True, timeout=60)
    assert done.stderr == ""
    return done.returncode, done.stdout


def expected(kit: Path, circuit: str) -> dict[str, float]:
    with (kit / circuit / "expected.csv").open(encoding="ascii") as file:
        return {row["name"]: float(row["value"]) for row in csv.DictReader(file)}


def simulated(kit: Path, circuit: str, answer: Path, filetype: str) -> None:
    """Run ngspice on a deck of the kit."""
    script = f"* run\n.control\nset filetype={filetype}\nset numdgt=15\nsource {kit}/{circuit}/deck.cir\nop\n"
    answer.with_suffix(".cir").write_text(f"{script}write {answer}\nquit\n.endc\n.end\n", encoding="ascii")
    command = [str(find_ngspice()), "-n", "-b", str(answer.with_suffix(".cir"))]
    subprocess.run(command, capture_output=True, timeout=60)


def test_what_is_in_it(kit: Path) -> None:
    found = sorted(path.relative_to(kit).as_posix() for path in kit.rglob("*") if path.is_file())
    assert found == sorted(["README.txt", "compare.py", *(f"{c}/{name}" for c in CIRCUITS for name in FILES)])


@pytest.mark.parametrize("circuit", CIRCUITS)
@pytest.mark.parametrize("filetype", ["binary", "ascii"])
def test_ngspice_agrees(kit: Path, circuit: str, filetype: str, tmp_path: Path) -> None:
    answer = tmp_path / "answer.raw"
    simulated(kit, circuit, answer, filetype)
    status, said = run_compare(kit, circuit, answer)
    assert (status, said) == (0, f"all {len(expected(kit, circuit))} values agree within 1e-09\n")


def test_pyspice_agrees(kit: Path, tmp_path: Path) -> None:
    simulation = to_pyspice(small_circuit(), {"warp1_minus": 1.0, "weft2_plus": 0.0}).simulator().operating_point()
    rows = [f"{name},{float(value[0])!r}" for name, value in simulation.nodes.items()]
    rows += [f"{name}#branch,{float(value[0])!r}" for name, value in simulation.branches.items()]
    (tmp_path / "answer.csv").write_text("\n".join(rows), encoding="ascii")
    assert run_compare(kit, "small", tmp_path / "answer.csv")[0] == 0


@pytest.mark.parametrize("circuit", CIRCUITS)
def test_scipy_agrees_from_the_matrix_alone(kit: Path, circuit: str, tmp_path: Path) -> None:
    """Three files, SciPy and nothing of ours."""
    folder = kit / circuit
    names = (folder / "unknowns.txt").read_text(encoding="ascii").split()
    volts = spsolve(mmread(folder / "matrix.mtx").tocsc(), np.asarray(mmread(folder / "right_hand_side.mtx"))[:, 0])
    table = "".join(f"{name} {value!r}\n" for name, value in zip(names, volts.tolist(), strict=True))
    (tmp_path / "answer.txt").write_text(table, encoding="ascii")
    assert run_compare(kit, circuit, tmp_path / "answer.txt", "--partial")[0] == 0


@pytest.mark.parametrize("circuit", CIRCUITS)
def test_networkx_reads_the_graph_whose_nodes_obey_kirchhoff(kit: Path, circuit: str) -> None:
    data = json.loads((kit / circuit / "graph.json").read_text(encoding="ascii"))
    named = "edges" if "edges" in nx.node_link_graph.__kwdefaults__ else "link"
    graph = nx.node_link_graph(data, **{named: "links"})
    values = expected(kit, circuit)
    for node, held in graph.nodes(data="volts"):
        ohms = [(other, ohm) for _, other, ohm in graph.edges(node, data="resistance")]
        out = sum((values[f"v({node})"] - values[f"v({other})"]) / ohm for other, ohm in ohms)
        rounding = 4.0 * np.finfo(float).eps * sum(1.0 / ohm for _, ohm in ohms)  # of voltages of at most 1 V
        if held is None:
            assert abs(out) <= rounding
        else:
            assert values[f"v({node})"] == held
            assert abs(out + values[f"i(v{node})"]) <= rounding + 1e-12 * abs(out)


@needs_gnucap
@pytest.mark.parametrize(("circuit", "count"), [("small", 18), ("medium", 40), ("cell", 40)])
def test_gnucap_agrees(kit: Path, circuit: str, count: int, tmp_path: Path) -> None:
    """As the kit's README says; inner resistances of its sources, and what rounding makes of them, leave six digits."""
    (edit,) = re.findall(r'sed "s/([^/]*)/([^/]*)/"', (kit / "README.txt").read_text(encoding="ascii"))
    deck = (kit / circuit / "deck.cir").read_text(encoding="ascii").replace(*edit)
    (tmp_path / "gnucap.cir").write_text(deck, encoding="ascii")
    done = subprocess.run(["gnucap", "-b", "gnucap.cir"], cwd=tmp_path, capture_output=True, timeout=60)
    (tmp_path / "answer.txt").write_bytes(done.stdout)
    status, said = run_compare(kit, circuit, tmp_path / "answer.txt", "--tolerance", "1e-6", "--partial")
    assert (status, said) == (0, f"all {count} values agree within 1e-06\n")


def test_our_reader_finds_the_same_circuit(kit: Path) -> None:
    found = read_deck(kit / "cell" / "deck.cir").circuit
    data = json.loads((kit / "cell" / "graph.json").read_text(encoding="ascii"))
    assert found.resistance.tolist() == [link["resistance"] for link in data["links"]]


# the runner


def table(kit: Path, circuit: str, path: Path, changes: dict[str, float]) -> Path:
    values = expected(kit, circuit) | changes
    path.write_text("name,value\n" + "".join(f"{n},{v!r}\n" for n, v in values.items()), encoding="ascii")
    return path


@pytest.mark.parametrize("circuit", CIRCUITS)
def test_a_change_in_the_ninth_digit_is_found(kit: Path, circuit: str, tmp_path: Path) -> None:
    values = expected(kit, circuit)
    for name in list(values)[:: max(1, len(values) // 10)]:
        if abs(values[name]) < 1e-3 * max(map(abs, values.values())):
            continue  # almost zero, where rounding takes the ninth digit
        changed = values[name] * (1.0 + 5e-9)
        status, said = run_compare(kit, circuit, table(kit, circuit, tmp_path / "a.csv", {name: changed}))
        assert status == 1
        assert said.splitlines()[0] == f"departs first at {name}: expected {values[name]!r}, found {changed!r}"
    assert run_compare(kit, circuit, table(kit, circuit, tmp_path / "a.csv", {}))[0] == 0


def test_the_first_of_several_departures(kit: Path, tmp_path: Path) -> None:
    names = list(expected(kit, "small"))
    answer = table(kit, "small", tmp_path / "a.csv", {names[12]: float("nan"), names[5]: 7.0})
    status, said = run_compare(kit, "small", answer)
    assert (status, said.splitlines()[0].split(":")[0]) == (1, f"departs first at {names[5]}")
    assert said.splitlines()[1] == f"2 of {len(names)} values depart"


def test_a_value_that_is_missing(kit: Path, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("warp1_minus 1.0\n", encoding="ascii")
    status, said = run_compare(kit, "small", tmp_path / "a.txt")
    assert (status, "v(warp1_plus): expected 0.709" in said, "found nothing" in said) == (1, True, True)
    assert run_compare(kit, "small", tmp_path / "a.txt", "--partial") == (0, "all 1 values agree within 1e-09\n")


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "none of the expected names"),
        (b"other 1.0\n", "none of the expected names"),
        (b"Flags: complex\nNo. Variables: 1\nVariables:\n0 v(a) voltage\nBinary:\n" + bytes(16), "real values"),
        (b"Flags: real\nNo. Variables: 1\nVariables:\n0 v(a) voltage\nBinary:\n" + bytes(7), "cut short"),
        (b"Flags: real\nNo. Variables: 1\nVariables:\n0 v(a) voltage\nValues:\n 0\n", "cut short"),
    ],
)
def test_an_answer_that_is_none(kit: Path, data: bytes, says: str, tmp_path: Path) -> None:
    (tmp_path / "a.raw").write_bytes(data)
    status, said = run_compare(kit, "small", tmp_path / "a.raw", "--partial")
    assert (status, said.startswith("cannot be read: "), says in said) == (2, True, True)


# what is refused, and whose words


def test_a_state_of_its_own(tmp_path: Path) -> None:
    study = synthetic_study()
    write_kit(study, tmp_path / "a", state=study.records[2].name)
    assert json.dumps(study.records[2].name) in (tmp_path / "a" / "README.txt").read_text(encoding="ascii")
    with pytest.raises(CircuitError, match=r"state 'other' does not exist; the study has relaxed, stretch-0.0250"):
        write_kit(study, tmp_path / "b", state="other")
    assert not (tmp_path / "b").exists()


@pytest.mark.parametrize(
    "text", ["a\n.control\nshell x\n.endc", "b\r.include /etc/passwd", "c\u2028R1 a b 1", '"; {x}']
)
def test_no_text_of_a_design_becomes_a_card(text: str, kit: Path, tmp_path: Path) -> None:
    """The deck of a design with a hostile name has the cards of that with a harmless one."""
    study = synthetic_study()
    hostile = replace(study.design, name="harmless")
    object.__setattr__(hostile, "name", text)  # what a design itself refuses must do no harm either
    write_kit(replace(study, design=hostile), tmp_path)

    def cards(folder: Path) -> list[str]:
        lines = re.split(r"[\n\r\u2028]", (folder / "cell" / "deck.cir").read_text(encoding="ascii"))
        return [line for line in lines if not line.startswith("*")]

    assert cards(tmp_path) == cards(kit)
    assert json.dumps(text) in (tmp_path / "README.txt").read_text(encoding="ascii")
