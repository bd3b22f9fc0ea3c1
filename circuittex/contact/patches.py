"""Which contact points make up one touch of two fibrils, and what that touch is as a whole: force, angle, length."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from circuittex.base.arrays import Floats, Ints

REACH = 1.5
"""Points of one touch follow one another within this many spacings of the contact points on both fibrils."""
PARABOLA = 6 / 5
"""Length of a touch over (∫ p)^2 / ∫ p^2 where the load falls off as a parabola; 1 where it is even."""


class Patches(NamedTuple):
    """The P touches of a contact state."""

    patch: Ints
    """(C,) the touch to which each contact point belongs."""
    share: Floats
    """(C,) part of its force that each point carries."""
    force: Floats
    """(P,) F = sum p w, N: both fibrils carry points, with half weight."""
    sine: Floats
    """(P,) sine of the angle between the two axes, root of the mean square over the load."""
    length: Floats
    """(P,) mm of axis: 6/5 (∫ p)^2 / ∫ p^2, the length along which straight fibrils overlap where they cross."""


def patch_of(pair: Ints, xi: Floats, spacing: Floats) -> Ints:
    """The touch (C,) of each contact point, numbered from 0.

    pair (C,) numbers the pairs of fibrils; xi (C, 2) mm are the places on either, in the same order for all points of a
    pair; spacing (C,) mm that of the contact points. Points are of one touch that follow one another on both fibrils.

    >>> patch_of(np.zeros(3, int), np.array([[0.0, 0.0], [0.1, 0.1], [0.9, 0.9]]), np.full(3, 0.1)).tolist()
    [0, 0, 1]
    """
    n = len(pair)
    if not n:
        return np.zeros(0, dtype=np.int64)
    at = xi / (REACH * spacing)[:, None]
    apart = np.column_stack([at, pair * 2.0])
    near = cKDTree(apart).query_pairs(1.0, p=np.inf, output_type="ndarray")
    graph = coo_array((np.ones(len(near)), (near[:, 0], near[:, 1])), shape=(n, n))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def patches(patch: Ints, load: Floats, weight: Floats, square: Floats) -> Patches:
    """The touches of contact points with loads p (C,) N/mm, weights w (C,) mm, sin^2 of the angle (C,) there."""
    carried = load * weight
    force, turned, dense = (of_patches(patch, each) for each in (carried, carried * square, carried * load))
    return Patches(
        patch=patch,
        share=carried / force[patch],
        force=force,
        sine=np.sqrt(turned / force),
        length=PARABOLA * (force / dense) * force,
    )


def of_patches(patch: Ints, values: Floats) -> Floats:
    """Sum (P,) of values (C,) over the points of each touch."""
    return np.asarray(np.bincount(patch, values), dtype=np.float64)
