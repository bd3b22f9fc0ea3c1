"""Electrical values that circuittex did not compute, each with its source."""

from __future__ import annotations

from math import pi

# Resistance between two nodes of networks of unit resistors; textbook values by symmetry and series-parallel reduction.
SQUARE_GRID_CORNER_TO_CORNER = {2: 1.0, 3: 1.5}
CUBE = {"body": 5 / 6, "face": 3 / 4, "edge": 7 / 12}
INFINITE_LATTICE_NEIGHBOUR = 0.5
INFINITE_LATTICE_DIAGONAL = 2 / pi

# 4 x 4 cell, Ry = 0.2829 ohm a segment, half segments at the edges; currents in A at 1 V, probes straight, parallel,
# perpendicular, published to three decimals.
WOVEN_RY = 0.2829
WOVEN_CURRENTS = {1.0: (1.057, 0.782, 0.791), 10.0: (0.906, 0.171, 0.189)}
WOVEN_ROUNDING = 5.1e-4

# Queiruga & Zohdi 2016, eq. [57]: an insulated yarn of ten fibrils, R = 0.15 mm, 10 S/mm, 8 mm long; four digits.
INSULATED_SEGMENT_OHM = 0.2829
INSULATED_YARN_CURRENT = 0.8836
FOUR_DIGITS = 6e-5
