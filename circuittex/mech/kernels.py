"""Compiled loops over beam elements: energy, gradient, tangent and section forces.

With u = (g1, g2, r', g1', g2') at a line point, the deformation gradient at a section point is
F = sum_m u_m (x) L_m, where the 5 x 3 matrix L holds the section coordinates (and, for a naturally curved
fibril, the inverse reference gradient). Everything follows from the neo-Hookean density [1] in terms of
L and y_m = F^-1 L_m:

    dE/du_m        = w (mu F L_m + (lambda ln J - mu) y_m)
    d2E/du_m du_n  = w (mu (L_m . L_n) I + (mu - lambda ln J) y_n (x) y_m + lambda y_m (x) y_n)
"""

from __future__ import annotations

from typing import Any

import numpy as np

from circuittex.compiled import compiled

N_STRAINS = 5


@compiled
def _strains(slots: Any, x: Any, shape: Any, slope: Any, u: Any) -> None:
    """Fill u (5, 3) with (g1, g2, r', g1', g2') from the nodal values x (slots, 9)."""
    u[:] = 0.0
    for a in range(slots.shape[0]):
        row = x[slots[a]]
        for c in range(3):
            u[0, c] += shape[a] * row[3 + c]
            u[1, c] += shape[a] * row[6 + c]
            u[2, c] += slope[a] * row[c]
            u[3, c] += slope[a] * row[3 + c]
            u[4, c] += slope[a] * row[6 + c]


@compiled
def _deformation(u: Any, L: Any, F: Any) -> float:
    """Fill F (3, 3) = sum_m u_m (x) L_m and return det F."""
    for c in range(3):
        for j in range(3):
            total = 0.0
            for m in range(N_STRAINS):
                total += u[m, c] * L[m, j]
            F[c, j] = total
    return (
        F[0, 0] * (F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1])
        - F[0, 1] * (F[1, 0] * F[2, 2] - F[1, 2] * F[2, 0])
        + F[0, 2] * (F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0])
    )


@compiled
def _push(F: Any, J: float, L: Any, y: Any) -> None:
    """Fill y (5, 3) with y_m = F^-T L_m, where (F^-T)_cj = (F^-1)_jc."""
    for c in range(3):
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        for m in range(N_STRAINS):
            total = 0.0
            for j in range(3):
                j1, j2 = (j + 1) % 3, (j + 2) % 3
                total += (F[c1, j1] * F[c2, j2] - F[c1, j2] * F[c2, j1]) * L[m, j]
            y[m, c] = total / J


@compiled
def _density(F: Any, J: float, mu: float, lam: float) -> float:
    """The neo-Hookean density [1] for J = det F > 0, to few units of round-off of the result even at small strain.

    With c = F^T F - I, tr c and J^2 - 1 = tr c + (sum of principal minors of c) + det c carry the same rounding
    errors, which cancel in mu (tr c / 2 - ln J); those of tr F^T F - 3 and ln det F would not.
    """
    c00, c11, c22, c01, c02, c12 = -1.0, -1.0, -1.0, 0.0, 0.0, 0.0
    for k in range(3):
        c00 += F[k, 0] * F[k, 0]
        c11 += F[k, 1] * F[k, 1]
        c22 += F[k, 2] * F[k, 2]
        c01 += F[k, 0] * F[k, 1]
        c02 += F[k, 0] * F[k, 2]
        c12 += F[k, 1] * F[k, 2]
    trace = c00 + c11 + c22
    minors = c00 * c11 - c01 * c01 + c11 * c22 - c12 * c12 + c22 * c00 - c02 * c02
    det = c00 * (c11 * c22 - c12 * c12) - c01 * (c01 * c22 - c12 * c02) + c02 * (c01 * c12 - c11 * c02)
    log_j = 0.5 * np.log1p(trace + minors + det) if J > 0.5 else np.log(J)
    return mu * (0.5 * trace - log_j) + 0.5 * lam * log_j * log_j


@compiled
def beam_energy(x: Any, slots: Any, shape: Any, slope: Any, weight: Any, L: Any, mu: Any, lam: Any) -> float:
    """Elastic energy, N mm; infinite where a section point has turned inside out.

    x (slots, 9); slots (M, n); shape (Q, n); slope (M, Q, n); weight (M, Q, S) volumes; L (1 or M, Q, S, 5, 3);
    mu, lam (M, S).
    """
    u, F = np.empty((N_STRAINS, 3)), np.empty((3, 3))
    energy = 0.0
    for e in range(slots.shape[0]):
        block = e if L.shape[0] > 1 else 0
        for q in range(shape.shape[0]):
            _strains(slots[e], x, shape[q], slope[e, q], u)
            for s in range(weight.shape[2]):
                J = _deformation(u, L[block, q, s], F)
                if not J > 0.0:
                    return np.inf
                energy += weight[e, q, s] * _density(F, J, mu[e, s], lam[e, s])
    return energy


@compiled
def _point(u: Any, L: Any, w: float, mu: float, lam: float, F: Any, y: Any, g: Any, H: Any) -> float:
    """Add one section point to g (5, 3) and H (5, 3, 5, 3); return its energy."""
    J = _deformation(u, L, F)
    if not J > 0.0:
        return np.inf
    _push(F, J, L, y)
    pressure = w * (lam * np.log(J) - mu)
    for m in range(N_STRAINS):
        for c in range(3):
            fl = 0.0
            for j in range(3):
                fl += F[c, j] * L[m, j]
            g[m, c] += w * mu * fl + pressure * y[m, c]
        for n in range(N_STRAINS):
            ll = w * mu * (L[m, 0] * L[n, 0] + L[m, 1] * L[n, 1] + L[m, 2] * L[n, 2])
            for c in range(3):
                H[m, c, n, c] += ll
                for d in range(3):
                    H[m, c, n, d] += w * lam * y[m, c] * y[n, d] - pressure * y[n, c] * y[m, d]
    return w * _density(F, J, mu, lam)


@compiled
def beam_tangent(
    x: Any, slots: Any, shape: Any, slope: Any, weight: Any, L: Any, mu: Any, lam: Any, gradient: Any, tangent: Any
) -> float:
    """Elastic energy; fills gradient (M, n, 9), N, and tangent (M, n, 9, n, 9), N/mm.

    Arguments as `beam_energy`. Only blocks with a <= b are filled; the tangent is symmetric.
    """
    nodes = slots.shape[1]
    u, F, y = np.empty((N_STRAINS, 3)), np.empty((3, 3)), np.empty((N_STRAINS, 3))
    g, H = np.empty((N_STRAINS, 3)), np.empty((N_STRAINS, 3, N_STRAINS, 3))
    # u_m gets shape or slope times unknown block m_block[m] of each node: r -> r'; g1 -> g1, g1'; g2 -> g2, g2'
    phi = np.empty((nodes, N_STRAINS))
    unknown = np.array([1, 2, 0, 1, 2])
    energy = 0.0
    gradient[:] = 0.0
    tangent[:] = 0.0
    for e in range(slots.shape[0]):
        block = e if L.shape[0] > 1 else 0
        for q in range(shape.shape[0]):
            _strains(slots[e], x, shape[q], slope[e, q], u)
            g[:] = 0.0
            H[:] = 0.0
            for s in range(weight.shape[2]):
                energy += _point(u, L[block, q, s], weight[e, q, s], mu[e, s], lam[e, s], F, y, g, H)
            for a in range(nodes):
                phi[a, 0] = phi[a, 1] = shape[q, a]
                phi[a, 2] = phi[a, 3] = phi[a, 4] = slope[e, q, a]
            for a in range(nodes):
                for m in range(N_STRAINS):
                    row = 3 * unknown[m]
                    for c in range(3):
                        gradient[e, a, row + c] += phi[a, m] * g[m, c]
                    for b in range(a, nodes):
                        for n in range(N_STRAINS):
                            col, factor = 3 * unknown[n], phi[a, m] * phi[b, n]
                            for c in range(3):
                                for d in range(3):
                                    tangent[e, a, row + c, b, col + d] += factor * H[m, c, n, d]
    return energy


@compiled
def section_force(x: Any, slots: Any, shape: Any, slope: Any, area: Any, L: Any, mu: Any, lam: Any, force: Any) -> None:
    """Fill force (M, Q, 3) with the section force dE/dr' = ∫ P E3 dA, N; area (M, Q, S) section weights, mm2."""
    u, F, y = np.empty((N_STRAINS, 3)), np.empty((3, 3)), np.empty((N_STRAINS, 3))
    g, H = np.empty((N_STRAINS, 3)), np.empty((N_STRAINS, 3, N_STRAINS, 3))
    for e in range(slots.shape[0]):
        block = e if L.shape[0] > 1 else 0
        for q in range(shape.shape[0]):
            _strains(slots[e], x, shape[q], slope[e, q], u)
            g[:] = 0.0
            for s in range(area.shape[2]):
                _point(u, L[block, q, s], area[e, q, s], mu[e, s], lam[e, s], F, y, g, H)
            for c in range(3):  # assigning the row would cost numba 4 s more to compile
                force[e, q, c] = g[2, c]
