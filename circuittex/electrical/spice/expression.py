"""Numbers and arithmetic as SPICE writes them: suffixes, units, parameters and a few functions.

Text of others is never evaluated by Python (`circuittex.base.expression`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from circuittex.base import expression
from circuittex.base.expression import Expression, Language

LONGEST = 1000
"""Characters of one expression."""

_NUMBER = re.compile(r"(\d+\.?\d*|\.\d+)(?:e([+-]?\d{1,4}))?([a-z]*)")
_EXPONENT = {"meg": 6, "t": 12, "g": 9, "k": 3, "m": -3, "u": -6, "n": -9, "p": -12, "f": -15}
_UNIT = re.compile(r"(ohms?|volts?|amps?|amperes?|hz|s|siemens|v|r|h)?")
_MIL = 25.4e-6

FUNCTIONS: dict[str, tuple[int, Callable[..., float]]] = {
    "sqrt": (1, math.sqrt),
    "exp": (1, math.exp),
    "log": (1, math.log),
    "ln": (1, math.log),
    "abs": (1, abs),
    "min": (2, min),
    "max": (2, max),
}
"""What an expression may call, and with how many values."""
RESERVED = frozenset(
    {
        *("abs", "acos", "acosh", "agauss", "arctan", "asin", "asinh", "atan", "atanh", "aunif", "ceil", "cos", "cosh"),
        *("exp", "floor", "gauss", "int", "limit", "ln", "log", "log10", "max", "min", "nint", "pow", "pwr", "sgn"),
        *("sin", "sinh", "sqr", "sqrt", "tan", "tanh", "ternary_fcn", "unif", "hertz", "temper", "time"),
    }
)
"""Names that mean something to simulators, and no parameter: ngspice takes another value for one, without a word."""
_OPERATORS: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "^": math.pow,
    "negative": lambda a: -a,
}
_CALLS = _OPERATORS | {name: function for name, (_, function) in FUNCTIONS.items()}


def read_number(text: str) -> float:
    """Return a number with its suffix (in lower case: m is a thousandth, meg a million) and unit.

    Raises ValueError for a text that is no number or that simulators read differently, such as 2k2 or 5a.

    >>> read_number("1kohm"), read_number("2.2meg"), read_number("1m"), read_number("-3e-2v")
    (1000.0, 2200000.0, 0.001, -0.03)
    """
    sign = text[:1] if text[:1] in ("+", "-") else ""
    found = _NUMBER.fullmatch(text[len(sign) :])
    if not found or len(text) > LONGEST:
        raise ValueError(f"{text[:40]!r} is no number such as 4.7, 1e-3, 2.2k or 1kohm")
    digits, exponent, letters = found[1], int(found[2] or 0), found[3]
    if letters.startswith("mil") and _UNIT.fullmatch(letters[3:]):
        value = float(f"{digits}e{exponent}") * _MIL
    else:
        suffix = next(
            (each for each in _EXPONENT if letters.startswith(each) and _UNIT.fullmatch(letters[len(each) :])), ""
        )
        if not suffix and not _UNIT.fullmatch(letters):
            raise ValueError(
                f"{text[:40]!r} ends in {letters[:20]!r}, and not in one of T G Meg K m u n p f mil or a unit"
            )
        value = float(f"{digits}e{exponent + _EXPONENT.get(suffix, 0)}")
    if not math.isfinite(value):
        raise ValueError(f"{text[:40]!r} is not finite")
    return -value if sign == "-" else value


def compile_expression(text: str) -> Expression:
    """Return the steps of an expression in lower case; ValueError for one that cannot be read.

    >>> compile_expression("2*(a + 1k)")
    (2.0, 'a', 1000.0, ('+', 2), ('*', 2))
    """
    return expression.compile_expression(text, _SPICE)


def evaluate(steps: Expression, value_of: Callable[[str], float]) -> float:
    """Return the value of an expression; ValueError where it has none that is finite.

    >>> evaluate(compile_expression("-2^2 + max(a, 7)"), {"a": 3.0}.__getitem__)
    3.0
    """
    return float(expression.evaluate(steps, value_of, _finite))


def _finite(name: str, values: list[float]) -> float:
    if name == "^" and values[0] < 0.0:  # ngspice takes the power of its magnitude
        raise ValueError(f"a power of {values[0]!r}, which is negative: simulators disagree about it")
    try:
        value = float(_CALLS[name](*values))
    except (ArithmeticError, ValueError):
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{name} of {', '.join(map(repr, values))} has no finite value")
    return value


def _number_of_expressions(token: str) -> float:
    if "mil" in token:
        raise ValueError(f"{token!r}: in expressions, simulators disagree about mil")
    return read_number(token)


_SPICE = Language({name: count for name, (count, _) in FUNCTIONS.items()}, _number_of_expressions, LONGEST)
