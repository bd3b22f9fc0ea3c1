"""What a library says of each of its sub-circuits: all that a symbol or a caller needs."""

from __future__ import annotations

from circuittex.base.frozen import frozen

DIALECTS = ("ngspice", "ltspice", "xyce", "gnucap")
LEVELS = ("detailed", "ports", "cell", "unit")


@frozen
class Pin:
    """One pin of a sub-circuit, in the order of its `.subckt` card."""

    name: str
    """Word in the card, for example 'warp1_minus': letters, digits and underscores, and no name of ground."""
    side: str
    """'left', 'right', 'top' or 'bottom': where a symbol shows it."""
    kind: str
    """'electrical', 'control' or 'flag'."""


@frozen
class Cell:
    """One sub-circuit of a library."""

    name: str
    """Of the sub-circuit: the same for another state or study unless asked otherwise."""
    level: str
    """'detailed', 'ports', 'cell' or 'unit'."""
    title: str
    """What it is, one line of ASCII."""
    pins: tuple[Pin, ...]
    """In the order of the `.subckt` card."""
    parameters: tuple[tuple[str, str], ...]
    """Name and default of each, as text: (('strain', '0'),)."""
    file: str
    """Relative to the library's folder, with '/': 'ngspice/fabric_ports.lib'."""
    dialect: str
    """'ngspice', 'ltspice', 'xyce' or 'gnucap'."""
