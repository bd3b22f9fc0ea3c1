"""A configuration of the fibrils carried over to another mesh of the same fibrils."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration


def transfer(configuration: Configuration, source: FibrilMesh, target: FibrilMesh) -> Configuration:
    """The finite element field of `configuration` on `source`, taken at the nodes of `target`.

    Both meshes hold the same fibrils with equally spaced nodes and elements of the same order. On a mesh whose
    elements are equal parts of those of `source` the field is the same function; elsewhere it is interpolated.
    Ends of fibrils, which clamps hold, stay exactly where they are.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> from circuittex.mech.configuration import initial_configuration
    >>> mesh = build_mesh(plain_weave())
    >>> there = transfer(initial_configuration(mesh), mesh, mesh)
    >>> bool((there.r == mesh.position).all())
    True
    """
    fibril = target.node_fibril
    node = np.arange(target.n_nodes) - target.first_node[fibril]
    elements, intervals = np.diff(source.first_element)[fibril], np.diff(target.first_node)[fibril] - 1
    place = node * elements / intervals  # in elements of the source: one rounding, none where meshes are nested
    element = np.minimum(place.astype(np.int64), elements - 1)
    return Configuration(field_at(configuration.x, source, fibril, element, place - element))


def field_at(x: Floats, mesh: FibrilMesh, fibril: Ints, element: Ints, t: Floats) -> Floats:
    """(n, 3, 3) the finite element field of nodal values x (N, 3, 3) at places on fibrils, all (n,).

    `element` counts those of the fibril, and t is the place in it, from 0 to 1.
    """
    nodes = mesh.elements[mesh.first_element[fibril] + element]
    return np.asarray(np.einsum("na,naij->nij", shape_functions(t, mesh.order), x[nodes]))


def shape_functions(t: Floats, order: int) -> Floats:
    """(n, order + 1) Lagrange polynomials on an element's nodes, in axis order, at local coordinates t (n,) in [0, 1].

    >>> shape_functions(np.array([0.0, 0.5, 1.0]), 2) + 0.0
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    if order == 1:
        return np.stack([1 - t, t], axis=1)
    return np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=1)
