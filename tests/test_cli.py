"""The command line: what it prints where, its exit codes, and what it refuses before any long work."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from synthetic_study import synthetic_study

import circuittex
from circuittex.base.errors import ConvergenceError
from circuittex.base.lock import locked
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode, code_of
from circuittex.design import Design, load_design, starter
from circuittex.electrical.network.circuit import CONTACT, Circuit
from circuittex.electrical.network.nodal import NodalSolution, solve_nodal
from circuittex.netlist import parse, pin_names
from circuittex.results.records import Study
from circuittex.results.store import load_study, write_study_start
from circuittex.results.verification import Verification

COMMANDS = ["new", "run", "netlist", "verify", "report", "panel"]


@pytest.fixture
def design_file(tmp_path: Path) -> Path:
    path = tmp_path / "weave.toml"
    path.write_text(starter(), encoding="utf-8")
    return path


def error_line(capsys: pytest.CaptureFixture[str]) -> str:
    """What stderr holds, which must be one line of the agreed form."""
    text = capsys.readouterr().err
    assert text.startswith("circuittex: error: ")
    assert text.count("\n") == 1
    return text


def replace_study(monkeypatch: pytest.MonkeyPatch, function: Callable[..., Study]) -> None:
    monkeypatch.setattr("circuittex.study.run.run_study", function)


# Help


@pytest.mark.parametrize("command", COMMANDS)
def test_help_explains_and_shows_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    text = capsys.readouterr().out
    assert stop.value.code == 0
    assert f"example:\n  circuittex {command} " in text
    assert len(text.splitlines()) > 6


def test_general_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    text = capsys.readouterr().out
    assert all(f"    {command} " in text for command in COMMANDS)


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"circuittex {circuittex.__version__}\n"


def test_runs_as_a_module() -> None:
    done = subprocess.run([sys.executable, "-m", "circuittex", "--version"], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, f"circuittex {circuittex.__version__}\n")


@pytest.mark.parametrize("arguments", [[], ["weave"], ["run"], ["run", "x.toml"], ["netlist", "x", "--kind", "spice"]])
def test_wrong_usage_is_exit_code_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 2
    assert "usage: circuittex" in capsys.readouterr().err


# new


def test_new_prints_a_design_that_loads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new"]) == 0
    path = tmp_path / "new.toml"
    path.write_text(capsys.readouterr().out, encoding="utf-8")
    assert isinstance(load_design(path), Design)
    assert "#" in path.read_text(encoding="utf-8")


def test_broken_pipe_is_silent() -> None:
    code = "import sys, circuittex.command.cli as c; sys.stdin.read(); sys.exit(c.main(['new']))"
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    process.stdout.close()  # the reader goes before a word is written
    process.stdout = None
    _, errors = process.communicate("go", timeout=60)
    assert (process.returncode, errors) == (141, "")


# run


def test_run_shows_progress_and_ends_with_a_table(
    design_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    study = synthetic_study()

    def fake(design: Design, out: Path, *, progress: Callable[[str], None], **_: object) -> Study:
        progress("relaxed: iteration 1")
        return study

    replace_study(monkeypatch, fake)
    assert main(["run", str(design_file), "--out", str(tmp_path / "a" / "b")]) == 0
    shown = capsys.readouterr()
    assert "relaxed: iteration 1\n" in shown.err
    lines = shown.out.splitlines()
    assert all(any(line.startswith(record.name) for line in lines) for record in study.records)
    assert lines[-1] == f"report: {tmp_path / 'a' / 'b' / 'report.html'}"


def test_quiet_run_says_nothing(
    design_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    replace_study(monkeypatch, lambda design, out, *, progress, **_: (progress("x"), synthetic_study(1))[1])
    assert main(["run", str(design_file), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def with_verification(change: Callable[[Verification], Verification]) -> Callable[..., Study]:
    """A run whose second state is verified with another outcome."""
    study = synthetic_study(2, contacts=10)
    first, second = study.records
    records = (first, replace(second, verification=change(second.verification)))
    return lambda *_, **__: replace(study, records=records)


@pytest.mark.parametrize("difference", ["max_voltage_difference", "max_current_difference"])
@pytest.mark.parametrize("value", [2e-9, float("nan")])
def test_run_whose_routes_disagree_is_no_success(
    difference: str,
    value: float,
    design_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    changed = {difference: value}
    replace_study(monkeypatch, with_verification(lambda v: replace(v, **changed)))  # type: ignore[arg-type]
    assert main(["run", str(design_file), "--out", str(tmp_path / "out"), "--quiet"]) == ExitCode.DISAGREE
    text = capsys.readouterr().err
    assert "the routes DISAGREE in stretch-0.0250:" in text
    assert "relaxed" not in text


def test_run_without_ngspice_completes_and_says_so(
    design_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def unchecked(v: Verification) -> Verification:
        return replace(v, routes=("fields", "nodal"), ngspice_checked=False, note="it is not installed")

    replace_study(monkeypatch, with_verification(unchecked))
    assert main(["run", str(design_file), "--out", str(tmp_path / "out")]) == 0
    assert "ngspice did NOT check stretch-0.0250" in capsys.readouterr().out


def test_run_without_probes_has_nothing_to_disagree_about(
    design_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing = {"max_voltage_difference": float("nan"), "max_current_difference": float("nan")}
    replace_study(monkeypatch, with_verification(lambda v: replace(v, routes=(), **nothing)))  # type: ignore[arg-type]
    assert main(["run", str(design_file), "--out", str(tmp_path / "out"), "--quiet"]) == 0


@pytest.mark.parametrize("workers", ["0", "-2"])
def test_run_needs_a_worker(
    workers: str, design_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        main(["run", str(design_file), "--out", str(tmp_path / "out"), "--workers", workers, "--quiet"])
        == ExitCode.DESIGN
    )
    assert f"workers: {workers} is not usable" in error_line(capsys)


def test_run_passes_its_options_on(design_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, object] = {}
    replace_study(monkeypatch, lambda *_, **options: (given.update(options), synthetic_study(1))[1])
    command = ["run", str(design_file), "--out", str(tmp_path / "out"), "--quiet"]
    assert main(command) == 0
    assert (given["fresh"], given["workers"]) == (False, None)
    assert main([*command, "--fresh", "--workers", "3"]) == 0
    assert (given["fresh"], given["workers"]) == (True, 3)


def test_run_refuses_a_file_as_folder(design_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(design_file), "--out", str(design_file)]) == ExitCode.DESIGN
    line = error_line(capsys)
    assert "results folder" in line
    assert "a file is in the way" in line


def test_run_refuses_a_folder_below_a_file(design_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(design_file), "--out", str(design_file / "results")]) == ExitCode.DESIGN
    assert "a file is in the way" in error_line(capsys)


def test_run_refuses_a_folder_that_cannot_be_written(
    design_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(**_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    assert main(["run", str(design_file), "--out", str(tmp_path)]) == ExitCode.DESIGN
    assert "Permission denied" in error_line(capsys)


def test_unusable_design_leaves_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text("nonsense = 1\n", encoding="utf-8")
    assert main(["run", str(bad), "--out", str(tmp_path / "out")]) == ExitCode.DESIGN
    assert "nonsense" in error_line(capsys)
    assert not (tmp_path / "out").exists()


def test_missing_design(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "none.toml", "--out", str(tmp_path / "out")]) == ExitCode.DESIGN
    assert "none.toml" in error_line(capsys)


@pytest.mark.parametrize(
    "error", [ConvergenceError("no equilibrium\nafter 80"), OSError(28, "No space left on device")]
)
def test_errors_of_a_study_are_one_line(
    error: Exception,
    design_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object, **__: object) -> Study:
        raise error

    replace_study(monkeypatch, fail)
    assert main(["run", str(design_file), "--out", str(tmp_path / "out"), "--quiet"]) == code_of(error)
    assert " ".join(str(error).split()) in error_line(capsys)


@pytest.mark.parametrize(
    ("states", "kept"), [(0, "no state"), (1, "1 finished state is"), (2, "2 finished states are")]
)
def test_interrupted_run_says_what_it_kept(
    states: int,
    kept: str,
    design_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def interrupted(design: Design, out: Path, **_: object) -> Study:
        if states:
            write_study_start(out / "results.h5", synthetic_study(states, contacts=10))
        raise KeyboardInterrupt

    replace_study(monkeypatch, interrupted)
    assert main(["run", str(design_file), "--out", str(tmp_path / "out"), "--quiet"]) == 130
    assert kept in capsys.readouterr().err


def test_an_error_of_circuittex_itself_has_a_code_and_a_sentence(
    design_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A defect of circuittex is not the user's mistake: it is told apart, and shows its traceback when asked."""

    def broken(*_: object, **__: object) -> Study:
        raise ZeroDivisionError("no divisor")

    replace_study(monkeypatch, broken)
    command = ["run", str(design_file), "--out", str(tmp_path / "out"), "--quiet"]
    monkeypatch.delenv("CIRCUITTEX_DEBUG", raising=False)
    assert main(command) == ExitCode.INTERNAL
    text = capsys.readouterr().err
    assert text.startswith("circuittex: internal error: ZeroDivisionError: no divisor")
    assert "CIRCUITTEX_DEBUG=1" in text
    monkeypatch.setenv("CIRCUITTEX_DEBUG", "1")
    with pytest.raises(ZeroDivisionError):
        main(command)


def test_what_failed_then_counts_whatever_is_installed_now(
    design_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def failed(v: Verification) -> Verification:
        return replace(v, routes=("fields", "nodal"), ngspice_checked=False, simulator_failed=True, note="it crashed")

    replace_study(monkeypatch, with_verification(failed))
    monkeypatch.setenv("CIRCUITTEX_NGSPICE", "")
    out = tmp_path / "out"
    assert main(["run", str(design_file), "--out", str(out), "--quiet"]) == ExitCode.SIMULATOR
    assert f"ngspice failed in stretch-0.0250: see the report; 'circuittex verify {out}'" in capsys.readouterr().err


# netlist, verify, report


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results folder with the HDF5 file only."""
    folder = tmp_path_factory.mktemp("results")
    write_study_start(folder / "results.h5", synthetic_study(2, contacts=60, rows=(2,)))
    return folder


@pytest.mark.parametrize("command", ["netlist", "verify", "report"])
def test_folder_without_results(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, str(tmp_path)]) == ExitCode.FILES
    assert "there is no results file here" in error_line(capsys)


@pytest.mark.parametrize("command", ["netlist", "verify"])
def test_unknown_state_names_the_known_ones(command: str, computed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, str(computed), "--state", "flat"]) == ExitCode.DESIGN
    line = error_line(capsys)
    assert "'flat'" in line
    assert "relaxed, stretch-0.0250" in line


def test_report_is_rebuilt_from_the_file_alone(
    computed: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # Drawing takes long and has tests of its own.
    monkeypatch.setattr(import_module("circuittex.results.report.page"), "save_figures", lambda study, folder: {})
    assert main(["report", str(computed)]) == 0
    assert capsys.readouterr().out == f"{computed / 'report.html'}\n"
    assert "stretch-0.0250" in (computed / "report.html").read_text(encoding="utf-8")
    states = json.loads((computed / "summary.json").read_text(encoding="utf-8"))["states"]
    assert [state["name"] for state in states] == ["relaxed", "stretch-0.0250"]


def test_a_folder_being_written_can_be_read_but_gets_no_report(
    computed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with locked(computed):
        assert main(["report", str(computed)]) == ExitCode.FILES
        assert "circuittex is writing there already" in error_line(capsys)
        assert main(["netlist", str(computed)]) == 0


def test_full_subcircuit_holds_every_contact(computed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["netlist", str(computed), "--resolution", "full"]) == 0
    circuit = parse(capsys.readouterr().out)
    contacts = load_study(computed / "results.h5").records[0].contacts
    ends = [f"{kind}{k}_{end}" for kind in ("warp", "weft") for k in range(1, 5) for end in ("minus", "plus")]
    assert list(pin_names(circuit)) == ends
    # 60 random contacts over 16 fibrils: all of them are reached, and none is near enough to another to matter
    found = np.sort(1.0 / circuit.resistance[circuit.resistor_kind == CONTACT])
    np.testing.assert_allclose(found, np.sort(contacts.conductance), rtol=1e-12)


def test_merged_subcircuit_conducts_as_much(computed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "merged.cir"
    assert main(["netlist", str(computed), "--state", "stretch-0.0250", "--out", str(path)]) == 0
    assert capsys.readouterr() == ("", "")
    text = path.read_text(encoding="ascii")
    circuit, contacts = parse(text), load_study(computed / "results.h5").records[1].contacts
    kept = circuit.resistor_kind == CONTACT
    assert kept.sum() < contacts.n_contacts
    assert np.sum(1.0 / circuit.resistance[kept]) == pytest.approx(contacts.conductance.sum(), rel=1e-12)
    assert '* state: "stretch-0.0250"' in text


def test_deck_of_a_probe_drives_its_terminals(computed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["netlist", str(computed), "--kind", "deck", "--probe", "parallel"]) == 0
    sources = [line.split()[1:] for line in capsys.readouterr().out.splitlines() if line.startswith("V")]
    assert sources == [["parallel", "0", "1.0"], ["common", "0", "0.0"]]


@pytest.mark.parametrize("kind", [[], ["--kind", "subckt"], ["--kind", "reduced"]])
def test_a_probe_belongs_to_a_deck(kind: list[str], computed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["netlist", str(computed), "--probe", "parallel", *kind]) == ExitCode.DESIGN
    assert "--probe: 'parallel' is not usable; only --kind deck is made for a probe" in error_line(capsys)


def test_the_header_of_a_full_netlist_says_that_nothing_is_merged(
    computed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for kind in ("subckt", "deck"):
        assert main(["netlist", str(computed), "--kind", kind, "--resolution", "full"]) == 0
        assert '* note: "contact points are not merged"' in capsys.readouterr().out


def test_reduced_netlist(computed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["netlist", str(computed), "--kind", "reduced"]) == 0
    circuit = parse(capsys.readouterr().out)
    # 4 x 4 crossings: 8 yarns of 3 inner Ry and 2 outer Ry/2, and 16 Rc; the made-up fit has Ry 0.2827 and Rc 210 ohm
    values, counts = np.unique(circuit.resistance, return_counts=True)
    np.testing.assert_allclose(values, [0.2827 / 2, 0.2827, 210.0], rtol=1e-12)
    assert counts.tolist() == [16, 24, 16]


def test_unknown_probe_names_the_known_ones(computed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["netlist", str(computed), "--kind", "deck", "--probe", "diagonal"]) == ExitCode.DESIGN
    assert "straight, parallel, perpendicular" in error_line(capsys)


def test_netlist_that_ngspice_would_not_finish_comes_with_a_note(
    computed: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("circuittex.electrical.spice.ngspice.feasible", lambda resistors: False)
    assert main(["netlist", str(computed)]) == 0
    assert "circuittex: note: " in capsys.readouterr().err


def test_verify_confirms_with_ngspice(computed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(computed), "--state", "relaxed"]) == 0
    text = capsys.readouterr().out
    assert "fields, nodal, ngspice" in text
    assert "stretch" not in text


def test_verify_without_ngspice_is_no_confirmation(
    computed: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("circuittex.electrical.spice.ngspice.find_ngspice", lambda: None)
    assert main(["verify", str(computed), "--state", "relaxed"]) == ExitCode.NOT_CHECKED
    assert "NOT confirmed" in capsys.readouterr().out


def test_an_ngspice_too_slow_for_a_circuit_has_not_failed(computed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is there, but nobody asked it: what that says differs from a crash."""
    monkeypatch.setattr("circuittex.electrical.spice.ngspice.estimated_seconds", lambda resistors: 1e6)
    assert main(["verify", str(computed), "--state", "relaxed"]) == ExitCode.NOT_CHECKED


def test_verify_finds_a_route_that_disagrees(
    computed: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def wrong(circuit: Circuit, drive: Mapping[str, float]) -> NodalSolution:
        right = solve_nodal(circuit, drive)
        return NodalSolution(right.voltage * (1 + 1e-8), right.port_current * (1 + 1e-8))

    monkeypatch.setattr("circuittex.study.verify.solve_nodal", wrong)
    assert main(["verify", str(computed), "--state", "relaxed"]) == ExitCode.DISAGREE
    assert "NOT confirmed" in capsys.readouterr().out
