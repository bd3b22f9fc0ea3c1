"""From a design to the flat mesh of its fibrils."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.design import Design, Material, Weave
from circuittex.design.declaration import keys
from circuittex.geometry.centre_lines import centre_lines
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.overlap import check_overlaps, check_starting_sides


def build_mesh(design: Design) -> FibrilMesh:
    """The flat mesh of all fibrils in their initial, unrelaxed positions: warp yarns first, each row by row.

    Nodes are equally spaced in xi3; elements of order 2 have one in their middle. See `centre_lines` for
    where the fibrils run.

    Raises `DesignError` where fibrils start more than the smaller radius inside one another, or in another order
    than the draft's.

    >>> from circuittex.design import plain_weave
    >>> mesh = build_mesh(plain_weave())
    >>> mesh.n_fibrils, mesh.n_nodes, mesh.order
    (80, 3280, 2)
    """
    weave, numerics = design.weave, design.numerics
    check_overlaps(weave, design.packing)
    check_starting_sides(weave, design.packing)
    elements = design.resolution.elements
    n_nodes = numerics.order * elements + 1
    lines = centre_lines(weave, n_nodes, design.packing)
    n_fibrils = len(lines.yarn)
    first_node = np.arange(n_fibrils + 1) * n_nodes
    within = np.arange(elements)[:, None] * numerics.order + np.arange(numerics.order + 1)
    materials = [material for kind in weave.yarns for material in kind.fibrils]
    surfaces = [material for kind in weave.yarns for material in kind.surfaces]
    names = list(dict.fromkeys(material.name for material in surfaces))
    return FibrilMesh(
        position=lines.position.reshape(-1, 3),
        directors=lines.directors.reshape(-1, 2, 3),
        xi=lines.xi.reshape(-1),
        elements=(first_node[:-1, None, None] + within).reshape(-1, numerics.order + 1),
        first_node=first_node,
        first_element=np.arange(n_fibrils + 1) * elements,
        yarn=lines.yarn,
        length=lines.length,
        radius=np.array([kind.radius for kind in weave.yarns])[lines.yarn],
        **{name: np.array([getattr(material, name) for material in materials]) for name in material_fields()},
        yarn_names=weave.yarn_names,
        yarn_axis=np.repeat([0, 1], [len(weave.warp), len(weave.weft)]),
        material=np.array([names.index(material.name) for material in surfaces]),
        material_names=tuple(names),
        natural=lines.natural.reshape(-1, 3, 3),
        **(_coats(weave, surfaces) if any(kind.coated for kind in weave.yarns) else {}),
    )


def _coats(weave: Weave, surfaces: list[Material]) -> dict[str, Floats]:
    """What the mesh holds of fibrils some of which are coated."""
    return {
        "surface_conductivity": np.array([material.electrical_conductivity for material in surfaces]),
        "bending_radius": np.array([radius for kind in weave.yarns for radius in kind.bending_radii]),
        "shell_thickness": np.array([kind.shell_thickness for kind in weave.yarns for _ in kind.materials]),
        "core_conductivity": np.array(
            [core.electrical_conductivity for kind in weave.yarns for core in kind.materials]
        ),
    }


def material_fields() -> list[str]:
    """The fields of a material that the mesh holds: what only exported parts use, tolerances and tc1, it does not."""
    return [name for name in keys(Material) if name in {field.name for field in fields(FibrilMesh)}]
