"""How resistances follow temperatures: tc1 and tc2 of fibrils and contacts, and the contacts at given temperatures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState
from circuittex.design import Design
from circuittex.electrical.fields.solution import Fields


@frozen
class Coefficients:
    """1 + tc1 T + tc2 T^2 multiplies resistances at a rise of T over 27 C, where they are as stated."""

    fibril: Floats
    """(F, 2) tc1, 1/K, and tc2, 1/K2, of each fibril along its axis."""
    contact: Floats
    """(C, 2) tc1, 1/K, and tc2, 1/K2, of each contact."""


def coefficients_of(design: Design, contacts: ContactState) -> Coefficients:
    """The coefficients that a design states for the fibrils and contacts of a state.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> design = plain_weave(yarns=2, rows=(1,))
    >>> mesh, nobody, nothing = build_mesh(design), np.zeros(0, dtype=int), np.zeros(0)
    >>> untouched = ContactState(mesh, nobody, nobody, *[nothing] * 8, np.ones(len(mesh.elements)))
    >>> coefficients_of(design, untouched).fibril.tolist()
    [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
    """
    yarns = design.weave.yarns
    surfaces = [each.name for yarn in yarns for each in yarn.surfaces]
    pairs = zip(contacts.fibril_a.tolist(), contacts.fibril_b.tolist(), strict=True)
    between = [design.contact.between(surfaces[a], surfaces[b]) for a, b in pairs]
    fibril = [(each.tc1, each.tc2) for yarn in yarns for each in yarn.fibrils]
    contact = [(each.tc1, each.tc2) for each in between]
    return Coefficients(*(np.array(each, dtype=np.float64).reshape(-1, 2) for each in (fibril, contact)))


def at_temperatures(contacts: ContactState, field: Fields) -> ContactState:
    """The contacts and fibrils with the resistances that they have at the temperatures of `field`.

    Each element of a fibril resists as its mean resistivity says, so that fields, circuits and netlists of this state
    carry the currents of `field` at its voltage; where these follow no temperature the state is as it was.
    """
    if not len(field.resistivity):
        return contacts
    return replace(
        contacts,
        axial_factor=contacts.axial_factor / field.resistivity,
        conductance=contacts.conductance / field.contact_resistivity,
    )
