"""The results of a study in one HDF5 file that grows by one recorded state at a time and is complete at any moment."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py

from circuittex.base.atomic import replacing
from circuittex.base.errors import CircuittexError, StoreError
from circuittex.design import Design
from circuittex.results.bifurcation import BranchCheck
from circuittex.results.discretisation import ErrorEstimate
from circuittex.results.records import FINDINGS, Finding, Record, Study, with_finding
from circuittex.results.store.archive import Digests, Reader, Writer, registry

FORMAT = "circuittex results"
VERSION = 1
"""Version of the file layout; files of another layout are refused."""
HEAD = ("version", "design", "design_hash", "mesh", "initial")
"""The fields of a `Study` that are known before its first record."""
NAMES: dict[type[Finding], str] = {ErrorEstimate: "error estimate", BranchCheck: "branch check"}
"""What findings are called where one is damaged."""
LIBVER = ("v110", "v110")
"""HDF5 1.10: its metadata carry checksums, and every viewer of the last years reads it."""


def write_study_start(path: str | Path, study: Study) -> None:
    """Write a results file with `study` and the records it has so far (usually none), replacing any file at `path`.

    Errors: `StoreError` where the file cannot be written.
    """

    def fill(file: h5py.File) -> None:
        writer = Writer(file)
        file.attrs["format"] = FORMAT
        file.attrs["format_version"] = VERSION
        head = file.create_group("study")
        for name in HEAD:
            writer.put(head, name, getattr(study, name))
        head.attrs["@digest"] = writer.digest(tuple(getattr(study, name) for name in HEAD))
        file.create_group("records")
        for record in study.records:
            _add(file, "records", writer, record)
        for group in FINDINGS.values():
            for finding in getattr(study, group):
                _add(file, group, writer, finding)

    _replace(Path(path), "w", fill)


def append_record(path: str | Path, record: Record) -> None:
    """Add one recorded state to the results file at `path`; within its loading path the states come in their order.

    The file is read into memory, extended there, written beside the old one and put in its place in one step, so
    that at every moment the file at `path` is complete, with or without the new record.

    Errors: `StoreError` where there is no results file at `path`, or it cannot be written.
    """

    _append(path, "records", record)


def append_finding(path: str | Path, finding: Finding) -> None:
    """Add a finding about a recorded state to the results file at `path`, in the manner of `append_record`.

    Errors: `StoreError` as there.
    """
    _append(path, FINDINGS[type(finding)], finding)


def load_study(path: str | Path) -> Study:
    """Everything that was computed, bit for bit, with locked arrays; checked against the digests in the file.

    Errors: `StoreError` where the file is missing, foreign, damaged, or of a newer layout.
    """

    def read(file: h5py.File) -> Study:
        _check_layout(file)
        reader, digest = Reader(registry(Study)), Digests()
        head = tuple(reader.get(file["study"], name) for name in HEAD)
        if file["study"].attrs["@digest"] != digest(head):
            raise StoreError("its content does not match its digest")
        study = Study(**dict(zip(HEAD, head, strict=True)), records=())
        records = _in_order(study.design, _members(file["records"], "record", reader, digest))
        study = replace(study, records=records)
        for kind, group in FINDINGS.items():
            for finding in _members(file[group], NAMES[kind], reader, digest) if group in file else ():
                study = with_finding(study, finding)
        return study

    path = Path(path)
    if not path.is_file():
        raise StoreError(f"{path}: there is no results file here")
    with _as_store_error(path, "cannot be read"), h5py.File(path, "r", locking=False) as file:
        return read(file)


def _in_order(design: Design, records: Sequence[Record]) -> tuple[Record, ...]:
    """The records path by path, whatever the order in which the paths came on; within a path it is theirs."""
    rank = {"": 0} | {loading.name: number for number, loading in enumerate(design.loading, start=1)}
    return tuple(sorted(records, key=lambda record: rank[record.path]))


def _append(path: str | Path, group: str, value: Record | Finding) -> None:
    def fill(file: h5py.File) -> None:
        _check_layout(file)
        _add(file, group, Writer(file), value)

    _replace(Path(path), "r+", fill)


def _add(file: h5py.File, group: str, writer: Writer, value: Record | Finding) -> None:
    members = file.require_group(group)
    name = _name(len(members))
    writer.put(members, name, value)
    members.attrs[f"@digest {name}"] = writer.digest(value)


def _members(group: h5py.Group, what: str, reader: Reader, digest: Digests) -> tuple[Any, ...]:
    """The members of a group in the order of their numbers, each checked against its digest."""
    names = [_name(number) for number in range(len(group))]
    members = tuple(reader.get(group, name) for name in names)
    for name, member in zip(names, members, strict=True):
        if group.attrs[f"@digest {name}"] != digest(member):
            raise StoreError(f"{what} {name} does not match its digest")
    return members


def _name(number: int) -> str:
    return f"{number:04d}"


def _check_layout(file: h5py.File) -> None:
    if file.attrs.get("format") != FORMAT:
        raise StoreError("this is not a results file of circuittex")
    version = file.attrs["format_version"]
    if version != VERSION:
        raise StoreError(f"its layout is version {version}; this circuittex reads version {VERSION}")


def _replace(path: Path, mode: str, fill: Callable[[h5py.File], None]) -> None:
    # HDF5 works in memory only: a full disk then meets plain Python I/O, from which one can recover, and not the HDF5
    # library, which cannot close a file it could not flush. Nor does it lock: the file that somebody reads is never
    # changed, only replaced.
    if mode == "r+" and not path.is_file():
        raise StoreError(f"{path}: there is no results file here")
    with _as_store_error(path, "cannot be written"):
        with h5py.File(path, mode, driver="core", backing_store=False, libver=LIBVER, locking=False) as file:
            fill(file)
            file.flush()
            image = file.id.get_file_image()
        with replacing(path) as partial:
            partial.write_bytes(image)


@contextlib.contextmanager
def _as_store_error(path: Path, what: str) -> Iterator[None]:
    # h5py reports damage in many ways (OSError, KeyError, RuntimeError, ...), and a damaged design fails validation.
    try:
        yield
    except (CircuittexError, OSError, KeyError, ValueError, TypeError, RuntimeError, AttributeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise StoreError(f"{path} {what}: {reason}") from error
