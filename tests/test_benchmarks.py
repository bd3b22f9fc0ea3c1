"""The benchmarks on tiny cases, so that they cannot rot; what they measure is not judged here."""

from __future__ import annotations

import importlib
import json
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import library_cases as cases
import numpy as np
import pytest
import scipy.sparse as sp

from circuittex.design import Design, design_hash, plain_weave, uniaxial
from circuittex.electrical.network.circuit import reduced_circuit

FOLDER = Path(__file__).parents[1] / "benchmarks"
SCRIPTS = [
    "algorithm1",
    "assembly",
    "cholesky",
    "compile",
    "dolfinx_beam",
    "estimate",
    "invariance",
    "kills",
    "library",
    "mesh_study",
    "netlist",
    "network",
    "newton",
    "panel",
    "paper_tables",
    "parts",
    "scaling",
    "size",
    "starts",
    "table",
]
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
    helpers = {"dolfinx_worker", "measure", "stages_worker", "watch", "woven"}
    assert {path.stem for path in FOLDER.glob("*.py")} == {*SCRIPTS, *helpers}


def test_ratio_is_that_of_neighbours() -> None:
    """A machine that slows down meanwhile does not change it; the quotient of the medians would be 1."""
    assert script("measure").ratio(np.array([2.0, 20.0, 20.0]), np.array([1.0, 10.0, 100.0])) == 2.0


def test_pieces_run_in_turn_after_a_warm_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a clock that ticks once a look, each piece takes the one tick between the looks before and after it."""
    calls: list[str] = []
    ticks = iter(map(float, range(100)))
    monkeypatch.setattr(script("measure").time, "perf_counter", lambda: next(ticks))
    seconds = script("measure").paired({name: lambda name=name: calls.append(name) for name in "ab"}, 2)
    assert "".join(calls) == "ababab"
    assert {name: times.tolist() for name, times in seconds.items()} == {"a": [1.0, 1.0], "b": [1.0, 1.0]}


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


def test_every_method_solves_the_same_panel(monkeypatch: pytest.MonkeyPatch) -> None:
    panel = script("panel")
    results = [panel.case(8, electrodes, 3.0, "SuperLU") for electrodes in (2, 8)]
    assert all(result["residual"] < 1e-10 for result in results)
    assert results[0]["resistors"] == 8 * 9 + 8 * 7 + 8 * 8 - 6 - 3  # the cut crosses six warp and three weft yarns
    monkeypatch.setattr(panel, "METHODS", ("SuperLU",))
    (row,) = panel.rows(8, 2, 3.0, 1000)
    assert len(row) == len(panel.HEAD)


def test_both_factorisations_solve_the_same_panel() -> None:
    cholesky = script("cholesky")
    matrix = cholesky.of_panel(6)
    row = cholesky.compare("panel", matrix)
    assert len(row) == len(cholesky.HEAD)
    assert row[1:3] == [72, 2 * 6 * 5 + 36]
    # A backward stable solution leaves n eps |A| |x| at most, whatever BLAS adds in which order.
    A = matrix.toarray()
    x = np.linalg.solve(A, np.random.default_rng(0).normal(size=72))
    assert max(row[-2:]) < 72 * np.finfo(float).eps * float((np.abs(A) @ np.abs(x)).max())


def test_netlist_against_pyspice_up_to_its_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    netlist = script("netlist")
    circuit = script("woven").woven_circuit(1, 1.0)
    row = netlist.compare(circuit, 1)
    assert len(row) == len(netlist.HEAD)
    assert row[0] == circuit.n_resistors
    assert "-" not in row
    monkeypatch.setattr(netlist, "LARGEST", 10)
    assert netlist.compare(reduced_circuit((2, 2), 1.0, 1.0), 1).count("-") == 2


def test_library_measures_every_level() -> None:
    library = script("library")
    study = cases.study(2)
    assert [row[0] for row in library.errors(study).rows] == ["cell"], "two states leave nothing to interpolate"
    ((state, difference),) = library.difference(study, 1).rows
    assert state == "relaxed"
    assert difference < 1e-9
    rows = library.transients(study).rows
    assert len(rows) == 4 + 2 * 2 * 4, "four fixed levels, and two loadings of four with strain as parameter and as pin"
    assert rows[0][0] == "fabric_detailed"


def test_library_gives_every_conductivity_of_contacts_its_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    """A made-up state whose contacts lie on the fibrils as a search finds them is not needed: they are scaled."""
    library = script("library")
    study = cases.study(2)
    monkeypatch.setattr(library, "CONTACTS", (1.0, 1e3))
    monkeypatch.setattr(library, "contacts_of", lambda design, mesh, configuration: study.records[0].contacts)
    rows = library.contacts(study).rows
    assert {row[0] for row in rows} == {"1e+00", "1e+03"}
    ports = [row for row in rows if row[1] == "ports"]
    assert all(row[2] < 1e-6 for row in ports), "in %, an exact reduction against a sparse LU"
    assert [row[-1] for row in rows].count("recommended") == 2


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
    # Raises where the second run leaves more kernels than the first.
    _, _, kernels = script("compile").first_and_second(code + "np.empty((0, 2), dtype=np.int64))")
    assert kernels == 1


def test_small_study_is_sound() -> None:
    compile(script("compile").SMALL_STUDY, "study", "exec")


def test_newton_reports_every_part_and_solver() -> None:
    newton = script("newton")
    parts, solvers = newton.report(tiny(), iterations=2, repeats=1)
    assert parts.title.startswith("2 iterations")
    assert "contact points" in parts.title
    assert {newton.CLOSEST, newton.ENERGY, newton.BEAM, newton.CONTACT, newton.SOLVE} < {row[0] for row in parts.rows}
    assert [row[0] for row in solvers.rows] == [solver.name for solver in newton.installed()]


def test_stopwatch_misses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a clock that ticks once a look, an iteration's parts and its rest fill the time between two reports."""
    module = script("watch")
    ticks = iter(map(float, range(100)))
    monkeypatch.setattr(module.time, "perf_counter", lambda: next(ticks))
    watch = module.Stopwatch()
    watch.report(0, 1.0)  # looks at 0
    watch.add(module.BEAM, module.time.perf_counter())  # from 1 to 2
    watch.report(1, 0.5)  # looks at 3
    assert watch.per_iteration(module.BEAM).tolist() == [1.0]
    assert watch.per_iteration(*module.PARTS).tolist() == [3.0]


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


def test_results_are_kept_with_their_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    measure, kept = script("measure"), tmp_path / "new" / "kept.json"
    monkeypatch.setattr("sys.argv", ["/somewhere/speed.py", "--repeats", "2", "--json", str(kept), "--size", "4"])
    parser = measure.arguments("What it costs.")
    parser.add_argument("--repeats")
    parser.add_argument("--size")
    measure.publish(parser.parse_args(), [measure.Table("Costs:", ["a", "b"], [["x", np.float64(0.5)], ["y", 2]])])
    result = json.loads(kept.read_text())
    assert result["command"] == "python benchmarks/speed.py --repeats 2 --size 4"
    assert result["tables"] == [{"title": "Costs:", "head": ["a", "b"], "rows": [["x", 0.5], ["y", 2]]}]
    assert result["machine"] == measure.machine()


def test_page_gets_the_tables_for_which_there_are_results(tmp_path: Path) -> None:
    result = {"command": "python x", "date": "today", "machine": "here", "tables": []}
    table = {"title": "Costs:", "head": ["a"], "rows": [[0.123456]]}
    (tmp_path / "one.json").write_text(json.dumps({**result, "tables": [table]}))
    page = "# Title\n\n<!-- one -->\nold\n<!-- end one -->\n\ntext\n\n<!-- two -->\nkept\n<!-- end two -->\n"
    new = script("table").rewritten(page, tmp_path)
    one = "<!-- one -->\n\n`python x`, today, here.\n\nCosts:\n\n| a |\n|---|\n| 0.123 |\n\n<!-- end one -->"
    assert new == page.replace("<!-- one -->\nold\n<!-- end one -->", one)
    assert script("table").rewritten(new, tmp_path) == new


def test_every_section_of_the_page_is_a_benchmark_with_results() -> None:
    table = script("table")
    sections = [match["name"] for match in table.SECTION.finditer(table.PAGE.read_text())]
    assert sorted(sections) == sorted(path.stem for path in table.MEASURED.glob("*.json"))
    assert table.rewritten(table.PAGE.read_text(), table.MEASURED) == table.PAGE.read_text()


def test_size_measures_both_ways_and_compares_sizes() -> None:
    size = script("size")
    found = [size.measured(way, 1, 3, 4) for way in size.WAYS[:2]]
    assert [result["cheap"] > 0 for result in found] == [False, True]
    assert size.measured("tiled", 4, 3, 2)["way"] == "tiled"
    table = size.table(
        [found[1], {**found[1], "unknowns": 2 * found[1]["unknowns"], "seconds": 2 * found[1]["seconds"]}]
    )
    assert len(table.rows[0]) == len(size.HEAD)
    assert table.rows[1][-2] == pytest.approx(1.0)
    several = [{**found[0], "yarns": 2, "filaments": n, "unknowns": 100 * n} for n in (10, 34, 100)]
    assert [len(axes.lines) for axes in size.growth(several).axes] == [2, 2]
    slender = size.cell(1, 34, 5)
    assert slender.weave.warp[0].n_fibrils == 34
    assert 34 * slender.weave.warp[0].radius ** 2 == pytest.approx(10 * 0.15**2)


def test_starts_measures_each(monkeypatch: pytest.MonkeyPatch) -> None:
    starts = script("starts")
    found = [starts.measured("plain", start, yarns, 3, 2) for start, yarns in (("initial", 2), ("tiled", 4))]
    assert [result["start"] for result in found] == ["initial", "tiled, from 2 x 2"]
    assert len(starts.table("plain", found).rows[0]) == len(starts.HEAD)
    assert {len(row) for row in starts.woven("twill", 4, 3, 4).weave.draft} == {4}
    monkeypatch.setattr(starts, "CHANGES", {"modulus": (1.1,), "radius": (1.1,), "penalty": (1.1,)})
    table = starts.similar(1, 3, 8)
    assert [row[:2] for row in table.rows[:2]] == [["1.1 x modulus", "initial"], ["1.1 x modulus", "state"]]
    assert all(len(row) == len(table.head) for row in table.rows)


def test_every_part_is_a_change_of_the_papers_cell() -> None:
    parts, cell = script("parts"), script("stages_worker").cell()
    found = {name: design_hash(change(cell)) for name, change in parts.PARTS.items()}
    assert len({design_hash(cell), *found.values()}) == len(found) + 1
    assert set(parts.MECHANICAL) < set(found)


def test_every_stage_runs_on_a_part_of_its_own_or_on_the_states_of_another() -> None:
    worker = script("stages_worker")
    design = replace(tiny(), loading=(uniaxial("stretch", (0.025,)),))
    case = worker.Case(design)
    seconds, iterations = worker.timed(case[worker.RELAXATION])
    assert seconds > 0.0
    assert iterations == case.relaxed.iterations > 0
    for stage in worker.STAGES[1:]:
        worker.timed(case[stage])
    other = worker.Case(script("parts").law("holm")(design), case)
    holm, paper = (each[worker.CONTACTS]().conductance.sum() for each in (other, case))
    assert other.relaxed is None, "its mechanics are those of the other"
    assert holm > paper, "spots without a film"


def test_costs_of_parts_are_ratios_within_a_round() -> None:
    """A machine that is twice as slow in the second round changes no ratio."""
    parts, calls = script("parts"), list[tuple[str, str]]()

    def ask(part: str, stage: str) -> tuple[float, int]:
        calls.append((part, stage))
        slow = 2.0 ** (calls.count((part, stage)) - 1)
        return slow * (1.0 if part == "off" else 1.5), 7

    (off, on) = parts.mechanics(ask, ["one"], 2, 3).rows
    assert on == ["one", 7, pytest.approx(2.25), 1.5, 7, pytest.approx(2.25), 1.5, 1.5]
    assert off[3] == off[6] == off[7] == 1.0
    assert [part for part, stage in calls if stage == parts.STEP] == ["off", "one"] * 2
    assert parts.recording(ask, ["two"], 2, 2).rows[1][2::2] == [1.5, 1.5]
    table = parts.off(lambda *_: (2.0, 3), lambda *_: (3.0, 3), 1, 1, "0123abc", 1)
    assert table.rows[-1][2:5] == [2.0 * 42, 3.0 * 42, 1.5]
    assert {row[4] for row in table.rows} == {1.5}
    assert "0123abc" in table.title


def test_a_process_for_stages_starts_and_ends() -> None:
    with script("parts").Worker() as worker:
        assert worker.process.poll() is None
    assert worker.process.returncode == 0


def test_scaling_measures_a_size_and_compares_two() -> None:
    scaling = script("scaling")
    small = scaling.measured(1, per_crossing=4, iterations=2)
    assert (small["fibrils"], small["elements"], small["iterations"]) == (20, 80, 2)
    assert sum(small["shares"].values()) == pytest.approx(100)
    assert small["memory"] > 50  # MB: Python with NumPy and SciPy alone
    large = {**small, "yarns": 2, "elements": 8 * 80, "seconds": 64 * small["seconds"], "residual": 1e-7}
    costs, shares = scaling.tables([small, large])
    assert len(costs.rows[0]) == len(scaling.HEAD)
    assert costs.rows[0][-3:] == ["", "", ""]
    assert costs.rows[1][-3:] == pytest.approx([2, 0, 0])
    assert shares.head == ["part", "1 x 1", "2 x 2"]
    costs, _ = scaling.tables([small, {**large, "residual": 1e-3}])  # cut short: its seconds compare with nothing
    assert costs.rows[1][-3] == ""


def test_estimate_measures_a_study_beside_its_words(monkeypatch: pytest.MonkeyPatch) -> None:
    estimate = script("estimate")
    result = estimate.measured(replace(tiny(), probes=(), terminals=()), workers=1)
    assert (result["words"], result["states"]) == ("under a minute", 1)
    assert 0 <= result["before"] < result["seconds"] < result["all"]
    assert result["memory"] > 0.05  # GB: Python with NumPy and SciPy alone
    table = estimate.table([result])
    assert len(table.rows[0]) == len(estimate.HEAD)
    assert len(estimate.weave(2, 3).loading) == 2


def test_algorithm_1_comes_to_rest_in_the_equilibrium() -> None:
    """Backward Euler step by step and the relaxation are two ways to one minimum of the potential."""
    algorithm1 = script("algorithm1")
    mesh, design = algorithm1.small_cell()
    (cells, seconds, sign), *others = algorithm1.marched(mesh, design, dt=1e-3, steps=500)
    assert (cells[0], sign, others) == ("Algorithm 1", "", [])
    assert seconds > 0
    assert cells[4] <= design.numerics.force_tolerance
    assert cells[5] == pytest.approx(algorithm1.relax(mesh, design).energy, rel=1e-5)


def test_algorithm_1_cut_short_gives_a_bound_and_an_estimate() -> None:
    algorithm1 = script("algorithm1")
    (bound, seconds, more), (estimate, longer, about) = algorithm1.marched(*algorithm1.small_cell(), dt=1e-4, steps=30)
    assert (bound[2], more, about) == ("> 30", "> ", "~ ")
    assert int(estimate[2].removeprefix("~ ")) > 30
    assert longer > seconds


def test_steps_needed_follow_the_decay() -> None:
    algorithm1 = script("algorithm1")
    assert algorithm1.steps_needed(10.0 ** -np.arange(5), 1e-7) == 8
    assert algorithm1.steps_needed(np.array([1.0, 2.0]), 1e-7) is None


def test_answers_of_dolfinx_are_compared_in_its_own_numbering() -> None:
    dolfinx_beam = script("dolfinx_beam")
    design = plain_weave(yarns=1, rows=(1,))
    ours = dolfinx_beam.Ours(replace(design, numerics=replace(design.numerics, elements=2)))
    ours.assemble()
    node = np.random.default_rng(0).permutation(ours.space.mesh.n_nodes)
    at = (9 * node[:, None] + np.arange(9)).ravel()
    n = len(ours.q)
    upper = sp.csr_array((ours.data, ours.pattern.indices, ours.pattern.indptr), shape=(n, n)).toarray()
    tangent = sp.csr_array((upper + np.triu(upper, 1).T)[np.ix_(at, at)])
    answer = {"node": node, "gradient": ours.gradient[at].copy()}
    answer |= {"value": tangent.data, "column": tangent.indices, "start": tangent.indptr}
    assert ours.differences(answer) == (0.0, 0.0)
    answer["gradient"][0] += np.abs(ours.gradient).max()
    assert ours.differences(answer)[0] == pytest.approx(1.0)


def test_without_dolfinx_there_is_a_hint(tmp_path: Path) -> None:
    dolfinx_beam = script("dolfinx_beam")
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\nexit 1\n")
    python.chmod(0o755)
    with (
        pytest.raises(SystemExit, match="apt-get install python3-dolfinx"),
        dolfinx_beam.dolfinx(str(python), tmp_path),
    ):
        pass
