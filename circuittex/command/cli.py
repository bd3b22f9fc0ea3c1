"""The command line: new, yarns, run, netlist, verify, report, ensemble, export, panel."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from circuittex.base.errors import CircuittexError, ConvergenceError, DesignError, StoreError
from circuittex.command.exit_codes import ExitCode, code_of
from circuittex.command.figures import plain_figures
from circuittex.command.options import build_parser
from circuittex.command.progress import Progress
from circuittex.command.streams import complain, show_notes, usable_streams, write_utf8

if TYPE_CHECKING:
    from circuittex.design import Design, Probe
    from circuittex.results.records import Record, Study
    from circuittex.results.verification import Verification

RESULTS = "results.h5"
"""Name of the HDF5 file in a results folder."""

DEBUG = "CIRCUITTEX_DEBUG"
"""Environment variable: set, an error in circuittex itself is shown with its traceback."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code (`ExitCode`).

    >>> main(["run", "no-such-file.toml", "--out", "somewhere"])
    3
    """
    return int(_exit_code(arguments))


def _exit_code(arguments: Sequence[str] | None) -> ExitCode:
    usable_streams()
    show_notes()
    plain_figures()
    options = build_parser().parse_args(arguments)
    try:
        code = COMMANDS[options.command](options)
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader of our output has gone, as in `circuittex new | head`: nobody is left to tell.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitCode.BROKEN_PIPE
    except (CircuittexError, OSError) as error:
        complain("error", str(error))
        return code_of(error)
    except KeyboardInterrupt:
        print(f"\ncircuittex: interrupted; {_kept(options)}", file=sys.stderr)  # below the ^C of the terminal
        return ExitCode.INTERRUPTED
    except Exception as error:
        if os.environ.get(DEBUG):
            raise
        complain(
            "internal error",
            f"{type(error).__name__}: {error}; this is a fault of circuittex: please report what {DEBUG}=1 shows",
        )
        return ExitCode.INTERNAL
    return code


def _new(options: argparse.Namespace) -> ExitCode:
    from circuittex.design import starter

    write_utf8(sys.stdout, starter(options.fabric))
    return ExitCode.DONE


def _yarns(options: argparse.Namespace) -> ExitCode:
    from circuittex.design.known_yarns import in_words, yarn_library

    write_utf8(sys.stdout, "\n".join(in_words(yarn) for yarn in yarn_library(*options.folder).values()))
    return ExitCode.DONE


def _run(options: argparse.Namespace) -> ExitCode:
    from circuittex.design import load_design

    design = load_design(options.design)
    _prepare(options.out)
    with Progress(sys.stderr, show=not options.quiet) as progress:
        progress("loading the solvers")
        from circuittex.results.summary import table
        from circuittex.study.run import run_study

        try:
            study = run_study(
                design,
                options.out,
                start=options.start,
                fresh=options.fresh,
                error_estimate=options.error_estimate,
                branches=options.branches,
                workers=options.workers,
                progress=progress,
            )
        except ConvergenceError as error:
            if not _count(options.out):
                raise
            complain("error", f"{error}; {_kept(options)}")
            return ExitCode.PARTLY
    if not options.quiet:
        print(table(study))
        print(f"\nreport: {options.out / 'report.html'}")
    if names := _disagreeing(study):
        print(f"circuittex: the routes DISAGREE in {', '.join(names)}: do not trust these results", file=sys.stderr)
        return ExitCode.DISAGREE
    if failed := _simulator_failed(study):
        again = f"'circuittex verify {options.out}' asks it again"
        print(f"circuittex: ngspice failed in {', '.join(failed)}: see the report; {again}", file=sys.stderr)
        return ExitCode.SIMULATOR
    return ExitCode.DONE


def _simulator_failed(study: Study) -> list[str]:
    """Names of the states on which an ngspice that was there gave no answer."""
    return [record.name for record in study.records if record.verification.simulator_failed]


def _disagreeing(study: Study) -> list[str]:
    """Names of the states on which the routes that answered do not agree."""
    from circuittex.results.summary import agrees

    return [record.name for record in study.records if record.verification.routes and not agrees(record)]


def _netlist(options: argparse.Namespace) -> ExitCode:
    if options.probe is not None and options.kind != "deck":
        raise DesignError("--probe", options.probe, f"only --kind deck is made for a probe, not {options.kind}")
    study = _load(options.results)
    (record,) = _select(study, options.state)
    text = _netlist_text(study, record, options)
    if options.out is None:
        write_utf8(sys.stdout, text)
    else:
        options.out.write_text(text, encoding="ascii")
    from circuittex.electrical.spice.ngspice import estimated_seconds, feasible

    resistors = text.count("\nR")
    if not feasible(resistors):
        seconds = estimated_seconds(resistors)
        print(f"circuittex: note: {resistors} resistors may take ngspice {seconds:.0f} s or more", file=sys.stderr)
    return ExitCode.DONE


def _netlist_text(study: Study, record: Record, options: argparse.Namespace) -> str:
    """The netlist that the options ask for."""
    from circuittex.study.export import circuits_of, detailed_netlist, probe_netlist, reduced_netlist

    design = study.design
    if options.kind == "reduced":
        return reduced_netlist(design, record.name, record.fit)
    length = None if options.resolution == "merged" else 0.0
    circuits = circuits_of(design, record.contacts, record.fields, merge_length=length)
    if options.kind == "subckt":
        return detailed_netlist(design, record.name, circuits, merge_length=length)
    probe = _probe(record.driven(design), options.probe)
    return probe_netlist(design, record.name, circuits, probe, merge_length=length)


def _probe(design: Design, name: str | None) -> Probe:
    """The probe called `name`, or the first one."""
    for probe in design.probes:
        if name in (None, probe.name):
            return probe
    raise DesignError("--probe", name, f"probes: {', '.join(probe.name for probe in design.probes) or 'none'}")


def _verify(options: argparse.Namespace) -> ExitCode:
    study = _load(options.results)
    records = _select(study, options.state)
    from circuittex.results.verification import AGREEMENT
    from circuittex.study.export import fewer, warm_contacts
    from circuittex.study.verify import verify

    design = study.design
    checks = []
    print(f"{'state':<20} {'V per V':>8} {'current':>8} {'merging':>8} {'mesh':>8}  routes")
    for record in records:
        warm = warm_contacts(record.contacts, record.fields)
        check = verify(warm, fewer(design, warm), design.terminals, record.driven(design).probes)
        differences = check.max_voltage_difference, check.max_current_difference
        checks.append(check)
        numbers = [*differences, check.merge_error, check.field_difference]
        shown = " ".join(f"{number:8.1e}" for number in numbers)
        print(f"{record.name:<20} {shown}  {', '.join(check.routes)} {check.note}".rstrip(), flush=True)
    code = _verdict(checks)
    applied = max([AGREEMENT, *(max(check.ngspice_limit, check.native_limit) for check in checks)])
    print(f"all routes agree to {applied:.0e}" if code == ExitCode.DONE else "NOT confirmed: see the notes above")
    return code


def _verdict(checks: Sequence[Verification]) -> ExitCode:
    """What the checks of all states say together, the worst first."""
    if any(check.routes and not check.agrees for check in checks):
        return ExitCode.DISAGREE
    if any(check.simulator_failed for check in checks):
        return ExitCode.SIMULATOR
    return ExitCode.DONE if all(check.ngspice_checked for check in checks) else ExitCode.NOT_CHECKED


def _report(options: argparse.Namespace) -> ExitCode:
    folder = _results_file(options.results).parent
    _prepare(folder)
    from circuittex.base.lock import locked
    from circuittex.results.report import write_report
    from circuittex.results.summary import write_summary

    with locked(folder):
        study = _load(options.results)
        beside = _beside(options, study)
        write_summary(folder / "summary.json", study)
        print(write_report(folder, study, beside))
    return ExitCode.DONE


def _beside(options: argparse.Namespace, study: Study) -> tuple[Study, ...]:
    """The study that shares the table of claims with `study`; both must be of the paper's cell."""
    if options.beside is None:
        return ()
    from circuittex.results.claims import parameter_set

    other = _load(options.beside)
    for path, one in ((options.results, study), (options.beside, other)):
        if parameter_set(one.design) is None:
            allowed = f"{path} must be a study of the paper's cell: only of that there are claims to compare"
            raise DesignError("--beside", str(options.beside), allowed)
    return (other,)


def _ensemble(options: argparse.Namespace) -> ExitCode:
    from circuittex.study.ensemble.command import closing_words, ensemble_command, folder_of, warnings

    _prepare(folder_of(options))
    with Progress(sys.stderr, show=not options.quiet) as progress:
        ensemble = ensemble_command(options, progress)
    if not options.quiet:
        print(closing_words(ensemble, folder_of(options)))
    for line in warnings(ensemble):
        print("circuittex:", line, file=sys.stderr)
    if any(ensemble.disagreeing):
        return ExitCode.DISAGREE
    if not any(ensemble.failures):
        return ExitCode.DONE
    if all(ensemble.failures):
        complain("error", f"all {len(ensemble.failures)} members failed")
    return ExitCode.PARTLY if ensemble.count.any() else ExitCode.NO_EQUILIBRIUM


def _export(options: argparse.Namespace) -> ExitCode:
    from circuittex.study.library.members import complete_members, is_ensemble

    several = is_ensemble(options.results)
    study = next(complete_members(options.results)) if several else _load(options.results)
    _prepare(options.out)
    from circuittex.study.library.export import export_library

    cells = export_library(
        study,
        options.out,
        name=options.name,
        state=options.state,
        ends=options.ends,
        thin=options.thin,
        rise=options.rise,
        combine=tuple(filter(None, options.combine.split(","))),
        members=complete_members(options.results) if several else (),
        reactive=options.reactive,
    )
    print(f"{len(cells)} sub-circuits in {options.out}: see {options.out / 'datasheet.html'}")
    if options.kit:
        from circuittex.study.kit import write_kit

        kit = write_kit(study, options.out / "kit", options.state or None)
        print(f"circuits with their answers in {kit}: see {kit / 'README.txt'}")
    return ExitCode.DONE


def _panel(options: argparse.Namespace) -> ExitCode:
    from circuittex.study.panel.gradient import panel_gradient
    from circuittex.study.panel.output import table, write_panel
    from circuittex.study.panel.reader import load_panel
    from circuittex.study.panel.solution import solve_panel

    panel, pairs = load_panel(options.panel)
    folder = options.out or Path("results", options.panel.stem)
    _prepare(folder)
    solution = solve_panel(panel)
    notes = write_panel(folder, solution, tuple(panel_gradient(solution, *pair) for pair in pairs))
    if not options.quiet:
        print(table(solution))
        print(f"\nresults: {folder}")
    for note in notes:
        print(f"circuittex: note: {note}", file=sys.stderr)
    return ExitCode.DONE


COMMANDS: dict[str, Callable[[argparse.Namespace], ExitCode]] = {
    "new": _new,
    "yarns": _yarns,
    "run": _run,
    "netlist": _netlist,
    "verify": _verify,
    "report": _report,
    "ensemble": _ensemble,
    "export": _export,
    "panel": _panel,
}


def _prepare(folder: Path) -> None:
    """Make the folder of the results and make sure that files can be written there, before any long work."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = "a file is in the way" if isinstance(error, FileExistsError | NotADirectoryError) else error.strerror
        raise DesignError(
            "results folder", str(folder), f"it must be a folder that can be written to ({reason})"
        ) from error


def _load(path: Path) -> Study:
    """The study in a results folder, or in an HDF5 file given by its own name."""
    from circuittex.results.store import load_study

    return load_study(path)


def _results_file(path: Path) -> Path:
    """The HDF5 file that is meant by itself or by its folder."""
    file = path / RESULTS if path.is_dir() else path
    if not file.is_file():
        raise StoreError(f"{file}: there is no results file here")
    return file


def _select(study: Study, name: str | None) -> tuple[Record, ...]:
    """The record called `name`, or all of them."""
    found = tuple(record for record in study.records if name in (None, record.name))
    if not found:
        names = ", ".join(record.name for record in study.records) or "none"
        raise DesignError("--state", name, f"recorded states: {names}")
    return found


def _kept(options: argparse.Namespace) -> str:
    """What an interrupted command leaves behind, in words."""
    if options.command == "ensemble":
        return "finished members and states are kept; the same command goes on from there"
    if options.command != "run":
        return "results that were there before are unchanged"
    count = _count(options.out)
    if count == 0:
        return "no state was finished"
    states = "1 finished state is" if count == 1 else f"{count} finished states are"
    return f"{states} kept in {options.out / RESULTS}; the same command goes on from there"


def _count(folder: Path) -> int:
    """How many states are kept in a results folder."""
    try:
        return len(_load(folder).records)
    except StoreError:
        return 0
