"""Yarns that people buy, by name: the package's, and those of a user's folders and installed packages.

A yarn is a TOML file whose name is the yarn's: what a data sheet says in the keys of a design, and where it says so.
A design that names one is the design with these keys written out: nothing of it refers to the library afterwards.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from datetime import date
from importlib.resources import files
from importlib.resources.abc import Traversable
from math import pi
from pathlib import Path
from textwrap import fill
from typing import Any

from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.design.checks import is_name, refuse
from circuittex.design.table import Table, choose, quantity
from circuittex.design.toml_file import read_toml
from circuittex.design.yarn import Yarn
from circuittex.design.yarn_table import CONDUCTIVITY, conductivities, read_material, read_yarn

FOLDERS = "CIRCUITTEX_YARNS"
"""Environment variable: folders with yarns of one's own, separated as in PATH."""
ENTRY_POINTS = "circuittex.yarns"
"""Entry points of installed packages: each names a package in which such files lie."""
LONGEST = 24
"""Characters of a yarn's name, which is part of its materials' names."""
_NAMES_YARN = "yarn"
_SAID = ("title", "source", "url", "assumptions")
_GIVES_WAY: dict[str, tuple[str, ...]] = {
    "rows": ("filaments", "flattening"),
    "filaments": ("rows",),
    "radius": ("linear_density", "core_linear_density"),
    "linear_density": ("radius", "core_linear_density"),
    "core_linear_density": ("radius", "linear_density"),
    "material": ("materials",),
    "materials": ("material", "resistance"),
}
"""Keys of a library's yarn that one of the design's own replaces."""


@frozen
class LibraryYarn:
    """One yarn of a library."""

    name: str
    """The name by which a design asks for it."""
    title: str
    """What it is, in a line."""
    source: str
    """Title, author and date of what its numbers are from, and the numbers."""
    url: str
    """Where that is found."""
    accessed: str
    """When it was read, as 2026-11-27."""
    assumptions: str
    """What is in no source, in words; empty where all is."""
    yarn: Mapping[str, Any]
    """Keys of a table [yarns.NAME]."""
    materials: Mapping[str, Mapping[str, Any]]
    """Tables [materials.NAME], by the names that the yarn has for them."""
    place: str
    """The file."""

    def material(self, own: str) -> str:
        """The name in a design of a material that the yarn calls `own`.

        >>> yarn_library()["carbon_t300_1k"].material("carbon")
        'carbon_t300_1k-carbon'
        """
        return f"{self.name}-{own}"

    def tables(self) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """The yarn's table and its materials' by the names that they have in a design."""
        yarn = dict(self.yarn)
        for key in ("material", "shell"):
            if key in yarn:
                yarn[key] = self.material(yarn[key])
        if "materials" in yarn:
            yarn["materials"] = [self.material(each) for each in yarn["materials"]]
        return yarn, {self.material(label): dict(table) for label, table in self.materials.items()}

    def as_sold(self) -> Yarn:
        """The yarn itself; DesignError with the file where its tables state none.

        >>> yarn = yarn_library()["carbon_t300_1k"].as_sold()
        >>> yarn.n_fibrils, round(2e3 * yarn.radius, 1)  # um
        (1000, 6.9)
        """
        yarn, materials = self.tables()
        top = Table({"yarns": {self.name: yarn}, "materials": materials}, "")
        try:
            found = conductivities(top)
            known = {
                label: read_material(table, f"materials.{label}", label, found) for label, table in materials.items()
            }
            return read_yarn(yarn, f"yarns.{self.name}", self.name, known)
        except DesignError as error:
            raise DesignError(f"{self.place}: {error.field}", error.value, error.allowed) from error


def yarn_library(*folders: str | os.PathLike[str]) -> dict[str, LibraryYarn]:
    """The yarns of the package, of installed packages, of `CIRCUITTEX_YARNS` and of `folders`, by name.

    Raises `DesignError` for a file that cannot be read, and for two of one name.

    >>> len(yarn_library()) >= 6
    True
    """
    found: dict[str, LibraryYarn] = {}
    for folder in (*_installed(), *_stated(), *map(Path, folders)):
        for file in _files(folder):
            yarn = _read(file)
            if yarn.name in found:
                first = found[yarn.name].place
                raise refuse("yarn library", yarn.name, f"two files have a yarn of this name: {first} and {yarn.place}")
            found[yarn.name] = yarn
    return dict(sorted(found.items()))


def in_words(entry: LibraryYarn) -> str:
    """Lines that say what a yarn is, where its numbers are from, and what is assumed.

    >>> print(in_words(yarn_library()["carbon_t300_1k"]).split(" source")[0])
    carbon_t300_1k
        Carbon fibre T300, 1000 filaments
        1000 filaments of 6.91 um, 66 tex, 454 ohm/m
    <BLANKLINE>
    """
    sold = entry.as_sold()
    section = pi * sold.radius**2
    tex = 1e6 * section * sum(each.density for each in sold.fibrils)
    conductance = section * sum(each.electrical_conductivity for each in sold.fibrils)
    resistance = f"{1e3 / conductance:.3g} ohm/m" if conductance > 0.0 else "insulating"
    filaments = f"{sold.n_fibrils} filament{'s' if sold.n_fibrils > 1 else ''} of {2e3 * sold.radius:.3g} um"
    if sold.shell:
        filaments += f" with {1e3 * sold.shell_thickness:.3g} um of {sold.shell.name.removeprefix(entry.name + '-')}"
    lines = [entry.title, f"{filaments}, {tex:.3g} tex, {resistance}", f"source: {entry.source}"]
    lines += [f"{entry.url} (read {entry.accessed})"]
    lines += [f"assumed: {entry.assumptions.strip()}"] if entry.assumptions.strip() else []
    indented = (fill(line, 116, initial_indent=" " * 4, subsequent_indent=" " * 4) for line in lines)
    return "\n".join([entry.name, *indented, ""])


def with_library(top: Table, folder: Path) -> Table:
    """The tables of a design in which yarns that name one of the library have its keys, under their own.

    `folder` is what the design's own `yarn_library = "..."`, a folder or a list of them, is relative to.
    """
    own = top.value.get("yarn_library", [])
    listed = [own] if isinstance(own, str) else own
    if not isinstance(listed, list | tuple) or not all(isinstance(each, str) for each in listed):
        raise refuse("yarn_library", own, "it must be the name of a folder with yarns, or a list of them")
    yarns, materials = top.value.get("yarns"), top.value.get("materials", {})
    named = [label for label, table in _tables(yarns) if _NAMES_YARN in table]
    rest = {key: value for key, value in top.value.items() if key != "yarn_library"}
    if not named and not listed:
        return top
    library = yarn_library(*(folder / each for each in listed))
    if not isinstance(materials, Mapping) or not isinstance(yarns, Mapping):
        return Table(rest, top.field)
    yarns, materials, stated = dict(yarns), dict(materials), top.value.get("materials", {})
    first: dict[str, tuple[str, Mapping[str, Any]]] = {}
    for label in named:
        table = Table(yarns[label], f"yarns.{label}")
        entry = choose(table.value[_NAMES_YARN], table.at(_NAMES_YARN), library)
        yarns[label], given = _merged(entry, {key: value for key, value in table.value.items() if key != _NAMES_YARN})
        listed = yarns[label].get("materials")
        used = [yarns[label].get("material"), yarns[label].get("shell"), *(listed if isinstance(listed, list) else [])]
        for key in filter(used.__contains__, given):
            materials[key] = {**given[key], **Table(stated.get(key, {}), f"materials.{key}").value}
            owner, before = first.setdefault(key, (label, materials[key]))
            if materials[key] != before:  # one with a resistance of its own and one with the library's
                allowed = f"with yarns.{owner} it would give {key!r} two conductivities: give one a material of its own"
                raise refuse(table.at(_NAMES_YARN), table.value[_NAMES_YARN], allowed)
    return Table({**rest, "yarns": yarns, "materials": materials}, top.field)


def _tables(yarns: object) -> Iterator[tuple[str, Mapping[str, object]]]:
    for label, table in yarns.items() if isinstance(yarns, Mapping) else ():
        if isinstance(table, Mapping):
            yield label, table


def _merged(entry: LibraryYarn, stated: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """The table of a yarn of the library under a design's own keys, and its materials.

    A resistance of the design's own states the conductivity of what conducts, in place of the library's number.
    """
    yarn, materials = entry.tables()
    for key in stated:
        for other in _GIVES_WAY.get(key, ()):
            yarn.pop(other, None)
    if "resistance" in stated and "resistance" not in yarn:
        for part in (str(yarn.get("shell")), str(yarn.get("material"))):
            numbers = materials.get(part, {})
            if CONDUCTIVITY in numbers and quantity(numbers[CONDUCTIVITY], "S/mm", part) > 0.0:
                del numbers[CONDUCTIVITY]
                break
    return {**yarn, **stated}, materials


def _installed() -> Iterator[Traversable]:
    """The folders of the package and of those that name themselves by entry points."""
    from importlib.metadata import entry_points

    yield files("circuittex.design").joinpath("data/yarns")
    for point in sorted(entry_points(group=ENTRY_POINTS), key=lambda each: each.name):
        try:
            yield files(point.value)
        except (ImportError, TypeError, ValueError) as error:
            allowed = f"the entry point {point.name!r} of {ENTRY_POINTS} must name a package with yarns: {error}"
            raise refuse("yarn library", point.value, allowed) from error


def _stated() -> Iterable[Path]:
    return [Path(each) for each in os.environ.get(FOLDERS, "").split(os.pathsep) if each]


def _files(folder: Traversable) -> list[Traversable]:
    if not folder.is_dir():
        raise refuse("yarn library", Path(str(folder)).name, f"there is no such folder: {folder}")
    return sorted((file for file in folder.iterdir() if file.name.endswith(".toml")), key=lambda file: file.name)


def _read(file: Traversable) -> LibraryYarn:
    """The yarn of a file; DesignError with the file's name where it is none."""
    label = file.name.removesuffix(".toml")
    try:
        table = Table(read_toml(file, "yarn file"), "", (*_SAID, "accessed", "yarn", "materials"))
        if not is_name(label) or len(label) > LONGEST:
            allowed = (
                f"a yarn's name, that of its file, is a letter and up to {LONGEST - 1} letters, digits, '_' or '-'"
            )
            raise refuse("yarn", label, allowed)
        said = {key: table.text(key, "where the numbers are from") for key in _SAID if key != "assumptions"}
        when = table.get("accessed", "the date on which the source was read, such as 2026-11-27")
        if type(when) is not date:
            raise refuse("accessed", when, "it must be a date such as 2026-11-27")
        yarn = Table(table.get("yarn", "a table [yarn]"), "yarn")
        materials = Table(table.get("materials", "tables [materials.NAME]"), "materials")
        return LibraryYarn(
            name=label,
            **said,
            accessed=when.isoformat(),
            assumptions=table.text("assumptions", "") if table.has("assumptions") else "",
            yarn=yarn.value,
            materials={key: Table(each, materials.at(key)).value for key, each in materials.value.items()},
            place=str(file),
        )
    except DesignError as error:
        raise DesignError(f"{file}: {error.field}", error.value, error.allowed) from error
