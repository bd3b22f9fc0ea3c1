"""The card by which a deck uses a sub-circuit of a library, its nodes given by the names of pins."""

from __future__ import annotations

from collections.abc import Mapping

from circuittex.base.errors import CircuitError
from circuittex.study.library.cell import Cell
from circuittex.study.library.dialect import DIALECTS


def instance(cell: Cell, reference: str, nodes: Mapping[str, str], **parameters: float) -> str:
    """The card of `cell` called `reference` ('X1'), with a node for each pin that `nodes` names.

    Pins that it does not name stay open, each on a node of its own. `parameters` are those of the cell, such as strain.

    >>> from circuittex.study.library.cell import Pin
    >>> pins = tuple(Pin(name, "left", "electrical") for name in ("w", "e", "n"))
    >>> cell = Cell("piece", "ports", "a piece", pins, (("strain", "0"),), "ngspice/piece.lib", "ngspice")
    >>> instance(cell, "X1", {"n": "sense", "w": "0"}, strain=0.02)
    'X1 0 X1_e sense piece strain=0.02'

    Raises `CircuitError` for a pin or a parameter that the cell has not.
    """
    names = [pin.name for pin in cell.pins]
    for what, given, known in (("pin", nodes, names), ("parameter", parameters, dict(cell.parameters))):
        if unknown := [name for name in given if name not in known]:
            raise CircuitError(f"{cell.name} has no {what} {unknown[0]!r}: it has {', '.join(known) or 'none'}")
    words = [reference, *(nodes.get(name, f"{reference}_{name}") for name in names), cell.name]
    if parameters:
        values = " ".join(f"{name}={float(value)!r}" for name, value in parameters.items())
        words.append(DIALECTS[cell.dialect].parameters + values)
    return " ".join(words)
