"""A table of a design: its keys, types and units, each complaint with the dotted name of the key."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from difflib import get_close_matches
from typing import TypeVar

from circuittex.design import units
from circuittex.design.checks import NOTHING, refuse

T = TypeVar("T")
_BARE = re.compile(r"[A-Za-z0-9_-]+", re.ASCII)
_LONGEST_KEY = 60  # characters shown of one


class Table:
    """A mapping at a dotted name of the design, of which only `known` keys may be used; any, where they are None."""

    def __init__(self, value: object, field: str, known: tuple[str, ...] | None = None) -> None:
        if not isinstance(value, Mapping):
            raise refuse(field or "design", value, f"it must be a table{field and f' [{field}]'}")
        self.value, self.field = value, field
        for key in value:
            if not isinstance(key, str):
                raise refuse(field or "design", key, "keys must be text")
        if known is not None:
            self.only(known)

    def only(self, known: tuple[str, ...]) -> None:
        """Refuse keys that are not known."""
        for key in self.value:
            if key not in known:
                raise refuse(self.at(key), self.value[key], _unknown(key, known))

    def at(self, key: str) -> str:
        """Dotted name of a key."""
        shown = key if _BARE.fullmatch(key) else json.dumps(key)
        if len(shown) > _LONGEST_KEY:
            shown = shown[:_LONGEST_KEY] + "..."
        return f"{self.field}.{shown}" if self.field else shown

    def has(self, key: str) -> bool:
        return key in self.value

    def get(self, key: str, wanted: str) -> object:
        """The value of a key that must be there."""
        if key not in self.value:
            raise refuse(self.at(key), NOTHING, f"the key is missing: {wanted}")
        return self.value[key]

    def number(self, key: str, unit: str) -> float:
        wanted = "a plain number" if unit == "1" else f"a number in {unit} or a string with a unit"
        return quantity(self.get(key, wanted), unit, self.at(key))

    def text(self, key: str, wanted: str) -> str:
        value = self.get(key, wanted)
        if not isinstance(value, str):
            raise refuse(self.at(key), value, f"it must be text: {wanted}")
        return value

    def items(self, key: str, wanted: str) -> list[object]:
        value = self.get(key, wanted)
        if not isinstance(value, list | tuple):
            raise refuse(self.at(key), value, f"it must be a list: {wanted}")
        return list(value)


def quantity(value: object, unit: str, field: str) -> float:
    """A number in `unit`, whatever unit it is spelled in."""
    if not isinstance(value, int | float | str):
        raise refuse(field, value, "it must be a plain number" if unit == "1" else f"it must be a number in {unit}")
    return units.parse(value, unit, field)


def choose(value: object, field: str, known: Mapping[str, T]) -> T:
    """The one of known things that a text names."""
    if not isinstance(value, str) or value not in known:
        raise refuse(field, value, "it must be one of " + ", ".join(map(repr, known)))
    return known[value]


def _unknown(key: str, known: tuple[str, ...]) -> str:
    close = get_close_matches(key, known, n=1, cutoff=0.6)
    if close:
        return f"it is an unknown key, did you mean {close[0]!r}?"
    return "it is an unknown key; the keys known here are " + ", ".join(known)
