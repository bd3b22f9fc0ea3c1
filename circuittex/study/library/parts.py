"""What is in a library: each level in one state, and each loading with strain as an input."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import CircuitError, CircuittexWarning
from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.electrical.network.circuit import Circuit, yarn_end_name
from circuittex.electrical.network.ports import PortMatrix
from circuittex.study.library.cell import Pin
from circuittex.study.library.levels import Levels
from circuittex.study.library.network import FLAG, STRAIN, Network, circuit_network, pin_words, ports_network
from circuittex.study.library.strain_path import StrainPath

PARAMETER, PIN = "_s", "_v"
"""How names of cells end whose strain is a parameter, and a pin."""
UNIT = ("w", "e", "n", "s")
TITLES = {
    "detailed": "every fibril segment and contact",
    "ports": "exact reduction to the pins",
    "cell": "Ry for each yarn segment and Rc for each crossing, fitted to all pairs of pins",
    "unit": "one crossing amid a wide fabric: arms Ry/2 of its warp (w, e) and of its weft (n, s), Rc between them",
}


@frozen
class Part:
    """One sub-circuit, before it is written in a dialect."""

    name: str
    """Of the sub-circuit."""
    level: str
    """'detailed', 'ports', 'cell' or 'unit'."""
    title: str
    """What it is, one line."""
    network: Network
    """What is between its pins."""
    pins: tuple[Pin, ...]
    """With those of strain."""
    parameters: tuple[tuple[str, str], ...]
    """Name and default."""
    path: str
    """Word of the path along which strain is an input; empty where it is none."""


def fixed_parts(name: str, design: Design, known: Levels, state: int, circuit: Circuit) -> Iterator[Part]:
    """Every level in one state; `circuit` is its detailed one."""
    nothing = np.zeros(1)
    networks = {
        "detailed": circuit_network([circuit], nothing, known.pins),
        "ports": ports_network([known.ports[state]], nothing),
    }
    if not known.reason:
        networks["cell"] = circuit_network([known.cells[state]], nothing, known.pins)
        networks["unit"] = unit_network(known.units[[state]], nothing)
    for level, network in networks.items():
        yield Part(f"{name}_{level}", level, TITLES[level], network, pins(design, network), (), "")


def thin_part(name: str, design: Design, matrix: PortMatrix, error: float) -> Part:
    """The ports in one state without the resistors that matter least."""
    network = ports_network([matrix], np.zeros(1))
    title = f"reduction to the pins, every resistance exact to {error:.3g}"
    return Part(f"{name}_ports_thin", "ports", title, network, pins(design, network), (), "")


def strained_parts(
    name: str, design: Design, known: Levels, path: StrainPath, thin: Mapping[str, Sequence[PortMatrix]]
) -> Iterator[Part]:
    """Ports, cell and unit with strain as a parameter and as a pin; `thin`: further reductions by the end of a name."""
    networks = {("ports", ""): ports_network([known.ports[k] for k in path.records], path.strain)}
    for end, matrices in thin.items():
        networks["ports", end] = ports_network([matrices[k] for k in path.records], path.strain)
    if not known.reason:
        cells = known.cells
        try:
            networks["cell", ""] = circuit_network([cells[k] for k in path.records], path.strain, known.pins)
            networks["unit", ""] = unit_network(known.units[path.records], path.strain)
        except CircuitError as error:
            warnings.warn(f"no cell of Ry and Rc for {path.loading!r}: {error}", CircuittexWarning, stacklevel=3)
    for (level, end), network in networks.items():
        title = f"{TITLES[level]}, strain of the loading as"
        base, plain = f"{name}_{level}{end}_{path.word}", pins(design, network)
        flag, strain = Pin(FLAG, "bottom", "flag"), Pin(STRAIN, "bottom", "control")
        given = ((STRAIN, "0"),)
        yield Part(base + PARAMETER, level, f"{title} a parameter", network, (*plain, flag), given, path.word)
        yield Part(
            base + PIN, level, f"{title} a voltage (1 V = 100 %)", network, (*plain, strain, flag), (), path.word
        )


def unit_network(values: Floats, strain: Floats) -> Network:
    """One crossing of Ry of its warp, Ry of its weft and Rc (K, 3), ohm; what is infinite is left out.

    >>> unit_network(np.array([[2.0, 4.0, 5.0]]), np.zeros(1)).conductance.tolist()
    [[1.0, 1.0, 0.5, 0.5, 0.2]]
    """
    arms = [("ry_w", "w", "warp"), ("ry_e", "e", "warp"), ("ry_n", "n", "weft"), ("ry_s", "s", "weft")]
    arms.append(("rc", "warp", "weft"))
    ohm = values[:, [0, 0, 1, 1, 2]] * np.array([0.5, 0.5, 0.5, 0.5, 1.0])
    there = np.isfinite(ohm)
    if (there != there[0]).any():
        raise CircuitError("a crossing conducts in some states only")
    kept = [arm for arm, finite in zip(arms, there[0], strict=True) if finite]
    names, ends = tuple(arm[0] for arm in kept), tuple((arm[1], arm[2]) for arm in kept)
    return Network(UNIT, names, ends, strain, 1.0 / ohm[:, there[0]])


def pins(design: Design, network: Network) -> tuple[Pin, ...]:
    """The pins of a network with the sides on which a symbol of the weave shows them."""
    sides = dict(zip(UNIT, ("left", "right", "top", "bottom"), strict=True))
    for yarns, minus, plus in ((len(design.weave.warp), "left", "right"), (len(design.weave.weft), "bottom", "top")):
        kind = "warp" if minus == "left" else "weft"
        for k in range(yarns):
            sides[yarn_end_name(f"{kind}{k + 1}", -1)] = minus
            sides[yarn_end_name(f"{kind}{k + 1}", 1)] = plus
    ends = [yarn_end_name(*terminal.ends[0]) for terminal in design.terminals]
    words = pin_words([terminal.name for terminal in design.terminals])
    free = {word: sides[end] for word, end in zip(words, ends, strict=True)}
    return tuple(Pin(name, sides.get(name, free.get(name, "left")), "electrical") for name in network.pins)
