"""Panels in TOML files: keys, types and units; the dataclasses check the rest."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.design.checks import refuse
from circuittex.design.table import Table, quantity
from circuittex.design.toml_file import read_toml
from circuittex.results.store import load_study
from circuittex.study.panel.cells import KINDS, CellResistances, cells_of_study
from circuittex.study.panel.maps import read_map
from circuittex.study.panel.statement import Cut, Electrode, Panel, Seam, check_shape

FORMAT = 1
_TOP = ("format", "name", "panel", "results", "resistance", "strain", "electrodes", "cuts", "seams", "gradients")
_MAP = ("uniform", "formula", "file", "image", "low", "high")


def load_panel(path: str | PathLike[str]) -> tuple[Panel, tuple[tuple[str, str], ...]]:
    """The panel in a TOML file, and the pairs of electrodes whose gradients it asks for.

    Files that it names lie beside it, or where their path leads from there.

    Raises `DesignError` for a file that cannot be read, is not TOML, or states something impossible, and `StoreError`
    for results that cannot be read.
    """
    return parse_panel(read_toml(path, "panel file"), Path(path).parent)


def parse_panel(mapping: object, folder: Path) -> tuple[Panel, tuple[tuple[str, str], ...]]:
    """The panel that a mapping of the layout of a panel file states; `folder` is where the files lie that it names."""
    top = Table(mapping, "", _TOP)
    version = top.get("format", f"format = {FORMAT} states the layout of the file")
    if isinstance(version, bool) or version != FORMAT:
        raise refuse("format", version, f"this version reads format = {FORMAT}")
    size = Table(top.get("panel", "a table [panel]"), "panel", ("warp", "weft", "pitch", "insulating"))
    shape = check_shape((size.get("warp", "the number of warp yarns"), size.get("weft", "the number of weft yarns")))
    if top.has("results") == top.has("resistance"):
        given = "both" if top.has("results") else "nothing"
        raise refuse("resistance", given, "Ry and Rc come either from [results] or from [resistance]")
    cells, pitch = _of_results(top, folder) if top.has("results") else (None, None)
    if pitch is None or size.has("pitch"):
        pitch = size.number("pitch", "mm")
    if not 0.0 < pitch < np.inf:
        raise refuse("panel.pitch", pitch, "it must be > 0 mm")
    strain: Floats = np.zeros((1, 1))
    outside = "refuse"
    if top.has("strain"):
        table = Table(top.value["strain"], "strain", (*_MAP, "outside"))
        strain = read_map(table, shape, pitch, "1", folder)
        if table.has("outside"):
            outside = table.text("outside", "'refuse' or 'clamp'")
    panel = Panel(
        shape=shape,
        cells=cells or _stated(top, shape, pitch, folder),
        electrodes=_electrodes(top),
        strain=strain,
        pitch=pitch,
        cuts=tuple(Cut(**_known(value, path, ("line", "rectangle"))) for value, path in _entries(top, "cuts")),
        seams=tuple(_seam(value, path) for value, path in _entries(top, "seams")),
        insulating=tuple(size.items("insulating", "yarns such as 'warp3'")) if size.has("insulating") else (),  # type: ignore[arg-type]
        outside=outside,
        name=top.text("name", "a title for the panel"),
    )
    return panel, _pairs(top, panel)


def _of_results(top: Table, folder: Path) -> tuple[CellResistances, float | None]:
    """Resistances and pitch of a study's cell; no pitch where warp and weft have their own."""
    table = Table(top.value["results"], "results", ("folder", "loading"))
    study = load_study(folder / table.text("folder", "the folder that 'circuittex run' has written"))
    loading = table.text("loading", "the name of a loading") if table.has("loading") else ""
    warp, weft = study.design.weave.directions
    return cells_of_study(study, loading), warp.pitch if warp.pitch == weft.pitch else None


def _stated(top: Table, shape: tuple[int, int], pitch: float, folder: Path) -> CellResistances:
    """Resistances that the file states: a number, a list with one for each strain, or a map."""
    table = Table(top.value["resistance"], "resistance", (*KINDS, "strain"))
    strain: tuple[float, ...] = (0.0,)
    if table.has("strain"):
        items = table.items("strain", "rising strains, such as [0, 0.05, 0.1]")
        strain = tuple(quantity(each, "1", table.at("strain")) for each in items)
    found: dict[str, Any] = {}
    for kind in KINDS:
        value, at = table.get(kind, "a resistance in ohm, or a list with one for each strain"), table.at(kind)
        if isinstance(value, Mapping):
            if len(strain) > 1:
                raise refuse(at, "a map", "where strains are listed it must be a list with one number for each")
            found[kind] = read_map(Table(value, at, _MAP), shape, pitch, "ohm", folder)
        elif isinstance(value, list | tuple):
            found[kind] = [_ohm(each, at) for each in value]
        else:
            found[kind] = _ohm(value, at)
    return CellResistances(**found, strain=strain)


def _ohm(value: object, at: str) -> float:
    return np.inf if value == "inf" else quantity(value, "ohm", at)


def _electrodes(top: Table) -> tuple[Electrode, ...]:
    table = Table(top.get("electrodes", "at least one table [electrodes.NAME]"), "electrodes")
    found = []
    for name, value in table.value.items():
        each = Table(value, table.at(name), ("ends", "edge", "rectangle", "voltage", "current"))
        given: dict[str, Any] = dict(each.value)
        for key, unit in (("voltage", "V"), ("current", "A")):
            if key in given:
                given[key] = quantity(given[key], unit, each.at(key))
        if "ends" in given:
            given["ends"] = tuple(each.items("ends", "yarn ends such as 'warp1-'"))
        if "edge" in given:
            each.text("edge", "'left', 'right', 'bottom' or 'top'")
        found.append(Electrode(name, **given))
    return tuple(found)


def _seam(value: object, path: str) -> Seam:
    given = _known(value, path, ("crossings", "rectangle", "resistance"))
    table = Table(value, path)
    given["resistance"] = table.number("resistance", "ohm")
    if "crossings" in given:
        given["crossings"] = tuple(table.items("crossings", "pairs [warp, weft]"))
    return Seam(**given)


def _known(value: object, path: str, keys: tuple[str, ...]) -> dict[str, Any]:
    return dict(Table(value, path, keys).value)


def _entries(top: Table, key: str) -> list[tuple[object, str]]:
    if not top.has(key):
        return []
    return [(value, f"{key}[{k}]") for k, value in enumerate(top.items(key, f"tables [[{key}]]"))]


def _pairs(top: Table, panel: Panel) -> tuple[tuple[str, str], ...]:
    """Pairs of electrodes of which gradients are wanted."""
    names = [each.name for each in panel.electrodes]
    found = []
    for value, path in _entries(top, "gradients"):
        if not isinstance(value, list | tuple) or len(value) != 2 or value[0] == value[1]:
            raise refuse(path, value, "it must be a pair of two different electrodes")
        for name in value:
            if name not in names:
                raise refuse(path, name, f"the panel's electrodes are {', '.join(names)}")
        found.append((str(value[0]), str(value[1])))
    return tuple(found)
