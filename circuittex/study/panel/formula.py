"""Formulas of x and y in text: arithmetic and some functions, and nothing else that Python can do."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from circuittex.base import expression
from circuittex.base.arrays import Floats
from circuittex.base.expression import Language
from circuittex.design.checks import refuse

LONGEST = 500
"""Characters of a formula at most."""

_FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    **{name: (1, getattr(np, name)) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "abs", "tanh", "floor")},
    **{"min": (2, np.minimum), "max": (2, np.maximum), "hypot": (2, np.hypot), "where": (3, np.where)},
}
_COMPARISONS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
_CALLS: dict[str, Callable[..., Any]] = {
    **{"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "^": operator.pow},
    "negative": operator.neg,
    **{name: function for name, (_, function) in _FUNCTIONS.items()},
}
ALLOWED = "numbers, + - * / ^ ( ), comparisons, pi, and " + ", ".join(_FUNCTIONS)
"""What a formula may consist of, in words."""


def evaluate(text: str, variables: Mapping[str, Floats], field: str) -> Floats:
    """The values of a formula for arrays of its variables, which are broadcast against one another.

    >>> evaluate("0.1 * exp(-(x^2 + y^2) / 2)", {"x": np.array([0.0, 1.0]), "y": np.array([0.0])}, "strain").round(6)
    array([0.1     , 0.060653])
    >>> evaluate("__import__('os')", {}, "strain")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    circuittex.base.errors.DesignError: strain: "__import__('os')" is not usable; ...

    Raises `DesignError` for anything else than a formula, and where a value is not finite.
    """
    if len(text) > LONGEST:
        raise refuse(field, text, f"a formula has at most {LONGEST} characters")
    known = {"pi": np.float64(np.pi), **variables}
    try:
        steps = expression.compile_expression(text, _PANEL)
        with np.errstate(all="ignore"):
            found = expression.evaluate(steps, known.__getitem__, _call)
    except (ValueError, KeyError) as error:
        reason = f"{error.args[0]!r} is unknown" if isinstance(error, KeyError) else str(error)
        raise refuse(field, text, f"it may consist of {', '.join(variables)}, {ALLOWED}: {reason}") from None
    shape = np.broadcast_shapes(*(np.shape(each) for each in variables.values()))
    values = np.broadcast_to(np.asarray(found, dtype=np.float64), shape)
    if not np.isfinite(values).all():
        raise refuse(field, text, f"it must be finite everywhere; {int((~np.isfinite(values)).sum())} values are not")
    return np.array(values)


def _call(name: str, values: list[Any]) -> Any:
    if name in _COMPARISONS:
        return np.where(_COMPARISONS[name](*values), 1.0, 0.0)
    return _CALLS[name](*values)


def _number(token: str) -> np.float64:
    value = np.float64(token)  # powers of Python's whole numbers could grow without end
    if not np.isfinite(value):
        raise ValueError(f"{token!r} is too large")
    return value


_PANEL = Language({name: count for name, (count, _) in _FUNCTIONS.items()}, _number, LONGEST, comparisons=True)
