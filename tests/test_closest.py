"""The contact curve and the closest points on it, against SciPy's spline and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from fabrics import contact_term, fibrils_through, reference_curve, straight, tangle
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.contact.closest import _Meeting, _root, _Scratch
from circuittex.contact.curve import BASIS, CurveTable, bezier, curve_table, curve_through, evaluate
from circuittex.contact.hull import hulls
from circuittex.contact.penalty import contact_points
from circuittex.geometry.mesh import FibrilMesh

ROUND_OFF = 1e-13  # of coordinates of a few mm


def on_curve(table: CurveTable, r: Floats, fibril: int, s: float, order: int = 0) -> Floats:
    """Position, or derivative of the given order, at s (in nodes) by the kernel under test."""
    base, end = table.first_interval[fibril], table.first_interval[fibril + 1]
    k = min(int(s), end - base - 1)
    weights, x = np.empty(4), np.empty(3)
    evaluate(BASIS[table.kind[base + k]], r, table.window[base + k], s - k, order, weights, x)
    return x


def nearest(mesh: FibrilMesh, r: Floats, fibril: int, x: Floats) -> tuple[float, float]:
    """Globally closest position (in nodes) and distance, by dense sampling and SciPy's bounded search."""
    curve = reference_curve(mesh, r, fibril)
    s = np.linspace(0.0, curve.x[-1], 200 * len(curve.x))
    best = s[np.argmin(((curve(s) - x) ** 2).sum(axis=1))]
    bounds = (max(0.0, best - 0.01), min(curve.x[-1], best + 0.01))
    found = minimize_scalar(
        lambda t: ((curve(t) - x) ** 2).sum(), bounds=bounds, method="bounded", options={"xatol": 1e-12}
    )
    at = min([float(found.x), *bounds], key=lambda t: ((curve(t) - x) ** 2).sum())
    return at, float(np.linalg.norm(curve(at) - x))


@pytest.mark.parametrize("order", [0, 1, 2])
def test_curve_is_the_hermite_spline_on_both_sides_of_every_node(order: int) -> None:
    mesh = tangle(1, fibrils=3, noise=0.1)
    table = curve_table(mesh)
    for f in range(mesh.n_fibrils):
        curve = reference_curve(mesh, mesh.position, f)
        for k in range(len(curve.x) - 1):
            for t in (0.0, 0.3, 1.0):
                x = np.empty(3)
                interval = table.first_interval[f] + k
                window, basis = table.window[interval], BASIS[table.kind[interval]]
                evaluate(basis, mesh.position, window, t, order, np.empty(4), x)
                piece = np.polynomial.Polynomial  # the spline's own piece k, so that second derivatives have a side
                expected = [piece(curve.c[::-1, k, c]).deriv(order)(t) if order else curve(k + t)[c] for c in range(3)]
                assert np.abs(x - expected).max() < 10 * ROUND_OFF


def test_curve_has_one_tangent_at_every_node() -> None:
    """C1: the end of an interval and the start of the next agree in value and first derivative."""
    mesh = tangle(2, fibrils=2, noise=0.2)
    table, r = curve_table(mesh), mesh.position
    hull = bezier(table, r)
    inner = np.flatnonzero(np.diff(table.fibril) == 0)
    assert np.abs(hull[inner, 3] - hull[inner + 1, 0]).max() < ROUND_OFF
    before, after = hull[inner, 3] - hull[inner, 2], hull[inner + 1, 1] - hull[inner + 1, 0]
    assert np.abs(before - after).max() < ROUND_OFF


@given(seed=st.integers(0, 2**32 - 1), nodes=st.integers(4, 9))
def test_parabolas_are_reproduced(seed: int, nodes: int) -> None:
    a, b, c = np.random.default_rng(seed).uniform(-1, 1, (3, 3))

    def parabola(s: float | Floats) -> Floats:
        s = np.asarray(s)[..., None]
        return np.asarray(a + b * s + 0.1 * c * s**2)

    mesh = fibrils_through([parabola(np.arange(nodes))])
    table = curve_table(mesh)
    for s in np.linspace(0.0, nodes - 1, 23):
        assert np.abs(on_curve(table, mesh.position, 0, s) - parabola(s)).max() < 100 * ROUND_OFF


def test_curve_converges_to_a_sine_with_third_and_its_tangent_with_second_order() -> None:
    sizes = np.array([8, 16, 32, 64])
    error = np.empty((2, len(sizes)))
    for i, n in enumerate(sizes):
        at = np.linspace(0.0, np.pi, n + 1)
        mesh = fibrils_through([np.stack([at, np.sin(at), 0 * at], axis=1)])
        table = curve_table(mesh)
        s = np.linspace(0.0, n, 5 * n + 1)
        x, h = s * np.pi / n, np.pi / n
        value = np.array([on_curve(table, mesh.position, 0, p) for p in s])
        slope = np.array([on_curve(table, mesh.position, 0, p, order=1) for p in s])
        error[:, i] = np.abs(value[:, 1] - np.sin(x)).max(), np.abs(slope[:, 1] / h - np.cos(x)).max()
    rate = np.log2(error[:, :-1] / error[:, 1:])
    assert rate[0, -1] > 2.8
    assert rate[1, -1] > 1.9


def test_curve_stays_in_the_hull_of_its_bezier_points() -> None:
    """The Bernstein weights of the points reproduce the curve and are positive and sum to one."""
    mesh = tangle(3, fibrils=2, noise=0.2)
    table = curve_table(mesh)
    hull = bezier(table, mesh.position)
    for t in np.linspace(0.0, 1.0, 7):
        bernstein = np.array([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
        for i in range(len(hull)):
            s = i - table.first_interval[table.fibril[i]] + t
            x = np.empty(3)
            evaluate(BASIS[table.kind[i]], mesh.position, table.window[i], t, 0, np.empty(4), x)
            assert np.abs(x - bernstein @ hull[i]).max() < ROUND_OFF, s


def test_too_few_nodes_are_refused() -> None:
    with pytest.raises(DesignError, match="four nodes"):
        curve_table(fibrils_through([straight([0, 0, 0], [1, 0, 0], 2)]))


@given(seed=st.integers(0, 2**32 - 1), order=st.sampled_from([1, 2]))
def test_touching_points_are_the_closest_of_the_whole_fibril(seed: int, order: int) -> None:
    """Positions and overlaps of gently bent fibrils against brute force, contact at fibril ends included."""
    mesh = tangle(seed, fibrils=3, elements=8 // order, order=order, radius=0.3)
    term, q = contact_term(mesh, per_element=2)
    found, table, r = term.touching(q), term.table, term.positions(q)
    seen = set()
    for i in range(len(found.overlap)):
        a, g = found.interval_a[i], found.fibril_b[i]
        f = table.fibril[a]
        x = reference_curve(mesh, r, f)(a - table.first_interval[f] + found.t_a[i])
        at, distance = nearest(mesh, r, g, x)
        assert found.overlap[i] == pytest.approx(0.6 - distance, abs=1e-11)
        # The distance is flat at its minimum: the search's xatol, not round-off, limits the position.
        assert found.position_b[i] == pytest.approx(at, abs=1e-5)
        seen.add((a, found.t_a[i], g))
    assert len(seen) == count_touching(mesh, r, table, term.points, 0.6)


def count_touching(mesh: FibrilMesh, r: Floats, table: CurveTable, points: Floats, reach: float) -> int:
    """How many (contact point, other fibril) are closer than `reach`, by brute force over all of them."""
    total = 0
    for a, f in enumerate(table.fibril):
        k = a - table.first_interval[f]
        for t in points[k % len(points)]:
            x = reference_curve(mesh, r, f)(k + t)
            total += sum(nearest(mesh, r, g, x)[1] < reach for g in range(mesh.n_fibrils) if g != f and t >= 0)
    return total


def test_beyond_a_fibrils_end_the_end_itself_is_closest() -> None:
    """A fibril that passes in front of another's end, at both ends: position exactly 0 and n."""
    lines = [straight([0, 0, 0], [4, 0, 0], 5)]
    lines += [straight([-0.1, -1, 0], [-0.1, 1, 0], 7), straight([4.1, -1, 0], [4.1, 1, 0], 7)]
    term, q = contact_term(fibrils_through(lines), per_element=4)
    found = term.touching(q)
    onto = found.fibril_b == 0
    first = term.table.fibril[found.interval_a] == 1
    assert np.count_nonzero(onto & first) > 2
    assert np.count_nonzero(onto & ~first) > 2
    assert np.all(found.position_b[onto & first] == 0.0)
    assert np.all(found.position_b[onto & ~first] == 5.0)


@pytest.mark.parametrize("quick", [False, True])
@given(seed=st.integers(0, 2**32 - 1), s=st.floats(0.01, 6.99), away=st.floats(-0.2, 0.2), start=st.floats(0.0, 1.0))
def test_the_foot_of_a_normal_is_found_from_anywhere_and_found_again(
    quick: bool, seed: int, s: float, away: float, start: float
) -> None:
    """From any place on its interval the search reaches the foot; started at the foot it stays."""
    t = np.linspace(0.0, 2.0, 8)
    bend = np.random.default_rng(seed).uniform(-0.2, 0.2)
    mesh = fibrils_through([np.stack([3 * t, bend * t**2, np.zeros(8)], axis=1)])
    table, r = curve_table(mesh), mesh.position
    point = on_curve(table, r, 0, s) + np.array([0.0, 0.0, away])
    scratch = _Scratch(point, np.empty((3, 3)), np.empty(4), np.empty((64, 8)))
    k = float(int(s))

    def search(start: float) -> float:
        meeting, curve = _Meeting(0, 0, 0, 7, 1.0, quick), curve_through(table, r)
        return float(_root(curve, hulls(curve).power, meeting, start, k, k + 1.0, 1.0, scratch))

    found = search(k + start)
    assert found == pytest.approx(s, abs=1e-12)
    assert search(found) == pytest.approx(found, abs=1e-13)


@pytest.mark.parametrize(("order", "per_element"), [(1, 1), (1, 4), (2, 1), (2, 3), (2, 4)])
def test_contact_points_are_equally_spaced_and_symmetric(order: int, per_element: int) -> None:
    mesh = fibrils_through([straight([0, 0, 0], [1, 0, 0], 4, order)], order=order)
    table = contact_points(mesh, per_element)
    at = np.sort(np.concatenate([k + row[row >= 0] for k, row in enumerate(table)])) / order
    assert np.abs(at - (np.arange(per_element) + 0.5) / per_element).max() < 1e-15
    assert np.abs(at + at[::-1] - 1).max() < 1e-15


@given(seed=st.integers(0, 2**32 - 1))
def test_quick_places_are_the_same_but_for_rounding(seed: int) -> None:
    """A tangle's places by the powers of the local coordinate and by the weights of the nodes.

    Where a minimum is flat its place is known to the root of round-off alone, and the distance to round-off.
    """
    term, q = contact_term(tangle(seed, fibrils=6, noise=0.1), per_element=3)
    r = term.positions(q)
    candidates = term._near(r)[0]
    plain, quick = (term._search(candidates, r, quick=quick) for quick in (False, True))
    deep = [each.overlap > ROUND_OFF for each in (plain, quick)]  # what touches in the last digit may differ
    for name, one in vars(plain).items():
        tolerance = np.sqrt(ROUND_OFF) if name == "position_b" else ROUND_OFF
        assert one[deep[0]] == pytest.approx(vars(quick)[name][deep[1]], abs=tolerance)
