"""The same fibrils in another order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Ints
from circuittex.design import Material
from circuittex.design.declaration import keys
from circuittex.geometry.mesh import FibrilMesh


def reordered(mesh: FibrilMesh, order: Ints) -> tuple[FibrilMesh, Ints]:
    """The mesh whose fibril f is number `order[f]` of `mesh`, and for each of its nodes (N,) the number there.

    `order` (F,) is a permutation. Yarns keep their numbers, so that terminals and clamps are the same.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> mesh = build_mesh(plain_weave())
    >>> other, nodes = reordered(mesh, np.arange(80)[::-1])
    >>> other.yarn_names[other.yarn[0]], bool((other.position == mesh.position[nodes]).all())
    ('weft4', True)
    """
    counts, elements = np.diff(mesh.first_node)[order], np.diff(mesh.first_element)[order]
    nodes = np.concatenate([np.arange(mesh.first_node[f], mesh.first_node[f + 1]) for f in order])
    old = np.concatenate([np.arange(mesh.first_element[f], mesh.first_element[f + 1]) for f in order])
    place = np.argsort(nodes)
    tables = ["yarn", "length", "radius", *keys(Material), *(["material"] if len(mesh.material) else [])]
    other = replace(
        mesh,
        position=mesh.position[nodes],
        directors=mesh.directors[nodes],
        xi=mesh.xi[nodes],
        elements=place[mesh.elements[old]],
        first_node=np.concatenate([[0], np.cumsum(counts)]),
        first_element=np.concatenate([[0], np.cumsum(elements)]),
        **{name: getattr(mesh, name)[order] for name in tables},
    )
    return other, nodes
