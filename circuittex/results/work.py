"""Energy balance of a path of equilibria: the work of the clamps, the energy stored, and what the snaps lost."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.results.loadings import by_loading
from circuittex.results.records import Study


class Held(Protocol):
    """What the balance asks of a state: an `Equilibrium` and the `Record` of one have it."""

    @property
    def configuration(self) -> Configuration: ...
    @property
    def reaction(self) -> Floats:
        """(N, 3) force of the clamps on each node, N."""

    @property
    def energy(self) -> float:
        """Stored elastic and contact energy, N mm."""


@frozen
class EnergyBalance:
    """Work and energy of the S steps between S + 1 equilibria."""

    work: Floats
    """(S,) work of the clamps on the fabric in each step, N mm."""
    stored: Floats
    """(S,) change of the elastic and contact energy in each step, N mm."""

    @property
    def loss(self) -> Floats:
        """(S,) energy lost in each step, N mm: work - stored."""
        return self.work - self.stored


def balance(position: Floats, force: Floats, energy: Floats) -> EnergyBalance:
    """Work of the forces (S + 1, K, 3) on K clamped points at `position` (S + 1, K, 3) against `energy` (S + 1,).

    The trapezoidal rule W_s = sum_k (f_s,k + f_s+1,k) / 2 . (x_s+1,k - x_s,k), exact where the forces change linearly
    in a step. Otherwise the error of a path falls with the square of the step, and so does the loss of a path without
    friction that follows one branch of equilibria. What remains as the steps get smaller was lost in snaps.

    Raises `DesignError` where the shapes do not fit.

    >>> x = np.array([0.0, 1.0, 2.0])[:, None, None] * [1.0, 0.0, 0.0]
    >>> balance(x, 3.0 * x, np.array([0.0, 1.5, 5.0])).loss  # a spring of 3 N/mm with 6 N mm in it, of which 1 is lost
    array([0., 1.])
    """
    position, force, energy = np.asarray(position), np.asarray(force), np.asarray(energy)
    if energy.ndim != 1 or not len(energy):
        raise DesignError("energy", energy.shape, "one energy for each of one or more states is asked for")
    for name, value in (("position", position), ("force", force)):
        if value.ndim != 3 or value.shape != (len(energy), position.shape[1], 3):
            allowed = f"its shape must be ({len(energy)}, points, 3), the same for positions and forces"
            raise DesignError(name, value.shape, allowed)
    mean = (force[1:] + force[:-1]) / 2
    return EnergyBalance(work=np.sum(mean * np.diff(position, axis=0), axis=(1, 2)), stored=np.diff(energy))


def clamp_balance(mesh: FibrilMesh, states: Sequence[Held]) -> EnergyBalance:
    """The energy balance of a fabric along a series of equilibria, in the order in which they were reached.

    The clamps are the two ends of every fibril [49]; ends that are not held carry no force and do no work.
    """
    ends = mesh.ends
    return balance(
        np.array([state.configuration.r[ends] for state in states]).reshape(-1, len(ends), 3),
        np.array([state.reaction[ends] for state in states]).reshape(-1, len(ends), 3),
        np.array([state.energy for state in states]),
    )


def step_balances(study: Study) -> dict[str, EnergyBalance]:
    """State -> the balance of the one step that led to it, from the recorded state before it on its loading path.

    The first step of a loading starts at the relaxed state, which no step leads to.
    """
    return {
        after.name: clamp_balance(study.mesh, (before, after))
        for records in by_loading(study).values()
        for before, after in pairwise(records)
    }
