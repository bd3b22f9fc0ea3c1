"""The report's table of energies: what the clamps put into each step, what of it was stored, and what was lost."""

from __future__ import annotations

from html import escape

from circuittex.results.records import Study
from circuittex.results.report.table import number, table
from circuittex.results.work import EnergyBalance, step_balances

_MEANING = (
    "Stored is the elastic energy of the fibrils with that of their contacts. The work is that of the clamps in the "
    "step from the recorded state before, for the first state of a path from the relaxed one. There is no friction: "
    "the loss, work less change, went where fibrils snapped from one equilibrium to another, or it is the error of the "
    "trapezoidal rule by which the work is summed up. That error may have either sign and shrinks with the steps of "
    "the path; what a snap loses stays."
)


def energy_section(study: Study) -> str:
    """The section as HTML."""
    quantities = ("stored energy", "work of the clamps", "change of stored energy", "loss")
    head = ["state", *(f"{quantity} (N mm)" for quantity in quantities)]
    steps = step_balances(study)
    rows = [[record.name, number(record.energy), *_row(steps.get(record.name))] for record in study.records]
    return f"<h3>Energy</h3>{table(head, rows)}<p>{escape(_MEANING)}</p>"


def _row(step: EnergyBalance | None) -> list[str]:
    if step is None:
        return ["–", "–", "–"]
    return [number(step.work.item()), number(step.stored.item()), number(step.loss.item(), 2)]
