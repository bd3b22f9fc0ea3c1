"""Merging, snapping and dropping of contact points: what is kept, and what must not matter."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from synthetic import fibrils, touching, woven

from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.contact.merge import drop_vanishing, merge_contacts, simplify, snap_feet
from circuittex.contact.state import ContactState

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


def test_one_contact_a_pair_and_bin_is_left() -> None:
    merged = merge_contacts(random_state(3), 0.5)
    keys = np.column_stack([merged.fibril_a, merged.fibril_b, np.floor(merged.xi_a / 0.5)])
    assert np.all(merged.fibril_a < merged.fibril_b)
    assert len(np.unique(keys, axis=0)) == merged.n_contacts


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
