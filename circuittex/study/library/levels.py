"""The levels of a study: what stands between the pins, exactly and in short, at every state."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import CircuitError, CircuittexWarning
from circuittex.base.frozen import frozen
from circuittex.design import Design, Terminal
from circuittex.electrical.network.circuit import Circuit, build_circuit, reduced_circuit, yarn_end_terminals
from circuittex.electrical.network.matching import groups, match_pairs, spread
from circuittex.electrical.network.ports import PortMatrix, port_matrix
from circuittex.results.records import Record, Study
from circuittex.study.export import simplified
from circuittex.study.library.network import FLOOR
from circuittex.study.library.resistivity import Factor, as_stated, scaled

CRIMPED, FREE = "crimped", "free"
ENDS = (CRIMPED, FREE)
"""crimped: a pin for each yarn end, which joins its fibrils. free: a pin for each terminal of the design; the fibril
ends of no terminal are insulated one by one."""


@frozen
class Levels:
    """What is known of each of S states."""

    pins: tuple[str, ...]
    """(P,) names of the ports with a conductor behind them."""
    ports: tuple[PortMatrix, ...]
    """(S,) the exact reduction to the pins."""
    along: Floats
    """(S, warp + weft) Ry of a segment of each yarn, fitted to all pairs, ohm; (0, warp + weft) where it cannot be."""
    across: Floats
    """(S, warp, weft) Rc of each crossing, ohm; infinite where nothing passes."""
    reason: str
    """Why there is no fit for every state; empty if there is."""

    @property
    def cells(self) -> tuple[Circuit, ...]:
        """(S,) networks of Ry and Rc."""
        shape = self.across.shape[1], self.across.shape[2]
        return tuple(reduced_circuit(shape, Ry, Rc) for Ry, Rc in zip(self.along, self.across, strict=True))

    @property
    def units(self) -> Floats:
        """(S, 3) medians of Ry of the warp, of Ry of the weft and of Rc, ohm; infinite as they are."""
        n = self.across.shape[1]
        rows = zip(self.along, self.across, strict=True)
        return np.array([[np.median(Ry[:n]), np.median(Ry[n:]), np.median(Rc)] for Ry, Rc in rows]).reshape(-1, 3)


def levels(study: Study, ends: str, factor: Factor = as_stated) -> Levels:
    """The levels of all states of a study whose yarn ends are `ends`, resistivities times `factor`.

    Raises `CircuitError` where no state is recorded or nothing conducts between pins.
    """
    if not study.records:
        raise CircuitError("the study has no recorded state: there is nothing to export")
    matrices = [_ports(study.design, record, ends, factor) for record in study.records]
    joined = np.any([matrix.conductance.diagonal() > 0.0 for matrix in matrices], axis=0)
    pins = tuple(name for name, there in zip(matrices[0].ports, joined, strict=True) if there)
    if not pins:
        raise CircuitError(f"no current passes between any two pins ({ends} yarn ends): there is nothing to export")
    ports = tuple(_kept(matrix, pins) for matrix in matrices)
    fit = _fitted(study, ports) if ends == CRIMPED else NO_CELL
    if isinstance(fit, str):
        warnings.warn(f"no cell of Ry and Rc: {fit}", CircuittexWarning, stacklevel=3)
        n, m = len(study.design.weave.warp), len(study.design.weave.weft)
        return Levels(pins, ports, np.empty((0, n + m)), np.empty((0, n, m)), fit)
    return Levels(pins, ports, *fit, "")


def port_matrices(study: Study, ends: str, pins: Sequence[str], factor: Factor = as_stated) -> tuple[PortMatrix, ...]:
    """(S,) the exact reductions of a study to these pins, resistivities times `factor`."""
    return tuple(_kept(_ports(study.design, record, ends, factor), pins) for record in study.records)


def _kept(matrix: PortMatrix, pins: Sequence[str]) -> PortMatrix:
    """A port matrix with these of its ports; the others carry no current."""
    place = [matrix.ports.index(name) for name in pins]
    return PortMatrix(tuple(pins), matrix.conductance[np.ix_(place, place)])


NO_CELL = "its pins are yarn ends whose fibrils are joined, and with free ends the pins are the terminals"


def detailed(design: Design, record: Record, ends: str, factor: Factor = as_stated) -> Circuit:
    """Every fibril segment and contact of one state, as the netlists of a run have it."""
    simple = simplified(design, record.contacts)
    contacts = scaled(design, simple.contacts, factor)
    return build_circuit(contacts, terminals(design, record, ends), dropped_contacts=simple.dropped_contacts)


def terminals(design: Design, record: Record, ends: str) -> tuple[Terminal, ...]:
    """What the pins join."""
    return design.terminals if ends == FREE else yarn_end_terminals(record.contacts.mesh)


def _ports(design: Design, record: Record, ends: str, factor: Factor) -> PortMatrix:
    """The stored reduction where it is the one that is wanted."""
    if factor is as_stated and ends == CRIMPED and record.ports.ports:
        return record.ports
    circuit = detailed(design, record, ends, factor)
    found = port_matrix(circuit)
    names = [terminal.name for terminal in terminals(design, record, ends)]
    place = [names.index(name) for name in found.ports]
    whole = np.zeros((len(names), len(names)))
    whole[np.ix_(place, place)] = found.conductance
    return PortMatrix(tuple(names), whole)


def _fitted(study: Study, ports: Sequence[PortMatrix]) -> tuple[Floats, Floats] | str:
    """Ry of the yarns and Rc of the crossings of every state, or why one has none."""
    grouping = groups(study.design, each_crossing=True)
    found = []
    for record, matrix in zip(study.records, ports, strict=True):
        match = match_pairs(study.design, grouping, matrix)
        if not match.solved:
            return f"state {record.name}: {'; '.join(match.reasons) or 'no network comes close to it'}"
        found.append(spread(grouping, match.found))
    across = np.array([Rc for _, Rc in found])
    # What opens in some states only keeps a resistance there, as between the pins (`ports_network`).
    largest = np.where(np.isfinite(across), across, 0.0).max(axis=0)
    return np.array([Ry for Ry, _ in found]), np.where((largest > 0.0) & np.isinf(across), largest / FLOOR, across)
