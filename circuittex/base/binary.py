"""Powers of two: multiplying by them rounds nothing."""

from __future__ import annotations

from math import frexp, ldexp


def power_of_two(size: float) -> float:
    """The largest power of two that does not exceed `size` > 0.

    It follows every power of two by which `size` is multiplied. So what is divided by it before a square root, a
    logarithm or another function is rounded alike at every scale.

    >>> power_of_two(0.15), power_of_two(0.15 * 2**-12) == 0.125 * 2**-12
    (0.125, True)
    """
    return ldexp(1.0, frexp(size)[1] - 1)
