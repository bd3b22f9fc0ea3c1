"""Compiled loops over beam elements: energy, gradient, tangent and section forces.

With u = (g1, g2, r', g1', g2') at a line point and xi = (1, xi1, xi2) at a section point, the volume ratio is linear
in the section's coordinates: J = sum_i xi_i j_i, j_i = (g1 x g2) . u_(2+i). The neo-Hookean density [1] is a quadratic
function of u and a function of J alone, psi = mu/2 (tr F^T F - 3) + f(J), f = -mu ln J + lambda/2 (ln J)^2. So the
section enters gradient and tangent by nine moments, whatever its number of points:

    dE    = K q + sum_i p_i dj_i,                           p_i  = sum w f'(J) xi_i
    d2E   = K + sum_i p_i d2j_i + sum_ik A_ik dj_i (x) dj_k,  A_ik = sum w f''(J) xi_i xi_k

with a constant matrix K. Where a fibril is naturally curved J and F are relative to that shape: only the ratio J / J0
and the metric of its strains change.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled

N_STRAINS = 5
LEAST, LARGEST = 0.64, 1.5625
"""J^2 between which the series of the logarithm serves: |z| < 0.22."""
SERIES = 12
"""Its terms: the next is below 0.22^24 / 25 < 1e-17 of the first."""


class Elements(NamedTuple):
    """M elements of n nodes with Q line points and S section points, as compiled functions take them."""

    nodes: Ints
    """(M, n), those of an element one after another."""
    shape: Floats
    """(Q, n) shape functions at the line points."""
    slope: Floats
    """(M, Q, n) their derivatives, 1/mm."""
    weight: Floats
    """(M, Q, S) volumes that section points stand for, mm3; or (`section_force`) their areas, mm2."""
    points: Floats
    """(1 or M, 2, S) coordinates in the section, mm."""
    natural: Floats
    """(1 or M, Q, 5, 5) products of the natural strains."""
    metric: Floats
    """(M, Q, S, 3, 3) of curved natural shapes; (1, Q, 0, 3, 3) of straight ones."""
    mu: Floats
    """(M, S) Lamé parameters of the section points, MPa."""
    lam: Floats
    """(M, S)."""


@compiled
def strains(nodes: Any, x: Any, shape: Any, slope: Any, u: Any, normal: Any) -> None:
    """Fill u (5, 3) with (g1, g2, r', g1', g2') from the nodal values x (N, 9), and normal (3,) with g1 x g2."""
    u[:] = 0.0
    for a in range(nodes.shape[0]):
        node = nodes[a]
        for c in range(3):
            u[0, c] += shape[a] * x[node, 3 + c]
            u[1, c] += shape[a] * x[node, 6 + c]
            u[2, c] += slope[a] * x[node, c]
            u[3, c] += slope[a] * x[node, 3 + c]
            u[4, c] += slope[a] * x[node, 6 + c]
    for c in range(3):
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        normal[c] = u[0, c1] * u[1, c2] - u[0, c2] * u[1, c1]


@compiled
def _logarithms(squared: Any, log: Any) -> None:
    """Fill log (S,) with ln J = 1/2 ln(1 + t) = artanh z, z = t / (2 + t), from t = J^2 - 1.

    A series with the same operations for all, so that several points are computed at once; `np.log1p` cannot be.
    """
    for s in range(log.shape[0]):
        z = squared[s] / (2.0 + squared[s])
        y = z * z
        total = 1.0 / (2 * SERIES - 1)
        for k in range(SERIES - 1):
            total = total * y + 1.0 / (2 * (SERIES - 2 - k) + 1)
        log[s] = z * total


@compiled
def _stretch_straight(d: Any, points: Any, half_trace: Any, squared: Any) -> None:
    """Fill half_trace (S,) with (tr F^T F - 3) / 2 and squared (S,) with J^2 - 1 for a straight natural shape.

    d (5, 5) holds the products u_m . u_n less those of the natural shape. With c = F^T F - I, J^2 - 1 = tr c + (sum of
    principal minors of c) + det c carries the same rounding errors as tr c. They cancel in tr c / 2 - ln J; those of
    tr F^T F - 3 and det F would not.
    """
    e00, e11, e01 = d[0, 0], d[1, 1], d[0, 1]
    d02, d03, d04, d12, d13, d14 = d[0, 2], d[0, 3], d[0, 4], d[1, 2], d[1, 3], d[1, 4]
    d22, d23, d24, d33, d34, d44 = d[2, 2], 2 * d[2, 3], 2 * d[2, 4], d[3, 3], 2 * d[3, 4], d[4, 4]
    plane = e00 * e11 - e01 * e01
    first, second = points[0], points[1]
    for s in range(half_trace.shape[0]):
        x, y = first[s], second[s]
        e02 = d02 + x * d03 + y * d04
        e12 = d12 + x * d13 + y * d14
        e22 = d22 + x * (d23 + x * d33 + y * d34) + y * (d24 + y * d44)
        trace = e00 + e11 + e22
        minors = plane + e11 * e22 - e12 * e12 + e22 * e00 - e02 * e02
        det = e22 * plane + e02 * (e01 * e12 - e11 * e02) + e12 * (e01 * e02 - e12 * e00)
        half_trace[s] = 0.5 * trace
        squared[s] = trace + minors + det


@compiled
def _stretch_curved(d: Any, points: Any, metric: Any, half_trace: Any, squared: Any, volume2: Any) -> None:
    """The same where the natural shape has the metric G (S, 3, 3); fills also volume2 (S,) with det G.

    With e = F^T F - G in the coordinates of the section and the axis, tr c = G^-1 : e, the minors' sum is
    G : cof e / det G and det c = det e / det G.
    """
    e, cofactor = np.empty((3, 3)), np.empty((3, 3))
    for s in range(half_trace.shape[0]):
        x, y = points[0, s], points[1, s]
        for a in range(2):
            e[a, 2] = e[2, a] = d[a, 2] + x * d[a, 3] + y * d[a, 4]
            for b in range(2):
                e[a, b] = d[a, b]
        e[2, 2] = d[2, 2] + 2 * (x * d[2, 3] + y * d[2, 4] + x * y * d[3, 4]) + x * x * d[3, 3] + y * y * d[4, 4]
        G = metric[s]
        trace = minors = det = volume2[s] = 0.0
        for a in range(3):
            a1, a2 = (a + 1) % 3, (a + 2) % 3
            for b in range(3):
                b1, b2 = (b + 1) % 3, (b + 2) % 3
                cofactor[a, b] = e[a1, b1] * e[a2, b2] - e[a1, b2] * e[a2, b1]
                own = G[a1, b1] * G[a2, b2] - G[a1, b2] * G[a2, b1]
                trace += own * e[a, b]
                minors += G[a, b] * cofactor[a, b]
            det += e[0, a] * cofactor[0, a]
            volume2[s] += G[0, a] * (G[1, a1] * G[2, a2] - G[1, a2] * G[2, a1])
        half_trace[s] = 0.5 * trace / volume2[s]
        squared[s] = (trace + minors + det) / volume2[s]


@compiled
def _volumes(j: Any, points: Any, squared: Any, volume: Any) -> tuple[int, int]:
    """Replace volume (S,), that of the natural shape squared, by the present one; fill squared (S,) with J^2.

    Returns how many points are not inside out, and at how many the series of the logarithm does not serve. Counted,
    not branched at, so that several points are computed at once.
    """
    right, far = 0, 0
    j0, j1, j2, first, second = j[0], j[1], j[2], points[0], points[1]
    for s in range(volume.shape[0]):
        J = j0 + first[s] * j1 + second[s] * j2
        ratio2 = J * J / volume[s]
        right += J > 0.0
        far += (ratio2 <= LEAST) | (ratio2 >= LARGEST)
        squared[s], volume[s] = ratio2, J
    return right, far


@compiled
def section(u: Any, normal: Any, natural: Any, metric: Any, points: Any, d: Any, j: Any, scratch: Any) -> bool:
    """State of all section points of one line point; False where one is inside out.

    Fills d (5, 5) with the products of strains less the natural ones, j (3,), and the rows of scratch (4, S): tr c / 2,
    J^2, ln J, and the volume before the natural shape is divided out. natural (5, 5); metric (S, 3, 3), or (0, 3, 3)
    for a straight natural shape; points (2, S).
    """
    for m in range(N_STRAINS):
        u0, u1, u2 = u[m, 0], u[m, 1], u[m, 2]
        for n in range(m, N_STRAINS):
            d[m, n] = d[n, m] = u0 * u[n, 0] + u1 * u[n, 1] + u2 * u[n, 2] - natural[m, n]
    for i in range(3):
        j[i] = u[2 + i, 0] * normal[0] + u[2 + i, 1] * normal[1] + u[2 + i, 2] * normal[2]
    if metric.shape[0] > 0:
        _stretch_curved(d, points, metric, scratch[0], scratch[1], scratch[3])
    else:
        _stretch_straight(d, points, scratch[0], scratch[1])
        scratch[3] = 1.0
    _logarithms(scratch[1], scratch[2])
    right, far = _volumes(j, points, scratch[1], scratch[3])
    if right < points.shape[1]:
        return False
    if far > 0:
        for s in range(points.shape[1]):
            if not LEAST < scratch[1, s] < LARGEST:
                scratch[2, s] = 0.5 * np.log(scratch[1, s])
    return True


@compiled
def energy(weight: Any, mu: Any, lam: Any, scratch: Any) -> float:
    """Sum of w (mu (tr c / 2 - ln J) + lambda/2 (ln J)^2) over the section points."""
    total = 0.0
    for s in range(weight.shape[0]):
        log = scratch[2, s]
        total += weight[s] * (mu[s] * (scratch[0, s] - log) + 0.5 * lam[s] * log * log)
    return total


@compiled
def moments(weight: Any, points: Any, mu: Any, lam: Any, scratch: Any, p: Any, A: Any) -> None:
    """Fill p (3,) and A (3, 3) with the section's moments of f' and f'', which overwrite scratch's first two rows.

    The sums keep their order, so only what comes before them is computed for several points at once.
    """
    p0 = p1 = p2 = a00 = a01 = a02 = a11 = a12 = a22 = 0.0
    slopes, curvatures, log, volume = scratch[0], scratch[1], scratch[2], scratch[3]
    for s in range(weight.shape[0]):
        inverse, slope = 1.0 / volume[s], lam[s] * log[s] - mu[s]
        slopes[s] = weight[s] * slope * inverse
        curvatures[s] = weight[s] * (lam[s] - slope) * inverse * inverse
    for s in range(weight.shape[0]):
        x, y, first, second = points[0, s], points[1, s], slopes[s], curvatures[s]
        p0 += first
        p1 += first * x
        p2 += first * y
        a00 += second
        a01 += second * x
        a02 += second * y
        a11 += second * x * x
        a12 += second * x * y
        a22 += second * y * y
    p[0], p[1], p[2] = p0, p1, p2
    A[0, 0], A[1, 1], A[2, 2] = a00, a11, a22
    A[0, 1] = A[1, 0] = a01
    A[0, 2] = A[2, 0] = a02
    A[1, 2] = A[2, 1] = a12


@compiled
def beam_energy(first: int, last: int, x: Any, elements: Any, out: Any) -> None:
    """Fill out (M,) with the elastic energy, N mm, of elements first to last; infinite where one is inside out.

    x (N, 9).
    """
    nodes, shape, slope, weight, points, natural, metric, mu, lam = elements
    u, normal, j, scratch = np.empty((N_STRAINS, 3)), np.empty(3), np.empty(3), np.empty((4, weight.shape[2]))
    d = np.empty((N_STRAINS, N_STRAINS))
    for e in range(first, last):
        block, shaped = min(e, points.shape[0] - 1), min(e, natural.shape[0] - 1)
        out[e] = 0.0
        for q in range(shape.shape[0]):
            strains(nodes[e], x, shape[q], slope[e, q], u, normal)
            if section(u, normal, natural[shaped, q], metric[shaped, q], points[block], d, j, scratch):
                out[e] += energy(weight[e, q], mu[e], lam[e], scratch)
            else:
                out[e] = np.inf


@compiled
def section_force(first: int, last: int, x: Any, elements: Any, quadratic: Any, force: Any) -> None:
    """Fill force (M, Q, 3) with the section force dE/dr' = ∫ P E3 dA, N, of elements whose weights are areas.

    x (N, 9); quadratic (M, Q, 5, 5): the part of it that is linear in u.
    """
    nodes, shape, slope, area, points, natural, metric, mu, lam = elements
    u, normal, j, scratch = np.empty((N_STRAINS, 3)), np.empty(3), np.empty(3), np.empty((4, area.shape[2]))
    d, p, A = np.empty((N_STRAINS, N_STRAINS)), np.empty(3), np.empty((3, 3))
    for e in range(first, last):
        block, shaped = min(e, points.shape[0] - 1), min(e, natural.shape[0] - 1)
        for q in range(shape.shape[0]):
            strains(nodes[e], x, shape[q], slope[e, q], u, normal)
            section(u, normal, natural[shaped, q], metric[shaped, q], points[block], d, j, scratch)
            moments(area[e, q], points[block], mu[e], lam[e], scratch, p, A)
            for c in range(3):
                force[e, q, c] = p[0] * normal[c]
                for m in range(N_STRAINS):
                    force[e, q, c] += quadratic[e, q, 2, m] * u[m, c]
