"""Names of the laws by which contacts conduct: those of the package, and those that a user adds."""

from __future__ import annotations

from circuittex.design.checks import name, refuse

PAPER = "paper"
"""The law of the paper [29-31], and of designs that state none."""
POWER = "power"
"""The law whose constants a design must state."""
PROVIDED = (PAPER, "strip", "crossed", "holm", "film", POWER)
"""The laws of the package (`circuittex.contact.conductance`)."""

_ADDED: dict[str, None] = {}


def admit(law: str) -> None:
    """Let designs name a further law.

    >>> admit("strip")
    Traceback (most recent call last):
    circuittex.base.errors.DesignError: contact law: 'strip' is not usable; the package has a law of this name
    """
    if name(law, "contact law") in PROVIDED:
        raise refuse("contact law", law, "the package has a law of this name")
    _ADDED[law] = None


def known() -> tuple[str, ...]:
    """The laws that a design can name now.

    >>> known()[:3]
    ('paper', 'strip', 'crossed')
    """
    return (*PROVIDED, *_ADDED)
