"""Quadrature over a circular section."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats


def disk_rule(degree: int) -> tuple[Floats, Floats]:
    """Points and weights of a rule on the unit disk that is exact for polynomials up to `degree`.

    A Gauss-Legendre rule in the squared radius times equally spaced angles: with n >= degree + 1 angles
    every trigonometric term up to `degree` integrates exactly, and what remains is a polynomial of
    degree floor(degree / 2) in the squared radius. Degree 3 gives the four-point rule of the paper's code.

    Returns points (S, 2) in the unit disk and weights (S,) that sum to 1, that is, to the section's area
    once multiplied by it.

    >>> points, weights = disk_rule(3)
    >>> len(weights), round(float((weights * points[:, 0] ** 2).sum()), 12)
    (4, 0.25)
    """
    radial = (degree // 2 + 2) // 2
    t, w = np.polynomial.legendre.leggauss(radial)
    radius, w = np.sqrt((t + 1) / 2), w / 2
    angle = 2 * np.pi * np.arange(degree + 1) / (degree + 1)
    direction = np.round(np.stack([np.cos(angle), np.sin(angle)], axis=1), 16)
    points = (radius[:, None, None] * direction).reshape(-1, 2)
    return points, np.repeat(w / (degree + 1), degree + 1)
