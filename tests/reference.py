"""Mechanical values that circuittex did not compute, each with its source."""

from __future__ import annotations

# Cantilever of length 1 under a transverse dead tip load alpha = P L^2 / (E I), inextensible and unshearable:
# elliptic integrals, cf. Mattiasson, Int. J. Numer. Meth. Engng 17 (1981).
# alpha: tip angle (rad), deflection, shortening.
ELASTICA_CANTILEVER = {
    1.0: (0.46135, 0.30172, 0.05643),
    2.0: (0.78175, 0.49346, 0.16064),
    5.0: (1.21537, 0.71379, 0.38763),
}

# Clamped-free column of length 1 under a dead axial load; Timoshenko & Gere, Theory of Elastic Stability, 2.7.
# Tip angle (degrees): load over the critical load, tip along and across the column.
ELASTICA_COLUMN = {
    20.0: (1.0154, 0.9697, 0.2194),
    60.0: (1.1517, 0.7410, 0.5932),
    120.0: (1.8848, 0.1232, 0.8032),
}

FIVE_DIGITS = 0.6e-5
FOUR_DIGITS = 0.6e-4
"""Rounding of the two tables above."""

# Cantilever that is naturally an arc of 45 degrees, bent out of its plane by a dead tip load; nu = 0.
# The classical problem (Simo & Vu-Quoc 1986: tip 58.84, 22.33, 40.08 with eight elements) has a unit square section.
# A circular one of radius 0.5708 has its E I and, with nu = 0, G J = E I. The tip below is that of the boundary-value
# problem of a rod with G J = E I, along (initial tangent at the root, in-plane normal, out of plane).
BEND_RADIUS, BEND_MODULUS, BEND_SECTION_RADIUS, BEND_LOAD = 100.0, 1e7, 0.5708, 300.0
BEND_TIP = (58.779, 22.245, 40.192)

HALF_PERCENT = 5e-3
"""How close the benchmarks must come to each published value on the meshes stated with them."""
