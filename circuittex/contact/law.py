"""Contact laws: the penalty of a pair of fibrils, the Hertz half-width [29], and what differs from pair to pair."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.design import HERTZ, ContactLaw
from circuittex.geometry.mesh import FibrilMesh

CONSTANTS = ("reference_conductance", "reference_force", "exponent")
"""Properties of a pair that some laws of conductance take."""


def effective_modulus(e1: Floats, nu1: Floats, e2: Floats, nu2: Floats) -> Floats:
    """E*, MPa: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2."""
    return 1 / ((1 - nu1**2) / e1 + (1 - nu2**2) / e2)


def hertz_penalty(modulus: Floats) -> Floats:
    """P* = E*/2, N/mm2.

    A line load P* o on either of two crossing cylinders of equal radius R, integrated over the crossing, is
    8/3 P* sqrt(R) o^(3/2), and Hertz's point contact has 4/3 E* sqrt(R) o^(3/2) (Johnson, Contact Mechanics, 1985,
    section 4.2).
    """
    return modulus / 2


def effective_radius(r1: Floats, r2: Floats) -> Floats:
    """R*, mm: 1/R* = 1/R1 + 1/R2."""
    return 1 / (1 / r1 + 1 / r2)


def hertz_width(line_load: Floats, radius: Floats, modulus: Floats) -> Floats:
    """Contact half-width a = sqrt(4 R* p / (pi E*)) [29], mm, for a line load p in N/mm.

    The paper calls it the differential thickness of the contact and uses it as the width; in Hertz's theory the strip
    is twice as wide.

    >>> import numpy as np
    >>> float(hertz_width(np.array(np.pi), np.array(1.0), np.array(4.0)))
    1.0
    """
    return np.asarray(np.sqrt(4 * radius * line_load / (np.pi * modulus)))


def pair_penalty(mesh: FibrilMesh, law: ContactLaw, a: Ints, b: Ints) -> Floats:
    """P* (C,), N/mm2, of contacts between the fibrils a and b (C,); 'hertz' is that of `hertz_penalty`."""
    stated = _of_pairs(mesh, law, "penalty", a, b)
    e, nu = mesh.youngs_modulus, mesh.poisson_ratio
    return np.where(np.isnan(stated), hertz_penalty(effective_modulus(e[a], nu[a], e[b], nu[b])), stated)


def largest_penalty(mesh: FibrilMesh, law: ContactLaw) -> Floats:
    """(F,) the largest P* of a fibril with any of those in the mesh, N/mm2."""
    kinds = np.stack([mesh.youngs_modulus, mesh.poisson_ratio, *([mesh.material] if len(mesh.material) else [])])
    _, first, kind = np.unique(kinds, axis=1, return_index=True, return_inverse=True)
    a, b = np.repeat(first, len(first)), np.tile(first, len(first))
    of_kind = pair_penalty(mesh, law, a, b).reshape(len(first), -1).max(axis=1)
    return np.asarray(of_kind[kind.ravel()])


def pair_conductivity(mesh: FibrilMesh, law: ContactLaw, a: Ints, b: Ints) -> Floats:
    """sigma_c (C,), S/mm2, of contacts between the fibrils a and b (C,); 0 where the surface of either
    insulates."""
    conducts = (mesh.surface[a] > 0) & (mesh.surface[b] > 0)
    return np.where(conducts, _of_pairs(mesh, law, "conductivity", a, b), 0.0)


def pair_heat_transfer(mesh: FibrilMesh, law: ContactLaw, a: Ints, b: Ints) -> Floats:
    """h_c (C,), W/(mm2 K), of contacts between the fibrils a and b (C,)."""
    return _of_pairs(mesh, law, "heat_transfer", a, b)


def pair_constants(mesh: FibrilMesh, law: ContactLaw, a: Ints, b: Ints) -> dict[str, Floats]:
    """The `CONSTANTS` (C,) of contacts between the fibrils a and b (C,), by name."""
    return {name: _of_pairs(mesh, law, name, a, b) for name in CONSTANTS}


def pair_law(mesh: FibrilMesh, law: ContactLaw, a: Ints, b: Ints) -> NDArray[np.str_]:
    """Name of the law of conductance (C,) of contacts between the fibrils a and b (C,)."""
    materials = mesh.material_names or ("",)
    table = np.array([[law.between(one, other).law for other in materials] for one in materials])
    if not len(mesh.material):
        return np.full(len(a), table[0, 0])
    return np.asarray(table[mesh.material[a], mesh.material[b]])


def _of_pairs(mesh: FibrilMesh, law: ContactLaw, name: str, a: Ints, b: Ints) -> Floats:
    """(C,) a property of the contact between the fibrils' materials; nan for the word 'hertz'."""
    table = np.full((max(1, len(mesh.material_names)),) * 2, _value(getattr(law, name)))
    for i, one in enumerate(mesh.material_names):
        for j, other in enumerate(mesh.material_names):
            table[i, j] = _value(getattr(law.between(one, other), name))
    if not len(mesh.material):
        return np.full(len(a), table[0, 0])
    return np.asarray(table[mesh.material[a], mesh.material[b]])


def _value(stated: float | str) -> float:
    return np.nan if stated == HERTZ else float(stated)
