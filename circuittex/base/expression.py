"""Arithmetic in texts of others, read into steps for a small stack: nothing is ever evaluated by Python.

What may be called, how a number is written and whether there are comparisons is the reader's choice: decks of SPICE and
formulas of panels are two readers.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

DEEPEST = 50
"""Parentheses within one another, or signs in a row."""

_TOKEN = re.compile(
    r"\s*(?:((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?[A-Za-z]*)|([A-Za-z_][A-Za-z0-9_]*)|(\*\*|<=|>=|[-+*/^(),<>])|(\S))"
)
COMPARISONS = ("<", "<=", ">", ">=")

Step = Any
"""A number to push, the name of a value to push, or a function and how many values it takes from the stack."""
Expression = tuple[Step, ...]
"""The steps of one expression, in the order of their work. Operators are functions called '+', '-', '*', '/', '^' and
'negative', and `COMPARISONS`."""


class Language(NamedTuple):
    """What an expression may consist of."""

    functions: Mapping[str, int]
    """With how many values each is called."""
    number: Callable[[str], float]
    """The value of a number as it is written; ValueError where it is none."""
    longest: int
    """Characters of one expression."""
    comparisons: bool = False
    """Whether two sums may be compared."""


def compile_expression(text: str, language: Language) -> Expression:
    """Return the steps of an expression; ValueError for one that cannot be read.

    Powers bind tighter than a sign before them, as in mathematics. A power of a power needs parentheses, since
    programs disagree about it.

    >>> compile_expression("2*(a + 1)", Language({}, float, 80))
    (2.0, 'a', 1.0, ('+', 2), ('*', 2))
    """
    if len(text) > language.longest:
        raise ValueError(f"an expression of {len(text)} characters is longer than the {language.longest} that are read")
    parser = _Parser(text, language)
    parser.whole(0)
    if parser.kind:
        raise ValueError(f"{parser.token!r} is not expected in {text!r}")
    return tuple(parser.steps)


def evaluate(expression: Expression, value_of: Callable[[str], Any], call: Callable[[str, list[Any]], Any]) -> Any:
    """Return the value of an expression, of names by `value_of` and of functions and operators by `call`.

    >>> steps = compile_expression("-2^2 + a", Language({}, float, 80))
    >>> evaluate(steps, {"a": 5.0}.__getitem__, lambda name, values: {
    ...     "^": pow, "negative": lambda x: -x, "+": lambda x, y: x + y}[name](*values))
    1.0
    """
    stack: list[Any] = []
    for step in expression:
        if isinstance(step, str):
            stack.append(value_of(step))
        elif isinstance(step, tuple):
            name, count = step
            values = stack[-count:]
            del stack[-count:]
            stack.append(call(name, values))
        else:
            stack.append(step)
    return stack[0]


class _Parser:
    """Reads sums of products of signed powers from left to right."""

    def __init__(self, text: str, language: Language) -> None:
        self.text, self.position, self.language = text, 0, language
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

    def whole(self, depth: int) -> None:
        """A sum, or two that are compared."""
        self.sum(depth)
        if self.language.comparisons and self.at(*COMPARISONS):
            sign = self.token
            self.next()
            self.sum(depth)
            self.steps.append((sign, 2))

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
                raise ValueError(f"a power of a power needs parentheses in {self.text!r}: programs disagree about it")

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
            self.steps.append(self.language.number(token))
        elif kind == "name" and self.at("("):
            self.call(token, depth + 1)
        elif kind == "name":
            self.steps.append(token)
        elif (kind, token) == ("sign", "("):
            self.whole(depth + 1)
            self.take(")")
        else:
            raise ValueError(f"{token} is not expected in {self.text!r}")

    def call(self, name: str, depth: int) -> None:
        functions = self.language.functions
        if name not in functions:
            raise ValueError(f"{name!r} is none of the functions {', '.join(functions)}")
        count = functions[name]
        self.take("(")
        self.whole(depth)
        for _ in range(count - 1):
            self.take(",")
            self.whole(depth)
        self.take(")")
        self.steps.append((name, count))
