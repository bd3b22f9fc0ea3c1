"""A panel as a circuit with its electrodes as ports, as a SPICE sub-circuit, and as a deck that runs."""

from __future__ import annotations

import numpy as np

from circuittex.base.frozen import frozen
from circuittex.electrical.network.circuit import REDUCED, Circuit
from circuittex.electrical.network.names import safe_name
from circuittex.electrical.network.ports import PortMatrix
from circuittex.netlist import Header, pin_names, subcircuit
from circuittex.study.panel.solution import PanelSolution
from circuittex.study.panel.statement import Panel
from circuittex.study.panel.wiring import CROSSING, WARP, Wiring


@frozen
class PanelNetlists:
    """What is written of a panel for SPICE."""

    whole: str
    """Sub-circuit of every segment and crossing, with the electrodes as pins."""
    ports: str
    """Sub-circuit of the exact reduction to the electrodes, with the same name and pins."""
    deck: str
    """Deck with the whole network and the panel's sources that runs as it stands."""


def panel_circuit(wiring: Wiring) -> Circuit:
    """All resistors of a panel that its electrodes reach, with these as ports.

    >>> from circuittex.study.panel.cells import CellResistances
    >>> from circuittex.study.panel.statement import Electrode
    >>> from circuittex.study.panel.wiring import wire
    >>> ends = (Electrode("a", ends=("warp1-",)), Electrode("b", ends=("weft1+",)))
    >>> panel_circuit(wire(Panel((1, 1), CellResistances(2.0, 2.0, 5.0), ends))).resistor_names
    ('ry_warp1_0', 'ry_weft1_1', 'rc_1_1')
    """
    (n, m), count = wiring.panel.shape, len(wiring.panel.electrodes)
    warp, weft = ([f"{way}{k + 1}" for k in range(number)] for way, number in (("warp", n), ("weft", m)))
    names = np.full(wiring.n_nodes, "", dtype=object)
    places = [f"{one}_at_{other}" for one in warp for other in weft]
    places += [f"{other}_at_{one}" for one in warp for other in weft]
    there = wiring.node.ravel() >= count
    names[wiring.node.ravel()[there]] = np.array(places, dtype=object)[there]
    names[:count] = [each.name for each in wiring.panel.electrodes]
    return _circuit(tuple(names), wiring.ends.T, wiring.resistance, _resistor_names(wiring), count)


def ports_circuit(ports: PortMatrix) -> Circuit:
    """A port matrix as resistors between its ports, those that conduct; the same to any circuit around it."""
    i, j = np.nonzero(np.triu(ports.conductance < 0.0, 1))
    names = [f"{ports.ports[a]}_{ports.ports[b]}" for a, b in zip(i.tolist(), j.tolist(), strict=True)]
    return _circuit(ports.ports, np.stack([i, j], axis=1), -1.0 / ports.conductance[i, j], names, len(ports.ports))


def panel_netlists(solution: PanelSolution) -> PanelNetlists:
    """The sub-circuits of a panel, of all its resistors and of its exact reduction, and a deck with its sources."""
    panel = solution.wiring.panel
    name = subcircuit_name(panel)
    rows, columns = panel.shape
    what = f"panel of {rows} x {columns} crossings"
    circuit = panel_circuit(solution.wiring)
    whole = subcircuit(circuit, name, Header(title=what, design=panel.name, notes=solution.notes))
    return PanelNetlists(whole, ports_netlist(solution), _deck(solution, name, pin_names(circuit), whole, what))


def ports_netlist(solution: PanelSolution) -> str:
    """The sub-circuit of a panel's exact reduction to its electrodes."""
    panel = solution.wiring.panel
    what = f"exact reduction to the electrodes of a panel of {panel.shape[0]} x {panel.shape[1]} crossings"
    header = Header(title=what, design=panel.name, notes=solution.notes)
    return subcircuit(ports_circuit(solution.ports), subcircuit_name(panel), header)


def subcircuit_name(panel: Panel) -> str:
    """The word by which a panel's sub-circuits are called."""
    return safe_name(f"panel {panel.name}")


def _deck(solution: PanelSolution, name: str, pins: tuple[str, ...], whole: str, what: str) -> str:
    """The sub-circuit, a call of it, and a source for each electrode that is driven; open ones hang on nothing else."""
    panel = solution.wiring.panel
    lines = [f"* {what}: a deck that runs as it stands", whole.rstrip(), f"Xpanel {' '.join(pins)} {name}"]
    for pin, electrode, volts in zip(pins, panel.electrodes, solution.voltage.tolist(), strict=True):
        if electrode.voltage is not None:
            lines.append(f"V{pin} {pin} 0 {electrode.voltage!r}")
        elif electrode.current:
            lines.append(f"I{pin} 0 {pin} {electrode.current!r}")
        elif volts != volts:  # no simulator answers where a part floats
            lines += ["* floats: nothing that is driven reaches it", f"Rfloat_{pin} {pin} 0 1e9"]
    return "\n".join([*lines, ".op", ".end"]) + "\n"


def _circuit(names: tuple[str, ...], ends: object, resistance: object, resistors: object, count: int) -> Circuit:
    return Circuit(
        node_names=names,
        node_fibril=np.full(len(names), -1),
        node_xi=np.full(len(names), np.nan),
        resistor_nodes=np.asarray(ends, dtype=np.int64),
        resistance=np.asarray(resistance, dtype=np.float64),
        resistor_names=tuple(resistors),  # type: ignore[arg-type]
        resistor_kind=np.full(len(np.asarray(resistance)), REDUCED),
        ports=names[:count],
        port_node=np.arange(count),
        merged_feet=0,
        dropped_contacts=0,
        unreached=np.empty(0, dtype=np.int64),
    )


def _resistor_names(wiring: Wiring) -> list[str]:
    """'ry_warp3_5' for the segment of warp3 behind its fifth crossing, 'ry_weft2_0', and 'rc_3_6'."""
    m = wiring.panel.shape[1]
    of_warp, of_crossing = wiring.kind == WARP, wiring.kind == CROSSING
    row, column = np.divmod(wiring.place, np.where(of_warp, m + 1, m))
    first = np.where(of_warp | of_crossing, row, column) + 1
    second = np.where(of_crossing, column + 1, np.where(of_warp, column, row))
    prefix = np.array(["ry_warp", "ry_weft", "rc_"])[wiring.kind].tolist()
    return [f"{a}{b}_{c}" for a, b, c in zip(prefix, first.tolist(), second.tolist(), strict=True)]
