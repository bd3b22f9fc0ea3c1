"""Frozen result dataclasses whose NumPy arrays are locked against writing."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, TypeVar, dataclass_transform

import numpy as np

T = TypeVar("T")


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(field,))
def frozen(cls: type[T]) -> type[T]:
    """Make `cls` a frozen dataclass whose array fields are read-only copies.

    ``dataclass(frozen=True)`` protects the attribute, not the memory behind it; this protects both.

    >>> import numpy as np
    >>> @frozen
    ... class Sample:
    ...     values: np.ndarray
    >>> Sample(np.zeros(2)).values[0] = 1.0
    Traceback (most recent call last):
    ValueError: assignment destination is read-only
    """
    inner = getattr(cls, "__post_init__", None)

    def lock(self: Any) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(value, np.ndarray) and value.flags.writeable:
                locked = value.copy()
                locked.setflags(write=False)
                object.__setattr__(self, each.name, locked)
        if inner is not None:
            inner(self)

    def restore(self: Any, state: dict[str, Any]) -> None:
        # What comes from another process, or is a copy, has writeable arrays of its own.
        for name, value in state.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, name, value)

    cls.__post_init__ = lock  # type: ignore[attr-defined]
    cls.__setstate__ = restore  # type: ignore[attr-defined]
    return dataclass(frozen=True, eq=False)(cls)


def same(a: object, b: object) -> bool:
    """Whether two results hold the same values, bit for bit (NaN equals NaN).

    >>> same((1.0, "x"), (1.0, "x"))
    True
    """
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if is_dataclass(a) and not isinstance(a, type):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, float) and a != a:
        return b != b
    return bool(a == b)
