"""The numbers by which two equilibria of one state are told apart."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.fit import Fit


@frozen
class Outcome:
    """What an equilibrium comes to."""

    clamp_force: Floats
    """(2, 3) total force of the clamps on the +x ends of the warp and the +y ends of the weft, N."""
    currents: tuple[float, ...]
    """Current of each probe into its source terminal, A."""
    Ry: float
    """Resistance of a yarn segment of the reduced network, ohm; nan where there are several kinds of yarn."""
    Rc: float
    """Resistance of a crossing of the reduced network, ohm; the median where they are several."""
    energy: float
    """Stored elastic and contact energy, N mm."""
    Ry_by_kind: Floats = field(default_factory=lambda: np.empty(0))
    """(k,) resistance of a yarn segment of each kind, ohm."""
    Rc_by_pair: Floats = field(default_factory=lambda: np.empty(0))
    """(q,) resistance of a crossing of each pair of kinds, ohm."""

    @property
    def network(self) -> tuple[float, ...]:
        """Resistance of a segment of each kind of yarn, then of a crossing of each pair of kinds, ohm."""
        if not len(self.Ry_by_kind):  # in results of a version that had one of each
            return self.Ry, self.Rc
        return *self.Ry_by_kind.tolist(), *self.Rc_by_pair.tolist()


def outcome(clamp_force: Floats, currents: tuple[float, ...], fit: Fit, energy: float) -> Outcome:
    """The numbers of an equilibrium with its reduced network."""
    ohms = np.array(list(fit.segments_by_name.values())), np.array(list(fit.crossings_by_name.values()))
    return Outcome(clamp_force, currents, fit.Ry, fit.Rc, energy, *ohms)
