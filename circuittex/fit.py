"""The reduced network [43-46] fitted to probe currents by least squares [47]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import CircuitError
from circuittex.base.frozen import frozen
from circuittex.design import Design, Probe
from circuittex.electrical.network.circuit import Circuit, reached_part, reduced_circuit, yarn_end_name
from circuittex.electrical.network.matching import Groups, Match, groups, match_pairs, match_probes, pair_errors, spread
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.network.one_pair import OnePair, checked, fit_one_pair
from circuittex.electrical.network.ports import PortMatrix

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
    def segments_by_name(self) -> dict[str, float]:
        """Ry of each kind of yarn, ohm: by the name 'Ry', or where there are several by those of `network_names`."""
        return dict(zip(_named("Ry", self.kinds), _values(self.kind_resistance, self.Ry), strict=True))

    @property
    def crossings_by_name(self) -> dict[str, float]:
        """Rc of each pair of kinds that cross, ohm: by the name 'Rc', or where there are several by theirs; none where
        no two yarns that conduct cross."""
        if self.kinds and not self.pairs:
            return {}
        return dict(zip(_named("Rc", self.pairs), _values(self.pair_resistance, self.Rc), strict=True))

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


def network_names(design: Design) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the resistances of the reduced networks of a design: those of yarns, and those of crossings.

    >>> from circuittex.design import plain_weave
    >>> network_names(plain_weave())
    (('Ry',), ('Rc',))
    """
    grouping = groups(design, each_crossing=_method(design) == "all-pairs")
    pairs = tuple(_conducting_pairs(design, grouping))
    return _named("Ry", grouping.yarns), _named("Rc", pairs) if pairs or not grouping.yarns else ()


def _named(letters: str, kinds: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"{letters} {kind}" for kind in kinds) if len(kinds) > 1 else (letters,)


def _values(by_kind: Floats, one: float) -> list[float]:
    """Resistances by kind; the one of the network where no kind conducts, or a file of older results has none."""
    return by_kind.tolist() if len(by_kind) else [one]


def _method(design: Design) -> str:
    """What the design is fitted to: 'probes' or 'all-pairs'."""
    if design.electrical.fit != "auto":
        return design.electrical.fit
    return "probes" if len(groups(design, each_crossing=False).yarns) == 1 else "all-pairs"


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
    method = _method(design)
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
            known = checked(currents, design, volts) if design.probes else np.empty(0)
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
    per_pair = {name: crossings[where] for name, where in _conducting_pairs(design, grouping).items()}
    return Fit(
        Ry=one.Ry,
        Rc=one.Rc,
        residual=one.residual,
        covariance=one.covariance,
        weighting=one.weighting,
        warnings=one.warnings + _poor(errors[0], one.residual, method == "probes" and crossings.size > 1),
        currents=one.currents,
        method=method,
        kinds=grouping.yarns,
        kind_resistance=values[:k],
        pairs=tuple(per_pair),
        pair_resistance=np.array([np.median(each) for each in per_pair.values()]),
        yarns=yarns,
        crossings=crossings,
        pair_errors=errors,
    )


def _poor(worst: float, residual: float, shared: bool) -> tuple[str, ...]:
    """What to say of a network that does not describe its cell; `shared`: its crossings have one resistance."""
    if worst == np.inf:
        return ("the reduced network does not join yarn ends that the cell joins",)
    if worst > POOR:
        way_out = '; with electrical.fit = "all-pairs" each crossing has a resistance of its own' if shared else ""
        return (f"the reduced network is off by up to {100 * worst:.2g} % between two yarn ends{way_out}",)
    if residual > POOR:
        return (f"the reduced network misses the currents by up to {100 * residual:.2g} %",)
    return ()


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


def _of_match(design: Design, match: Match, values: Floats, k: int, best: Circuit | None) -> OnePair:
    """A match in one number each: of the yarns where they are of one kind, and the median of the crossings."""
    weave = design.weave
    one_kind = len({yarn.name for yarn in weave.yarns}) == 1
    currents = np.full(len(design.probes), np.nan)
    if best is not None:
        volts = np.array([probe.voltage for probe in design.probes])
        currents = np.array([_through(best, design, probe) for probe in design.probes]) * volts
    return OnePair(
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
    conducts = dict(zip(design.weave.yarn_names, (yarn.conducts for yarn in design.weave.yarns), strict=True))
    live = {t.name: any(conducts[yarn] for yarn, _ in t.ends) for t in design.terminals}
    there = np.array([live[probe.source] and live[probe.sink] for probe in design.probes], dtype=bool)
    return np.where(there, conductance, 0.0)


def _conducting_pairs(design: Design, grouping: Groups) -> dict[str, tuple[Ints, Ints]]:
    """Pair of kinds that conduct -> the crossings (warp, weft) of it."""
    found: dict[str, list[tuple[int, int]]] = {}
    for i, warp in enumerate(design.weave.warp):
        for j, weft in enumerate(design.weave.weft):
            found.setdefault(" x ".join(sorted([warp.name, weft.name])), []).append((i, j))
    places = {name: (np.array(each)[:, 0], np.array(each)[:, 1]) for name, each in found.items()}
    return {name: where for name, where in places.items() if (grouping.crossing_group[where] >= 0).any()}
