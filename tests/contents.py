"""The table of contents of results.h5 in docs/results.md, from a file itself.

`python tests/contents.py` writes it anew; a test fails where it is not what a file holds.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
from synthetic_study import synthetic_study

from circuittex.results.bifurcation import BranchCheck
from circuittex.results.discretisation import ErrorEstimate, QuantityError
from circuittex.results.records import Study
from circuittex.results.store import write_study_start

PAGE = Path(__file__).parents[1] / "docs" / "results.md"
BEGIN, END = "<!-- contents -->\n", "<!-- end of contents -->\n"
LISTED_ELSEWHERE = ("objects", "design")
"""What the table leaves to others: the keys of a design have a page of their own."""


def full_study() -> Study:
    """A study with everything that a file can hold."""
    study = synthetic_study(1, contacts=5, rows=(1,))
    state, outcome = study.records[0].name, study.records[0].outcome
    quantity = QuantityError("Ry", "ohm", 1.0, 1.1, 0.9, 1.0)
    estimate = ErrorEstimate(state, (2, 4, 8), (4, 8), np.zeros(3), (quantity,), ())
    check = BranchCheck(state, outcome, outcome, 0.0, (outcome, outcome), "")
    return replace(study, start="tiled, from 2 x 2 yarns", errors=(estimate,), branches=(check,))


def contents(file: h5py.File) -> str:
    """The table of a file: the group of one state stands for all, the first of a row of equals for each of them."""
    rows = ["| place | unit | what it is |", "|---|---|---|", *_rows(file, "", set())]
    return "\n".join(rows) + "\n"


def _rows(group: h5py.Group, at: str, seen: set[int]) -> Iterator[str]:
    for line in filter(None, group.attrs.get("about", "").split("\n")):
        name, meaning = line.split(": ", 1)
        name, _, unit = name.partition(" [")
        yield _row(f"{at.rstrip('/')} @{name}".strip(), unit.rstrip("]"), meaning)
    for name, item in group.items():
        if at + name in LISTED_ELSEWHERE:
            yield _row(f"{at}{name}/", "", item.attrs["description"])
            continue
        place = at + ("NAME" if at in ("states/", "errors/", "branches/") else name)
        if name.isdigit() and int(name) > 0:
            continue
        if isinstance(item, h5py.Dataset):
            yield _row(place, item.attrs.get("unit", ""), item.attrs["description"])
            continue
        yield _row(f"{place}/", "", item.attrs["description"])
        address = h5py.h5o.get_info(item.id).addr
        if address not in seen:
            seen.add(address)
            yield from _rows(item, f"{place}/", seen)


def _row(place: str, unit: str, meaning: str) -> str:
    return f"| `{place}` | {unit} | {meaning.replace('|', chr(92) + '|')} |"


def table() -> str:
    """The table of a file that holds everything."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "results.h5")
        write_study_start(path, full_study())
        with h5py.File(path) as file:
            return contents(file)


if __name__ == "__main__":
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
    PAGE.write_text(before + BEGIN + table() + END + rest.split(END)[1], encoding="utf-8")
