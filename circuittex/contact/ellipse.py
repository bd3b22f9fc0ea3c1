"""The ellipse in which two crossing cylinders touch: Hertz's point contact."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import elliprd

from circuittex.base.arrays import Floats
from circuittex.contact.law import effective_radius

SLENDEREST = 1e-12
"""Least of sin^2 of the angle: what is more parallel has a touch whose length something else limits."""
STEPS = 24
"""Each leaves a fifth or less of the error of log(short / long)."""
SLOPE = 1.7
"""Of log(B / A) over log(long / short): from 3/2 for a circle to 2 for a line."""


class Ellipse(NamedTuple):
    """Half-axes of P ellipses."""

    long: Floats
    """(P,) mm."""
    short: Floats
    """(P,) mm."""

    def shortened(self, times: Floats) -> Ellipse:
        """Those of the same force on touches so many times (P,) shorter: line load and square of the width rise."""
        return Ellipse(self.long / times, self.short * np.sqrt(times))

    @property
    def area(self) -> Floats:
        """(P,) mm2."""
        return np.asarray(np.pi * self.long * self.short)


def hertz_ellipse(force: Floats, sine: Floats, radius_a: Floats, radius_b: Floats, modulus: Floats) -> Ellipse:
    """The ellipses (P,) of straight cylinders of radii R, R' (mm) that cross at an angle of the given sine under F (N).

    The gap is A x^2 + B y^2 with A + B = (1/R + 1/R')/2 and A B = sin^2 / (4 R R'), and with k = short / long

        B / A = R_D(0, 1, k^2) / R_D(0, k^2, 1),    long^3 = F R_D(0, k^2, 1) / (2 pi E* A)

    (Johnson, Contact Mechanics, 1985, section 4.2, whose K - E and E/k^2 - K are written by Carlson's R_D so that
    no digits cancel). Equal radii at a right angle touch in a circle of radius (3 F R / (4 E*))^(1/3):

    >>> one = np.ones(1)
    >>> float(hertz_ellipse(4 / 3 * one, one, one, one, one).long.round(12)[0])
    1.0
    """
    scale = effective_radius(radius_a, radius_b)  # R*: all else is a pure number, which no change of scale touches
    one, other = scale / radius_a, scale / radius_b
    square = np.maximum(np.square(sine), SLENDEREST)
    apart = np.sqrt(np.maximum(0.0, 1 - 4 * one * other * square))  # cos 2t = 1 - 2 sin^2 t, and 1/R + 1/R' = 1/R*
    B = (1 + apart) / 4
    A = one * other * square / (4 * B)
    wanted = np.log(B / A)
    log_k = -wanted / SLOPE
    for _ in range(STEPS):
        k2 = np.exp(2 * log_k)
        found = np.log(elliprd(0.0, 1.0, k2) / elliprd(0.0, k2, 1.0))
        log_k = np.minimum(0.0, log_k + (found - wanted) / SLOPE)
    k = np.exp(log_k)
    cube = force / (modulus * scale**2) * elliprd(0.0, k**2, 1.0) / (2 * np.pi * A)
    long = np.cbrt(cube) * scale
    return Ellipse(long, k * long)
