"""Resistor decks of others: what they hold after all sub-circuits are expanded, as a circuit and its drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from circuittex.base.errors import CircuitError
from circuittex.base.expression import DEEPEST, Expression
from circuittex.base.frozen import frozen
from circuittex.electrical.network.circuit import REDUCED, Circuit
from circuittex.electrical.spice.blocks import GROUND, Block, Call, Resistor, Source, read_blocks
from circuittex.electrical.spice.cards import Card, read_cards
from circuittex.electrical.spice.expression import evaluate

LARGEST = 2_000_000
"""Resistors, sources and calls of an expanded deck at most."""
GROUND_PORT = "ground"


@frozen
class Deck:
    """A deck that was read."""

    circuit: Circuit
    """Its resistors, named as in the deck with the calls before them ('x1.r2'), and a port for each driven node."""
    drive: dict[str, float]
    """Voltage of each port, V; the port 'ground' is node 0."""


def read_deck(path: str | Path) -> Deck:
    """Return the circuit of a SPICE deck that anybody wrote, of resistors driven by DC sources against ground.

    Read are R, V and X cards, `.subckt`, `.param` and includes from the deck's own folder; what only says what to
    compute or to show is passed over. Nodes inside a call are named as ngspice does, 'x1.mid'.

    Raises `CircuitError` for anything else, with the file, the line and what is allowed.

    >>> import tempfile
    >>> from circuittex.electrical.network.nodal import solve_nodal
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "a.cir").write_text("divider\\nV1 top 0 4\\nR1 top mid 1k\\nR2 mid 0 3k\\n.op\\n.end\\n")
    ...     deck = read_deck(Path(folder, "a.cir"))
    >>> deck.drive, deck.circuit.node_names
    ({'ground': 0.0, 'top': 4.0}, ('0', 'top', 'mid'))
    >>> solve_nodal(deck.circuit, deck.drive).voltage.tolist()
    [0.0, 4.0, 3.0]
    """
    top = read_blocks(read_cards(Path(path)))
    _refuse_bombs(top)
    found = _Found()
    _expand(_Frame(top, None, {}), {}, "", found)
    if not found.ohm:
        raise CircuitError(f"{Path(path).name}: it has no resistors")
    return found.deck()


@dataclass
class _Found:
    """What has been expanded so far."""

    number: dict[str, int] = field(default_factory=lambda: {GROUND: 0})
    pairs: list[tuple[int, int]] = field(default_factory=list)
    ohm: list[float] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    volts: dict[str, float] = field(default_factory=dict)

    def node(self, name: str) -> int:
        return self.number.setdefault(name, len(self.number))

    def deck(self) -> Deck:
        nodes = tuple(self.number)
        drive = {GROUND_PORT: 0.0, **self.volts}
        return Deck(
            circuit=Circuit(
                node_names=nodes,
                node_fibril=np.full(len(nodes), -1),
                node_xi=np.full(len(nodes), np.nan),
                resistor_nodes=np.array(self.pairs, dtype=np.int64).reshape(-1, 2),
                resistance=np.array(self.ohm, dtype=np.float64),
                resistor_names=tuple(self.names),
                resistor_kind=np.full(len(self.ohm), REDUCED),
                ports=tuple(drive),
                port_node=np.array([0, *(self.number[node] for node in self.volts)], dtype=np.int64),
                merged_feet=0,
                dropped_contacts=0,
                unreached=np.empty(0, dtype=np.int64),
            ),
            drive=drive,
        )


@dataclass
class _Frame:
    """One call of a sub-circuit: where its parameters have values."""

    block: Block
    caller: _Frame | None
    given: dict[str, float]
    known: dict[str, float] = field(default_factory=dict)
    asked: list[str] = field(default_factory=list)

    def value(self, name: str) -> float:
        """The value of a parameter as this call sees it: its own, one of a block around it, or one of the deck's.

        ngspice would also take a parameter of the caller, and takes it before one of the deck's of the same name;
        others do not.
        """
        frame: _Frame | None = self
        while frame is not None and name not in frame.block.parameters:
            frame = frame.caller
        if frame is None:
            raise ValueError(f"there is no parameter {name!r} here")
        if not _inside(self.block, frame.block):
            raise ValueError(
                f"{name!r} is a parameter of the sub-circuit {frame.block.name!r} that calls this one; simulators "
                "disagree about what it means here: hand it on in the call"
            )
        return frame.own(name)

    def own(self, name: str) -> float:
        if name not in self.known:
            if name in self.asked:
                raise ValueError(f"the parameter {name!r} follows from itself")
            if len(self.asked) >= DEEPEST:
                raise ValueError(f"more than {DEEPEST} parameters follow from one another")
            self.asked.append(name)
            if name in self.given:
                self.known[name] = self.given[name]
            else:
                card, expression = self.block.parameters[name]
                self.known[name] = _evaluated(card, expression, self.value)
            self.asked.pop()
        return self.known[name]


def _inside(block: Block | None, outer: Block) -> bool:
    while block is not None and block is not outer:
        block = block.outer
    return block is outer


def _evaluated(card: Card, expression: Expression, value_of: Callable[[str], float]) -> float:
    try:
        return evaluate(expression, value_of)
    except CircuitError:
        raise
    except ValueError as error:
        raise card.refused(str(error)) from error


def _refuse_bombs(top: Block) -> None:
    """Raise for a deck that would expand to too much, before it does."""
    size: dict[int, int] = {}

    def count(block: Block, depth: int, card: Card | None) -> int:
        if id(block) not in size:
            if card is not None and depth > DEEPEST:
                raise card.refused(f"calls are nested deeper than {DEEPEST}, or a sub-circuit calls itself")
            total = len(block.elements)
            for element in block.elements:
                if isinstance(element, Call):
                    total += count(_called(block, element), depth + 1, element.card)
                    if total > LARGEST:
                        raise element.card.refused(
                            f"with it, the expanded deck has more than {LARGEST} resistors, sources and calls"
                        )
            size[id(block)] = total
        return size[id(block)]

    count(top, 0, None)


def _called(block: Block, call: Call) -> Block:
    found = block.find(call.block)
    if found is None:
        raise call.card.refused(f"there is no sub-circuit {call.block!r} here")
    if len(found.pins) != len(call.nodes):
        raise call.card.refused(f"{call.block!r} has {len(found.pins)} pins, and the call has {len(call.nodes)} nodes")
    if unknown := sorted(set(call.parameters) - found.declared):
        raise call.card.refused(f"{call.block!r} has no parameter {unknown[0]!r}")
    return found


def _expand(frame: _Frame, pins: dict[str, str], prefix: str, found: _Found) -> None:
    """Add the elements of one call, whose inner nodes begin with `prefix`."""

    def node(name: str) -> str:
        if "." in name and name.partition(".")[0] in frame.block.names:
            raise element.card.refused(f"the node {name!r} could be inside the call {name.partition('.')[0]!r}")
        return name if name == GROUND else pins.get(name, prefix + name)

    for element in frame.block.elements:
        if isinstance(element, Resistor):
            ohm = _evaluated(element.card, element.ohm, frame.value)
            if not ohm > 0.0:
                raise element.card.refused(f"a resistance of {ohm!r} ohm is not positive")
            found.pairs.append((found.node(node(element.nodes[0])), found.node(node(element.nodes[1]))))
            found.ohm.append(ohm)
            found.names.append(prefix + element.name)
        elif isinstance(element, Source):
            _drive(element, [node(each) for each in element.nodes], frame, found)
        else:
            block = _called(frame.block, element)
            given = {name: _evaluated(element.card, each, frame.value) for name, each in element.parameters.items()}
            inner = dict(zip(block.pins, map(node, element.nodes), strict=True))
            _expand(_Frame(block, frame, given), inner, f"{prefix}{element.name}.", found)


def _drive(source: Source, nodes: list[str], frame: _Frame, found: _Found) -> None:
    plus, minus = nodes
    if (plus == GROUND) == (minus == GROUND):
        raise source.card.refused("a source must drive one node against node 0")
    volts = _evaluated(source.card, source.volts, frame.value)
    driven, volts = (plus, volts) if minus == GROUND else (minus, -volts)
    if driven in found.volts:
        raise source.card.refused(f"another source drives the node {driven!r} already")
    found.node(driven)
    found.volts[driven] = volts
