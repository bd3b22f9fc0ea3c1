"""Checks that every part of a design shares: ranges, whole numbers, names."""

from __future__ import annotations

import re
from math import inf, isfinite
from numbers import Real
from operator import index
from typing import Any, SupportsIndex

import numpy as np

from circuittex.base.errors import DesignError

_NAME_RULE = "a name is a letter followed by at most 39 letters, digits, '_' or '-' (ASCII)"
LARGEST = 1e12
"""Largest size of any number in a design, in base units; its inverse is the smallest of a positive one."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}", re.ASCII)
_LONGEST_TITLE = 200
_LONGEST_VALUE = 60


def refuse(field: str, value: object, allowed: str) -> DesignError:
    """A `DesignError` whose value is shortened to fit on a line.

    >>> str(refuse("weave.pitch", -1.0, "it must be > 0 mm"))
    'weave.pitch: -1.0 is not usable; it must be > 0 mm'
    """
    text = " ".join(repr(value).splitlines())  # an array's has several lines
    if len(text) > _LONGEST_VALUE:
        value = _Shown(text[:_LONGEST_VALUE] + "...")
    elif text != repr(value):
        value = _Shown(text)
    return DesignError(field, value, allowed)


class _Shown:
    """Something that is printed as it stands."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __repr__(self) -> str:
        return self.text


NOTHING = _Shown("nothing")
"""Stands for the value of a key that is missing."""


def real(
    value: object, field: str, unit: str = "", *, above: float = -inf, at_least: float = -inf, at_most: float = inf
) -> float:
    """`value` as a finite float within bounds.

    >>> real(2, "weave.pitch", "mm", above=0.0)
    2.0
    """
    allowed = _range(unit, above, at_least, at_most)
    if isinstance(value, bool) or not isinstance(value, Real):
        raise refuse(field, value, f"it must be a number{allowed and ' ' + allowed}")
    try:
        number = float(value) + 0.0  # + 0.0 turns -0.0 into 0.0, which must not make two designs differ
    except OverflowError:
        number = inf
    if not isfinite(number):
        raise refuse(field, value, f"it must be finite{allowed and ' and ' + allowed}")
    if not (number > above and at_least <= number <= at_most):
        raise refuse(field, value, f"it must be {allowed}")
    # Products of a few such numbers must neither overflow nor vanish.
    if abs(number) > LARGEST or (above == 0 and number < 1 / LARGEST):
        raise refuse(field, value, f"its size must lie between {1 / LARGEST:g} and {LARGEST:g} {unit}".rstrip())
    return number


def whole(value: object, field: str, at_least: int, at_most: int) -> int:
    """`value` as a whole number within bounds.

    >>> whole(20, "numerics.elements", 2, 1000)
    20
    """
    allowed = f"it must be a whole number from {at_least} to {at_most}"
    if isinstance(value, bool) or not isinstance(value, SupportsIndex):
        raise refuse(field, value, allowed)
    try:
        number = index(value)
    except TypeError:  # an array has __index__, too, but may not be one whole number
        raise refuse(field, value, allowed) from None
    if not at_least <= number <= at_most:
        raise refuse(field, value, allowed)
    return number


def name(value: object, field: str) -> str:
    """`value` if it can name a yarn, loading, terminal or probe in files and netlists alike.

    >>> name("warp-end_1", "probes.name")
    'warp-end_1'
    """
    if not isinstance(value, str) or not is_name(value):
        raise refuse(field, value, _NAME_RULE)
    return value


def is_name(text: str) -> bool:
    """Whether `text` can be a name.

    >>> is_name("warp 1")
    False
    """
    return _NAME.fullmatch(text) is not None


def title(value: object, field: str) -> str:
    """`value` if it is one line of printable text: any language, no control characters.

    >>> title("Leinwand, 4 × 4", "name")
    'Leinwand, 4 × 4'
    """
    allowed = f"it must be one line of text, 1 to {_LONGEST_TITLE} characters, without control characters"
    if not isinstance(value, str) or not value.strip() or len(value) > _LONGEST_TITLE or not value.isprintable():
        raise refuse(field, value, allowed)
    return value


def one_of(value: object, field: str, choices: tuple[str, ...]) -> str:
    """`value` if it is one of `choices`.

    >>> one_of("reference", "electrical.conduction", ("reference", "current"))
    'reference'
    """
    if not isinstance(value, str) or value not in choices:
        raise refuse(field, value, "it must be one of " + ", ".join(map(repr, choices)))
    return value


def truth(value: object, field: str) -> bool:
    """`value` if it is true or false.

    >>> truth(True, "electrical.contact_heat")
    True
    """
    if not isinstance(value, bool):
        raise refuse(field, value, "it must be true or false")
    return value


def sequence(value: object, field: str, wanted: str) -> tuple[Any, ...]:
    """The items of a list, a tuple or a NumPy array, in which arrays are as deep tuples; `wanted` says of what.

    A generator or a set has no order or no second reading, and the letters of a text are not its items.

    >>> sequence(np.eye(2, dtype=int), "weave.draft", "rows of 0 and 1")
    ((1, 0), (0, 1))
    """
    if isinstance(value, np.ndarray) and value.ndim:
        items: list[object] = value.tolist()
        return tuple(map(_deep, items))
    if not isinstance(value, list | tuple):
        raise refuse(field, value, f"it must be a list or tuple of {wanted}")
    return tuple(value)


def _deep(item: object) -> object:
    return tuple(map(_deep, item)) if isinstance(item, list) else item


def instances(value: object, field: str, kind: type, wanted: str) -> tuple[Any, ...]:
    """The items of a sequence, each of which must be a `kind`.

    >>> instances([1, 2], "rows", int, "whole numbers")
    (1, 2)
    """
    items = sequence(value, field, wanted)
    for i, item in enumerate(items):
        instance(item, f"{field}[{i}]", kind)
    return items


def instance(value: object, field: str, kind: type) -> None:
    """Refuse what is no `kind`.

    >>> instance("silver", "name", str)
    """
    if not isinstance(value, kind):
        raise refuse(field, value, f"it must be a {kind.__name__}")


def distinct(names: tuple[str, ...], field: str) -> None:
    """Refuse names that are equal when case is ignored, as SPICE and some file systems ignore it.

    >>> distinct(("a", "b"), "probes")
    """
    seen: dict[str, str] = {}
    for item in names:
        if item.lower() in seen:
            raise refuse(
                field, item, f"the name is taken by {seen[item.lower()]!r}; names must differ in more than case"
            )
        seen[item.lower()] = item


def store(target: Any, **values: object) -> None:
    """Put checked values into a frozen dataclass that is being made.

    >>> class Target: pass
    >>> target = Target()
    >>> store(target, radius=0.15)
    >>> target.radius
    0.15
    """
    for key, value in values.items():
        object.__setattr__(target, key, value)


def _range(unit: str, above: float, at_least: float, at_most: float) -> str:
    low = f"> {above:g}" if above > -inf else f">= {at_least:g}" if at_least > -inf else ""
    high = f"<= {at_most:g}" if at_most < inf else ""
    bounds = " and ".join(filter(None, (low, high)))
    return f"{bounds} {unit}".strip() if bounds else (f"in {unit}" if unit else "")
