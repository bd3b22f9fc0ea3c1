"""`circuittex ensemble`: what the command does with its options, and what it prints."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from circuittex.design import load_design
from circuittex.study.ensemble.files import PAGE
from circuittex.study.ensemble.result import Ensemble, percentiles
from circuittex.study.ensemble.run import run_ensemble

SHOWN = ("warp_Fx", "weft_Fy")
"""Quantities of the closing table besides the resistances; ensemble.csv has all of them."""


def ensemble_command(options: argparse.Namespace, progress: Callable[[str], None]) -> Ensemble:
    """Compute the ensemble that the options ask for, into the folder `folder_of` names."""
    return run_ensemble(
        load_design(options.design),
        folder_of(options),
        members=options.members,
        seed=options.seed,
        start=options.start,
        address=options.scheduler,
        workers=options.workers,
        progress=progress,
    )


def folder_of(options: argparse.Namespace) -> Path:
    """The folder of the results: as asked for, or named after the design file."""
    return options.out if options.out is not None else Path("results", f"{options.design.stem}-ensemble")


def closing_words(ensemble: Ensemble, folder: Path) -> str:
    """The median and the band from 5 to 95 % of the main quantities, and where the page is."""
    low, middle, high = percentiles(ensemble.values, (5, 50, 95))
    names = [quantity.name for quantity in ensemble.quantities]
    shown = [q for q, name in enumerate(names) if name in SHOWN or name.partition("_")[0] in ("Ry", "Rc")]
    lines = [f"{'state':<20} " + " ".join(f"{ensemble.quantities[q].column:>28}" for q in shown)]
    for s, state in enumerate(ensemble.states):
        cells = [f"{middle[s, q]:.4g} [{low[s, q]:.4g}, {high[s, q]:.4g}]" for q in shown]
        lines.append(f"{state:<20} " + " ".join(f"{cell:>28}" for cell in cells))
    members = f"{ensemble.finished} of {len(ensemble.seeds)} members have all their states"
    return "\n".join([*lines, f"median [5 %, 95 %]; {members}", f"\nreport: {folder / PAGE}"])


def warnings(ensemble: Ensemble) -> list[str]:
    """One line for each member that is incomplete or whose routes to the currents disagree."""
    lines = []
    for number, seed in enumerate(ensemble.seeds):
        member = f"member {number:04d} (seed {seed})"
        if ensemble.failures[number]:
            lines.append(f"{member} is incomplete: {ensemble.failures[number]}")
        if ensemble.disagreeing[number]:
            states = ", ".join(ensemble.disagreeing[number])
            lines.append(f"{member}: the routes DISAGREE in {states}: do not trust these results")
    return lines
