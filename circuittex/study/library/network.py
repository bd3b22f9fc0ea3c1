"""Resistors between the pins of a sub-circuit, whose conductances are known at one or more strains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

import networkx as nx
import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import CircuitError
from circuittex.base.frozen import frozen
from circuittex.electrical.network.circuit import Circuit
from circuittex.electrical.network.names import unique_names
from circuittex.electrical.network.ports import PortMatrix, port_matrix

STRAIN, FLAG, USED = CONTROLS = ("strain", "out_of_range", "strain_used")
"""What drives a strained cell: the parameter or pin, the pin that flags, and the strain that is used inside."""
SPREAD, SPREAD_USED = "mc", "mc_used"
"""The parameter that tells a place among the corners of an ensemble, and what is used of it."""
WITHIN, WITHIN_USED = "tol", "tol_used"
"""The parameter that tells a place within the tolerances, from -1 to 1, and what is used of it."""
FLOOR = 1e-9
"""What opens in some states of a path and not in others keeps this part of its smallest conductance: the logarithm of
none has no value between states, and a resistor that reaches none stops a transient."""

ALIKE = 1e-6
"""Relative: of resistances that differ by less the first is the largest."""


@frozen
class Axis:
    """A strain that is an input."""

    word: str
    """The parameter or pin."""
    strain: Floats
    """(n,) at which states are known, rising."""

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest."""
        return float(self.strain[0]), float(self.strain[-1])


@frozen
class Network:
    """R resistors, P pins, K states."""

    pins: tuple[str, ...]
    """(P,) words; the nodes that are no pin are inside."""
    names: tuple[str, ...]
    """(R,) of the resistors, without the letter of their card."""
    nodes: tuple[tuple[str, str], ...]
    """(R,) the two nodes of each resistor, words."""
    strain: Floats
    """(K,) rising; one value where strain is no input; of a grid of two strains the number of each state."""
    conductance: Floats
    """(K, R) S, positive."""
    grid: tuple[Axis, ...] = ()
    """Where two strains are inputs, both; the states are those of their grid, row by row along the second."""
    tc: Floats = field(default_factory=lambda: np.empty((0, 2)))
    """(R, 2) temperature coefficients tc1 (1/K) and tc2 (1/K2) of each resistance; (0, 2) where there are none."""

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The strains that are inputs."""
        return self.grid or (Axis(STRAIN, self.strain),)


def ports_network(matrices: Sequence[PortMatrix], strain: Floats) -> Network:
    """A resistor between each two pins that anything joins: the exact reduction, -G_ij.

    >>> matrix = PortMatrix(("a", "b"), np.array([[0.5, -0.5], [-0.5, 0.5]]))
    >>> ports_network([matrix], np.zeros(1)).conductance.tolist()
    [[0.5]]
    """
    pins = pin_words(matrices[0].ports)
    i, j = np.triu_indices(len(pins), 1)
    siemens = -np.array([matrix.conductance[i, j] for matrix in matrices])
    there = (siemens > 0.0).any(axis=0)
    ends = [(pins[a], pins[b]) for a, b in zip(i[there].tolist(), j[there].tolist(), strict=True)]
    names = unique_names(f"{a}_{b}" for a, b in ends)
    return Network(pins, names, tuple(ends), strain, _positive(siemens[:, there]))


def pin_words(ports: Sequence[str]) -> tuple[str, ...]:
    """Words for ports that are none of those of strain.

    >>> pin_words(["warp1_minus", "Strain"])
    ('warp1_minus', 'strain_2')
    """
    return unique_names([*CONTROLS, *ports])[len(CONTROLS) :]


def circuit_network(circuits: Sequence[Circuit], strain: Floats, pins: Sequence[str]) -> Network:
    """The network of circuits of the same shape; of their ports those called as in `pins`, in that order."""
    first = circuits[0]
    if any(each.resistor_names != first.resistor_names for each in circuits):
        raise CircuitError("the networks of the states differ in shape: they cannot be one sub-circuit")
    words = pin_words(first.node_names)
    place = {name: words[node] for name, node in zip(first.ports, first.port_node.tolist(), strict=True)}
    ends = [(words[a], words[b]) for a, b in first.resistor_nodes.tolist()]
    return Network(
        tuple(place[name] for name in pins),
        unique_names(first.resistor_names),
        tuple(ends),
        strain,
        1.0 / np.array([each.resistance for each in circuits]),
    )


def matrix_at(network: Network, conductance: Floats) -> PortMatrix:
    """The port matrix of a network with these conductances (R,)."""
    number = {name: k for k, name in enumerate(dict.fromkeys([*network.pins, *(n for e in network.nodes for n in e)]))}
    pairs = np.array([[number[a], number[b]] for a, b in network.nodes], dtype=np.int64).reshape(-1, 2)
    circuit = Circuit(
        node_names=tuple(number),
        node_fibril=np.full(len(number), -1),
        node_xi=np.full(len(number), np.nan),
        resistor_nodes=pairs,
        resistance=1.0 / conductance,
        resistor_names=network.names,
        resistor_kind=np.full(len(pairs), 2),
        ports=network.pins,
        port_node=np.arange(len(network.pins)),
        merged_feet=0,
        dropped_contacts=0,
        unreached=np.empty(0, dtype=np.int64),
    )
    return port_matrix(circuit)


def farthest(network: Network) -> tuple[tuple[str, str], float]:
    """The first pin that anything joins, the one with the largest resistance to it, and that in the first state, ohm.

    Along one yarn a strain may change nothing; the way to another yarn leads through contacts.

    >>> farthest(Network(("a", "b", "c"), ("ab", "bc"), (("a", "b"), ("b", "c")), np.zeros(1), np.full((1, 2), 0.5)))
    (('a', 'c'), 4.0)
    """
    parts = _parts(network)
    number, source = next((k, pin) for k, pin in enumerate(network.pins) if any({pin} < part for part in parts))
    (part,) = [part for part in parts if source in part]
    own = [k for k, pin in enumerate(network.pins) if k != number and pin in part]
    G = matrix_at(network, network.conductance[0]).conductance[np.ix_(own, own)]
    ohm = np.linalg.inv(G).diagonal()  # the first pin is at ground
    k = int(np.argmax(ohm > (1.0 - ALIKE) * ohm.max()))
    return (source, network.pins[own[k]]), float(ohm[k])


def floating(network: Network, ground: str) -> tuple[str, ...]:
    """A pin of each part of a network that nothing joins to the pin `ground`.

    >>> floating(Network(("a", "b", "c"), ("a_b",), (("a", "b"),), np.zeros(1), np.ones((1, 1))), "a")
    ('c',)
    """
    return tuple(min(part) for part in _parts(network) if part and ground not in part)


def _parts(network: Network) -> list[set[str]]:
    """The pins of each part that hangs together."""
    graph = nx.Graph(network.nodes)
    graph.add_nodes_from(network.pins)
    return [part.intersection(network.pins) for part in nx.connected_components(graph)]


def _positive(siemens: Floats) -> Floats:
    """(K, R) the conductances, what is none in some states lifted to `FLOOR` of the smallest of the others."""
    smallest = np.where(siemens > 0.0, siemens, np.inf).min(axis=0, initial=np.inf)
    return np.asarray(np.maximum(siemens, FLOOR * smallest))
