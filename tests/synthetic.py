"""Small fibril meshes and contact states made by hand, shared by the tests of the electrical stages."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from circuittex.base.arrays import Floats, Ints
from circuittex.contact.state import ContactState
from circuittex.geometry.mesh import FibrilMesh


def fibrils(
    length: ArrayLike = (8.0,),
    *,
    elements: int = 4,
    order: int = 1,
    yarn: Sequence[int] | None = None,
    radius: ArrayLike = 0.15,
    sigma: ArrayLike = 10.0,
    k: ArrayLike = 1.0,
    yarn_names: Sequence[str] | None = None,
) -> FibrilMesh:
    """Straight fibrils along x, one for each length, by default each one a yarn of its own named warp1, warp2, ..."""
    L = np.atleast_1d(np.asarray(length, dtype=float))
    F, n = len(L), elements * order + 1
    xi = (L[:, None] * np.linspace(0.0, 1.0, n)).ravel()
    local = order * np.arange(elements)[:, None] + np.arange(order + 1)
    owner = np.arange(F) if yarn is None else np.asarray(yarn)
    names = tuple(yarn_names or (f"warp{i + 1}" for i in range(owner.max() + 1)))
    position = np.column_stack([xi, np.repeat(0.3 * np.arange(F), n), np.zeros(F * n)])

    def table(value: ArrayLike) -> Floats:
        return np.broadcast_to(np.asarray(value, dtype=float), (F,)).copy()

    return FibrilMesh(
        position=position,
        directors=np.tile(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), (F * n, 1, 1)),
        xi=xi,
        elements=(n * np.arange(F)[:, None, None] + local).reshape(-1, order + 1).astype(np.int64),
        first_node=(n * np.arange(F + 1)).astype(np.int64),
        first_element=(elements * np.arange(F + 1)).astype(np.int64),
        yarn=owner.astype(np.int64),
        length=L.copy(),
        radius=table(radius),
        youngs_modulus=table(10.0),
        poisson_ratio=table(0.0),
        density=table(1.0),
        electrical_conductivity=table(sigma),
        thermal_conductivity=table(k),
        yarn_names=names,
        yarn_axis=np.array([0 if name.startswith("warp") else 1 for name in names], dtype=np.int64),
    )


def touching(
    mesh: FibrilMesh,
    a: ArrayLike = (),
    xi_a: ArrayLike = (),
    b: ArrayLike = (),
    xi_b: ArrayLike = (),
    *,
    conductance: ArrayLike = 1e-3,
    heat_conductance: ArrayLike = 0.0,
    weight: ArrayLike = 0.1,
    axial_factor: ArrayLike = 1.0,
) -> ContactState:
    """Contact points with the given electrical and thermal conductances; their mechanics is made up."""
    fa, fb = (np.atleast_1d(np.asarray(v, dtype=np.int64)) for v in (a, b))
    C = len(fa)

    def table(value: ArrayLike, n: int = C) -> Floats:
        return np.broadcast_to(np.asarray(value, dtype=float), (n,)).copy()

    return ContactState(
        mesh=mesh,
        fibril_a=fa,
        fibril_b=fb,
        xi_a=table(xi_a),
        xi_b=table(xi_b),
        gap=table(-0.01),
        line_load=table(0.05),
        width=table(0.02),
        weight=table(weight),
        conductance=table(conductance),
        heat_conductance=table(heat_conductance),
        axial_factor=table(axial_factor, len(mesh.elements)),
    )


def rails(r: float, g: float, length: float, points: int, *, elements: int = 4) -> ContactState:
    """Two parallel fibrils of r ohm/mm each, coupled by g S/mm at `points` midpoints, half of it from either side."""
    sigma = 1.0 / (r * np.pi * 0.15**2)
    mesh = fibrils([length, length], elements=elements, sigma=sigma)
    at = (np.arange(points) + 0.5) * length / points
    ones = np.ones(points, dtype=np.int64)
    return touching(
        mesh,
        np.concatenate([0 * ones, ones]),
        np.tile(at, 2),
        np.concatenate([ones, 0 * ones]),
        np.tile(at, 2),
        conductance=0.5 * g * length / points,
        weight=0.5 * length / points,
    )


def woven(yarns: int = 4, per_yarn: int = 3, points: int = 8, *, seed: int = 0, elements: int = 8) -> ContactState:
    """A plain weave of `yarns` x `yarns` yarns with random contact points, `points` a pair of touching fibrils.

    Neighbouring fibrils of a yarn touch all along, fibrils of crossing yarns near the crossing, with the
    conductances of the paper's cell: sigma_c a w is some 1e-5 S.
    """
    rng = np.random.default_rng(seed)
    length = 2.0 * yarns
    names = [f"warp{i + 1}" for i in range(yarns)] + [f"weft{i + 1}" for i in range(yarns)]
    mesh = fibrils(
        np.full(2 * yarns * per_yarn, length),
        elements=elements,
        yarn=np.repeat(np.arange(2 * yarns), per_yarn).tolist(),
        yarn_names=names,
    )
    inside = [(y * per_yarn + j, y * per_yarn + j + 1, 0.0, 0.0) for y in range(2 * yarns) for j in range(per_yarn - 1)]
    across = [
        (i * per_yarn + p, (yarns + j) * per_yarn + q, 1.0 + 2.0 * j, 1.0 + 2.0 * i)
        for i in range(yarns)
        for j in range(yarns)
        for p in range(per_yarn)
        for q in range(per_yarn)
    ]
    table = np.repeat(np.array(inside + across), points, axis=0)
    along = table[:, 2] == 0.0
    at = rng.uniform(0.0, length, len(table))
    a: Ints = table[:, 0].astype(np.int64)
    b: Ints = table[:, 1].astype(np.int64)
    near = rng.uniform(-0.4, 0.4, (2, len(table)))
    xi_a = np.where(along, at, table[:, 2] + near[0])
    xi_b = np.where(along, np.clip(at + 0.05 * near[0], 0.0, length), table[:, 3] + near[1])
    swap = rng.random(len(table)) < 0.5
    g = rng.uniform(0.2, 2.0, len(table)) * 1e-5
    return touching(
        mesh,
        np.where(swap, b, a),
        np.where(swap, xi_b, xi_a),
        np.where(swap, a, b),
        np.where(swap, xi_a, xi_b),
        conductance=g,
        heat_conductance=10.0 * g,
        weight=rng.uniform(0.02, 0.05, len(table)),
    )
