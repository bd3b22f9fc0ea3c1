"""Work of the clamps against stored energy: equal where a path is reversible; what is lost is lost in snaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from fabrics import small_cell
from synthetic_study import synthetic_study

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.contact.extract import contacts_of
from circuittex.design import Design, load_unload, plain_weave, shear, uniaxial
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.relaxation.increment import advance
from circuittex.relaxation.relax import Equilibrium, move, relax
from circuittex.results.records import Record, Study
from circuittex.results.report.energy import energy_section
from circuittex.results.report.number import number
from circuittex.results.store import load_study, write_study_start
from circuittex.results.summary import summary
from circuittex.results.work import EnergyBalance, balance, clamp_balance, step_balances
from circuittex.study.run import run_study

pytestmark = pytest.mark.xdist_group("energy_balance")  # what its fixtures make serves one worker

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
        states = [start]
        for before, after in pairwise(strains):
            moved = move(states[-1].configuration, np.diag([1 + before, 1.0]), np.diag([1 + after, 1.0]))
            states.append(relax(self.mesh, self.design, moved))
        return states

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
    design = replace(design, numerics=replace(design.numerics, elements=4, order=2, tolerance=f"{TOLERANCE} N"))
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
    balances = [clamp_balance(fabric.mesh, reversible(steps)) for steps in (2, 4, 8)]
    stored = balances[0].stored.sum()
    assert [each.stored.sum() for each in balances] == pytest.approx([stored] * 3, rel=1e-9)
    lost = np.array([each.loss.sum() for each in balances])
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
    design, mesh = small_cell((2, 3), elements=4, tolerance=f"{TOLERANCE} N")
    fabric = Fabric(design, mesh)
    start = fabric.along([0.0, STRAINS[0]], relax(mesh, design))[-1]
    coarse = fabric.along(STRAINS, start)
    fine_strains = np.interp(np.arange(FINER * (len(STRAINS) - 1) + 1) / FINER, np.arange(len(STRAINS)), STRAINS)
    returned = [fabric.along(STRAINS[[k + 1, k]], coarse[k + 1])[-1] for k in range(len(STRAINS) - 1)]
    return Loop(fabric, coarse, fabric.along(fine_strains, start), returned)


def test_the_cycle_closes_and_all_its_work_is_lost(loop: Loop) -> None:
    """Back at the first state, the energy is what it was: the work of the cycle, which is positive, has gone."""
    for states, found in zip((loop.coarse, loop.fine), loop.balances(), strict=True):
        assert apart(states[0], states[-1]) < SAME
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


# ---- The records of a study ----------------------------------------------------------------------------------

SPRING = 3.0  # N/mm


def sprung(record: Record, pull: float, lost: float = 0.0) -> Record:
    """The record as if each fibril were a spring that its plus end stretches by `pull` along its yarn."""
    mesh = record.contacts.mesh
    way = np.eye(3)[mesh.yarn_axis[mesh.yarn]] * pull
    x = initial_configuration(mesh).x.copy()
    x[mesh.end_nodes(+1), 0] += way
    return replace(
        record,
        configuration=Configuration(x),
        end_force=np.concatenate([-SPRING * way, SPRING * way]),
        energy=mesh.n_fibrils * SPRING * pull**2 / 2 - lost,
    )


def springs() -> Study:
    """Springs pulled by 0.1 mm, then on two paths to 0.2 and 0.4, and to 0.3 and 0.1, where 0.05 N mm are lost."""
    study = synthetic_study(3, contacts=4, rows=(1,), loadings=("stretch", "shear"))
    pulls, lost = (0.1, 0.2, 0.4, 0.3, 0.1), (0.0, 0.0, 0.0, 0.0, 0.05)
    return replace(study, records=tuple(map(sprung, study.records, pulls, lost)))


def test_the_steps_of_a_study_start_at_the_relaxed_state_on_every_path() -> None:
    study = springs()
    found = step_balances(study)
    stiffness = study.mesh.n_fibrils * SPRING
    steps = {"stretch-0.0250": (0.1, 0.2), "stretch-0.0500": (0.2, 0.4)}
    steps |= {"shear-0.0250": (0.1, 0.3), "shear-0.0500": (0.3, 0.1)}
    assert list(found) == list(steps)
    for name, (before, after) in steps.items():
        assert found[name].work == pytest.approx([stiffness * (after**2 - before**2) / 2], rel=1e-12)
        assert found[name].loss == pytest.approx([0.05 if name == "shear-0.0500" else 0.0], abs=1e-12)


def test_the_summary_has_the_energies_of_every_state() -> None:
    keys = ("stored_energy_N_mm", "clamp_work_N_mm", "stored_energy_change_N_mm", "energy_loss_N_mm")
    states = {state["name"]: [state[key] for key in keys] for state in summary(springs())["states"]}
    stiffness = springs().mesh.n_fibrils * SPRING
    assert states["relaxed"] == [pytest.approx(stiffness * 0.005), None, None, None]
    expected = [stiffness * 0.005 - 0.05, -stiffness * 0.04, -stiffness * 0.04 - 0.05, 0.05]
    assert states["shear-0.0500"] == pytest.approx(expected, rel=1e-12)


def test_the_report_has_a_table_of_energies() -> None:
    text = energy_section(springs())
    assert '<th scope="row">relaxed</th><td>0.12</td><td>–</td><td>–</td><td>–</td>' in text
    assert '<th scope="row">shear-0.0500</th><td>0.07</td><td>-0.96</td><td>-1.01</td><td>0.05</td>' in text


def test_forces_on_the_ends_are_those_on_the_nodes() -> None:
    record = springs().records[2]
    mesh = record.contacts.mesh
    for side, sign in ((-1, -1.0), (+1, 1.0)):
        expected = sign * 0.4 * SPRING * np.eye(3)[mesh.yarn_axis[mesh.yarn]]
        assert record.reaction[mesh.end_nodes(side)] == pytest.approx(expected, rel=1e-12)
    assert np.count_nonzero(record.reaction.any(axis=1)) == 2 * mesh.n_fibrils


def test_a_study_keeps_the_balance_of_its_equilibria(tmp_path: Path) -> None:
    """The same equilibria computed without a study; on the strip the weft is let go and does no work any more."""
    design, mesh = small_cell((1, 2), elements=4, tolerance=f"{TOLERANCE} N")
    loading = (load_unload(uniaxial("cycle", (0.03, 0.06))), shear("strip", (0.05, 0.1), free="y"))
    design = replace(design, terminals=(), probes=(), loading=loading)
    study = run_study(design, workers=1, solver=MultifrontalSolver)
    expected: dict[str, EnergyBalance] = {}
    rest = relax(mesh, design, solver=MultifrontalSolver())
    for loading in design.loading:
        states = [rest]
        gradients = [np.eye(2), *map(np.array, loading.gradients)]
        for one, other in pairwise(gradients):
            start = states[-1].configuration
            found = advance(mesh, design, start, one, other, free_edges=loading.free, solver=MultifrontalSolver())
            states.append(found.equilibrium)
        whole = clamp_balance(mesh, states)
        names = [record.name for record in study.records if record.loading == loading.name]
        assert len(names) == len(whole.work)
        expected |= {n: EnergyBalance(whole.work[k : k + 1], whole.stored[k : k + 1]) for k, n in enumerate(names)}
    write_study_start(tmp_path / "results.h5", study)
    text = energy_section(study)
    for kept in (study, load_study(tmp_path / "results.h5")):
        balances = step_balances(kept)
        assert list(balances) == list(expected)
        for name, step in expected.items():
            # Either may stand elsewhere within the tolerance, which moves energies in second order.
            assert balances[name].work == pytest.approx(step.work, rel=1e-6)
            assert balances[name].stored == pytest.approx(step.stored, rel=1e-6)
            cells = "".join(f"<td>{number(value.item())}</td>" for value in (step.work, step.stored))
            assert f"{cells}<td>" in text[text.index(f'<th scope="row">{name}</th>') :]
    loss = sum(step.loss.item() for name, step in expected.items() if name.startswith("cycle"))
    assert abs(loss) < 0.02 * max(step.work.item() for step in expected.values())
