"""The same fibrils in another order: every one of them as it was, and back again."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from fabrics import small_cell

from circuittex.base.frozen import same
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.permutation import permuted
from circuittex.geometry.weave import material_fields


def uneven() -> FibrilMesh:
    """Six fibrils of which no two have the same number in any table, one with fewer elements."""
    _, mesh = small_cell((1, 2), elements=4)
    short = mesh.first_node[-2] + 5  # the last fibril's first two quadratic elements
    few = {name: getattr(mesh, name)[:short] for name in ("position", "directors", "xi")}
    last = mesh.first_element[-2] + 2
    number = np.arange(1.0, mesh.n_fibrils + 1)
    names = "length radius youngs_modulus poisson_ratio density electrical_conductivity thermal_conductivity"
    return replace(
        mesh,
        **few,
        elements=mesh.elements[:last],
        first_node=np.append(mesh.first_node[:-1], short),
        first_element=np.append(mesh.first_element[:-1], last),
        material=np.arange(mesh.n_fibrils),
        **{name: number + 100 * place for place, name in enumerate(names.split())},
    )


def parts(mesh: FibrilMesh, fibril: int) -> tuple[np.ndarray | float, ...]:
    """All that a mesh says of one fibril, its nodes numbered from 0."""
    first, last = mesh.first_node[fibril : fibril + 2]
    nodal = (getattr(mesh, name)[first:last] for name in ("position", "directors", "xi"))
    elements = mesh.elements[mesh.first_element[fibril] : mesh.first_element[fibril + 1]] - first
    tables = [f.name for f in fields(mesh) if getattr(getattr(mesh, f.name), "shape", ()) == (mesh.n_fibrils,)]
    assert len(tables) == 3 + len(material_fields()) + 1
    return (*nodal, elements, *(getattr(mesh, name)[fibril] for name in tables))


@pytest.mark.parametrize("seed", [0, 1])
def test_every_fibril_is_what_it_was(seed: int) -> None:
    mesh = uneven()
    permutation = np.random.default_rng(seed).permutation(mesh.n_fibrils)
    other, nodes = permuted(mesh, permutation)
    assert np.any(permutation != np.arange(mesh.n_fibrils))
    for number, old in enumerate(permutation):
        assert same(parts(other, number), parts(mesh, old))
        first, last = other.first_node[number : number + 2]
        assert np.array_equal(nodes[first:last], np.arange(mesh.first_node[old], mesh.first_node[old + 1]))


def test_the_inverse_order_gives_the_mesh_back() -> None:
    mesh = uneven()
    permutation = np.random.default_rng(2).permutation(mesh.n_fibrils)
    other, nodes = permuted(mesh, permutation)
    back, again = permuted(other, np.argsort(permutation))
    assert same(back, mesh)
    assert np.array_equal(nodes[again], np.arange(mesh.n_nodes))
