"""A claim of the paper, and what a study says about it."""

from __future__ import annotations

from collections.abc import Callable

from circuittex.base.frozen import frozen
from circuittex.results.claims.cell import PaperStudy

AGREES = {"yes": "agrees", "partly": "in part", "no": "does not agree", "open": "not computed"}
"""What the answers are called in tables."""


@frozen
class Finding:
    """What a study finds on a claim."""

    text: str
    """One sentence with the numbers, all of them computed from the study."""
    agrees: str
    """A key of `AGREES`."""


@frozen
class Claim:
    """One checkable statement of the paper, in other words."""

    place: str
    """Sections, figures and equations where the paper makes it."""
    states: str
    """What the paper states."""
    rule: str
    """What counts as agreement here; the paper's words are seldom numbers."""
    find: Callable[[PaperStudy], Finding | None]
    """What a study of the paper's cell finds; None where it lacks a loading or a probe that this needs."""
    reason: str = ""
    """Why circuittex may find something else."""


@frozen
class Verdict:
    """A claim and what one study finds on it."""

    claim: Claim
    finding: Finding


def graded(text: str, good: bool, fair: bool = False) -> Finding:
    """A finding that agrees where it is `good`, and in part where it is `fair`.

    >>> graded("1.6 N", good=False, fair=True).agrees
    'partly'
    """
    return Finding(text, "yes" if good else "partly" if fair else "no")


def counted(text: str, answers: list[bool]) -> Finding:
    """A finding on several cases: it agrees where all of them do, and in part where some do.

    >>> counted("one of two", [True, False]).agrees
    'partly'
    """
    return graded(text, all(answers), any(answers))
