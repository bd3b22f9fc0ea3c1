"""The resistances of a panel's cells as functions of strain, stated or found by a study.

Every crossing of a panel is a cell of the reduced network [43-46]: four arms Ry/2 to its edges and Rc between its warp
and its weft yarn. What is known at some strains is interpolated between them by monotone cubics (PCHIP) of ln R.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.design.checks import LARGEST, one_of, refuse, store
from circuittex.electrical.network.matching import groups, match_pairs, spread
from circuittex.results.loadings import by_loading, turns
from circuittex.results.records import Record, Study

OUTSIDE = ("refuse", "clamp")
KINDS = ("warp", "weft", "crossing")


@frozen
class CellResistances:
    """Ry of both yarns and Rc of each cell at S strains; a tile that repeats over the panel.

    >>> CellResistances(0.28, 0.28, 300.0).crossing.shape
    (1, 1, 1)
    """

    warp: Floats
    """(S, a, b) resistance of a segment of the warp yarn, from crossing to crossing, ohm; inf where it insulates."""
    weft: Floats
    """(S, a, b) of the weft yarn, ohm."""
    crossing: Floats
    """(S, a, b) from yarn to yarn, ohm; inf where nothing passes. Every kind may have a tile of its own size."""
    strain: tuple[float, ...] = (0.0,)
    """(S,) rising strains at which they are known."""
    source: str = "stated"
    """Where they come from."""

    def __post_init__(self) -> None:
        strain = np.asarray(self.strain, dtype=np.float64)
        if strain.ndim != 1 or not len(strain) or not np.isfinite(strain).all() or (np.diff(strain) <= 0.0).any():
            raise refuse(
                "resistance.strain", self.strain, "it must be a list of rising strains, such as [0, 0.05, 0.1]"
            )
        store(self, strain=tuple(strain.tolist()), **{k: _tile(getattr(self, k), len(strain), k) for k in KINDS})


@frozen
class LocalResistances:
    """The resistances of every cell of a panel at its strain, and how they change with it."""

    warp: Floats
    """(n, m) ohm."""
    weft: Floats
    """(n, m) ohm."""
    crossing: Floats
    """(n, m) ohm."""
    warp_slope: Floats
    """(n, m) d ln R / d strain [1]."""
    weft_slope: Floats
    """(n, m) d ln R / d strain [1]."""
    crossing_slope: Floats
    """(n, m) d ln R / d strain [1]."""
    clamped: int
    """Cells strained beyond what is known, which have the last known values."""


def local_resistances(cells: CellResistances, strain: Floats, outside: str = "refuse") -> LocalResistances:
    """Resistances at the strains (n, m) of a panel's cells.

    Between known strains ln R is a monotone cubic, so that no value lies beyond its neighbours' [PCHIP]; beyond them
    it is an error ('refuse') or the last value ('clamp'), which then has no slope.

    >>> law = CellResistances([1.0, 1.0], [1.0, 1.0], [100.0, 400.0], (0.0, 0.1))
    >>> local_resistances(law, np.array([[0.0, 0.05, 0.1]])).crossing.round(9).tolist()
    [[100.0, 200.0, 400.0]]
    """
    one_of(outside, "strain.outside", OUTSIDE)
    low, high = cells.strain[0], cells.strain[-1]
    beyond = (strain < low) | (strain > high)
    if len(cells.strain) == 1:  # nothing is known of a dependence on strain
        beyond = strain != low
    if beyond.any() and outside == "refuse":
        worst = float(strain.flat[np.argmax(np.abs(strain - (low + high) / 2))])
        raise refuse(
            "strain",
            worst,
            f"resistances are known from {low:g} to {high:g} ({cells.source}); outside = 'clamp' takes the last ones",
        )
    at = np.clip(strain, low, high)
    found: dict[str, Any] = {}
    for kind in KINDS:
        found[kind], slope = _interpolated(np.asarray(cells.strain), getattr(cells, kind), at)
        found[f"{kind}_slope"] = np.where(beyond, 0.0, slope)
    return LocalResistances(**found, clamped=int(beyond.sum()))


def cells_of_study(study: Study, loading: str = "") -> CellResistances:
    """The resistances of a study's cell along one loading, until it turns back; every panel repeats the cell.

    Each state's reduced network has a Ry for each kind and direction of yarn and an Rc for each crossing, matched to
    the resistances between all pairs of yarn ends (`match_pairs`), or is the state's fit where these are not known.

    Raises `DesignError` for a loading that the study does not have and a state whose network is not determined.
    """
    paths = by_loading(study)
    if not loading:
        loading = next(iter(paths))
    if loading not in paths:
        raise refuse("results.loading", loading, f"the study has {', '.join(filter(None, paths)) or 'no loading'}")
    records = paths[loading]
    if not records:
        raise refuse("results", study.design.name, "no state of it is finished")
    back = turns([record.strain for record in records])
    records = tuple(sorted(records[: back[0] + 1] if back else records, key=lambda record: record.strain))
    each = [_network(study, record) for record in records]
    n = len(each[0][1])
    along = np.array([yarns for yarns, _ in each])
    words = f"{study.design.name}, {loading or 'relaxed'}"
    return CellResistances(
        warp=along[:, :n, None],
        weft=along[:, None, n:],
        crossing=np.array([crossings for _, crossings in each]),
        strain=tuple(record.strain for record in records),
        source=words,
    )


def _network(study: Study, record: Record) -> tuple[Floats, Floats]:
    """Ry of each yarn (warp + weft,) and Rc of each crossing (warp, weft) of a state, ohm."""
    grouping = groups(study.design, each_crossing=True)
    match = match_pairs(study.design, grouping, record.ports)
    if len(record.ports.ports) and match.solved and not match.lost.any():
        return spread(grouping, match.values)
    if record.fit.known:
        return record.fit.yarns, record.fit.crossings
    reasons = "; ".join(record.fit.warnings or match.reasons) or "no fit"
    raise DesignError("results", record.name, f"the resistances of this state are not determined: {reasons}")


def _tile(values: object, count: int, kind: str) -> Floats:
    """Values (S, a, b) from one number, one for each strain, or arrays."""
    field, wanted = f"resistance.{kind}", f"it must be one number > 0 ohm, or {count}, one for each strain"
    try:
        found = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise refuse(field, values, wanted) from None
    if found.ndim == 0:
        found = np.full(count, found)
    if found.ndim == 1:
        found = found[:, None, None]
    if found.ndim == 2 and count == 1:
        found = found[None]
    if found.ndim != 3 or len(found) != count or not found.size:
        raise refuse(field, found.shape, wanted)
    with np.errstate(invalid="ignore"):
        good = (found >= 1.0 / LARGEST) & ((found <= LARGEST) | np.isposinf(found))
    if not good.all():
        value = float(found[~good][0])
        raise refuse(field, value, f"it must be from {1 / LARGEST:g} to {LARGEST:g} ohm, or inf where nothing conducts")
    if (np.isinf(found).any(axis=0) != np.isinf(found).all(axis=0)).any():
        raise refuse(field, float("inf"), "what insulates must do so at every strain")
    return found


def _interpolated(known: Floats, values: Floats, at: Floats) -> tuple[Floats, Floats]:
    """Values (n, m) and slopes of their logarithms at strains (n, m) from a tile (S, a, b)."""
    _, a, b = values.shape
    rows, columns = np.ix_(np.arange(at.shape[0]) % a, np.arange(at.shape[1]) % b)
    if len(known) == 1:
        return values[0, rows, columns], np.zeros(at.shape)
    finite = np.isfinite(values)
    with np.errstate(invalid="ignore"):
        curve = PchipInterpolator(known, np.log(np.where(finite, values, 1.0)), axis=0)
    place = np.clip(np.searchsorted(known, at, side="right") - 1, 0, len(known) - 2)
    c3, c2, c1, c0 = (each[place, rows, columns] for each in curve.c)
    t = at - known[place]
    value = np.exp(c0 + t * (c1 + t * (c2 + t * c3)))
    slope = c1 + t * (2.0 * c2 + t * 3.0 * c3)
    conducts = finite[0][rows, columns]
    return np.where(conducts, value, np.inf), np.where(conducts, slope, 0.0)


def stated_cells(
    warp: float | Sequence[float] | Floats,
    weft: float | Sequence[float] | Floats,
    crossing: float | Sequence[float] | Floats,
    strain: Sequence[float] = (0.0,),
) -> CellResistances:
    """Resistances stated directly: one number each, one for each strain, or an array (n, m) of a panel's cells, ohm.

    >>> stated_cells(0.28, 0.28, [300.0, 250.0], strain=(0.0, 0.1)).crossing.ravel().tolist()
    [300.0, 250.0]
    """
    return CellResistances(warp, weft, crossing, tuple(strain))  # type: ignore[arg-type]
