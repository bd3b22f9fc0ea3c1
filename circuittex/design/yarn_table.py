"""Reading yarns and their materials: by radius and rows, or by what the trade states; bare fibrils or coated ones."""

from __future__ import annotations

from collections.abc import Mapping
from math import isclose, pi, sqrt
from typing import Any

from circuittex.design.checks import real, refuse, whole
from circuittex.design.declaration import keys, read
from circuittex.design.table import Table, choose
from circuittex.design.trade import (
    MOST_FILAMENTS,
    MOST_FLAT,
    coated_radius,
    fibril_conductivity,
    fibril_radius,
    hexagonal_rows,
    shell_thickness,
)
from circuittex.design.yarn import Material, Yarn, check_rows

CONDUCTIVITY = "electrical_conductivity"
_TRADE = ("filaments", "flattening", "linear_density", "core_linear_density", "resistance", "shell")
_SIZES = ("radius", "linear_density", "core_linear_density", "shell_thickness")
_SAME = 1e-9
"""Conductivities of one material from two yarns differ by rounding alone."""


def read_yarn(value: object, field: str, label: str, materials: Mapping[str, Material]) -> Yarn:
    """A yarn: `rows` or `filaments`, `radius` or `linear_density`; filaments touch unless a spacing is given."""
    table = Table(value, field, ("rows", *keys(Yarn), "material", "materials", *_TRADE))
    rows = _rows(table)
    chosen = _fibril_materials(table, sum(rows), materials)
    shell = choose(table.value["shell"], table.at("shell"), materials) if table.has("shell") else None
    radius, thickness = _sizes(table, [material.density for material in chosen], shell.density if shell else None)
    found: dict[str, Any] = {**table.value, "radius": radius, "shell_thickness": thickness}
    if table.has("filaments"):
        found.setdefault("spacing", 2.0 * radius)
        spacing = Table(found, field).number("spacing", "mm")
        found.setdefault("row_spacing", sqrt(3.0) / 2.0 * spacing)
    elif table.has("spacing"):
        found.setdefault("row_spacing", table.value["spacing"])
    numbers = read(Yarn, Table(found, field), "rows", "material", "materials", *_TRADE)
    return Yarn(name=label, rows=rows, materials=chosen, shell=shell, **numbers)


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
        material, sigma = _from_resistance(table, materials if isinstance(materials, Mapping) else {})
        if not isclose(found.setdefault(material, sigma), sigma, rel_tol=_SAME):
            allowed = f"{material!r} would have two conductivities: state the two as materials of their own"
            raise refuse(table.at("resistance"), value["resistance"], allowed)
    return found


def _from_resistance(table: Table, materials: Mapping[str, object]) -> tuple[str, float]:
    """Name and sigma (S/mm) of the material whose conductivity follows from a yarn's resistance, 1 / r' = sum sigma A.

    Of a coated yarn it is the shell's, unless that is stated and the core's is not.
    """
    core = table.text("material", "a yarn with a resistance has one material, whose conductivity follows")
    tables = {key: _one_of(materials, table, key) for key in ("material", "shell") if table.has(key)}
    densities = {key: of.number("density", "g/mm3") for key, of in tables.items()}
    n = sum(_rows(table))
    radius, thickness = _sizes(table, [densities["material"]] * n, densities.get("shell"))
    resistance = _positive(table, "resistance", "ohm/mm")
    if thickness == 0.0:
        return core, fibril_conductivity(resistance, n * pi * radius**2)
    areas = {"material": n * pi * (radius - thickness) ** 2, "shell": n * pi * thickness * (2.0 * radius - thickness)}
    stated = {key: of.number(CONDUCTIVITY, "S/mm") for key, of in tables.items() if of.has(CONDUCTIVITY)}
    wanted, other = ("material", "shell") if "shell" in stated and "material" not in stated else ("shell", "material")
    rest = 1.0 / resistance - stated.get(other, 0.0) * areas[other]
    if rest < 0.0:
        alone = 1e3 / (stated[other] * areas[other])
        allowed = f"the {'core' if other == 'material' else 'shell'} alone has less: {alone:.4g} ohm/m"
        raise refuse(table.at("resistance"), table.value["resistance"], allowed)
    return str(table.value[wanted]), rest / areas[wanted]


def _one_of(materials: Mapping[str, object], table: Table, key: str) -> Table:
    """The table of the material that a key of a yarn names."""
    return Table(choose(table.value[key], table.at(key), materials), f"materials.{table.value[key]}")


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


def _sizes(table: Table, densities: list[float], shell: float | None) -> tuple[float, float]:
    """R and the thickness of the shell in mm, as they stand or by the yarn's linear densities with and without it.

    Of the fibrils' `densities` and that of the `shell`, None where they are bare: T = pi R² (the sum of the densities).
    """
    if shell is None:
        if table.has("core_linear_density"):
            given = table.value["core_linear_density"]
            raise refuse(table.at("core_linear_density"), given, "it is of a yarn before it got a shell: give one")
        thickness = table.number("shell_thickness", "mm") if table.has("shell_thickness") else 0.0
        return _radius(table, densities), thickness
    given = [key for key in _SIZES if table.has(key)]
    if len(given) != 2 or given == ["radius", "linear_density"]:
        allowed = f"a coated yarn has two of {', '.join(_SIZES)}, and of radius and linear_density one at most"
        raise refuse(table.field, given, allowed)
    if "core_linear_density" not in given:
        thickness = real(table.number("shell_thickness", "mm"), table.at("shell_thickness"), "mm", at_least=0)
        return _radius(table, densities, shell, thickness), thickness
    mean = sum(densities) / len(densities)
    bare = _positive(table, "core_linear_density", "g/mm")
    inner = fibril_radius(bare, 1, sum(densities))
    if "linear_density" in given:
        whole_yarn = _positive(table, "linear_density", "g/mm")
        if whole_yarn < bare:
            allowed = "it must be at least the core_linear_density, of the yarn before it got its shell"
            raise refuse(table.at("linear_density"), table.value["linear_density"], allowed)
        thickness = shell_thickness(whole_yarn, bare, len(densities), mean, shell)
    elif "radius" in given:
        thickness = real(table.number("radius", "mm") - inner, table.at("radius"), "mm more than the core", at_least=0)
    else:
        thickness = real(table.number("shell_thickness", "mm"), table.at("shell_thickness"), "mm", at_least=0)
    return inner + thickness, thickness


def _radius(table: Table, densities: list[float], shell: float = 0.0, thickness: float = 0.0) -> float:
    """R in mm, as it stands or by the yarn's linear density."""
    if not table.has("linear_density"):
        wanted = "a number in mm or a string with a unit, or linear_density in place of it"
        table.get("radius", wanted)
        return table.number("radius", "mm")
    if table.has("radius"):
        raise refuse(table.at("radius"), table.value["radius"], "give either radius or linear_density, not both")
    T = _positive(table, "linear_density", "g/mm")
    if thickness == 0.0:
        return fibril_radius(T, 1, sum(densities))
    return coated_radius(T, len(densities), sum(densities) / len(densities), shell, thickness)


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
