"""Reduced networks matched to what is known of a cell: a resistance for each kind of yarn, one for crossings.

The network has a node on either yarn of each crossing (`reduced_circuit`). Its resistors stand in groups that share one
value: those of a kind of yarn, and those of a pair of kinds that cross or of a single crossing. The logarithms of the
values are fitted to the data by least squares of logarithms, with exact derivatives: of a port matrix
G = sum over resistors of g d d^T, with d (P,) a resistor's drops for one volt at each port, dG/dg = d d^T.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from circuittex.base.arrays import Floats, Ints
from circuittex.base.binary import power_of_two
from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.design.yarn import PATH
from circuittex.electrical.network.circuit import Circuit, reduced_circuit, yarn_end_name
from circuittex.electrical.network.ports import PortMatrix, port_matrix, resistances

AMPLIFIED = 100.0
"""A value is not determined where a relative error of the data comes back this many times larger: 1 % as 100 %."""
RATIOS = np.logspace(-8.0, 12.0, 21)
"""Rc over Ry where the search may begin, one for each decade."""
BEYOND = 1e3
"""How far beyond these, or from that of an insulated yarn, it may go."""
RANK = 1e-12
"""Singular values below this part of the largest are rounding: the data know nothing of that combination of values."""


@frozen
class Groups:
    """Which resistors of the reduced network share a value."""

    yarns: tuple[str, ...]
    """names of the kinds of yarn."""
    crossings: tuple[str, ...]
    """names of the groups of crossings."""
    yarn_group: Ints
    """(warp + weft,) group of each yarn; -1 where it insulates."""
    crossing_group: Ints
    """(warp, weft) group of each crossing; -1 where one of its yarns insulates."""
    start: Floats
    """(yarns + crossings,) ohm: where the search begins; the yarns' are those of insulated yarns."""


@frozen
class Match:
    """Values of the groups."""

    found: Floats
    """(yarns + crossings,) ohm: what comes closest to the data, determined or not."""
    lost: NDArray[np.bool_]
    """(yarns + crossings,) whether the data do not determine the value."""
    misfit: float
    """Largest relative difference between network and data."""
    reasons: tuple[str, ...]
    """Why what is lost is not determined; empty if all is."""

    @property
    def solved(self) -> bool:
        """Whether there is a network that comes closest to the data."""
        return bool(len(self.found)) and not np.isnan(self.found).any()

    @property
    def values(self) -> Floats:
        """(yarns + crossings,) ohm; nan where the data do not determine it."""
        return np.where(self.lost, np.nan, self.found)


def groups(design: Design, *, each_crossing: bool) -> Groups:
    """The groups of a design: `each_crossing` and each direction by itself, or one for all of the same kinds."""
    weave = design.weave
    n, m = len(weave.warp), len(weave.weft)
    warp, weft = weave.directions
    # Segments of one kind have one length, or one in each direction: of the step, or of the path.
    as_path = any(yarn.crimp == PATH for yarn in weave.yarns) and warp.amplitude != weft.amplitude
    apart = each_crossing or warp.step != weft.step or as_path
    names, segments = [], []
    for direction in (warp, weft):
        for yarn in direction.yarns:
            sigma = sum(each.electrical_conductivity for each in yarn.fibrils)
            siemens = sigma * np.pi * yarn.radius**2 / direction.step
            names.append(f"{yarn.name} {direction.name}" if apart else yarn.name)
            segments.append(1.0 / siemens if siemens > 0.0 and direction.crossings else np.inf)
    conducts = np.isfinite(segments)
    yarns = tuple(dict.fromkeys(name for name, there in zip(names, conducts, strict=True) if there))
    yarn_group = np.array([yarns.index(name) if there else -1 for name, there in zip(names, conducts, strict=True)])
    crossings: dict[str, int] = {}
    crossing_group = np.full((n, m), -1)
    for i, j in np.argwhere(conducts[:n, None] & conducts[None, n:]):
        pair = sorted({weave.warp[i].name, weave.weft[j].name})
        name = f"warp{i + 1} weft{j + 1}" if each_crossing else " x ".join(pair if len(pair) > 1 else pair * 2)
        crossing_group[i, j] = crossings.setdefault(name, len(crossings))
    start = [segments[int(np.flatnonzero(yarn_group == k)[0])] for k in range(len(yarns))]
    return Groups(yarns, tuple(crossings), yarn_group, crossing_group, np.array([*start, *[np.nan] * len(crossings)]))


def spread(grouping: Groups, values: Floats) -> tuple[Floats, Floats]:
    """Ry of each yarn (warp + weft,) and Rc of each crossing (warp, weft) by the values of their groups, ohm; infinite
    where something insulates."""
    known = np.append(values, np.inf)  # the last one for the group -1
    place = np.where(grouping.crossing_group < 0, -1, grouping.crossing_group + len(grouping.yarns))
    return known[grouping.yarn_group], known[place]


def pair_errors(circuit: Circuit, matrix: PortMatrix) -> Floats:
    """(2,) worst and median relative error of a reduced network's resistances between all pairs of pins of a matrix."""
    exact, found = resistances(matrix), resistances(port_matrix(circuit, matrix.ports))
    i, j = np.triu_indices(len(exact), 1)
    joined = np.isfinite(exact[i, j]) & (exact[i, j] > 0.0)
    if not joined.any():
        return np.full(2, np.nan)
    errors = np.abs(found[i, j][joined] / exact[i, j][joined] - 1.0)
    return np.array([errors.max(), np.median(errors)])


def match_pairs(design: Design, grouping: Groups, matrix: PortMatrix) -> Match:
    """The values whose network has the resistances between all pairs of pins that a port matrix has.

    Those of crossings between yarns that nothing joins are infinite, and not determined: any that is large would do.
    """
    wanted = resistances(matrix)
    whole, grouping = grouping, _of_joined(grouping, matrix, np.isfinite(wanted))
    i, j = np.triu_indices(len(wanted), 1)
    known = np.isfinite(wanted[i, j]) & (wanted[i, j] > 0.0)
    i, j = i[known], j[known]
    unit = _unit(grouping)
    target = np.log(wanted[i, j] / unit)
    between = np.concatenate([[i], [j]])

    def model(circuit: Circuit, drop: Floats, conductance: Floats) -> tuple[Floats, Floats]:
        drop = drop[:, [circuit.ports.index(name) for name in matrix.ports]]
        G = (drop.T * conductance) @ drop
        np.fill_diagonal(G, 0.0)
        np.fill_diagonal(G, -G.sum(axis=1))
        found, response = _resistances_and_response(G, drop)
        ohm = found[between[0], between[1]]
        share = conductance[:, None] * (response[:, between[0]] - response[:, between[1]]) ** 2 / ohm
        return np.log(ohm), share

    data = "the resistances between the pins"
    return _with_open(whole, grouping, _matched(design, grouping, target, model, data, unit), data)


def _of_joined(grouping: Groups, matrix: PortMatrix, joined: NDArray[np.bool_]) -> Groups:
    """The groups without those of crossings none of whose pairs of yarns has pins that are `joined` (P, P)."""
    place, beside = {name: k for k, name in enumerate(matrix.ports)}, len(matrix.ports)
    passes = np.pad(joined, (0, 1))  # the last one for a yarn that is no pin
    warp, weft = (
        [place.get(yarn_end_name(f"{kind}{k + 1}", -1), beside) for k in range(count)]
        for kind, count in zip(("warp", "weft"), grouping.crossing_group.shape, strict=True)
    )
    group, there = grouping.crossing_group, passes[np.ix_(warp, weft)]
    kept = np.unique(group[there & (group >= 0)])
    if len(kept) == len(grouping.crossings):
        return grouping
    numbers = np.full(len(grouping.crossings) + 1, -1)  # the last one for the group -1
    numbers[kept] = np.arange(len(kept))
    yarns = len(grouping.yarns)
    start = np.concatenate([grouping.start[:yarns], grouping.start[yarns + kept]])
    names = tuple(grouping.crossings[k] for k in kept.tolist())
    return replace(grouping, crossings=names, crossing_group=numbers[group], start=start)


def _with_open(whole: Groups, joined: Groups, match: Match, data: str) -> Match:
    """The values of all groups: those of crossings that are not among the `joined` ones are infinite."""
    if whole is joined or not len(match.found):
        return match
    yarns = len(whole.yarns)
    there = np.array([True] * yarns + [name in joined.crossings for name in whole.crossings])
    found, lost = np.full(len(there), np.inf), np.ones(len(there), dtype=bool)
    found[there], lost[there] = match.found, match.lost
    names = [name for name in whole.crossings if name not in joined.crossings]
    reasons = tuple(f"Rc of {name} is not determined: {data} do not tell it from other values" for name in names)
    return Match(found, lost, match.misfit, match.reasons + reasons)


def match_probes(design: Design, grouping: Groups, conductance: Floats) -> Match:
    """The values whose network has these conductances (n,) between the terminals of the probes, S."""
    ends = {t.name: [yarn_end_name(yarn, side) for yarn, side in t.ends] for t in design.terminals}
    carried = conductance > 0.0
    probes = [probe for probe, there in zip(design.probes, carried, strict=True) if there]
    unit = _unit(grouping)
    target = -np.log(conductance[carried] * unit)

    def model(circuit: Circuit, drop: Floats, siemens: Floats) -> tuple[Floats, Floats]:
        logs, shares = [], []
        for probe in probes:
            driven = {name: volt for side, volt in ((probe.source, 1.0), (probe.sink, 0.0)) for name in ends[side]}
            across = drop @ _voltages(circuit, drop, siemens, driven)
            power = siemens * across**2
            logs.append(-np.log(max(power.sum(), np.finfo(float).tiny)))
            shares.append(power / max(power.sum(), np.finfo(float).tiny))
        return np.array(logs), np.array(shares).reshape(len(probes), len(siemens)).T

    return _matched(design, grouping, target, model, "the probe currents", unit)


def _unit(grouping: Groups) -> float:
    """Ohm in which the search counts: logarithms of pure numbers are rounded alike at every scale."""
    return power_of_two(float(np.nanmax(grouping.start, initial=0.0)) or 1.0)


def drops(circuit: Circuit) -> Floats:
    """(R, P) drop over each resistor of a small circuit for one volt at each port, the others at 0 V."""
    n, (a, b) = circuit.n_nodes, circuit.resistor_nodes.T
    laplacian, siemens = np.zeros((n, n)), 1.0 / circuit.resistance
    for i, j, sign in ((a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)):
        np.add.at(laplacian, (i, j), sign * siemens)
    ports = circuit.port_node
    inner = np.setdiff1d(np.flatnonzero(np.diag(laplacian) > 0.0), ports)
    potential = np.zeros((n, len(ports)))
    potential[ports, np.arange(len(ports))] = 1.0
    if len(inner):
        scale = 1.0 / np.sqrt(np.diag(laplacian)[inner])
        matrix = laplacian[np.ix_(inner, inner)] * np.outer(scale, scale)
        potential[inner] = -scale[:, None] * np.linalg.solve(matrix, scale[:, None] * laplacian[np.ix_(inner, ports)])
    return np.asarray(potential[a] - potential[b])


def _voltages(circuit: Circuit, drop: Floats, siemens: Floats, driven: dict[str, float]) -> Floats:
    """(P,) voltage of every pin where some are driven and the others carry no current; 0 where nothing reaches."""
    G = (drop.T * siemens) @ drop
    volts = np.array([driven.get(name, 0.0) for name in circuit.ports])
    open_ = np.flatnonzero([name not in driven for name in circuit.ports])
    if len(open_):
        scale = 1.0 / np.sqrt(np.maximum(np.diag(G)[open_], np.finfo(float).tiny))
        matrix = G[np.ix_(open_, open_)] * np.outer(scale, scale)
        volts[open_] = -scale * np.linalg.lstsq(matrix, scale * (G @ volts)[open_], rcond=1e-13)[0]
    return volts


def _resistances_and_response(G: Floats, drop: Floats) -> tuple[Floats, Floats]:
    """Resistances between the pins (P, P), and (R, P) the drop over each resistor for one ampere into each pin."""
    found = resistances(PortMatrix(tuple(map(str, range(len(G)))), G))
    scale = 1.0 / np.sqrt(np.maximum(np.diag(G), np.finfo(float).tiny))
    inverse = np.linalg.pinv(G * np.outer(scale, scale), rcond=1e-12, hermitian=True) * np.outer(scale, scale)
    return found, np.asarray(drop @ inverse)


Model = Callable[[Circuit, Floats, Floats], tuple[Floats, Floats]]
"""(network, drops, conductances) -> logarithms of what is compared (D,), shares (R, D) of the resistors in it."""


def _matched(design: Design, grouping: Groups, target: Floats, model: Model, data: str, unit: float) -> Match:
    """The values with which `model` comes closest to `target`, whose logarithms are of resistances in `unit` (ohm)."""
    count = len(grouping.start)
    if not len(target) or not count:
        reason = f"no value is determined: {data} say nothing" if count else "no yarn conducts: there is no network"
        return Match(np.full(count, np.nan), np.ones(count, dtype=bool), np.nan, (reason,))
    shape = len(design.weave.warp), len(design.weave.weft)
    of_resistor = np.concatenate(
        [
            *(np.full(_segments(shape, k) + 1, group) for k, group in enumerate(grouping.yarn_group) if group >= 0),
            grouping.crossing_group[grouping.crossing_group >= 0] + len(grouping.yarns),
        ]
    )
    member = (of_resistor[:, None] == np.arange(count)).astype(float)

    def both(logs: Floats) -> tuple[Floats, Floats]:
        circuit = reduced_circuit(shape, *spread(grouping, np.exp(logs)))
        found, shares = model(circuit, drops(circuit), 1.0 / circuit.resistance)
        return found - target, shares.T @ member

    known = grouping.start / unit
    unknown, segment = ~np.isfinite(known), float(np.log(np.nanmean(known)))
    logs = np.log(np.where(unknown, 1.0, known))
    starts = [np.where(unknown, segment + step, logs) for step in np.log(RATIOS)]
    start = min(starts, key=lambda each: float(np.linalg.norm(both(each)[0])))
    middle = np.where(unknown, segment, logs)
    bounds = (
        middle + np.where(unknown, np.log(RATIOS[0] / BEYOND), -np.log(BEYOND)),
        middle + np.where(unknown, np.log(RATIOS[-1] * BEYOND), np.log(BEYOND)),
    )

    def misfits(logs: Floats) -> Floats:
        return both(logs)[0]

    def slopes(logs: Floats) -> Floats:
        return both(logs)[1]

    # Without a limit for the slope, a start that fits to the last bit ends in 0 / 0.
    limits = {"xtol": 1e-14, "ftol": None, "gtol": float(np.finfo(float).eps)}
    found = least_squares(misfits, start, jac=slopes, bounds=bounds, x_scale="jac", **limits)
    names = [*(f"Ry of {kind}" for kind in grouping.yarns), *(f"Rc of {pair}" for pair in grouping.crossings)]
    reasons, lost = _undetermined(found.jac, names, data)
    return Match(unit * np.exp(found.x), lost, float(np.expm1(np.abs(found.fun).max())), reasons)


def _segments(shape: tuple[int, int], yarn: int) -> int:
    """Crossings along a yarn."""
    return shape[1] if yarn < shape[0] else shape[0]


def _undetermined(jacobian: Floats, names: Sequence[str], data: str) -> tuple[tuple[str, ...], NDArray[np.bool_]]:
    """What to say of values that the data do not determine, and which they are."""
    _, sizes, directions = np.linalg.svd(jacobian, full_matrices=True)
    sizes = np.concatenate([sizes, np.zeros(len(names) - len(sizes))])
    with np.errstate(divide="ignore"):
        inverse = np.where(sizes > RANK * sizes[0], 1.0 / sizes, np.inf)
    weights = np.abs(directions.T) * np.where(np.isfinite(inverse), inverse, 0.0)
    moved = np.sqrt((weights**2).sum(axis=1))
    blind = (np.abs(directions[~np.isfinite(inverse)]) > RANK**0.5).any(axis=0)
    lost = blind | (moved > AMPLIFIED)
    reasons = tuple(
        f"{name} is not determined: {data} do not tell it from other values"
        if out
        else f"{name} is not determined: an error of 1 % in {data} moves it by {percent:.3g} %"
        for name, out, gone, percent in zip(names, blind, lost, moved, strict=True)
        if gone
    )
    return reasons, lost
