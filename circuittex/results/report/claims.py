"""The report's part on the paper: claim by claim what it states and what circuittex finds."""

from __future__ import annotations

from markupsafe import Markup

from circuittex.results.claims.claim import AGREES
from circuittex.results.claims.table import Table
from circuittex.results.report.template import render


def claims_section(table: Table | None) -> Markup:
    """The section as HTML; nothing where no study is of the paper's cell.

    >>> str(claims_section(None))
    ''
    """
    if table is None:
        return Markup()
    return render("claims.html", columns=table.columns, rows=table.rows, tally=table.tally, words=AGREES)
