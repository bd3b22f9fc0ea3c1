"""The results of a study in one HDF5 file that grows by one recorded state at a time and is complete at any moment."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py

from circuittex.errors import CircuittexError, StoreError
from circuittex.results import Record, Study
from circuittex.store.archive import Digests, Reader, Writer, registry

FORMAT = "circuittex results"
VERSION = 1
"""Version of the file layout; files of another layout are refused."""
HEAD = ("version", "design", "design_hash", "mesh", "initial")
"""The fields of a `Study` that are known before its first record."""
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
            _add(file, writer, record)

    _replace(Path(path), "w", fill)


def append_record(path: str | Path, record: Record) -> None:
    """Add one recorded state to the results file at `path`.

    The file is read into memory, extended there, written beside the old one and put in its place in one step, so
    that at every moment the file at `path` is complete, with or without the new record.

    Errors: `StoreError` where there is no results file at `path`, or it cannot be written.
    """

    def fill(file: h5py.File) -> None:
        _check_layout(file)
        _add(file, Writer(file), record)

    _replace(Path(path), "r+", fill)


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
        names = [_record_name(number) for number in range(len(file["records"]))]
        records = tuple(reader.get(file["records"], name) for name in names)
        for name, record in zip(names, records, strict=True):
            if file["records"].attrs[f"@digest {name}"] != digest(record):
                raise StoreError(f"record {name} does not match its digest")
        return Study(**dict(zip(HEAD, head, strict=True)), records=records)

    path = Path(path)
    if not path.is_file():
        raise StoreError(f"{path}: there is no results file here")
    with _as_store_error(path, "cannot be read"), h5py.File(path, "r") as file:
        return read(file)


def _add(file: h5py.File, writer: Writer, record: Record) -> None:
    records = file["records"]
    name = _record_name(len(records))
    writer.put(records, name, record)
    records.attrs[f"@digest {name}"] = writer.digest(record)


def _record_name(number: int) -> str:
    return f"{number:04d}"


def _check_layout(file: h5py.File) -> None:
    if file.attrs.get("format") != FORMAT:
        raise StoreError("this is not a results file of circuittex")
    version = file.attrs["format_version"]
    if version != VERSION:
        raise StoreError(f"its layout is version {version}; this circuittex reads version {VERSION}")


def _replace(path: Path, mode: str, fill: Callable[[h5py.File], None]) -> None:
    # HDF5 works in memory only: a full disk then meets plain Python I/O, from which one can recover, and not the HDF5
    # library, which cannot close a file it could not flush.
    partial = path.with_name(path.name + ".partial")
    if mode == "r+" and not path.is_file():
        raise StoreError(f"{path}: there is no results file here")
    with _as_store_error(path, "cannot be written"):
        with h5py.File(path, mode, driver="core", backing_store=False, libver=LIBVER) as file:
            fill(file)
            file.flush()
            image = file.id.get_file_image()
        try:
            with partial.open("wb") as out:
                out.write(image)
                out.flush()
                os.fsync(out.fileno())
            partial.replace(path)
        except OSError:
            partial.unlink(missing_ok=True)
            raise
        _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    # The rename itself must survive a power cut; Windows has no such call and needs none.
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


@contextlib.contextmanager
def _as_store_error(path: Path, what: str) -> Iterator[None]:
    # h5py reports damage in many ways (OSError, KeyError, RuntimeError, ...), and a damaged design fails validation.
    try:
        yield
    except (CircuittexError, OSError, KeyError, ValueError, TypeError, RuntimeError, AttributeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise StoreError(f"{path} {what}: {reason}") from error
