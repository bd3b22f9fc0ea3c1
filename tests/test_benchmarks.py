"""The benchmarks on tiny cases, so that they cannot rot; what they measure is not judged here."""

from __future__ import annotations

import importlib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from circuittex.circuit import reduced_circuit
from circuittex.design import Design, plain_weave

FOLDER = Path(__file__).parents[1] / "benchmarks"
SCRIPTS = ["assembly", "compile", "mesh_study", "netlist", "network", "newton", "paper_tables"]
ROUND_OFF = 1e-12
"""Relative difference of two routes to the same numbers, summed in different orders."""


@pytest.fixture(autouse=True)
def _scripts_find_their_helpers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(FOLDER))


def script(name: str) -> ModuleType:
    return importlib.import_module(name)


def tiny() -> Design:
    """One crossing of the paper's yarns: 20 fibrils of eight elements."""
    design = plain_weave(yarns=1)
    return replace(design, numerics=replace(design.numerics, elements=8, section_degree=6))


@pytest.mark.parametrize("name", SCRIPTS)
def test_script_explains_itself(name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.argv", [name, "--help"])
    with pytest.raises(SystemExit, match="0"):
        script(name).main()
    assert f"python benchmarks/{name}.py" in capsys.readouterr().out


def test_every_script_is_known_here() -> None:
    helpers = {"measure", "woven"}
    assert {path.stem for path in FOLDER.glob("*.py")} == {*SCRIPTS, *helpers}


def test_ratio_is_that_of_neighbours() -> None:
    """A machine that slows down meanwhile does not change it; the quotient of the medians would be 1."""
    assert script("measure").ratio(np.array([2.0, 20.0, 20.0]), np.array([1.0, 10.0, 100.0])) == 2.0


def test_pieces_run_in_turn_after_a_warm_up() -> None:
    calls: list[str] = []
    seconds = script("measure").paired({name: lambda name=name: calls.append(name) for name in "ab"}, 2)
    assert "".join(calls) == "ababab"
    assert seconds["a"].shape == (2,)
    assert np.all(seconds["b"] > 0)


def test_table() -> None:
    assert script("measure").markdown(["a", "b"], [["x", 0.123456]]).split("\n") == [
        "| a | b |",
        "|---|---|",
        "| x | 0.123 |",
    ]


def test_assembly_agrees_with_the_form() -> None:
    assembly = script("assembly")
    design = tiny()
    row = assembly.compare(replace(design, numerics=replace(design.numerics, elements=3, order=1)), 1)
    assert len(row) == len(assembly.HEAD)
    assert row[:2] == [1, 60]
    assert row[-1] < ROUND_OFF


def test_netlist_against_pyspice_up_to_its_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    netlist = script("netlist")
    row = netlist.compare(script("woven").woven_circuit(1, 1.0), 1)
    assert len(row) == len(netlist.HEAD)
    assert all(value > 0 for value in row)
    monkeypatch.setattr(netlist, "LARGEST", 10)
    assert netlist.compare(reduced_circuit((2, 2), 1.0, 1.0), 1).count("-") == 2


def test_ready_words_are_the_cards_of_the_deck() -> None:
    circuit = reduced_circuit((2, 2), 1.0, 1.0)
    cards = script("netlist").ready_words(circuit)().split("\n")
    text = script("netlist").deck(circuit, {"warp1_minus": 1.0, "warp1_plus": 0.0}).split("\n")
    assert cards == [line for line in text if line.startswith("R")]


def test_network_agrees_with_ngspice() -> None:
    network = script("network")
    row = network.compare(script("woven").woven_circuit(1, 4.0), 1)
    assert len(row) == len(network.HEAD)
    assert row[-1] < ROUND_OFF


def test_first_run_compiles_and_the_second_does_not() -> None:
    code = "import numpy as np\nfrom circuittex.mech.pattern import build_pattern as b\nb(2, np.array([[0, 1]]), "
    first, second, kernels = script("compile").first_and_second(code + "np.empty((0, 2), dtype=np.int64))")
    assert kernels == 1
    assert min(first, second) > 0


def test_small_study_is_sound() -> None:
    compile(script("compile").SMALL_STUDY, "study", "exec")


def test_newton_reports_every_part_and_solver() -> None:
    newton = script("newton")
    head, title, parts, _, solvers = newton.report(tiny(), iterations=2, repeats=1)
    assert "contact points" in head
    assert title.startswith("2 iterations")
    for part in (newton.CLOSEST, newton.ENERGY, newton.BEAM, newton.CONTACT, newton.SOLVE):
        assert part in parts
    names = [line.split("|")[1].strip() for line in solvers.split("\n")[2:]]
    assert names == [solver.name for solver in newton.installed()]


def test_stopwatch_misses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a clock that ticks once a look, an iteration's parts and its rest fill the time between two reports."""
    newton = script("newton")
    ticks = iter(map(float, range(100)))
    monkeypatch.setattr(newton.time, "perf_counter", lambda: next(ticks))
    watch = newton.Stopwatch()
    watch.report(0, 1.0)  # looks at 0
    watch.add(newton.BEAM, newton.time.perf_counter())  # from 1 to 2
    watch.report(1, 0.5)  # looks at 3
    assert watch.per_iteration(newton.BEAM).tolist() == [1.0]
    assert watch.per_iteration(*newton.PARTS).tolist() == [3.0]


def test_finer_mesh_starts_on_the_coarse_state() -> None:
    """Every node of the finer mesh finds its place on its fibril, and the clamped ends are where they were."""
    newton = script("newton")
    design = tiny()
    fine = newton.coarse_state(design, newton.installed()[0]())
    mesh = newton.build_mesh(design)
    start = newton.initial_configuration(mesh)
    ends = np.concatenate([mesh.end_nodes(-1), mesh.end_nodes(+1)])
    assert fine.x.shape == start.x.shape
    np.testing.assert_allclose(fine.r[ends], start.r[ends], atol=1e-12)
    step = np.linalg.norm(np.diff(fine.r.reshape(mesh.n_fibrils, -1, 3), axis=1), axis=2)
    assert step.max() < 1.5 * step.min()  # evenly spaced but for the strain: no node is in another's place
