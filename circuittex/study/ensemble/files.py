"""The folder of an ensemble: ensemble.json, ensemble.csv, its figures and its page.

ensemble.json is strict JSON: a number that is not determined is null, an infinite one the text "inf". Its keys:

``format``
    1. A change that would break readers of the file gives a new number; new keys do not.
``version``, ``design``, ``design_hash``
    version of circuittex, name of the design, and its hash with the packing below
``start``
    where members start: ``initial``, or which members' states of another ensemble; ``initial`` where it is missing
``packing``
    ``seed`` of the ensemble and the four amplitudes: ``lateral_mm``, ``vertical_mm``, ``twist_turns_per_mm``,
    ``phase_mm``
``quantities``
    names with units, such as ``warp_Fx_N``, in the order of every list of values
``states``
    for each state ``name``, ``loading``, ``strain``, ``count`` of members, and under ``percentiles`` the lists for
    ``p5``, ``p25``, ``p50``, ``p75`` and ``p95``
``members``
    for each member ``number``, ``seed``, ``failure`` (empty where it has all states), ``disagreeing`` states, and
    ``values``, one list for each state

The last three are missing until the ensemble has been computed once.
"""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

from circuittex.base.atomic import write_text
from circuittex.base.errors import FolderError
from circuittex.base.version import __version__
from circuittex.design import Design, design_hash
from circuittex.results.records import INITIAL
from circuittex.study.ensemble.figures import save_bands
from circuittex.study.ensemble.member import plain
from circuittex.study.ensemble.page import page
from circuittex.study.ensemble.result import BANDS, Ensemble, percentiles

FORMAT = 1
STATE, TABLE, PAGE = "ensemble.json", "ensemble.csv", "ensemble.html"
COLUMNS = ("state", "loading", "strain", "quantity", "unit", "median", "p5", "p25", "p75", "p95", "members")


def member_folder(folder: Path, number: int) -> Path:
    """Where a member of the ensemble in `folder` is.

    >>> member_folder(Path("weave-ensemble"), 7).as_posix()
    'weave-ensemble/members/0007'
    """
    return folder / "members" / f"{number:04d}"


def open_folder(folder: Path, design: Design, start: str = INITIAL) -> None:
    """Make sure that `folder` is empty of ensembles or holds this one, with the same starts.

    Raises `FolderError` where it holds another, or one by another version of circuittex.
    """
    path = folder / STATE
    here = {"design_hash": design_hash(design), "version": __version__, "format": FORMAT, "start": start}
    (folder / "members").mkdir(exist_ok=True)
    if not path.exists():
        if any((folder / "members").iterdir()):
            raise FolderError(f"{folder}: it holds members of an ensemble but no {STATE}; take another folder")
        write_text(path, json.dumps(head(design, start), indent=1, allow_nan=False))
        return
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        there = {key: found[key] for key in here if key in found or key != "start"}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FolderError(f"{path}: it cannot be read ({error}); take another folder") from error
    there = {"start": INITIAL, **there}  # older files have none
    for key, value in here.items():
        if there[key] != value:
            raise FolderError(
                f"{folder}: it holds an ensemble with another {key.replace('_', ' ')} ({there[key]}, and this is "
                f"{value}); take another folder"
            )


def write_results(folder: Path, ensemble: Ensemble) -> None:
    """Write the table, the figures, the page and ensemble.json."""
    write_text(folder / TABLE, table(ensemble))
    pictures = save_bands(ensemble, folder / "figures")
    write_text(folder / PAGE, page(ensemble, {name: path.read_bytes() for name, path in pictures.items()}))
    write_text(folder / STATE, json.dumps(content(ensemble), indent=1, allow_nan=False))


def table(ensemble: Ensemble) -> str:
    """ensemble.csv: one line for each state and quantity; a cell is empty where nothing is determined."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    p5, p25, p50, p75, p95 = percentiles(ensemble.values, BANDS)
    for s, state in enumerate(ensemble.states):
        for q, quantity in enumerate(ensemble.quantities):
            numbers = [plain(part[s, q]) for part in (p50, p5, p25, p75, p95)]
            strain = float(ensemble.strains[s])
            place = [state, ensemble.loadings[s], strain, quantity.name, quantity.unit]
            writer.writerow([*place, *numbers, int(ensemble.count[s, q])])
    return text.getvalue()


def content(ensemble: Ensemble) -> dict[str, Any]:
    """The content of ensemble.json."""
    bands = percentiles(ensemble.values, BANDS)
    states = [
        {
            "name": name,
            "loading": ensemble.loadings[s],
            "strain": float(ensemble.strains[s]),
            "count": ensemble.count[s].tolist(),
            "percentiles": {f"p{percent:g}": plain(band[s]) for percent, band in zip(BANDS, bands, strict=True)},
        }
        for s, name in enumerate(ensemble.states)
    ]
    members = [
        {
            "number": number,
            "seed": seed,
            "failure": ensemble.failures[number],
            "disagreeing": list(ensemble.disagreeing[number]),
            "values": plain(ensemble.values[number]),
        }
        for number, seed in enumerate(ensemble.seeds)
    ]
    columns = [quantity.column for quantity in ensemble.quantities]
    return {**head(ensemble.design, ensemble.start), "quantities": columns, "states": states, "members": members}


def head(design: Design, start: str = INITIAL) -> dict[str, Any]:
    """What ensemble.json says before anything is computed."""
    packing = design.packing
    return {
        "format": FORMAT,
        "version": __version__,
        "design": design.name,
        "design_hash": design_hash(design),
        "start": start,
        "packing": {
            "seed": packing.seed,
            "lateral_mm": packing.lateral,
            "vertical_mm": packing.vertical,
            "twist_turns_per_mm": packing.twist,
            "phase_mm": packing.phase,
        },
    }
