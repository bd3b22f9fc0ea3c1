"""The reduced network [43-46] fitted to probe currents by least squares [47]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from functools import lru_cache

import numpy as np
from scipy.optimize import least_squares

from circuittex.base.arrays import Floats, Ints
from circuittex.base.binary import power_of_two
from circuittex.base.errors import CircuitError
from circuittex.base.frozen import frozen
from circuittex.design import Design, Probe, Yarn
from circuittex.electrical.network.circuit import Circuit, reached_part, reduced_circuit, yarn_end_name
from circuittex.electrical.network.matching import Groups, Match, groups, match_pairs, match_probes, pair_errors, spread
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.network.ports import PortMatrix

# A conductance below this fraction of that of an insulated yarn is none: it is rounding of the solution.
_NONE = 1e-12
# Rc / Ry of the start values, one for each decade, and how far beyond them the search may go.
_RATIOS = np.logspace(-8.0, 10.0, 19)
_BEYOND = 10.0
# A value is called undetermined where a relative error of the weighted currents comes back this many times larger.
_AMPLIFIED = 100.0
# A misfit below this fraction of the currents is rounding.
_EXACT = 1e-15
POOR = 0.05
"""A network that misses a current or a resistance by more than this part does not describe the cell: a warning."""


@frozen
class Fit:
    """The reduced network that comes closest to the currents of the probes."""

    Ry: float
    """Resistance of a yarn segment from crossing to crossing, ohm; inf where no yarn conducts along itself, nan where
    the probes do not tell."""
    Rc: float
    """Resistance of a crossing, ohm; inf where no probe that crosses between yarns carries current, nan where the
    probes do not tell."""
    residual: float
    """Root of the sum of squared misfits: relative ('relative') or in A ('absolute') [1 or A]; nan without probes."""
    covariance: Floats
    """(2, 2) of Ry and Rc, ohm2, from the misfit with two degrees of freedom spent; inf where nothing tells."""
    weighting: str
    """'relative' or 'absolute'."""
    warnings: tuple[str, ...]
    """What the probes do not determine; empty if all is well."""
    currents: Floats
    """(n,) probe currents of the fitted network, A."""
    method: str = "probes"
    """What was fitted to: 'probes' or 'all-pairs'."""
    kinds: tuple[str, ...] = ()
    """(k,) kinds of yarn, by direction where all pairs tell them apart."""
    kind_resistance: Floats = field(default_factory=lambda: np.empty(0))
    """(k,) resistance of a segment of each kind, ohm; nan where not determined."""
    pairs: tuple[str, ...] = ()
    """(q,) pairs of kinds that cross."""
    pair_resistance: Floats = field(default_factory=lambda: np.empty(0))
    """(q,) resistance of a crossing of each, the median of its crossings, ohm; nan where not determined."""
    yarns: Floats = field(default_factory=lambda: np.empty(0))
    """(warp + weft,) resistance of a segment of each yarn, ohm; inf where it insulates, nan where not determined."""
    crossings: Floats = field(default_factory=lambda: np.empty((0, 0)))
    """(warp, weft) resistance of each crossing, ohm; inf where nothing passes, nan where not determined."""
    pair_errors: Floats = field(default_factory=lambda: np.full(2, np.nan))
    """(2,) worst and median relative error of the network's resistances between all pairs of yarn ends; nan where the
    network is not determined."""

    @property
    def known(self) -> bool:
        """Whether the data determine the whole network, so that it can be written down."""
        values = np.concatenate([self.yarns.ravel(), self.crossings.ravel()])
        return bool(np.isfinite(self.yarns).any() and not np.isnan(values).any())

    def circuit(self) -> Circuit:
        """The reduced network as a circuit whose ports are all yarn ends.

        Raises `CircuitError` where it is not known.
        """
        if not self.known:
            raise CircuitError(f"the reduced network is not determined: {'; '.join(self.warnings)}")
        n, m = self.crossings.shape
        return reduced_circuit((n, m), self.yarns, self.crossings)


def fit_network(
    currents: Sequence[float] | Floats, design: Design, matrix: PortMatrix | None = None, *, weighting: str = "relative"
) -> Fit:
    """Return the reduced network that comes closest to what the design's `electrical.fit` names.

    'probes': the currents (n,) in A of `design.probes`, a resistance for each kind of yarn and one for each pair of
    kinds that cross. Where all yarns are of one kind that is the fit of the paper [47], by `fit_one_pair`. 'all-pairs':
    the resistances between all pairs of yarn ends of the port matrix of the state, with a resistance for each kind of
    yarn in either direction and one for each crossing.

    What the data do not determine is nan, and `warnings` says why. Raises `CircuitError` as `fit_one_pair` does.
    """
    weave = design.weave
    shape = len(weave.warp), len(weave.weft)
    method = design.electrical.fit
    if method == "auto":
        method = "probes" if len(groups(design, each_crossing=False).yarns) == 1 else "all-pairs"
    grouping = groups(design, each_crossing=method == "all-pairs")
    currents = np.asarray(currents, dtype=np.float64)
    told = np.isfinite(currents)
    if method == "probes" and not told.all():
        return _untold(np.flatnonzero(~told), design, grouping, weighting)
    if method == "probes" and len(grouping.yarns) == 1 and (grouping.yarn_group >= 0).all():
        one = fit_one_pair(currents, design, weighting=weighting)
        values, match = np.array([one.Ry, one.Rc]), None
    else:
        volts = np.array([probe.voltage for probe in design.probes])
        if method == "probes":
            known = _checked(currents, design, volts) if design.probes else np.empty(0)
            match = match_probes(design, grouping, _through_conductors(design, known))
        else:
            match = match_pairs(design, grouping, matrix if matrix is not None else PortMatrix())
        values, one = match.values, None
    yarns, crossings = spread(grouping, values)
    best = reduced_circuit(shape, *spread(grouping, match.found)) if match is not None and match.solved else None
    if one is not None and np.isfinite(one.Ry):
        best = reduced_circuit(shape, yarns, np.where(np.isnan(crossings), np.inf, crossings))
    errors = np.full(2, np.nan)
    if best is not None and matrix is not None and not np.isnan(values).any():
        errors = pair_errors(best, matrix)
    k = len(grouping.yarns)
    if one is None:
        assert match is not None
        one = _of_match(design, match, values, k, best)
    kinds, q = _kind_pairs(design), grouping.crossing_group
    per_pair = {name: crossings[where] for name, where in kinds.items() if (q[where] >= 0).any()}
    warnings, one_rc = one.warnings, method == "probes" and q.size > 1
    if errors[0] > POOR:
        way_out = '; with electrical.fit = "all-pairs" each crossing has a resistance of its own' if one_rc else ""
        warnings += (f"the reduced network is off by up to {100 * errors[0]:.2g} % between two yarn ends{way_out}",)
    elif one.residual > POOR:
        warnings += (f"the reduced network misses the currents by up to {100 * one.residual:.2g} %",)
    return replace(
        one,
        warnings=warnings,
        method=method,
        kinds=grouping.yarns,
        kind_resistance=values[:k],
        pairs=tuple(per_pair),
        pair_resistance=np.array([np.median(each) for each in per_pair.values()]),
        yarns=yarns,
        crossings=crossings,
        pair_errors=errors,
    )


def _untold(lost: Ints, design: Design, grouping: Groups, weighting: str) -> Fit:
    """What follows from currents that are lost in rounding beside others: nothing about the crossings."""
    names = ", ".join(design.probes[k].name for k in lost)
    k, q = len(grouping.yarns), grouping.crossing_group
    return Fit(
        Ry=float("nan"),
        Rc=float("nan"),
        residual=float("nan"),
        covariance=np.diag([np.inf, np.inf]),
        weighting=weighting,
        warnings=(f"Ry and Rc are not determined: the currents of {names} are lost in rounding beside a yarn's",),
        currents=np.full(len(design.probes), np.nan),
        kinds=grouping.yarns,
        kind_resistance=np.full(k, np.nan),
        pairs=grouping.crossings,
        pair_resistance=np.full(len(grouping.crossings), np.nan),
        yarns=np.where(grouping.yarn_group < 0, np.inf, np.nan),
        crossings=np.where(q < 0, np.inf, np.nan),
    )


def _of_match(design: Design, match: Match, values: Floats, k: int, best: Circuit | None) -> Fit:
    """A match in one number each: of the yarns where they are of one kind, and the median of the crossings."""
    weave = design.weave
    one_kind = len({yarn.name for yarn in weave.yarns}) == 1
    currents = np.full(len(design.probes), np.nan)
    if best is not None:
        volts = np.array([probe.voltage for probe in design.probes])
        currents = np.array([_through(best, design, probe) for probe in design.probes]) * volts
    return Fit(
        Ry=float(np.mean(values[:k])) if one_kind and k else float("nan"),
        Rc=float(np.median(values[k:])) if len(values) > k else float("nan"),
        residual=match.misfit,
        covariance=np.diag([np.inf, np.inf]),
        weighting="relative",
        warnings=match.reasons,
        currents=currents,
    )


def _through(circuit: Circuit, design: Design, probe: Probe) -> float:
    """Conductance of a reduced network between the terminals of a probe, S."""
    ends = {t.name: [yarn_end_name(yarn, side) for yarn, side in t.ends] for t in design.terminals}
    drive = dict.fromkeys(ends[probe.source], 1.0) | dict.fromkeys(ends[probe.sink], 0.0)
    part = reached_part(circuit, drive)
    found = solve_nodal(part, drive).port_current
    return float(sum(found[part.ports.index(end)] for end in ends[probe.source]))


def _through_conductors(design: Design, conductance: Floats) -> Floats:
    """(n,) the conductances, 0 for a probe with a terminal that has no conducting yarn: it says nothing of others."""
    conducts = dict(zip(design.weave.yarn_names, map(_conducts, design.weave.yarns), strict=True))
    live = {t.name: any(conducts[yarn] for yarn, _ in t.ends) for t in design.terminals}
    there = np.array([live[probe.source] and live[probe.sink] for probe in design.probes], dtype=bool)
    return np.where(there, conductance, 0.0)


def _conducts(yarn: Yarn) -> bool:
    return any(material.electrical_conductivity > 0.0 for material in yarn.materials)


def _kind_pairs(design: Design) -> dict[str, tuple[Ints, Ints]]:
    """Pair of kinds -> the crossings (warp, weft) of it."""
    found: dict[str, list[tuple[int, int]]] = {}
    for i, warp in enumerate(design.weave.warp):
        for j, weft in enumerate(design.weave.weft):
            found.setdefault(" x ".join(sorted([warp.name, weft.name])), []).append((i, j))
    return {name: (np.array(each)[:, 0], np.array(each)[:, 1]) for name, each in found.items()}


def fit_one_pair(currents: Sequence[float] | Floats, design: Design, *, weighting: str = "relative") -> Fit:
    """Return the Ry and Rc whose reduced network has the probe currents (n,) in A of `design.probes` [47].

    'absolute' minimises Σ (I_network - I)² as [47] is written, 'relative' Σ (I_network / I - 1)². Probes across yarns
    carry about a hundredth of the current along one yarn, so in the absolute sum the little that the network cannot
    follow along the yarn outweighs all they say about Rc; relative misfits let every probe speak.

    What does not conduct has the value inf, and what the probes do not tell is nan; `warnings` says so. A probe
    carries nothing if its conductance is less than 1e-12 of that of an insulated yarn of the design.

    Raises `CircuitError` for currents that are not one finite number for each probe, or that flow backwards.
    """
    if weighting not in ("relative", "absolute"):
        raise CircuitError(f"weighting: {weighting!r} is not usable; it must be 'relative' or 'absolute'")
    volts = np.array([probe.voltage for probe in design.probes])
    wanted = _checked(currents, design, volts)
    carries = wanted > 0.0
    insulated = network_conductances(design, 1.0, np.inf).sum(axis=1)
    if not carries.any():
        return _without_current(insulated, yarn_conductance(design), weighting)
    size = float(wanted.max())
    scale: Floats = np.where(carries, wanted, size) if weighting == "relative" else 1.0 / np.abs(volts)
    if np.array_equal(carries, insulated > 0.0):
        return _without_contacts(insulated, wanted, scale, volts, weighting)
    return _with_contacts(design, wanted, scale, volts, weighting)


def yarn_conductance(design: Design) -> float:
    """Return the largest Σ sigma π R² / L of an insulated yarn, with L its straight length across the cell, S.

    >>> from circuittex.design import plain_weave
    >>> round(yarn_conductance(plain_weave()), 4)
    0.8836
    """
    weave = design.weave
    crossings = [len(weave.weft)] * len(weave.warp) + [len(weave.warp)] * len(weave.weft)
    return max(
        sum(material.electrical_conductivity for material in yarn.materials)
        * np.pi
        * yarn.radius
        * yarn.radius
        / (count * weave.pitch)
        for yarn, count in zip(weave.warp + weave.weft, crossings, strict=True)
    )


def network_conductances(design: Design, Ry: float, Rc: float) -> Floats:
    """Return the conductance of the reduced network at each probe, S, in two shares (n, 2): yarn arms and crossings.

    A share is the power Σ G ΔV² of those resistors over the squared probe voltage. Since the power is stationary in
    the potential, -share / Ry and -share / Rc are also the exact derivatives of the conductance with Ry and Rc.
    """
    ends = {t.name: tuple(yarn_end_name(yarn, side) for yarn, side in t.ends) for t in design.terminals}
    pairs = tuple((ends[probe.source], ends[probe.sink]) for probe in design.probes)
    return _conductances((len(design.weave.warp), len(design.weave.weft)), pairs, Ry, Rc)


# The start values of the fit are the same for every state, and a misfit and its derivatives follow from one solution.
@lru_cache(maxsize=100)
def _conductances(
    shape: tuple[int, int], pairs: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...], Ry: float, Rc: float
) -> Floats:
    """`network_conductances` between the (source, sink) ends of each probe; nobody may write to what it returns."""
    whole = reduced_circuit(shape, Ry, Rc)
    shares = []
    for source, sink in pairs:
        drive = dict.fromkeys(source, 1.0) | dict.fromkeys(sink, 0.0)
        part = reached_part(whole, drive)
        voltage = solve_nodal(part, drive).voltage
        power = np.diff(voltage[part.resistor_nodes], axis=1)[:, 0] ** 2 / part.resistance
        crossing = np.array([name.startswith("rc_") for name in part.resistor_names])
        shares.append((power[~crossing].sum(), power[crossing].sum()))
    found = np.array(shares, dtype=np.float64).reshape(-1, 2)
    found.setflags(write=False)
    return found


def _checked(currents: Sequence[float] | Floats, design: Design, volts: Floats) -> Floats:
    """Return I / U of each probe after looking at it; 0 where it is nothing but rounding."""
    found = np.asarray(currents, dtype=np.float64)
    if found.shape != volts.shape or not np.isfinite(found).all():
        raise CircuitError(
            f"currents: {found.tolist()} is not usable; it must be one finite number for each of {len(volts)} probes"
        )
    conductance: Floats = found / volts
    nothing = _NONE * yarn_conductance(design)
    if conductance.min(initial=0.0) < -max(nothing, _NONE * conductance.max(initial=0.0)):
        raise CircuitError(f"currents: {found.tolist()} is not usable; no current may flow against its voltage")
    return np.where(conductance > nothing, conductance, 0.0)


def _without_current(insulated: Floats, yarns: float, weighting: str) -> Fit:
    """Say what follows from no current at all: something on the way of every probe does not conduct."""
    Ry = Rc = float("nan")
    if not len(insulated):
        warnings: tuple[str, ...] = ("there are no probes: Ry and Rc are not determined",)
    elif yarns == 0.0 or insulated.any():
        Ry = float("inf")
        warnings = ("no probe carries current: the yarns do not conduct, and Rc is not determined",)
    else:
        Rc = float("inf")
        warnings = ("no probe carries current: the crossings do not conduct, and Ry is not determined",)
    return Fit(
        Ry=Ry,
        Rc=Rc,
        residual=0.0 if len(insulated) else float("nan"),
        covariance=np.diag([np.inf, np.inf]),
        weighting=weighting,
        warnings=warnings,
        currents=np.zeros(len(insulated)),
    )


def _without_contacts(insulated: Floats, wanted: Floats, scale: Floats, volts: Floats, weighting: str) -> Fit:
    """Fit Ry alone, in closed form: only probes along a yarn carry current, so the yarns are insulated."""
    model, target = insulated / scale, wanted / scale
    Ry = float(model @ model / (model @ target))
    misfit = model / Ry - target
    variance = _variance(misfit) * Ry**2 / float((model / Ry) @ (model / Ry))
    return Fit(
        Ry=Ry,
        Rc=float("inf"),
        residual=float(np.linalg.norm(misfit)),
        covariance=np.array([[variance, 0.0], [0.0, np.inf]]),
        weighting=weighting,
        warnings=("Rc is not determined: no probe between different yarns carries current",),
        currents=insulated / Ry * volts,
    )


def _with_contacts(design: Design, wanted: Floats, scale: Floats, volts: Floats, weighting: str) -> Fit:
    """Fit log Ry and log Rc, from the best of a table of ratios (given Rc / Ry, the best 1 / Ry is linear)."""
    target = wanted / scale
    start, best = np.zeros(2), np.inf
    unit = power_of_two(float(wanted.max()))  # S: logarithms of pure numbers are rounded alike at every scale
    for ratio in _RATIOS:
        model = network_conductances(design, 1.0, ratio).sum(axis=1) / scale
        siemens = float(model @ target / (model @ model))
        size = float(np.linalg.norm(siemens * model - target))
        if siemens > 0.0 and size < best:
            start, best = np.log([unit / siemens, ratio]), size

    # The search is in log Ry and log Rc / Ry: bounds of the ratio keep the network solvable.
    def values(logs: Floats) -> tuple[float, float]:
        return float(np.exp(logs[0])) / unit, float(np.exp(logs[0] + logs[1])) / unit

    def misfits(logs: Floats) -> Floats:
        difference: Floats = network_conductances(design, *values(logs)).sum(axis=1) / scale - target
        return difference

    def jacobian(logs: Floats) -> Floats:
        return -network_conductances(design, *values(logs)) @ [[1.0, 0.0], [1.0, 1.0]] / scale[:, None]

    low, high = np.log([_RATIOS[0] / _BEYOND, _RATIOS[-1] * _BEYOND])
    logs = start
    if best > _EXACT * float(np.linalg.norm(target)):  # as one probe alone always is; the search would divide by 0
        logs = least_squares(
            misfits,
            start,
            jacobian,
            bounds=([-np.inf, low], [np.inf, high]),
            xtol=1e-15,
            ftol=None,  # small misfits and slopes do not end the search: Rc may show in nothing but tiny currents
            gtol=None,
        ).x
    misfit = misfits(logs)
    Ry, Rc = values(logs)
    shares = network_conductances(design, Ry, Rc)
    spread, warnings = _spread(-shares / scale[:, None], float(np.abs(target).max()))
    if not low + 1.0 < logs[1] < high - 1.0:
        warnings += ("Rc is not determined, at the edge of the search: no crossing resistance explains the currents",)
    if len(wanted) < 3:
        warnings += (f"{len(wanted)} probes leave no misfit to judge the fit by: the covariance is unknown",)
    lost = np.isinf(np.diag(spread)) | (np.sqrt(np.diag(spread)) * float(np.abs(target).max()) > _AMPLIFIED)
    if not low + 1.0 < logs[1] < high - 1.0:
        lost[1] = True
    variance = _variance(misfit)
    covariance = (
        variance * spread * np.outer([Ry, Rc], [Ry, Rc]) if np.isfinite(variance) else np.diag([np.inf, np.inf])
    )
    return Fit(
        Ry=float("nan") if lost[0] else Ry,
        Rc=float("nan") if lost[1] else Rc,
        residual=float(np.linalg.norm(misfit)),
        covariance=covariance,
        weighting=weighting,
        warnings=warnings,
        currents=shares.sum(axis=1) * volts,
    )


def _variance(misfit: Floats) -> float:
    """Return the variance of one misfit, with two degrees of freedom spent on Ry and Rc."""
    return float(misfit @ misfit) / (len(misfit) - 2) if len(misfit) > 2 else float("inf")


def _spread(jacobian: Floats, size: float) -> tuple[Floats, tuple[str, ...]]:
    """Return (JᵀJ)⁻¹ of the logarithms, inf where J has lost its rank, and what must be said about it."""
    _, values, directions = np.linalg.svd(jacobian, full_matrices=True)
    values = np.concatenate([values, np.zeros(2 - len(values))])
    if values[-1] <= 1e-13 * values[0]:
        return np.diag([np.inf, np.inf]), (
            "Ry and Rc are not determined: the probes determine only one combination of them",
        )
    spread = (directions.T / values**2) @ directions
    warnings = tuple(
        f"{name} is not determined: an error of 1 % in the weighted currents moves it by {percent:.3g} %"
        for name, percent in zip(("Ry", "Rc"), np.sqrt(np.diag(spread)) * size, strict=True)
        if percent > _AMPLIFIED
    )
    return spread, warnings
