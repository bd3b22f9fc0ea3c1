"""From a configuration to its frozen `ContactState`."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Floats
from circuittex.contact.curve import CurveTable, tangents
from circuittex.contact.law import effective_modulus, effective_radius, hertz_width, pair_penalty
from circuittex.contact.penalty import PenaltyContact, Touching
from circuittex.contact.share import shares
from circuittex.contact.state import ContactState
from circuittex.contact.touches import Points, conductances
from circuittex.design import ContactLaw, Design
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.mech.space import BeamSpace, beam_space


def contact_state(
    mesh: FibrilMesh,
    configuration: Configuration,
    law: ContactLaw,
    *,
    per_element: int,
    conduction: str = "reference",
) -> ContactState:
    """The contact points of a configuration with their loads, Hertz half-widths and conductances.

    p = P* o [28], a = sqrt(4 R* p / (pi E*)) [29], and by the paper's law G = sigma_c a w [31] (0 where either fibril
    insulates) and heat conductance h_c a w [30]; the others are in `circuittex.contact.conductance`. A contact point
    has a row for each minimum of the distance, with its part of the weight (`share`). `per_element` contact points an
    element; `conduction` is 'reference' or 'current'
    (`axial_factor`).
    """
    space = beam_space(mesh)
    term = PenaltyContact(mesh, law=law, per_element=per_element)
    found, table = term.touching(space.vector(configuration)), term.table
    part = shares(found, table)
    touching, part = _take(found, part > 0.0), part[part > 0.0]
    a, b = table.fibril[touching.interval_a], touching.fibril_b
    spacing = mesh.length / (np.diff(mesh.first_node) - 1)
    load = pair_penalty(mesh, law, a, b) * touching.overlap
    e, nu = mesh.youngs_modulus, mesh.poisson_ratio
    radius = effective_radius(mesh.radius[a], mesh.radius[b])
    width = hertz_width(load, radius, effective_modulus(e[a], nu[a], e[b], nu[b]))
    weight = term.weight[a] * part
    xi_a = (touching.interval_a - table.first_interval[a] + touching.t_a) * spacing[a]
    xi_b = touching.position_b * spacing[b]

    def square(rows: NDArray[np.bool_]) -> Floats:
        return _sine_squared(table, term.positions(space.vector(configuration)), _take(touching, rows))

    points = Points(a, b, xi_a, xi_b, load, width, weight)
    electrical, thermal = conductances(mesh, law, points, 2 * term.weight, square)
    return ContactState(
        mesh=mesh,
        fibril_a=a,
        fibril_b=b,
        xi_a=xi_a,
        xi_b=xi_b,
        gap=-touching.overlap,
        line_load=load,
        width=width,
        weight=weight,
        conductance=electrical,
        heat_conductance=thermal,
        axial_factor=axial_factor(space, configuration) if conduction == "current" else np.ones(len(mesh.elements)),
    )


def _sine_squared(table: CurveTable, r: Floats, touching: Touching) -> Floats:
    """(C,) sin^2 of the angle between the two axes."""
    last = table.first_interval[touching.fibril_b + 1] - table.first_interval[touching.fibril_b] - 1
    k = np.minimum(touching.position_b.astype(np.int64), last)
    one = tangents(table, r, touching.interval_a, touching.t_a)
    other = tangents(table, r, table.first_interval[touching.fibril_b] + k, touching.position_b - k)
    across = (np.cross(one, other) ** 2).sum(axis=1)
    return np.asarray(across / ((one**2).sum(axis=1) * (other**2).sum(axis=1)))


def _take(found: Touching, rows: NDArray[np.bool_]) -> Touching:
    return replace(found, **{field.name: getattr(found, field.name)[rows] for field in fields(found)})


def contacts_of(design: Design, mesh: FibrilMesh, configuration: Configuration) -> ContactState:
    """The contact state of a configuration of a design's fibrils, by the design's own laws and numerics."""
    return contact_state(
        mesh,
        configuration,
        design.contact,
        per_element=design.resolution.contact_points,
        conduction=design.electrical.conduction,
    )


def axial_factor(space: BeamSpace, configuration: Configuration) -> Floats:
    """(M,) conduction along the axis of a material that keeps its conductivity in the current frame, over sigma A.

    The conductance per reference length is sigma A_now / stretch with A_now = A |(g1 x g2).e| and
    stretch = |r'|; an element's is the harmonic mean over its line points, since they lie in series.
    """
    x = configuration.x[space.mesh.elements]
    slope = np.einsum("eqa,eac->eqc", space.slope, x[:, :, 0])
    g1, g2 = (np.einsum("qa,eac->eqc", space.shape, x[:, :, k]) for k in (1, 2))
    stretch = np.sqrt((slope**2).sum(axis=2))
    area = np.abs((np.cross(g1, g2) * slope).sum(axis=2)) / stretch
    return np.asarray(1 / (stretch / area).mean(axis=1))
