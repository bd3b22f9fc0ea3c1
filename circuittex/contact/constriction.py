"""Radius of the circular spot that constricts a current as much as an ellipse or a strip does, or a touch on a shell.

Two conductors that touch in a circle of radius a add (1/sigma + 1/sigma') / (4 a) to the circuit (Holm, Electric
Contacts, 1967, section 3): this is the a of other shapes, and of shells in which the current has to spread.
"""

from __future__ import annotations

from math import exp, log, pi

import numpy as np
from scipy.special import ellipkm1

from circuittex.base.arrays import Floats
from circuittex.contact.ellipse import Ellipse

SMALL_SPOT, LARGE_SPOT = 4 * exp(-float(np.euler_gamma)), pi / 2 - log(4) / pi
"""Of `spot_on_shell`: the far field of a point source on a sheet (the sum over its mirror images), and that of a large
electrode, which is fed as if it ended t ln 4 / pi within its edge (a conformal map of the half strip)."""


def spot_of_ellipse(ellipse: Ellipse) -> Floats:
    """(P,) mm: the current spreads from an ellipse into a half space through K(m) / (2 pi sigma long), m = 1 - k^2.

    >>> one = np.ones(1)
    >>> float(spot_of_ellipse(Ellipse(one, one))[0])
    1.0
    """
    k = ellipse.short / ellipse.long
    return np.asarray(np.pi / 2 * ellipse.long / ellipkm1(k**2))


def spot_of_strip(length: Floats, half_width: Floats, radius: Floats) -> Floats:
    """(C,) mm: from a strip of half-width b along a length l of a cylinder of radius R the current enters through

        (ln(2 R / b) + 1/8) / (pi sigma l)

    to the axis, whose potential is the mean over the section: u = (r^2 / (4 R^2) - ln|x - x0|) / pi is the plane field
    of a line source on a circle with a sink spread over its inside. Where b reaches R it is taken as R.

    >>> one = np.ones(1)
    >>> float((spot_of_strip(one, one, one) * 4 * (np.log(2) + 1 / 8) / np.pi)[0])
    1.0
    """
    return np.asarray(np.pi / 4 * length / (np.log(2 * radius / np.minimum(half_width, radius)) + 1 / 8))


def spot_on_shell(spot: Floats, mean: Floats, thickness: Floats, radius: Floats) -> Floats:
    """(P,) mm: the same for spots of radius a on the shell of a cylinder of radius R, of thickness t on a core that
    insulates, which resists by

        1 / (4 sigma a) + ln(R / r) / (2 pi sigma t),  r = a + t (c_0 t + c_1 a) / (t + a)

    more than along its axis. Around a point source at z = 0, theta = 0 of a cylinder's surface the potential is
    -ln(2 cosh(z/R) - 2 cos theta) / (4 pi sigma t), and that of the axis -|z| / (4 pi R sigma t), which is what it is
    far away: their difference near the source is ln(R / r) / (2 pi sigma t). Where a is much smaller than t, r is c_0 t
    (a point on a sheet), where it is much larger r is a, as a flat electrode has it, both to first order:
    c_0 = 4 exp(-gamma), c_1 = pi/2 - ln 4 / pi. For ellipses a is
    `spot` in the first place and the `mean` of the half-axes in r: the circle with the same field far away.

    >>> one = np.ones(1)
    >>> thick, thin = (float(spot_on_shell(0.01 * one, 0.01 * one, t * one, one)[0]) for t in (0.4, 1e-5))
    >>> round(thick / 0.01, 3), round(1e5 * thin / 4 * (2 / pi) * log(100), 3)
    (0.998, 0.25)
    """
    reach = mean + thickness * (SMALL_SPOT * thickness + LARGE_SPOT * mean) / (thickness + mean)
    spread = np.log(np.maximum(1.0, radius / reach))
    return np.asarray(spot / (1.0 + 2 / pi * spread * spot / thickness))


def strip_on_shell(length: Floats, half_width: Floats, thickness: Floats, radius: Floats) -> Floats:
    """(C,) mm: the same for strips of half-width b along a length l of it, which resist by

        (pi R / (6 t) f^3 + (ln 2 - ln(1 - exp(-pi b / t))) / pi f^2) / (sigma l),  f = 1 - b / (pi R)

    to the mean of the potential around the section, from which the current leaves evenly: the first part is that of
    the sheet on either side of the strip, the second that of its edges, by a conformal map of the half strip. Where b
    reaches R it is taken as R.

    >>> one = np.ones(1)
    >>> float((1 / (4 * strip_on_shell(one, 0.01 * one, 1e-5 * one, one)) / (pi / 6e-5)).round(2)[0])
    0.99
    """
    b = np.minimum(half_width, radius)
    free = 1 - b / (pi * radius)
    edges = (log(2) - np.log1p(-np.exp(-pi * b / thickness))) / pi
    return np.asarray(length / (4 * free**2 * (pi / 6 * radius / thickness * free + edges)))


def on_core(shell: Floats, bare: Floats, conductivity: Floats) -> Floats:
    """(P,) mm: radius of the spot where the core conducts, too, this much (P,) times as well as the shell.

    Of two that both constrict more than the truth (Rayleigh: less conducts less), on the shell alone and in a half
    space of the lesser of both conductivities, it is the larger: `bare` where core and shell are the same.
    """
    return np.maximum(shell, bare * np.minimum(1.0, conductivity))
