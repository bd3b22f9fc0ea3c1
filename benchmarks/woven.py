"""Circuits of woven cells in several sizes."""

from __future__ import annotations

from circuittex.contact.extract import contact_state
from circuittex.contact.merge import simplify
from circuittex.design import plain_weave
from circuittex.electrical.network.circuit import Circuit
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import initial_configuration
from circuittex.study.circuits import state_circuits


def woven_circuit(yarns: int, merge_length: float) -> Circuit:
    """The detailed circuit of the paper's cell with that many yarns each way, laid out but not relaxed.

    `merge_length` (mm) sets the resolution; 0 keeps every contact point.
    """
    design = plain_weave(yarns=yarns)
    mesh, numerics = build_mesh(design), design.numerics
    contacts = contact_state(mesh, initial_configuration(mesh), design.contact, per_element=numerics.contact_points)
    simple = simplify(
        contacts, merge_length=merge_length, snap_length=design.snap_length, drop_fraction=numerics.drop_fraction
    )
    return state_circuits(simple).yarn_ends
