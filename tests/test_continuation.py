"""Slender fibrils among stiff contacts arrive by way of softer ones, and where the true penalty leads alone."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace

import numpy as np
import pytest
from test_resolution import cell
from test_scaling import Scale, differing, mechanics, scaled

from circuittex.base.arrays import Floats
from circuittex.base.errors import ConvergenceError, CreepingError, PenetrationError
from circuittex.contact.extract import contacts_of
from circuittex.contact.law import largest_penalty
from circuittex.contact.places import axis_points
from circuittex.design import Design, Numerics
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.minimise import CREEPING, SHORT, Minimum, minimise
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.scales import fibril_scales
from circuittex.relaxation.continuation import SOFTER, SOFTEST, continued
from circuittex.relaxation.relax import clamp_force, force_terms, relax
from circuittex.relaxation.sides import check_sides

SAME = 1e-8
"""Relative: energies at a minimum differ by the second order of what the tolerance of 2e-5 leaves."""
BALANCED = 1e-3
"""Relative: forces to the tolerance of 2e-5, times what some fifty nodes of a fibril may add up to."""


def slender(modulus: float = 10.0, elements: int = 20) -> Design:
    """Three fibrils a yarn, R = 0.05 mm in a pitch of 2 mm."""
    numerics = Numerics(elements=elements, contact_points=4)
    return replace(cell(modulus, 0.3, 0.05, (1, 2), 2.0, 0.1025), numerics=numerics)


def copper(amplitude: float) -> Design:
    """Three filaments a yarn of R = 25 um in a pitch of 2 mm; not at rest after 200 iterations of the true penalty."""
    numerics = Numerics(elements=60, contact_points=8, max_iterations=80)
    return replace(cell(120e3, 0.34, 0.025, (1, 2), 2.0, amplitude), numerics=numerics)


def descended(design: Design, *, may_creep: bool) -> Minimum:
    """By the true penalty alone."""
    mesh = build_mesh(design)
    space, beam, contact = force_terms(mesh, design)
    return minimise(
        [beam, contact],
        space.vector(initial_configuration(mesh)),
        scales=fibril_scales(space, design.weave.pitch, largest_penalty(mesh, design.contact)),
        fixed=space.fixed,
        solver=MultifrontalSolver(),
        may_creep=may_creep,
    )


def test_the_end_is_the_one_to_which_the_true_penalty_creeps() -> None:
    design = slender()
    alone, found = descended(design, may_creep=True), relax(build_mesh(design), design)
    assert found.energy == pytest.approx(alone.energy, rel=SAME)
    assert found.iterations < 0.8 * alone.iterations


def test_a_descent_that_may_not_creep_ends_at_the_fifth_short_step() -> None:
    with pytest.raises(CreepingError) as caught:
        descended(slender(), may_creep=False)
    steps = caught.value.history[:, 3]
    assert np.count_nonzero(steps <= SHORT) == CREEPING
    assert steps[-1] <= SHORT


def test_copper_arrives_and_where_does_not_depend_on_the_start() -> None:
    """Warp and weft are alike, so their clamps pull alike; together they are in balance, and the draft is kept."""
    pulls = []
    for amplitude in (0.04, 0.08):
        design = copper(amplitude)
        mesh = build_mesh(design)
        found = relax(mesh, design)
        check_sides(mesh, design, found.configuration.r, np.eye(2))
        force = clamp_force(mesh, found.reaction)
        assert force[0, 0] == pytest.approx(force[1, 1], rel=BALANCED)
        assert np.abs(found.reaction.sum(axis=0)).max() < BALANCED * force[0, 0]
        pulls.append(force[0, 0])
    assert pulls[0] == pytest.approx(pulls[1], rel=BALANCED)


@pytest.mark.parametrize("moduli", [(0.1, 10.0), (3e3, 200e3)])
def test_the_soft_and_the_stiff_of_one_yarn_are_at_rest(moduli: tuple[float, float]) -> None:
    """On each fibril, by its own largest force, clamps and contacts are in balance; these from the contact state."""
    design = slender()
    yarn = design.weave.warp[0]
    kinds = [replace(yarn.materials[0], name=f"m{k}", youngs_modulus=moduli[k]) for k in (0, 1)]
    yarns = (replace(yarn, materials=(kinds[0], kinds[1], kinds[0])),) * 2
    design = replace(design, weave=replace(design.weave, warp=yarns, weft=yarns))
    mesh = build_mesh(design)
    found = relax(mesh, design)
    contacts = contacts_of(design, mesh, found.configuration)
    sides = ((contacts.fibril_a, contacts.xi_a), (contacts.fibril_b, contacts.xi_b))
    one, other = (axis_points(contacts, found.configuration, *side) for side in sides)
    normal = (one - other) / np.linalg.norm(one - other, axis=1)[:, None]
    force = (contacts.line_load * contacts.weight)[:, None] * normal
    total = np.zeros((mesh.n_fibrils, 3))
    np.add.at(total, contacts.fibril_a, force)
    np.add.at(total, contacts.fibril_b, -force)
    held = found.reaction[mesh.end_nodes(-1)] + found.reaction[mesh.end_nodes(+1)]
    largest = np.abs(found.reaction[mesh.ends]).reshape(2, -1, 3).max(axis=(0, 2))
    assert (np.abs(held + total).max(axis=1) < BALANCED * largest).all()


def test_another_scale_takes_the_same_way_bit_for_bit() -> None:
    design = slender()
    known = mechanics(relax(build_mesh(design), design), Scale())
    for scale in (Scale(s=-6, m=12), Scale(s=3, m=-7, d=2)):
        there = scaled(design, scale)
        assert differing(mechanics(relax(build_mesh(there), there), scale), known) == []


# ---- the order of the descents ----------------------------------------------------------------------------


class Descents:
    """Descents that creep, fail or arrive, as a table says; each moves q by 1 and takes 5 iterations."""

    def __init__(self, creeping: Set[float], failing: Set[float] = frozenset()) -> None:
        self.creeping, self.failing = creeping, failing
        self.made: list[tuple[float, float, bool]] = []

    def __call__(self, q: Floats, part: float, may_creep: bool) -> Minimum:
        self.made.append((float(q[0]), part, may_creep))
        if part in self.failing:
            raise PenetrationError("too soft", np.zeros((4, 4)))
        if part in self.creeping and not may_creep:
            raise CreepingError("short", np.zeros((8, 4)), q + 0.5)
        return Minimum(q + 1.0, q, 0.0, 0.0, 5, np.zeros((6, 4)))


START = np.zeros(1)


def test_what_does_not_creep_is_one_descent() -> None:
    descents = Descents(set())
    assert continued(descents, START).iterations == 5
    assert descents.made == [(0.0, 1.0, False)]


def test_what_creeps_goes_on_from_where_softer_contacts_lead() -> None:
    descents = Descents({1.0, SOFTER})
    assert continued(descents, START).iterations == 7 + 7 + 5 + 5 + 5
    assert descents.made == [
        (0.0, 1.0, False),
        (0.0, SOFTER, False),
        (0.0, SOFTER**2, False),
        (1.0, SOFTER, True),
        (2.0, 1.0, True),
    ]


def test_contacts_too_soft_to_hold_are_left_out() -> None:
    descents = Descents({1.0}, {SOFTER})
    assert continued(descents, START).iterations == 7 + 3 + 5
    assert descents.made[-1] == (0.5, 1.0, True)  # and the creeping one goes on


def test_it_ends_where_all_creep_and_where_the_true_penalty_fails() -> None:
    descents = Descents({SOFTER**k for k in range(9)})
    continued(descents, START)
    assert min(part for _, part, _ in descents.made) == SOFTEST
    with pytest.raises(ConvergenceError, match="too soft"):
        continued(Descents(set(), {1.0}), START)
