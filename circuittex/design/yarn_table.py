"""Reading yarns and their materials: by radius and rows, or by what the trade states."""

from __future__ import annotations

from collections.abc import Mapping
from math import isclose, pi, sqrt
from typing import Any

from circuittex.design.checks import real, refuse, whole
from circuittex.design.declaration import keys, read
from circuittex.design.table import Table, choose
from circuittex.design.trade import MOST_FILAMENTS, MOST_FLAT, fibril_conductivity, fibril_radius, hexagonal_rows
from circuittex.design.yarn import Material, Yarn, check_rows

CONDUCTIVITY = "electrical_conductivity"
_TRADE = ("filaments", "flattening", "linear_density", "resistance")
_SAME = 1e-9
"""Conductivities of one material from two yarns differ by rounding alone."""


def read_yarn(value: object, field: str, label: str, materials: Mapping[str, Material]) -> Yarn:
    """A yarn: `rows` or `filaments`, `radius` or `linear_density`; filaments touch unless a spacing is given."""
    table = Table(value, field, ("rows", *keys(Yarn), "material", "materials", *_TRADE))
    rows = _rows(table)
    chosen = _fibril_materials(table, sum(rows), materials)
    radius = _radius(table, [material.density for material in chosen])
    found: dict[str, Any] = {"radius": radius, **table.value}
    if table.has("filaments"):
        found.setdefault("spacing", 2.0 * radius)
        spacing = Table(found, field).number("spacing", "mm")
        found.setdefault("row_spacing", sqrt(3.0) / 2.0 * spacing)
    elif table.has("spacing"):
        found.setdefault("row_spacing", table.value["spacing"])
    numbers = read(Yarn, Table(found, field), "rows", "material", "materials", *_TRADE)
    return Yarn(name=label, rows=rows, materials=chosen, **numbers)


def read_material(value: object, field: str, label: str, from_yarns: Mapping[str, float]) -> Material:
    """A material, whose conductivity may follow from the resistance of a yarn (`conductivities`)."""
    table = Table(value, field)
    if label in from_yarns:
        if table.has(CONDUCTIVITY):
            stated = table.value[CONDUCTIVITY]
            raise refuse(table.at(CONDUCTIVITY), stated, "a yarn's resistance states it already: give one of them")
        table = Table({**table.value, CONDUCTIVITY: from_yarns[label]}, field)
    return Material(label, **read(Material, table))


def conductivities(top: Table) -> dict[str, float]:
    """sigma (S/mm) of the materials of yarns that state their resistance per length, 1 / (r' A) by their names."""
    found: dict[str, float] = {}
    tables, materials = top.value.get("yarns"), top.value.get("materials")
    for label, value in tables.items() if isinstance(tables, Mapping) else ():
        if not isinstance(value, Mapping) or "resistance" not in value:
            continue
        table = Table(value, f"yarns.{label}")
        material = table.text("material", "a yarn with a resistance has one material, whose conductivity follows")
        known = choose(material, table.at("material"), materials if isinstance(materials, Mapping) else {})
        density = Table(known, f"materials.{material}").number("density", "g/mm3")
        n = sum(_rows(table))
        area = n * pi * _radius(table, [density] * n) ** 2
        sigma = fibril_conductivity(_positive(table, "resistance", "ohm/mm"), area)
        if not isclose(found.setdefault(material, sigma), sigma, rel_tol=_SAME):
            allowed = f"{material!r} would have two conductivities: state the two as materials of their own"
            raise refuse(table.at("resistance"), value["resistance"], allowed)
    return found


def _rows(table: Table) -> tuple[int, ...]:
    if not table.has("filaments"):
        if table.has("flattening"):
            raise refuse(table.at("flattening"), table.value["flattening"], "it shapes yarns stated by filaments")
        wanted = "the number of fibrils in each row, such as [3, 4, 3], or filaments in place of it"
        return check_rows(table.get("rows", wanted), table.at("rows"))
    if table.has("rows"):
        raise refuse(table.at("rows"), table.value["rows"], "give either rows or filaments, not both")
    filaments = whole(table.value["filaments"], table.at("filaments"), 1, MOST_FILAMENTS)
    if not table.has("flattening"):
        return hexagonal_rows(filaments)
    flattening = real(table.number("flattening", "1"), table.at("flattening"), at_least=1, at_most=MOST_FLAT)
    return hexagonal_rows(filaments, flattening)


def _radius(table: Table, densities: list[float]) -> float:
    """R in mm, as it stands or by the yarn's linear density: T = pi R² (the sum of the fibrils' densities)."""
    if not table.has("linear_density"):
        wanted = "a number in mm or a string with a unit, or linear_density in place of it"
        table.get("radius", wanted)
        return table.number("radius", "mm")
    if table.has("radius"):
        raise refuse(table.at("radius"), table.value["radius"], "give either radius or linear_density, not both")
    return fibril_radius(_positive(table, "linear_density", "g/mm"), 1, sum(densities))


def _positive(table: Table, key: str, unit: str) -> float:
    return real(table.number(key, unit), table.at(key), "" if unit == "1" else unit, above=0)


def _fibril_materials(table: Table, n_fibrils: int, materials: Mapping[str, Material]) -> tuple[Material, ...]:
    if table.has("material") and table.has("materials"):
        raise refuse(table.at("materials"), table.value["materials"], "give either material or materials, not both")
    if table.has("materials"):
        wanted = f"{n_fibrils} material names, one for each fibril, row by row"
        listed = table.items("materials", wanted)
        if len(listed) != n_fibrils:
            raise refuse(table.at("materials"), len(listed), f"the rows need {wanted}")
        return tuple(choose(item, f"{table.at('materials')}[{i}]", materials) for i, item in enumerate(listed))
    chosen = choose(table.get("material", "the name of a material"), table.at("material"), materials)
    return (chosen,) * n_fibrils
