"""The parts of a library in which two strains are inputs at once."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from circuittex.base.errors import CircuitError, CircuittexWarning
from circuittex.design import Design
from circuittex.electrical.network.names import unique_names
from circuittex.study.library.fit_corners import FitCorner
from circuittex.study.library.levels import Levels
from circuittex.study.library.network import FLAG, Axis, Network, circuit_network, ports_network
from circuittex.study.library.parts import TITLES, Part, monte_carlo, strained, title_of, tolerated, unit_network
from circuittex.study.library.reduction import CORNERS, TOLERANCES, Reduction
from circuittex.study.library.strain_grid import StrainGrid


def grid_parts(
    name: str,
    design: Design,
    known: Levels,
    reductions: Sequence[Reduction],
    grid: StrainGrid,
    fits: Sequence[FitCorner] = (),
) -> Iterator[Part]:
    """Ports, cell and unit with both strains as parameters and as pins; ports and cell with a place among the corners
    of an ensemble, and ports with one within tolerances, as a third parameter."""
    states = grid.records.ravel().tolist()
    number = np.arange(float(len(states)))
    networks = {each.end: on_grid(ports_network([each.ports[k] for k in states], number), grid) for each in reductions}
    for each in reductions:
        yield from strained(name, design, "ports", each.end, each.title, networks[each.end], grid.word)
    if set(CORNERS) <= set(networks):
        yield from monte_carlo(name, design, "ports", [networks[end] for end in CORNERS], grid.word)
    if set(TOLERANCES) <= set(networks):
        yield from tolerated(name, design, networks, grid.word)
    if known.reason:
        return
    try:
        cells = circuit_network([known.cells[k] for k in states], number, known.pins)
        found = {"cell": cells, "unit": unit_network(known.units[states], number)}
    except CircuitError as error:
        warnings.warn(f"no cell of Ry and Rc for {grid.word}: {error}", CircuittexWarning, stacklevel=3)
        return
    for level, network in found.items():
        yield from strained(name, design, level, "", TITLES[level], on_grid(network, grid), grid.word)
    at = [on_grid(circuit_network([fit.levels.cells[k] for k in states], number, known.pins), grid) for fit in fits]
    for fit, network in zip(fits, at, strict=True):
        yield from strained(name, design, "cell", fit.end, title_of(fit), network, grid.word)
    if fits:
        yield from monte_carlo(name, design, "cell", at, grid.word)


def on_grid(network: Network, grid: StrainGrid) -> Network:
    """The network with the strains of a grid, in words that none of its nodes has."""
    nodes = dict.fromkeys([FLAG, *network.pins, *(node for ends in network.nodes for node in ends)])
    words = unique_names([*nodes, *grid.axes])[len(nodes) :]
    strains = (grid.first, grid.second)
    return replace(network, grid=tuple(Axis(word, e) for word, e in zip(words, strains, strict=True)))
