"""Writes the tables of docs/paper.md from the results of both parameter sets; solves nothing.

    python benchmarks/paper_tables.py results/paper results/paper_table

Each table stands between two comments, `<!-- claims -->` and `<!-- end claims -->` for example, and takes the place of
what is there; the text around them stays.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

from circuittex.results.claims.claim import AGREES
from circuittex.results.claims.table import Table, claims_table
from circuittex.results.records import Record, Study
from circuittex.results.store import load_study

PAGE = Path(__file__).parents[1] / "docs" / "paper.md"
FORCES = ["warp Fx", "Fy", "Fz", "weft Fx", "Fy", "Fz"]
HEAD = ["state", *FORCES, "I1 (A)", "I2 (mA)", "I3 (mA)", "Ry (Ω)", "Rc (Ω)", "iterations"]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", nargs="+", type=Path, help="folders of results, such as results/paper")
    parser.add_argument("--page", type=Path, default=PAGE, help="the page to write (default: docs/paper.md)")
    options = parser.parse_args(arguments)
    studies = [load_study(folder / "results.h5") for folder in options.results]
    page = options.page.read_text(encoding="utf-8")
    for name, table in tables(studies).items():
        page = filled(page, name, table)
    options.page.write_text(page, encoding="utf-8")


def tables(studies: Sequence[Study]) -> dict[str, str]:
    """Name -> Markdown: the claims, the reasons, and for each parameter set its states and error estimates."""
    judged = claims_table(studies)
    if judged is None or len(judged.columns) < len(studies):
        raise SystemExit("every study must be of the paper's cell and have states")
    found = {
        "claims": claims(judged),
        "reasons": "\n".join(f"* **{row.claim.states}** {row.reason}" for row in judged.rows if row.reason) or "None.",
    }
    for name, study in zip(judged.columns, studies, strict=True):
        found[name] = markdown(HEAD, [state(record) for record in study.records])
        found[f"{name} errors"] = errors(study)
    return found


def claims(judged: Table) -> str:
    """One row for each claim, one column for each study."""
    rows = [
        [f"{row.claim.states} ({row.claim.place})", *(f"**{AGREES[f.agrees]}**: {f.text}" for f in row.findings)]
        for row in judged.rows
    ]
    return markdown(["the paper", *judged.columns], [*rows, [f"all {len(rows)} claims", *judged.tally]])


def state(record: Record) -> list[str]:
    straight, *others = record.currents
    return [
        record.name,
        *(f"{force:.4f}" for force in record.clamp_force.ravel()),
        f"{straight:.6f}",
        *(f"{1e3 * current:.4f}" for current in others),
        f"{record.fit.Ry:.5f}",
        f"{record.fit.Rc:.2f}",
        f"{record.iterations}" + (f" in {record.parts} parts" if record.parts > 1 else ""),
    ]


def errors(study: Study) -> str:
    """Estimated discretisation errors of the states that have an estimate."""
    if not study.errors:
        return "No error estimate was computed."
    head = ["state", *(f"{quantity.name} ({quantity.unit})" for quantity in study.errors[0].quantities)]
    rows = [
        [estimate.state, *(f"{quantity.value:.5g} ± {quantity.absolute:.2g}" for quantity in estimate.quantities)]
        for estimate in study.errors
    ]
    return markdown(head, rows)


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; the first column to the left, a bar in a text is written as `&#124;`.

    >>> print(markdown(["a", "b"], [["|x|", "1"]]))
    | a | b |
    |---|---|
    | &#124;x&#124; | 1 |
    """
    lines = [head, *rows]
    cells = [" | ".join(text.replace("|", "&#124;") for text in line) for line in lines]
    rule = "|" + "---|" * len(head)
    return "\n".join([f"| {cells[0]} |", rule, *(f"| {row} |" for row in cells[1:])])


def filled(page: str, name: str, table: str) -> str:
    """The page with `table` between the comments of that name.

    >>> filled("<!-- a -->old<!-- end a -->", "a", "new")
    '<!-- a -->\\n\\nnew\\n\\n<!-- end a -->'
    """
    mark, end = f"<!-- {name} -->", f"<!-- end {name} -->"
    if page.count(mark) != 1 or page.count(end) != 1:
        raise SystemExit(f"the page must have one {mark} and one {end}")
    return re.sub(f"{re.escape(mark)}.*?{re.escape(end)}", lambda _: f"{mark}\n\n{table}\n\n{end}", page, flags=re.S)


if __name__ == "__main__":
    main()
