"""A core in a shell: what a coated fibril is along its axis, as one material on its whole section.

Core and shell lie side by side: stretched alike, at one voltage and at one temperature. So conductances, stiffnesses
and masses per length add up, and one homogeneous fibril of the same radius has them all but the bending stiffness,
which `bending_radius` is for. The limits are exact: a shell of no thickness, or of the core's own numbers, is the core.
"""

from __future__ import annotations

from math import sqrt

SIGMA = "electrical_conductivity"
SUMMED = ("youngs_modulus", "density", SIGMA, "thermal_conductivity", "poisson_ratio")
"""Fields of a coated fibril that are those of its parts by their shares of the section."""


def shell_share(radius: float, thickness: float) -> float:
    """Share of the section pi R^2 that a shell of thickness t takes: t (2 R - t) / R^2.

    >>> shell_share(1.0, 0.5)
    0.75
    """
    return thickness * (2.0 * radius - thickness) / radius**2


def mixed(core: float, shell: float, share: float) -> float:
    """The mean of a section of which the shell takes this share; exact where share is 0 or both are equal.

    >>> mixed(1.0, 5.0, 0.25)
    2.0
    """
    return core + (shell - core) * share


def current_share(core: object, shell: object, share: float) -> float:
    """Part of the current along a fibril that a shell with this share of the section carries; the share itself where
    neither conducts.

    >>> from circuittex.design import Material
    >>> copper, silver = (Material("metal", 1e5, 0.3, 0.01, sigma, 0.4) for sigma in (50.0, 150.0))
    >>> current_share(copper, silver, 0.25)
    0.5
    """
    own = getattr(shell, SIGMA) * share
    both = mixed(getattr(core, SIGMA), getattr(shell, SIGMA), share)
    return float(own / both) if both > 0.0 else share


def coated(core: object, shell: object, share: float) -> dict[str, float]:
    """The numbers of the material that is along its axis as a core and a shell, two others, of this share are together.

    Of E, rho, sigma, k (rule of mixtures: sums of E_i A_i, rho_i A_i, sigma_i A_i, k_i A_i over A) and nu. Its
    resistance follows the temperature as that of the two in parallel does, to second order: with the parts w_i of the
    current, tc1 = sum w_i tc1_i and tc2 = sum w_i (tc2_i - tc1_i^2) + tc1^2; its tolerance is sum w_i tolerance_i.

    >>> from circuittex.design import Material
    >>> nylon = Material("nylon", 2e3, 0.4, 1.0, 0.0, 1.0)
    >>> silver = Material("silver", 2e3, 0.4, 2.0, 100.0, 1.0, tc1=0.004)
    >>> [round(coated(nylon, silver, 0.25)[key], 12) for key in ("density", "electrical_conductivity", "tc1")]
    [1.25, 25.0, 0.004]
    """

    def mean(key: str, part: float, power: int = 1) -> float:
        return mixed(getattr(core, key) ** power, getattr(shell, key) ** power, part)

    found = {key: mean(key, share) for key in SUMMED}
    part = current_share(core, shell, share)
    tc1 = mean("tc1", part)
    spread = mean("tc1", part, 2) - tc1**2
    return found | {"tc1": tc1, "tc2": mean("tc2", part) - spread, "tolerance": mean("tolerance", part)}


def bending_radius(radius: float, core_modulus: float, shell_modulus: float, share: float) -> float:
    """2 sqrt(E I / (E A)) of a coated section, mm: the radius of a homogeneous one that bends as it does.

    E A = E_c A_c + E_s A_s, and E I = pi/4 (E_c R_c^4 + E_s (R^4 - R_c^4)). R where both moduli are equal, and
    sqrt(R^2 + R_c^2) where only the shell is stiff, a thin tube:

    >>> round(bending_radius(1.0, 1.0, 1e9, 0.5), 6) == round(sqrt(1.5), 6)
    True
    """
    inside = 1.0 - share
    inertia = mixed(core_modulus, shell_modulus, 1.0 - inside * inside)
    return radius * sqrt(inertia / mixed(core_modulus, shell_modulus, share))
