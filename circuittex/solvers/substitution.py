"""Solutions with a factor of dense fronts: forwards with U^T, backwards with U, in either precision.

What the pivots of a front subtract from the unknowns of its border is handed to the front above, like the updates of
the elimination (`circuittex.solvers.cholesky`). So no subtree of fronts writes to an unknown of another's: threads
share them, and the result has the same bits on any number of threads.
"""

from __future__ import annotations

from typing import Any

from circuittex.base.compiled import compiled, compiled_sums


@compiled
def forwards(fronts: Any, tables: Any, values: Any, x: Any, passed: Any) -> None:
    """Replace the pivots of `fronts`, from the first to the last, in x (n,) by those of U^-T x.

    tables: `Tables`; values: of the factor; passed, as long as all borders: what each front hands on.
    """
    first, start, cut, _, places, eldest, below = tables
    for k in fronts:
        p, b = first[k + 1] - first[k], cut[k + 1] - cut[k]
        own, on = x[first[k] : first[k + 1]], passed[cut[k] : cut[k + 1]]
        on[:] = 0.0
        for child in below[eldest[k] : eldest[k + 1]]:
            for m in range(cut[child], cut[child + 1]):
                if places[m] < p:
                    own[places[m]] += passed[m]
                else:
                    on[places[m] - p] += passed[m]
        for i in range(p):
            row = values[start[k] + i * p : start[k] + (i + 1) * p]
            own[i] /= row[i]
            own_i = own[i]
            for j in range(i + 1, p):
                own[j] -= own_i * row[j]
        _subtract(values[start[k] + p * p : start[k] + p * (p + b)], own, on)


@compiled
def _subtract(border: Any, own: Any, on: Any) -> None:
    """Subtract own (p,) . border (p b,) from on (b,), four rows at a time."""
    p, b = own.shape[0], on.shape[0]
    whole = p - p % 4
    for i in range(0, whole, 4):
        row, row1, row2, row3 = (border[i * b :], border[(i + 1) * b :], border[(i + 2) * b :], border[(i + 3) * b :])
        x, x1, x2, x3 = own[i], own[i + 1], own[i + 2], own[i + 3]
        for j in range(b):
            on[j] -= (x * row[j] + x1 * row1[j]) + (x2 * row2[j] + x3 * row3[j])
    for i in range(whole, p):
        row, x = border[i * b :], own[i]
        for j in range(b):
            on[j] -= x * row[j]


@compiled
def backwards(fronts: Any, tables: Any, values: Any, x: Any) -> None:
    """Replace the pivots of `fronts`, from the last to the first, in x (n,) by those of U^-1 x."""
    first, start, cut, border, _, _, _ = tables
    for k in fronts[::-1]:
        p, b = first[k + 1] - first[k], cut[k + 1] - cut[k]
        own, beyond = x[first[k] : first[k + 1]], x[border[cut[k] : cut[k + 1]]]
        at = start[k] + p * p
        for i in range(p - 1, -1, -1):
            row = values[start[k] + i * p : start[k] + (i + 1) * p]
            rest = own[i] - _dot(values[at + i * b : at + (i + 1) * b], beyond) - _dot(row[i + 1 :], own[i + 1 :])
            own[i] = rest / row[i]


@compiled_sums
def _dot(a: Any, b: Any) -> Any:
    total = a[:0].sum()  # zero, as precise as they are
    for j in range(a.shape[0]):
        total += a[j] * b[j]
    return total
