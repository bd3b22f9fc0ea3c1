"""The initial centre lines and directors of a weave's fibrils, in closed form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.design import Weave
from circuittex.design.packing import Packing
from circuittex.design.wave import Wave, cosine
from circuittex.design.yarn import PATH
from circuittex.geometry.natural import FINER, PARTS, along_directions, equal_arcs, lessened
from circuittex.geometry.packing import Draws, centred, draw, places_in_yarn


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
    natural: Floats
    """(F, K, 3, 3) r, mm, g1 and g2 of the natural shapes; empty where all are straight."""


def centre_lines(weave: Weave, n_places: int, packing: Packing = Packing()) -> CentreLines:  # noqa: B008 (frozen)
    """Centre lines and directors at `n_places` equally spaced places on every fibril.

    r(xi3) = yarn axis(s) + lateral offset + row offset with s = xi3 - L/2. The row offset is vertical, as in
    the paper's start, so rows come closer than their spacing where the yarn rises. The natural length L is
    that of the straight yarn, crossings times the pitch of what it crosses; the clamped wave is longer, so fibrils
    start in tension. Fibrils with a natural length or shape of their own (`Yarn.crimp`, `Yarn.heat_set`) have their
    places at equal lengths along the path instead, so that they start evenly stretched.
    `packing` shifts the waves of the yarns and moves the fibrils within them, see `places_in_yarn`.

    >>> from circuittex.design import plain_weave
    >>> centre_lines(plain_weave().weave, 5).position.shape
    (80, 5, 3)
    """
    fibrils = [kind.n_fibrils for kind in weave.yarns]
    yarn = np.repeat(np.arange(len(weave.yarns)), fibrils)
    warps, wefts = weave.directions
    span = np.where(yarn < len(weave.warp), warps.crossings * warps.step, wefts.crossings * wefts.step)
    path = _Path(weave, packing, draw(weave, packing.seed), yarn, span)
    t, length, natural = np.linspace(0.0, 1.0, n_places), span, np.empty((0, n_places, 3, 3))
    if any(kind.crimp or kind.heat_set for kind in weave.yarns):
        t, length, natural = _natural(path, n_places)
    position, across, slope = path.at(t)
    xi = length[:, None] * np.linspace(0.0, 1.0, n_places)
    return CentreLines(yarn, length, xi, position, _directors(across, slope, path.along_x), natural)


class _Path(NamedTuple):
    """Where the fibrils of a weave run, in closed form."""

    weave: Weave
    packing: Packing
    draws: Draws
    yarn: Ints
    """(F,)."""
    span: Floats
    """(F,) from end to end, mm."""

    @property
    def along_x(self) -> NDArray[np.bool_]:
        """(F, 1) whether it is a fibril of the warp."""
        return (self.yarn < len(self.weave.warp))[:, None]

    def at(self, t: Floats) -> tuple[Floats, Floats, Floats]:
        """(F, K, 3) positions at t, (K,) or (F, K), from 0 to 1 along the span, and the slopes (F, K) across and up."""
        weave, packing, draws = self.weave, self.packing, self.draws
        s = self.span[:, None] * t - self.span[:, None] / 2.0
        offset, offset_slope = places_in_yarn(weave, packing, draws, t)
        axes = np.concatenate([each.pitch * centred(len(each.yarns)) for each in weave.directions])
        across = axes[self.yarn][:, None] + offset[..., 0]
        height, slope = _axis_heights(weave, self.yarn, s - packing.phase * draws.phase[self.yarn][:, None])
        position = _in_space(self.along_x, s, across, height + offset[..., 1])
        return position, offset_slope[..., 0], slope + offset_slope[..., 1]


def _in_space(along_x: NDArray[np.bool_], along: Floats, across: Floats, up: Floats) -> Floats:
    """(F, K, 3) points of a warp's or weft's fibrils."""
    return np.stack([np.where(along_x, along, across), np.where(along_x, across, along), up], axis=-1)


def _natural(path: _Path, places: int) -> tuple[Floats, Floats, Floats]:
    """Places t (F, K) along the span, natural lengths (F,) and shapes (F, K, 3, 3) that the yarns ask for.

    A shape is the woven one with the angle between direction and yarn axis times `heat_set`; `heat_set` = 1 is the
    woven path itself, and to the last bit where it is as long.
    """
    kinds, yarn, span = path.weave.yarns, path.yarn, path.span
    crossings = max(len(path.weave.warp), len(path.weave.weft))
    _, across, slope = path.at(np.linspace(0.0, 1.0, 2 * PARTS * crossings + 1))
    t, woven = equal_arcs(np.sqrt(1.0 + across**2 + slope**2), span, FINER * (places - 1) + 1)
    stated = np.array([0.0 if isinstance(kind.crimp, str) else kind.crimp for kind in kinds])[yarn]
    as_path = np.array([kind.crimp == PATH for kind in kinds])[yarn]
    length = np.where(as_path, woven, (1.0 + stated) * span)
    part = np.array([kind.heat_set for kind in kinds])[yarn]
    plain = ~as_path & (stated == 0.0) & (part == 0.0)
    t = np.where(plain[:, None], np.linspace(0.0, 1.0, t.shape[1]), t)
    if not part.any():
        return t[:, ::FINER], length, np.empty((0, places, 3, 3))
    start, across, slope = path.at(t)
    less_across, less_slope = lessened(across, slope, part[:, None])
    curve = along_directions(less_across, less_slope, length)
    whole = (part == 1.0)[:, None, None]
    position = np.where(
        whole,
        start[:, ::FINER] * (length / woven)[:, None, None],
        _in_space(path.along_x, curve[..., 0], curve[..., 1], curve[..., 2]),
    )
    directors = _directors(less_across[:, ::FINER], less_slope[:, ::FINER], path.along_x)
    exact = _directors(across[:, ::FINER], slope[:, ::FINER], path.along_x)
    directors = np.where(whole[..., None], exact, directors)
    return t[:, ::FINER], length, np.concatenate([position[:, :, None], directors], axis=2)


def yarn_height(u: Floats, sides: Ints, wave: Wave = cosine) -> tuple[Floats, Floats]:
    """Height of yarn axes over their amplitude, and its derivative, at places `u` counted in crossings.

    Crossing j lies at u = j; `sides` (n, crossings) holds +1 (over) or -1 (under); `u` has shape (n, k).
    Between neighbouring crossings on sides a and b the axis is half a wave, by default a cosine,

        z = (a + b)/2 + (a - b)/2 cos(pi (u - j)),

    hence constant along a float. Before the first and after the last crossing it continues as if the next
    yarn lay on the other side, which brings it to z = 0 half a pitch further on, at the edge of the cell.
    A 1/1 weave is the sine of the paper throughout, or Peirce's geometry.

    >>> yarn_height(np.array([[0.0, 0.5, 1.0]]), np.array([[1, -1]]))[0].round(12) + 0.0
    array([[ 1.,  0., -1.]])
    """
    padded = np.concatenate([-sides[:, :1], sides, -sides[:, -1:]], axis=1).astype(np.float64)
    j = np.clip(np.floor(u).astype(np.int64), -1, sides.shape[1] - 1)
    a, b = np.take_along_axis(padded, j + 1, axis=1), np.take_along_axis(padded, j + 2, axis=1)
    height, slope = wave(u - j)
    return (a + b) / 2 + (a - b) / 2 * height, (a - b) / 2 * slope


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
        height, slope = yarn_height(from_first, sides, weave.wave(direction))
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
