"""Numbers with units: "0.15 mm" or "1 W/(mm K)" to a float in the package's base units, checked by dimension."""

from __future__ import annotations

import re
from fractions import Fraction
from math import isfinite

from circuittex.base.errors import DesignError

Exponents = tuple[int, int, int, int, int]
"""Exponents of metre, kilogram, second, ampere, kelvin."""

Unit = tuple[Fraction, Exponents]
"""A unit as an exact multiple of SI, so that "150 um" and "0.15 mm" are the same float."""

_NONE: Exponents = (0, 0, 0, 0, 0)

_SYMBOLS: dict[str, Unit] = {
    "1": (Fraction(1), _NONE),
    "%": (Fraction(1, 100), _NONE),
    "m": (Fraction(1), (1, 0, 0, 0, 0)),
    "g": (Fraction(1, 1000), (0, 1, 0, 0, 0)),
    "s": (Fraction(1), (0, 0, 1, 0, 0)),
    "A": (Fraction(1), (0, 0, 0, 1, 0)),
    "K": (Fraction(1), (0, 0, 0, 0, 1)),
    "N": (Fraction(1), (1, 1, -2, 0, 0)),
    "Pa": (Fraction(1), (-1, 1, -2, 0, 0)),
    "J": (Fraction(1), (2, 1, -2, 0, 0)),
    "W": (Fraction(1), (2, 1, -3, 0, 0)),
    "V": (Fraction(1), (2, 1, -3, -1, 0)),
    "ohm": (Fraction(1), (2, 1, -3, -2, 0)),
    "Ω": (Fraction(1), (2, 1, -3, -2, 0)),  # Greek capital omega
    "\u2126": (Fraction(1), (2, 1, -3, -2, 0)),  # the ohm sign
    "S": (Fraction(1), (-2, -1, 3, 2, 0)),
    "tex": (Fraction(1, 10**6), (-1, 1, 0, 0, 0)),  # g/km
    "dtex": (Fraction(1, 10**7), (-1, 1, 0, 0, 0)),
    "den": (Fraction(1, 9 * 10**6), (-1, 1, 0, 0, 0)),  # g/9 km
}

_PREFIXES: dict[str, Fraction] = {
    "n": Fraction(1, 10**9),
    "u": Fraction(1, 10**6),
    "µ": Fraction(1, 10**6),  # micro sign
    "\u03bc": Fraction(1, 10**6),  # Greek mu
    "m": Fraction(1, 10**3),
    "c": Fraction(1, 100),
    "k": Fraction(10**3),
    "M": Fraction(10**6),
    "G": Fraction(10**9),
}

_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)", re.DOTALL | re.ASCII)
_TOKEN = re.compile(r"\s*(?:([^\W\d_]+|%|1(?!\d))(?:(?:\^|\*\*)?(-?\d)(?!\d))?|([/()])|([*·]))\s*")
_LONGEST = 80  # characters of a number with its unit; keeps nested brackets shallow


def parse(value: float | int | str, unit: str, field: str) -> float:
    """The number that `value` stands for when measured in `unit`.

    Numbers are in `unit` already; strings carry their own unit, which must have the same dimension.
    Products are written with a space, `*` or `·`, quotients with `/`, powers as `mm2`, `mm^2` or `mm²`.
    The conversion is exact and rounded once, so every spelling of a quantity gives the same float.

    Raises `DesignError`, naming `field`, for anything else: another dimension, an unknown unit, NaN,
    infinity, a truth value.

    >>> parse("150 um", "mm", "yarns.silver.radius")
    0.15
    >>> parse("1 W/(m K)", "W/(mm K)", "materials.silver.thermal_conductivity")
    0.001
    >>> parse("2 S", "mm", "pitch")
    Traceback (most recent call last):
    circuittex.base.errors.DesignError: pitch: '2 S' is not usable; it must be in mm or a unit of the same dimension
    """
    if isinstance(value, str):
        return _from_text(value, unit, field)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DesignError(field, value, _wanted(unit))
    try:
        number = float(value)
    except OverflowError:
        raise DesignError(field, f"{str(value)[:20]}...", f"{_wanted(unit)}; this one is too large") from None
    if not isfinite(number):
        raise DesignError(field, value, f"it must be a finite number, in {_label(unit)}")
    return number


def newtons_and_millimetres(unit: str) -> tuple[int, int] | None:
    """(a, b) of a unit of dimension N^a mm^b; None where it is none.

    >>> newtons_and_millimetres("MPa"), newtons_and_millimetres("S/mm")
    ((1, -2), None)
    """
    metres, kilograms, seconds, amperes, kelvins = _read(unit)[1]
    return None if amperes or kelvins or seconds != -2 * kilograms else (kilograms, metres - kilograms)


def _from_text(text: str, unit: str, field: str) -> float:
    if len(text) > _LONGEST:
        raise DesignError(field, text[:40] + "...", _wanted(unit))
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise DesignError(field, text, _wanted(unit))
    number, suffix = match.groups()
    scale, dimension = _read(unit)
    try:
        factor, own = _read(suffix)
    except ValueError as error:
        raise DesignError(field, text, f"{error}; {_wanted(unit)}") from None
    if own != dimension:
        allowed = (
            "it must be a plain number"
            if dimension == _NONE
            else f"it must be in {unit} or a unit of the same dimension"
        )
        raise DesignError(field, text, allowed)
    if not isfinite(float(number)):
        raise DesignError(field, text, f"it must be a finite number, in {_label(unit)}")
    if float(number) == 0.0:  # also keeps exponents such as 1e-999999999 away from exact arithmetic
        return 0.0
    try:
        return float(Fraction(number) * factor / scale)
    except OverflowError:
        raise DesignError(field, text, f"it must be a finite number, in {_label(unit)}") from None


def _read(text: str) -> Unit:
    """The unit `text` stands for; ValueError where it is none."""
    if not text.strip():
        return _SYMBOLS["1"]
    tokens, at, source = [], 0, text.strip().translate(_SUPERSCRIPTS)
    while at < len(source):
        match = _TOKEN.match(source, at)
        if match is None:
            raise ValueError(f"{source[at:]!r} cannot be read as a unit")
        tokens.append(match.groups())
        at = match.end()
    tokens.reverse()
    result = _product(tokens)
    if tokens:
        raise ValueError("the unit has an unmatched ')'")
    return result


def _product(tokens: list[tuple[str | None, ...]]) -> Unit:
    """Read factors off the end of the reversed `tokens` up to a closing bracket."""
    total, sign, wants_factor = _SYMBOLS["1"], 1, True
    while tokens and tokens[-1][2] != ")":
        symbol, power, mark, times = tokens.pop()
        if mark == "/" or times:
            if wants_factor:
                raise ValueError(f"a unit is missing before {mark or times!r}")
            sign, wants_factor = (-1 if mark else 1), True
            continue
        if mark == "(":
            factor = _product(tokens)
            if not tokens:
                raise ValueError("the unit has an unmatched '('")
            tokens.pop()
        else:
            factor = _power(_symbol(symbol or ""), int(power or 1))
        total = _multiply(total, _power(factor, sign))
        sign, wants_factor = 1, False
    if wants_factor:
        raise ValueError("the unit is incomplete")
    return total


def _symbol(text: str) -> Unit:
    if text in _SYMBOLS:
        return _SYMBOLS[text]
    prefix, rest = text[:1], text[1:]
    if prefix in _PREFIXES and rest in _SYMBOLS and rest not in ("1", "%"):
        factor, exponents = _SYMBOLS[rest]
        return _PREFIXES[prefix] * factor, exponents
    raise ValueError(f"{text!r} is not a unit known here")


def _multiply(a: Unit, b: Unit) -> Unit:
    x, y = a[1], b[1]
    return a[0] * b[0], (x[0] + y[0], x[1] + y[1], x[2] + y[2], x[3] + y[3], x[4] + y[4])


def _power(unit: Unit, power: int) -> Unit:
    x = unit[1]
    return unit[0] ** power, (x[0] * power, x[1] * power, x[2] * power, x[3] * power, x[4] * power)


def _label(unit: str) -> str:
    return "plain numbers" if _read(unit)[1] == _NONE else unit


def _wanted(unit: str) -> str:
    if _read(unit)[1] == _NONE:
        return "it must be a plain number"
    return f"it must be a number in {unit} or a string with a unit, such as '1 {unit}'"
