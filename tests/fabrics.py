"""Small fabrics made by hand, shared by the tests of contact, relaxation and dynamics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicHermiteSpline

from circuittex.base.arrays import Floats, Ints
from circuittex.contact.penalty import PenaltyContact
from circuittex.design import ContactLaw, Design, Material, Weave, Yarn, plain_weave
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.permutation import permuted
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.space import beam_space
from circuittex.relaxation.relax import Equilibrium


@dataclass
class Cell:
    """A woven cell in two states."""

    design: Design
    mesh: FibrilMesh
    relaxed: Equilibrium
    stretched: Equilibrium


def resized(weave: Weave, s: float, material: Callable[[Material], Material]) -> Weave:
    """The weave with lengths times s and each material as `material` makes it."""

    def yarns(of: tuple[Yarn, ...]) -> tuple[Yarn, ...]:
        return tuple(
            replace(
                yarn,
                radius=s * yarn.radius,
                spacing=s * yarn.spacing,
                row_spacing=s * yarn.row_spacing,
                materials=tuple(map(material, yarn.materials)),
            )
            for yarn in of
        )

    return replace(
        weave,
        warp=yarns(weave.warp),
        weft=yarns(weave.weft),
        pitch=s * weave.pitch,
        amplitude=s * weave.amplitude,
    )


def fibrils_through(
    lines: Sequence[ArrayLike],
    *,
    order: int = 1,
    radius: ArrayLike = 0.15,
    length: ArrayLike | None = None,
    modulus: ArrayLike = 10.0,
    poisson: ArrayLike = 0.0,
    sigma: ArrayLike = 10.0,
) -> FibrilMesh:
    """Fibrils through given nodes (n, 3) each; natural lengths are by default those of the polylines."""
    nodes = [np.asarray(line, dtype=float) for line in lines]
    counts = np.array([len(line) for line in nodes])
    elements = (counts - 1) // order
    assert np.all(elements * order == counts - 1)
    polyline = [np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in nodes]
    L = np.broadcast_to(np.asarray(polyline if length is None else length, dtype=float), counts.shape).copy()
    first = np.concatenate([[0], np.cumsum(counts)])

    def table(value: ArrayLike) -> Floats:
        return np.broadcast_to(np.asarray(value, dtype=float), counts.shape).copy()

    return FibrilMesh(
        position=np.concatenate(nodes),
        directors=np.concatenate([_frames(line) for line in nodes]),
        xi=np.concatenate([np.linspace(0.0, L[f], counts[f]) for f in range(len(nodes))]),
        elements=np.concatenate(
            [first[f] + order * np.arange(elements[f])[:, None] + np.arange(order + 1) for f in range(len(nodes))]
        ),
        first_node=first,
        first_element=np.concatenate([[0], np.cumsum(elements)]),
        yarn=np.arange(len(nodes)),
        length=L,
        radius=table(radius),
        youngs_modulus=table(modulus),
        poisson_ratio=table(poisson),
        density=table(1.0),
        electrical_conductivity=table(sigma),
        thermal_conductivity=table(1.0),
        yarn_names=tuple(f"warp{f + 1}" for f in range(len(nodes))),
        yarn_axis=np.zeros(len(nodes), dtype=np.int64),
    )


def _frames(line: Floats) -> Floats:
    """(n, 2, 3) directors across a line, right-handed with its tangent."""
    tangent = np.gradient(line, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    g1 = np.cross(tangent, np.eye(3)[np.argmin(np.abs(tangent).max(axis=0))])
    g1 /= np.linalg.norm(g1, axis=1)[:, None]
    return np.stack([g1, np.cross(tangent, g1)], axis=1)


def straight(start: ArrayLike, stop: ArrayLike, elements: int, order: int = 1) -> Floats:
    """Equally spaced nodes from `start` to `stop`."""
    t = np.linspace(0.0, 1.0, elements * order + 1)[:, None]
    return np.asarray((1 - t) * np.asarray(start, dtype=float) + t * np.asarray(stop, dtype=float))


def tangle(
    seed: int,
    *,
    fibrils: int = 6,
    elements: int = 8,
    order: int = 1,
    bend: float = 0.8,
    noise: float = 0.0,
    radius: ArrayLike = 0.15,
) -> FibrilMesh:
    """Random fibrils, 0.5 to 5 mm long, that cross one another: waves of curvature up to `bend` (1/mm).

    As long as the radius of curvature exceeds R + R' a point in contact has one closest point on a fibril.
    `noise` (mm) on each node takes that away.
    """
    rng = np.random.default_rng(seed)
    lines = []
    for _ in range(fibrils):
        start, stop = rng.uniform(-1, 1, (2, 3))
        stop[0] += 2.5
        length, half_waves = np.linalg.norm(stop - start), rng.uniform(1, 3)
        across = np.cross(stop - start, rng.normal(size=3))
        size = rng.uniform(0, bend) * (length / (half_waves * np.pi)) ** 2
        line = straight(start, stop, elements, order)
        t = np.linspace(0.0, 1.0, len(line))[:, None]
        line += size * across / np.linalg.norm(across) * np.sin(half_waves * np.pi * t + rng.uniform(0, 6))
        lines.append(line + noise * rng.normal(size=line.shape))
    return fibrils_through(lines, order=order, radius=radius)


def renumbered(
    mesh: FibrilMesh, permutation: Sequence[int] | Ints, flip: Sequence[int] = ()
) -> tuple[FibrilMesh, Ints]:
    """The same fibrils in another order, those in `flip` (old numbers) run through backwards.

    Returns the mesh and, for each of its nodes, the node's number in the old one. The first director changes sign
    along with the tangent, so that the frames stay right-handed.
    """
    other, node = permuted(mesh, np.asarray(permutation))
    for number, fibril in enumerate(permutation):
        nodes = slice(other.first_node[number], other.first_node[number + 1])
        node[nodes] = node[nodes][:: -1 if fibril in flip else 1]
    directors = mesh.directors[node].copy()
    directors[np.isin(mesh.node_fibril[node], list(flip)), 0] *= -1
    return replace(other, position=mesh.position[node], directors=directors), node


def mirrored(mesh: FibrilMesh, axis: int) -> FibrilMesh:
    """The mirror image; the second director changes sign, so that the frames stay right-handed."""
    sign = np.ones(3)
    sign[axis] = -1.0
    directors = mesh.directors * sign
    directors[:, 1] *= -1
    return replace(mesh, position=mesh.position * sign, directors=directors)


def reference_curve(mesh: FibrilMesh, r: Floats, fibril: int) -> CubicHermiteSpline:
    """SciPy's cubic Hermite spline with the tangents that the contact curve should have."""
    x = r[mesh.first_node[fibril] : mesh.first_node[fibril + 1]]
    tangent = np.empty_like(x)
    tangent[1:-1] = (x[2:] - x[:-2]) / 2
    tangent[0] = (-3 * x[0] + 4 * x[1] - x[2]) / 2
    tangent[-1] = (3 * x[-1] - 4 * x[-2] + x[-3]) / 2
    return CubicHermiteSpline(np.arange(len(x)), x, tangent)


def contact_term(
    mesh: FibrilMesh, *, penalty: float = 5.0, per_element: int = 4, skin: float = 0.05
) -> tuple[PenaltyContact, Floats]:
    """The contact term of a mesh and the vector of unknowns of its initial configuration."""
    space = beam_space(mesh)
    term = PenaltyContact(mesh, law=ContactLaw(penalty, 0.0, 0.0), per_element=per_element, skin=skin)
    return term, space.vector(initial_configuration(mesh))


def small_cell(
    rows: tuple[int, ...] = (1, 2), *, yarns: int = 2, elements: int = 6, order: int = 2, **numerics: float | int | str
) -> tuple[Design, FibrilMesh]:
    """A cell of two by two yarns with few elements, and its mesh."""
    design = plain_weave(yarns=yarns, rows=rows)
    choice = replace(design.numerics, elements=elements, order=order, **numerics)
    design = replace(design, numerics=choice)
    return design, build_mesh(design)
