"""The report's part on the paper: claim by claim what it states and what circuittex finds."""

from __future__ import annotations

from html import escape

from circuittex.results.claims.claim import AGREES, Finding
from circuittex.results.claims.table import Row, Table

_INTRODUCTION = (
    "What Queiruga and Zohdi (2016) state in words, what the states of this study say, and whether the two agree. "
    "Agreement is decided by the rule in the first column, since the paper seldom gives numbers; where something else "
    "is found, the reason follows, as far as it is known."
)


def claims_section(table: Table | None) -> str:
    """The section as HTML; nothing where no study is of the paper's cell.

    >>> claims_section(None)
    ''
    """
    if table is None:
        return ""
    head = ["The paper states", *table.columns]
    top = "".join(f'<th scope="col">{escape(text)}</th>' for text in head)
    counts = "".join(f"<td>{escape(text)}</td>" for text in table.tally)
    body = "".join(map(_row, table.rows)) + f'<tr><th scope="row">All {len(table.rows)} claims</th>{counts}</tr>'
    rows = f'<div class="scroll"><table class="claims"><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'
    return f"<h2>The paper, claim by claim</h2><p>{_INTRODUCTION}</p>{rows}"


def _row(row: Row) -> str:
    claim = row.claim
    small = [f"Section {claim.place}. Agreement: {claim.rule}."]
    if row.reason:
        small.append(f"Why not: {row.reason}")
    notes = "".join(f"<small>{escape(text)}</small>" for text in small)
    return f'<tr><th scope="row">{escape(claim.states)}{notes}</th>{"".join(map(_cell, row.findings))}</tr>'


def _cell(finding: Finding) -> str:
    return f'<td><em class="{finding.agrees}">{AGREES[finding.agrees]}</em> {escape(finding.text)}</td>'
