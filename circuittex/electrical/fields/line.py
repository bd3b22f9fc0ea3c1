"""The line mesh of all fibrils for the field problems, and where the contacts sit on it."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState
from circuittex.geometry.mesh import FibrilMesh

ROUNDING = 1e-9
"""Feet closer than this fraction of the fibril's length share a node: shorter elements only add rounding errors."""


@frozen
class FibrilLine:
    """The line mesh of all fibrils, each on its own [0, L], and where the contacts sit on it."""

    fibril: Ints
    """(K,) fibril of each node, K nodes, fibril after fibril in axis order."""
    xi: Floats
    """(K,) axis coordinate, mm."""
    segments: Ints
    """(S, 2) node numbers of each element."""
    element: Ints
    """(S,) element of the mechanics in which each lies."""
    conduction: Floats
    """(S,) sigma A times axial factor, S mm."""
    thermal: Floats
    """(S,) k A, W mm/K."""
    ends: Ints
    """(2, F) nodes at xi = 0 and xi = L."""
    foot_segment: Ints
    """(2, C) element that carries the foot on fibril a and on fibril b."""
    foot_local: Floats
    """(2, C) coordinate of the foot in its element, 0 to 1."""


def fibril_line(contacts: ContactState, *, refine: bool, elements: bool = False) -> FibrilLine:
    """The mesh of the mechanics or, refined, the one whose nodes are the feet of the contacts; with `elements` those of
    the mechanics as well."""
    mesh = contacts.mesh
    foot_fibril = np.stack([contacts.fibril_a, contacts.fibril_b])
    foot_xi = _checked_feet(mesh, foot_fibril, np.stack([contacts.xi_a, contacts.xi_b]))
    if refine:
        fibril, xi, foot_xi = _refined_nodes(contacts, foot_fibril, foot_xi, elements)
    else:
        fibril, xi = mesh.node_fibril, mesh.xi
    left = np.flatnonzero(fibril[1:] == fibril[:-1])
    segments = np.column_stack([left, left + 1])
    owner = fibril[left]
    middle = 0.5 * (xi[left] + xi[left + 1])
    element = _locate(mesh, mesh.element_fibril, mesh.xi[mesh.elements[:, 0]], owner, middle)
    foot_segment = _locate(mesh, owner, xi[left], foot_fibril, foot_xi)
    start, stop = xi[segments[foot_segment]].transpose(2, 0, 1)
    return FibrilLine(
        fibril=fibril,
        xi=xi,
        segments=segments,
        element=element,
        conduction=(mesh.electrical_conductivity * mesh.area)[owner] * contacts.axial_factor[element],
        thermal=(mesh.thermal_conductivity * mesh.area)[owner],
        ends=np.stack([np.searchsorted(fibril, np.arange(mesh.n_fibrils), side) for side in ("left", "right")])
        - np.array([[0], [1]]),
        foot_segment=foot_segment,
        foot_local=(foot_xi - start) / (stop - start),
    )


def _checked_feet(mesh: FibrilMesh, fibril: Ints, xi: Floats) -> Floats:
    """The feet, those beyond an end by no more than rounding put there; DesignError for all other feet outside."""
    length = mesh.length[fibril]
    on_fibril = np.clip(xi, 0.0, length)
    outside = np.argwhere(~(np.abs(xi - on_fibril) <= ROUNDING * length))
    if len(outside):
        side, contact = outside[0]
        raise DesignError(
            f"xi_{'ab'[side]}[{contact}]", float(xi[side, contact]), f"it must lie in [0, {length[side, contact]}] mm"
        )
    return on_fibril


def _refined_nodes(
    contacts: ContactState, foot_fibril: Ints, foot_xi: Floats, elements: bool
) -> tuple[Ints, Floats, Floats]:
    """Nodes at the ends, at the feet and, if asked for or the conduction varies along the axis, between the elements.

    Returns fibril and coordinate of the nodes, and the coordinate of the node that each foot became.
    """
    mesh = contacts.mesh
    every = np.arange(mesh.n_fibrils)
    varies = elements or np.any(contacts.axial_factor != 1.0)
    breaks = mesh.elements[:, 0] if varies else np.empty(0, dtype=np.int64)
    fibril = np.concatenate([every, every, mesh.node_fibril[breaks], foot_fibril.ravel()])
    xi = np.concatenate([np.zeros(mesh.n_fibrils), mesh.length, mesh.xi[breaks], foot_xi.ravel()])
    permutation = np.lexsort((xi, fibril))
    same_fibril = np.diff(fibril[permutation]) == 0
    apart = np.diff(xi[permutation]) > ROUNDING * mesh.length[fibril[permutation[1:]]]
    first = np.concatenate([[True], ~same_fibril | apart])
    node = np.empty(len(permutation), dtype=np.int64)
    node[permutation] = np.cumsum(first) - 1
    node_xi = xi[permutation[first]]
    node_xi[node[mesh.n_fibrils : 2 * mesh.n_fibrils]] = mesh.length
    return (
        fibril[permutation[first]],
        node_xi,
        node_xi[node[-foot_xi.size :]].reshape(foot_xi.shape) if foot_xi.size else foot_xi,
    )


def _locate(mesh: FibrilMesh, owner: Ints, start: Floats, fibril: Ints, xi: Floats) -> Ints:
    """The element that contains each point, of elements sorted by `owner` and `start`."""
    # Fibril f covers the keys f to f + 1/2, so that one search serves all fibrils.
    key = owner + 0.5 * start / mesh.length[owner]
    found: Ints = np.searchsorted(key, fibril + 0.5 * xi / mesh.length[fibril], side="right") - 1
    return found
