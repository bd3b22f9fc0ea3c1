"""Numbers to read."""

from __future__ import annotations


def number(value: float, digits: int = 4) -> str:
    """A number to read, with a dash for what is undefined.

    >>> number(0.28294, 3), number(1234.5, 2), number(float("nan")), number(0.123456789, 8)
    ('0.283', '1200', '–', '0.12345679')
    """
    # Rounded first: only then is 1200 not 1.2e+03.
    return f"{float(f'{value:.{digits}g}'):.{max(digits, 6)}g}" if value == value else "–"
