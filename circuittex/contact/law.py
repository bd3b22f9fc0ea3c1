"""Contact laws: Hertz width of two parallel cylinders [29]."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats


def effective_modulus(e1: Floats, nu1: Floats, e2: Floats, nu2: Floats) -> Floats:
    """E*, MPa: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2."""
    return 1 / ((1 - nu1**2) / e1 + (1 - nu2**2) / e2)


def hertz_penalty(modulus: Floats) -> Floats:
    """P* = E*/2, N/mm2: with it two equal cylinders that cross at 90 degrees press one another as in Hertz's theory.

    Both give F = 4/3 E* sqrt(R) o^(3/2) to the leading order in o / R (`docs/model.md`).
    """
    return modulus / 2


def effective_radius(r1: Floats, r2: Floats) -> Floats:
    """R*, mm: 1/R* = 1/R1 + 1/R2."""
    return 1 / (1 / r1 + 1 / r2)


def hertz_width(line_load: Floats, radius: Floats, modulus: Floats) -> Floats:
    """Contact width a = sqrt(4 R* p / (pi E*)) [29], mm, for a line load p in N/mm.

    This is what the paper calls the differential thickness of the contact; in Hertz's theory it is the
    half-width of the strip.

    >>> import numpy as np
    >>> float(hertz_width(np.array(np.pi), np.array(1.0), np.array(4.0)))
    1.0
    """
    return np.asarray(np.sqrt(4 * radius * line_load / (np.pi * modulus)))
