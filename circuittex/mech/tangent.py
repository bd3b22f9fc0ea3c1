"""Gradient and tangent of beam elements, added straight to the vector and the sparse matrix.

The second derivative of the elastic energy has three parts (see `kernels`): a constant one, the same for the three
components; the second derivatives of the volume ratio's coefficients j_i, which couple two nodes by a cross product
with a vector; and the products of their first derivatives, of rank three at each line point. Rows of a node are
computed from the last part, as wide as a vector register's multiple, and the others are added on the way into the
matrix. Elements of different fibrils share no node and no entry, so they can be added at the same time.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled
from circuittex.mech.kernels import N_STRAINS, energy, moments, section, strains

WIDTH = 32
"""Length of a row of the 27 unknowns of a quadratic element, filled up."""
RANK = 6
"""Three coefficients j_i at each of two line points at most."""


class Sums(NamedTuple):
    """What elements are added to."""

    indptr: Ints
    """(n_dofs + 1,) row starts of the pattern."""
    gradient: Floats
    """(n_dofs,), N."""
    data: Floats
    """(nnz,) tangent, N/mm."""


@compiled
def _volume_slopes(u: Any, normal: Any, shape: Any, slope: Any, V: Any) -> None:
    """Fill V (3, WIDTH) with the derivatives of j_i = (g1 x g2) . u_(2+i) by the element's unknowns."""
    for i in range(3):
        for c in range(3):
            c1, c2 = (c + 1) % 3, (c + 2) % 3
            by_g1 = u[1, c1] * u[2 + i, c2] - u[1, c2] * u[2 + i, c1]
            by_g2 = u[2 + i, c1] * u[0, c2] - u[2 + i, c2] * u[0, c1]
            for a in range(shape.shape[0]):
                V[i, 9 * a + c] = 0.0
                V[i, 9 * a + 3 + c] = shape[a] * by_g1
                V[i, 9 * a + 6 + c] = shape[a] * by_g2
                V[i, 9 * a + 3 * i + c] += slope[a] * normal[c]


@compiled
def _turn(u: Any, shape: Any, slope: Any, p: Any, C: Any) -> None:
    """Add sum_i p_i d2j_i to C (3 n, 3 n, 3): the block of the vectors k and l is epsilon_cde C[k, l, e].

    j_i = g1 . (g2 x u_(2+i)): the pairs (g1, g2), (u, g1) and (g2, u) give u, g2 and g1. Node a <= node b only.
    """
    for a in range(shape.shape[0]):
        for b in range(a, shape.shape[0]):
            both, left, right = shape[a] * shape[b], slope[a] * shape[b], shape[a] * slope[b]
            for e in range(3):
                g1, g2 = u[0, e], u[1, e]
                v = both * (p[0] * u[2, e] + p[1] * u[3, e] + p[2] * u[4, e])
                C[3 * a, 3 * b + 1, e] += left * p[0] * g2
                C[3 * a, 3 * b + 2, e] -= left * p[0] * g1
                C[3 * a + 1, 3 * b, e] -= right * p[0] * g2
                C[3 * a + 2, 3 * b, e] += right * p[0] * g1
                C[3 * a + 1, 3 * b + 1, e] += (left - right) * p[1] * g2
                C[3 * a + 2, 3 * b + 2, e] += (right - left) * p[2] * g1
                C[3 * a + 1, 3 * b + 2, e] += v - right * p[2] * g2 - left * p[1] * g1
                C[3 * a + 2, 3 * b + 1, e] -= v - left * p[2] * g2 - right * p[1] * g1


@compiled
def _spread(stiffness: Any, C: Any, K: Any) -> None:
    """Fill the upper triangle of K (9 n, WIDTH) with the constant stiffness and the cross products."""
    for k in range(stiffness.shape[0]):
        x, y, z = K[3 * k], K[3 * k + 1], K[3 * k + 2]
        for m in range(3 * (k // 3), stiffness.shape[0]):
            at, same, c0, c1, c2 = 3 * m, stiffness[k, m], C[k, m, 0], C[k, m, 1], C[k, m, 2]
            x[at], x[at + 1], x[at + 2] = same, c2, -c1
            y[at], y[at + 1], y[at + 2] = -c2, same, c0
            z[at], z[at + 1], z[at + 2] = c1, -c0, same


@compiled
def _pulled(p: Any, V: Any, g: Any) -> None:
    """Add p V to the gradient g (WIDTH,)."""
    p0, p1, p2, v0, v1, v2 = p[0], p[1], p[2], V[0], V[1], V[2]
    for m in range(WIDTH):
        g[m] += p0 * v0[m] + p1 * v1[m] + p2 * v2[m]


@compiled
def _weighted(p: Any, A: Any, V: Any, W: Any, g: Any) -> None:
    """Fill W (3, WIDTH) with A V and add p V to the gradient g (WIDTH,)."""
    p0, p1, p2, v0, v1, v2 = p[0], p[1], p[2], V[0], V[1], V[2]
    for m in range(WIDTH):
        g[m] += p0 * v0[m] + p1 * v1[m] + p2 * v2[m]
    for i in range(3):
        row, a0, a1, a2 = W[i], A[i, 0], A[i, 1], A[i, 2]
        for m in range(WIDTH):
            row[m] = a0 * v0[m] + a1 * v1[m] + a2 * v2[m]


@compiled
def _products(V: Any, W: Any, K: Any) -> None:
    """Add W^T V to K (9 n, WIDTH)."""
    v0, v1, v2, v3, v4, v5 = V[0], V[1], V[2], V[3], V[4], V[5]
    for k in range(K.shape[0]):
        row = K[k]
        w0, w1, w2, w3, w4, w5 = W[0, k], W[1, k], W[2, k], W[3, k], W[4, k], W[5, k]
        for m in range(WIDTH):
            row[m] += w0 * v0[m] + w1 * v1[m] + w2 * v2[m] + w3 * v3[m] + w4 * v4[m] + w5 * v5[m]


@compiled
def _add_gradient(nodes: Any, x: Any, stiffness: Any, g: Any, gradient: Any) -> None:
    """Add the element's gradient g, that of the constant stiffness (3 n, 3 n) included, to gradient (n_dofs,)."""
    for k in range(stiffness.shape[0]):
        t0, t1, t2 = g[3 * k], g[3 * k + 1], g[3 * k + 2]
        for j in range(nodes.shape[0]):
            row = x[nodes[j]]
            for m in range(3):
                factor = stiffness[k, 3 * j + m]
                t0 += factor * row[3 * m]
                t1 += factor * row[3 * m + 1]
                t2 += factor * row[3 * m + 2]
        at = 9 * nodes[k // 3] + 3 * (k % 3)
        gradient[at] += t0
        gradient[at + 1] += t1
        gradient[at + 2] += t2


@compiled
def _add_tangent(nodes: Any, K: Any, indptr: Any, data: Any) -> None:
    """Add the upper triangle of the element's tangent K (9 n, WIDTH) to the matrix values.

    The nodes follow one another, and a row of the matrix begins with them: with its own and its first neighbours.
    """
    width = 9 * nodes.shape[0]
    for r in range(width):
        at, row = indptr[9 * nodes[0] + r] - r, K[r]
        for m in range(r, width):
            data[at + m] += row[m]


@compiled
def add_tangent(first: int, last: int, x: Any, elements: Any, stiffness: Any, out: Any, sums: Any) -> None:
    """Add gradient and tangent of elements first to last to the sums; fill out (M,) with their energies, N mm.

    x (N, 9); stiffness (M, 3 n, 3 n), N/mm.
    """
    nodes, shape, slope, weight, points, natural, metric, mu, lam = elements
    indptr, gradient, data = sums
    u, normal, j, scratch = np.empty((N_STRAINS, 3)), np.empty(3), np.empty(3), np.empty((4, weight.shape[2]))
    d, p, A = np.empty((N_STRAINS, N_STRAINS)), np.empty(3), np.empty((3, 3))
    V, W = np.zeros((RANK, WIDTH)), np.zeros((RANK, WIDTH))
    vectors = stiffness.shape[1]
    C, K, g = np.empty((vectors, vectors, 3)), np.zeros((3 * vectors, WIDTH)), np.empty(WIDTH)
    for e in range(first, last):
        block, shaped = min(e, points.shape[0] - 1), min(e, natural.shape[0] - 1)
        out[e], g[:], C[:] = 0.0, 0.0, 0.0
        for q in range(shape.shape[0]):
            strains(nodes[e], x, shape[q], slope[e, q], u, normal)
            if not section(u, normal, natural[shaped, q], metric[shaped, q], points[block], d, j, scratch):
                out[e] = np.inf
                continue
            out[e] += energy(weight[e, q], mu[e], lam[e], scratch)
            moments(weight[e, q], points[block], mu[e], lam[e], scratch, p, A)
            here = slice(3 * q, 3 * q + 3)
            _volume_slopes(u, normal, shape[q], slope[e, q], V[here])
            _weighted(p, A, V[here], W[here], g)
            _turn(u, shape[q], slope[e, q], p, C)
        _spread(stiffness[e], C, K)
        _products(V, W, K)
        _add_gradient(nodes[e], x, stiffness[e], g, gradient)
        _add_tangent(nodes[e], K, indptr, data)


@compiled
def add_gradient(first: int, last: int, x: Any, elements: Any, stiffness: Any, out: Any, gradient: Any) -> None:
    """Add the gradient of elements first to last alone; fill out (M,) with their energies, N mm (`add_tangent`)."""
    nodes, shape, slope, weight, points, natural, metric, mu, lam = elements
    u, normal, j, scratch = np.empty((N_STRAINS, 3)), np.empty(3), np.empty(3), np.empty((4, weight.shape[2]))
    d, p, A = np.empty((N_STRAINS, N_STRAINS)), np.empty(3), np.empty((3, 3))
    V, g = np.zeros((3, WIDTH)), np.empty(WIDTH)
    for e in range(first, last):
        block, shaped = min(e, points.shape[0] - 1), min(e, natural.shape[0] - 1)
        out[e], g[:] = 0.0, 0.0
        for q in range(shape.shape[0]):
            strains(nodes[e], x, shape[q], slope[e, q], u, normal)
            if not section(u, normal, natural[shaped, q], metric[shaped, q], points[block], d, j, scratch):
                out[e] = np.inf
                continue
            out[e] += energy(weight[e, q], mu[e], lam[e], scratch)
            moments(weight[e, q], points[block], mu[e], lam[e], scratch, p, A)
            _volume_slopes(u, normal, shape[q], slope[e, q], V)
            _pulled(p, V, g)
        _add_gradient(nodes[e], x, stiffness[e], g, gradient)
