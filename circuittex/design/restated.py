"""A design in other units of length and of modulus: the same fabric, with other numbers."""

from __future__ import annotations

from copy import copy
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

from circuittex.design.checks import store
from circuittex.design.declaration import keys
from circuittex.design.statement import Design
from circuittex.design.units import newtons_and_millimetres

T = TypeVar("T")
DIGITS = 12
"""Significant digits that are kept: a quotient of decimal numbers is the decimal number that it stands for again."""


def restated(design: Design, length: float, modulus: float) -> Design:
    """The design with lengths in units of `length` mm and moduli in units of `modulus` N/mm2, to 12 digits.

    A key in N^a mm^b is divided by (modulus length^2)^a length^b, as its declaration says; what is of no matter for the
    mechanics of fibrils at rest, conductivities and densities, stays. Numbers of elements and contact points that
    were 'auto' are stated. What is allowed is not checked again: limits are about mm and MPa, and what lies exactly at
    one may lie beyond it by the last digit in other units.

    >>> from circuittex.design import plain_weave
    >>> fine = restated(plain_weave(), 100.0, 1.0)
    >>> fine.weave.pitch, fine.weave.warp[0].radius, fine.contact.penalty
    (0.02, 0.0015, 5.0)
    """
    resolution, numerics = design.resolution, design.numerics
    force = modulus * (length * length)
    if numerics.force_tolerance:
        numerics = replace(numerics, tolerance=f"{_rounded(numerics.force_tolerance / force)!r} N")
    numerics = replace(numerics, elements=resolution.elements, contact_points=resolution.contact_points)

    def other(thing: Any) -> Any:
        if isinstance(thing, tuple):
            return tuple(other(each) for each in thing)
        if not is_dataclass(thing) or isinstance(thing, type):
            return thing
        declared = keys(type(thing))
        changed = {
            field.name: number(value, declared[field.name].unit) if field.name in declared else other(value)
            for field in fields(thing)
            for value in [getattr(thing, field.name)]
        }
        return _with(thing, changed)

    def number(value: Any, unit: str) -> Any:
        newtons, millimetres = newtons_and_millimetres(unit) or (0, 0)
        if isinstance(value, str) or not (newtons or millimetres):
            return value
        return _rounded(value / (force**newtons * length**millimetres))

    parts = {name: getattr(design, name) for name in ("weave", "contact", "packing", "clamps")} | {"numerics": numerics}
    return _with(design, {name: other(part) for name, part in parts.items()})


def _with(thing: T, changed: dict[str, Any]) -> T:
    """A copy with other values, which are those that were checked when `thing` was made."""
    found = copy(thing)
    store(found, **changed)
    return found


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
