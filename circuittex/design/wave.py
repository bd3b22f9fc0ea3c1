"""The wave of a yarn's axis from crest to trough: the paper's cosine, or Peirce's arcs and straight pieces."""

from __future__ import annotations

from collections.abc import Callable
from math import asin, atan2, hypot

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen

SINE, PEIRCE = "sine", "peirce"
PATHS = (SINE, PEIRCE)
"""Ways of a yarn's axis from crossing to crossing."""
Wave = Callable[[Floats], tuple[Floats, Floats]]
"""Height over the amplitude at parts of the way from crest (0) to trough (1), and its derivative."""


def cosine(part: Floats) -> tuple[Floats, Floats]:
    """The paper's: cos(pi part).

    >>> cosine(np.array([0.0, 0.5, 1.0]))[0].round(12) + 0.0
    array([ 1.,  0., -1.])
    """
    phase = np.pi * part
    return np.cos(phase), -np.pi * np.sin(phase)


@frozen
class Arcs:
    """Peirce's flexible thread from one crossing to the next (Journal of the Textile Institute 28, T45, 1937).

    With the sum D of the two diameters, the height h of the wave, the spacing p of the threads that it crosses, the
    weave angle theta and the thread's length l between crossings:
    p = (l - D theta) cos theta + D sin theta, h = (l - D theta) sin theta + D (1 - cos theta).
    """

    angle: float
    """theta."""
    straight: float
    """l - D theta, mm; negative where the threads are jammed."""
    radius: float
    """D/2, of the axis about the thread that it crosses, mm."""
    height: float
    """h/2, mm."""
    spacing: float
    """p, mm."""

    @property
    def length(self) -> float:
        """l, mm."""
        return self.straight + 2.0 * self.radius * self.angle

    def at(self, part: Floats) -> tuple[Floats, Floats]:
        """Height over h/2 from crest (part 0) to trough (1), and its derivative with `part`.

        >>> arcs = peirce(2.0, 0.15, 0.3)
        >>> arcs.at(np.array([0.0, 0.5, 1.0]))[0].round(12).tolist()
        [1.0, 0.0, -1.0]
        """
        x = self.spacing * part
        near = np.minimum(x, self.spacing - x)  # from the nearer of the two
        foot = self.radius * np.sin(self.angle)
        root = np.sqrt(self.radius**2 - np.minimum(near, foot) ** 2)
        fall = self.radius - root + np.tan(self.angle) * np.maximum(near - foot, 0.0)
        height = np.where(x <= self.spacing / 2.0, 1.0, -1.0) * (self.height - fall)
        slope = -np.where(near <= foot, np.minimum(near, foot) / root, np.tan(self.angle))
        return height / self.height, slope * self.spacing / self.height


def peirce(spacing: float, amplitude: float, apart: float) -> Arcs:
    """The thread with waves of height 2 `amplitude` whose axis is bent about threads `apart` = D/2 from it, mm.

    Without l the two equations are p sin theta + (D - h) cos theta = D.

    >>> arcs = peirce(2.0, 0.15, 0.3)
    >>> D, t = 0.6, arcs.angle
    >>> p = (arcs.length - D * t) * np.cos(t) + D * np.sin(t)
    >>> h = (arcs.length - D * t) * np.sin(t) + D * (1 - np.cos(t))
    >>> round(float(p), 12), round(float(h), 12)
    (2.0, 0.3)
    """
    D, h = 2.0 * apart, 2.0 * amplitude
    angle = asin(min(1.0, D / hypot(spacing, D - h))) - atan2(D - h, spacing)
    straight = (spacing - D * np.sin(angle)) / np.cos(angle)
    return Arcs(angle, float(straight), apart, amplitude, spacing)
