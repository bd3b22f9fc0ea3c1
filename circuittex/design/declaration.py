"""What a key of a design is, stated once beside its field: unit, range, default, and what users are told of it.

A field of a design's dataclass carries its `Key` as metadata. The reader of TOML files, the checks of values from
Python, the lines of the starter design and the reference in the documentation follow from it; the hash and the store
take every field as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, fields
from itertools import zip_longest
from math import inf
from textwrap import wrap
from typing import Any

from circuittex.base.errors import DesignError
from circuittex.design.checks import name as checked_name
from circuittex.design.checks import one_of, real, refuse, store, truth, whole
from circuittex.design.table import Table, quantity

_KEY = "key"
_COMMENT = 42
"""Column at which the comments of the starter design begin."""
_WIDTH = 118
"""Columns of its lines at most."""

Check = Callable[[object, str], object]


@dataclass(frozen=True)
class Key:
    """How the value of a field is read, checked and explained."""

    check: Check
    """(value, dotted name) -> the value, or `DesignError`."""
    read: Check
    """The same for a value from a file, before `check`: units become numbers."""
    wanted: str
    """What must be given, for the error where it is missing."""
    allowed: str
    """The range, for the documentation."""
    shown: str
    """The value in the starter design, as TOML."""
    note: str
    """What it is, in words that fit behind it on a line."""
    unit: str = "1"
    """What its number is measured in; "1" for pure ones, texts and the rest."""


def number(
    unit: str,
    note: str,
    *,
    shown: str,
    above: float = -inf,
    at_least: float = -inf,
    at_most: float = inf,
    words: tuple[str, ...] = (),
) -> Mapping[str, Key]:
    """Metadata of a field with a number in `unit` ("1": a plain one), or one of `words` in its place.

    >>> number("mm", "of every fibril", shown="0.15 mm", above=0)["key"].check(2, "radius")
    2.0
    """
    shown_unit = "" if unit == "1" else unit

    def check(value: object, field: str) -> object:
        if isinstance(value, str) and words:
            return one_of(value, field, words)
        return real(value, field, shown_unit, above=above, at_least=at_least, at_most=at_most)

    def read(value: object, field: str) -> object:
        if isinstance(value, str) and value in words:
            return value
        try:
            return quantity(value, unit, field)
        except DesignError as error:
            if not words:
                raise
            allowed = f"{error.allowed}, or {' or '.join(map(repr, words))}"
            raise DesignError(error.field, error.value, allowed) from None

    wanted = "a plain number" if unit == "1" else f"a number in {unit} or a string with a unit"
    limits = [f"> {above:g}"] * (above > -inf) + [f">= {at_least:g}"] * (at_least > -inf)
    limits += [f"<= {at_most:g}"] * (at_most < inf)
    allowed = ", ".join([*(f'"{word}"' for word in words), " and ".join(limits) or "any"])
    text = shown if _is_plain(shown) else f'"{shown}"'
    return _metadata(check, read, wanted, f"{allowed} {shown_unit}".strip(), text, note, unit)


def relative(unit: str, note: str, *, shown: str, at_most: float) -> Mapping[str, Key]:
    """Metadata of a field with a pure number, in parts of something, or with a quantity in `unit`, kept as text.

    >>> relative("N", "of forces", shown="1e-6", at_most=1)["key"].check("2 mN", "tolerance")
    '0.002 N'
    """

    def check(value: object, field: str) -> object:
        if isinstance(value, str):  # of any size: what it is compared with may be as small
            size = quantity(value, unit, field)
            if not size > 0.0:
                raise refuse(field, value, f"it must be > 0 {unit}")
            return f"{size!r} {unit}"
        return real(value, field, f"or a text in {unit}", above=0, at_most=at_most)

    wanted = f"a plain number or a string in {unit}"
    return _metadata(check, _as_it_is, wanted, f"> 0 and <= {at_most:g}, or > 0 {unit}", shown, note)


def count(note: str, at_least: int, at_most: int, *, shown: str, words: tuple[str, ...] = ()) -> Mapping[str, Key]:
    """Metadata of a field with a whole number, or one of `words` in its place.

    >>> count("of each fibril", 2, 100, shown="20")["key"].check(20, "elements")
    20
    """

    def check(value: object, field: str) -> object:
        if isinstance(value, str) and words:
            return one_of(value, field, words)
        return whole(value, field, at_least, at_most)

    allowed = ", ".join([*(f'"{word}"' for word in words), f"{at_least} to {at_most}"])
    text = shown if _is_plain(shown) else f'"{shown}"'
    return _metadata(check, _as_it_is, "a whole number", allowed, text, note)


def choice(note: str, choices: tuple[str, ...], *, shown: str) -> Mapping[str, Key]:
    """Metadata of a field with one of several words.

    >>> choice("which law", ("reference", "current"), shown="reference")["key"].allowed
    '"reference", "current"'
    """
    allowed = ", ".join(f'"{word}"' for word in choices)
    return _metadata(
        lambda value, field: one_of(value, field, choices), _as_it_is, allowed, allowed, f'"{shown}"', note
    )


def word(note: str, words: Callable[[], tuple[str, ...]], *, shown: str) -> Mapping[str, Key]:
    """Metadata of a field with one of `words()`, to which users may add: asked for when a file is read.

    In Python any name will do: results are read where what a user once added is not known.

    >>> word("which law", lambda: ("paper", "strip"), shown="paper")["key"].check("mine", "law")
    'mine'
    """
    allowed = ", ".join(f'"{each}"' for each in words()) + ", or one that was added"
    return _metadata(
        checked_name, lambda value, field: one_of(value, field, words()), allowed, allowed, f'"{shown}"', note
    )


def flag(note: str, *, shown: bool) -> Mapping[str, Key]:
    """Metadata of a field that is true or false.

    >>> flag("whether", shown=True)["key"].shown
    'true'
    """
    return _metadata(truth, _as_it_is, "true or false", "true, false", str(shown).lower(), note)


def keys(kind: type) -> dict[str, Key]:
    """The declared keys of a dataclass, in the order of its fields.

    >>> from circuittex.design import Material
    >>> list(keys(Material))[0]
    'youngs_modulus'
    """
    return {field.name: field.metadata[_KEY] for field in fields(kind) if _KEY in field.metadata}


def check(target: Any, at: str) -> None:
    """Check every declared field of a dataclass that is being made at the dotted name `at`.

    Raises `DesignError` for the first that is not usable.
    """
    store(
        target, **{name: key.check(getattr(target, name), f"{at}.{name}") for name, key in keys(type(target)).items()}
    )


def read(kind: type, table: Table, *also: str) -> dict[str, Any]:
    """The values that a table of a design gives for the declared keys of a dataclass; those left out have defaults.

    `also` are further keys of the table that the caller reads. Raises `DesignError` for an unknown key, one that is
    missing and has no default, and a value that is no number in its unit.
    """
    known = keys(kind)
    table.only((*known, *also))
    found = {}
    for name, key in known.items():
        if table.has(name) or _required(kind, name):
            found[name] = key.read(table.get(name, key.wanted), table.at(name))
    return found


def starter_lines(kind: type) -> str:
    """The lines of the starter design for the declared keys of a dataclass.

    >>> from circuittex.design import Weave
    >>> starter_lines(Weave).splitlines()[0]
    'pitch = "2.5 mm"                          # between the axes of neighbouring warp yarns'
    """
    lines = []
    for name, key in keys(kind).items():
        comment = wrap(key.note, _WIDTH - _COMMENT - len("# "))
        lines += [
            f"{start:{_COMMENT}}# {words}"
            for start, words in zip_longest([f"{name} = {key.shown}"], comment, fillvalue="")
        ]
    return "\n".join(lines)


def reference_table(kind: type) -> str:
    """The documentation's table of the declared keys of a dataclass, in Markdown.

    >>> from circuittex.design import Electrical
    >>> reference_table(Electrical).splitlines()[3]
    '| `contact_heat` | true, false | `true` | whether the Joule heat of the contacts warms the fibrils |'
    """
    rows = ["| key | allowed | default | what it is |", "|---|---|---|---|"]
    for name, key in keys(kind).items():
        default = "" if _required(kind, name) else f"`{_toml(_field(kind, name).default)}`"
        rows.append(f"| `{name}` | {key.allowed} | {default} | {key.note} |")
    return "\n".join(rows)


def _metadata(
    read_check: Check, read_value: Check, wanted: str, allowed: str, shown: str, note: str, unit: str = "1"
) -> dict[str, Key]:
    return {_KEY: Key(read_check, read_value, wanted, allowed, shown, note, unit)}


def _as_it_is(value: object, field: str) -> object:
    return value


def _is_plain(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _field(kind: type, name: str) -> Field[Any]:
    return next(field for field in fields(kind) if field.name == name)


def _required(kind: type, name: str) -> bool:
    return _field(kind, name).default is MISSING


def _toml(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else f'"{value}"' if isinstance(value, str) else f"{value:g}"
