"""Objectivity: a rotated cell gives rotated results, and no number of the electrical side changes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from fabrics import small_cell
from scipy.spatial.transform import Rotation

from circuittex.base.arrays import Floats
from circuittex.base.frozen import same
from circuittex.contact.extract import contacts_of
from circuittex.contact.state import ContactState
from circuittex.design import Design
from circuittex.electrical.fields import solve_probes
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.relaxation.relax import Equilibrium, move, relax

TIGHT = 1e-9
"""N, largest free force asked for. Newton's method ends far below it."""
AGREE = 1e-7
"""Positions in mm, and forces in N (clamp forces are some 0.1 N), between runs that differ by round-off only. TIGHT
over the stiffness of a fibril in bending, 48 E I / L^3 = 3e-3 N/mm, is 3e-7, and the residuals are a tenth of it."""
LEVEL = 1e-10
"""Of energies, whose error is of second order in that of positions, and hence round-off of a sum."""
CURRENT = 1e-7
"""Of currents: overlaps are some 0.01 mm, and a contact's width goes with their root."""

AXES = [[1.0, 2.0, -0.5], [0.0, 0.0, 1.0], [-0.3, 0.1, 3.0]]
STRETCH = np.array([[1.04, 0.0], [0.06, 0.98]])


def turned_mesh(mesh: FibrilMesh, turn: Floats) -> FibrilMesh:
    """The same fibrils laid out in a rotated frame, and away from the origin."""
    return replace(mesh, position=mesh.position @ turn.T + [0.7, -1.3, 2.9], directors=mesh.directors @ turn.T)


@cache
def at_rest() -> tuple[Design, FibrilMesh, Equilibrium]:
    design, mesh = small_cell((1, 2), elements=4, tolerance=f"{TIGHT} N")
    return design, mesh, relax(mesh, design)


def contacts(state: Equilibrium, mesh: FibrilMesh) -> ContactState:
    return contacts_of(at_rest()[0], mesh, state.configuration)


def section(state: Equilibrium) -> Floats:
    """(N, 3, 3) g1 g1^T + g2 g2^T: what remains of the directors where a fibril may spin about its axis."""
    directors = state.configuration.x[:, 1:]
    return np.asarray(np.einsum("nki,nkj->nij", directors, directors))


def assert_turned(found: Equilibrium, mesh: FibrilMesh, turn: Floats, expected: Equilibrium) -> None:
    """Everything that has a direction has turned, and everything else is the same."""
    design, original, _ = at_rest()
    offset = found.configuration.r[0] - expected.configuration.r[0] @ turn.T  # of a clamped node
    assert np.abs(found.configuration.r - expected.configuration.r @ turn.T - offset).max() < AGREE
    assert np.abs(section(found) - turn @ section(expected) @ turn.T).max() < AGREE
    assert np.abs(found.reaction - expected.reaction @ turn.T).max() < AGREE
    assert np.abs(found.section_force - expected.section_force @ turn.T).max() < AGREE
    assert found.energy == pytest.approx(expected.energy, rel=LEVEL)
    here, there = contacts(expected, original), contacts(found, mesh)
    assert here.n_contacts > 100
    assert np.array_equal(there.fibril_a, here.fibril_a)
    assert np.array_equal(there.fibril_b, here.fibril_b)
    for name in ("xi_a", "xi_b", "gap"):
        assert np.abs(getattr(there, name) - getattr(here, name)).max() < 10 * AGREE
    before, after = (solve_probes(state, design.terminals, design.probes) for state in (here, there))
    for one, other in zip(before, after, strict=True):
        assert other.currents == pytest.approx(one.currents, rel=CURRENT)
        assert other.heat == pytest.approx(one.heat, rel=CURRENT)


@pytest.mark.parametrize("axis", AXES)
def test_a_cell_laid_out_in_a_rotated_frame_relaxes_to_the_rotated_state(axis: list[float]) -> None:
    """From the rotated initial weave, by the same iterations."""
    design, mesh, rest = at_rest()
    turn = Rotation.from_rotvec(axis).as_matrix()
    other = turned_mesh(mesh, turn)
    found = relax(other, design)
    assert_turned(found, other, turn, rest)


@cache
def stretched() -> Equilibrium:
    design, mesh, rest = at_rest()
    return relax(mesh, design, move(rest.configuration, np.eye(2), STRETCH))


@pytest.mark.parametrize("angle", [0.1, -0.5])
def test_a_rotation_on_top_of_a_deformation_rotates_the_result(angle: float) -> None:
    """F and Q F with Q a rotation in the plane, both from rest.

    `move` leaves directors where they were, so that the two relaxations start from different places.
    """
    design, mesh, rest = at_rest()
    turn = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
    start = move(rest.configuration, np.eye(2), turn[:2, :2] @ STRETCH)
    assert_turned(relax(mesh, design, start), mesh, turn, stretched())


def test_a_deformed_cell_that_is_only_rotated_stays_in_equilibrium() -> None:
    """No iteration is needed: the rotated forces balance as the forces did."""
    design, mesh, _ = at_rest()
    turn = Rotation.from_rotvec(AXES[0]).as_matrix()
    found = relax(mesh, design, Configuration(stretched().configuration.x @ turn.T))
    assert found.iterations == 0
    assert_turned(found, mesh, turn, stretched())


def test_a_turn_of_the_plane_by_move_alone_does_no_work() -> None:
    """Rest turned by an increment of rotation: the energy comes back, with no strain to blame."""
    design, mesh, rest = at_rest()
    turn = Rotation.from_rotvec([0.0, 0.0, 0.3]).as_matrix()
    found = relax(mesh, design, move(rest.configuration, np.eye(2), turn[:2, :2]))
    assert found.iterations > 0  # the directors had to follow
    assert not same(found.configuration, rest.configuration)
    assert_turned(found, mesh, turn, rest)
