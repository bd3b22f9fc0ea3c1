"""The native solution of a panel: voltages, currents, heat, and its exact reduction to the electrodes."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import CircuitError, DesignError
from circuittex.base.frozen import frozen
from circuittex.electrical.network.ports import PortMatrix, resistances
from circuittex.solvers.laplacian import responses
from circuittex.study.panel.statement import Panel
from circuittex.study.panel.wiring import CROSSING, WARP, WEFT, Wiring, wire

_CHUNK = 1 << 18
"""Resistors whose drops for all electrodes are held at once."""
_UNBALANCED = 1e-6
"""Part of the power that may be lost in rounding."""
_NOTHING = 16.0 * float(np.finfo(float).eps)
"""Of voltages and conductances: what is below is rounding, and so is its heat."""


@frozen
class PanelSolution:
    """What happens in a panel of n x m cells with P electrodes."""

    wiring: Wiring
    """The network."""
    basis: Floats
    """(K, P) voltage of each node for one volt at each electrode, the others at 0 V [V per V]."""
    voltage: Floats
    """(P,) of the electrodes, V; nan where an electrode floats: nothing that is driven reaches it."""
    current: Floats
    """(P,) into the panel, A."""
    warp_voltage: Floats
    """(n, m) of the warp yarn at each crossing, V; nan where nothing that is driven reaches."""
    weft_voltage: Floats
    """(n, m) of the weft yarn at each crossing, V."""
    heat: Floats
    """(n, m) of each cell: its four arms, its crossing and the seam there, W."""
    current_x: Floats
    """(n, m) current along the warp yarn at each crossing over the pitch, A/mm."""
    current_y: Floats
    """(n, m) current along the weft yarn at each crossing over the pitch, A/mm."""
    ports: PortMatrix
    """The exact reduction to the electrodes: I = G V."""
    resistance: Floats
    """(P, P) between electrodes, the others open, ohm; inf where nothing joins them."""
    method: str
    """'direct' or 'multigrid'."""
    residual: float
    """Largest relative residual of a solution [1]."""
    notes: tuple[str, ...]
    """What was left out, clamped, or floats."""

    @property
    def electrodes(self) -> tuple[str, ...]:
        """(P,) names."""
        return self.ports.ports

    @property
    def n_resistors(self) -> int:
        return len(self.wiring.resistance)

    @property
    def power(self) -> float:
        """What the electrodes feed in, W."""
        return float(np.nansum(self.voltage * self.current))


def solve_panel(panel: Panel, method: str = "auto") -> PanelSolution:
    """Solve Kirchhoff's laws on a panel.

    All electrodes are held first, at one volt in turn: with L the nodal matrix, i the inner nodes and p the electrodes,
    phi_i = -L_ii^-1 L_ip, and G = sum over resistors of g dphi dphi^T is the exact port matrix. Voltages of electrodes
    that are fed with a current or open follow from G, and everything inside from phi.

    `method` is 'auto', 'direct' or 'multigrid' (`circuittex.solvers.laplacian`).

    >>> from circuittex.study.panel.cells import CellResistances
    >>> from circuittex.study.panel.statement import Electrode
    >>> ends = (Electrode("a", edge="left", voltage=1.0), Electrode("b", edge="right", voltage=0.0))
    >>> solution = solve_panel(Panel((4, 6), CellResistances(0.5, 0.5, 300.0), ends))
    >>> round(float(solution.resistance[0, 1]), 9)  # four yarns of six segments
    0.75

    Raises `DesignError` as `wire` does and for a current with no way back, `CircuitError` where nothing solves it.
    """
    wiring = wire(panel)
    count = len(panel.electrodes)
    found = responses(wiring.ends, 1.0 / wiring.resistance, wiring.n_nodes, count, method)
    basis = found.values
    ports = _ports(wiring, basis)
    voltage, notes = _driven(panel, wiring, ports)
    known = np.isfinite(voltage)
    middle = 0.5 * (voltage[known].min() + voltage[known].max()) if known.any() else 0.0
    above = np.where(known, voltage - middle, 0.0)
    current = ports.conductance @ above
    floats = np.isin(wiring.island, wiring.island[~known])
    across = basis @ above + middle
    across[basis[:, floats].sum(axis=1) > 0.5] = np.nan  # the sum is 1 where they are, else 0
    padded = np.append(across, np.nan)
    warp_voltage, weft_voltage = padded[wiring.node]
    heat, along = _flows(wiring, basis, above)
    _refuse_unbalanced(wiring, ports, heat, float(current @ above), float(np.abs(above).max()))
    return PanelSolution(
        wiring=wiring,
        basis=basis,
        voltage=voltage,
        current=current,
        warp_voltage=warp_voltage,
        weft_voltage=weft_voltage,
        heat=heat,
        current_x=along[0] / panel.pitch,
        current_y=along[1] / panel.pitch,
        ports=ports,
        resistance=resistances(ports),
        method=found.method,
        residual=found.residual,
        notes=(*wiring.notes, *notes),
    )


def _ports(wiring: Wiring, basis: Floats) -> PortMatrix:
    """The port matrix by energy products, which are exact to second order in the error of the solution."""
    count = basis.shape[1]
    G = np.zeros((count, count))
    for first in range(0, len(wiring.resistance), _CHUNK):
        part = slice(first, first + _CHUNK)
        drop = basis[wiring.ends[0, part]] - basis[wiring.ends[1, part]]
        G += drop.T @ (drop / wiring.resistance[part, None])
    apart = wiring.island[:, None] != wiring.island[None, :]
    off = np.minimum(np.where(np.eye(count, dtype=bool) | apart, 0.0, (G + G.T) / 2), 0.0)
    return PortMatrix(tuple(each.name for each in wiring.panel.electrodes), off - np.diag(off.sum(axis=1)))


def _driven(panel: Panel, wiring: Wiring, ports: PortMatrix) -> tuple[Floats, list[str]]:
    """Voltages (P,) of the electrodes, and which of them float."""
    volts = np.array([np.nan if each.voltage is None else each.voltage for each in panel.electrodes])
    amperes = np.array([each.current or 0.0 for each in panel.electrodes])
    floating: list[str] = []
    for number in np.unique(wiring.island):
        own = np.flatnonzero(wiring.island == number)
        free, held = own[np.isnan(volts[own])], own[~np.isnan(volts[own])]
        if not len(free):
            continue
        if not len(held):
            fed = amperes[own]
            if not fed.any():
                floating += [panel.electrodes[k].name for k in own]
                continue
            first = own[int(np.argmax(np.abs(fed)))]
            raise DesignError(
                f"electrodes.{panel.electrodes[first].name}.current",
                float(amperes[first]),
                "no electrode at a voltage is joined to it: one must be, for example at 0 V",
            )
        volts[free] = _potentials(ports.conductance, amperes, volts, free, held)
    note = f"{', '.join(floating[:8])}{', ...' * (len(floating) > 8)}: no driven electrode reaches them, they float"
    return volts, [note] if floating and len(floating) < len(volts) else []


def _potentials(G: Floats, amperes: Floats, volts: Floats, free: Floats, held: Floats) -> Floats:
    """Voltages of the free electrodes of one part of the panel."""
    middle = float(np.mean(volts[held]))
    scale = 1.0 / np.sqrt(np.diag(G)[free])
    matrix = G[np.ix_(free, free)] * np.outer(scale, scale)
    right = amperes[free] - G[np.ix_(free, held)] @ (volts[held] - middle)
    return np.asarray(middle + scale * np.linalg.solve(matrix, scale * right))


def _refuse_unbalanced(wiring: Wiring, ports: PortMatrix, heat: Floats, power: float, span: float) -> None:
    """Raise where the heat of the resistors is not what the electrodes feed in: their drops are lost in rounding."""
    total, ohm = float(heat.sum()), wiring.resistance
    nothing = (_NOTHING**2 * float((1.0 / ohm).sum()) + _NOTHING * float(np.trace(ports.conductance))) * span**2
    if not abs(total - power) <= max(_UNBALANCED * max(abs(power), total), nothing):
        raise CircuitError(
            f"the cells turn {total:.6g} W into heat but {power:.6g} W are fed in: resistances from {ohm.min():.1e} to "
            f"{ohm.max():.1e} ohm are too far apart for a nodal solution"
        )


def _flows(wiring: Wiring, basis: Floats, volts: Floats) -> tuple[Floats, tuple[Floats, Floats]]:
    """Heat (n, m) of the cells, W, and current (n, m) along the warp and the weft yarn at each crossing, A."""
    flow = resistor_currents(wiring, basis, volts)
    return _heat(wiring, flow), (_mean_current(wiring, flow, WARP), _mean_current(wiring, flow, WEFT))


def resistor_currents(wiring: Wiring, basis: Floats, volts: Floats) -> Floats:
    """(R,) current from the first to the second node of each resistor for voltages (P,) of the electrodes, A."""
    potential = basis @ volts
    return np.asarray((potential[wiring.ends[0]] - potential[wiring.ends[1]]) / wiring.resistance)


def segments(wiring: Wiring, values: Floats, kind: int) -> Floats:
    """Values (R,) of a kind of segments in their places, 0 where there is none: (n, m + 1) warp or (m, n + 1) weft."""
    n, m = wiring.panel.shape
    found = np.zeros((n, m + 1) if kind == WARP else (n + 1, m))
    own = wiring.kind == kind
    found.ravel()[wiring.place[own]] = values[own]
    return found if kind == WARP else found.T


def at_crossings(wiring: Wiring, values: Floats) -> Floats:
    """(n, m) values (R,) of the resistors between the yarns, 0 where there is none."""
    found = np.zeros(wiring.panel.shape)
    own = wiring.kind == CROSSING
    found.ravel()[wiring.place[own]] = values[own]
    return found


def _heat(wiring: Wiring, flow: Floats) -> Floats:
    squared = flow**2
    heat = at_crossings(wiring, squared * wiring.resistance)
    for kind, Ry in ((WARP, wiring.local.warp), (WEFT, wiring.local.weft)):
        each = segments(wiring, squared, kind)
        arms = 0.5 * (each[:, :-1] + each[:, 1:])
        arms = arms if kind == WARP else arms.T
        heat += np.where(arms > 0.0, np.where(np.isfinite(Ry), Ry, 0.0) * arms, 0.0)
    return heat


def _mean_current(wiring: Wiring, flow: Floats, kind: int) -> Floats:
    each = segments(wiring, flow, kind)
    found = 0.5 * (each[:, :-1] + each[:, 1:])
    return found if kind == WARP else found.T
