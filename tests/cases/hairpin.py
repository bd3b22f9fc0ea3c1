"""A straight fibril between the two legs of a hairpin: both legs must carry the same contact force."""

import sys
from itertools import pairwise

import numpy as np

from circuittex.contact.extract import contact_state
from circuittex.design import ContactLaw
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import initial_configuration

R, LEG, P, HALF = 0.15, 0.28, 5.0, 1.0  # radius, distance of a leg from the middle, penalty, half the straight length
# Hairpin: along x at y = -LEG, a half circle, back at y = +LEG. Straight: along x at y = 0, between the legs.
bend = np.linspace(-np.pi / 2, np.pi / 2, 20)[1:-1]
leg = np.linspace(-3.0, 3.0, 121)
hairpin = np.concatenate(
    [
        np.stack([leg, 0 * leg - LEG, 0 * leg], 1),
        np.stack([3.0 + LEG * np.cos(bend), LEG * np.sin(bend), 0 * bend], 1),
        np.stack([leg[::-1], 0 * leg + LEG, 0 * leg], 1),
    ]
)
x = np.linspace(-HALF, HALF, 41)
straight = np.stack([x, 0 * x, 0 * x], 1)
lines, n = (hairpin, straight), np.array([len(hairpin), len(straight)])
first = np.concatenate([[0], np.cumsum(n)])
xi = [np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))]) for q in lines]
two = np.ones(2)
mesh = FibrilMesh(
    position=np.concatenate(lines),
    directors=np.tile(np.eye(3)[1:], (first[-1], 1, 1)),
    xi=np.concatenate(xi),
    elements=np.concatenate([np.stack([np.arange(a, b - 1), np.arange(a + 1, b)], 1) for a, b in pairwise(first)]),
    first_node=first,
    first_element=np.concatenate([[0], np.cumsum(n - 1)]),
    yarn=np.array([0, 1]),
    length=np.array([q[-1] for q in xi]),
    radius=R * two,
    youngs_modulus=10 * two,
    poisson_ratio=0 * two,
    density=two,
    electrical_conductivity=10 * two,
    thermal_conductivity=two,
    yarn_names=("warp1", "weft1"),
    yarn_axis=np.array([0, 1]),
)
c = contact_state(mesh, initial_configuration(mesh), ContactLaw(P, 0.01, 0.1), per_element=4)
force = c.line_load * c.weight
on_hairpin = np.where(c.fibril_a == 0, c.xi_a, c.xi_b)
lower, upper = (float(force[side].sum()) for side in (on_hairpin < mesh.length[0] / 2, on_hairpin > mesh.length[0] / 2))
expected = P * (2 * R - LEG) * 2 * HALF  # line load times length
print(f"force on the lower leg {lower:.4f} N, on the upper {upper:.4f} N; expected on each {expected:.4f} N")
print(f"force left over on the straight fibril {lower - upper:.4f} N; expected 0")
sys.exit(int(abs(lower - upper) > 0.02 * expected or abs(lower - expected) > 0.05 * expected))
