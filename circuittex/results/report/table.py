"""Numbers and tables of the report."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """An HTML table; the first column names the row. All texts are escaped here."""
    top = "".join(f'<th scope="col">{escape(text)}</th>' for text in head)
    body = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>' + "".join(f"<td>{escape(text)}</td>" for text in row[1:]) + "</tr>"
        for row in rows
    )
    return f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


def number(value: float, digits: int = 4) -> str:
    """A number to read, with a dash for what is undefined.

    >>> number(0.28294, 3), number(1234.5, 2), number(float("nan")), number(0.123456789, 8)
    ('0.283', '1200', '–', '0.12345679')
    """
    # Rounded first: only then is 1200 not 1.2e+03.
    return f"{float(f'{value:.{digits}g}'):.{max(digits, 6)}g}" if value == value else "–"
