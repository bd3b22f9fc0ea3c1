"""Radius of the circular spot that constricts a current as much as an ellipse or a strip does.

Two conductors that touch in a circle of radius a add (1/sigma + 1/sigma') / (4 a) to the circuit (Holm, Electric
Contacts, 1967, section 3): this is the a of other shapes.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ellipkm1

from circuittex.base.arrays import Floats
from circuittex.contact.ellipse import Ellipse


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
