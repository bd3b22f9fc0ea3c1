"""From contact points to touches, and from the conductance of touches back to that of their points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.contact.conductance import PER_LENGTH, Touches, of_touches
from circuittex.contact.constriction import on_core, spot_of_ellipse, spot_of_strip, spot_on_shell, strip_on_shell
from circuittex.contact.ellipse import hertz_ellipse
from circuittex.contact.law import (
    effective_modulus,
    pair_conductivity,
    pair_constants,
    pair_heat_transfer,
    pair_law,
    pair_penalty,
)
from circuittex.contact.patches import Patches, of_patches, patch_of, patches
from circuittex.contact.transition import departure, straight_length
from circuittex.design import ContactLaw
from circuittex.geometry.mesh import FibrilMesh


@frozen
class Points:
    """C contact points, as `ContactState` has them."""

    a: Ints
    """(C,) fibril that carries the point."""
    b: Ints
    """(C,) the other."""
    xi_a: Floats
    """(C,) mm."""
    xi_b: Floats
    """(C,) mm."""
    load: Floats
    """(C,) line load, N/mm."""
    half_width: Floats
    """(C,) a, mm."""
    weight: Floats
    """(C,) w, mm."""

    def take(self, rows: NDArray[np.bool_]) -> Points:
        return Points(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})


def conductances(
    mesh: FibrilMesh,
    law: ContactLaw,
    points: Points,
    spacing: Floats,
    square: Callable[[NDArray[np.bool_]], Floats],
) -> tuple[Floats, Floats]:
    """Electrical (C,) S and thermal (C,) W/K conductance of contact points, each by the law of its pair of materials.

    No current passes where the surface of either fibril insulates. Heat passes through the same area: h_c a w,
    h_c 2 a w, or h_c A by all laws that know touches. spacing (F,) mm: of the contact points of a fibril; `square`
    gives sin^2 of the angle between the axes at chosen points, which only those laws ask for.
    """
    names = pair_law(mesh, law, points.a, points.b)
    electrical, thermal = np.zeros(len(names)), np.zeros(len(names))
    for name in np.unique(names).tolist():
        rows = names == name
        of = points.take(rows)
        sigma_c, h_c = pair_conductivity(mesh, law, of.a, of.b), pair_heat_transfer(mesh, law, of.a, of.b)
        if name in PER_LENGTH:
            per_length = PER_LENGTH[name]
            electrical[rows] = per_length(sigma_c, of.half_width) * of.weight
            thermal[rows] = per_length(h_c, of.half_width) * of.weight
            continue
        found, touches = _touches(mesh, law, of, square(rows), spacing)
        conducts = np.minimum(mesh.surface[of.a], mesh.surface[of.b]) > 0.0
        electrical[rows] = np.where(conducts, found.share * of_touches(name, touches)[found.patch], 0.0)
        thermal[rows] = h_c * (found.share * touches.area[found.patch])
    return electrical, thermal


def _touches(
    mesh: FibrilMesh, law: ContactLaw, points: Points, square: Floats, spacing: Floats
) -> tuple[Patches, Touches]:
    """The touches that contact points add up to."""
    swap = points.a > points.b
    a, b = np.where(swap, points.b, points.a), np.where(swap, points.a, points.b)
    swap |= (a == b) & (points.xi_a > points.xi_b)
    xi = np.stack([np.where(swap, points.xi_b, points.xi_a), np.where(swap, points.xi_a, points.xi_b)], axis=1)
    step = np.maximum(spacing[a], spacing[b])
    found = patches(patch_of(a * mesh.n_fibrils + b, xi, step), points.load, points.weight, square)
    first, low, high = np.unique(found.patch, return_index=True)[1], a, b
    a, b, step = a[first], b[first], step[first]
    R, other, E, nu = mesh.radius[a], mesh.radius[b], mesh.youngs_modulus, mesh.poisson_ratio
    modulus = effective_modulus(E[a], nu[a], E[b], nu[b])
    straight = straight_length(found.force, found.sine, R + other, pair_penalty(mesh, law, a, b))
    shorter, part = departure(found.length, step, straight)
    # A touch without end has an ellipse without end; as none of it is left, any will do.
    shorter = np.where(part < 1.0, shorter, 1.0)
    ellipse = hertz_ellipse(found.force, found.sine, R, other, modulus).shortened(shorter)
    along = points.weight * spot_of_strip(
        np.ones(1), points.half_width, np.sqrt(mesh.radius[points.a] * mesh.radius[points.b])
    )
    strip_area, strip_spot = (of_patches(found.patch, each) for each in (2 * points.half_width * points.weight, along))
    bare = spot_of_ellipse(ellipse)
    spot = (1 - part) * bare + part * strip_spot

    def bulk(fibril: Ints, of_point: Ints) -> Floats:
        """sigma of the half space in which the current of a touch would spread as it does in its fibril."""
        if not len(mesh.shell_thickness):
            return mesh.surface[fibril]
        mean, t, radius = (ellipse.long + ellipse.short) / 2, _thickness(mesh, fibril), mesh.radius[fibril]
        strips = strip_on_shell(points.weight, points.half_width, _thickness(mesh, of_point), mesh.radius[of_point])
        shell = (1 - part) * spot_on_shell(bare, mean, t, radius) + part * of_patches(found.patch, strips)
        surface = mesh.surface[fibril]
        within = np.divide(mesh.core_conductivity[fibril], surface, out=np.ones_like(surface), where=surface > 0.0)
        spread = on_core(shell, spot, within)
        return np.asarray(np.where(mesh.shell_thickness[fibril] > 0.0, surface * (spread / spot), surface))

    return found, Touches(
        force=found.force,
        sine=found.sine,
        length=found.length,
        area=(1 - part) * ellipse.area + part * strip_area,
        spot=spot,
        radius_a=R,
        radius_b=other,
        modulus=modulus,
        bulk_a=bulk(a, low),
        bulk_b=bulk(b, high),
        film=pair_conductivity(mesh, law, a, b),
        **pair_constants(mesh, law, a, b),
    )


def _thickness(mesh: FibrilMesh, fibril: Ints) -> Floats:
    """Of the shells of fibrils, mm; the radius of those without one, for which nothing is made of it."""
    thickness = mesh.shell_thickness[fibril]
    return np.where(thickness > 0.0, thickness, mesh.radius[fibril])
