"""Heat that a thin wire or a flat fabric gives to still air, by textbook correlations: nothing of it is fitted here."""

from __future__ import annotations

import numpy as np

STEFAN_BOLTZMANN = 5.670374e-8
"""W/(m2 K4)."""
GRAVITY = 9.81
"""m/s2."""
KELVIN = (300.0, 350.0, 400.0, 450.0, 500.0, 550.0, 600.0)
CONDUCTIVITY = (26.3e-3, 30.0e-3, 33.8e-3, 37.3e-3, 40.7e-3, 43.9e-3, 46.9e-3)
"""W/(m K), as all properties of air below at 1 atm (Incropera & DeWitt, Heat and Mass Transfer, A.4)."""
VISCOSITY = (15.89e-6, 20.92e-6, 26.41e-6, 32.39e-6, 38.79e-6, 45.57e-6, 52.69e-6)
"""m2/s, kinematic."""
PRANDTL = (0.707, 0.700, 0.690, 0.686, 0.684, 0.683, 0.685)


def churchill_chu(diameter: float, surface: float, surroundings: float) -> float:
    """h, W/(m2 K), of a horizontal cylinder (m) at a temperature in air of another, K: Churchill & Chu (1975).

    Nu = (0.60 + 0.387 (Ra / (1 + (0.559/Pr)^(9/16))^(16/9))^(1/6))^2 at the mean of both temperatures.
    """
    k, Pr, Ra = _air(diameter, surface, surroundings)
    Nu = (0.60 + 0.387 * (Ra / (1 + (0.559 / Pr) ** (9 / 16)) ** (16 / 9)) ** (1 / 6)) ** 2
    return float(k / diameter * Nu)


def morgan(diameter: float, surface: float, surroundings: float) -> float:
    """The same by Morgan (1975): Nu = C Ra^n, piecewise."""
    k, _, Ra = _air(diameter, surface, surroundings)
    for most, C, n in ((1e-2, 0.675, 0.058), (1e2, 1.02, 0.148), (1e4, 0.850, 0.188)):
        if most >= Ra:
            return float(k / diameter * C * Ra**n)
    raise ValueError(f"a wire of {diameter} m is too thick for the table")


def radiation(emissivity: float, surface: float, surroundings: float) -> float:
    """h, W/(m2 K), of what a surface at a temperature radiates more than it receives, over the difference, K."""
    return emissivity * STEFAN_BOLTZMANN * (surface**4 - surroundings**4) / (surface - surroundings)


def _air(diameter: float, surface: float, surroundings: float) -> tuple[float, float, float]:
    """k, Pr and Ra of the air between."""
    film = (surface + surroundings) / 2
    k, nu, Pr = (float(np.interp(film, KELVIN, values)) for values in (CONDUCTIVITY, VISCOSITY, PRANDTL))
    return k, Pr, GRAVITY / film * (surface - surroundings) * diameter**3 * Pr / nu**2
