"""The Hertz law against published values and its limits."""

from __future__ import annotations

import numpy as np
import pytest

from circuittex.contact.law import effective_modulus, effective_radius, hertz_width

# Benchmark "hertz line": two steel cylinders of radius 10 mm, E = 206 GPa, nu = 0.3, P = 1e5 N/m;
# b = sqrt(4 P R / (pi E*)), p0 = sqrt(P E* / (pi R)). Five digits are published.
RADIUS, MODULUS, POISSON, LOAD = 10.0, 206e3, 0.3, 100.0
HALF_WIDTH, PEAK_PRESSURE = 74.997e-3, 848.86
DIGITS = 1e-5


def steel_width() -> float:
    radius = effective_radius(np.array(RADIUS), np.array(RADIUS))
    modulus = effective_modulus(np.array(MODULUS), np.array(POISSON), np.array(MODULUS), np.array(POISSON))
    return float(hertz_width(np.array(LOAD), radius, modulus))


def test_width_of_the_published_line_contact() -> None:
    assert steel_width() == pytest.approx(HALF_WIDTH, rel=DIGITS)


def test_peak_pressure_of_the_published_line_contact() -> None:
    """The load is the area under the half ellipse of pressure over the width on either side: P = pi/2 b p0."""
    assert 2 * LOAD / (np.pi * steel_width()) == pytest.approx(PEAK_PRESSURE, rel=DIGITS)


def test_a_rigid_partner_leaves_the_modulus_of_the_other() -> None:
    e, nu = np.array(10.0), np.array(0.3)
    assert effective_modulus(e, nu, np.array(1e300), np.array(0.0)) == pytest.approx(10.0 / 0.91, rel=1e-15)


def test_a_flat_partner_leaves_the_radius_of_the_other() -> None:
    assert effective_radius(np.array(0.15), np.array(1e300)) == pytest.approx(0.15, rel=1e-15)


def test_partners_may_be_swapped() -> None:
    e, nu = np.array([10.0, 200.0]), np.array([0.1, 0.4])
    assert np.array_equal(effective_modulus(e, nu, e[::-1], nu[::-1]), effective_modulus(e[::-1], nu[::-1], e, nu))
    assert np.array_equal(effective_radius(e, e[::-1]), effective_radius(e[::-1], e))


def test_width_grows_with_the_root_of_the_load_and_vanishes_without() -> None:
    load = np.array([0.0, 1.0, 4.0])
    width = hertz_width(load, np.array(0.075), np.array(5.0))
    assert width[0] == 0.0
    assert width[2] == pytest.approx(2 * width[1], rel=1e-15)
