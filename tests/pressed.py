"""Two straight fibrils that press on one another with a given force."""

from __future__ import annotations

import numpy as np
from fabrics import fibrils_through, straight
from scipy.optimize import brentq

from circuittex.contact.extract import contact_state
from circuittex.contact.state import ContactState
from circuittex.contact.transition import straight_length
from circuittex.design import ContactLaw
from circuittex.mech.configuration import initial_configuration

R, E, SIGMA, FILM = 0.15, 10.0, 10.0, 0.7
STAR = E / 2
"""E* of two equal materials with nu = 0, MPa."""
SPOT = 0.1 * R
"""Radius of Hertz's circle in the tests, mm: overlaps are 0.01 R, and 0.025 R with a quarter of the penalty."""
FORCE = 4 / 3 * STAR * SPOT**3 / R
"""The force that makes it: a^3 = 3 F R / (4 E*)."""
FOUND = 1e-9
"""How closely the distance is found at which the fibrils press with a given force, relative to the force."""


def pressed(
    law: str,
    *,
    angle: float = 90.0,
    penalty: float = STAR / 2,
    force: float = FORCE,
    points: int = 200,
    length: float = 1.0,
    **properties: float,
) -> ContactState:
    """Two straight fibrils that cross and press on one another with a given force; `points` on either."""
    direction = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0]) * length / 2
    x = np.array([length / 2, 0, 0])
    contact = ContactLaw(penalty, FILM, 0.1, law=law, **properties)
    per_element = 4
    elements = points // per_element

    def at(overlap: float) -> ContactState:
        up = np.array([0, 0, 2 * R - overlap])
        lines = [straight(-x, x, elements), straight(up - direction, up + direction, elements)]
        mesh = fibrils_through(lines, radius=R, modulus=E, sigma=SIGMA)
        return contact_state(mesh, initial_configuration(mesh), contact, per_element=per_element)

    def excess(overlap: float) -> float:
        return (force_of(at(overlap)) / force) ** (2 / 3) - 1  # of a crossing all but linear

    return at(brentq(excess, 1e-8 * R, R, xtol=1e-12 * R))


def force_of(state: ContactState) -> float:
    return float(np.sum(state.line_load * state.weight))


def per_touch(wanted: int, penalty: float) -> dict[str, float | int]:
    """Options of `pressed` with which some `wanted` contact points of either fibril see the touch at a right angle."""
    one = np.ones(1)
    across = float(straight_length(FORCE * one, one, 2 * R * one, penalty * one)[0])
    return {"penalty": penalty, "points": 4 * round(13 * wanted / 4), "length": 13 * across}
