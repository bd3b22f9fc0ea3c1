"""What the trade states of a yarn, turned into what its fibrils are: count, filaments, resistance per length."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.design.checks import real, whole

MOST_FLAT = 100.0
"""Width over height of a yarn: wider ones are films."""
MOST_FILAMENTS = 2000
"""Of a yarn whose rows are found."""


def fibril_radius(linear_density: float, filaments: int, density: float) -> float:
    """R (mm) of the round filaments of a yarn of linear density T (g/mm) and density rho (g/mm3): T = n rho pi R².

    1 tex is 1e-6 g/mm, 1 dtex 1e-7, 1 den 1e-6 / 9.

    >>> round(fibril_radius(235e-7, 34, 1.14e-3), 5)  # nylon 235 dtex f34: 27.8 um thick
    0.01389
    """
    count = real(linear_density, "linear_density", "g/mm", above=0)
    area = count / (whole(filaments, "filaments", 1, 10**6) * real(density, "density", "g/mm3", above=0))
    return sqrt(area / pi)


def coated_radius(linear_density: float, filaments: int, core: float, shell: float, thickness: float) -> float:
    """R (mm) of the filaments of a yarn that weighs T (g/mm) with its shell of thickness t (mm); densities in g/mm3.

    T = n pi (rho_c (R - t)² + rho_s (R² - (R - t)²)), the positive root of rho_c R² + 2 t (rho_s - rho_c) R = ...

    >>> bare = fibril_radius(235e-7, 34, 1.14e-3)
    >>> coated_radius(235e-7, 34, 1.14e-3, 10.5e-3, 0.0) == bare
    True
    """
    if thickness == 0.0:
        return fibril_radius(linear_density, filaments, core)
    area = real(linear_density, "linear_density", "g/mm", above=0) / (whole(filaments, "filaments", 1, 10**6) * pi)
    lean = thickness * (shell - core)
    return (sqrt(lean**2 + core * (area + thickness * lean)) - lean) / real(core, "density", "g/mm3", above=0)


def shell_thickness(
    linear_density: float, core_linear_density: float, filaments: int, core: float, shell: float
) -> float:
    """t (mm) of the shell that makes a yarn of filaments of T_c (g/mm) one of T; densities in g/mm3.

    T - T_c = n pi rho_s (R² - R_c²). What silver plating adds to nylon:

    >>> round(1e3 * shell_thickness(290e-7, 235e-7, 34, 1.14e-3, 10.5e-3), 3)  # um
    0.175
    """
    inner = fibril_radius(core_linear_density, filaments, core)
    added = real(linear_density - core_linear_density, "linear_density", "g/mm more than its core", at_least=0)
    square = added / (filaments * pi * real(shell, "density", "g/mm3", above=0))
    return square / (sqrt(inner**2 + square) + inner)


def fibril_conductivity(resistance: float, area: float) -> float:
    """sigma (S/mm) of fibrils of joint section A (mm2) that have a resistance r' (ohm/mm) side by side: 1 / (r' A).

    >>> round(fibril_conductivity(0.1, 0.02), 6)
    500.0
    """
    return 1.0 / (real(resistance, "resistance", "ohm/mm", above=0) * real(area, "area", "mm2", above=0))


def hexagonal_rows(filaments: int, flattening: float = 1.0) -> tuple[int, ...]:
    """Rows of the densest packing of n filaments in a section `flattening` times as wide as it is high.

    Neighbouring rows differ by one filament, so that each lies in the gaps of the other, sqrt(3)/2 spacings above it.
    Of all such sequences the one with the least sum of (x / a)² + (z a)² is taken, a² = `flattening`: filaments as near
    to the middle of an ellipse of that shape as they can be.

    >>> hexagonal_rows(7), hexagonal_rows(19), hexagonal_rows(10, 8.0)
    ((2, 3, 2), (3, 4, 5, 4, 3), (10,))
    """
    n = whole(filaments, "filaments", 1, MOST_FILAMENTS)
    aspect = real(flattening, "flattening", at_least=1, at_most=MOST_FLAT)
    # n hexagons of area sqrt(3)/2 fill an ellipse of that shape, rows sqrt(3)/2 apart.
    ideal = sqrt(4.0 * n * (sqrt(3.0) / 2.0) / (pi * aspect)) / (sqrt(3.0) / 2.0)
    counts = range(max(1, round(ideal) - 3), min(n, round(ideal) + 3) + 1)
    found = [_best(n, rows, aspect) for rows in counts]
    return min(found, key=lambda each: each[0])[1]


def _best(n: int, rows: int, aspect: float) -> tuple[float, tuple[int, ...]]:
    """The least sum of a number of rows that hold n filaments, and the rows; infinite where none do.

    Row by row from below, the least sum for every width of the last row and number of filaments so far.
    """
    widest = min(n, 3 * -(-n // rows) + 3)
    widths: Ints = np.arange(widest + 1)
    heights = (np.arange(rows) - (rows - 1) / 2.0) * sqrt(3.0) / 2.0
    flat = widths * (widths**2 - 1.0) / 12.0 / aspect  # the sum of x² of a row about its middle
    least: Floats = np.full((rows, widest + 1, n + 1), np.inf)
    for row, height in enumerate(heights):
        for width in range(1, widest + 1):
            cost = flat[width] + width * aspect * height**2
            if row == 0:
                least[0, width, width] = cost
                continue
            before = least[row - 1, [k for k in (width - 1, width + 1) if 1 <= k <= widest]].min(axis=0, initial=np.inf)
            least[row, width, width:] = before[: n + 1 - width] + cost
    width = int(np.argmin(least[-1, :, n]))
    total, left, chosen = float(least[-1, width, n]), n, []
    for row in range(rows - 1, -1, -1):
        chosen.append(width)
        left -= width
        if row and np.isfinite(total):
            narrower = width - 1 if width > 1 else width + 1
            wider = min(width + 1, widest)
            width = narrower if least[row - 1, narrower, left] <= least[row - 1, wider, left] else wider
    return total, tuple(chosen)
