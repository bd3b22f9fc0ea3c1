"""Error estimates of made-up sequences whose limit, and hence true error, is known."""

from __future__ import annotations

from math import inf, isnan, nan

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from circuittex.results.discretisation import ErrorEstimate, QuantityError, contact_error, mesh_error, observed_order

ROUNDING = 1e-6  # relative: errors of 1e-3 and more beside a limit of at most 100, in double precision
limits = st.floats(-100, 100)
sizes = st.floats(1e-3, 1e3) | st.floats(-1e3, -1e-3)
orders = st.floats(1.001, 1.999)


def sequence(limit: float, size: float, order: float) -> tuple[float, float, float]:
    """Values whose error is `size` on the middle mesh."""
    return limit + size * 2**order, limit + size, limit + size / 2**order


@given(limits, sizes, orders)
def test_a_plausible_order_recovers_the_error(limit: float, size: float, order: float) -> None:
    values = sequence(limit, size, order)
    assert observed_order(*values) == pytest.approx(order, rel=ROUNDING)
    assert mesh_error(*values) == pytest.approx(1.25 * abs(size), rel=ROUNDING)


@given(limits, sizes, st.floats(2.001, 6.0))
def test_a_higher_order_is_not_counted_upon(limit: float, size: float, order: float) -> None:
    found = mesh_error(*sequence(limit, size, order))
    assert found == pytest.approx(1.25 * abs(size) * (2**order - 1) / 3, rel=ROUNDING)
    assert found > 1.25 * abs(size)


@given(limits, sizes, st.floats(0.0, 6.0))
def test_values_on_alternating_sides_are_bounded(limit: float, size: float, order: float) -> None:
    values = limit - size * 2**order, limit + size, limit - size / 2**order
    assert isnan(observed_order(*values))
    assert mesh_error(*values) >= 3 * abs(size)


@given(limits, sizes, st.floats(-3.0, 3.0))
@example(0.0, 1.0, -0.78)  # the two finer values nearly agree, by chance and far from the limit
def test_second_order_with_a_large_next_term_is_bounded(limit: float, size: float, next_term: float) -> None:
    """e = h² + b h⁴ as far from its leading term as a coarse mesh may be, whatever the sequence looks like."""
    coarse, middle, fine = (limit + size * (h**2 + next_term * h**4) for h in (2.0, 1.0, 0.5))
    assert mesh_error(coarse, middle, fine) >= abs(middle - limit) * (1 - ROUNDING) - 1e-12


@given(limits, sizes)
def test_slow_convergence_is_irregular(limit: float, size: float) -> None:
    values = sequence(limit, size, 0.8)
    quantity = QuantityError("Rc", "ohm", values[1], values[0], values[2], values[1])
    assert not quantity.regular
    assert quantity.mesh == pytest.approx(3 * abs(values[1] - values[2]), rel=1e-12)
    assert quantity.mesh >= abs(size)


@given(limits, sizes)
def test_contact_points_of_second_order(limit: float, size: float) -> None:
    assert contact_error(limit + size, limit + size / 4) == pytest.approx(1.25 * abs(size), rel=ROUNDING)


@given(limits, sizes, st.floats(0.5, 6.0), st.sampled_from([-1.0, 2.0**-20, 2.0**20]))
def test_units_do_not_matter(limit: float, size: float, order: float, unit: float) -> None:
    """Powers of two, which round nothing: at orders of 1 and 2 the last bit decides which rule applies."""
    values = sequence(limit, size, order)
    scaled = [unit * value for value in values]
    assert mesh_error(*scaled) == pytest.approx(abs(unit) * mesh_error(*values), rel=ROUNDING)


@pytest.mark.parametrize(
    ("values", "error"),
    [
        ((1.0, 1.0, 1.0), 0.0),
        ((nan, 1.0, 1.1), 0.3),
        ((inf, 1.0, 1.1), 0.3),
        ((1.1, 1.0, nan), nan),
        ((1.1, 1.0, inf), nan),
        ((inf, inf, inf), nan),  # a crossing that does not conduct has no finite Rc
        ((1.3, 1.0, 1.0), 0.125),  # agreement of the last two is not taken for convergence
    ],
)
def test_degenerate_sequences(values: tuple[float, float, float], error: float) -> None:
    assert mesh_error(*values) == pytest.approx(error, rel=1e-12, nan_ok=True)


def test_a_quantity_adds_its_parts() -> None:
    quantity = QuantityError("Fx warp", "N", value=-2.0, coarse=-2.3, fine=-1.9, more_points=-1.97)
    assert quantity.regular
    assert quantity.observed_order == pytest.approx(np.log2(3.0), rel=1e-12)
    assert (quantity.mesh, quantity.contact) == pytest.approx((1.25 * 0.15, 0.05), rel=1e-12)
    assert quantity.absolute == pytest.approx(0.2375, rel=1e-12)
    assert quantity.relative == pytest.approx(0.11875, rel=1e-12)


def test_no_value_has_no_relative_error() -> None:
    assert isnan(QuantityError("I straight", "A", 0.0, 0.0, 0.0, 0.0).relative)


def test_missing_contact_part_leaves_no_total() -> None:
    assert isnan(QuantityError("Rc", "ohm", 1.0, 1.2, 0.95, nan).absolute)


def test_an_estimate_is_locked() -> None:
    estimate = ErrorEstimate("relaxed", (4, 8, 16), (4, 8), np.zeros(3), (), ())
    with pytest.raises(ValueError, match="read-only"):
        estimate.moved[0] = 1.0
