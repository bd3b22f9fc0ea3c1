"""What is much and what is little for given fibrils: the scales by which the minimisation measures forces and steps.

No number of the minimisation has a unit: lengths are measured by the span, stiffnesses by those of the fibrils. So it
takes the same steps whatever the fibrils' size and modulus, and their density, which no equilibrium depends on, does
not enter.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.binary import power_of_two
from circuittex.base.frozen import frozen
from circuittex.mech.pattern import DOFS, Pattern, add_elements
from circuittex.mech.space import BeamSpace

BENDING = 128 / 45
"""Stiffness per length that holds the positions, in parts of E I / span^4: a fibril clamped at both ends of a span has
its softest mode at 500 (4.73^4). Of the paper's fibrils this is 1e-2 N/mm per mm3, with which they relax well."""
TURNING = 5.625e-6
"""Stiffness per length that holds the directors, in parts of E A. That is far above the round-off of the tangent and
above what the section's rule makes of a spin, and far below what bends fibrils of the paper's slenderness, R / span =
0.075."""


STRETCH = 1 / 16
"""Forces above E A times this ask for no smaller free force than that: a fibril stretched so far is out of the common.
"""


@frozen
class Scales:
    """The scales of a set of fibrils."""

    lever: float
    """Half the span, mm: a moment on a director over it is a force, and it is the unit in which steps are measured."""
    energy: float
    """A power of two near the largest E A span, N mm."""
    largest_force: Floats
    """(F,) N: no force above it counts as a fibril's own when a free force is compared with that."""
    first_node: Ints
    """(F + 1,) offsets of the fibrils into the nodes."""
    metric: Callable[[Pattern], Floats]
    """The stiffness that a shift multiplies, in a pattern: N/mm for positions, N mm for directors."""
    newtons: float = 1.0
    """N in one unit of force: 1, or what messages multiply by where the fibrils are in units of their own."""

    @property
    def unit(self) -> Floats:
        """(n_dofs,) what counts as one of each unknown: the lever, mm, for positions, and 1 for directors."""
        return np.tile(np.where(np.arange(DOFS) < 3, self.lever, 1.0), self.first_node[-1])

    @property
    def binary_unit(self) -> Floats:
        """(n_dofs,) the same as powers of two, with which multiplying rounds nothing."""
        return np.tile(np.where(np.arange(DOFS) < 3, power_of_two(self.lever), 1.0), self.first_node[-1])

    def forces(self, gradient: Floats) -> Floats:
        """(F,) largest force on a node of each fibril, N, for a gradient (n_dofs,): moments count over the lever."""
        size = np.abs(gradient).reshape(-1, DOFS)
        return self.over_fibrils(np.maximum(size[:, :3].max(axis=1), size[:, 3:].max(axis=1) / self.lever))

    def over_fibrils(self, of_node: Floats) -> Floats:
        """(F,) the largest value of each fibril's nodes."""
        return np.asarray(np.maximum.reduceat(of_node, self.first_node[:-1]))


def fibril_scales(space: BeamSpace, span: float, penalty: float | Floats = 0.0) -> Scales:
    """The scales of fibrils that bend over a `span` (mm), in a weave from crossing to crossing, and touch.

    `penalty` is the largest P* of each fibril's contacts, (F,) or one for all, N/mm2.

    Per length of axis the metric is `BENDING` E I / span^4 for the positions and `TURNING` E A for the directors, with
    the modulus E or, where contacts are harder than Hertz's, 2 P*: the shifts must cope with their forces, which turn
    as fibrils slide. A fibril's spin about its axis costs no energy, so only the directors' part keeps the tangent from
    being singular.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> from circuittex.mech.space import beam_space
    >>> fibril_scales(beam_space(build_mesh(plain_weave())), span=2.0).lever
    1.0
    """
    mesh = space.mesh
    stretching = mesh.youngs_modulus * mesh.area
    stiffer = np.maximum(mesh.youngs_modulus, 2 * np.asarray(penalty)) * mesh.area
    bending = BENDING * stiffer * mesh.section_radius**2 / 4

    area = span * span  # and not span**4, which a power function may round otherwise at another scale

    def metric(pattern: Pattern) -> Floats:
        return line_matrix(space, pattern, bending / (area * area), TURNING * stiffer)

    energy = power_of_two(float(stretching.max()) * span)
    return Scales(span / 2, energy, STRETCH * stretching, mesh.first_node, metric)


def line_matrix(space: BeamSpace, pattern: Pattern, position: Floats, director: Floats) -> Floats:
    """(nnz,) values of ∫ (a dr.dr + b (dg1.dg1 + dg2.dg2)) dxi3 with a = `position` and b = `director`, (F,) each."""
    mesh = space.mesh
    fibril, n = mesh.element_fibril, mesh.elements.shape[1]
    density = np.stack([position, director, director], axis=1)[fibril]
    matrix = np.zeros((len(fibril), n, DOFS, n, DOFS))
    k = np.arange(DOFS)
    matrix[:, :, k, :, k] = np.moveaxis(space.mass_line[..., None] * density[:, None, None, k // 3], -1, 0)
    data = np.zeros(pattern.nnz)
    add_elements(
        mesh.elements,
        matrix,
        pattern.indptr,
        pattern.neighbour_start,
        pattern.neighbour,
        pattern.point_offset,
        pattern.full_offset,
        data,
    )
    return data
