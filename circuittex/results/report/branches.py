"""The report's part on branches: what changed when every state was reached again with the fibrils in another order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from circuittex.results.bifurcation import (
    ALLOWED,
    BranchCheck,
    branch_statement,
    current_difference,
    force_difference,
)
from circuittex.results.outcome import Outcome
from circuittex.results.report.number import number
from circuittex.results.report.template import render

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


def branch_alarm(checks: Sequence[BranchCheck]) -> Markup:
    """A box for the head of the page, as HTML; nothing where no check found anything to be told there.

    >>> str(branch_alarm(()))
    ''
    """
    return render("alarm.html", sentences=branch_statement([check for check in checks if check.alarming]))


def branch_section(checks: Sequence[BranchCheck], probes: Sequence[str], network: Sequence[str]) -> Markup:
    """The section as HTML; nothing without checks. `probes` are the names of the currents, `network` those of the
    resistances.

    >>> str(branch_section((), (), ()))
    ''
    """
    if not checks:
        return Markup()
    head = ["state", "clamp forces (relative)", "currents (relative)", "relaxed further (relative)"]
    return render(
        "branches.html",
        introduction=_INTRODUCTION,
        head=[*head, "energy (N mm)", "largest distance (mm)", "verdict"],
        rows=[_row(check) for check in checks],
        bifurcations=[_both(check, probes, network) for check in checks if check.bifurcation],
        troubles=[f"{check.state}: {check.verdict} ({check.trouble})" for check in checks if check.trouble],
    )


def _row(check: BranchCheck) -> list[str]:
    recorded, again = check.recorded, check.again
    differences = force_difference(recorded, again), current_difference(recorded, again)
    values = *differences, check.settled_difference, again.energy - recorded.energy, check.moved
    return [check.state, *(number(value, 2) for value in values), check.verdict]


def _both(check: BranchCheck, probes: Sequence[str], network: Sequence[str]) -> dict[str, Any]:
    """The two branches of a bifurcation side by side."""
    names = [f"{side} F{axis} (N)" for side in ("warp +x", "weft +y") for axis in "xyz"]
    names += [*(f"I {probe} (A)" for probe in probes), *(f"{name} (Ω)" for name in network), "stored energy (N mm)"]
    head = ["", "recorded branch", "other branch", *(f"{which}, relaxed further" for which in _WHICH if check.settled)]
    outcomes = check.recorded, check.again, *check.settled
    columns = ([number(value, DIGITS) for value in _values(outcome)] for outcome in outcomes)
    rows = list(zip(names, *columns, strict=True))
    return {"state": check.state, "moved": number(check.moved, 2), "head": head, "rows": rows}


def _values(outcome: Outcome) -> list[float]:
    return [*map(float, outcome.clamp_force.ravel()), *outcome.currents, *outcome.network, outcome.energy]
