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
from circuittex.study.library.cell import Pin
from circuittex.study.library.fit_corners import FitCorner
from circuittex.study.library.levels import Levels
from circuittex.study.library.network import (
    FLAG,
    SPREAD,
    WITHIN,
    Network,
    circuit_network,
    pin_words,
    ports_network,
)
from circuittex.study.library.reduction import CORNERS, TOLERANCES, Reduction
from circuittex.study.library.strain_path import StrainPath

PARAMETER, PIN = "_s", "_v"
"""How names of cells end whose strain is a parameter, and a pin."""
UNIT = ("w", "e", "n", "s")
FLAGGED = Pin(FLAG, "bottom", "flag")
TITLES = {
    "detailed": "every fibril segment and contact",
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
    end: str
    """Of the reduction of its ports, such as '_thin'; empty for the exact one and for other levels."""
    title: str
    """What it is, one line."""
    network: Network
    """What is between its pins."""
    pins: tuple[Pin, ...]
    """With those of strain."""
    parameters: tuple[tuple[str, str], ...]
    """Name and default."""
    path: str
    """Word of the path or grid along which strain is an input; empty where it is none."""
    spread: tuple[Network, Network] | None = None
    """The networks at the 5th and the 95th percentile of resistance, or at the low and the high end of the tolerances,
    where the place among them is a parameter."""
    drift: float = 0.0
    """Largest relative error of R(T)/R(27 C) between its pins within 50 K: see `temperature`."""


def fixed_parts(
    name: str,
    design: Design,
    known: Levels,
    reductions: Sequence[Reduction],
    state: int,
    circuit: Circuit,
    fits: Sequence[FitCorner] = (),
) -> Iterator[Part]:
    """Every level in one state; `circuit` is its detailed one."""
    nothing = np.zeros(1)
    yield _fixed(name, design, "detailed", "", TITLES["detailed"], circuit_network([circuit], nothing, known.pins))
    networks = {each.end: ports_network([each.ports[state]], nothing) for each in reductions}
    for each in reductions:
        yield _fixed(name, design, "ports", each.end, each.title, networks[each.end])
    if set(TOLERANCES) <= set(networks):
        yield from tolerated(name, design, networks)
    if not known.reason:
        network = circuit_network([known.cells[state]], nothing, known.pins)
        yield _fixed(name, design, "cell", "", TITLES["cell"], network)
        yield _fixed(name, design, "unit", "", TITLES["unit"], unit_network(known.units[[state]], nothing))
    for fit in fits:
        network = circuit_network([fit.levels.cells[state]], nothing, known.pins)
        yield _fixed(name, design, "cell", fit.end, title_of(fit), network)


def title_of(fit: FitCorner) -> str:
    """What the cell of a corner is, one line."""
    return f"Ry and Rc, each at percentile {fit.end[2:]} of {fit.packings} packings"


def _fixed(name: str, design: Design, level: str, end: str, title: str, network: Network) -> Part:
    return Part(f"{name}_{level}{end}", level, end, title, network, pins(design, network), (), "")


def strained_parts(
    name: str,
    design: Design,
    known: Levels,
    reductions: Sequence[Reduction],
    path: StrainPath,
    fits: Sequence[FitCorner] = (),
) -> Iterator[Part]:
    """Ports, cell and unit with strain as a parameter and as a pin; ports and cell with a place among the corners."""
    networks = {each.end: ports_network([each.ports[k] for k in path.records], path.strain) for each in reductions}
    for each in reductions:
        yield from strained(name, design, "ports", each.end, each.title, networks[each.end], path.word)
    if set(CORNERS) <= set(networks):
        yield from monte_carlo(name, design, "ports", [networks[end] for end in CORNERS], path.word)
    if set(TOLERANCES) <= set(networks):
        yield from tolerated(name, design, networks, path.word)
    if known.reason:
        return
    try:
        cells = [known.cells[k] for k in path.records]
        found = {
            "cell": circuit_network(cells, path.strain, known.pins),
            "unit": unit_network(known.units[path.records], path.strain),
        }
    except CircuitError as error:
        warnings.warn(f"no cell of Ry and Rc for {path.loading!r}: {error}", CircuittexWarning, stacklevel=3)
        return
    for level, network in found.items():
        yield from strained(name, design, level, "", TITLES[level], network, path.word)
    at = [circuit_network([fit.levels.cells[k] for k in path.records], path.strain, known.pins) for fit in fits]
    for fit, network in zip(fits, at, strict=True):
        yield from strained(name, design, "cell", fit.end, title_of(fit), network, path.word)
    if fits:
        yield from monte_carlo(name, design, "cell", at, path.word)


def monte_carlo(name: str, design: Design, level: str, corners: Sequence[Network], word: str) -> Iterator[Part]:
    """The ports or the cell with a place among the corners as a parameter beside the strains; `word` of their path."""
    low, middle, high = corners
    if not low.names == middle.names == high.names:
        text = f"no part with the parameter {SPREAD} for {word!r}: some packings lack resistors of others"
        warnings.warn(text, CircuittexWarning, stacklevel=3)
        return
    what = "reduction to the pins" if level == "ports" else "Ry and Rc"
    words = [axis.word for axis in middle.axes]
    title = f"{what}, parameters: {', '.join(words)}, and {SPREAD} in standard deviations of all resistors at once"
    given = (*((each, "0") for each in words), (SPREAD, "0"))
    full = f"{name}_{level}_{SPREAD}_{word}{PARAMETER}"
    yield Part(full, level, f"_{SPREAD}", title, middle, (*pins(design, middle), FLAGGED), given, word, (low, high))


def tolerated(name: str, design: Design, networks: Mapping[str, Network], word: str = "") -> Iterator[Part]:
    """The ports with a place within the tolerances as a parameter, beside those of the strains of a path or grid."""
    middle, low, high = (networks[end] for end in ("", *TOLERANCES))
    if not low.names == middle.names == high.names:
        return  # a tolerance of the whole resistance may open what another state joins
    title = f"reduction to the pins, {WITHIN} from -1 to 1: all resistivities from the low to the high end of tolerance"
    base, own = f"{name}_ports_{WITHIN}", pins(design, middle)
    given: tuple[tuple[str, str], ...] = ((WITHIN, "0"),)
    if not word:
        yield Part(base, "ports", f"_{WITHIN}", title, middle, own, given, "", (low, high))
        return
    words = [axis.word for axis in middle.axes]
    title = f"{title}; {' and '.join(words) if middle.grid else 'strain of the loading'} as a parameter"
    given = (*((each, "0") for each in words), *given)
    yield Part(
        f"{base}_{word}{PARAMETER}", "ports", f"_{WITHIN}", title, middle, (*own, FLAGGED), given, word, (low, high)
    )


def strained(
    name: str, design: Design, level: str, end: str, title: str, network: Network, word: str
) -> Iterator[Part]:
    """The strains of a network as parameters and as pins."""
    base, plain = f"{name}_{level}{end}_{word}", pins(design, network)
    words = [axis.word for axis in network.axes]
    what = f"{title}, {' and '.join(words) if network.grid else 'strain of the loading'} as a"
    given = tuple((word, "0") for word in words)
    yield Part(base + PARAMETER, level, end, f"{what} parameter", network, (*plain, FLAGGED), given, word)
    control = (*plain, *(Pin(each, "bottom", "control") for each in words), FLAGGED)
    yield Part(base + PIN, level, end, f"{what} voltage (1 V = 100 %)", network, control, (), word)


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
