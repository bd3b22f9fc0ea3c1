"""The resistor network of a contact state: fibril segments, contacts, and the terminals as ports."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import networkx as nx
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import CircuitError
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState
from circuittex.design import Terminal
from circuittex.electrical.network.feet import (
    axial_resistance,
    fibril_names,
    live_contacts,
    micrometres,
    place_names,
    sites,
)
from circuittex.electrical.network.names import unique_names
from circuittex.geometry.mesh import FibrilMesh

SEGMENT, CONTACT, REDUCED = 0, 1, 2
KINDS = ("segment", "contact", "reduced")


@frozen
class Circuit:
    """A network of K nodes, R resistors and P ports, detailed (`build_circuit`) or reduced (`reduced_circuit`)."""

    node_names: tuple[str, ...]
    """(K,) words that tell fibril and place, for example 'warp2_f03_1250um' (fibrils of a yarn count from 1)."""
    node_fibril: Ints
    """(K,) fibril of each node; -1 where fibrils are joined (ports) and in the reduced network."""
    node_xi: Floats
    """(K,) axis coordinate, mm; nan where `node_fibril` is -1."""
    resistor_nodes: Ints
    """(R, 2) nodes of each resistor."""
    resistance: Floats
    """(R,) ohm, positive and finite."""
    resistor_names: tuple[str, ...]
    """(R,) for example 's_warp2_f03_1250um' (starts there) and 'c_warp2_f03_weft1_f07_1250um' (place on the first)."""
    resistor_kind: Ints
    """(R,) `SEGMENT` of a fibril, `CONTACT` between two, or a resistor of the `REDUCED` network."""
    ports: tuple[str, ...]
    """(P,) names of the terminals."""
    port_node: Ints
    """(P,) node of each port."""
    merged_feet: int
    """Contact feet that share their node with another foot or a fibril end."""
    dropped_contacts: int
    """Contacts left out since no current can pass them."""
    unreached: Ints
    """(U,) conducting fibrils that no port reaches; they have no defined potential and are left out."""

    @property
    def n_nodes(self) -> int:
        return len(self.node_names)

    @property
    def n_resistors(self) -> int:
        return len(self.resistance)


def build_circuit(contacts: ContactState, terminals: Sequence[Terminal], *, dropped_contacts: int = 0) -> Circuit:
    """Return the detailed circuit of a contact state, each terminal joined to one node.

    Neighbouring nodes of a fibril are joined by R = ∫ dxi / (sigma A f) with f the axial factor of the elements
    between them, the two feet of a contact by R = 1 / G with G = sigma_c a w [31]. Fibril ends that belong to no
    terminal are insulated one by one [53]. `dropped_contacts` counts what was dropped from `contacts` before.

    Raises `CircuitError` for terminals that share a yarn end or name none, and for values that are not finite.
    """
    return build_circuits(contacts, [terminals], dropped_contacts=dropped_contacts)[0]


def build_circuits(
    contacts: ContactState, terminals: Sequence[Sequence[Terminal]], *, dropped_contacts: int = 0
) -> list[Circuit]:
    """Return `build_circuit` of one contact state for several choices of terminals."""
    apart = _resistors_apart(contacts)
    return [_joined(contacts, apart, choice, dropped_contacts) for choice in terminals]


@frozen
class _Apart:
    """All fibril segments and live contacts between S sites, before terminals join any of these."""

    live: Ints
    """(L,) the contacts that can carry current."""
    fibril: Ints
    """(S,) fibril of each site."""
    xi: Floats
    """(S,) axis coordinate of each site, mm."""
    end_site: Ints
    """(F, 2) sites of the ends of each fibril, -1 for an insulating one."""
    place_names: tuple[str, ...]
    """(S,) word for each site; not all of them differ."""
    site: Ints
    """(R, 2) sites of each resistor: the segments, then the contacts."""
    kind: Ints
    """(R,) `SEGMENT` or `CONTACT`."""
    resistance: Floats
    """(R,) ohm."""
    names: tuple[str, ...]
    """(R,) name of each resistor."""


def _resistors_apart(contacts: ContactState) -> _Apart:
    live = live_contacts(contacts)
    fibril, xi, foot_site, end_site = sites(contacts, live)
    first = np.flatnonzero(fibril[1:] == fibril[:-1])
    places = place_names(contacts.mesh, fibril, xi)
    return _Apart(
        live=live,
        fibril=fibril,
        xi=xi,
        end_site=end_site,
        place_names=tuple(places),
        site=np.concatenate([np.stack([first, first + 1], axis=1), foot_site]),
        kind=np.repeat([SEGMENT, CONTACT], [len(first), len(live)]),
        resistance=np.concatenate([axial_resistance(contacts, fibril, xi)[first], 1.0 / contacts.conductance[live]]),
        names=unique_names([f"s_{places[i]}" for i in first.tolist()] + _contact_names(contacts, live)),
    )


def _joined(contacts: ContactState, apart: _Apart, terminals: Sequence[Terminal], dropped_contacts: int) -> Circuit:
    """Join the sites of each terminal, and keep what the terminals reach."""
    port_of_site = _join(contacts.mesh, terminals, apart.end_site, len(apart.xi))
    unjoined = port_of_site < 0
    inner = np.flatnonzero(unjoined)
    node = np.where(unjoined, len(terminals) + np.cumsum(unjoined) - 1, port_of_site)
    pairs = node[apart.site]
    loop = pairs[:, 0] == pairs[:, 1]  # both ends in one terminal: no current
    keep = np.flatnonzero(~loop)
    lost = contacts.n_contacts - len(apart.live) + int(np.sum(loop & (apart.kind == CONTACT)))
    whole = Circuit(
        node_names=unique_names([t.name for t in terminals] + [apart.place_names[i] for i in inner.tolist()]),
        node_fibril=np.concatenate([np.full(len(terminals), -1), apart.fibril[inner]]),
        node_xi=np.concatenate([np.full(len(terminals), np.nan), apart.xi[inner]]),
        resistor_nodes=pairs[keep],
        resistance=apart.resistance[keep],
        resistor_names=tuple([apart.names[i] for i in keep.tolist()]),
        resistor_kind=apart.kind[keep],
        ports=tuple(t.name for t in terminals),
        port_node=np.arange(len(terminals)),
        merged_feet=2 * len(apart.live) + 2 * len(np.unique(apart.fibril)) - len(apart.xi),
        dropped_contacts=dropped_contacts + lost,
        unreached=np.empty(0, dtype=np.int64),
    )
    return reached_part(whole, whole.ports)


def reached_part(circuit: Circuit, ports: Iterable[str]) -> Circuit:
    """Return the part of a circuit that the given ports reach; ports that it does not contain are no ports of it.

    >>> cut = reached_part(reduced_circuit((2, 2), 1.0, np.inf), ["warp1_minus"])
    >>> cut.ports, cut.n_nodes
    (('warp1_minus', 'warp1_plus'), 4)
    """
    island = islands(circuit)
    reached = np.isin(island, island[port_nodes(circuit, ports)])
    if reached.all():
        return circuit
    number = np.cumsum(reached) - 1
    keep = np.flatnonzero(reached[circuit.resistor_nodes[:, 0]])
    lost = np.unique(circuit.node_fibril[~reached & (circuit.node_fibril >= 0)])
    kept_ports = np.flatnonzero(reached[circuit.port_node])
    return replace(
        circuit,
        node_names=tuple([circuit.node_names[i] for i in np.flatnonzero(reached)]),
        node_fibril=circuit.node_fibril[reached],
        node_xi=circuit.node_xi[reached],
        resistor_nodes=number[circuit.resistor_nodes[keep]],
        resistance=circuit.resistance[keep],
        resistor_names=tuple([circuit.resistor_names[i] for i in keep]),
        resistor_kind=circuit.resistor_kind[keep],
        ports=tuple([circuit.ports[i] for i in kept_ports]),
        port_node=number[circuit.port_node[kept_ports]],
        unreached=np.union1d(circuit.unreached, lost).astype(np.int64),
    )


def with_ports(circuit: Circuit, ports: Sequence[str]) -> Circuit:
    """Return the circuit with its ports, which are the first of its nodes, in another order.

    >>> line = reached_part(reduced_circuit((1, 1), 1.0, np.inf), ["warp1_plus"])
    >>> turned = with_ports(line, ["warp1_plus", "warp1_minus"])
    >>> turned.node_names, turned.resistor_nodes.tolist()
    (('warp1_plus', 'warp1_minus', 'warp1_at_weft1'), [[1, 2], [2, 0]])
    """
    if tuple(ports) == circuit.ports:
        return circuit
    first = port_nodes(circuit, ports)
    nodes = np.concatenate([first, np.setdiff1d(np.arange(circuit.n_nodes), first)])
    return replace(
        circuit,
        node_names=tuple([circuit.node_names[i] for i in nodes.tolist()]),
        node_fibril=circuit.node_fibril[nodes],
        node_xi=circuit.node_xi[nodes],
        resistor_nodes=np.argsort(nodes)[circuit.resistor_nodes],
        ports=tuple(ports),
        port_node=np.arange(len(first)),
    )


def islands(circuit: Circuit) -> Ints:
    """Return for each node the number (K,) of the connected part of the circuit it belongs to.

    >>> islands(reduced_circuit((1, 1), 1.0, np.inf)).tolist()
    [0, 0, 1, 1, 0, 1]
    """
    i, j = circuit.resistor_nodes.T
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(circuit.n_nodes, circuit.n_nodes))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def port_nodes(circuit: Circuit, ports: Iterable[str]) -> Ints:
    """Return the node of each named port; `CircuitError` for a name that is no port."""
    table = dict(zip(circuit.ports, circuit.port_node.tolist(), strict=True))
    names = list(ports)
    unknown = [name for name in names if name not in table]
    if unknown:
        raise CircuitError(f"port {unknown[0]!r} does not exist; the circuit has {', '.join(circuit.ports) or 'none'}")
    return np.array([table[name] for name in names], dtype=np.int64)


def _join(mesh: FibrilMesh, terminals: Sequence[Terminal], end_site: Ints, n_sites: int) -> Ints:
    """Return the terminal (S,) that each site belongs to, -1 for none."""
    if len({t.name for t in terminals}) < len(terminals):
        raise CircuitError(f"terminal names repeat: {', '.join(t.name for t in terminals)}")
    yarn_of = {name: y for y, name in enumerate(mesh.yarn_names)}
    port = np.full(n_sites, -1, dtype=np.int64)
    owner: dict[tuple[str, int], str] = {}
    for p, terminal in enumerate(terminals):
        for yarn, side in terminal.ends:
            if yarn not in yarn_of or side not in (-1, 1):
                known = ", ".join(mesh.yarn_names)
                raise CircuitError(
                    f"terminal {terminal.name!r}: no yarn end ({yarn!r}, {side}); yarns {known}, sides -1, 1"
                )
            if (yarn, side) in owner:
                raise CircuitError(
                    f"terminals {owner[yarn, side]!r} and {terminal.name!r} share the end ({yarn!r}, {side})"
                )
            owner[yarn, side] = terminal.name
            joined = end_site[mesh.yarn == yarn_of[yarn], (side + 1) // 2]
            port[joined[joined >= 0]] = p
    return port


def _contact_names(contacts: ContactState, live: Ints) -> list[str]:
    """Name the live contacts after their fibrils and their place on the first."""
    fibrils = fibril_names(contacts.mesh)
    return [
        f"c_{fibrils[a]}_{fibrils[b]}_{um}um"
        for a, b, um in zip(
            contacts.fibril_a[live].tolist(),
            contacts.fibril_b[live].tolist(),
            micrometres(contacts.xi_a[live]),
            strict=True,
        )
    ]


def reduced_circuit(shape: tuple[int, int], Ry: float | Floats, Rc: float | Floats) -> Circuit:
    """Return the reduced network [43-46] of a weave of `shape` = (warp, weft) yarns.

    Each crossing has a node on its warp and one on its weft yarn with `Rc` (ohm) between them, and four arms Ry/2
    to the edges of its cell. Two arms that meet between neighbouring crossings are one resistor `Ry`; the outer arms
    lead to the ports 'warp1_minus', 'warp1_plus', .... With Rc infinite the yarns are insulated from each other.
    Resistors of the yarns are named 'ry_...' and come first, those of the crossings 'rc_...'.

    `Ry` may be given yarn by yarn (warp + weft,), infinite for one that insulates, `Rc` crossing by crossing
    (warp, weft).

    >>> reduced_circuit((4, 4), 0.2829, 10.0).n_resistors
    56
    """
    n, m = shape
    if not (n > 0 and m > 0 and np.all(np.asarray(Ry) > 0) and np.min(Ry) < np.inf and np.all(np.asarray(Rc) > 0)):
        raise CircuitError(f"reduced network {n} x {m}, Ry = {Ry!r}, Rc = {Rc!r}: all must be positive, Ry finite")
    along, across = np.broadcast_to(Ry, (n + m,)), np.broadcast_to(Rc, (n, m))
    conducts = np.isfinite(along)
    yarns = [f"warp{i + 1}" for i in range(n)] + [f"weft{j + 1}" for j in range(m)]
    ports = [yarn_end_name(yarn, side) for yarn in yarns for side in (-1, 1)]
    warp = len(ports) + np.arange(n * m).reshape(n, m)
    weft = warp.T + n * m
    outer = np.arange(len(ports)).reshape(-1, 2)
    chains = [np.concatenate([ends[:1], row, ends[1:]]) for ends, row in zip(outer, [*warp, *weft], strict=True)]
    lines = [(yarns[k], chains[k], along[k]) for k in np.flatnonzero(conducts)]
    arms = np.concatenate([np.stack([chain[:-1], chain[1:]], axis=1) for _, chain, _ in lines])
    ohm = np.concatenate([each * np.r_[0.5, np.ones(len(chain) - 3), 0.5] for _, chain, each in lines])
    names = [f"ry_{yarn}_{k}" for yarn, chain, _ in lines for k in range(len(chain) - 1)]
    joined = np.isfinite(across) & conducts[:n, None] & conducts[None, n:]
    arms = np.concatenate([arms, np.stack([warp[joined], weft.T[joined]], axis=1)])
    ohm = np.concatenate([ohm, across[joined]])
    names += [f"rc_{i + 1}_{j + 1}" for i, j in np.argwhere(joined)]
    inner = [f"warp{i + 1}_at_weft{j + 1}" for i in range(n) for j in range(m)]
    inner += [f"weft{j + 1}_at_warp{i + 1}" for i in range(n) for j in range(m)]
    there = np.ones(len(ports) + 2 * n * m, dtype=bool)
    there[warp[~conducts[:n]]] = there[weft[~conducts[n:]]] = False  # an insulating yarn has no nodes at crossings
    nodes = unique_names([name for name, kept in zip(ports + inner, there, strict=True) if kept])
    arms = (np.cumsum(there) - 1)[arms]
    return Circuit(
        node_names=nodes,
        node_fibril=np.full(len(nodes), -1),
        node_xi=np.full(len(nodes), np.nan),
        resistor_nodes=arms,
        resistance=ohm,
        resistor_names=tuple(names),
        resistor_kind=np.full(len(arms), REDUCED),
        ports=tuple(ports),
        port_node=np.arange(len(ports)),
        merged_feet=0,
        dropped_contacts=0,
        unreached=np.empty(0, dtype=np.int64),
    )


def yarn_end_terminals(mesh: FibrilMesh) -> tuple[Terminal, ...]:
    """Return one terminal for each yarn end, 'warp1_minus', 'warp1_plus', ...: the pins of a sub-circuit."""
    return tuple(
        Terminal(name=yarn_end_name(yarn, side), ends=((yarn, side),)) for yarn in mesh.yarn_names for side in (-1, 1)
    )


def yarn_end_name(yarn: str, side: int) -> str:
    """Return the name of a yarn end where it is a port.

    >>> yarn_end_name("warp2", -1)
    'warp2_minus'
    """
    return f"{yarn}_{'minus' if side < 0 else 'plus'}"


def to_networkx(circuit: Circuit) -> nx.MultiGraph:
    """Return the circuit as a networkx multigraph.

    Nodes are keyed by name and carry `fibril`, `xi` and, at a port, `port`; edges are keyed by resistor name and carry
    `resistance`, `conductance` and `kind`.

    >>> graph = to_networkx(reduced_circuit((1, 1), 2.0, 5.0))
    >>> sorted(data["resistance"] for _, _, data in graph.edges(data=True))
    [1.0, 1.0, 1.0, 1.0, 5.0]
    """
    graph = nx.MultiGraph()
    for name, fibril, xi in zip(
        circuit.node_names, circuit.node_fibril.tolist(), circuit.node_xi.tolist(), strict=True
    ):
        graph.add_node(name, fibril=fibril, xi=xi)
    for port, node in zip(circuit.ports, circuit.port_node.tolist(), strict=True):
        graph.nodes[circuit.node_names[node]]["port"] = port
    for name, (i, j), ohm, kind in zip(
        circuit.resistor_names,
        circuit.resistor_nodes.tolist(),
        circuit.resistance.tolist(),
        circuit.resistor_kind.tolist(),
        strict=True,
    ):
        graph.add_edge(
            circuit.node_names[i],
            circuit.node_names[j],
            key=name,
            resistance=ohm,
            conductance=1.0 / ohm,
            kind=KINDS[kind],
        )
    return graph
