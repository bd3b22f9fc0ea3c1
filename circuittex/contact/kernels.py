"""Compiled loops over contacts: gradient and exact tangent of the contact potential.

With u = x_a - x_b(s), c the weights of the eight nodes in u, c' their derivative in s and
w = c u_s + c' u, eliminating the closest position s from 1/2 P o^2 gives, for nodes i and j,

    gradient_i  = -P w_q o c_i n
    tangent_ij  =  P w_q (c_i c_j n n^T - o/d (c_i c_j (I - n n^T) - w_i w_j^T / m_ss)),  m_ss = u_s.u_s + u.u_ss

where the last term stands only while the closest point is not a fibril's end.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from circuittex.compiled import compiled
from circuittex.contact.curve import weights
from circuittex.mech.pattern import find_neighbour


@compiled
def _couple(r: Any, wa: int, wb: int, c: Any, cs: Any, css: Any, w: Any, n: Any, at_end: bool) -> tuple[float, float]:
    """Fill n (3,) and w (8, 3) of one contact; return the distance and 1 / m_ss (0 at a fibril's end)."""
    u, us, uss = np.zeros(3), np.zeros(3), np.zeros(3)
    for i in range(8):
        node = wa + i if i < 4 else wb + i - 4
        for k in range(3):
            u[k] += c[i] * r[node, k]
            us[k] += cs[i] * r[node, k]
            uss[k] += css[i] * r[node, k]
    d = np.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    m = 0.0
    for k in range(3):
        n[k] = u[k] / d
        m += us[k] * us[k] + u[k] * uss[k]
        for i in range(8):
            w[i, k] = c[i] * us[k] + cs[i] * u[k]
    return d, 0.0 if at_end or m <= 0.0 else 1.0 / m


@compiled
def add_contacts(
    r: Any,
    slot: Any,
    basis: Any,
    window_a: Any,
    kind_a: Any,
    t_a: Any,
    window_b: Any,
    kind_b: Any,
    t_b: Any,
    at_end: Any,
    overlap: Any,
    stiffness: Any,
    indptr: Any,
    start: Any,
    neighbour: Any,
    point_offset: Any,
    total: Any,
    data: Any,
    softening: Any,
) -> None:
    """Add the gradient and the tangent's upper triangle of every contact (C) in place.

    The tangent's first part, P w_q c_i c_j n n^T, goes to data; the rest, by which the contact force turns as
    fibrils slide, goes to softening.

    stiffness (C,): P* times quadrature weight, N/mm; the matrix arguments are those of `Pattern`.
    """
    c, cs, css = np.zeros(8), np.zeros(8), np.zeros(8)
    w, n, normal, turning = np.empty((8, 3)), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for q in range(overlap.shape[0]):
        weights(basis[kind_a[q]], t_a[q], 0, c[:4])
        for order, out in ((0, c), (1, cs), (2, css)):
            weights(basis[kind_b[q]], t_b[q], order, out[4:])
            for i in range(4, 8):
                out[i] = -out[i]
        d, over_m = _couple(r, window_a[q], window_b[q], c, cs, css, w, n, at_end[q])
        stiff, lean = stiffness[q], stiffness[q] * overlap[q] / d
        for i in range(8):
            if c[i] == 0.0 and cs[i] == 0.0:
                continue
            slot_i = slot[window_a[q] + i if i < 4 else window_b[q] + i - 4]
            for k in range(3):
                total[9 * slot_i + k] -= stiff * overlap[q] * c[i] * n[k]
            for j in range(i, 8):
                if c[j] == 0.0 and cs[j] == 0.0:
                    continue
                cc = c[i] * c[j]
                for k in range(3):
                    for m in range(3):
                        normal[k, m] = stiff * cc * n[k] * n[m]
                        turning[k, m] = lean * (cc * n[k] * n[m] + over_m * w[i, k] * w[j, m])
                    turning[k, k] -= lean * cc
                if i == j:
                    for k in range(3):
                        at = indptr[9 * slot_i + k]
                        for m in range(k, 3):
                            data[at + m - k] += normal[k, m]
                            softening[at + m - k] += turning[k, m]
                    continue
                slot_j = slot[window_a[q] + j if j < 4 else window_b[q] + j - 4]
                low, high = min(slot_i, slot_j), max(slot_i, slot_j)
                at = point_offset[find_neighbour(start, neighbour, low, high)]
                for k in range(3):
                    row = indptr[9 * low + k] + 9 - k + at
                    for m in range(3):
                        data[row + m] += normal[k, m]  # n n^T is its own transpose
                        softening[row + m] += turning[k, m] if slot_i < slot_j else turning[m, k]
