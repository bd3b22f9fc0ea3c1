"""One member of an ensemble: its study, what it comes to, and the file that keeps that."""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.atomic import write_text
from circuittex.base.errors import CircuittexWarning, ConvergenceError, DesignError, StoreError
from circuittex.base.frozen import frozen
from circuittex.base.version import __version__
from circuittex.design import Design, design_hash
from circuittex.results.records import INITIAL, Record
from circuittex.results.store import RESULTS, load_study
from circuittex.results.summary import agrees
from circuittex.study.ensemble.quantities import measure, quantities
from circuittex.study.plan import plan
from circuittex.study.run import run_study

FILE = "member.json"
"""In the folder of a member, once there is nothing more to compute."""
FORMAT = 1


@frozen
class Outcome:
    """What a member of an ensemble comes to."""

    values: Floats
    """(S, Q) its values in every state of the design; nan where it has none."""
    failure: str
    """Why states are missing; empty where none is."""
    disagreeing: tuple[str, ...]
    """Names of the states on which the routes to the currents disagree."""


def compute_member(design: Design, folder: str, start: str = INITIAL) -> Outcome:
    """Compute a member in `folder` from `start`, or go on with it, in this thread; its outcome is kept there too.

    A packing that cannot be laid out, a state that is no start for it and an equilibrium that is not found are
    outcomes: they would not change in another attempt, and the states found before count. Other errors are raised, and
    nothing is kept of them.

    Raises `FileNotFoundError` where the folder of the ensemble is not there: a worker elsewhere does not see it.
    """
    place = Path(folder)
    place.mkdir(exist_ok=True)
    failure = ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CircuittexWarning)  # said once, of the ensemble's own folder
            records: Sequence[Record] = run_study(design, place, start=start, workers=1).records
    except DesignError as error:
        records, failure = (), str(error)
    except ConvergenceError as error:
        records, failure = _records(place), str(error)
    disagreeing = tuple(r.name for r in records if r.verification.routes and not agrees(r))
    outcome = Outcome(_values(design, records), " ".join(failure.split()), disagreeing)
    write_outcome(place, design, outcome)
    return outcome


def _records(folder: Path) -> tuple[Record, ...]:
    """The states that a study found before it failed."""
    try:
        return load_study(folder / RESULTS).records
    except StoreError:
        return ()


def _values(design: Design, records: Sequence[Record]) -> Floats:
    """(S, Q) values of the records, in the order of the design's states."""
    found = {record.name: measure(design, record) for record in records}
    missing = [np.nan] * len(quantities(design))
    return np.array([found.get(step.name, missing) for step in plan(design)], dtype=np.float64)


def write_outcome(folder: Path, design: Design, outcome: Outcome) -> None:
    """Keep the outcome of a member in its folder."""
    content = {
        "format": FORMAT,
        "version": __version__,
        "design_hash": design_hash(design),
        "seed": design.packing.seed,
        "failure": outcome.failure,
        "disagreeing": list(outcome.disagreeing),
        "quantities": [quantity.column for quantity in quantities(design)],
        "states": [step.name for step in plan(design)],
        "values": plain(outcome.values),
    }
    write_text(folder / FILE, json.dumps(content, indent=1, allow_nan=False))


def read_outcome(folder: Path, design: Design) -> Outcome | None:
    """The outcome that is kept in `folder` for this very design and this version of circuittex, if there is one."""
    try:
        content = json.loads((folder / FILE).read_text(encoding="utf-8"))
        known = content["format"], content["version"], content["design_hash"]
        if known != (FORMAT, __version__, design_hash(design)):
            return None
        values = np.array([[_number(value) for value in row] for row in content["values"]], dtype=np.float64)
        if values.shape != (len(plan(design)), len(quantities(design))):
            return None
        return Outcome(values, str(content["failure"]), tuple(content["disagreeing"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None  # none, or of no use: the study in the folder tells it again


def plain(values: Floats) -> Any:
    """Nested lists for strict JSON: nan is null, an infinite number is the text 'inf' or '-inf'.

    >>> plain(np.array([1.0, np.nan, np.inf]))
    [1.0, None, 'inf']
    """
    if values.ndim:
        return [plain(row) for row in values]
    value = float(values)
    return None if np.isnan(value) else value if np.isfinite(value) else str(value)


def _number(value: float | str | None) -> float:
    return float("nan") if value is None else float(value)
