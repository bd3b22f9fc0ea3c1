"""The initial centre lines and directors of a weave's fibrils, in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.design import Weave
from circuittex.design.packing import Packing
from circuittex.geometry.packing import centred, draw, places_in_yarn


@frozen
class CentreLines:
    """F fibrils sampled at K places each: the warp's yarns first, each fibril after fibril."""

    yarn: Ints
    """(F,) yarn of each fibril."""
    length: Floats
    """(F,) natural length, mm."""
    xi: Floats
    """(F, K) axis coordinate from 0 to the natural length, mm."""
    position: Floats
    """(F, K, 3) r, mm."""
    directors: Floats
    """(F, K, 2, 3) unit directors g1, g2."""


def centre_lines(weave: Weave, n_places: int, packing: Packing = Packing()) -> CentreLines:  # noqa: B008 (frozen)
    """Centre lines and directors at `n_places` equally spaced places on every fibril.

    r(xi3) = yarn axis(s) + lateral offset + row offset with s = xi3 - L/2. The row offset is vertical, as in
    the paper's start, so rows come closer than their spacing where the yarn rises. The natural length L is
    that of the straight yarn, crossings times the pitch of what it crosses; the clamped wave is longer, so fibrils
    start in tension.
    `packing` shifts the waves of the yarns and moves the fibrils within them, see `places_in_yarn`.

    >>> from circuittex.design import plain_weave
    >>> centre_lines(plain_weave().weave, 5).position.shape
    (80, 5, 3)
    """
    fibrils = [kind.n_fibrils for kind in weave.yarns]
    yarn = np.repeat(np.arange(len(weave.yarns)), fibrils)
    along_x = yarn < len(weave.warp)
    warps, wefts = weave.directions
    length = np.where(along_x, warps.crossings * warps.step, wefts.crossings * wefts.step)
    t = np.linspace(0.0, 1.0, n_places)
    xi = length[:, None] * t
    s = xi - length[:, None] / 2.0
    draws = draw(weave, packing.seed)
    offset, offset_slope = places_in_yarn(weave, packing, draws, t)
    axes = np.concatenate([each.pitch * centred(len(each.yarns)) for each in weave.directions])
    across = axes[yarn][:, None] + offset[..., 0]
    height, slope = _axis_heights(weave, yarn, s - packing.phase * draws.phase[yarn][:, None])
    warp = along_x[:, None]
    position = np.stack([np.where(warp, s, across), np.where(warp, across, s), height + offset[..., 1]], axis=-1)
    directors = _directors(offset_slope[..., 0], slope + offset_slope[..., 1], warp)
    return CentreLines(yarn, length, xi, position, directors)


def yarn_height(u: Floats, sides: Ints) -> tuple[Floats, Floats]:
    """Height of yarn axes over their amplitude, and its derivative, at places `u` counted in crossings.

    Crossing j lies at u = j; `sides` (n, crossings) holds +1 (over) or -1 (under); `u` has shape (n, k).
    Between neighbouring crossings on sides a and b the axis is a half cosine,

        z = (a + b)/2 + (a - b)/2 cos(pi (u - j)),

    hence constant along a float. Before the first and after the last crossing it continues as if the next
    yarn lay on the other side, which brings it to z = 0 half a pitch further on, at the edge of the cell.
    A 1/1 weave is the sine of the paper throughout.

    >>> yarn_height(np.array([[0.0, 0.5, 1.0]]), np.array([[1, -1]]))[0].round(12) + 0.0
    array([[ 1.,  0., -1.]])
    """
    padded = np.concatenate([-sides[:, :1], sides, -sides[:, -1:]], axis=1).astype(np.float64)
    j = np.clip(np.floor(u).astype(np.int64), -1, sides.shape[1] - 1)
    a, b = np.take_along_axis(padded, j + 1, axis=1), np.take_along_axis(padded, j + 2, axis=1)
    phase = np.pi * (u - j)
    return (a + b) / 2 + (a - b) / 2 * np.cos(phase), -np.pi * (a - b) / 2 * np.sin(phase)


def _axis_heights(weave: Weave, yarn: Ints, s: Floats) -> tuple[Floats, Floats]:
    """(F, K) height z and slope dz/ds of the yarn axis along each fibril."""
    over: Ints = 2 * np.array(weave.draft, dtype=np.int64) - 1
    n_warp = len(weave.warp)
    split = int(np.searchsorted(yarn, n_warp))  # the warp's fibrils come first
    heights, slopes = [], []
    for direction, places, sides in zip(
        weave.directions, (s[:split], s[split:]), (over[yarn[:split]], -over.T[yarn[split:] - n_warp]), strict=True
    ):
        from_first: Floats = places / direction.step + (direction.crossings - 1) / 2.0
        height, slope = yarn_height(from_first, sides)
        heights.append(direction.amplitude * height)
        slopes.append(direction.amplitude * (slope / direction.step))
    return np.concatenate(heights), np.concatenate(slopes)


def _directors(across: Floats, slope: Floats, along_x: NDArray[np.bool_]) -> Floats:
    """(F, K, 2, 3) unit directors turned with the tangent t: g1 horizontal, g2 = t x g1, det[g1 g2 t] = 1.

    `across` and `slope` (F, K) are the derivatives of the centre line's place across the yarn and of its height.
    """
    # The left of one who looks along the yarn: y for the warp, -x for the weft. 0.0 - x makes no negative zero.
    left = np.where(along_x, across, 0.0 - across)
    flat = 1.0 / np.sqrt(1.0 + left**2)
    up = flat / np.sqrt(1.0 + left**2 + slope**2)
    g1 = 0.0 - left * flat, flat
    g2 = -slope * up, 0.0 - left * slope * up
    directors: Floats = np.zeros((*slope.shape, 2, 3))
    for number, (along, sideways) in enumerate((g1, g2)):
        directors[..., number, 0] = np.where(along_x, along, 0.0 - sideways)
        directors[..., number, 1] = np.where(along_x, sideways, along)
    directors[..., 1, 2] = (1.0 + left**2) * up
    return directors
