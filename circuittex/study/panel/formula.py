"""Formulas of x and y in text: arithmetic and some functions, and nothing else that Python can do."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.design.checks import refuse

LONGEST = 500
"""Characters of a formula at most."""
_DEEPEST = 100

_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_UNARY: dict[type, Callable[[Any], Any]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}
_COMPARISONS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_FUNCTIONS: dict[str, tuple[Callable[..., Any], int]] = {
    **{name: (getattr(np, name), 1) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "abs", "tanh", "floor")},
    **{"min": (np.minimum, 2), "max": (np.maximum, 2), "hypot": (np.hypot, 2), "where": (np.where, 3)},
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
    try:
        tree = ast.parse(text.strip().replace("^", "**"), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise refuse(field, text, f"it must be a formula of {', '.join(variables)}: {ALLOWED}") from None
    with np.errstate(all="ignore"):
        found = _value(tree, variables, text, field, 0)
    shape = np.broadcast_shapes(*(np.shape(each) for each in variables.values()))
    values = np.broadcast_to(np.asarray(found, dtype=np.float64), shape)
    if not np.isfinite(values).all():
        raise refuse(field, text, f"it must be finite everywhere; {int((~np.isfinite(values)).sum())} values are not")
    return np.array(values)


def _value(node: ast.AST, variables: Mapping[str, Floats], text: str, field: str, depth: int) -> Any:
    """The value of one node of the syntax tree; whatever is not listed is refused."""

    def of(inner: ast.AST) -> Any:
        return _value(inner, variables, text, field, depth + 1)

    if depth > _DEEPEST:
        raise refuse(field, text, "the formula is nested too deeply")
    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as number):
            try:
                return np.float64(number)  # a float: powers of whole numbers could grow without end
            except OverflowError:
                raise refuse(field, text, "a number in it is too large") from None
        case ast.Name(id=name) if name in variables:
            return variables[name]
        case ast.Name(id="pi"):
            return np.pi
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            return _BINARY[type(op)](of(left), of(right))
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _UNARY:
            return _UNARY[type(op)](of(operand))
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARISONS:
            return np.where(_COMPARISONS[type(op)](of(left), of(right)), 1.0, 0.0)
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in _FUNCTIONS:
            function, count = _FUNCTIONS[name]
            if len(arguments) != count:
                raise refuse(field, text, f"{name} takes {count} argument{'s' * (count > 1)}")
            return function(*map(of, arguments))
        case _:
            pass
    raise refuse(field, text, f"it may consist of {', '.join(variables)}, {ALLOWED}")
