"""How fine a mesh must be for its fibrils: elements that follow their bends, contact points that see their contacts.

Estimated before anything is computed, from the initial wave of a yarn, z = H sin(pi s / p), fibril by fibril:

* the wave is longer than the span by eps = (pi H / p)^2 / 4, so that a fibril pulls with T = E A eps and leaves a
  crossing at the slope pi H / p: it presses on what it crosses with N = 2 T pi H / p;
* two cylinders of the mean radius R that cross under N overlap by o with N = 8/3 P* sqrt(R) o^(3/2), and touch over
  2 s = 4 sqrt(R o) of either axis (docs/model.md);
* a bend fades over sqrt(E I / T) = R / (2 sqrt(eps)) along a fibril in tension, but no faster than over its thickness.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil, pi, sqrt

from circuittex.base.frozen import frozen
from circuittex.design.contact import HERTZ, ContactLaw, ContactProperties
from circuittex.design.weave import Weave
from circuittex.design.yarn import Material, Yarn

POINTS = 20
"""Contact points across the length of a contact: with fewer the resistance of a crossing is off by more than 1 %,
measured on copper of 25 um."""
BENDS = 2
"""Quadratic elements in the length over which a bend fades; linear ones need twice as many."""
LEAST = 5
"""Elements from one crossing to the next."""
MOST_POINTS = 20
"""Contact points of an element."""


@frozen
class Resolution:
    """What the fibrils of a weave ask for."""

    elements: int
    """of each fibril."""
    contact_points: int
    """of each element."""


def resolution(weave: Weave, contact: ContactLaw, order: int, elements: int | None = None) -> Resolution:
    """The mesh with which forces and resistances are within 1 % of those of a mesh twice as fine; for a given number of
    `elements` the contact points, as far as an element can have that many.

    >>> from circuittex.design import plain_weave
    >>> design = plain_weave()
    >>> resolution(design.weave, design.contact, 2)
    Resolution(elements=28, contact_points=11)
    """
    step = spacing = weave.least_pitch / LEAST
    for direction in weave.directions:
        slope = pi * direction.amplitude / direction.step
        stretch = slope**2 / 4.0
        for yarn in dict.fromkeys(direction.yarns):
            bend = yarn.radius / (2.0 * sqrt(stretch)) if stretch > 0.0 else direction.step
            step = min(step, max(bend / BENDS, 2.0 * yarn.radius))
            for material, surface in _kinds(yarn):
                for other in dict.fromkeys(weave.yarns):
                    for partner, touched in _kinds(other):
                        law = contact.between(surface.name, touched.name)
                        length = _contact_length(yarn, material, other, partner, law, slope)
                        spacing = min(spacing, length / POINTS)
    longest = max(direction.crossings * direction.step for direction in weave.directions)
    step = step / 2.0 if order == 1 else step
    points = longest / spacing
    if elements is None:
        elements = 2 * _ceil(max(longest / step, points / MOST_POINTS) / 2)  # even: an error estimate halves it
    return Resolution(elements, min(max(2, _ceil(points / elements)), MOST_POINTS))


def _ceil(number: float) -> int:
    """The next whole number, whatever rounding makes of one: scaled designs have the same mesh."""
    return ceil(round(number, 6))


def _kinds(yarn: Yarn) -> Iterable[tuple[Material, Material]]:
    """What the fibrils of a yarn are along their axes, and what they touch with."""
    return dict.fromkeys(zip(yarn.fibrils, yarn.surfaces, strict=True))


def _contact_length(
    yarn: Yarn, material: Material, other: Yarn, partner: Material, law: ContactProperties, slope: float
) -> float:
    """2 s (mm) of a fibril that crosses one of another yarn; the length of the contact of two radii at most."""
    radius = (yarn.radius + other.radius) / 2.0
    penalty = law.penalty
    if penalty == HERTZ:
        soft = sum((1.0 - each.poisson_ratio**2) / each.youngs_modulus for each in (material, partner))
        penalty = 0.5 / soft
    pull = material.youngs_modulus * pi * yarn.radius**2 * slope**2 / 4.0
    force = 2.0 * pull * slope
    overlap = (force / (8.0 / 3.0 * float(penalty) * sqrt(radius))) ** (2.0 / 3.0)
    return 4.0 * sqrt(radius * min(overlap, radius)) if overlap > 0.0 else 4.0 * radius
