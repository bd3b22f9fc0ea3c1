"""The penalty 'hertz': two crossing cylinders push one another as in Hertz's theory."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from fabrics import fibrils_through, straight
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from circuittex.contact.extract import contact_state
from circuittex.contact.law import effective_modulus
from circuittex.design import HERTZ, ContactLaw
from circuittex.mech.configuration import initial_configuration

LAW = ContactLaw(HERTZ, 0.0, 0.0)
ELEMENTS, POINTS = 400, 20
"""Contact points 50 to an overlap's half length: the midpoint rule errs by far less than what is tested."""
ORDER = 1.0
"""The line law departs from Hertz's by a part that is proportional to o/R: its leading coefficient is below one."""
UNEQUAL = 0.03
"""Radii of one to two: the contact is an ellipse, which the line law knows only through the mean radius."""


def crossing_force(
    overlap: float, radii: tuple[float, float], moduli: tuple[float, float], poisson: tuple[float, float]
) -> float:
    """Force between two straight cylinders that cross at 90 degrees, N."""
    reach = 2.0 * np.sqrt(2 * sum(radii) * overlap)
    lines = [
        straight([-reach, 0, 0], [reach, 0, 0], ELEMENTS),
        straight([0, -reach, sum(radii) - overlap], [0, reach, sum(radii) - overlap], ELEMENTS),
    ]
    mesh = fibrils_through(lines, radius=radii, modulus=moduli, poisson=poisson)
    contacts = contact_state(mesh, initial_configuration(mesh), LAW, per_element=POINTS)
    return float(np.sum(contacts.line_load * contacts.weight))


def star(moduli: tuple[float, float], poisson: tuple[float, float]) -> float:
    one, other = (tuple(map(np.array, pair)) for pair in zip(moduli, poisson, strict=True))
    return float(effective_modulus(one[0], one[1], other[0], other[1]))


def hertz_force(overlap: float, radii: tuple[float, float], modulus: float) -> float:
    """Hertz's point contact of crossed cylinders with its ellipse (Johnson, Contact Mechanics, 1985, 4.26)."""
    a, b = sorted([1 / (2 * radii[0]), 1 / (2 * radii[1])])
    if a == b:
        return 4 / 3 * modulus * np.sqrt(radii[0]) * overlap**1.5

    def ratio(m: float) -> float:  # m: the square of the eccentricity
        return (ellipe(m) / (1 - m) - ellipk(m)) / (ellipk(m) - ellipe(m)) - b / a

    m = brentq(ratio, 1e-9, 1 - 1e-9)
    K, E = ellipk(m), ellipe(m)
    long = np.sqrt(overlap * (K - E) / (a * m * K))
    short = long * np.sqrt(1 - m)
    peak = modulus * overlap / (short * K)
    return float(2 * np.pi * long * short * peak / 3)


@pytest.mark.parametrize(
    ("moduli", "poisson"),
    [((10.0, 10.0), (0.0, 0.0)), ((200e3, 3e3), (0.3, 0.4)), ((0.1, 400e3), (0.45, 0.2))],
    ids=["equal", "steel on nylon", "rubber on carbon"],
)
def test_a_crossing_of_equal_radii_is_hertz_contact(moduli: tuple[float, float], poisson: tuple[float, float]) -> None:
    """F = 4/3 E* sqrt(R) o^(3/2), to the order of o/R: the departure halves with the overlap."""
    R, modulus = 0.15, star(moduli, poisson)
    departures = []
    for part in (0.08, 0.04, 0.02):
        force = crossing_force(part * R, (R, R), moduli, poisson)
        departures.append(force / (4 / 3 * modulus * np.sqrt(R) * (part * R) ** 1.5) - 1)
        assert abs(departures[-1]) < ORDER * part
    for larger, smaller in pairwise(departures):
        assert larger / smaller == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("radii", [(0.15, 0.075), (0.0035, 0.005), (0.5, 0.25)])
def test_a_crossing_of_different_radii(radii: tuple[float, float]) -> None:
    """4/3 E* sqrt((R + R')/2) o^(3/2) to leading order: the mean radius, near Hertz's ellipse."""
    moduli, poisson = (200e3, 3e3), (0.3, 0.4)
    modulus, overlap = star(moduli, poisson), 0.02 * min(radii)
    force = crossing_force(overlap, radii, moduli, poisson)
    assert force == pytest.approx(4 / 3 * modulus * np.sqrt(sum(radii) / 2) * overlap**1.5, rel=ORDER * 0.02)
    assert force == pytest.approx(hertz_force(overlap, radii, modulus), rel=UNEQUAL)


def test_the_ellipse_of_nearly_equal_radii_is_the_circle() -> None:
    """What the force is compared with is right where it is known."""
    assert hertz_force(1e-3, (0.15, 0.15001), 5.0) == pytest.approx(hertz_force(1e-3, (0.15, 0.15), 5.0), rel=1e-4)


def test_another_penalty_is_another_force() -> None:
    """The test can fail: the paper's 5 N/mm2 is twice Hertz's at E = 10 MPa."""
    mesh = fibrils_through([straight([-1, 0, 0], [1, 0, 0], 40), straight([0, -1, 0.29], [0, 1, 0.29], 40)])
    at = initial_configuration(mesh)
    hertz, paper = (
        contact_state(mesh, at, ContactLaw(penalty, 0.0, 0.0), per_element=4).line_load for penalty in (HERTZ, 5.0)
    )
    assert paper == pytest.approx(2 * hertz, rel=1e-15)
