"""Cubics and bicubics in pieces, as expressions of a dialect."""

from __future__ import annotations

from collections.abc import Sequence

from circuittex.study.library.bicubic import Patches
from circuittex.study.library.dialect import Dialect


def piece_of(texts: Sequence[str], knots: Sequence[float], strain: str, dialect: Dialect) -> str:
    """That of n texts between whose knots (n + 1) a strain lies, found by halving.

    >>> from circuittex.study.library.dialect import DIALECTS
    >>> piece_of(["a", "b"], [0.0, 0.1, 0.2], "e", DIALECTS["ltspice"])
    'if(e<0.1,a,b)'
    """
    if len(texts) == 1:
        return texts[0]
    middle = len(texts) // 2
    below = piece_of(texts[:middle], knots[: middle + 1], strain, dialect)
    return dialect.choose(
        f"{strain}<{knots[middle]!r}", below, piece_of(texts[middle:], knots[middle:], strain, dialect)
    )


def cubic(strain: str, start: float, coefficients: Sequence[str]) -> str:
    """c_0 + t (c_1 + t (c_2 + t c_3)) with t = strain - start."""
    t = strain if start == 0.0 else f"({strain}-({start!r}))"
    c0, c1, c2, c3 = coefficients
    return f"({c0})+{t}*(({c1})+{t}*(({c2})+{t}*({c3})))"


def patch_of(found: Patches, resistor: int, first: str, second: str, dialect: Dialect) -> str:
    """The logarithm of a conductance in S: the bicubic of the patch in which two strains lie."""
    columns, rows = found.first.tolist(), found.second.tolist()
    c = found.coefficients[..., resistor]

    def patch(i: int, j: int) -> str:
        inner = [cubic(second, rows[j], [repr(x) for x in c[k, :, i, j].tolist()]) for k in range(4)]
        return cubic(first, columns[i], inner)

    texts = [piece_of([patch(i, j) for j in range(c.shape[3])], rows, second, dialect) for i in range(c.shape[2])]
    return f"({piece_of(texts, columns, first, dialect)})"
