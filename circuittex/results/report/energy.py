"""The report's table of energies: what the clamps put into each step, what of it was stored, and what was lost."""

from __future__ import annotations

from markupsafe import Markup

from circuittex.results.records import Study
from circuittex.results.report.number import number
from circuittex.results.report.template import render
from circuittex.results.work import EnergyBalance, step_balances


def energy_section(study: Study) -> Markup:
    """The section as HTML."""
    quantities = ("stored energy", "work of the clamps", "change of stored energy", "loss")
    head = ["state", *(f"{quantity} (N mm)" for quantity in quantities)]
    steps = step_balances(study)
    rows = [[record.name, number(record.energy), *_row(steps.get(record.name))] for record in study.records]
    return render("energy.html", head=head, rows=rows)


def _row(step: EnergyBalance | None) -> list[str]:
    if step is None:
        return ["–", "–", "–"]
    return [number(step.work.item()), number(step.stored.item()), number(step.loss.item(), 2)]
