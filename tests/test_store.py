"""The results file: bit-for-bit round trips, sharing, and safety against kills, full disks and damage."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_study import synthetic_study

from circuittex.base.errors import StoreError
from circuittex.base.frozen import frozen, same
from circuittex.design import plain_weave
from circuittex.results.records import Study
from circuittex.results.store import append_record, load_study, write_study_start
from circuittex.results.store.archive import Digests, Reader, Writer, registry

STUDY = synthetic_study(2, contacts=40)
ANOTHER = replace(STUDY.records[0], name="another")


@frozen
class Inner:
    values: np.ndarray
    label: str


@frozen
class Outer:
    first: Inner
    second: Inner
    anything: object


def round_trip(value: object) -> object:
    with h5py.File("memory", "w", driver="core", backing_store=False) as file:
        Writer(file).put(file, "value", value)
        return Reader(registry(Outer)).get(file, "value")


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    path = tmp_path / "results.h5"
    write_study_start(path, STUDY)
    return path


def test_study_comes_back_bit_for_bit(stored: Path) -> None:
    loaded = load_study(stored)
    assert same(loaded, STUDY)
    assert Digests()(loaded) == Digests()(STUDY)  # also the sign of zeros, which == does not see


def test_states_appended_one_by_one_give_the_same_study(tmp_path: Path) -> None:
    path = tmp_path / "results.h5"
    write_study_start(path, replace(STUDY, records=()))
    assert load_study(path).records == ()
    for number, record in enumerate(STUDY.records):
        append_record(path, record)
        assert len(load_study(path).records) == number + 1
    assert same(load_study(path), STUDY)
    assert [file.name for file in tmp_path.iterdir()] == ["results.h5"]


def test_loaded_arrays_are_locked(stored: Path) -> None:
    with pytest.raises(ValueError, match="read-only"):
        load_study(stored).records[0].contacts.xi_a[0] = 1.0


def test_the_mesh_is_one_object_and_is_stored_once(stored: Path, tmp_path: Path) -> None:
    loaded = load_study(stored)
    assert all(record.contacts.mesh is loaded.mesh for record in loaded.records)
    assert loaded.records[0].fields[0].xi is loaded.records[0].fields[1].xi
    empty = tmp_path / "empty.h5"
    write_study_start(empty, replace(STUDY, records=()))
    mesh_bytes = sum(a.nbytes for a in vars(STUDY.mesh).values() if isinstance(a, np.ndarray))
    record = STUDY.records[0]
    states = [record.configuration.x, *(a for a in vars(record.contacts).values() if isinstance(a, np.ndarray))]
    for fields in record.fields:
        states += [a for a in vars(fields).values() if isinstance(a, np.ndarray)]
    growth = (stored.stat().st_size - empty.stat().st_size) / len(STUDY.records)
    assert growth < sum(a.nbytes for a in states) + mesh_bytes / 2


def test_the_file_reads_well_in_any_viewer(stored: Path) -> None:
    with h5py.File(stored) as file:
        assert file.attrs["format"] == "circuittex results"
        first = file["states/relaxed"]
        assert first.attrs["strain"] == 0.0
        np.testing.assert_array_equal(first["contacts/line_load"][()], STUDY.records[0].contacts.line_load)
        kinds: set[str] = set()
        file.visititems(lambda _, item: kinds.add(item.dtype.kind) if isinstance(item, h5py.Dataset) else None)
        file["states"].visititems(lambda _, item: kinds.add(item.attrs["@type"]) or None)
    assert "V" not in kinds
    assert {"Record", "ContactState", "Fields", "Fit"} <= kinds


@pytest.mark.parametrize(
    "array",
    [
        np.array([np.nan, -0.0, np.inf, 5e-324]),
        np.empty((0, 3)),
        np.array(2.5),
        np.arange(3000, dtype=np.int32).reshape(2, -1),
        np.asfortranarray(np.arange(600.0).reshape(20, 30)),
        np.array([True, False]),
        np.array([1 + 2j]),
        np.arange(3, dtype=">f8"),
    ],
    ids=lambda array: f"{array.dtype}{array.shape}",
)
def test_arrays(array: np.ndarray) -> None:
    loaded = round_trip(array)
    assert isinstance(loaded, np.ndarray)
    assert (loaded.dtype, loaded.shape, loaded.tobytes()) == (array.dtype, array.shape, array.tobytes())


scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(),
    st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0")),
)


@given(st.recursive(scalars, lambda inner: st.lists(inner, max_size=4).map(tuple), max_leaves=12))
def test_nested_tuples_of_scalars(value: object) -> None:
    assert same(round_trip(value), value)


def test_equal_parts_are_shared_and_numpy_scalars_keep_their_type() -> None:
    inner = Inner(np.arange(3.0), "ä\n")
    loaded = round_trip(Outer(inner, Inner(np.arange(3.0), "ä\n"), np.float32(0.1)))
    assert isinstance(loaded, Outer)
    assert loaded.first is loaded.second
    assert same(loaded.first, inner)
    assert type(loaded.anything) is np.float32


@pytest.mark.parametrize("value", [{"a": 1}, [1], "a\0b", "\ud800", 2**63, np.array(["text"]), np.array([None]), 1j])
def test_what_cannot_be_stored_is_refused(value: object) -> None:
    with pytest.raises(StoreError, match="cannot store"):
        round_trip(value)


def test_only_result_types_are_built() -> None:
    with h5py.File("memory", "w", driver="core", backing_store=False) as file:
        Writer(file).put(file, "value", Outer(Inner(np.zeros(1), ""), Inner(np.ones(1), ""), None))
        with pytest.raises(StoreError, match="unknown type 'Outer'"):
            Reader(registry(Study)).get(file, "value")


def test_a_type_with_other_fields_is_refused(stored: Path) -> None:
    with h5py.File(stored, "r+") as file:
        del file["states/relaxed"].attrs["strain"]
    assert_refused(stored, "the fields of Record are not those of")
    assert_refused(stored, "circuittex 0.0.0 wrote it and can read it")


def test_missing_file(tmp_path: Path) -> None:
    for call in (load_study, lambda path: append_record(path, STUDY.records[0])):
        with pytest.raises(StoreError, match="no results file"):
            call(tmp_path / "none.h5")
    with pytest.raises(StoreError, match="cannot be written"):
        write_study_start(tmp_path / "no folder" / "results.h5", STUDY)


@pytest.mark.parametrize("content", [b"", b"not HDF5 at all", b"\x89HDF\r\n\x1a\n" + bytes(200)])
def test_not_hdf5(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "results.h5"
    path.write_bytes(content)
    assert_refused(path, "cannot be read")


def test_foreign_hdf5_and_other_layouts(stored: Path, tmp_path: Path) -> None:
    foreign = tmp_path / "foreign.h5"
    with h5py.File(foreign, "w") as file:
        file["x"] = 1.0
    assert_refused(foreign, "not a results file of circuittex")
    with h5py.File(stored, "r+") as file:
        file.attrs["format_version"] = 99
    assert_refused(stored, "layout is version 99")
    assert_refused(stored, "circuittex 0.0.0 wrote it and can read it")
    with pytest.raises(StoreError, match="layout is version 99"):
        append_record(stored, ANOTHER)


@pytest.mark.parametrize("part", [0.02, 0.3, 0.7, 0.99])
def test_truncated_file(stored: Path, part: float) -> None:
    content = stored.read_bytes()
    stored.write_bytes(content[: int(part * len(content))])
    assert_refused(stored, "cannot be read")


def test_a_changed_value_is_noticed(stored: Path) -> None:
    with h5py.File(stored, "r+") as file:
        file["states/stretch-0.0250"].attrs["strain"] = 0.5
    assert_refused(stored, "record stretch-0.0250 does not match its digest")


def test_flipped_bits_are_noticed_or_harmless(stored: Path) -> None:
    content = stored.read_bytes()
    refused = 0
    for position in np.random.default_rng(5).integers(0, len(content), 25):
        damaged = bytearray(content)
        damaged[position] ^= 0x10
        stored.write_bytes(damaged)
        try:
            assert same(load_study(stored), STUDY)
        except StoreError:
            refused += 1
    assert refused > 5  # most of the file is content, not padding


def assert_refused(path: Path, reason: str) -> None:
    with pytest.raises(StoreError, match=re.escape(reason)) as caught:
        load_study(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_records_of_loadings_that_came_on_side_by_side_are_loaded_in_order(tmp_path: Path) -> None:
    study = synthetic_study(3, contacts=10, rows=(1,), loadings=("stretch", "shear"))
    path = tmp_path / "results.h5"
    write_study_start(path, replace(study, records=()))
    for number in (0, 3, 1, 4, 2):
        append_record(path, study.records[number])
    assert same(load_study(path), study)


def test_a_folder_stands_for_its_file(stored: Path) -> None:
    assert same(load_study(stored.parent), STUDY)
    with pytest.raises(StoreError, match="no results file"):
        load_study(stored.parent.parent / "elsewhere")


def test_a_state_is_kept_once(stored: Path) -> None:
    with pytest.raises(StoreError, match="states/relaxed already"):
        append_record(stored, STUDY.records[0])
    assert same(load_study(stored), STUDY)


OLD = Path(__file__).parent / "data" / "results_version_1.h5"
"""Written by the package before layout 2: `synthetic_study(2, contacts=2, rows=(1,))` of 2 x 2 yarns with the fields of
the first probe alone, an error estimate and a branch check of its second state."""


def test_a_file_of_version_1_is_read_with_defaults(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synthetic_study.plain_weave", partial(plain_weave, yarns=2))
    expected = synthetic_study(2, contacts=2, rows=(1,))
    study = load_study(OLD)
    for old, new in zip(study.records, expected.records, strict=True):
        for name in ("name", "loading", "strain", "configuration", "history", "end_force", "energy", "netlist"):
            assert same(getattr(old, name), getattr(new, name)), name
        assert same(old.fields, new.fields[:1])
        assert same(old.contacts.line_load, new.contacts.line_load)
        assert old.verification.simulator_failed is False
        assert old.contacts.mesh is study.mesh
    assert same(study.mesh.position, expected.mesh.position)
    assert study.mesh.material_names == ()
    assert (study.errors[0].state, study.errors[0].quantities[0].coarse) == ("stretch-0.0250", 1.1)
    assert (study.branches[0].state, study.branches[0].moved) == ("stretch-0.0250", 0.25)
    assert study.design.numerics.tolerance == "1e-06 N"  # it was a number in N
    changed = tmp_path / "changed.h5"
    changed.write_bytes(OLD.read_bytes())
    with h5py.File(changed, "r+") as file:
        file["records/0001"].attrs["path"] = "elsewhere"
    assert_refused(changed, "record 0001 does not match its digest")
    with pytest.raises(StoreError, match="to which nothing can be added"):
        append_record(OLD, STUDY.records[0])
