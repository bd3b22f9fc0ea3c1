"""The folder of a study: what is in it, what may be added to it, and what is removed from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from circuittex.base.atomic import PARTIAL
from circuittex.base.errors import FolderError, StoreError
from circuittex.results.plot import FIGURES
from circuittex.results.records import Examination, Record, Study, with_examination
from circuittex.results.report import write_report
from circuittex.results.store import (
    RESULTS,
    append_examination,
    append_record,
    complete_change,
    load_study,
    write_study_start,
)
from circuittex.results.summary import write_summary
from circuittex.results.vtk.vtu import write_collections, write_vtu
from circuittex.study.circuits import StateCircuits
from circuittex.study.export import circuits_of, netlist_files, write_netlists
from circuittex.study.unfinished import remove_unfinished

MARKS = {
    "netlists/*.sub": b"* circuittex ",
    "netlists/*.cir": b"* circuittex ",
    "vtu/*.vtu": b'"contact_line_load_N_per_mm"',
    "vtu/*.pvd": b"<!--circuittex-->",
}
"""What tells the files of a run, whose names depend on its design, from those that somebody else put beside them."""
REPORT, SUMMARY = "report.html", "summary.json"


def open_study(folder: Path, study: Study, begin: Callable[[Study], Study], *, fresh: bool = False) -> Study:
    """The study as far as it is in `folder` already, ready to go on; in an empty one what `begin` makes of it, written
    there.

    With `fresh` what an earlier run left is removed. Nothing is removed without it.

    Raises `FolderError` where the results in the folder are of another design, start or version of circuittex, or
    damaged.
    """
    path = folder / RESULTS
    if fresh:
        study = begin(study)
        remove_results(folder)
        write_study_start(path, study)
    elif not path.exists():
        if left := made_by_a_run(folder):
            raise FolderError(
                f"{folder}: it holds files of a run ({left[0].relative_to(folder)} and others) but no {RESULTS} to go "
                f"on from; {ADVICE}"
            )
        study = begin(study)
        write_study_start(path, study)
    else:
        complete_change(path)
        return _continued(path, study)
    return study


ADVICE = "take another folder, or --fresh (fresh=True) to remove what is there and start again"


def _continued(path: Path, study: Study) -> Study:
    """The study in the file at `path`, if it is this one."""
    try:
        found = load_study(path)
    except StoreError as error:
        raise FolderError(f"{error}; {ADVICE}") from error
    if found.design_hash != study.design_hash:
        raise FolderError(
            f"{path.parent}: it holds results of another design: {found.design.name!r} with hash "
            f"{found.design_hash}, and this is {study.design.name!r} with hash {study.design_hash}; {ADVICE}"
        )
    if found.version != study.version:
        raise FolderError(
            f"{path.parent}: its results are of circuittex {found.version}, and this is {study.version}, which may "
            f"compute other numbers (design hash {found.design_hash}); {ADVICE}"
        )
    if found.start != study.start:
        raise FolderError(
            f"{path.parent}: its first relaxation had another start, {found.start}, and this is {study.start}; {ADVICE}"
        )
    return found


def keep_record(folder: Path, study: Study, record: Record) -> Study:
    """The study with one more state, which is in the HDF5 file then and will last.

    An older report does not know the new state, and goes.
    """
    (folder / REPORT).unlink(missing_ok=True)
    append_record(folder / RESULTS, record)
    return replace(study, records=(*study.records, record))


def keep_examination(folder: Path, study: Study, examination: Examination) -> Study:
    """The study with one more examination about a state, which is in the HDF5 file then; an older report goes."""
    (folder / REPORT).unlink(missing_ok=True)
    append_examination(folder / RESULTS, examination)
    return with_examination(study, examination)


def write_state(folder: Path, study: Study, record: Record, circuits: StateCircuits | None = None) -> None:
    """The netlists and the VTU file of one state, those that are not there yet.

    The `circuits` are those that were built when it was recorded; they are built anew for a state of an earlier run.
    """
    design = study.design
    files = netlist_files(design, record.name, record.fit)
    if not all((folder / "netlists" / name).exists() for name in files):
        if circuits is None:
            circuits = circuits_of(design, record.contacts, record.fields)
        driven = record.driven(design).probes
        write_netlists(folder / "netlists", design, record.name, circuits, record.fit, driven)
    vtu = folder / "vtu" / f"{record.name}.vtu"
    if not vtu.exists():
        vtu.parent.mkdir(exist_ok=True)
        write_vtu(vtu, study.mesh, record)


def write_numbers(folder: Path, study: Study) -> None:
    """The summary of the states so far."""
    write_summary(folder / SUMMARY, study)


def needs_report(folder: Path) -> bool:
    """Whether the report is still to be written; it comes after its figures, so that it stands for them."""
    return not (folder / REPORT).exists()


def complete(folder: Path, study: Study) -> None:
    """Write whatever of the folder's files is missing, once all states are there."""
    for record in study.records:
        write_state(folder, study, record)
    write_collections(folder / "vtu", study)
    write_numbers(folder, study)
    if needs_report(folder):
        write_report(folder, study)


def remove_results(folder: Path) -> None:
    """Remove what a run left in `folder`, so that no stale result can pass for one of the next run.

    Files in the same places that circuittex did not write stay. So does the HDF5 file, which the next run replaces
    in one step: until then the folder can be completed again from it.
    """
    partial = [path for pattern in (*MARKS, "figures/*", "*") for path in folder.glob(pattern + PARTIAL)]
    for path in (*made_by_a_run(folder), *partial):
        path.unlink(missing_ok=True)
    remove_unfinished(folder)


def made_by_a_run(folder: Path) -> list[Path]:
    """The files that a run left in `folder`, but for the HDF5 file."""
    made = [path for pattern, mark in MARKS.items() for path in folder.glob(pattern) if _holds(path, mark)]
    made += [folder / "figures" / f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")]
    return [path for path in (*made, folder / REPORT, folder / SUMMARY) if path.is_file()]


def _holds(path: Path, mark: bytes) -> bool:
    return path.is_file() and mark in path.read_bytes()
