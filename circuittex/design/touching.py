"""How high the yarns of a weave must rise for none to start inside another."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.design.checks import refuse
from circuittex.design.wave import SINE, peirce
from circuittex.design.yarn import Yarn

AUTO = "auto"
"""Stands for the amplitude that this finds."""
_APART = 1.001
"""Distance of fibrils over R + R': what sampling the curves at 41 places misses of it is 3e-4 at most."""
_PLACES, _HEIGHTS, _HALVINGS = 41, 64, 40


def touching_amplitude(
    warp: Sequence[Yarn], weft: Sequence[Yarn], pitch: float, weft_pitch: float, path: str = SINE
) -> float:
    """The smallest height H (mm) of all yarn axes over the mid-plane with which warp and weft fibrils do not overlap.

    Near a crossing a warp fibril at y runs at z = H cos(pi s / p_weft) + z_warp, a weft fibril at x at
    z = -H cos(pi t / p_warp) + z_weft, z_warp and z_weft their places in their yarns; none of any two may come closer
    than R + R'. Fibrils beside the middle of a yarn need more height than half of both thicknesses, since the yarn
    over them has begun to fall. With the `path` of Peirce the waves are his, about axes 2 H apart.

    Raises `DesignError` where no height keeps them apart.

    >>> from circuittex.design import plain_weave
    >>> yarn = plain_weave(rows=(1,)).weave.warp[0]
    >>> round(touching_amplitude([yarn], [yarn], 4.0, 4.0), 3)  # about R
    0.15
    """
    pairs = list(product(_distinct(warp), _distinct(weft)))
    most = min(pitch, weft_pitch)
    heights = most * np.arange(_HEIGHTS + 1) / _HEIGHTS
    reached = next((k for k, H in enumerate(heights) if _apart(H, pairs, pitch, weft_pitch, path)), None)
    if reached is None:
        raise refuse("weave.amplitude", AUTO, "the yarns are too thick for their pitch: no height keeps them apart")
    if reached == 0:
        return 0.0
    low, high = heights[reached - 1], heights[reached]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        low, high = (low, middle) if _apart(middle, pairs, pitch, weft_pitch, path) else (middle, high)
    return float(high)


def _distinct(yarns: Sequence[Yarn]) -> list[Yarn]:
    return list({yarn.name: yarn for yarn in yarns}.values())


def _apart(H: float, pairs: list[tuple[Yarn, Yarn]], pitch: float, weft_pitch: float, path: str) -> bool:
    """Whether at this height the fibrils of all pairs of crossing yarns keep their distance."""
    return all(
        _gap(H, over, under, pitch, weft_pitch, path) >= _APART * (over.radius + under.radius) for over, under in pairs
    )


def _gap(H: float, over: Yarn, under: Yarn, pitch: float, weft_pitch: float, path: str) -> float:
    """Smallest distance of the centre lines of a warp yarn over a weft yarn, mm."""
    (y, low), (x, high) = _rim(over, -1.0), _rim(under, 1.0)
    reach = np.linspace(-1.0, 1.0, _PLACES) * (over.radius + under.radius)
    s, t = x[:, None] + reach, y[:, None] + reach  # (weft fibrils, places), (warp fibrils, places)
    # (warp fibrils, weft fibrils, places along the warp fibril, places along the weft fibril)
    above = low[:, None, None, None] + H * _crest(H, s, weft_pitch, path)[None, :, :, None]
    below = high[None, :, None, None] - H * _crest(H, t, pitch, path)[:, None, None, :]
    climb = above - below
    distance: Floats = np.sqrt(reach[:, None] ** 2 + reach**2 + climb**2)
    sides = np.sign(climb[:, :, _PLACES // 2, _PLACES // 2])  # a fibril on the wrong side is no distance away
    return float((distance.min(axis=(2, 3)) * sides).min())


def _crest(H: float, s: Floats, spacing: float, path: str) -> Floats:
    """Height over H at s (mm) from a crest, of a wave with its next crossing `spacing` away."""
    if path == SINE or H == 0.0:
        return np.asarray(np.cos(np.pi * s / spacing))
    part = np.abs(s) / spacing
    return peirce(spacing, H, 2.0 * H).at(np.minimum(part % 2.0, 2.0 - part % 2.0))[0]


def _rim(yarn: Yarn, side: float) -> tuple[Floats, Floats]:
    """Across and height of the lowest (side -1) or highest (+1) fibrils at each place across a yarn, mm."""
    across = np.concatenate([yarn.spacing * (np.arange(n) - (n - 1) / 2.0) for n in yarn.rows])
    height = np.repeat(yarn.row_spacing * (np.arange(len(yarn.rows)) - (len(yarn.rows) - 1) / 2.0), yarn.rows)
    places, column = np.unique(across.round(12), return_inverse=True)
    rim = np.full(len(places), -np.inf)
    np.maximum.at(rim, column, side * height)
    return places, side * rim
