"""The same fibrils in another order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Ints
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import material_fields


def permuted(mesh: FibrilMesh, permutation: Ints) -> tuple[FibrilMesh, Ints]:
    """The mesh whose fibril f is number `permutation[f]` of `mesh`, and for each of its nodes (N,) the number there.

    Yarns keep their numbers, so that terminals and clamps are the same.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> mesh = build_mesh(plain_weave())
    >>> other, nodes = permuted(mesh, np.arange(80)[::-1])
    >>> other.yarn_names[other.yarn[0]], bool((other.position == mesh.position[nodes]).all())
    ('weft4', True)
    """
    counts, elements = np.diff(mesh.first_node)[permutation], np.diff(mesh.first_element)[permutation]
    nodes = np.concatenate([np.arange(mesh.first_node[f], mesh.first_node[f + 1]) for f in permutation])
    old = np.concatenate([np.arange(mesh.first_element[f], mesh.first_element[f + 1]) for f in permutation])
    place = np.argsort(nodes)
    coats = "surface_conductivity", "bending_radius", "shell_thickness", "core_conductivity"
    there = [name for name in ("material", *coats) if len(getattr(mesh, name))]
    tables = ["yarn", "length", "radius", *material_fields(), *there]
    other = replace(
        mesh,
        position=mesh.position[nodes],
        directors=mesh.directors[nodes],
        xi=mesh.xi[nodes],
        natural=mesh.natural[nodes] if len(mesh.natural) else mesh.natural,
        elements=place[mesh.elements[old]],
        first_node=np.concatenate([[0], np.cumsum(counts)]),
        first_element=np.concatenate([[0], np.cumsum(elements)]),
        **{name: getattr(mesh, name)[permutation] for name in tables},
    )
    return other, nodes
