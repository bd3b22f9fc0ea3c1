"""Where in space the contact points of a contact state lie."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.contact.curve import BASIS, curve_table
from circuittex.contact.state import ContactState
from circuittex.mech.configuration import Configuration


def contact_places(contacts: ContactState, configuration: Configuration) -> Floats:
    """(C, 3) the place of each contact point, mm: between the two axes, in the ratio of the radii.

    `configuration` is the one that the contact state was taken from.

    >>> import circuittex as ct
    >>> design = ct.plain_weave(yarns=1)
    >>> mesh = ct.build_mesh(design)
    >>> at = ct.initial_configuration(mesh)
    >>> bool(np.abs(contact_places(ct.contacts_of(design, mesh, at), at)).max() < 1.0)
    True
    """
    radius = contacts.mesh.radius
    one, other = (
        axis_points(contacts, configuration, fibril, xi)
        for fibril, xi in ((contacts.fibril_a, contacts.xi_a), (contacts.fibril_b, contacts.xi_b))
    )
    share = radius[contacts.fibril_a] / (radius[contacts.fibril_a] + radius[contacts.fibril_b])
    return np.asarray(one + share[:, None] * (other - one))


def axis_points(contacts: ContactState, configuration: Configuration, fibril: Ints, xi: Floats) -> Floats:
    """(n, 3) points, mm, of the centre line on which contact is found, at axis coordinates xi (n,) of fibrils (n,)."""
    mesh, table = contacts.mesh, curve_table(contacts.mesh)
    intervals = np.diff(table.first_interval)[fibril]
    place = xi / mesh.length[fibril] * intervals
    within = np.minimum(place.astype(np.int64), intervals - 1)
    interval = table.first_interval[fibril] + within
    powers = (place - within)[:, None] ** np.arange(4)
    weights = np.einsum("nap,np->na", BASIS[table.kind[interval]], powers)
    nodes = table.window[interval][:, None] + np.arange(4)
    return np.asarray(np.einsum("na,nac->nc", weights, configuration.r[nodes]))
