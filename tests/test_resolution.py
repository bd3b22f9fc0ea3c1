"""The mesh that follows from the fibrils: within 1 % of one twice as fine, the state carried over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from circuittex.base.arrays import Floats
from circuittex.base.frozen import same
from circuittex.contact.extract import contacts_of
from circuittex.design import HERTZ, ContactLaw, Design, Material, Numerics, Weave, Yarn, plain_weave
from circuittex.electrical.fields import solve_probes
from circuittex.fit import fit_network
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.relaxation.relax import Equilibrium, clamp_force, relax
from circuittex.relaxation.transfer import transfer
from circuittex.results.soundness import SEEN, points_across

WITHIN = 0.01
"""What is promised of Ry, Rc and clamp forces against a mesh twice as fine."""
AUTO = Numerics(elements="auto", contact_points="auto")


def cell(
    modulus: float, poisson: float, radius: float, rows: tuple[int, ...], pitch: float, amplitude: float
) -> Design:
    """Two by two yarns of one material."""
    material = Material("fibre", modulus, poisson, 1e-3, 10.0, 1.0)
    yarn = Yarn("yarn", rows, radius, 2.1 * radius, 2.1 * radius, (material,) * sum(rows))
    design = plain_weave(yarns=2, rows=(1,))
    weave = Weave(design.weave.draft, (yarn,) * 2, (yarn,) * 2, pitch, amplitude)
    return replace(design, weave=weave, contact=ContactLaw(HERTZ, 0.01, 0.1), numerics=AUTO)


COPPER = cell(120e3, 0.34, 0.025, (1,), 1.0, 0.03)
LONG_COPPER = cell(120e3, 0.34, 0.025, (1,), 2.0, 0.03)
COPPER_FILAMENTS = cell(120e3, 0.34, 0.025, (3,), 1.0, 0.03)


def values(design: Design, mesh: FibrilMesh, state: Equilibrium) -> Floats:
    """Clamp forces, Ry and Rc."""
    contacts = contacts_of(design, mesh, state.configuration)
    fields = solve_probes(contacts, design.terminals, design.probes)
    fit = fit_network([field.currents[0] for field in fields], design)
    force = clamp_force(mesh, state.reaction)
    return np.array([force[0, 0], force[1, 1], fit.Ry, fit.Rc])


def twice(design: Design) -> Design:
    wanted = design.resolution
    numerics = Numerics(elements=2 * wanted.elements, contact_points=wanted.contact_points)
    return replace(design, numerics=numerics)


@pytest.mark.parametrize(
    "design",
    [COPPER, LONG_COPPER, COPPER_FILAMENTS, replace(plain_weave(yarns=2), numerics=AUTO)],
    ids=["copper", "2 mm", "filaments", "paper"],
)
def test_a_mesh_twice_as_fine_changes_little(design: Design) -> None:
    mesh, fine = build_mesh(design), build_mesh(twice(design))
    state = relax(mesh, design)
    finer = relax(fine, twice(design), transfer(state.configuration, mesh, fine))
    assert values(design, mesh, state) == pytest.approx(values(twice(design), fine, finer), rel=WITHIN)


def test_the_default_mesh_misses_the_contacts_of_copper_and_says_so() -> None:
    """The test above can fail: with 20 elements and 4 points Rc is half of what it is."""
    mesh, fine = build_mesh(replace(COPPER, numerics=Numerics())), build_mesh(COPPER)
    coarse = replace(COPPER, numerics=Numerics())
    state = relax(mesh, coarse)
    finer = relax(fine, COPPER, transfer(state.configuration, mesh, fine))
    assert abs(values(coarse, mesh, state)[3] / values(COPPER, fine, finer)[3] - 1) > 0.4
    assert points_across(contacts_of(coarse, mesh, state.configuration)) < SEEN
    assert points_across(contacts_of(COPPER, fine, finer.configuration)) > SEEN


def test_a_scale_changes_nothing() -> None:
    """Lengths and moduli by powers of two: the same mesh."""
    for s, m in ((2.0**-12, 1.0), (2.0**10, 1.0), (1.0, 2.0**10), (2.0**-12, 2.0**-12)):
        scaled = cell(120e3 * m, 0.34, 0.025 * s, (1,), 1.0 * s, 0.03 * s)
        assert same(scaled.resolution, COPPER.resolution)


def test_a_number_stays_possible() -> None:
    wanted = replace(COPPER, numerics=Numerics(elements=30, contact_points="auto")).resolution
    assert wanted.elements == 30
    assert wanted.contact_points == 20
    assert replace(COPPER, numerics=Numerics()).resolution.contact_points == 4
