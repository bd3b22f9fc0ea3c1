"""Ranges of whole numbers, one after another."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Ints


def ranges(first: Ints, length: Ints) -> Ints:
    """first, first + 1, ... of each range, one range after another.

    >>> ranges(np.array([5, 0]), np.array([2, 3])).tolist()
    [5, 6, 0, 1, 2]
    """
    return np.repeat(first - np.cumsum(length) + length, length) + np.arange(length.sum())
