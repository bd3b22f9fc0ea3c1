"""Lamé parameters, the neo-Hookean density and its derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from circuittex.base.arrays import Floats
from circuittex.mech.form import psi, stress, stress_change
from circuittex.mech.material import bending_lambda, lame

MU, LAM = 4.0, 6.0
MODULI = st.floats(1e-3, 1e6)
RATIOS = st.floats(0.0, 0.45)


def near_identity(seed: int, size: float = 0.3) -> Floats:
    return np.asarray(np.eye(3) + np.random.default_rng(seed).uniform(-size, size, (3, 3)))


@given(E=MODULI, nu=RATIOS)
def test_lame_parameters_give_back_young_and_poisson(E: float, nu: float) -> None:
    mu, lam = lame(np.array([E]), np.array([nu]))
    assert mu * (3 * lam + 2 * mu) / (lam + mu) == pytest.approx(E, rel=1e-12)
    assert lam / (2 * (lam + mu)) == pytest.approx(nu, rel=1e-12, abs=1e-15)


@given(E=MODULI, nu=RATIOS)
def test_bending_modulus_without_contraction_is_youngs(E: float, nu: float) -> None:
    """Section points that cannot contract feel 2 mu + lambda: with lambda_b that is E, and never more than lambda."""
    mu, lam = lame(np.array([E]), np.array([nu]))
    lam_b = bending_lambda(mu, np.array([nu]))
    assert 2 * mu + lam_b == pytest.approx(E, rel=1e-14)
    assert np.all(lam_b <= lam)


@given(seed=st.integers(0, 2**32 - 1))
def test_rotation_stores_no_energy(seed: int) -> None:
    R = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    assert abs(psi(R, np.array(MU), np.array(LAM))) < 1e-14 * MU
    assert np.abs(stress(R, np.array(MU), np.array(LAM))).max() < 1e-14 * (MU + LAM)


@given(seed=st.integers(0, 2**32 - 1))
def test_stress_turns_with_the_body(seed: int) -> None:
    R, F = Rotation.random(rng=np.random.default_rng(seed)).as_matrix(), near_identity(seed)
    mu, lam = np.array(MU), np.array(LAM)
    assert stress(R @ F, mu, lam) == pytest.approx(R @ stress(F, mu, lam), abs=1e-12 * MU)


@pytest.mark.parametrize("seed", range(5))
def test_stress_and_its_change_are_slopes(seed: int) -> None:
    """Central differences with step 1e-5: truncation 1e-10, round-off 1e-11."""
    mu, lam, step = np.array(MU), np.array(LAM), 1e-5
    F, dF = near_identity(seed), np.random.default_rng(seed + 100).uniform(-1, 1, (3, 3))
    ahead, behind = F + step * dF, F - step * dF
    slope = (psi(ahead, mu, lam) - psi(behind, mu, lam)) / (2 * step)
    assert slope == pytest.approx(np.sum(stress(F, mu, lam) * dF), abs=1e-7)
    change = (stress(ahead, mu, lam) - stress(behind, mu, lam)) / (2 * step)
    assert change == pytest.approx(stress_change(F, dF, mu, lam), abs=1e-6)


def test_small_strain_is_hookes_law() -> None:
    """2 mu e + lambda tr(e) I; the next term is of the order of the square of the strain, 1e-6 here."""
    e = np.random.default_rng(0).uniform(-1, 1, (3, 3)) * 1e-6
    e = (e + e.T) / 2
    expected = 2 * MU * e + LAM * np.trace(e) * np.eye(3)
    assert stress(np.eye(3) + e, np.array(MU), np.array(LAM)) == pytest.approx(expected, abs=1e-4 * MU * 1e-6)


def test_pure_dilation_in_closed_form() -> None:
    """F = s I: psi = 3/2 mu (s^2 - 1) - 3 mu ln s + 9/2 lambda ln(s)^2."""
    s = 1.3
    expected = 1.5 * MU * (s**2 - 1) - 3 * MU * np.log(s) + 4.5 * LAM * np.log(s) ** 2
    assert psi(s * np.eye(3), np.array(MU), np.array(LAM)) == pytest.approx(expected, rel=1e-14)
