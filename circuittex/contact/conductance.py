"""Laws of the conductance of a contact: functions from what is known of touches to the conductance of each.

A touch is what two fibrils have in common at one place, however many contact points see it: force, angle, area. A law
takes `Touches` and returns (P,) S, which the points of the touch share in proportion to the force that they carry. The
laws `paper` and `strip` know no touches: they have a conductance per length of axis, point by point.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.design import ContactLaw
from circuittex.design.contact_laws import admit, known


@frozen
class Touches:
    """What a law of conductance is told of P touches, all of pairs of materials that have this law."""

    force: Floats
    """(P,) normal force F, N."""
    sine: Floats
    """(P,) sine of the angle between the axes: 1 at a right angle, 0 where they are parallel."""
    length: Floats
    """(P,) length of the touch, mm of axis."""
    area: Floats
    """(P,) area, mm2: Hertz's ellipse, or the strip of width 2 a where the touch is long and parallel."""
    spot: Floats
    """(P,) radius of the circular spot that constricts a current as the touch does, mm."""
    radius_a: Floats
    """(P,) R of the fibril of lower number, mm."""
    radius_b: Floats
    """(P,) R of the other, mm."""
    modulus: Floats
    """(P,) E* of the pair, MPa."""
    bulk_a: Floats
    """(P,) sigma of the half space in which the current spreads from the spot as it does in the fibril of lower number,
    S/mm: its own; of its shell or, where that is thin beside the spot and the core conducts less, a part of that."""
    bulk_b: Floats
    """(P,) sigma of the other, S/mm."""
    film: Floats
    """(P,) sigma_c of the pair, S/mm2."""
    reference_conductance: Floats
    """(P,) G0 of the pair, S."""
    reference_force: Floats
    """(P,) F0 of the pair, N."""
    exponent: Floats
    """(P,) n of the pair."""


Law = Callable[[Touches], Floats]


def paper(conductivity: Floats, half_width: Floats) -> Floats:
    """sigma_c a [31], S/mm: the paper takes the half-width a for the width of the strip."""
    return conductivity * half_width


def strip(conductivity: Floats, half_width: Floats) -> Floats:
    """sigma_c 2 a, S/mm: the whole width of Hertz's strip, whatever the angle."""
    return conductivity * (2 * half_width)


def crossed(touches: Touches) -> Floats:
    """sigma_c A, S: the area of the touch conducts, as Hertz's theory has it."""
    return touches.film * touches.area


def holm(touches: Touches) -> Floats:
    """4 a / (1/sigma + 1/sigma'), S: the current is constricted to the spot of the touch, of radius a.

    In thin shells it spreads as in a sheet (`spot_on_shell`), which the sigmas, `Touches.bulk_a` and `bulk_b`, hold.
    """
    return 4 * touches.spot * in_series(touches.bulk_a, touches.bulk_b)


def film(touches: Touches) -> Floats:
    """`holm` and `crossed` in series, S: 1/G = (1/sigma + 1/sigma') / (4 a) + 1/(sigma_c A), a film on bare spots."""
    return in_series(holm(touches), crossed(touches))


def power(touches: Touches) -> Floats:
    """G0 (F/F0)^n, S: n is 1/3 for one elastic spot, 1/2 for a plastic one, near 1 for a rough surface with many."""
    return touches.reference_conductance * (touches.force / touches.reference_force) ** touches.exponent


def in_series(one: Floats, other: Floats) -> Floats:
    """Conductance of two in series; 0 where either is.

    >>> in_series(np.array([1.0, 0.0]), np.array([3.0, 0.0])).tolist()
    [0.75, 0.0]
    """
    total = one + other
    return np.asarray(np.divide(one, total, out=np.zeros_like(total), where=total > 0.0) * other)


PER_LENGTH = {"paper": paper, "strip": strip}
"""Laws that know no touches."""
PER_TOUCH: dict[str, Law] = {"crossed": crossed, "holm": holm, "film": film, "power": power}
"""The others, and those that users add, by the names that designs have for them."""


def add_contact_law(name: str, law: Law) -> None:
    """Let designs name a law of one's own, `contact.law = NAME`, for as long as this Python runs.

    Adding it again replaces it. Raises `DesignError` where the package has a law of this name.

    >>> add_contact_law("soldered", lambda touches: np.full_like(touches.force, 5.0))
    """
    admit(name)
    PER_TOUCH[name] = law


def of_touches(name: str, touches: Touches) -> Floats:
    """(P,) S by the law of a name; `DesignError` where one's own does not return that."""
    found = np.asarray(PER_TOUCH[name](touches), dtype=np.float64)
    if found.shape != touches.force.shape or not np.all((found >= 0.0) & (found < np.inf)):
        wanted = f"it must return {len(touches.force)} finite conductances >= 0 S, one for each touch"
        raise DesignError(f"contact law {name!r}", found, wanted)
    return found


def check_laws(law: ContactLaw) -> None:
    """Refuse a law that nobody has added here: results of another Python may name it."""
    for name in law.laws:
        if name not in PER_LENGTH and name not in PER_TOUCH:
            raise DesignError("contact.law", name, "the laws known here are " + ", ".join(map(repr, known())))
