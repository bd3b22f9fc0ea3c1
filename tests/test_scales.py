"""The scales of fibrils: what they are by hand, and that nothing else enters them."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from beams import dense, rod
from hypothesis import given
from hypothesis import strategies as st

from circuittex.base.binary import power_of_two
from circuittex.contact.law import largest_penalty
from circuittex.design import ContactLaw, MaterialPair, Numerics
from circuittex.mech.beam import Beam
from circuittex.mech.pattern import build_pattern
from circuittex.mech.scales import BENDING, STRETCH, TURNING, Scales, fibril_scales
from circuittex.mech.space import beam_space

L, R, E, SPAN = 4.0, 0.15, 10.0, 2.0
A = pi * R**2


def scales(**options: float) -> tuple[Scales, np.ndarray]:
    """The scales of a rod, and their metric as a dense matrix."""
    space = beam_space(rod(L, 4, 2, radius=R, modulus=E))
    found = fibril_scales(space, SPAN, **options)
    pattern = build_pattern(space.mesh.n_nodes, *Beam(space).pairs())
    return found, dense(pattern, found.metric(pattern))


def test_the_metric_is_that_of_a_uniform_motion() -> None:
    """Squared, a unit translation weighs c E I L / span^4, and a unit change of one director's component c' E A L."""
    _, metric = scales()
    for row, expected in ((0, BENDING * E * A * R**2 / 4 / SPAN**4 * L), (1, TURNING * E * A * L)):
        motion = np.zeros((len(metric) // 9, 3, 3))
        motion[:, row, 2] = 1.0
        assert motion.ravel() @ metric @ motion.ravel() == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("penalty", "factor"), [(0.1, 1.0), (5.0, 1.0), (50.0, 10.0)])
def test_contacts_harder_than_the_fibril_raise_the_metric(penalty: float, factor: float) -> None:
    """By 2 P* / E."""
    assert scales(penalty=penalty)[1] == pytest.approx(factor * scales()[1], rel=1e-12)


def test_a_moment_counts_over_half_a_span() -> None:
    found, _ = scales()
    gradient = np.zeros(9 * 9)
    gradient[9 * 2 + 1], gradient[9 * 5 + 7] = -3.0, 4.0  # N, N mm
    assert found.forces(gradient) == pytest.approx([4.0 / (SPAN / 2)])
    gradient[9 * 2 + 1] = -5.0
    assert found.forces(gradient) == pytest.approx([5.0])
    assert found.largest_force == pytest.approx([STRETCH * E * A])


@given(size=st.floats(1e-200, 1e200), exponent=st.integers(-200, 200))
def test_a_power_of_two_is_just_below_and_follows(size: float, exponent: int) -> None:
    unit = power_of_two(size)
    assert unit <= size < 2 * unit
    assert power_of_two(size * 2.0**exponent) == unit * 2.0**exponent


def test_the_largest_penalty_is_that_with_any_other() -> None:
    """Hertz's of two soft fibrils, of soft and hard, and of a pair that states its own: E* = E/2 of equals, nu = 0."""
    mesh = rod(L, 4, 2, radius=R, modulus=E)
    two = {"youngs_modulus": np.array([10.0, 1e6, 10.0]), "poisson_ratio": np.zeros(3)}
    mesh = replace(mesh, **two, material=np.array([0, 1, 0]), material_names=("soft", "hard"))
    law = ContactLaw("hertz", 0.01, 0.1)
    softer = 1 / (1 / 10.0 + 1e-6) / 2
    assert largest_penalty(mesh, law) == pytest.approx([softer, 2.5e5, softer])
    pair = MaterialPair(70.0, 0.01, 0.1, ("soft", "hard"))
    assert largest_penalty(mesh, replace(law, pairs=(pair,))) == pytest.approx([70.0, 2.5e5, 70.0])


def test_a_tolerance_in_newtons_may_be_as_small_as_forces_are() -> None:
    numerics = Numerics(tolerance="1e-20 N")
    assert (numerics.relative_tolerance, numerics.force_tolerance) == (0.0, 1e-20)
    assert Numerics(tolerance="10 nN").tolerance == Numerics(tolerance="0.01 uN").tolerance
