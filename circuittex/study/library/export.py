"""A study becomes a folder of libraries: `circuittex export`."""

from __future__ import annotations

import json
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from circuittex.base.atomic import write_text
from circuittex.base.errors import CircuittexWarning, DesignError
from circuittex.base.version import __version__
from circuittex.design.statement import NONLINEAR
from circuittex.electrical.network.names import safe_name
from circuittex.results.records import Study
from circuittex.study.export import circuits_of, probe_netlist
from circuittex.study.library.accuracy import Errors
from circuittex.study.library.cell import DIALECTS, Cell
from circuittex.study.library.datasheet import write_datasheet
from circuittex.study.library.dialect import DIALECTS as SYNTAX
from circuittex.study.library.examples import crimped_probe, example_deck
from circuittex.study.library.facts import Facts, facts_of
from circuittex.study.library.grid_parts import grid_parts
from circuittex.study.library.levels import CRIMPED, ENDS, FREE, detailed, levels, port_matrices
from circuittex.study.library.network import Network, farthest, floating
from circuittex.study.library.parts import Part, fixed_parts, strained_parts
from circuittex.study.library.reactive import YarnReactances, of_cell, of_unit, yarn_reactances
from circuittex.study.library.reduction import exact
from circuittex.study.library.resistivity import Factor, as_stated, differs, warmer
from circuittex.study.library.subcircuit import library_text
from circuittex.study.library.symbols.files import write_symbols
from circuittex.study.library.temperature import CHECKED, STEP, with_temperature
from circuittex.study.plan import plan

FORMAT = 1
"""Of library.json."""


def export_library(
    study: Study,
    folder: str | Path,
    *,
    name: str = "fabric",
    state: str = "",
    ends: str = CRIMPED,
    thin: float = 0.0,
    dialects: Sequence[str] = DIALECTS,
    rise: float | None = None,
    combine: Sequence[str] = (),
    members: Iterable[Study] = (),
    reactive: bool = False,
) -> tuple[Cell, ...]:
    """Write the sub-circuits of a study into `folder`, with symbols, library.json, examples and datasheet.html.

    Names of sub-circuits begin with `name` and are the same for every study and state. Cells in which strain is no
    input are of `state`, the first recorded one unless named. `ends`: see `ENDS`. With `thin` > 0 there are also ports
    with fewer resistors, whose resistances rise by at most that part. Ratings are for `rise` kelvin, by
    default those of the design. Two strains, of `strain_grid.AXES`, are inputs of one part where the study has all
    states of a grid of them; with `combine`, the names of both, it is an error where it has not.
    `members` of an ensemble, `study` among them, give corners: see `reduction.corners`. With `reactive` every part
    has capacitors between its pins and inductors behind them, of the chosen state (`electrical.network.reactance`).

    Raises `DesignError` for an argument and `CircuitError` for a study that cannot be used.
    """
    rise = study.design.electrical.rated_rise if rise is None else rise
    chosen = _checked(study, state, ends, thin, dialects, rise)
    if reactive and ends != CRIMPED:
        raise DesignError("reactive", reactive, f"it needs {CRIMPED} yarn ends: capacitances are those of whole yarns")
    yarns = yarn_reactances(study.design, study.records[chosen]) if reactive else None
    _note_missing(study)
    known = facts_of(study, ends, thin, rise, members, combine)
    word = safe_name(name) + ("_free" if ends == FREE else "")
    found = list(_parts(study, known, word, chosen, ends))
    _check_names(found)
    if differs(study.design, "tc1", "tc2"):
        found = _with_temperature(study, known, word, chosen, ends, found)
    folder = Path(folder)
    cells = [
        _write(folder, study, known, part, dialect, chosen, yarns)
        for dialect in dialects
        for part in found
        if SYNTAX[dialect].expression or not any(pin.kind == "control" for pin in part.pins)
    ]
    networks = {part.name: part.network for part in found}
    _write_examples(folder / "examples", cells, networks)
    _write_probes(folder / "examples", study, chosen)
    write_symbols(folder, word, study.design.name, cells, networks)
    write_datasheet(folder, study, known, cells, networks, found, yarns)
    library = {
        "format": FORMAT,
        "circuittex": __version__,
        "design": study.design.name,
        "design_hash": study.design_hash,
        "state": study.records[chosen].name,
        "ends": ends,
        "recommended": known.recommended,
        "errors": {level: _plain(each) for level, each in known.errors.items()},
        "interpolation_errors": {word: _plain(each) for word, each in known.left_out.items()},
        "cells": [asdict(cell) for cell in cells],
    }
    if known.tolerance:
        library["tolerance"] = dict(zip(("fall", "rise"), known.tolerance, strict=True))
    write_text(folder / "library.json", json.dumps(library, indent=1) + "\n", encoding="ascii")
    return tuple(cells)


def _check_names(parts: Sequence[Part]) -> None:
    """Refuse parts of one name, of which one file would be that of the last: words of paths and grids are joined to
    those of levels."""
    twice = [name for name, count in Counter(part.name.lower() for part in parts).items() if count > 1]
    if twice:
        raise DesignError("loading", twice[0], "two sub-circuits would have this name: give the loading another one")


def _plain(errors: Errors) -> dict[str, list[float | None]]:
    """Errors in resistance and in change for JSON, which has no nan."""
    parts = {"worst": errors.worst, "median": errors.median}
    return {name: [None if np.isnan(each) else each for each in pair] for name, pair in parts.items()}


def _checked(study: Study, state: str, ends: str, thin: float, dialects: Sequence[str], rise: float) -> int:
    """The number of the state, after all arguments have been found usable."""
    if ends not in ENDS:
        raise DesignError("ends", ends, f"it must be one of {', '.join(ENDS)}")
    if not 0.0 <= thin < 1.0:
        raise DesignError("thin", thin, "it must be an error from 0 to less than 1, such as 0.001")
    if not (0.0 < rise < np.inf):
        raise DesignError("rise", rise, "it must be > 0 K")
    electrical = study.design.electrical
    if electrical.heating == NONLINEAR and rise != electrical.rated_rise:
        allowed = (
            f"heating is nonlinear: currents are rated for electrical.rated_rise alone, {electrical.rated_rise:g} K"
        )
        raise DesignError("rise", rise, allowed)
    if unknown := [each for each in dialects if each not in DIALECTS]:
        raise DesignError("dialects", unknown[0], f"it must be one of {', '.join(DIALECTS)}")
    names = [record.name for record in study.records]
    if state and state not in names:
        raise DesignError("state", state, f"recorded states: {', '.join(names) or 'none'}")
    return names.index(state) if state else 0


def _note_missing(study: Study) -> None:
    """Say which states of the design are not there, and where strain is no input."""
    there = {record.name for record in study.records}
    if missing := [step.name for step in plan(study.design) if step.name not in there]:
        text = f"the study is not finished: without {', '.join(missing)} strain is sampled less far or less closely"
        warnings.warn(text, CircuittexWarning, stacklevel=3)
    elif len(there) == 1:
        text = "the study has one state: strain is no input of its library"
        warnings.warn(text, CircuittexWarning, stacklevel=3)


def _with_temperature(
    study: Study, known: Facts, word: str, chosen: int, ends: str, parts: Sequence[Part]
) -> list[Part]:
    """The parts with temperature coefficients."""
    made: list[list[Part]] = []
    for kelvin in (-STEP, STEP):
        found = levels(study, ends, warmer(kelvin))
        there = replace(known, levels=found, reductions=(exact(found.ports),), fit_corners=())
        made.append(list(_parts(study, there, word, chosen, ends, warmer(kelvin))))
    ports = {kelvin: port_matrices(study, ends, known.levels.pins, warmer(kelvin)) for kelvin in CHECKED}
    states = {path.word: path.records for path in known.paths} | {"": np.array([chosen])}
    states |= {grid.word: grid.records.ravel() for grid in known.grids}
    return with_temperature(parts, made[0], made[1], ports | {0.0: known.levels.ports}, states)


def _parts(study: Study, known: Facts, word: str, chosen: int, ends: str, factor: Factor = as_stated) -> Iterator[Part]:
    design = study.design
    circuit = detailed(design, study.records[chosen], ends, factor)
    yield from fixed_parts(word, design, known.levels, known.reductions, chosen, circuit, known.fit_corners)
    for path in known.paths:
        yield from strained_parts(word, design, known.levels, known.reductions, path, known.fit_corners)
    for grid in known.grids:
        yield from grid_parts(word, design, known.levels, known.reductions, grid, known.fit_corners)


def _write(
    folder: Path, study: Study, known: Facts, part: Part, dialect: str, chosen: int, yarns: YarnReactances | None
) -> Cell:
    """Write the file of one sub-circuit in one dialect."""
    elements = None
    if yarns is not None:
        elements = of_unit(yarns, study.design) if part.level == "unit" else of_cell(yarns, part.network.pins)
    cell = Cell(part.name, part.level, part.title, part.pins, part.parameters, f"{dialect}/{part.name}.lib", dialect)
    state = f"strain of {part.path}" if part.path else study.records[chosen].name
    notes = [("design", study.design.name), ("design hash", study.design_hash), ("state", state), *known.notes(part)]
    if yarns is not None:
        notes.append(("capacitance, inductance", f"to first order, of state {study.records[chosen].name}"))
    path = folder / cell.file
    path.parent.mkdir(parents=True, exist_ok=True)
    _write_ascii(path, library_text(cell, part.network, notes, part.spread, elements))
    return cell


def _write_examples(folder: Path, cells: Sequence[Cell], networks: Mapping[str, Network]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    ends = {cell.name: farthest(networks[cell.name])[0] for cell in cells if cell.level != "detailed"}
    for cell in cells:
        if cell.level != "detailed":
            network, (source, sink) = networks[cell.name], ends[cell.name]
            fixed = len(network.strain) == 1
            ranges = [(-1.0, 1.0)] if fixed else [axis.range for axis in network.axes]
            text = example_deck(cell, (source, sink), ranges, floating(network, sink))
            _write_ascii(folder / f"{cell.dialect}_{cell.name}.cir", text)


def _write_probes(folder: Path, study: Study, chosen: int) -> None:
    """A deck of each probe for either meaning of the ends of yarns that it does not drive."""
    record, design = study.records[chosen], study.design
    if not design.probes:
        return
    circuits = circuits_of(design, record.contacts, record.fields)
    for probe in record.driven(design).probes:
        word = safe_name(probe.name)
        _write_ascii(folder / f"probe_{word}_free.cir", probe_netlist(design, record.name, circuits, probe))
        _write_ascii(
            folder / f"probe_{word}_crimped.cir", crimped_probe(design, circuits.yarn_ends, probe, record.name)
        )


def _write_ascii(path: Path, text: str) -> None:
    """The same bytes on every system: no CR before the LF."""
    write_text(path, text, encoding="ascii")
