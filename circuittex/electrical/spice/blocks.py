"""The sub-circuits of a deck of others, read but not yet expanded: resistors, sources, calls and parameters."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from circuittex.base.expression import DEEPEST, Expression
from circuittex.electrical.spice.cards import Card
from circuittex.electrical.spice.expression import RESERVED, compile_expression, read_number

ALLOWED = (
    "allowed are R, V and X cards, .subckt, .ends, .param, .include, .lib and .end; "
    "analyses and outputs are passed over"
)
PASSED_OVER = frozenset(
    {".op", ".print", ".plot", ".probe", ".meas", ".measure", ".options", ".option", ".save", ".tran", ".dc", ".title"}
)
"""Cards that say what to compute or to show, and nothing about the circuit."""
GROUND = "0"

_TOKEN = re.compile(r"\{[^{}]*\}|'[^']*'|=|[^\s=(){}',\"]+")
_ASSIGNED = re.compile(r"(?<![^\s,])([a-z_][a-z0-9_]*)\s*=\s*")


@dataclass(frozen=True)
class Resistor:
    card: Card
    name: str
    nodes: tuple[str, str]
    ohm: Expression


@dataclass(frozen=True)
class Source:
    card: Card
    name: str
    nodes: tuple[str, str]
    volts: Expression


@dataclass(frozen=True)
class Call:
    card: Card
    name: str
    nodes: tuple[str, ...]
    block: str
    parameters: dict[str, Expression]


@dataclass
class Block:
    """A sub-circuit, or the deck itself, whose `outer` is None."""

    name: str
    card: Card | None = None
    outer: Block | None = None
    pins: tuple[str, ...] = ()
    declared: frozenset[str] = frozenset()
    """The parameters that a call may give."""
    parameters: dict[str, tuple[Card, Expression]] = field(default_factory=dict)
    """Those declared and those of `.param`."""
    elements: list[Resistor | Source | Call] = field(default_factory=list)
    names: set[str] = field(default_factory=set)
    blocks: dict[str, Block] = field(default_factory=dict)

    def find(self, name: str) -> Block | None:
        """The sub-circuit that a call in this one means: of its own, or of those around it."""
        block: Block | None = self
        while block is not None:
            if name in block.blocks:
                return block.blocks[name]
            block = block.outer
        return None


def read_blocks(cards: Iterable[Card]) -> Block:
    """Return the deck, with its sub-circuits inside; `CircuitError` names the card that cannot be read.

    >>> deck = read_blocks([Card("a.cir", 2, "r1 a 0 1k")])
    >>> deck.elements[0].nodes, deck.elements[0].ohm
    (('a', '0'), (1000.0,))
    """
    top = block = Block("")
    depth = 0
    for card in cards:
        try:
            word = card.text.split(maxsplit=1)[0]
            if word == ".subckt":
                depth += 1
                if depth > DEEPEST:
                    raise ValueError(f"sub-circuits are nested deeper than {DEEPEST}")
                block = _opened(card, block)
            elif word == ".ends":
                block = _closed(card, block)
                depth -= 1
            elif word == ".param":
                _add_parameters(card, block)
            elif word[0] in "rvx":
                _add_element(card, block)
            elif word not in PASSED_OVER or (word.startswith(".option") and "rshunt" in card.text):
                raise ValueError(ALLOWED)
        except ValueError as error:
            raise card.refused(str(error)) from error
    if block.card is not None:
        raise block.card.refused("its .ends is missing")
    return top


def _opened(card: Card, outer: Block) -> Block:
    words, assigned = _split(card.text)
    if len(words) < 3:
        raise ValueError("a .subckt has a name and pins")
    name, pins = words[1], tuple(map(_node, words[2:]))
    if name in outer.blocks:
        raise ValueError(f"there is a sub-circuit {name!r} already")
    if len(set(pins)) < len(pins) or GROUND in pins:
        raise ValueError("its pins must differ, and none can be ground")
    block = Block(name, card, outer, pins, frozenset(assigned))
    block.parameters = {each: (card, expression) for each, expression in assigned.items()}
    outer.blocks[name] = block
    return block


def _closed(card: Card, block: Block) -> Block:
    words = card.text.split()
    if block.outer is None:
        raise ValueError("there is no .subckt before it")
    if words[1:] not in ([], [block.name]):
        raise ValueError(f"the sub-circuit that is open is {block.name!r}")
    return block.outer


def _add_parameters(card: Card, block: Block) -> None:
    words, assigned = _split(card.text)
    if words != [".param"] or not assigned:
        raise ValueError("a .param is followed by name = expression, once or more")
    for name, expression in assigned.items():
        if name in block.parameters:
            raise ValueError(f"there is a parameter {name!r} already")
        block.parameters[name] = (card, expression)


def _add_element(card: Card, block: Block) -> None:
    name = card.text.split(maxsplit=1)[0]
    element = _ELEMENTS[name[0]](card, name)
    if name in block.names:
        raise ValueError(f"there is a {name!r} already")
    block.names.add(name)
    block.elements.append(element)


def _resistor(card: Card, name: str) -> Resistor:
    words = _words(card.text)
    if len(words) == 6 and words[3:5] == ["r", "="]:
        words = [*words[:3], words[5]]
    if len(words) != 4:
        raise ValueError("a resistor is R<name> node node value, or R=value; models and coefficients are not read")
    return Resistor(card, name, (_node(words[1]), _node(words[2])), _value(words[3]))


def _source(card: Card, name: str) -> Source:
    words = _words(card.text)
    rest = words[3:]
    if rest[:1] == ["dc"]:
        rest = rest[2:] if rest[1:2] == ["="] else rest[1:]
    if len(words) < 3 or len(rest) > 1:
        raise ValueError("a voltage source is V<name> node node value or dc value; wave forms are not read")
    nodes = _node(words[1]), _node(words[2])
    return Source(card, name, nodes, _value(rest[0]) if rest else (0.0,))


def _call(card: Card, name: str) -> Call:
    words, parameters = _split(card.text)
    if len(words) < 3:
        raise ValueError("a call is X<name> nodes sub-circuit, and parameters")
    return Call(card, name, tuple(map(_node, words[1:-1])), words[-1], parameters)


_ELEMENTS: dict[str, Callable[[Card, str], Resistor | Source | Call]] = {"r": _resistor, "v": _source, "x": _call}


def _node(word: str) -> str:
    if word[0] in "{'=" or "params:" in word:
        raise ValueError(f"{word!r} is no node")
    if word == "ground":
        raise ValueError("some simulators take the node 'ground' for node 0 and some do not; give it another name")
    return GROUND if word == "gnd" else word


def _value(word: str) -> Expression:
    return compile_expression(word[1:-1]) if word[0] in "{'" else (read_number(word),)


def _words(text: str) -> list[str]:
    """The words of a card; an expression in braces or quotes is one."""
    if left := _TOKEN.sub("", text).split():
        raise ValueError(f"{left[0][:20]!r} is not expected")
    return _TOKEN.findall(text)


def _split(text: str) -> tuple[list[str], dict[str, Expression]]:
    """The words of a card before its parameters, and the parameters."""
    found = list(_ASSIGNED.finditer(text))
    head = text[: found[0].start()] if found else text
    words = [word for word in _words(head) if word != "params:"]
    assigned: dict[str, Expression] = {}
    starts = [*(each.start() for each in found), len(text)]
    for this, end in zip(found, starts[1:], strict=True):
        value = text[this.end() : end].strip().rstrip(",").strip()
        if value[:1] + value[-1:] in ("{}", "''") and len(value) > 1:
            value = value[1:-1]
        elif re.search(r"\s", value):
            raise ValueError(f"{value[:40]!r} must stand in braces: simulators disagree about where it ends")
        if this[1] in assigned:
            raise ValueError(f"{this[1]!r} is given twice")
        if this[1] in RESERVED:
            raise ValueError(f"{this[1]!r} means something else to simulators; give the parameter another name")
        assigned[this[1]] = compile_expression(value)
    return words, assigned
