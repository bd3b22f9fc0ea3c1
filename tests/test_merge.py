"""Merging, snapping and dropping of contact points: what is kept, and what must not matter."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from synthetic import fibrils, touching, woven

import circuittex as ct
from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.contact.merge import drop_vanishing, merge_contacts, simplify, snap_feet
from circuittex.contact.state import ContactState
from circuittex.design import Terminal

COLUMNS = [f.name for f in fields(ContactState) if f.name not in ("mesh", "axial_factor")]
LENGTHS = st.sampled_from([0.01, 0.1, 0.3, 1.0, 3.0])
SEEDS = st.integers(0, 10_000)


def random_state(seed: int) -> ContactState:
    """A weave with different widths, loads and gaps."""
    rng = np.random.default_rng(seed)
    state = woven(yarns=2, per_yarn=2, points=6, seed=seed)
    n = state.n_contacts
    return replace(
        state,
        gap=-rng.uniform(0, 0.05, n),
        line_load=rng.uniform(0, 0.2, n),
        width=rng.uniform(0, 0.1, n) * (rng.random(n) < 0.9),
    )


def reordered(state: ContactState, order: np.ndarray) -> ContactState:
    return replace(state, **{name: getattr(state, name)[order] for name in COLUMNS})


def flipped(state: ContactState, which: np.ndarray) -> ContactState:
    """The chosen contacts seen from their other fibril."""
    pairs = [("fibril_a", "fibril_b"), ("xi_a", "xi_b")]
    swapped = {}
    for a, b in pairs:
        swapped[a] = np.where(which, getattr(state, b), getattr(state, a))
        swapped[b] = np.where(which, getattr(state, a), getattr(state, b))
    return replace(state, **swapped)


def equal(a: ContactState, b: ContactState) -> bool:
    return all(same(getattr(a, name), getattr(b, name)) for name in COLUMNS)


def test_three_points_of_one_pair_by_hand() -> None:
    """Two in the first bin, one of them from the other side; the third alone, as it was."""
    state = touching(
        fibrils([8.0, 8.0]),
        [0, 1, 0],
        [0.2, 0.5, 1.4],
        [1, 0, 1],
        [0.3, 0.6, 1.5],
        conductance=[1.0, 3.0, 5.0],
        heat_conductance=[10.0, 20.0, 30.0],
        weight=[0.1, 0.3, 0.2],
    )
    merged = merge_contacts(state, 1.0)
    assert_array_equal(merged.fibril_a, [0, 0])
    assert_array_equal(merged.fibril_b, [1, 1])
    assert_allclose(merged.xi_a, [0.25 * 0.2 + 0.75 * 0.6, 1.4], rtol=1e-15)
    assert_allclose(merged.xi_b, [0.25 * 0.3 + 0.75 * 0.5, 1.5], rtol=1e-15)
    assert_array_equal(merged.conductance, [4.0, 5.0])
    assert_array_equal(merged.heat_conductance, [30.0, 30.0])
    assert_allclose(merged.weight, [0.4, 0.2], rtol=1e-15)
    assert_allclose(merged.width, state.width[0], rtol=1e-15)


@given(SEEDS, LENGTHS)
def test_sums_are_kept_for_every_pair(seed: int, length: float) -> None:
    state = random_state(seed)
    merged = merge_contacts(state, length)

    def sums(s: ContactState) -> np.ndarray:
        low, high = np.minimum(s.fibril_a, s.fibril_b), np.maximum(s.fibril_a, s.fibril_b)
        values = (
            s.weight,
            s.conductance,
            s.heat_conductance,
            s.width * s.weight,
            s.line_load * s.weight,
            s.gap * s.weight,
            s.width * s.weight * np.where(s.fibril_a < s.fibril_b, s.xi_a, s.xi_b),
            s.width * s.weight * np.where(s.fibril_a < s.fibril_b, s.xi_b, s.xi_a),
        )
        n = s.mesh.n_fibrils
        return np.array([np.bincount(low * n + high, v, n * n) for v in values])

    assert_allclose(sums(merged), sums(state), rtol=1e-12, atol=1e-18)
    assert merged.n_contacts <= state.n_contacts


@given(SEEDS, LENGTHS)
def test_merging_again_changes_nothing(seed: int, length: float) -> None:
    once = merge_contacts(random_state(seed), length)
    assert equal(merge_contacts(once, length), once)


@given(SEEDS, LENGTHS)
def test_neither_order_nor_sides_matter(seed: int, length: float) -> None:
    state = random_state(seed)
    rng = np.random.default_rng(seed + 1)
    other = flipped(reordered(state, rng.permutation(state.n_contacts)), rng.random(state.n_contacts) < 0.5)
    assert equal(merge_contacts(other, length), merge_contacts(state, length))


@given(SEEDS, LENGTHS)
def test_only_neighbours_on_both_fibrils_are_merged(seed: int, length: float) -> None:
    """Against groups made one contact at a time: same bin on the lower fibril, chains of bins on the other."""
    state = random_state(seed)
    low_first = state.fibril_a < state.fibril_b
    low, high = (np.where(low_first, *p) for p in ((state.fibril_a, state.fibril_b), (state.fibril_b, state.fibril_a)))
    xi_low, xi_high = (np.where(low_first, *p) for p in ((state.xi_a, state.xi_b), (state.xi_b, state.xi_a)))
    spans: dict[tuple[int, ...], set[int]] = {}
    for a, b, xa, xb in zip(low, high, xi_low, xi_high, strict=True):
        spans.setdefault((a, b, int(xa / length)), set()).add(int(4 * (xb / length)))
    expected = 0
    for bins in map(sorted, spans.values()):
        runs = np.split(bins, np.flatnonzero(np.diff(bins) > 4) + 1)
        expected += sum(1 if run[-1] - run[0] < 6 else len(run) for run in runs)
    merged = merge_contacts(state, length)
    assert np.all(merged.fibril_a < merged.fibril_b)
    assert merged.n_contacts == expected


@pytest.mark.parametrize(("apart", "left"), [(0.2, 1), (1.0, 1), (1.6, 2), (3.4, 2)])
def test_contacts_far_apart_on_one_fibril_stay_two(apart: float, left: int) -> None:
    """Together on the lower fibril, `apart` on the other: from 3/2 of the merge length on always two."""
    for swap in (False, True):
        a, b = (np.array([2.2, 2.4]), np.array([0.2, 0.2 + apart]))
        state = touching(fibrils([8.0, 8.0]), [swap] * 2, b if swap else a, [not swap] * 2, a if swap else b)
        merged = merge_contacts(state, 1.0)
        assert merged.n_contacts == left
        if left == 2:
            assert_array_equal(merged.xi_b, b)


def test_a_bridge_is_not_shorted_by_merging() -> None:
    """0.2 and 0.4 mm of a fibril in series with 3.4 mm beside 0.2 mm of another and two contacts: 2.39698 ohm."""
    design = ct.plain_weave("paper-code", yarns=2, rows=(1,))
    mesh = ct.build_mesh(design)
    one = np.ones(2)
    contacts = ContactState(
        mesh=mesh,
        fibril_a=np.array([0, 0]),
        fibril_b=np.array([2, 2]),
        xi_a=np.array([2.2, 2.4]),
        xi_b=np.array([0.2, 3.6]),
        gap=-0.01 * one,
        line_load=0.05 * one,
        width=0.01 * one,
        weight=0.1 * one,
        conductance=one,
        heat_conductance=one,
        axial_factor=np.ones(len(mesh.elements)),
    )
    merged = merge_contacts(contacts, 1.0)
    circuit = ct.build_circuit(merged, [Terminal("in", (("weft1", -1),)), Terminal("out", (("weft1", 1),))])
    ohm = 1.0 / float(ct.solve_nodal(circuit, {"in": 1.0, "out": 0.0}).port_current[0])
    per_mm = 1 / (10 * np.pi * 0.15**2)
    by_hand = per_mm * (0.2 + 1 / (1 / 3.4 + 1 / (0.2 + 2 / per_mm)) + 0.4)
    assert by_hand == pytest.approx(2.396980, abs=5e-7)
    assert_array_equal(merged.xi_b, [0.2, 3.6])
    assert ohm == pytest.approx(by_hand, rel=1e-12)


def test_points_without_width_merge_at_their_plain_mean() -> None:
    state = replace(touching(fibrils([8.0, 8.0]), [0, 0], [0.2, 0.4], [1, 1], [0.3, 0.5]), width=np.zeros(2))
    merged = merge_contacts(state, 1.0)
    assert_allclose([merged.xi_a, merged.xi_b], [[0.3], [0.4]], rtol=1e-15)
    assert_array_equal(merged.width, [0.0])


def test_snapping_by_hand() -> None:
    """0.0004 goes to the end, the two around 4 become one, 7.9995 goes to the other end."""
    state = touching(fibrils([8.0, 8.0]), [0, 0, 0, 0], [4e-4, 4.0, 4.0008, 7.9995], [1, 1, 1, 1], [1.0, 2.0, 3.0, 4.0])
    snapped, vanished = snap_feet(state, 1e-3)
    assert_allclose(snapped.xi_a, [0.0, 4.0004, 4.0004, 8.0], rtol=1e-15)
    assert_array_equal(snapped.xi_b, [1.0, 2.0, 3.0, 4.0])
    assert vanished == 3
    assert_array_equal(snapped.conductance, state.conductance)


def test_feet_that_coincide_already_are_not_counted() -> None:
    state = touching(fibrils([8.0, 8.0]), [0, 0], [0.0, 8.0], [1, 1], [2.0, 2.0])
    snapped, vanished = snap_feet(state, 1e-3)
    assert vanished == 0
    assert equal(snapped, state)


@given(SEEDS, st.sampled_from([1e-4, 1e-2, 0.05]))
def test_snapped_feet_are_apart_and_stay(seed: int, length: float) -> None:
    state = random_state(seed)
    snapped, vanished = snap_feet(state, length)
    mesh = state.mesh
    every = np.arange(mesh.n_fibrils)
    ends = np.concatenate([0 * mesh.length, mesh.length])

    def distinct(s: ContactState) -> np.ndarray:
        fibril = np.concatenate([every, every, s.fibril_a, s.fibril_b])
        return np.unique(np.column_stack([fibril, np.concatenate([ends, s.xi_a, s.xi_b])]), axis=0)

    places = distinct(snapped)
    step = np.diff(places, axis=0)
    assert np.all(step[step[:, 0] == 0, 1] >= length)
    assert len(distinct(state)) - len(places) == vanished
    again, none = snap_feet(snapped, length)
    assert none == 0
    assert equal(again, snapped)
    rng = np.random.default_rng(seed)
    order = rng.permutation(state.n_contacts)
    assert equal(snap_feet(reordered(state, order), length)[0], reordered(snapped, order))


def test_a_snap_length_that_swallows_a_fibril_is_refused() -> None:
    state = touching(fibrils([8.0, 1.0]), [0], [4.0], [1], [0.5])
    with pytest.raises(DesignError, match="would join both ends of fibril 1"):
        snap_feet(state, 0.6)


def test_vanishing_contacts_are_dropped_and_counted() -> None:
    state = touching(
        fibrils([8.0, 8.0]), [0] * 4, [1, 2, 3, 4], [1] * 4, [1, 2, 3, 4], conductance=[1.0, 1e-7, 0.0, 1e-5]
    )
    kept, dropped = drop_vanishing(state, 1e-6)
    assert dropped == 2
    assert_array_equal(kept.xi_a, [1.0, 4.0])
    nothing, all_of_them = drop_vanishing(replace(state, conductance=np.zeros(4)), 0.0)
    assert (nothing.n_contacts, all_of_them) == (0, 4)


def test_the_only_way_between_two_yarns_is_never_dropped() -> None:
    """Found in review: a millionth of a yarn's own contacts was all that joined it to others, and went."""
    mesh = fibrils([8.0] * 3, yarn=[0, 0, 1])
    state = touching(mesh, [0, 0, 0], [1, 2, 3], [1, 2, 2], [1, 2, 3], conductance=[1.0, 1e-9, 1e-16])
    kept, dropped = drop_vanishing(state, 1e-6)
    assert dropped == 1
    assert_array_equal(kept.conductance, [1.0, 1e-9])


def test_simplify_composes_and_counts() -> None:
    state = random_state(11)
    found = simplify(state, merge_length=0.5, snap_length=1e-2, drop_fraction=0.2)
    merged = merge_contacts(state, 0.5)
    kept, dropped = drop_vanishing(merged, 0.2)
    snapped, feet = snap_feet(kept, 1e-2)
    assert equal(found.contacts, snapped)
    assert found.merged_contacts == state.n_contacts - merged.n_contacts > 0
    assert (found.dropped_contacts, found.merged_feet) == (dropped, feet)
    assert dropped > 0
    assert feet > 0


def test_zero_lengths_leave_the_steps_out() -> None:
    state = random_state(1)
    found = simplify(state, merge_length=0.0, snap_length=0.0, drop_fraction=0.0)
    assert (found.merged_contacts, found.merged_feet) == (0, 0)
    assert equal(found.contacts, state)


def test_no_contacts_at_all() -> None:
    state = touching(fibrils([8.0]))
    found = simplify(state, merge_length=1.0, snap_length=1e-3, drop_fraction=1e-6)
    assert found.contacts.n_contacts == found.merged_contacts == found.dropped_contacts == found.merged_feet == 0


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf])
def test_unusable_lengths_are_refused(length: float) -> None:
    state = touching(fibrils([8.0]))
    with pytest.raises(DesignError, match="merge_length"):
        merge_contacts(state, length)
    with pytest.raises(DesignError, match="snap_length"):
        snap_feet(state, length)


@pytest.mark.parametrize("fraction", [-0.1, 1.0, np.nan])
def test_unusable_fractions_are_refused(fraction: float) -> None:
    with pytest.raises(DesignError, match="drop_fraction"):
        drop_vanishing(touching(fibrils([8.0])), fraction)
