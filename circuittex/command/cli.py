"""The command line: new, run, netlist, verify, report, ensemble."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from circuittex.base.errors import CircuittexError, DesignError, StoreError
from circuittex.command.options import build_parser

if TYPE_CHECKING:
    from circuittex.design import Design, Probe
    from circuittex.results.records import Record, Study

RESULTS = "results.h5"
"""Name of the HDF5 file in a results folder."""

BAD_INPUT, DISAGREE, INTERRUPTED, BROKEN_PIPE = 2, 1, 130, 141
"""Exit codes besides 0; the last two are what shells report for SIGINT and SIGPIPE."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    >>> main(["run", "no-such-file.toml", "--out", "somewhere"])
    2
    """
    options = build_parser().parse_args(arguments)
    try:
        code = COMMANDS[options.command](options)
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader of our output has gone, as in `circuittex new | head`: nobody is left to tell.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except (CircuittexError, OSError) as error:
        print("circuittex: error:", " ".join(str(error).split()), file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print(f"\ncircuittex: interrupted; {_kept(options)}", file=sys.stderr)
        return INTERRUPTED
    return code


def _new(options: argparse.Namespace) -> int:
    from circuittex.design import starter

    print(starter(), end="")
    return 0


def _run(options: argparse.Namespace) -> int:
    from circuittex.design import load_design

    design = load_design(options.design)
    _prepare(options.out)
    with Progress(sys.stderr, show=not options.quiet) as progress:
        progress("loading the solvers")
        from circuittex.results.summary import table
        from circuittex.study.run import run_study

        study = run_study(
            design,
            options.out,
            fresh=options.fresh,
            error_estimate=options.error_estimate,
            branches=options.branches,
            workers=options.workers,
            progress=progress,
        )
    if not options.quiet:
        print(table(study))
        print(f"\nreport: {options.out / 'report.html'}")
    if names := _disagreeing(study):
        print(f"circuittex: the routes DISAGREE in {', '.join(names)}: do not trust these results", file=sys.stderr)
        return DISAGREE
    return 0


def _disagreeing(study: Study) -> list[str]:
    """Names of the states on which the routes that answered do not agree."""
    from circuittex.results.summary import agrees

    return [record.name for record in study.records if record.verification.routes and not agrees(record)]


def _netlist(options: argparse.Namespace) -> int:
    if options.probe is not None and options.kind != "deck":
        raise DesignError("--probe", options.probe, f"only --kind deck is made for a probe, not {options.kind}")
    study = _load(options.results)
    (record,) = _select(study, options.state)
    text = _netlist_text(study, record, options)
    if options.out is None:
        print(text, end="")
    else:
        options.out.write_text(text, encoding="ascii")
    from circuittex.electrical.spice.ngspice import estimated_seconds, feasible

    resistors = text.count("\nR")
    if not feasible(resistors):
        seconds = estimated_seconds(resistors)
        print(f"circuittex: note: {resistors} resistors may take ngspice {seconds:.0f} s or more", file=sys.stderr)
    return 0


def _netlist_text(study: Study, record: Record, options: argparse.Namespace) -> str:
    """The netlist that the options ask for."""
    from circuittex.study.export import detailed_netlist, probe_netlist, reduced_netlist, simplified

    design = study.design
    if options.kind == "reduced":
        return reduced_netlist(design, record.name, record.fit)
    length = None if options.resolution == "merged" else 0.0
    simple = simplified(design, record.contacts, merge_length=length)
    if options.kind == "subckt":
        return detailed_netlist(design, record.name, simple, merge_length=length)
    return probe_netlist(design, record.name, simple, _probe(design, options.probe), merge_length=length)


def _probe(design: Design, name: str | None) -> Probe:
    """The probe called `name`, or the first one."""
    for probe in design.probes:
        if name in (None, probe.name):
            return probe
    raise DesignError("--probe", name, f"probes: {', '.join(probe.name for probe in design.probes) or 'none'}")


def _verify(options: argparse.Namespace) -> int:
    study = _load(options.results)
    records = _select(study, options.state)
    from circuittex.results.verification import AGREEMENT
    from circuittex.study.export import simplified
    from circuittex.study.verify import verify

    design = study.design
    agree = True
    print(f"{'state':<20} {'V per V':>8} {'current':>8} {'merging':>8} {'mesh':>8}  routes")
    for record in records:
        simple = simplified(design, record.contacts)
        check = verify(record.contacts, simple.contacts, design.terminals, design.probes)
        differences = check.max_voltage_difference, check.max_current_difference
        agree &= check.ngspice_checked and check.agrees
        numbers = [*differences, check.merge_error, check.field_difference]
        shown = " ".join(f"{number:8.1e}" for number in numbers)
        print(f"{record.name:<20} {shown}  {', '.join(check.routes)} {check.note}".rstrip(), flush=True)
    print(f"all routes agree to {AGREEMENT:.0e}" if agree else "NOT confirmed: see the notes above")
    return 0 if agree else DISAGREE


def _report(options: argparse.Namespace) -> int:
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
    return 0


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


def _ensemble(options: argparse.Namespace) -> int:
    from circuittex.study.ensemble.command import closing_words, ensemble_command, folder_of, warnings

    _prepare(folder_of(options))
    with Progress(sys.stderr, show=not options.quiet) as progress:
        ensemble = ensemble_command(options, progress)
    if not options.quiet:
        print(closing_words(ensemble, folder_of(options)))
    for line in warnings(ensemble):
        print("circuittex:", line, file=sys.stderr)
    return DISAGREE if any(ensemble.disagreeing) else 0


COMMANDS: dict[str, Callable[[argparse.Namespace], int]] = {
    "new": _new,
    "run": _run,
    "netlist": _netlist,
    "verify": _verify,
    "report": _report,
    "ensemble": _ensemble,
}


class Progress:
    """Shows what is being done: one updating line on a terminal, plain lines elsewhere.

    A text that ends with a line break stays on the terminal.
    """

    def __init__(self, stream: TextIO, *, show: bool = True) -> None:
        self._stream, self._show = stream, show
        self._updating = stream.isatty()

    def __call__(self, text: str) -> None:
        """Show `text`, which is one line."""
        if not self._show:
            return
        if text.endswith("\n") or not self._updating:
            start = "\r\x1b[2K" if self._updating else ""
            self._stream.write(f"{start}{text.rstrip()}\n")
        else:
            width = shutil.get_terminal_size().columns - 1
            self._stream.write(f"\r\x1b[2K{text[:width]}")
        self._stream.flush()

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._show and self._updating:
            self._stream.write("\r\x1b[2K")
            self._stream.flush()


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

    return load_study(_results_file(path))


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
    try:
        count = len(_load(options.out).records)
    except StoreError:
        count = 0
    if count == 0:
        return "no state was finished"
    states = "1 finished state is" if count == 1 else f"{count} finished states are"
    return f"{states} kept in {options.out / RESULTS}; the same command goes on from there"
