"""Fewer contact points for the same contacts: merging, snapping of feet, and leaving out what conducts nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState

MOST_EMPTY, MOST_BINS = 3, 6
"""Of bins of a quarter of the merge length: how many empty ones a run survives, and how many a contact stands for."""


@frozen
class Simplified:
    """A contact state with fewer points, and how it came to be."""

    contacts: ContactState
    """The simplified state."""
    merged_contacts: int
    """How many contact points were added to others."""
    dropped_contacts: int
    """How many were left out because they conduct next to nothing."""
    merged_feet: int
    """How many feet moved onto a neighbouring one or onto a fibril end."""


def simplify(state: ContactState, *, merge_length: float, snap_length: float, drop_fraction: float) -> Simplified:
    """Merge, then drop, then snap: the state for circuits that a simulator can afford.

    See `merge_contacts`, `drop_vanishing` and `snap_feet`. A `merge_length` or `snap_length` of 0 leaves that
    step out.
    """
    merged = merge_contacts(state, merge_length) if merge_length else state
    kept, dropped = drop_vanishing(merged, drop_fraction)
    snapped, feet = snap_feet(kept, snap_length) if snap_length else (kept, 0)
    return Simplified(snapped, state.n_contacts - merged.n_contacts, dropped, feet)


def merge_contacts(state: ContactState, length: float) -> ContactState:
    """One contact for all those of a fibril pair that lie together on both fibrils.

    Along the lower-numbered fibril, which becomes fibril a, together is what falls into the same bin of `length` mm.
    Of these, neighbours along the other are merged, whose bins are a quarter as long. A run of bins that hold
    contacts ends where four are empty; one of up to six bins becomes one contact, and each bin of a longer one makes
    its own. So what spans up to 5/4 `length` along the other fibril and lies alone is merged, and what spans more
    than 3/2 never is. Both sides of the pair are taken in.

    Sums are kept: conductances and weights, and weighted by them contact area (width), force (line load) and
    gap; so where G = sigma_c a w [31] it still is. The feet are means weighted by contact area. The result is
    ordered by pair and coordinate and does not depend on the order of the contacts, nor on which fibril of a
    pair is a; merging it again changes nothing.

    Raises DesignError unless `length` is positive.
    """
    _check_length("merge_length", length)
    if not state.n_contacts:
        return state
    state = _take(_lower_first(state), _canonical_permutation(_lower_first(state)))
    group, start = _together(state, length)
    state = _take(state, np.argsort(group, kind="stable"))
    weight = np.add.reduceat(state.weight, start)
    area = state.width * state.weight
    merged = replace(
        state,
        fibril_a=state.fibril_a[start],
        fibril_b=state.fibril_b[start],
        xi_a=_mean(state.xi_a, area, start),
        xi_b=_mean(state.xi_b, area, start),
        gap=_mean(state.gap, state.weight, start),
        line_load=_mean(state.line_load, state.weight, start),
        width=_mean(state.width, state.weight, start),
        weight=weight,
        conductance=np.add.reduceat(state.conductance, start),
        heat_conductance=np.add.reduceat(state.heat_conductance, start),
    )
    return _take(merged, _canonical_permutation(merged))


def _together(state: ContactState, length: float) -> tuple[Ints, Ints]:
    """The group (C,) of each contact, numbered from 0, and where each group starts once they are sorted by it."""
    bin_a, bin_b = np.floor(state.xi_a / length), np.floor(4 * (state.xi_b / length))
    permutation = np.lexsort([bin_b, bin_a, state.fibril_b, state.fibril_a])
    apart = [np.diff(column[permutation]) != 0 for column in (state.fibril_a, state.fibril_b, bin_a)]
    bin_b = bin_b[permutation]
    step = np.diff(bin_b)
    run_starts = np.concatenate([[True], np.logical_or.reduce([*apart, step > MOST_EMPTY + 1])])
    run, at = np.cumsum(run_starts) - 1, np.flatnonzero(run_starts)
    bins = bin_b[np.append(at[1:], len(permutation)) - 1] - bin_b[at] + 1
    own = run_starts | (np.concatenate([[True], step != 0]) & (bins[run] > MOST_BINS))
    group = np.empty(len(permutation), dtype=np.int64)
    group[permutation] = np.cumsum(own) - 1
    return group, np.flatnonzero(own)


def snap_feet(state: ContactState, length: float) -> tuple[ContactState, int]:
    """Give feet of one fibril that are closer than `length` mm the same coordinate; returns also how many vanished.

    A resistor far smaller than its neighbours costs digits in every solver, so the pieces of fibril between
    such feet are taken out. A chain of close feet becomes one, at their mean weighted by contact area; a chain
    that holds a fibril end moves to the end. Snapping again changes nothing.

    Raises DesignError unless `length` is positive and so small that no chain joins both ends of a fibril.
    """
    _check_length("snap_length", length)
    if not state.n_contacts:
        return state, 0
    L = state.mesh.length
    every = np.arange(len(L))
    fibril = np.concatenate([every, every, state.fibril_a, state.fibril_b])
    xi = np.concatenate([np.zeros(len(L)), L, state.xi_a, state.xi_b])
    area = np.concatenate([np.zeros(2 * len(L)), np.tile(state.width * state.weight, 2)])
    permutation = np.lexsort((area, xi, fibril))
    same_fibril = np.diff(fibril[permutation]) == 0
    moved = np.diff(xi[permutation])
    start = np.flatnonzero(np.concatenate([[True], ~same_fibril | (moved >= length)]))
    chain = np.empty(len(permutation), dtype=np.int64)
    chain[permutation] = np.repeat(np.arange(len(start)), np.diff(start, append=len(permutation)))
    at = _mean(xi[permutation], area[permutation], start)
    low, high = chain[: len(L)], chain[len(L) : 2 * len(L)]
    if np.any(joined := low == high):
        raise DesignError("snap_length", length, f"would join both ends of fibril {int(np.flatnonzero(joined)[0])}")
    at[low], at[high] = 0.0, L
    distinct = len(permutation) - int(np.count_nonzero(same_fibril & (moved == 0.0)))
    feet = at[chain[2 * len(L) :]]
    n = state.n_contacts
    return replace(state, xi_a=feet[:n], xi_b=feet[n:]), distinct - len(start)


def drop_vanishing(state: ContactState, fraction: float) -> tuple[ContactState, int]:
    """Leave out contacts that conduct nothing or less than `fraction` of the best one between the same two yarns.

    Returns also how many. Of a cell's best one a part would say nothing: where two kinds of yarn hardly conduct to one
    another, all that joins them may be less than a millionth of what joins the fibrils within one.


    Raises DesignError unless 0 <= `fraction` < 1.
    """
    if not 0.0 <= fraction < 1.0:
        raise DesignError("drop_fraction", fraction, "must be at least 0 and less than 1")
    yarns = np.sort(state.mesh.yarn[np.stack([state.fibril_a, state.fibril_b])], axis=0)
    pair = yarns[0] * len(state.mesh.yarn_names) + yarns[1]
    largest = np.zeros(len(state.mesh.yarn_names) ** 2)
    np.maximum.at(largest, pair, state.conductance)
    kept = np.flatnonzero((state.conductance > 0.0) & (state.conductance >= fraction * largest[pair]))
    return _take(state, kept), state.n_contacts - len(kept)


_ROWS = (
    "fibril_a",
    "fibril_b",
    "xi_a",
    "xi_b",
    "gap",
    "line_load",
    "width",
    "weight",
    "conductance",
    "heat_conductance",
)


def _take(state: ContactState, rows: Ints) -> ContactState:
    """The contacts `rows`, in that order."""
    return replace(state, **{name: getattr(state, name)[rows] for name in _ROWS})


def _lower_first(state: ContactState) -> ContactState:
    """The same contacts, seen from the lower-numbered fibril (of a self-contact: from the lower coordinate)."""
    swap = (state.fibril_a > state.fibril_b) | ((state.fibril_a == state.fibril_b) & (state.xi_a > state.xi_b))
    return replace(
        state,
        fibril_a=np.where(swap, state.fibril_b, state.fibril_a),
        fibril_b=np.where(swap, state.fibril_a, state.fibril_b),
        xi_a=np.where(swap, state.xi_b, state.xi_a),
        xi_b=np.where(swap, state.xi_a, state.xi_b),
    )


def _canonical_permutation(state: ContactState) -> Ints:
    """The order by pair and coordinate, ties broken by all other values, so that sums round the same way."""
    permutation: Ints = np.lexsort([getattr(state, name) for name in reversed(_ROWS)])
    return permutation


def _mean(values: Floats, measure: Floats, start: Ints) -> Floats:
    """Weighted mean of each run of `values`, never outside their range; the plain one where nothing weighs."""
    count = np.diff(start, append=len(values))
    total = np.add.reduceat(measure, start)
    plain = np.add.reduceat(values, start) / count
    weighted = np.add.reduceat(values * measure, start)
    mean = np.divide(weighted, total, out=plain, where=total > 0.0)
    return np.clip(mean, np.minimum.reduceat(values, start), np.maximum.reduceat(values, start))


def _check_length(field: str, length: float) -> None:
    if not 0.0 < length < np.inf:
        raise DesignError(field, length, "must be a positive number of mm")
