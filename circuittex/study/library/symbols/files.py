"""The files of symbols in the folder of a library."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from circuittex.base.atomic import write_text
from circuittex.study.library.cell import Cell
from circuittex.study.library.network import Network
from circuittex.study.library.symbols.kicad import symbol_library
from circuittex.study.library.symbols.ltspice import asy
from circuittex.study.library.symbols.project import divider, example_project


def write_symbols(folder: Path, name: str, design: str, cells: Sequence[Cell], networks: Mapping[str, Network]) -> None:
    """Write `kicad/NAME.kicad_sym` with an example project, and an `.asy` beside each file for LTspice.

    `networks`: what is between the pins of each cell, by its name. What a library has no files for gets no symbols.
    """
    run = [cell for cell in cells if cell.dialect == "ngspice"]
    files = {f"ltspice/{cell.name}.asy": asy(cell) for cell in cells if cell.dialect == "ltspice"}
    if run:
        files[f"kicad/{name}.kicad_sym"] = symbol_library(run, design)
        shown = shown_cell(run)
        project = example_project(shown, design, f"{name}.kicad_sym", divider(networks[shown.name]))
        files |= {f"kicad/example/{file}": text for file, text in project.items()}
    for file, text in files.items():
        path = folder / file
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text, encoding="utf-8")


def shown_cell(cells: Sequence[Cell]) -> Cell:
    """The ports with one strain as a pin where there are such, else the ports of one state.

    >>> from circuittex.study.library.cell import Pin
    >>> pins = (Pin("a", "left", "electrical"), Pin("b", "right", "electrical"))
    >>> shown_cell([Cell(f"x_{level}", level, "", pins, (), "", "ngspice") for level in ("detailed", "ports")]).name
    'x_ports'
    """
    ports = [cell for cell in cells if cell.level == "ports"]
    return next((cell for cell in ports if sum(pin.kind == "control" for pin in cell.pins) == 1), ports[0])
