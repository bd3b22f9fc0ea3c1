"""Two contacts of one pair that lie together on one fibril and far apart on the other must not be merged."""

import sys

import numpy as np

import circuittex as ct
from circuittex.contact.merge import merge_contacts
from circuittex.contact.state import ContactState
from circuittex.design import Terminal

design = ct.plain_weave("paper-code", yarns=2, rows=(1,))
mesh = ct.build_mesh(design)
one = np.ones(2)
contacts = ContactState(
    mesh=mesh,
    fibril_a=np.array([0, 0]),
    fibril_b=np.array([2, 2]),
    xi_a=np.array([2.2, 2.4]),
    xi_b=np.array([0.2, 3.6]),
    gap=-0.01 * one,
    line_load=0.05 * one,
    width=0.01 * one,
    weight=0.1 * one,
    conductance=1.0 * one,
    heat_conductance=one,
    axial_factor=np.ones(len(mesh.elements)),
)
merged = merge_contacts(contacts, 1.0)
print("before", contacts.xi_b.tolist(), "S", contacts.conductance.tolist())
print("merged", merged.xi_b.tolist(), "S", merged.conductance.tolist())
ends = [Terminal("in", (("weft1", -1),)), Terminal("out", (("weft1", 1),))]


def ohm(state):
    circuit = ct.build_circuit(state, ends)
    return 1.0 / float(ct.solve_nodal(circuit, {"in": 1.0, "out": 0.0}).port_current[0])


per_mm = 1 / (10 * np.pi * 0.15**2)
by_hand = per_mm * (0.2 + 1 / (1 / 3.4 + 1 / (0.2 + 2 / per_mm)) + 0.4)  # the other fibril is a bridge over 3.4 mm
print(f"weft1 from end to end: {ohm(contacts):.6f} ohm, merged {ohm(merged):.6f} ohm, by hand {by_hand:.6f} ohm")
sys.exit(int(merged.n_contacts != 2 or abs(ohm(merged) / by_hand - 1) > 1e-3))
