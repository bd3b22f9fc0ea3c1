"""Capacitors and inductors of a part: between its pins, and in series with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.electrical.network.circuit import yarn_end_name
from circuittex.electrical.network.names import unique_names
from circuittex.electrical.network.reactance import end_capacitances, inductance, yarn_lines
from circuittex.results.records import Record
from circuittex.study.library.network import CONTROLS, Network, pin_words
from circuittex.study.library.parts import UNIT


@frozen
class Reactive:
    """What a part has beside its resistors."""

    capacitors: tuple[tuple[str, str, float], ...]
    """Two pins each, F."""
    inductors: tuple[tuple[str, float], ...]
    """A pin each, H: between it and the resistors."""


@frozen
class YarnReactances:
    """What is known of the yarns of one state."""

    ends: tuple[str, ...]
    """(2 Y,) names of the yarn ends, minus and plus."""
    farad: tuple[tuple[float, ...], ...]
    """(2 Y, 2 Y) between yarn ends."""
    henry: tuple[float, ...]
    """(Y,) of each yarn from end to end."""


def yarn_reactances(design: Design, record: Record) -> YarnReactances:
    """Capacitances between the ends of the conducting yarns of a state, and inductances of these."""
    mesh = record.contacts.mesh
    lines = yarn_lines(mesh, record.configuration.r)
    conducts = np.bincount(mesh.yarn, mesh.electrical_conductivity) > 0.0
    kept = replace(lines, **{name: getattr(lines, name)[conducts] for name in ("place", "radius", "mean_distance")})
    names = [name for name, there in zip(mesh.yarn_names, conducts, strict=True) if there]
    farad = end_capacitances(kept, design.electrical.permittivity)
    ends = tuple(yarn_end_name(name, side) for name in names for side in (-1, 1))
    return YarnReactances(ends, tuple(map(tuple, farad.tolist())), tuple(inductance(kept).tolist()))


def of_cell(known: YarnReactances, pins: tuple[str, ...]) -> Reactive:
    """The elements of a part whose pins are yarn ends, half of a yarn's inductance at either end."""
    words = dict(zip(known.ends, pin_words(known.ends), strict=True))
    there = [k for k, name in enumerate(known.ends) if words[name] in pins]
    capacitors = [
        (words[known.ends[i]], words[known.ends[j]], known.farad[i][j])
        for n, i in enumerate(there)
        for j in there[n + 1 :]
        if known.farad[i][j] > 0.0
    ]
    return Reactive(tuple(capacitors), tuple((words[known.ends[k]], known.henry[k // 2] / 2.0) for k in there))


def of_unit(known: YarnReactances, design: Design) -> Reactive:
    """The elements of one crossing: the median of a warp's and a weft's, shared out to the pins w, e, n and s."""
    n, m = len(design.weave.warp), len(design.weave.weft)
    kinds = [name.startswith("warp") for name in known.ends[::2]]
    warps, wefts = [k for k, warp in enumerate(kinds) if warp], [k for k, warp in enumerate(kinds) if not warp]
    farad = np.array(known.farad)
    between = [farad[2 * i : 2 * i + 2, 2 * j : 2 * j + 2].sum() for i in warps for j in wefts]
    capacitors = [(a, b, float(np.median(between)) / 4.0) for a in UNIT[:2] for b in UNIT[2:] if between]
    segments = [(known.henry[k] / m, UNIT[:2]) for k in warps[:1]] + [(known.henry[k] / n, UNIT[2:]) for k in wefts[:1]]
    return Reactive(tuple(capacitors), tuple((pin, henry / 2.0) for henry, pins in segments for pin in pins))


def within(network: Network, reactive: Reactive) -> tuple[Network, list[str]]:
    """The network behind the inductors of its pins, and the cards of the elements."""
    nodes = dict.fromkeys([*CONTROLS, *network.pins, *(node for ends in network.nodes for node in ends)])
    pins = [pin for pin, _ in reactive.inductors]
    inner = dict(zip(pins, unique_names([*nodes, *(f"{pin}_in" for pin in pins)])[len(nodes) :], strict=True))
    behind = tuple((inner.get(a, a), inner.get(b, b)) for a, b in network.nodes)
    cards = [f"L{pin} {pin} {inner[pin]} {henry!r}" for pin, henry in reactive.inductors]
    cards += [f"C{a}_{b} {a} {b} {farad!r}" for a, b, farad in reactive.capacitors]
    return replace(network, nodes=behind), cards
