"""The descent by gradients before Newton's method: what each of its steps keeps, and who has the last word."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from fabrics import small_cell

from circuittex.base.arrays import Floats
from circuittex.base.errors import ConvergenceError, PenetrationError
from circuittex.base.frozen import same
from circuittex.design import Design
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.descent import TIRED, descend
from circuittex.mech.minimise import Minimum, minimise
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pattern import DOFS, Pattern
from circuittex.mech.scales import fibril_scales
from circuittex.mech.system import System
from circuittex.relaxation.relax import PATIENT, Equilibrium, force_terms, move, relax

TIGHT = 1e-9
"""N; clamp forces are some 0.1 N."""


@dataclass
class Witness:
    """A potential of zero that keeps the ways it was asked for, and bars all but a part of each."""

    part: float = 1.0
    presses_from: int = 10**9
    """The question from which on it says that fibrils are pressed through one another."""
    ways: list[tuple[Floats, Floats]] = field(default_factory=list)
    assemblies: int = 0

    def prepare(self, q: Floats) -> bool:
        return False

    def forget(self) -> None:
        pass

    def pairs(self) -> tuple[np.ndarray, np.ndarray]:
        return np.empty((0, 2), dtype=np.int64), np.empty((0, 2), dtype=np.int64)

    def energy(self, q: Floats) -> float:
        return 0.0

    def add_gradient(self, q: Floats, gradient: Floats) -> float:
        return 0.0

    def longest(self, q: Floats, direction: Floats) -> float:
        self.ways.append((q, direction))
        if len(self.ways) >= self.presses_from:
            raise PenetrationError("pressed")
        return self.part

    def assemble(self, q: Floats, pattern: Pattern, gradient: Floats, data: Floats, softening: Floats) -> float:
        self.assemblies += 1
        return 0.0


def descended(witness: Witness, stride: float, most: int = 1500) -> tuple[System, Floats, Floats, int]:
    """System, first and last unknowns and iterations of a descent in a cell of three fibrils a yarn."""
    design, mesh = small_cell()
    space, beam, contact = force_terms(mesh, design)
    start = space.vector(initial_configuration(mesh))
    scales = fibril_scales(space, design.weave.least_pitch, 5.0)
    system = System([beam, contact, witness], scales, space.fixed, len(start))
    q, count = descend(system, MultifrontalSolver(), start, stride=stride, limits=(2e-5, 0.0), max_iterations=most)
    return system, start, q, count


@pytest.mark.parametrize("part", [1.0, 0.6])
def test_every_step_is_asked_for_leads_lower_and_is_no_longer_than_its_stride(part: float) -> None:
    witness, stride = Witness(part), 0.05
    system, start, q, _ = descended(witness, stride)
    asked = [way[0] for way in witness.ways]
    assert np.array_equal(asked[0], start)
    for here, there, (_, direction) in zip(asked, [*asked[1:], q], witness.ways, strict=True):
        step = there - here
        if not step.any():
            continue
        # The last steps gain less than the round-off of a sum of some thousand terms.
        assert system.energy(there) <= system.energy(here) * (1 + 1e-14)
        assert np.abs(step[system.fixed]).max() == 0.0
        nodes = step.reshape(-1, DOFS)[:, :3]
        assert np.sqrt((nodes**2).sum(axis=1)).max() <= stride * (1 + 1e-9)  # round-off of coordinates of 1 mm
        fraction = float(step @ direction / (direction @ direction))
        # A part of the way that was asked for, and of none other: 1e-9 is round-off of coordinates.
        assert 0.0 < fraction <= part + 1e-6
        assert np.abs(step - fraction * direction).max() <= 1e-9 * stride


def test_it_ends_where_forces_are_below_their_limits() -> None:
    system, _, q, count = descended(Witness(), 0.15)
    _, _, gradient = system.assemble(q)
    gradient[system.fixed] = 0.0
    assert count > 10
    # The limits are those of the last renewal, and the forces that they are parts of differ by less than twice since.
    assert (system.scales.forces(gradient) <= 2 * system.limits(q, 2e-5, 0.0)).all()


@pytest.mark.parametrize(("part", "renewals"), [(1.0, 1), (0.04, 20 // TIRED)])
def test_a_factor_whose_steps_are_all_short_is_renewed_early(part: float, renewals: int) -> None:
    """Where nothing bars the way it serves for all of twenty steps; where all but a thirtieth is barred, for four."""
    witness = Witness(part)
    descended(witness, 0.15, 20)
    assert witness.assemblies == renewals


def test_the_last_factor_of_a_place_takes_the_values_and_they_can_be_had_again() -> None:
    """To the last bit; and a factor that is not the last leaves them."""
    design, mesh = small_cell()
    space, beam, contact = force_terms(mesh, design)
    q = space.vector(initial_configuration(mesh))
    system = System([beam, contact], fibril_scales(space, design.weave.least_pitch, 5.0), space.fixed, len(q))
    system.assemble(q)
    before = [system.data, system.softening, system.metric]
    one = system.factor(MultifrontalSolver(), 1e6, 1.0)
    assert all(
        here is there for here, there in zip(before, (system.data, system.softening, system.metric), strict=True)
    )
    two = system.factor(MultifrontalSolver(), 1e6, 1.0, last=True)
    assert not system.data.size
    assert not system.softening.size
    assert not system.metric.size
    assert one is not None
    assert two is not None
    force = np.where(system.free, 1.0, 0.0)
    assert np.array_equal(one(force), two(force))
    system.assemble(q)
    again = system.data, system.softening, system.metric
    assert all(np.array_equal(here, there) for here, there in zip(before, again, strict=True))


def test_it_stops_short_of_a_step_that_presses_fibrils_through_one_another() -> None:
    witness = Witness(presses_from=7)
    _, _, q, _ = descended(witness, 0.15)
    assert len(witness.ways) == 7
    assert np.array_equal(q, witness.ways[-1][0])


def test_gradients_alone_are_the_slopes_of_the_energies() -> None:
    """Central differences of the energies: their error is of the order of the step squared, 1e-10 of the curvature."""
    design, mesh = small_cell()
    space, beam, contact = force_terms(mesh, design)
    rng = np.random.default_rng(3)
    q = space.vector(initial_configuration(mesh)) + 1e-3 * rng.standard_normal(space.n_dofs)
    for term in (beam, contact):
        gradient, direction = np.zeros(len(q)), rng.standard_normal(len(q))
        energy = term.add_gradient(q, gradient)
        assert energy == term.energy(q)
        ahead, behind = (term.energy(q + s * direction) for s in (1e-6, -1e-6))
        slope = (ahead - behind) / 2e-6
        assert slope == pytest.approx(float(gradient @ direction), abs=1e-8 * np.abs(gradient).sum())


def with_descent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("circuittex.relaxation.relax.WORTH_A_DESCENT", 0)


def test_newtons_method_confirms_the_minimum_that_it_would_have_found_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two yarns that cross have one equilibrium nearby, so both ways meet there: to the forces left over stiffness."""
    design, mesh = small_cell((1,), yarns=1, tolerance=f"{TIGHT} N")
    alone = relax(mesh, design)
    with_descent(monkeypatch)
    found = relax(mesh, design)
    assert found.residual <= TIGHT
    assert found.iterations > len(found.history) - 1  # some were by gradients
    assert np.abs(found.configuration.r - alone.configuration.r).max() < 1e-6
    assert found.energy == pytest.approx(alone.energy, rel=1e-9)


def test_a_step_of_a_path_ends_where_newtons_method_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """To the forces left over stiffness again; and the last step, with the factor that shows the minimum to be one,
    leaves a hundred times less than the descent does, where its limits are wide: it is Newton's but for the shift."""
    design, mesh = small_cell((1,), yarns=1, tolerance="1e-4 N")
    rest = relax(mesh, design)
    stretched = np.diag([1.05, 1.0])
    moved = move(rest.configuration, np.eye(2), stretched)
    tight = replace(design, numerics=replace(design.numerics, tolerance=f"{TIGHT} N"))
    alone = relax(mesh, tight, moved, before=rest.configuration, gradient=stretched)
    with_descent(monkeypatch)
    found = relax(mesh, design, moved, before=rest.configuration, gradient=stretched)
    assert len(found.history) == 1  # all by gradients
    assert found.iterations > 2
    assert found.residual < 1e-2 * found.history[-1][0] < 1e-2 * 1e-4
    assert np.abs(found.reaction - alone.reaction).max() < 1e-6


@pytest.mark.parametrize("tried", [PATIENT, PATIENT + 50])
def test_a_step_that_newtons_method_does_not_end_is_tried_by_gradients(
    monkeypatch: pytest.MonkeyPatch, tried: int
) -> None:
    """Where it was given a chance: a lower limit of its iterations is meant, and ends the step."""
    design, mesh = small_cell((1,), yarns=1)
    rest = relax(mesh, design)
    moved = move(rest.configuration, np.eye(2), np.diag([1.02, 1.0]))

    def tired(*of: Any, stride: float, **more: Any) -> Minimum:
        if stride == 0.0:
            raise ConvergenceError("no equilibrium", np.zeros((tried, 4)))
        return minimise(*of, stride=stride, **more)

    monkeypatch.setattr("circuittex.relaxation.relax.minimise", tired)
    if tried <= PATIENT:
        with pytest.raises(ConvergenceError):
            relax(mesh, design, moved, before=rest.configuration)
        return
    found = relax(mesh, design, moved, before=rest.configuration)
    with_descent(monkeypatch)
    monkeypatch.setattr("circuittex.relaxation.relax.minimise", minimise)
    by_gradients = relax(mesh, design, moved, before=rest.configuration)
    assert same(found.configuration, by_gradients.configuration)
    assert found.iterations == by_gradients.iterations + tried - 1


def relaxed(s: float, m: float) -> tuple[Design, FibrilMesh, Equilibrium]:
    """A cell with lengths times s and moduli times m, from a start that is relaxed in mm and N."""
    design, _ = small_cell()
    yarn = design.weave.warp[0]
    material = yarn.materials[0]
    material = replace(material, youngs_modulus=m * material.youngs_modulus)
    yarn = replace(
        yarn,
        radius=s * yarn.radius,
        spacing=s * yarn.spacing,
        row_spacing=s * yarn.row_spacing,
        materials=(material,) * len(yarn.materials),
    )
    weave = replace(
        design.weave,
        warp=(yarn,) * 2,
        weft=(yarn,) * 2,
        pitch=s * design.weave.pitch,
        amplitude=s * design.weave.amplitude,
    )
    contact = replace(design.contact, penalty=m * design.contact.penalty)
    design = replace(design, weave=weave, contact=contact)
    mesh = build_mesh(design)
    x = initial_configuration(mesh).x.copy()
    space = force_terms(mesh, design)[0]
    x[:, 0, 2] += s * 2.0**-10 * np.random.default_rng(5).standard_normal(len(x))
    x.reshape(-1)[space.fixed] = initial_configuration(mesh).x.reshape(-1)[space.fixed]
    return design, mesh, relax(mesh, design, Configuration(x))


def test_at_another_scale_the_steps_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    with_descent(monkeypatch)
    s, m = 2.0**-7, 2.0**5
    (_, _, one), (_, _, other) = relaxed(1.0, 1.0), relaxed(s, m)
    assert one.iterations == other.iterations > 10
    assert np.array_equal(s * one.configuration.r, other.configuration.r)
    assert m * s**3 * one.energy == other.energy


def test_threads_change_no_bit_of_a_descent(monkeypatch: pytest.MonkeyPatch) -> None:
    with_descent(monkeypatch)
    for part in ("contact.penalty", "mech.beam"):
        monkeypatch.setattr(f"circuittex.{part}.WORTH_A_THREAD", 1)
    found = []
    for cores in (1, 3):
        for part in ("contact.penalty", "mech.beam"):
            monkeypatch.setattr(f"circuittex.{part}.cores", lambda cores=cores: cores)
        design, mesh = small_cell()
        found.append(relax(mesh, design).configuration.x.tobytes())
    assert found[0] == found[1]
