"""Contact forces against differences of the energy, conservation, symmetry and rigid cylinders in closed form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from fabrics import contact_term, fibrils_through, renumbered, straight, tangle
from hypothesis import given
from hypothesis import strategies as st

from circuittex.base.arrays import Floats
from circuittex.contact.penalty import PenaltyContact
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.pattern import Pattern, build_pattern, multiply

P, R = 5.0, 0.15


def assembled(term: PenaltyContact, q: Floats) -> tuple[float, Floats, Pattern, Floats]:
    """Energy, gradient (n_dofs,), pattern and tangent of the contact term alone."""
    term.prepare(q)
    pattern = build_pattern(len(q) // 9, *term.pairs())
    gradient, data = np.zeros(len(q)), np.zeros(pattern.nnz)
    softening = np.zeros(pattern.nnz)
    energy = term.assemble(q, pattern, gradient, data, softening)
    return energy, gradient, pattern, data + softening


def forces(mesh: FibrilMesh, per_element: int = 4) -> tuple[float, Floats]:
    """Energy and the (N, 3) gradient in mesh order."""
    term, q = contact_term(mesh, penalty=P, per_element=per_element)
    energy, gradient, _, _ = assembled(term, q)
    return energy, term.positions(gradient)


def with_contact_at_ends(order: int) -> FibrilMesh:
    """A tangle and two fibrils whose ends lie against each other and against it."""
    mesh = tangle(11, fibrils=5, elements=6 // order, order=order, radius=0.25)
    lines = [mesh.position[mesh.first_node[f] : mesh.first_node[f + 1]] for f in range(5)]
    lines.append(straight(lines[0][0] + [-0.1, 0.05, 0.2], lines[0][0] + [-1.1, 0.4, 0.3], 6 // order, order))
    lines.append(straight(lines[0][-1] + [0.1, 0.05, 0.2], lines[0][-1] + [1.2, 0.7, 0.3], 6 // order, order))
    return fibrils_through(lines, order=order, radius=0.25)


CASES = [tangle(seed, fibrils=5, elements=6, radius=0.25) for seed in (0, 1)]
CASES += [tangle(2, fibrils=5, elements=3, order=2, radius=0.25)]
CASES += [with_contact_at_ends(1), with_contact_at_ends(2)]


def test_the_cases_have_contacts_inside_and_at_ends() -> None:
    for number, mesh in enumerate(CASES):
        term, q = contact_term(mesh)
        found = term.touching(q)
        last = np.diff(term.table.first_interval)[found.fibril_b]
        at_end = (found.position_b == 0) | (found.position_b == last)
        assert np.count_nonzero(~at_end) > 20
        if number >= 3:
            assert np.count_nonzero(at_end) > 4


@pytest.mark.parametrize("mesh", CASES)
def test_gradient_is_the_slope_of_the_energy(mesh: FibrilMesh) -> None:
    term, q = contact_term(mesh, penalty=P)
    _, gradient, _, _ = assembled(term, q)
    rng = np.random.default_rng(0)
    step = 1e-6  # central differences: truncation 1e-12 relative, round-off 1e-10
    for _ in range(10):
        direction = rng.normal(size=len(q))
        slope = (term.energy(q + step * direction) - term.energy(q - step * direction)) / (2 * step)
        assert slope == pytest.approx(gradient @ direction, abs=1e-8 * np.abs(gradient).sum())


@pytest.mark.parametrize("mesh", CASES)
def test_tangent_is_the_slope_of_the_gradient(mesh: FibrilMesh) -> None:
    """Exact, the motion of the closest point included: differences see nothing beyond their own error."""
    term, q = contact_term(mesh, penalty=P)
    _, _, pattern, data = assembled(term, q)
    rng = np.random.default_rng(1)
    step = 1e-7  # small, so that no contact opens or closes in between
    for _ in range(10):
        direction = rng.normal(size=len(q))
        ahead, behind = (assembled(term, q + s * direction)[1] for s in (step, -step))
        product = multiply(pattern, data, direction)
        assert np.abs((ahead - behind) / (2 * step) - product).max() < 2e-8 * np.abs(product).max()


@pytest.mark.parametrize("mesh", CASES)
@pytest.mark.parametrize("threads", [2, 3, 7])
def test_threads_change_no_bit(mesh: FibrilMesh, threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("circuittex.contact.penalty.WORTH_A_THREAD", 1)
    found = []
    for cores in (1, threads):
        monkeypatch.setattr("circuittex.contact.penalty.cores", lambda cores=cores: cores)
        term, q = contact_term(mesh, penalty=P)
        _, gradient, _, data = assembled(term, q)
        found.append((gradient.tobytes(), data.tobytes()))
    assert found[0] == found[1]


@given(seed=st.integers(0, 2**32 - 1), order=st.sampled_from([1, 2]))
def test_forces_and_moments_sum_to_zero(seed: int, order: int) -> None:
    mesh = tangle(seed, fibrils=5, elements=6 // order, order=order, radius=0.3)
    _, force = forces(mesh)
    size = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() <= 1e-14 * size
    # The lever d x n vanishes only as well as the closest point is found, which is to round-off of positions.
    assert np.abs(np.cross(mesh.position, force).sum(axis=0)).max() <= 1e-12 * size


@given(seed=st.integers(0, 2**32 - 1))
def test_directors_feel_no_contact(seed: int) -> None:
    term, q = contact_term(tangle(seed, radius=0.3))
    assert np.all(assembled(term, q)[1].reshape(-1, 9)[:, 3:] == 0.0)


@given(
    seed=st.integers(0, 2**32 - 1),
    order=st.sampled_from([1, 2]),
    place=st.permutations(range(5)),
    flip=st.sets(st.integers(0, 4)),
)
def test_renumbering_and_reversing_fibrils_changes_nothing(
    seed: int, order: int, place: Sequence[int], flip: set[int]
) -> None:
    mesh = tangle(seed, fibrils=5, elements=6 // order, order=order, radius=0.25)
    other, node = renumbered(mesh, place, sorted(flip))
    energy, force = forces(mesh)
    same_energy, same_force = forces(other)
    assert same_energy == pytest.approx(energy, rel=1e-12)
    assert np.abs(same_force - force[node]).max() <= 1e-12 * max(1.0, np.abs(force).max())


@given(seed=st.integers(0, 2**32 - 1))
def test_moving_and_turning_the_whole_changes_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = tangle(seed, fibrils=4, elements=5, radius=0.25)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    lines = [mesh.position[mesh.first_node[f] : mesh.first_node[f + 1]] @ turn.T for f in range(4)]
    moved = fibrils_through([line + 3.0 for line in lines], radius=0.25)
    energy, force = forces(mesh)
    same_energy, same_force = forces(moved)
    assert same_energy == pytest.approx(energy, rel=1e-11)
    assert np.abs(same_force - force @ turn.T).max() <= 1e-11 * max(1.0, np.abs(force).max())


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("first", "second"), [(6, 6), (6, 8)])
def test_parallel_cylinders(order: int, first: int, second: int) -> None:
    """Total force P o L and energy 1/2 P o^2 L, whether or not their meshes agree."""
    length, apart = 2.0, 0.25
    lines = [straight([0, 0, z], [length, 0, z], n, order) for z, n in ((0.0, first), (apart, second))]
    energy, force = forces(fibrils_through(lines, order=order, radius=R))
    overlap = 2 * R - apart
    assert energy == pytest.approx(0.5 * P * overlap**2 * length, rel=1e-13)
    on_lower = force[: first * order + 1].sum(axis=0)
    assert on_lower == pytest.approx([0.0, 0.0, P * overlap * length], abs=1e-13)  # the gradient points to more overlap


def crossed(n: int, height: float) -> FibrilMesh:
    """Two cylinders of n elements over 2 mm that cross at right angles, `height` apart, away from nodes and middles."""
    c = 0.0371
    lines = [straight([-1 - c, 0, 0], [1 - c, 0, 0], n), straight([0, -1 + c / 2, height], [0, 1 + c / 2, height], n)]
    return fibrils_through(lines, radius=R)


HEIGHT = 0.22
HALF = np.sqrt(4 * R**2 - HEIGHT**2)  # contact where |x| < HALF, since d = sqrt(h^2 + x^2) to the foot of the crossing


def test_cylinders_crossed_at_right_angles() -> None:
    """Both sides see o = 2R - sqrt(h^2 + x^2); line load, force and energy converge with second order.

    A midpoint rule with spacing w errs by at most w^2/24 times the change of slope, plus w^2/8 times the jump of
    the slope at either end of the contact: the bound that is asserted.
    """
    h, x = HEIGHT, HALF
    root = np.arcsinh(x / h)
    load = P * (4 * R * x - (2 * R * x + h**2 * root))
    force = P * h * (4 * R * root - 2 * x)
    energy = 0.5 * P * ((4 * R**2 + h**2) * 2 * x + 2 * x**3 / 3 - 4 * R * (2 * R * x + h**2 * root))
    slope = x / (2 * R)
    jumps = np.array([P * slope, P * slope * h / (2 * R), 0.0])  # of load, force and energy at the end of contact
    # Change of slope between the crossing and the end, bounded by that of P o, P o h / d and P o^2 / 2.
    change = np.array([P * slope, 2 * P * x / h, P * 2 * R * slope])
    for n in (40, 80, 160, 320):
        per_element = 2
        term, q = contact_term(crossed(n, h), penalty=P, per_element=per_element)
        w = 2.0 / n / per_element
        found = term.touching(q)
        energy_found, gradient = assembled(term, q)[:2]
        measured = [
            P * float(np.sum(term.weight[term.table.fibril[found.interval_a]] * found.overlap)),
            float(term.positions(gradient)[: n + 1, 2].sum()),
            energy_found,
        ]
        error = np.abs(np.array(measured) - [load, force, energy])
        assert np.all(error <= w**2 * (jumps / 4 + change / 12))


def test_penalty_scales_energy_and_force() -> None:
    mesh = CASES[0]
    results = []
    for penalty in (1.0, 4.0):
        term, q = contact_term(mesh, penalty=penalty)
        results.append(assembled(term, q)[:2])
    assert results[1][0] == pytest.approx(4 * results[0][0], rel=1e-14)
    assert np.abs(results[1][1] - 4 * results[0][1]).max() < 1e-14


@pytest.mark.parametrize("mesh", CASES[:1])
def test_threads_do_not_change_a_bit(mesh: FibrilMesh, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = forces(mesh)
    monkeypatch.setattr("circuittex.contact.penalty.cores", lambda: 1)
    alone = forces(mesh)
    assert alone[0] == expected[0]
    assert np.array_equal(alone[1], expected[1])
