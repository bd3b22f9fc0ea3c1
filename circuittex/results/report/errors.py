"""The report's part on discretisation errors: one table for each state that has an estimate."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from circuittex.results.discretisation import ErrorEstimate, QuantityError
from circuittex.results.report.table import number, table

_INTRODUCTION = (
    "Estimated from the same equilibrium on half and on twice as many elements and with twice as many contact points: "
    "an estimate, not a bound. The error is the sum of the parts of the mesh and of the contact points. A dash as "
    "order means that the values on the three meshes do not run one way; the estimate then rests on their differences "
    "alone."
)


def error_section(estimates: Sequence[ErrorEstimate]) -> str:
    """The section as HTML; nothing without estimates.

    >>> error_section(())
    ''
    """
    if not estimates:
        return ""
    return f"<h2>Discretisation errors</h2><p>{_INTRODUCTION}</p>{''.join(map(_state, estimates))}"


def _state(estimate: ErrorEstimate) -> str:
    coarse, own, fine = estimate.elements
    points, more = estimate.contact_points
    head = [
        "quantity",
        f"{own} elements, {points} points",
        "error",
        "relative",
        "mesh part",
        "contact part",
        "order",
    ]
    head += [f"{coarse} elements", f"{fine} elements", f"{more} points"]
    warnings = "".join(f'<p class="bad">{escape(text)}</p>' for text in estimate.warnings)
    rows = table(head, [_row(quantity) for quantity in estimate.quantities])
    return f'<h3>{escape(estimate.state)}</h3>{warnings}<div class="numbers">{rows}</div>'


def _row(quantity: QuantityError) -> list[str]:
    return [
        f"{quantity.name} ({quantity.unit})",
        number(quantity.value, 6),
        f"± {number(quantity.absolute, 2)}" if quantity.absolute == quantity.absolute else "not known",
        percent(quantity.relative),
        number(quantity.mesh, 2),
        number(quantity.contact, 2),
        number(quantity.order, 2),
        *(number(value, 6) for value in (quantity.coarse, quantity.fine, quantity.more_points)),
    ]


def percent(share: float) -> str:
    """A share to read, in per cent.

    >>> percent(0.01234), percent(float("nan"))
    ('1.2 %', '–')
    """
    return f"{100 * share:.2g} %" if share == share else "–"
