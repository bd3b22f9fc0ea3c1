"""The frozen contact state against closed forms: loads, widths, conductances, and conduction along the axis."""

from __future__ import annotations

import numpy as np
import pytest
from fabrics import fibrils_through, renumbered, straight, tangle
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from circuittex.contact.extract import axial_factor, contact_state
from circuittex.contact.state import ContactState
from circuittex.design import ContactLaw
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.space import beam_space

LAW = ContactLaw(penalty=5.0, conductivity=0.01, heat_transfer=0.1)
LENGTH, APART = 2.0, 0.25


def rails(order: int = 2, sigma: ArrayLike = 10.0, **properties: ArrayLike) -> FibrilMesh:
    """Two parallel fibrils that overlap by R + R' - 0.25 mm all along."""
    lines = [straight([0, 0, z], [LENGTH, 0, z], 6, order) for z in (0.0, APART)]
    return fibrils_through(lines, order=order, sigma=sigma, **properties)


def state_of(mesh: FibrilMesh, per_element: int = 4) -> ContactState:
    return contact_state(mesh, initial_configuration(mesh), LAW, per_element=per_element)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("per_element", [1, 3, 4])
def test_parallel_fibrils_touch_along_their_whole_length(order: int, per_element: int) -> None:
    state = state_of(rails(order), per_element)
    assert state.n_contacts == 2 * 6 * per_element
    assert state.weight.sum() == pytest.approx(LENGTH, rel=1e-14)
    assert state.weight[state.fibril_a == 0].sum() == pytest.approx(LENGTH / 2, rel=1e-14)
    at = (np.arange(6 * per_element) + 0.5) * LENGTH / (6 * per_element)
    for f in (0, 1):
        assert np.sort(state.xi_a[state.fibril_a == f]) == pytest.approx(at, abs=1e-14)
    assert state.xi_b == pytest.approx(state.xi_a, abs=1e-13)
    assert np.array_equal(state.fibril_a + state.fibril_b, np.ones(state.n_contacts))


def test_load_width_and_conductances_of_parallel_fibrils() -> None:
    """o = 0.05 mm, p = 0.25 N/mm, R* = 0.075 mm, E* = 5 MPa: a = sqrt(4 R* p / (pi E*)), G = sigma_c a w."""
    state = state_of(rails())
    load = 5.0 * 0.05
    width = np.sqrt(4 * 0.075 * load / (np.pi * 5.0))
    assert state.gap == pytest.approx(-0.05, rel=1e-13)
    assert state.line_load == pytest.approx(load, rel=1e-13)
    assert state.width == pytest.approx(width, rel=1e-13)
    assert state.conductance.sum() == pytest.approx(0.01 * width * LENGTH, rel=1e-13)
    assert state.heat_conductance.sum() == pytest.approx(0.1 * width * LENGTH, rel=1e-13)


def test_unlike_fibrils() -> None:
    """R* = 0.06 mm from 0.1 and 0.15, 1/E* = 1/10 + (1 - 0.3^2)/100: the same from either side."""
    state = state_of(rails(radius=[0.1, 0.18], modulus=[10.0, 100.0], poisson=[0.0, 0.3]))
    radius, modulus, load = 1 / (1 / 0.1 + 1 / 0.18), 1 / (0.1 + 0.91 / 100), 5.0 * (0.28 - APART)
    assert state.line_load == pytest.approx(load, rel=1e-12)
    assert state.width == pytest.approx(np.sqrt(4 * radius * load / (np.pi * modulus)), rel=1e-12)


@pytest.mark.parametrize("sigma", [[0.0, 10.0], [10.0, 0.0], [0.0, 0.0]])
def test_insulating_fibrils_pass_heat_but_no_current(sigma: list[float]) -> None:
    state = state_of(rails(sigma=sigma))
    assert np.all(state.conductance == 0.0)
    assert np.all(state.heat_conductance > 0.0)


def test_different_conductivities_do_not_enter_the_contact() -> None:
    """G = sigma_c a w: the fibrils' own conductivity belongs to the fibrils."""
    assert np.array_equal(state_of(rails(sigma=[10.0, 0.1])).conductance, state_of(rails()).conductance)


def test_coordinates_are_those_of_the_natural_length() -> None:
    """A fibril of natural length 1 stretched to 2 mm has its contacts in [0, 1], of total weight 1."""
    mesh = rails(length=[1.0, LENGTH])
    state = state_of(mesh)
    first = state.fibril_a == 0
    assert state.weight[first].sum() == pytest.approx(1.0 / 2, rel=1e-14)
    assert state.xi_a[first].max() < 1.0
    assert state.xi_b[first] == pytest.approx(2 * state.xi_a[first], rel=1e-12)


def test_no_contact_is_an_empty_state() -> None:
    state = state_of(fibrils_through([straight([0, y, 0], [1, y, 0], 4) for y in (0, 1)]))
    assert state.n_contacts == 0
    assert state.conductance.shape == (0,)


@given(seed=st.integers(0, 2**32 - 1), order=st.sampled_from([1, 2]))
def test_renumbering_fibrils_keeps_every_contact(seed: int, order: int) -> None:
    mesh = tangle(seed, fibrils=4, elements=6 // order, order=order, radius=0.25)
    place = np.random.default_rng(seed).permutation(4)
    state, other = state_of(mesh), state_of(renumbered(mesh, place)[0])
    assert other.n_contacts == state.n_contacts
    names = np.lexsort((other.fibril_b, other.xi_a, place[other.fibril_a]))
    order_here = np.lexsort((state.fibril_b, state.xi_a, state.fibril_a))
    # Points of one fibril that touch several others share xi_a: compare sums over each point instead of rows.
    assert np.array_equal(np.sort(place[other.fibril_a]), np.sort(state.fibril_a))
    assert other.xi_a[names] == pytest.approx(state.xi_a[order_here], abs=1e-12)
    for name in ("gap", "width", "conductance", "xi_b"):
        assert np.sort(getattr(other, name)) == pytest.approx(np.sort(getattr(state, name)), abs=1e-10)


def test_reference_law_keeps_conduction_along_the_axis() -> None:
    assert np.all(state_of(rails(length=1.0)).axial_factor == 1.0)


@pytest.mark.parametrize("order", [1, 2])
def test_current_law_of_a_uniformly_stretched_fibril(order: int) -> None:
    """Stretched by 1.5, its section 0.9 by 0.8 and sheared along the axis: A_now/A = 0.72, factor 0.72 / 1.5 = 0.48."""
    mesh = fibrils_through([straight([0, 0, 0], [3.0, 0, 0], 5, order)], order=order, length=2.0)
    x = initial_configuration(mesh).x.copy()
    x[:, 1] = [0.2, 0.9, 0.0]
    x[:, 2] = [-0.1, 0.0, 0.8]
    assert axial_factor(beam_space(mesh), Configuration(x)) == pytest.approx(np.full(5, 0.48), rel=1e-13)


def test_current_law_does_not_feel_rotation() -> None:
    """A straight fibril in any direction, unstretched: factor 1."""
    mesh = fibrils_through([straight([0, 0, 0], [1.0, -2.0, 0.5], 5, 2)], order=2)
    assert axial_factor(beam_space(mesh), initial_configuration(mesh)) == pytest.approx(np.ones(5), rel=1e-13)


def test_current_law_puts_the_parts_of_an_element_in_series() -> None:
    """x = xi + b xi^2 on one element: resistance per reference length grows with stretch, its mean is exact.

    With A_now = A the element's factor is 1 / mean(1 + 2 b xi), and two Gauss points integrate that line exactly.
    """
    b = 0.1
    xi = np.linspace(0.0, 2.0, 5)
    line = np.stack([xi + b * xi**2, 0 * xi, 0 * xi], axis=1)
    mesh = fibrils_through([line], order=2, length=2.0)
    factor = axial_factor(beam_space(mesh), initial_configuration(mesh))
    assert factor == pytest.approx([1 / (1 + 2 * b * 0.5), 1 / (1 + 2 * b * 1.5)], rel=1e-13)


def test_conduction_law_is_chosen_by_name() -> None:
    mesh = rails(length=1.0)
    state = contact_state(mesh, initial_configuration(mesh), LAW, per_element=4, conduction="current")
    assert state.axial_factor == pytest.approx(np.full(12, 0.5), rel=1e-13)
