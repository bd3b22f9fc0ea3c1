"""The compressible neo-Hookean material [1]."""

from __future__ import annotations

from circuittex.base.arrays import Floats


def lame(youngs_modulus: Floats, poisson_ratio: Floats) -> tuple[Floats, Floats]:
    """Lamé parameters mu = E / (2 (1 + nu)) and lambda = E nu / ((1 + nu)(1 - 2 nu)), MPa.

    >>> import numpy as np
    >>> lame(np.array([10.0]), np.array([0.25]))
    (array([4.]), array([4.]))
    """
    mu = youngs_modulus / (2 * (1 + poisson_ratio))
    return mu, 2 * mu * poisson_ratio / (1 - 2 * poisson_ratio)


def bending_lambda(mu: Floats, poisson_ratio: Floats) -> Floats:
    """lambda_b = 2 mu nu, MPa: what the section points carry of lambda.

    A section whose points move linearly cannot contract on one side and widen on the other, as Poisson's
    effect in bending asks, so with the full lambda it bends (1 - nu) / ((1 + nu)(1 - 2 nu)) times too
    stiffly. With lambda_b at the section points its bending stiffness is E I again; the remaining
    lambda - lambda_b at one point on the axis restores the axial response.
    """
    return 2 * mu * poisson_ratio
