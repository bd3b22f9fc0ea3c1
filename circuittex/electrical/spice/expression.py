"""Numbers and arithmetic as SPICE writes them: suffixes, units, parameters and a few functions.

Text of others is never evaluated by Python: it is read into steps for a small stack, with a bound on its length.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

LONGEST = 1000
"""Characters of one expression."""
DEEPEST = 50
"""Parentheses within one another, or signs in a row."""

_NUMBER = re.compile(r"(\d+\.?\d*|\.\d+)(?:e([+-]?\d{1,4}))?([a-z]*)")
_TOKEN = re.compile(r"\s*(?:((?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?[a-z]*)|([a-z_][a-z0-9_]*)|(\*\*|[-+*/^(),])|(\S))")
_EXPONENT = {"meg": 6, "t": 12, "g": 9, "k": 3, "m": -3, "u": -6, "n": -9, "p": -12, "f": -15}
_UNIT = re.compile(r"(ohms?|volts?|amps?|amperes?|hz|s|siemens|v|r|h)?")
_MIL = 25.4e-6

Step = float | str | tuple[str, int]
"""A number to push, a parameter to push, or a function and how many values it takes from the stack."""
Expression = tuple[Step, ...]
"""The steps of one expression, in the order of their work."""

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

    Powers bind tighter than a sign before them, as in mathematics. A power of a power needs parentheses, since
    simulators disagree about it.

    >>> compile_expression("2*(a + 1k)")
    (2.0, 'a', 1000.0, ('+', 2), ('*', 2))
    """
    if len(text) > LONGEST:
        raise ValueError(f"an expression of {len(text)} characters is longer than the {LONGEST} that are read")
    parser = _Parser(text)
    parser.sum(0)
    if parser.kind:
        raise ValueError(f"{parser.token!r} is not expected in {text!r}")
    return tuple(parser.steps)


def evaluate(expression: Expression, value_of: Callable[[str], float]) -> float:
    """Return the value of an expression; ValueError where it has none that is finite.

    >>> evaluate(compile_expression("-2^2 + max(a, 7)"), {"a": 3.0}.__getitem__)
    3.0
    """
    stack: list[float] = []
    for step in expression:
        if isinstance(step, float):
            stack.append(step)
        elif isinstance(step, str):
            stack.append(value_of(step))
        else:
            name, count = step
            values = stack[-count:]
            del stack[-count:]
            if name == "^" and values[0] < 0.0:  # ngspice takes the power of its magnitude
                raise ValueError(f"a power of {values[0]!r}, which is negative: simulators disagree about it")
            try:
                value = float(_CALLS[name](*values))
            except (ArithmeticError, ValueError):
                value = math.nan
            if not math.isfinite(value):
                raise ValueError(f"{name} of {', '.join(map(repr, values))} has no finite value")
            stack.append(value)
    return stack[0]


class _Parser:
    """Reads sums of products of signed powers from left to right."""

    def __init__(self, text: str) -> None:
        self.text, self.position = text, 0
        self.steps: list[Step] = []
        self.next()

    def next(self) -> None:
        """Go to the next token: a number, a name, a sign, or '' at the end."""
        found = _TOKEN.match(self.text, self.position)
        if not found:
            self.kind, self.token = "", "the end"
            return
        self.position = found.end()
        self.token = found[found.lastindex or 0].strip()
        self.kind = ("number", "name", "sign", "other")[(found.lastindex or 0) - 1]

    def take(self, sign: str) -> None:
        """Go beyond a sign that must be there."""
        if (self.kind, self.token) != ("sign", sign):
            raise ValueError(f"{sign!r} is missing before {self.token} in {self.text!r}")
        self.next()

    def at(self, *signs: str) -> bool:
        return self.kind == "sign" and self.token in signs

    def sum(self, depth: int) -> None:
        self._chain(self.product, ("+", "-"), depth)

    def product(self, depth: int) -> None:
        self._chain(self.signed, ("*", "/"), depth)

    def _chain(self, part: Callable[[int], None], signs: tuple[str, ...], depth: int) -> None:
        part(depth)
        while self.at(*signs):
            sign = self.token
            self.next()
            part(depth)
            self.steps.append((sign, 2))

    def signed(self, depth: int) -> None:
        if depth > DEEPEST:
            raise ValueError(f"more than {DEEPEST} parentheses or signs within one another")
        if self.at("+", "-"):
            sign = self.token
            self.next()
            self.signed(depth + 1)
            if sign == "-":
                self.steps.append(("negative", 1))
            return
        self.atom(depth)
        if self.at("**", "^"):
            self.next()
            if self.at("+", "-"):
                self.signed_exponent(depth)
            else:
                self.atom(depth)
            self.steps.append(("^", 2))
            if self.at("**", "^"):
                raise ValueError(f"a power of a power needs parentheses in {self.text!r}: simulators disagree about it")

    def signed_exponent(self, depth: int) -> None:
        negative = self.token == "-"
        self.next()
        self.atom(depth)
        if negative:
            self.steps.append(("negative", 1))

    def atom(self, depth: int) -> None:
        """A number, a parameter, a call, or a sum in parentheses."""
        kind, token = self.kind, self.token
        self.next()
        if kind == "number":
            if "mil" in token:
                raise ValueError(f"{token!r}: in expressions, simulators disagree about mil")
            self.steps.append(read_number(token))
        elif kind == "name" and self.at("("):
            self.call(token, depth + 1)
        elif kind == "name":
            self.steps.append(token)
        elif (kind, token) == ("sign", "("):
            self.sum(depth + 1)
            self.take(")")
        else:
            raise ValueError(f"{token} is not expected in {self.text!r}")

    def call(self, name: str, depth: int) -> None:
        if name not in FUNCTIONS:
            raise ValueError(f"{name!r} is none of the functions {', '.join(FUNCTIONS)}")
        count = FUNCTIONS[name][0]
        self.take("(")
        self.sum(depth)
        for _ in range(count - 1):
            self.take(",")
            self.sum(depth)
        self.take(")")
        self.steps.append((name, count))
