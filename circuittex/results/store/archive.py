"""Frozen dataclasses as a tree of HDF5 groups, without pickles: equal parts are stored once and shared.

A dataclass becomes a group whose datasets and attributes bear the names of its fields, so that any HDF5 viewer
shows what it holds. Every array, tuple and dataclass is also linked under ``/objects`` by the digest of its content;
what is there already is linked, not written again. A link costs a few bytes: the fibril mesh that every contact state
refers to, or the coordinates that three probes have in common, are in the file once, and once in memory after loading.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Set
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, get_args, get_type_hints

import h5py
import numpy as np

from circuittex.base.errors import StoreError
from circuittex.base.version import __version__
from circuittex.results.store.meaning import meanings, summary, unit

TYPE = "@type"
"""Attribute with the kind of an HDF5 object; no field can have this name."""
MEANING, UNIT, ATTRIBUTES = "description", "unit", "about"
"""Attributes for readers of the file: what an object is, its unit, and what the other attributes of a group are."""
RESERVED = {MEANING, ATTRIBUTES}
"""Attributes of groups that are no fields."""

Former = Mapping[str, Mapping[str, str]]
"""Dataclass -> field -> the name that it has in files of an older layout."""
_SCALARS = (bool, int, float, str)
_COMPRESS_ABOVE = 256  # elements; below, chunking costs more than compression saves


def registry(root: type) -> dict[str, type]:
    """The dataclasses that occur in the annotations of `root`, by name: what a file may ask to be built.

    >>> from circuittex.mech.configuration import Configuration
    >>> registry(Configuration)
    {'Configuration': <class 'circuittex.mech.configuration.Configuration'>}
    """
    found: dict[str, type] = {}
    pending: list[Any] = [root]
    while pending:
        kind = pending.pop()
        pending.extend(get_args(kind))
        if isinstance(kind, type) and is_dataclass(kind) and found.get(kind.__name__) is not kind:
            if kind.__name__ in found:
                raise TypeError(f"two result types are called {kind.__name__}")
            found[kind.__name__] = kind
            pending.extend(get_type_hints(kind).values())
    return found


class Digests:
    """Content digests; remembers the objects it has seen, which must stay alive and unchanged meanwhile.

    `without` names fields of dataclasses that do not count: those that an older file lacks. `former` has the names
    under which an older file counts fields: dataclass -> field -> its name there.
    """

    def __init__(self, without: Mapping[str, Set[str]] | None = None, former: Former | None = None) -> None:
        self._known: dict[int, tuple[object, str]] = {}
        self._without = without if without is not None else {}
        self._former = former if former is not None else {}

    def __call__(self, value: object) -> str:
        """Digest of arrays, scalars, tuples and dataclasses; equal exactly for equal types and equal bits.

        >>> digest = Digests()
        >>> digest((1.0, "a")) == digest((1.0, "a")), digest(1) == digest(1.0), digest(0.0) == digest(-0.0)
        (True, False, False)
        """
        if id(value) in self._known:
            return self._known[id(value)][1]
        result = hashlib.blake2b(digest_size=16)
        if isinstance(value, (np.ndarray, np.generic)):
            result.update(f"{type(value).__name__}{value.dtype.str}{value.shape}".encode())
            result.update(np.ascontiguousarray(value).data)
        elif isinstance(value, tuple):
            result.update(f"tuple{len(value)}".encode())
            result.update("".join(map(self, value)).encode())
        elif is_dataclass(value) and not isinstance(value, type):
            result.update(type(value).__name__.encode())
            lacking = self._without.get(type(value).__name__, set())
            former = self._former.get(type(value).__name__, {})
            for field in fields(value):
                if field.name not in lacking:
                    result.update(f"{former.get(field.name, field.name)}={self(getattr(value, field.name))}".encode())
        elif value is None or type(value) in _SCALARS:
            text = value.hex() if isinstance(value, float) else repr(value)
            result.update(f"{type(value).__name__}{text}".encode())
        else:
            raise StoreError(f"cannot store a {type(value).__name__}")
        self._known[id(value)] = (value, result.hexdigest())
        return result.hexdigest()


class Writer:
    """Writes objects into an open HDF5 file, each with what it means and its unit."""

    def __init__(self, file: h5py.File) -> None:
        self._shared = file.require_group("objects")
        self.digest = Digests()

    def put(self, parent: h5py.Group, name: str, value: object, meaning: str = "") -> None:
        """Write `value` into `parent`: scalars as attributes, everything else as linked objects.

        `meaning` is what a reader of the file is told of it. Equal objects of equal meaning are in the file once.
        """
        if value is None:
            parent.attrs[name] = h5py.Empty("f8")
        elif type(value) in _SCALARS:
            parent.attrs[name] = _scalar(value)
        else:
            key = self.digest(value)
            if meaning:
                key += hashlib.blake2b(meaning.encode(), digest_size=4).hexdigest()
            if key not in self._shared:
                self._create(key, value, meaning)
            parent[name] = self._shared[key]

    def _create(self, key: str, value: object, meaning: str) -> None:
        if isinstance(value, (np.ndarray, np.generic)):
            if value.dtype.kind not in "biufc":
                raise StoreError(f"cannot store an array of {value.dtype}")
            packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True, "chunks": value.shape}
            stored = self._shared.create_dataset(key, data=value, **(packed if value.size > _COMPRESS_ABOVE else {}))
            stored.attrs[TYPE] = "array" if isinstance(value, np.ndarray) else "scalar"
        elif isinstance(value, tuple) and value and type(value[0]) in _SCALARS and len(set(map(type, value))) == 1:
            data = [_scalar(item) for item in value]
            stored = self._shared.create_dataset(key, data=data, dtype=_dtype(type(value[0])))
            stored.attrs[TYPE] = "tuple"
        elif isinstance(value, tuple):
            stored = self._shared.create_group(key)
            stored.attrs[TYPE] = "tuple"
            stored.attrs["@length"] = len(value)
            for number, item in enumerate(value):
                self.put(stored, f"{number:04d}", item, _told(item, meaning))
        else:
            stored = self._shared.create_group(key)
            stored.attrs[TYPE] = type(value).__name__
            self.fields(stored, value)
        if meaning:
            stored.attrs[MEANING] = meaning
            if isinstance(stored, h5py.Dataset) and stored.dtype.kind in "iufc":
                stored.attrs[UNIT] = unit(meaning)

    def fields(self, group: h5py.Group, value: Any) -> None:
        """Write the fields of a dataclass into a group; what its plain numbers and texts mean is an attribute."""
        told = meanings(type(value))
        scalars = []
        for field in fields(value):
            content = getattr(value, field.name)
            meaning = _told(content, told.get(field.name, ""))
            self.put(group, field.name, content, meaning)
            if meaning and (content is None or type(content) in _SCALARS):
                of = f" [{unit(meaning)}]" if type(content) in (int, float) else ""
                scalars.append(f"{field.name}{of}: {meaning}")
        if scalars:
            group.attrs[ATTRIBUTES] = "\n".join(scalars)


class Reader:
    """Rebuilds objects from an open HDF5 file; what is one object in the file becomes one object in memory.

    `former` are names of fields in files of an older layout, `author` the version of circuittex that wrote the file.
    """

    def __init__(self, types: Mapping[str, type], former: Former | None = None, author: str = "unknown") -> None:
        self._types, self._author = types, author
        self._former = former if former is not None else {}
        self._built: dict[int, Any] = {}
        self.lacking: dict[str, set[str]] = {}
        """Dataclass -> fields that it has by default here and that the file lacks."""

    def get(self, parent: h5py.Group, name: str) -> Any:
        """The value that `Writer.put` stored under `name`."""
        if name in parent.attrs:
            value = parent.attrs[name]
            return None if isinstance(value, h5py.Empty) else value if isinstance(value, str) else value.item()
        stored = parent[name]
        address = h5py.h5o.get_info(stored.id).addr
        if address not in self._built:
            self._built[address] = self._build(stored)
        return self._built[address]

    def _build(self, stored: h5py.Dataset | h5py.Group) -> Any:
        kind = stored.attrs[TYPE]
        if isinstance(stored, h5py.Dataset):
            if kind == "tuple":
                text = h5py.check_string_dtype(stored.dtype) is not None
                return tuple((stored.asstr()[()] if text else stored[()]).tolist())
            value = stored[()]
            if kind == "array":
                value = np.asarray(value)
                value.setflags(write=False)
            return value
        if kind == "tuple":
            return tuple(self.get(stored, f"{number:04d}") for number in range(int(stored.attrs["@length"])))
        if kind not in self._types:
            raise StoreError(f"unknown type {kind!r}; {reader_of(self._author)}")
        return self.dataclass(stored, self._types[kind])

    def dataclass(self, stored: h5py.Group, kind: type) -> Any:
        """The dataclass whose fields are in a group; those that an older version did not have take their defaults."""
        former = self._former.get(kind.__name__, {})
        present = {former.get(field.name, field.name): field.name for field in fields(kind)}
        names = set(present.values())
        found = {name for name in (*stored, *stored.attrs) if name not in RESERVED and not name.startswith("@")}
        there = {present.get(name, name) for name in found}
        optional = {f.name for f in fields(kind) if f.default is not MISSING or f.default_factory is not MISSING}
        if there - names or names - there - optional:
            raise StoreError(
                f"the fields of {kind.__name__} are not those of circuittex {__version__}; {reader_of(self._author)}"
            )
        if names - there:
            self.lacking[kind.__name__] = names - there
        return kind(**{name: self.get(stored, former.get(name, name)) for name in names & there})


def reader_of(author: str) -> str:
    """Who can read what this circuittex cannot."""
    return f"circuittex {author} wrote it and can read it"


def _told(value: object, meaning: str) -> str:
    """What a reader is told of a part: of a dataclass the same wherever it stands, so that it is one object, shared."""
    return summary(type(value)) if is_dataclass(value) and not isinstance(value, type) else meaning


def _scalar(value: Any) -> Any:
    if isinstance(value, str):
        if "\0" in value or any("\ud800" <= letter <= "\udfff" for letter in value):
            raise StoreError(f"cannot store the text {value!r}: NUL and lone surrogates are not allowed")
        return value
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise StoreError(f"cannot store the integer {value}: at most 64 bits are allowed")
    return _dtype(type(value)).type(value)


def _dtype(kind: type) -> np.dtype[Any]:
    text: np.dtype[Any] = h5py.string_dtype()
    return text if kind is str else np.dtype({bool: np.bool_, int: np.int64, float: np.float64}[kind])
