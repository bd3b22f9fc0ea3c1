"""The text of one library file: comments, and one sub-circuit with nothing outside."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.base.version import __version__
from circuittex.electrical.network.names import unique_names
from circuittex.study.library.bicubic import Patches, patches
from circuittex.study.library.cell import Cell
from circuittex.study.library.dialect import DIALECTS, Dialect
from circuittex.study.library.interpolation import Pieces, pieces
from circuittex.study.library.network import (
    FLAG,
    SPREAD,
    SPREAD_USED,
    WITHIN,
    WITHIN_USED,
    Axis,
    Network,
)
from circuittex.study.library.polynomial import cubic, patch_of, piece_of
from circuittex.study.library.reactive import Reactive, within

SLACK = 1e-6
"""A strain this part of the range beyond its ends is at the end: a source's rounding raises no flag."""
NORMAL = 1.6448536269514722
"""The 95th percentile of the standard normal distribution."""
FURTHEST = 3.0
"""Standard deviations beyond which the parameter mc changes nothing."""
COLDEST = 0.01
"""A behavioural resistance does not fall below this part of that of 27 C, however far the temperature goes."""
OPEN = 1e9
"""ohm between the pin of strain and ground: left open it is 0."""


def library_text(
    cell: Cell,
    network: Network,
    notes: Sequence[tuple[str, str]],
    spread: tuple[Network, Network] | None = None,
    reactive: Reactive | None = None,
) -> str:
    """One file: comments with `notes` (key, text) of which no text can become a card, then the sub-circuit.

    `spread`: the networks at the 5th and 95th percentile of resistance, or at the ends of the tolerances, where the
    place among them is a parameter.
    """
    body = "\n".join(_subcircuit(cell, network, spread, reactive))
    digest = hashlib.sha256(body.encode("ascii")).hexdigest()
    head = [
        f"* circuittex {__version__} library: {cell.name}",
        f"* {json.dumps(cell.title)}",
        f"* content: sha256 {digest}",
        f"* dialect: {cell.dialect}",
        *(f"* {key}: {json.dumps(text)}" for key, text in notes),
    ]
    return "\n".join([*head, body, ""])


def _subcircuit(
    cell: Cell, network: Network, spread: tuple[Network, Network] | None, reactive: Reactive | None
) -> list[str]:
    dialect = DIALECTS[cell.dialect]
    card = [".subckt", cell.name, *(pin.name for pin in cell.pins)]
    if cell.parameters:
        card.append(dialect.parameters + " ".join(f"{name}={value}" for name, value in cell.parameters))
    lines = [" ".join(card), *(f"* pin: {pin.name} {pin.kind} {pin.side}" for pin in cell.pins)]
    if reactive is not None:
        network, cards = within(network, reactive)
        lines += cards
    if spread is not None and WITHIN in dict(cell.parameters):
        lines += _within_tolerance(network, *spread, dialect)
    elif len(network.strain) == 1:
        lines += _fixed(network)
    elif spread is not None:
        lines += _by_spread(network, *spread, dialect)
    else:
        lines += _by_parameter(network, dialect) if cell.parameters else _by_pin(network, dialect)
    return [*lines, f".ends {cell.name}"]


def _fixed(network: Network) -> list[str]:
    """A resistor each."""
    ohm = (1.0 / network.conductance[0]).tolist()
    return [
        f"R{name} {a} {b} {value!r}{tc}"
        for name, (a, b), value, tc in zip(network.names, network.nodes, ohm, _coefficients(network), strict=True)
    ]


def _coefficients(network: Network) -> list[str]:
    """(R,) what a resistor's card says of temperature, after its value; all programs count from 27 C."""
    if not len(network.tc):
        return [""] * len(network.names)
    return [f" tc1={tc1!r} tc2={tc2!r}" for tc1, tc2 in network.tc.tolist()]


def _warmth(network: Network, dialect: Dialect) -> list[str]:
    """(R,) what a behavioural resistor's current is divided by, kept positive; empty where there is nothing."""
    if not len(network.tc):
        return [""] * len(network.names)
    dT = f"({dialect.temperature}-27)"
    return [f"/max(1+{dT}*(({tc1!r})+{dT}*({tc2!r})),{COLDEST!r})" for tc1, tc2 in network.tc.tolist()]


@frozen
class _Strained:
    """A network whose resistors follow its strains: those of one conductance share its logarithm."""

    axes: tuple[Axis, ...]
    """The strains."""
    used: tuple[str, ...]
    """Words for the strains that are used inside."""
    pieces: Pieces | Patches
    """Of the L conductances that differ."""
    logs: tuple[str, ...]
    """(L,) words for their logarithms, which no node has."""
    own: Ints
    """(R,) which of them is that of each resistor."""
    devices: tuple[str, ...]
    """(R,) names of the resistors that no other device has."""


def _strained(network: Network) -> _Strained:
    different, own = np.unique(network.conductance, axis=1, return_inverse=True)
    axes = network.axes
    words = [FLAG, *(axis.word for axis in axes)]
    nodes = dict.fromkeys([*words, *network.pins, *(node for ends in network.nodes for node in ends)])
    inner = [*(f"{axis.word}_used" for axis in axes), *(f"log_{k + 1}" for k in range(different.shape[1]))]
    inner = list(unique_names([*nodes, *inner])[len(nodes) :])
    used, logs = tuple(inner[: len(axes)]), tuple(inner[len(axes) :])
    taken = [*words, *used, *logs]
    devices = unique_names([*taken, *network.names])[len(taken) :]
    return _Strained(axes, used, _between(network, different), logs, own.ravel(), devices)


def _between(network: Network, conductance: Floats) -> Pieces | Patches:
    """Conductances (K, L) between the states of a network."""
    if not network.grid:
        return pieces(network.strain, conductance)
    first, second = (axis.strain for axis in network.grid)
    return patches(first, second, conductance.reshape(len(first), len(second), -1))


def _by_parameter(network: Network, dialect: Dialect) -> list[str]:
    """Resistors whose values follow the parameters, and a source for the flag."""
    known = _strained(network)
    lines = [
        f".param {used}={{{_clamped(axis.word, axis)}}}" for axis, used in zip(known.axes, known.used, strict=True)
    ]
    lines += [f".param {log}={{{_logarithm(known, k, known.used, dialect)}}}" for k, log in enumerate(known.logs)]
    lines += [
        f"R{name} {a} {b} {{exp(-{known.logs[k]})}}{tc}"
        for name, (a, b), k, tc in zip(
            known.devices, network.nodes, known.own.tolist(), _coefficients(network), strict=True
        )
    ]
    return [*lines, _flag(network, dialect)]


def _by_spread(network: Network, low: Network, high: Network, dialect: Dialect) -> list[str]:
    """As `_by_parameter`, and the logarithm of every resistance goes with the parameter mc from that of the median
    towards that of its 5th percentile (mc = -1.645) or its 95th (1.645), and straight on as far as `FURTHEST`."""
    lines = [f".param {SPREAD_USED}={{min(max({SPREAD},-{FURTHEST!r}),{FURTHEST!r})/{NORMAL!r}}}"]
    lines += _used(network)
    cards = zip(network.names, network.nodes, _coefficients(network), strict=True)
    for k, (name, (a, b), tc) in enumerate(cards):
        words = [f"{kind}_{k + 1}" for kind in ("middle", "low", "high")]
        for word, each in zip(words, (network, low, high), strict=True):
            lines.append(f".param {word}={{{_log_at(each, k, dialect)}}}")
        middle, lower, upper = words
        share = dialect.choose(f"{SPREAD_USED}<0", f"{middle}-{lower}", f"{upper}-{middle}")
        lines.append(f"R{name} {a} {b} {{exp(-{middle}-{SPREAD_USED}*{share})}}{tc}")
    return [*lines, _flag(network, dialect)]


def _within_tolerance(network: Network, low: Network, high: Network, dialect: Dialect) -> list[str]:
    """Every resistance goes straight from its value as stated to that at the low (tol = -1) or the high end (tol = 1);
    where strain is an input too, each of the three follows it as in `_by_parameter`."""
    lines = [f".param {WITHIN_USED}={{min(max({WITHIN},-1),1)}}"]
    strained = len(network.strain) > 1
    if strained:
        lines += _used(network)
    cards = zip(network.names, network.nodes, _coefficients(network), strict=True)
    for k, (name, (a, b), tc) in enumerate(cards):
        words = [f"{kind}_{k + 1}" for kind in ("middle", "low", "high")]
        for word, each in zip(words, (network, low, high), strict=True):
            fixed = repr(1.0 / float(each.conductance[0, k]))
            lines.append(f".param {word}={{{f'exp(-{_log_at(each, k, dialect)})' if strained else fixed}}}")
        middle, lower, upper = words
        share = dialect.choose(f"{WITHIN_USED}<0", f"{middle}-{lower}", f"{upper}-{middle}")
        lines.append(f"R{name} {a} {b} {{{middle}+{WITHIN_USED}*{share}}}{tc}")
    return [*lines, _flag(network, dialect)] if strained else lines


def _used(network: Network) -> list[str]:
    """Parameters for the strains within their ranges."""
    return [f".param {axis.word}_used={{{_clamped(axis.word, axis)}}}" for axis in network.axes]


def _log_at(network: Network, k: int, dialect: Dialect) -> str:
    """The logarithm of the conductance of one resistor, in S, at the strains of `_used`."""
    strains = [f"{axis.word}_used" for axis in network.axes]
    found = _between(network, network.conductance[:, [k]])
    if isinstance(found, Patches):
        return patch_of(found, 0, strains[0], strains[1], dialect)
    return _log_conductance(found, 0, strains[0], dialect)


def _flag(network: Network, dialect: Dialect) -> str:
    """The source of the flag where strains are parameters."""
    return f"V{FLAG} {FLAG} 0 {{{_outside([axis.word for axis in network.axes], network.axes, dialect)}}}"


def _by_pin(network: Network, dialect: Dialect) -> list[str]:
    """Sources whose conductances follow the voltage of a pin.

    Each logarithm is the voltage of a node of its own: only one derivative of the long expression is needed, which
    makes a transient three times as fast. It is held between those of the samples also where a simulator tries on
    its way what is no solution, so that the conductance is positive and finite always.
    """
    known = _strained(network)

    def source(name: str, plus: str, minus: str, quantity: str, of: str) -> str:
        return f"B{name} {plus} {minus} {quantity}={dialect.expression.format(of=of)}"

    lines = []
    for axis, used in zip(known.axes, known.used, strict=True):
        lines.append(f"R{axis.word} {axis.word} 0 {OPEN!r}")
        lines.append(source(used, used, "0", "V", _clamped(f"V({axis.word})", axis)))
    volts = [f"V({used})" for used in known.used]
    lines += [source(log, log, "0", "V", _logarithm(known, k, volts, dialect)) for k, log in enumerate(known.logs)]
    bounds = known.pieces.bounds.T.tolist()
    rows = zip(known.devices, network.nodes, known.own.tolist(), _warmth(network, dialect), strict=True)
    for name, (a, b), k, warmth in rows:
        low, high = bounds[k]
        current = f"V({a},{b})*exp(min(max(V({known.logs[k]}),{low!r}),{high!r})){warmth}"
        lines.append(source(name, a, b, "I", current))
    given = [f"V({axis.word})" for axis in known.axes]
    return [*lines, source(FLAG, FLAG, "0", "V", _outside(given, known.axes, dialect))]


def _clamped(strain: str, axis: Axis) -> str:
    """The strain within the sampled range."""
    low, high = axis.range
    return f"min(max({strain},{low!r}),{high!r})"


def _outside(strains: Sequence[str], axes: Sequence[Axis], dialect: Dialect) -> str:
    """1 where a strain is outside its sampled range, else 0."""
    found = "0"
    for strain, axis in reversed(list(zip(strains, axes, strict=True))):
        low, high = axis.range
        slack = SLACK * (high - low)
        found = dialect.choose(f"{strain}>{high + slack!r}", "1", found)
        found = dialect.choose(f"{strain}<{low - slack!r}", "1", found)
    return found


def _logarithm(known: _Strained, k: int, strains: Sequence[str], dialect: Dialect) -> str:
    """The logarithm of one of the conductances that differ, in S."""
    if isinstance(known.pieces, Patches):
        return patch_of(known.pieces, k, strains[0], strains[1], dialect)
    return _log_conductance(known.pieces, k, strains[0], dialect)


def _log_conductance(found: Pieces, resistor: int, strain: str, dialect: Dialect) -> str:
    """The logarithm of a conductance in S: the cubic of the piece in which a strain lies."""
    cubics = found.coefficients[:, :, resistor].T.tolist()
    knots = found.knots.tolist()
    texts = [cubic(strain, start, [repr(c) for c in four]) for start, four in zip(knots, cubics, strict=False)]
    return f"({piece_of(texts, knots, strain, dialect)})"
