"""Fibrils as tubes: their surface, and what is known along them as values at mesh nodes and between them.

A *span* is the piece of a fibril between two neighbouring mesh nodes; there are I = N - F of them, fibril after fibril.
"""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.contact.state import ContactState
from circuittex.electrical.fields import Fields
from circuittex.geometry.mesh import FibrilMesh


def surface(mesh: FibrilMesh, x: Floats, sides: int) -> Floats:
    """(N, sides, 3) points on the deformed section circles, r + R cos t g1 + R sin t g2 [9], mm.

    `x` (N, 3, 3) are the nodal r, g1, g2.
    """
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    radius = mesh.radius[mesh.node_fibril]
    points: Floats = x[:, None, 0] + radius[:, None, None] * np.einsum("sd,ndk->nsk", ring, x[:, 1:])
    return points


def spans(mesh: FibrilMesh) -> Ints:
    """(I, 2) the two mesh nodes of each span."""
    start = np.delete(np.arange(mesh.n_nodes), mesh.end_nodes(+1))
    return np.stack([start, start + 1], axis=1)


def span_element(mesh: FibrilMesh) -> Ints:
    """(I,) element of each span."""
    return np.repeat(np.arange(len(mesh.elements)), mesh.order)


def at_nodes(mesh: FibrilMesh, fields: Fields, values: Floats) -> Floats:
    """(N,) nodal `values` (K,) of `fields`, such as its temperature, interpolated to the mesh nodes; nan stays nan."""
    start = _starts(mesh)
    result: Floats = np.interp(start[mesh.node_fibril] + mesh.xi, start[fields.fibril] + fields.xi, values)
    return result


def span_current(mesh: FibrilMesh, fields: Fields) -> Floats:
    """(I,) mean over each span of the current along +xi, A; exact for the piecewise constant current."""
    start = _starts(mesh)
    ends = start[fields.fibril[fields.segments]] + fields.xi[fields.segments]
    permutation = np.argsort(ends[:, 0], kind="stable")
    ends = ends[permutation]
    passed = np.cumsum(np.diff(ends, axis=1)[:, 0] * fields.segment_current[permutation])
    integral = np.stack([np.concatenate([[0.0], passed[:-1]]), passed], axis=1)
    nodes = spans(mesh)
    total = np.interp(start[mesh.node_fibril] + mesh.xi, ends.ravel(), integral.ravel())
    mean: Floats = np.diff(total[nodes], axis=1)[:, 0] / np.diff(mesh.xi[nodes], axis=1)[:, 0]
    return mean


def span_load(contacts: ContactState) -> Floats:
    """(I,) contact force per length of axis, N/mm: the sum of p w over the contacts on a span, over its length.

    Both sides of every contact count, each on its own fibril; forces from opposite sides add up (it is a magnitude).
    """
    mesh, nodes = contacts.mesh, spans(contacts.mesh)
    fibril = np.concatenate([contacts.fibril_a, contacts.fibril_b])
    xi = np.concatenate([contacts.xi_a, contacts.xi_b])
    force = np.tile(contacts.line_load * contacts.weight, 2)
    start = _starts(mesh)
    node = np.searchsorted(start[mesh.node_fibril] + mesh.xi, start[fibril] + xi, side="right") - 1
    node = np.clip(node, mesh.first_node[fibril], mesh.first_node[fibril + 1] - 2)
    total = np.bincount(node - fibril, weights=force, minlength=len(nodes))
    load: Floats = total / np.diff(mesh.xi[nodes], axis=1)[:, 0]
    return load


def _starts(mesh: FibrilMesh) -> Floats:
    # All fibrils one after the other on one coordinate, start + xi, with gaps: one interpolation serves them all.
    return np.concatenate([[0.0], np.cumsum(mesh.length[:-1] + mesh.length.max())])
