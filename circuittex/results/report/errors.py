"""The report's part on discretisation errors: one table for each state that has an estimate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from circuittex.results.discretisation import ErrorEstimate, QuantityError
from circuittex.results.report.number import number
from circuittex.results.report.template import render


def error_section(estimates: Sequence[ErrorEstimate]) -> Markup:
    """The section as HTML; nothing without estimates.

    >>> str(error_section(()))
    ''
    """
    return render("errors.html", estimates=[_state(each) for each in estimates]) if estimates else Markup()


def _state(estimate: ErrorEstimate) -> dict[str, Any]:
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
    rows = [_row(quantity) for quantity in estimate.quantities]
    return {"state": estimate.state, "warnings": estimate.warnings, "head": head, "rows": rows}


def _row(quantity: QuantityError) -> list[str]:
    return [
        f"{quantity.name} ({quantity.unit})",
        number(quantity.value, 6),
        f"± {number(quantity.absolute, 2)}" if quantity.absolute == quantity.absolute else "not known",
        percent(quantity.relative),
        number(quantity.mesh, 2),
        number(quantity.contact, 2),
        number(quantity.observed_order, 2),
        *(number(value, 6) for value in (quantity.coarse, quantity.fine, quantity.more_points)),
    ]


def percent(share: float) -> str:
    """A share to read, in per cent.

    >>> percent(0.01234), percent(float("nan"))
    ('1.2 %', '–')
    """
    return f"{100 * share:.2g} %" if share == share else "–"
