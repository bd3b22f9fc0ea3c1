"""Work of the clamps against stored energy: equal where a path is reversible; what is lost is lost in snaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from fabrics import small_cell

from circuittex.contact.extract import contacts_of
from circuittex.design import Design, plain_weave
from circuittex.errors import DesignError
from circuittex.geometry.mesh import FibrilMesh, Floats
from circuittex.geometry.weave import build_mesh
from circuittex.relaxation import Equilibrium, move, relax
from circuittex.work import EnergyBalance, balance, clamp_balance

TOLERANCE = 1e-7  # N, largest free force
SAME = 1e-5
"""mm: an equilibrium found again. TOLERANCE over a fibril's stiffness in bending, 3e-3 N/mm, is 3e-5, and
Newton's method ends far below its tolerance; states on different branches are 1e-2 and more apart."""


@dataclass
class Fabric:
    design: Design
    mesh: FibrilMesh

    def along(self, strains: Sequence[float] | Floats, start: Equilibrium) -> list[Equilibrium]:
        """The equilibria along x-strains, from `start` at the first of them."""
        path = [start]
        for before, after in pairwise(strains):
            moved = move(path[-1].configuration, np.diag([1 + before, 1.0]), np.diag([1 + after, 1.0]))
            path.append(relax(self.mesh, self.design, moved))
        return path

    def touching(self, state: Equilibrium) -> set[tuple[int, int]]:
        """The pairs of fibrils that touch."""
        contacts = contacts_of(self.design, self.mesh, state.configuration)
        return set(zip(contacts.fibril_a.tolist(), contacts.fibril_b.tolist(), strict=True))


def apart(one: Equilibrium, other: Equilibrium) -> float:
    """Largest distance between the centre lines' nodes, mm."""
    return float(np.abs(one.configuration.r - other.configuration.r).max())


# ---- The function, on paths whose work is known ------------------------------------------------------------


def test_springs_that_are_linear_are_exact() -> None:
    """Two springs of 2 and 5 N/mm pulled along lines in space: 1/2 k u^2 to round-off, whatever the steps."""
    stiffness, way = np.array([2.0, 5.0]), np.array([[1.0, 2.0, -2.0], [0.0, 3.0, 4.0]])
    position = np.array([0.0, 0.3, 0.4, 1.0])[:, None, None] * way
    energy = 0.5 * (stiffness * (position**2).sum(axis=2)).sum(axis=1)
    found = balance(position, stiffness[:, None] * position, energy)
    assert found.work == pytest.approx(np.diff(energy), rel=1e-14)
    assert np.abs(found.loss).max() < 1e-14 * energy[-1]
    assert found.work.sum() == pytest.approx(0.5 * (2 * 9 + 5 * 25), rel=1e-14)


def test_the_error_of_a_force_that_bends_is_that_of_the_trapezoidal_rule() -> None:
    """f = u^2: a step from u to u + h has the error h^3 / 6."""
    position = np.arange(4.0)[:, None, None] * [0.0, 0.0, 0.5]
    found = balance(position, position**2, position[:, 0, 2] ** 3 / 3)
    assert found.loss == pytest.approx([0.5**3 / 6] * 3, rel=1e-12)


def test_one_state_has_no_steps() -> None:
    found = balance(np.zeros((1, 2, 3)), np.zeros((1, 2, 3)), np.ones(1))
    assert found.work.shape == found.stored.shape == found.loss.shape == (0,)


@pytest.mark.parametrize(
    ("position", "force", "energy", "field"),
    [
        ((3, 2, 3), (3, 2, 3), (3, 1), "energy"),
        ((3, 2, 3), (3, 2, 3), (0,), "energy"),
        ((2, 2, 3), (3, 2, 3), (3,), "position"),
        ((3, 2, 2), (3, 2, 3), (3,), "position"),
        ((3, 6), (3, 2, 3), (3,), "position"),
        ((3, 2, 3), (3, 1, 3), (3,), "force"),
    ],
)
def test_shapes_that_do_not_fit_are_refused(
    position: tuple[int, ...], force: tuple[int, ...], energy: tuple[int, ...], field: str
) -> None:
    with pytest.raises(DesignError, match=f"^{field}: "):
        balance(np.zeros(position), np.zeros(force), np.zeros(energy))


# ---- A reversible path: one crossing of three fibrils each -------------------------------------------------

FIRST, LAST = 0.05, 0.15


@cache
def crossing() -> tuple[Fabric, Equilibrium]:
    """One yarn over another, stretched to the beginning of the path: from here on the same fibrils touch."""
    design = plain_weave(yarns=1, rows=(1, 2))
    design = replace(design, numerics=replace(design.numerics, elements=4, order=2, tolerance=TOLERANCE))
    fabric = Fabric(design, build_mesh(design))
    rest = relax(fabric.mesh, design)
    return fabric, fabric.along([0.0, FIRST], rest)[-1]


@cache
def reversible(steps: int) -> list[Equilibrium]:
    fabric, start = crossing()
    return fabric.along(np.linspace(FIRST, LAST, steps + 1), start)


def test_work_is_stored_where_the_path_is_reversible() -> None:
    """The difference falls at second order, the trapezoidal rule's, and Richardson's extrapolation leaves nothing.

    Order: 0.15 allows for the next term of the error. 1e-6: the next term after extrapolation, h^4, with two steps of
    the smaller of which h^2 leaves 1e-4.
    """
    fabric, _ = crossing()
    paths = [clamp_balance(fabric.mesh, reversible(steps)) for steps in (2, 4, 8)]
    stored = paths[0].stored.sum()
    assert [path.stored.sum() for path in paths] == pytest.approx([stored] * 3, rel=1e-9)
    lost = np.array([path.loss.sum() for path in paths])
    assert np.log2(lost[:-1] / lost[1:]) == pytest.approx([2.0, 2.0], abs=0.15)
    assert abs(lost[-1]) < 1e-4 * stored
    extrapolated = lost[-1] + (lost[-1] - lost[-2]) / 3
    assert abs(extrapolated) < 1e-6 * stored


def test_a_reversible_path_leads_back_and_gives_all_work_back() -> None:
    """State by state; the work of the way there and back cancels although either has a quadrature error."""
    fabric, _ = crossing()
    there = reversible(4)
    back = fabric.along(np.linspace(LAST, FIRST, 5), there[-1])
    for one, other in zip(there, reversed(back), strict=True):
        assert apart(one, other) < SAME
    cycle = clamp_balance(fabric.mesh, [*there, *back[1:]])
    assert abs(cycle.work.sum()) < 1e-6 * np.abs(cycle.work).sum()
    assert abs(cycle.stored.sum()) < 1e-9 * np.abs(cycle.stored).sum()  # energies are of second order in the residual


# ---- A path with snaps: two by two yarns of five fibrils ---------------------------------------------------

STRAINS = np.array([0.0375, 0.05, 0.0625, 0.075, 0.0875, 0.1, 0.0875, 0.075, 0.0625, 0.05, 0.0375])
"""Load and unload; below the first strain and above the last the cell is reversible."""
FINER = 4
JUMP = 0.03
"""mm: how far a node is from where the affine move put it, after a snap at least; after a smooth fine step a tenth of
that is usual, and two thirds at most, just before a snap."""


@dataclass
class Loop:
    """The cycle in coarse steps and in finer ones; and from each coarse step one step back."""

    fabric: Fabric
    coarse: list[Equilibrium]
    fine: list[Equilibrium]
    returned: list[Equilibrium]

    @property
    def irreversible(self) -> np.ndarray:
        """(S,) whether a coarse step and one step back do not lead to where the step began."""
        return np.array([apart(a, b) > SAME for a, b in zip(self.coarse[:-1], self.returned, strict=True)])

    def balances(self) -> tuple[EnergyBalance, EnergyBalance]:
        mesh = self.fabric.mesh
        return clamp_balance(mesh, self.coarse), clamp_balance(mesh, self.fine)


@pytest.fixture(scope="module")
def loop() -> Loop:
    design, mesh = small_cell((2, 3), elements=4, tolerance=TOLERANCE)
    fabric = Fabric(design, mesh)
    start = fabric.along([0.0, STRAINS[0]], relax(mesh, design))[-1]
    coarse = fabric.along(STRAINS, start)
    fine_strains = np.interp(np.arange(FINER * (len(STRAINS) - 1) + 1) / FINER, np.arange(len(STRAINS)), STRAINS)
    returned = [fabric.along(STRAINS[[k + 1, k]], coarse[k + 1])[-1] for k in range(len(STRAINS) - 1)]
    return Loop(fabric, coarse, fabric.along(fine_strains, start), returned)


def test_the_cycle_closes_and_all_its_work_is_lost(loop: Loop) -> None:
    """Back at the first state, the energy is what it was: the work of the cycle, which is positive, has gone."""
    for path, found in zip((loop.coarse, loop.fine), loop.balances(), strict=True):
        assert apart(path[0], path[-1]) < SAME
        assert abs(found.stored.sum()) < 1e-8 * np.abs(found.stored).sum()
        assert found.work.sum() > 1e-3 * np.abs(found.work).sum()


def test_the_cell_goes_up_and_down_on_different_branches(loop: Loop) -> None:
    """At some strains two equilibria of different energies, both of them minima (`relax` returns nothing else)."""
    up, down = loop.coarse[:6], loop.coarse[:-7:-1]
    different = [apart(one, other) > JUMP for one, other in zip(up, down, strict=True)]
    assert 0 < sum(different) < 5  # and at the others the same one
    assert different == [apart(one, other) > SAME for one, other in zip(up, down, strict=True)]
    assert max(abs(one.energy / other.energy - 1) for one, other in zip(up, down, strict=True)) > 1e-3


def test_energy_is_lost_where_the_step_cannot_be_undone_and_nowhere_else(loop: Loop) -> None:
    """Irreversible steps are found without looking at energy; each loses ten times what quadrature can feign.

    The quadrature error of a smooth step is read off the reversible steps.
    """
    found, _ = loop.balances()
    snaps = loop.irreversible
    assert 2 <= snaps.sum() <= 6  # some, and not all
    assert np.any(snaps[:5])
    assert np.any(snaps[5:])
    feigned = np.abs(found.loss[~snaps]).max()
    assert found.loss[snaps].min() > 10 * feigned
    assert found.loss[~snaps].min() >= -feigned


def test_snaps_stay_in_their_places_and_keep_their_loss_as_steps_get_smaller(loop: Loop) -> None:
    """The quadrature error of a step falls as h^3, by 64 for four steps in one; of a coarse step's four together by
    16; the loss of a snap stays, up to an error of first order, from where in its step it happens."""
    coarse, fine = loop.balances()
    snaps = loop.irreversible
    fine_loss = fine.loss.reshape(-1, FINER)
    together = fine_loss.sum(axis=1)
    assert np.abs(together[~snaps]).max() < np.abs(coarse.loss[~snaps]).max() / 10
    assert together[snaps].min() > 100 * np.abs(together[~snaps]).max()
    assert together[snaps].sum() == pytest.approx(coarse.loss[snaps].sum(), rel=0.25)
    # In each of these coarse steps it is one fine step that loses; the others are smooth.
    others = np.sort(fine_loss[snaps], axis=1)[:, :-1]
    assert np.abs(others).max() < 0.05 * fine_loss[snaps].max(axis=1).min()


def test_energy_never_comes_from_nowhere(loop: Loop) -> None:
    """Second law: no loss is negative but by quadrature.

    Its error is the larger the nearer a step comes to the end of its branch, since there the fibrils move with the
    square root of the distance. It stays below a thousandth of a step's work and a twentieth of the least snap.
    """
    snap = loop.balances()[0].loss[loop.irreversible].min()
    for found in loop.balances():
        assert np.all(found.loss > -1e-3 * np.abs(found.work))
        assert found.loss.min() > -0.05 * snap


def test_a_snap_is_a_jump_to_other_contacts(loop: Loop) -> None:
    """With smaller steps a smooth step's motion shrinks in proportion; a snap's does not, and other fibrils touch."""
    lost = loop.balances()[1].loss
    snaps = lost > 0.05 * lost.max()
    assert np.array_equal(np.any(snaps.reshape(-1, FINER), axis=1), loop.irreversible)
    strains = np.interp(np.arange(len(loop.fine)) / FINER, np.arange(len(STRAINS)), STRAINS)
    for k in range(len(lost)):
        before, after = loop.fine[k], loop.fine[k + 1]
        moved = move(before.configuration, np.diag([1 + strains[k], 1.0]), np.diag([1 + strains[k + 1], 1.0]))
        motion = np.abs(moved.r - after.configuration.r).max()
        assert (motion > JUMP) == snaps[k]
        if snaps[k]:
            assert loop.fabric.touching(before) != loop.fabric.touching(after)
