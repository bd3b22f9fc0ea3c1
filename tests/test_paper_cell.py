"""The paper's cell at the default mesh: what is known of it beforehand, and what the paper says of it.

These are the only tests that relax the full cell of 80 fibrils.
"""

from __future__ import annotations

import numpy as np
import pytest
from fabrics import Cell

from circuittex.contact.extract import contacts_of
from circuittex.design import Design, plain_weave
from circuittex.electrical.fields import solve_probes
from circuittex.geometry.levels import levels
from circuittex.geometry.weave import build_mesh
from circuittex.mech.minimise import CHEAP
from circuittex.relaxation.increment import advance
from circuittex.relaxation.relax import clamp_force, relax

pytestmark = pytest.mark.xdist_group("paper_cell")  # what its fixtures make serves one worker

MOST_ITERATIONS, MOST_GRADIENTS = 80, 200
"""What a relaxation of this cell, and any step of 2.5 %, may take in iterations of Newton's method, one by gradients
being an eighth of those (`CHEAP`); and what such a step may take by gradients."""
SYMMETRY = 1e-5
"""Relative difference allowed between warp and weft forces, which a symmetry of the cell makes equal: the free
residual of 1e-6 N on either side of a force of about 1 N, and its amplification by the softest mode."""
PROTOTYPE, COARSE = 1.49, 0.05
"""Clamp tension in N of the relaxed cell by an independent prototype with 16 linear elements and two contact points an
element and side, and the relative error of so coarse a mesh: 2 % from 20 to 40 of our elements at most, and half the
points."""


@pytest.fixture(scope="module", params=["paper-code", "paper-table"])
def cell(request: pytest.FixtureRequest) -> Cell:
    design = plain_weave(request.param)
    mesh = build_mesh(design)
    relaxed = relax(mesh, design)
    step = advance(mesh, design, relaxed.configuration, np.eye(2), np.diag([1.025, 1.0]))
    assert step.parts == 1
    return Cell(design, mesh, relaxed, step.equilibrium)


def wave_force(design: Design) -> float:
    """Clamp force of the forty fibrils of one direction on their initial wave, all of it stretched alike, N.

    Arc length of z = H sin(pi s / 2) over the natural length, by quadrature; neo-Hookean with nu = 0; the
    component along the yarn of a tension that leaves at the wave's slope.
    """
    s = np.linspace(-4, 4, 100_001)
    slope = design.weave.amplitude * np.pi / 2 * np.cos(np.pi * s / 2)
    stretch = float(np.trapezoid(np.sqrt(1 + slope**2), s)) / 8
    material = design.weave.warp[0].materials[0]
    mu, area = material.youngs_modulus / 2, np.pi * design.weave.warp[0].radius ** 2
    return float(40 * area * mu * (stretch - 1 / stretch) / np.sqrt(1 + slope[-1] ** 2))


def test_equilibrium_is_found_in_time(cell: Cell) -> None:
    for state in (cell.relaxed, cell.stretched):
        assert state.residual <= 1e-6
        newton = len(state.history) - 1
        assert newton + (state.iterations - newton) / CHEAP <= MOST_ITERATIONS
    assert cell.stretched.iterations <= MOST_GRADIENTS


def test_forces_are_equal_in_both_directions_by_symmetry(cell: Cell) -> None:
    force = clamp_force(cell.mesh, cell.relaxed.reaction)
    assert force[0, 0] == pytest.approx(force[1, 1], rel=SYMMETRY)


def test_opposite_clamps_balance(cell: Cell) -> None:
    """Contact and elastic forces are internal: the reactions of all clamps sum to the free residuals."""
    total = cell.stretched.reaction.sum(axis=0)
    assert np.abs(total).max() <= 1e-6 * cell.mesh.n_nodes


def test_tension_is_that_of_compacted_yarns(cell: Cell) -> None:
    """Another program found 1.49 N for E = 10 MPa; softer fibrils at the same penalty are compacted less, so that they
    keep at least that part of it, and no more than their initial wave carries."""
    force = clamp_force(cell.mesh, cell.relaxed.reaction)[0, 0]
    modulus = cell.design.weave.warp[0].materials[0].youngs_modulus
    least = PROTOTYPE * modulus / 10
    assert (1 - COARSE) * least <= force < wave_force(cell.design)
    if modulus == 10:
        assert force == pytest.approx(PROTOTYPE, rel=COARSE)


def test_initial_wave_carries_what_the_model_says() -> None:
    assert wave_force(plain_weave("paper-code")) == pytest.approx(3.1, abs=0.05)


def test_three_levels_become_two(cell: Cell) -> None:
    start = levels(cell.mesh, cell.mesh.position, yarn=1, place=-1.0)
    relaxed = [levels(cell.mesh, cell.relaxed.configuration.r, yarn=1, place=x) for x in (-1.0, 1.0)]
    assert start == 3
    assert relaxed == [2, 2]


def test_warp_stretch_raises_its_tension_and_changes_the_weft_s(cell: Cell) -> None:
    before, after = (clamp_force(cell.mesh, state.reaction) for state in (cell.relaxed, cell.stretched))
    assert after[0, 0] > 1.1 * before[0, 0]
    assert abs(after[1, 1] / before[1, 1] - 1) > 1e-3


def test_probe_currents_are_ordered_as_the_paper_says(cell: Cell) -> None:
    """Probe 1 carries most; a yarn without contacts carries 0.8836 A, and contacts can only add (Rayleigh)."""
    contacts = contacts_of(cell.design, cell.mesh, cell.relaxed.configuration)
    straight, parallel, perpendicular = (
        f.currents[0] for f in solve_probes(contacts, cell.design.terminals, cell.design.probes)
    )
    insulated = 10 * np.pi * 0.15**2 * 10 / 8
    assert insulated <= straight < 1.01 * insulated
    assert 0 < parallel < 0.1 * straight
    assert 0 < perpendicular < 0.1 * straight
