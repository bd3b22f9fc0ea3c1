"""The report's part on branches: what changed when every state was reached again with the fibrils in another order."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from circuittex.results.bifurcation import (
    ALLOWED,
    BranchCheck,
    branch_statement,
    current_difference,
    force_difference,
)
from circuittex.results.outcome import Outcome
from circuittex.results.report.table import number, table

_INTRODUCTION = (
    "Each state was reached once more from the recorded state before it, with the fibrils in another order. That "
    "changes round-off and, where a descent meets a saddle point, the start from which its way out is looked for; "
    "neither means anything. Differences of clamp forces are relative to the largest component, those of currents each "
    f"to itself; up to {ALLOWED:.0e} the branch is the same. Where they are larger and the tolerance of the relaxation "
    "could be the reason, both were relaxed further and compared again. Where values agree although nodes lie "
    "elsewhere, the two are images of one another. This is no search for other equilibria: a state that keeps its "
    "branch may have more."
)
DIGITS = 8
"""Of both branches: one more than differences of `ALLOWED` need to be seen."""
_WHICH = ("recorded", "other")


def branch_alarm(checks: Sequence[BranchCheck]) -> str:
    """A box for the head of the page, as HTML; nothing where no check found anything to be told there.

    >>> branch_alarm(())
    ''
    """
    sentences = branch_statement([check for check in checks if check.alarming])
    return f'<div class="bad">{"".join(f"<p>{escape(text)}</p>" for text in sentences)}</div>' if sentences else ""


def branch_section(checks: Sequence[BranchCheck], probes: Sequence[str]) -> str:
    """The section as HTML; nothing without checks. `probes` are the names of the currents.

    >>> branch_section((), ())
    ''
    """
    if not checks:
        return ""
    head = ["state", "clamp forces (relative)", "currents (relative)", "relaxed further (relative)"]
    head += ["energy (N mm)", "largest distance (mm)", "verdict"]
    rows = table(head, [_row(check) for check in checks])
    boxes = "".join(_both(check, probes) for check in checks if check.bifurcation)
    reasons = "".join(
        f'<p class="bad">{escape(f"{check.state}: {check.verdict} ({check.trouble})")}</p>'
        for check in checks
        if check.trouble
    )
    return f'<h2>Branches</h2><p>{escape(_INTRODUCTION)}</p><div class="numbers">{rows}</div>{boxes}{reasons}'


def _row(check: BranchCheck) -> list[str]:
    recorded, again = check.recorded, check.again
    differences = force_difference(recorded, again), current_difference(recorded, again)
    values = *differences, check.settled_difference, again.energy - recorded.energy, check.moved
    return [check.state, *(number(value, 2) for value in values), check.verdict]


def _both(check: BranchCheck, probes: Sequence[str]) -> str:
    """The two branches of a bifurcation side by side."""
    names = [f"{side} F{axis} (N)" for side in ("warp +x", "weft +y") for axis in "xyz"]
    names += [*(f"I {probe} (A)" for probe in probes), "Ry (Ω)", "Rc (Ω)", "stored energy (N mm)"]
    head = ["", "recorded branch", "other branch", *(f"{which}, relaxed further" for which in _WHICH if check.settled)]
    outcomes = check.recorded, check.again, *check.settled
    columns = ([number(value, DIGITS) for value in _values(outcome)] for outcome in outcomes)
    both = table(head, list(zip(names, *columns, strict=True)))
    words = (
        "The order of the fibrils decides which of these two equilibria is reached; their nodes are up to "
        f"{number(check.moved, 2)} mm apart. Neither is more right than the other, and what follows on the loading "
        "path rests on the recorded one."
    )
    return f'<div class="bad"><h3>Bifurcation in {escape(check.state)}</h3><p>{words}</p>{both}</div>'


def _values(outcome: Outcome) -> list[float]:
    return [*map(float, outcome.clamp_force.ravel()), *outcome.currents, outcome.Ry, outcome.Rc, outcome.energy]
