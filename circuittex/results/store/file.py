"""The results of a study in one HDF5 file that grows by one recorded state at a time and is complete at any moment."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import Any

import h5py

from circuittex.base.atomic import replacing
from circuittex.base.errors import CircuittexError, StoreError
from circuittex.base.version import __version__
from circuittex.design import Design
from circuittex.results.bifurcation import BranchCheck
from circuittex.results.discretisation import ErrorEstimate
from circuittex.results.records import EXAMINATIONS, INITIAL, Examination, Record, Study, with_examination
from circuittex.results.store.archive import ATTRIBUTES, MEANING, Digests, Former, Reader, Writer, reader_of, registry
from circuittex.results.store.journal import Overlay, commit, finish, overlay, snapshot
from circuittex.results.store.meaning import meanings, summary

FORMAT = "circuittex results"
VERSION = 2
"""Version of the file layout. Files of version 1 are read; others are refused."""
OLDEST = 1
FORMER: Former = {"Record": {"loading": "path"}}
"""Names of fields in files of version 1."""
RESULTS = "results.h5"
"""What the file is called in a study's folder."""
HEAD = ("version", "design", "design_hash", "mesh", "initial")
"""The fields of a `Study` that are known before its first record."""
CHOSEN = "start"
"""One more, which is written where it is not the default: files that older versions know stay as they are."""
NAMES: dict[type[Examination], str] = {ErrorEstimate: "error estimate", BranchCheck: "branch check"}
"""What examinations are called where one is damaged."""
LIBVER = ("v110", "v110")
"""HDF5 1.10: its metadata carry checksums, and every viewer of the last years reads it."""
GROUPS = {
    "states": "One group for each recorded state, in the order of the attribute @number: the fields of a Record.",
    "errors": "Estimated discretisation errors, by the state's name.",
    "branches": "Whether round-off chose the branch of a state, by its name.",
    "objects": "Where all of it is stored, each object once, by a digest of its content; every other place links here.",
}


def write_study_start(path: str | Path, study: Study) -> None:
    """Write a results file with `study` and the records it has so far (usually none), replacing any file at `path`.

    Errors: `StoreError` where the file cannot be written.
    """

    def fill(file: h5py.File) -> None:
        writer = Writer(file)
        file.attrs.update({"format": FORMAT, "format_version": VERSION, MEANING: summary(Study)})
        told = meanings(Study)
        head = HEAD if study.start == INITIAL else (*HEAD, CHOSEN)
        for name in head:
            part = getattr(study, name)
            writer.put(file, name, part, summary(type(part)) if is_dataclass(part) else told.get(name, ""))
        file.attrs[ATTRIBUTES] = "\n".join(
            f"{name}: {told[name]}" for name in ("version", "design_hash", CHOSEN) if name in told and name in head
        )
        file.attrs["@digest"] = writer.digest(tuple(getattr(study, name) for name in head))
        for name, meaning in GROUPS.items():
            file.require_group(name).attrs[MEANING] = meaning
        for record in study.records:
            _add(file, "states", record.name, writer, record)
        for group in EXAMINATIONS.values():
            for examination in getattr(study, group):
                _add(file, group, examination.state, writer, examination)

    path = Path(path)
    # HDF5 works in memory only: a full disk then meets plain Python I/O, from which one can recover, and not the HDF5
    # library, which cannot close a file it could not flush.
    with _as_store_error(path, "cannot be written"):
        image = Overlay(None, 0)
        with h5py.File(image, "w", libver=LIBVER) as file:
            fill(file)
        finish(path)  # lest a journal of what was there before be taken for one of this
        with replacing(path) as partial:
            partial.write_bytes(image.tail)


def append_record(path: str | Path, record: Record) -> None:
    """Add one recorded state to the results file at `path`; within its loading path the states come in their order.

    What is there is not written again (`circuittex.results.store.journal`), and whenever the process ends, the file is
    read complete, with or without the new record.

    Errors: `StoreError` where there is no results file at `path`, it has the state, or it cannot be written.
    """
    _append(Path(path), "states", record.name, record)


def append_examination(path: str | Path, examination: Examination) -> None:
    """Add an examination about a recorded state to the results file at `path`, in the manner of `append_record`.

    Errors: `StoreError` as there.
    """
    _append(Path(path), EXAMINATIONS[type(examination)], examination.state, examination)


def complete_change(path: str | Path) -> None:
    """Make the change complete that a kill left half-made at `path`, so that h5py alone reads the file, too.

    Only who may write to the file may call this. Errors: `StoreError` where it cannot be written.
    """
    with _as_store_error(Path(path), "cannot be written"):
        finish(Path(path))


def load_study(path: str | Path) -> Study:
    """Everything that was computed, bit for bit, with locked arrays; checked against the digests in the file.

    `path` is a results file or the folder of a study. A file of an older layout is read, with defaults for what it
    lacks; while a run adds to the file, what it held a moment ago is read.

    Errors: `StoreError` where the file is missing, foreign, damaged, or of a newer layout.
    """
    path = Path(path)
    path = path / RESULTS if path.is_dir() else path
    if not path.is_file():
        raise StoreError(f"{path}: there is no results file here")
    with _as_store_error(path, "cannot be read"):
        return _read(snapshot(path))


def _read(content: Overlay) -> Study:
    with h5py.File(content, "r") as file:
        version = _check_layout(file)
        former: Former = FORMER if version == 1 else {}
        reader = Reader(registry(Study), former, _author(file))
        start = file if version > 1 else file["study"]
        names = (*HEAD, CHOSEN) if CHOSEN in start.attrs else HEAD
        head = tuple(reader.get(start, name) for name in names)
        records = _members(file["states" if version > 1 else "records"], reader)
        examinations = {kind: _members(file[group], reader) for kind, group in EXAMINATIONS.items() if group in file}
        digest = Digests(reader.lacking, former)
        if start.attrs["@digest"] != digest(head):
            raise StoreError("its content does not match its digest")
        study = Study(**dict(zip(names, head, strict=True)), records=())
        study = replace(study, records=_by_plan(study.design, _checked(records, "record", digest)))
        for kind, members in examinations.items():
            for examination in _checked(members, NAMES[kind], digest):
                study = with_examination(study, examination)
        return replace(study, design=_in_newtons(study.design)) if version == 1 else study


def _in_newtons(design: Design) -> Design:
    """A design of a file of version 1, whose tolerance was a number in N."""
    numerics = design.numerics
    return replace(design, numerics=replace(numerics, tolerance=f"{numerics.tolerance!r} N"))


def _by_plan(design: Design, records: Sequence[Record]) -> tuple[Record, ...]:
    """The records loading by loading, whatever the order in which these came on; within one it is theirs."""
    rank = {"": 0} | {loading.name: number for number, loading in enumerate(design.loading, start=1)}
    return tuple(sorted(records, key=lambda record: rank[record.loading]))


def _append(path: Path, group: str, name: str, value: Record | Examination) -> None:
    if not path.is_file():
        raise StoreError(f"{path}: there is no results file here")
    with _as_store_error(path, "cannot be written"), path.open("rb") as handle:
        finish(path)
        changed = overlay(path, handle)
        with h5py.File(changed, "r+", libver=LIBVER) as file:
            if (version := _check_layout(file)) != VERSION:
                raise StoreError(f"its layout is version {version}, to which nothing can be added")
            if name in file[group]:
                raise StoreError(f"it holds {group}/{name} already")
            _add(file, group, name, Writer(file), value)
        commit(path, changed)


def _add(file: h5py.File, group: str, name: str, writer: Writer, value: Record | Examination) -> None:
    members = file[group]
    number = len(members)
    writer.put(members, name, value, summary(type(value)))
    members[name].attrs["@number"] = number
    members[name].attrs["@digest"] = writer.digest(value)


def _members(group: h5py.Group, reader: Reader) -> dict[str, tuple[Any, str]]:
    """Name -> member of a group and its digest, in the order of their numbers."""
    if "@digest 0000" in group.attrs:  # version 1: the names are the numbers
        return {name: (reader.get(group, name), str(group.attrs[f"@digest {name}"])) for name in sorted(group)}
    names = sorted(group, key=lambda name: int(group[name].attrs["@number"]))
    return {name: (reader.get(group, name), str(group[name].attrs["@digest"])) for name in names}


def _checked(members: Mapping[str, tuple[Any, str]], what: str, digest: Digests) -> list[Any]:
    for name, (member, stated) in members.items():
        if digest(member) != stated:
            raise StoreError(f"{what} {name} does not match its digest")
    return [member for member, _ in members.values()]


def _check_layout(file: h5py.File) -> int:
    """The version of the layout."""
    if file.attrs.get("format") != FORMAT:
        raise StoreError("this is not a results file of circuittex")
    version = int(file.attrs["format_version"])
    if not OLDEST <= version <= VERSION:
        raise StoreError(
            f"its layout is version {version} and circuittex {__version__} reads {OLDEST} to {VERSION}; "
            f"{reader_of(_author(file))}"
        )
    return version


def _author(file: h5py.File) -> str:
    """The version of circuittex that wrote the file, in any layout."""
    return str(file.attrs.get("version") or file.get("study", file).attrs.get("version", "of another version"))


@contextlib.contextmanager
def _as_store_error(path: Path, what: str) -> Iterator[None]:
    # h5py reports damage in many ways (OSError, KeyError, RuntimeError, ...), and a damaged design fails validation.
    try:
        yield
    except (CircuittexError, OSError, KeyError, ValueError, TypeError, RuntimeError, AttributeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise StoreError(f"{path} {what}: {reason}") from error
