"""A configuration on another mesh: what is exact, and what must not change."""

from __future__ import annotations

import numpy as np
import pytest
from fabrics import small_cell
from scipy.interpolate import BarycentricInterpolator
from scipy.spatial.transform import Rotation

from circuittex.base.arrays import Floats
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.relaxation.transfer import transfer

ROUNDING = 1e-13  # relative, of a few products of numbers of order one to ten


def mesh_of(elements: int, order: int = 2) -> FibrilMesh:
    return small_cell((1, 2), elements=elements, order=order)[1]


def random_configuration(mesh: FibrilMesh) -> Configuration:
    return Configuration(np.random.default_rng(3).normal(size=(mesh.n_nodes, 3, 3)))


def polynomials(mesh: FibrilMesh, degree: int) -> Configuration:
    """Another polynomial of xi3 for every component on every fibril."""
    coefficients = np.random.default_rng(5).normal(size=(mesh.n_fibrils, degree + 1, 3, 3))
    powers = mesh.xi[:, None] ** np.arange(degree + 1)
    return Configuration(np.einsum("np,npij->nij", powers, coefficients[mesh.node_fibril]))


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("elements", [3, 5, 6, 12, 13])
def test_polynomials_of_the_elements_order_are_exact_on_any_mesh(order: int, elements: int) -> None:
    source, target = mesh_of(6, order), mesh_of(elements * (3 - order), order)
    found = transfer(polynomials(source, order), source, target)
    np.testing.assert_allclose(found.x, polynomials(target, order).x, rtol=ROUNDING, atol=ROUNDING)


def test_a_mesh_of_twice_as_many_elements_holds_the_same_function() -> None:
    """At places between the nodes, against SciPy's interpolation of each element by itself."""
    source, target = mesh_of(4), mesh_of(8)
    state = random_configuration(source)
    finer = transfer(state, source, target)
    t = np.array([0.1, 0.3, 0.45])

    def values(mesh: FibrilMesh, x: Floats, element: int, at: Floats) -> Floats:
        return np.asarray(BarycentricInterpolator([0.0, 0.5, 1.0], x[mesh.elements[element]])(at))

    for element in (0, 3, 4, 17):
        for half in (0, 1):
            expected = values(source, state.x, element, t + half / 2)
            found = values(target, finer.x, 2 * element + half, 2 * t)
            np.testing.assert_allclose(found, expected, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("order", [1, 2])
def test_there_and_back_is_bit_for_bit(order: int) -> None:
    source, target = mesh_of(6, order), mesh_of(12, order)
    state = random_configuration(source)
    back = transfer(transfer(state, source, target), target, source)
    assert np.array_equal(back.x, state.x)


def test_a_coarser_mesh_takes_the_values_at_its_nodes() -> None:
    source, target = mesh_of(8), mesh_of(4)
    state = random_configuration(source)
    found = transfer(state, source, target)
    nodes = state.x.reshape(source.n_fibrils, -1, 3, 3)
    assert np.array_equal(found.x.reshape(target.n_fibrils, -1, 3, 3), nodes[:, ::2])


@pytest.mark.parametrize("elements", [3, 5, 7, 12])
def test_clamped_ends_stay_where_they_are(elements: int) -> None:
    source, target = mesh_of(6), mesh_of(elements)
    state = random_configuration(source)
    found = transfer(state, source, target)
    for side in (-1, 1):
        assert np.array_equal(found.x[target.end_nodes(side)], state.x[source.end_nodes(side)])


def test_a_moved_body_is_moved_on_the_other_mesh() -> None:
    source, target = mesh_of(6), mesh_of(5)
    turn, shift = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix(), np.array([3.0, -2.0, 5.0])

    def moved(state: Configuration) -> Floats:
        x = state.x @ turn.T
        x[:, 0] += shift
        return x

    state = initial_configuration(source)
    found = transfer(Configuration(moved(state)), source, target)
    np.testing.assert_allclose(found.x, moved(transfer(state, source, target)), rtol=0, atol=ROUNDING)
