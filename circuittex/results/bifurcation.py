"""Two ways to one state, compared: are they on one branch? Arithmetic alone.

`docs/numerics.md` says what the check of branches does and what it does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from math import nan

import numpy as np

from circuittex.base.frozen import frozen
from circuittex.results.outcome import Outcome

ALLOWED = 1e-6
"""Relative difference, of clamp forces to the largest component and of each current to itself, up to which two ways to
a state have the same end: what circuittex promises of the solver and of the order of the fibrils. In the paper's cell,
at the default tolerance, one branch gave 4e-8 in forces and 7e-7 in currents; others lie half a per cent off."""
SETTLED = 0.1
"""Part of `ALLOWED` that the largest free force may be of the largest clamp force, lest a difference be put down to a
branch which an unfinished relaxation has left. What a residual leaves in forces and currents is of about its own size:
with the default tolerance, 7e-7 of the paper's clamp forces, currents were within 7e-7. A tenth is on the safe side."""


class Verdict(StrEnum):
    """What the comparison of two ways to a state says."""

    SAME = "same branch"
    TOLERANCE = "same branch, within the tolerance"
    """The difference is one that relaxing both further removes."""
    BIFURCATION = "bifurcation"
    UNDECIDED = "not decided"
    """A difference of which cannot be told whether the tolerance or a branch makes it."""
    MISSING = "no equilibrium"


@frozen
class BranchCheck:
    """A recorded state beside the one that is reached from the same start with the fibrils in another order."""

    state: str
    """Name of the state."""
    recorded: Outcome
    """Of the record."""
    again: Outcome
    """With the fibrils in another order; nan where there is no equilibrium."""
    moved: float
    """Largest distance of a node from its place in the record, mm; nan where there is no equilibrium."""
    settled: tuple[Outcome, ...]
    """Both, in this order, relaxed further to tell the tolerance from a branch; empty where that was not needed or did
    not converge."""
    trouble: str
    """Why there is no equilibrium, or why the two could not be relaxed further; empty if all is well."""

    @property
    def difference(self) -> float:
        """The larger difference, of clamp forces or of currents; nan where there is no equilibrium."""
        return difference(self.recorded, self.again)

    @property
    def settled_difference(self) -> float:
        """The same of both relaxed further; nan where they were not."""
        return difference(*self.settled) if self.settled else nan

    @property
    def verdict(self) -> Verdict:
        """What the two say of the state."""
        if np.isnan(self.difference):
            return Verdict.MISSING
        if self.difference <= ALLOWED:
            return Verdict.SAME
        if self.settled_difference <= ALLOWED:
            return Verdict.TOLERANCE
        return Verdict.UNDECIDED if self.trouble else Verdict.BIFURCATION

    @property
    def bifurcation(self) -> bool:
        """Whether the two ways end on two branches."""
        return self.verdict is Verdict.BIFURCATION

    @property
    def alarming(self) -> bool:
        """Whether who uses the results of the state must know what was found."""
        return self.verdict not in (Verdict.SAME, Verdict.TOLERANCE)


def force_difference(one: Outcome, other: Outcome) -> float:
    """Largest difference of a component of the clamp forces, over the largest component of `one`."""
    return _share(np.abs(other.clamp_force - one.clamp_force).max(), np.abs(one.clamp_force).max())


def current_difference(one: Outcome, other: Outcome) -> float:
    """Largest difference of a current, over that current of `one`; 0 where there are no probes."""
    pairs = zip(one.currents, other.currents, strict=True)
    return float(np.max([_share(abs(b - a), abs(a)) for a, b in pairs], initial=0.0))


def difference(one: Outcome, other: Outcome) -> float:
    """The larger of `force_difference` and `current_difference`; nan if one is."""
    return float(np.max([force_difference(one, other), current_difference(one, other)]))


def _share(part: float, whole: float) -> float:
    """Part over whole; nothing of nothing is 0, something of nothing inf."""
    return 0.0 if part == 0.0 else float(part / whole) if whole != 0.0 else part * np.inf


def branch_statement(checks: Sequence[BranchCheck]) -> tuple[str, ...]:
    """Sentences that say what the checks found, what is wrong first; none without checks.

    >>> branch_statement(())
    ()
    """
    by_verdict = {verdict: [check for check in checks if check.verdict == verdict] for verdict in Verdict}
    sentences = []
    if found := by_verdict[Verdict.BIFURCATION]:
        apart = max(np.fmax(check.difference, check.settled_difference) for check in found)
        sentences.append(
            f"BIFURCATION in {_names(found)}: the order of the fibrils, which should not matter, decides which of two "
            f"branches is reached, with clamp forces or currents up to {apart:.1e} apart; the report shows both."
        )
    if missing := by_verdict[Verdict.MISSING]:
        sentences.append(f"With the fibrils in another order NO equilibrium was found in {_names(missing)}.")
    if open_ := by_verdict[Verdict.UNDECIDED]:
        sentences.append(
            f"NOT DECIDED in {_names(open_)}: with the fibrils in another order the results differ by up to "
            f"{max(check.difference for check in open_):.1e}, which may be the tolerance of the relaxation or a "
            "branch; a smaller tolerance would tell."
        )
    if loose := by_verdict[Verdict.TOLERANCE]:
        sentences.append(
            f"The tolerance of the relaxation leaves differences of up to {max(c.difference for c in loose):.1e} in "
            f"{_names(loose)}, more than {ALLOWED:.0e}; relaxed further, both ways end at the same equilibrium."
        )
    if same := by_verdict[Verdict.SAME]:
        which = "the state keeps its branch" if len(same) == 1 else f"{len(same)} states keep their branch"
        sentences.append(
            f"With the fibrils in another order {which}: clamp forces and currents change by at most "
            f"{max(check.difference for check in same):.1e}."
        )
    return tuple(sentences)


def _names(checks: Sequence[BranchCheck]) -> str:
    return ", ".join(check.state for check in checks)
