"""Where the fibrils lie within their yarns: the rows of the section, twisted and displaced at random."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.design import Weave, Yarn
from circuittex.design.packing import Packing


@frozen
class Draws:
    """What a seed decides about Y yarns and their fibrils: independent standard normal numbers."""

    twist: Floats
    """(Y,) twist of each yarn over its standard deviation."""
    phase: Floats
    """(Y,) shift of each yarn's wave over its standard deviation."""
    modes: tuple[Floats, Floats]
    """For the warp's and the weft's F fibrils (F, 2, 2 n + 1), n the yarns they cross: amplitudes of each fibril's
    offset across its yarn and vertically, a constant, then n cosines, then n sines."""


def draw(weave: Weave, seed: int) -> Draws:
    """The random numbers of a packing: every yarn has a generator of its own, seeded with `seed` and its number.

    >>> from circuittex.design import plain_weave
    >>> weave = plain_weave(yarns=2).weave
    >>> bool((draw(weave, 7).twist == draw(weave, 7).twist).all()), draw(weave, 7).modes[0].shape
    (True, (20, 2, 5))
    """
    n_warp, n_weft = len(weave.warp), len(weave.weft)
    yarns, modes = [], []
    for number, yarn in enumerate(weave.yarns):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
        yarns.append(rng.standard_normal(2))
        modes.append(rng.standard_normal((yarn.n_fibrils, 2, 1 + 2 * (n_weft if number < n_warp else n_warp))))
    twist, phase = np.array(yarns).T
    return Draws(twist, phase, (np.concatenate(modes[:n_warp]), np.concatenate(modes[n_warp:])))


def places_in_yarn(weave: Weave, packing: Packing, draws: Draws, t: Floats) -> tuple[Floats, Floats]:
    """(F, K, 2) place of each fibril in its yarn, across it and vertically, mm, and its derivative along the yarn.

    The rows of the section, turned by the yarn's twist as a right-handed screw, and displaced by

        d(t) = sigma / sqrt(n + 1) (c + sum_k (a_k cos(pi k t) + b_k sin(pi k t))),  k = 1 .. n

    at `t` from 0 to 1 along the span, (K,) for all or (F, K), with standard normal c, a_k, b_k and n the crossings of
    the yarn. The standard deviation of d is sigma everywhere, and its shortest wave is two pitches long, as the yarn's
    own.
    """
    sigma = np.array([packing.lateral, packing.vertical])
    directions, fibril = [], 0
    # A right-handed screw turns towards the left of one who looks along the yarn: y for the warp, -x for the weft.
    for direction, first, left, modes in zip(
        weave.directions, (0, len(weave.warp)), (1.0, -1.0), draws.modes, strict=True
    ):
        yarns, length = direction.yarns, direction.crossings * direction.step
        turns = left * packing.twist * draws.twist[first : first + len(yarns)]
        rate = 2.0 * np.pi * np.repeat(turns, [yarn.n_fibrils for yarn in yarns])
        own = t if t.ndim == 1 else t[fibril : fibril + len(rate)]
        fibril += len(rate)
        place, slope = _turned(np.concatenate([section_offsets(yarn) for yarn in yarns]), rate, length * (own - 0.5))
        offset, offset_slope = _waves(modes, own)
        directions.append((place + sigma * offset, slope + sigma * offset_slope / length))
    places, slopes = zip(*directions, strict=True)
    return np.concatenate(places), np.concatenate(slopes)


def _turned(section: Floats, rate: Floats, s: Floats) -> tuple[Floats, Floats]:
    """(F, K, 2) places `section` (F, 2) turned by `rate` (F,) times `s` (K,) or (F, K), and the derivative with s."""
    angle = rate[:, None] * s
    cosine, sine = np.cos(angle), np.sin(angle)
    across, height = section[:, :1], section[:, 1:]
    turned = np.stack([across * cosine - height * sine, across * sine + height * cosine], axis=-1)
    return turned, rate[:, None, None] * np.stack([-turned[..., 1], turned[..., 0]], axis=-1)


def _waves(modes: Floats, t: Floats) -> tuple[Floats, Floats]:
    """(F, K, 2) displacements of unit standard deviation with amplitudes `modes`, and their derivative with t."""
    n = (modes.shape[-1] - 1) // 2
    wave = np.pi * np.arange(1, n + 1)
    cosine, sine = np.cos(wave * t[..., None]), np.sin(wave * t[..., None])
    values = np.concatenate([np.ones((*t.shape, 1)), cosine, sine], axis=-1)
    slopes = np.concatenate([np.zeros((*t.shape, 1)), -wave * sine, wave * cosine], axis=-1)
    sums = "km,fcm->fkc" if t.ndim == 1 else "fkm,fcm->fkc"
    offset, slope = (np.einsum(sums, table, modes) / np.sqrt(n + 1.0) for table in (values, slopes))
    return offset, slope


def section_offsets(yarn: Yarn) -> Floats:
    """(n, 2) lateral and vertical place of each fibril in the section of its yarn, mm, row by row from below.

    >>> from circuittex.design import plain_weave
    >>> section_offsets(plain_weave(rows=(1, 2)).weave.warp[0])
    array([[ 0.  , -0.15],
           [-0.15,  0.15],
           [ 0.15,  0.15]])
    """
    heights = centred(len(yarn.rows)) * yarn.row_spacing
    lateral = np.concatenate([centred(n) * yarn.spacing for n in yarn.rows])
    return np.column_stack([lateral, np.repeat(heights, yarn.rows)])


def centred(n: int) -> Floats:
    """n numbers one apart, about zero.

    >>> centred(3)
    array([-1.,  0.,  1.])
    """
    return np.arange(n, dtype=np.float64) - (n - 1) / 2.0
