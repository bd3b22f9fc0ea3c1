"""Discretisation errors estimated from values on three meshes and with more contact points: arithmetic alone.

After Roache's grid convergence index (ASME V&V 20) and the rules of Eça & Hoekstra (J. Comput. Phys. 262, 2014) for
sequences that do not converge as theory says; `docs/error_estimate.md` says what the estimate is and is not.
"""

from __future__ import annotations

from math import exp2, inf, isfinite, log2, nan

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen

SAFETY = 1.25
"""Factor on Richardson's estimate where the observed order is plausible (Roache)."""
CAUTION = 3.0
"""Factor on a bare difference of two values, where no order supports more (Roache, Eça & Hoekstra)."""
LEAST_ORDER, FORMAL_ORDER = 1.0, 2.0
"""Orders that an estimate may rest on: the contact points integrate with second order. What seems to converge faster
is not trusted to, what converges more slowly counts as irregular."""


@frozen
class QuantityError:
    """One quantity of a state, on the design's own mesh and repeated on others, with the error of the first."""

    name: str
    """For example 'Fx warp' or 'Ry'."""
    unit: str
    """'N', 'A' or 'ohm'."""
    value: float
    """With the design's own numerics, in `unit`."""
    coarse: float
    """On half as many elements, in `unit`; nan where there is no equilibrium."""
    fine: float
    """On twice as many elements, in `unit`; nan likewise."""
    more_points: float
    """With twice as many contact points an element, in `unit`; nan likewise."""

    @property
    def observed_order(self) -> float:
        """Observed order of convergence with the mesh; nan where the three values do not approach a limit."""
        return observed_order(self.coarse, self.value, self.fine)

    @property
    def regular(self) -> bool:
        """Whether the mesh part rests on Richardson's extrapolation rather than on bare differences."""
        return self.observed_order >= LEAST_ORDER

    @property
    def mesh(self) -> float:
        """Estimated error by the mesh; nan where it cannot be estimated."""
        return mesh_error(self.coarse, self.value, self.fine)

    @property
    def contact(self) -> float:
        """Estimated error by the number of contact points; nan where it cannot be estimated."""
        return contact_error(self.value, self.more_points)

    @property
    def absolute(self) -> float:
        """Estimated error in the quantity's unit: the sum of both parts, as if they never cancelled."""
        return self.mesh + self.contact

    @property
    def relative(self) -> float:
        """Estimated error over the magnitude of the value; nan where the value is 0."""
        return self.absolute / abs(self.value) if self.value != 0.0 else nan


@frozen
class ErrorEstimate:
    """The estimated discretisation errors of one recorded state."""

    state: str
    """Name of the state."""
    elements: tuple[int, int, int]
    """Elements of a fibril: coarse mesh, the design's own, fine mesh."""
    contact_points: tuple[int, int]
    """Contact points of an element: the design's own, and more."""
    moved: Floats
    """(3,) largest distance of a node from where the state has it, mm, in the repeated equilibrium on the coarse
    mesh, on the fine one, and with more contact points; nan where there is none."""
    quantities: tuple[QuantityError, ...]
    """Clamp forces, probe currents, Ry and Rc; where there are several kinds, of each."""
    warnings: tuple[str, ...]
    """What limits the estimate; empty if all is well."""

    def quantity(self, name: str) -> QuantityError:
        """The quantity of that name: 'Fx warp', 'Fy weft', 'I ' with the name of a probe, 'Ry' or 'Rc', with the kind
        behind it where there are several."""
        return {quantity.name: quantity for quantity in self.quantities}[name]


def observed_order(coarse: float, middle: float, fine: float) -> float:
    """log2((coarse - middle) / (middle - fine)), for meshes halved in size each time.

    nan where the values do not run one way, inf where only the last two agree.

    >>> observed_order(17.0, 5.0, 2.0)
    2.0
    """
    first, second = coarse - middle, middle - fine
    if not (isfinite(first) and isfinite(second)) or first == 0.0 or first * second < 0.0:
        return nan
    return log2(first / second) if second != 0.0 else inf


def mesh_error(coarse: float, value: float, fine: float) -> float:
    """Estimated error of `value` from values on half and on twice as many elements.

    With d = |value - fine|, D = |coarse - value| and the observed order p: Richardson's 1.25 d 2^p / (2^p - 1) for
    1 <= p <= 2; second order on the coarser pair, 1.25 D / 3, for p > 2; the larger of that and 3 d where the
    sequence is not monotone or p < 1. nan without the finer value, 3 d without the coarser one.

    >>> round(mesh_error(1.0 + 16e-3, 1.0 + 4e-3, 1.0 + 1e-3), 12)  # its error is 0.004
    0.005
    """
    coarser, finer = abs(coarse - value), abs(value - fine)
    if not isfinite(finer):
        return nan
    observed = observed_order(coarse, value, fine)
    if LEAST_ORDER <= observed <= FORMAL_ORDER:
        return SAFETY * finer / (1.0 - exp2(-observed))
    second_order = SAFETY * coarser / (exp2(FORMAL_ORDER) - 1.0) if isfinite(coarser) else 0.0
    return second_order if observed > FORMAL_ORDER else max(CAUTION * finer, second_order)


def contact_error(value: float, more_points: float) -> float:
    """Estimated error of `value` from that with twice as many contact points: 1.25 · 4/3 of their difference.

    Two values show no order; second order, that of the contact points' rule, is taken for granted.
    """
    difference = abs(value - more_points)
    return SAFETY * difference / (1.0 - exp2(-FORMAL_ORDER)) if isfinite(difference) else nan
