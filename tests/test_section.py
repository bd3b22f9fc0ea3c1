"""The disk rule against the moments of the unit disk in closed form."""

from __future__ import annotations

from math import gamma, pi

import numpy as np
import pytest

from circuittex.mech.section import disk_rule

DEGREES = range(1, 10)


def mean_of_monomial(a: int, b: int) -> float:
    """Mean of x^a y^b over the unit disk: 2 G((a+1)/2) G((b+1)/2) / (pi (a + b + 2) G((a+b+2)/2)), 0 for odd powers."""
    if a % 2 or b % 2:
        return 0.0
    return 2 * gamma((a + 1) / 2) * gamma((b + 1) / 2) / (pi * (a + b + 2) * gamma((a + b + 2) / 2))


def error(degree: int, power: int) -> float:
    """Largest error of the rule of a degree over all monomials of one total power."""
    points, weights = disk_rule(degree)
    return max(
        abs(weights @ (points[:, 0] ** a * points[:, 1] ** (power - a)) - mean_of_monomial(a, power - a))
        for a in range(power + 1)
    )


def test_closed_form_knows_the_polar_moment() -> None:
    assert mean_of_monomial(0, 0) == pytest.approx(1.0, rel=1e-15)
    assert mean_of_monomial(2, 0) + mean_of_monomial(0, 2) == pytest.approx(0.5, rel=1e-15)


@pytest.mark.parametrize("degree", DEGREES)
def test_rule_is_exact_up_to_its_degree_and_no_further(degree: int) -> None:
    assert max(error(degree, power) for power in range(degree + 1)) < 1e-15
    assert error(degree, degree + 1) > 1e-4


@pytest.mark.parametrize("degree", DEGREES)
def test_points_are_inside_and_weights_positive(degree: int) -> None:
    points, weights = disk_rule(degree)
    assert np.all(np.linalg.norm(points, axis=1) < 1)
    assert np.all(weights > 0)


def test_degree_three_is_the_four_point_rule() -> None:
    """Four points at R / sqrt 2, as in the paper's code."""
    points, weights = disk_rule(3)
    assert weights == pytest.approx(np.full(4, 0.25))
    assert np.linalg.norm(points, axis=1) == pytest.approx(np.full(4, 0.5**0.5))
