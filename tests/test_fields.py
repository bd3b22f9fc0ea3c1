"""Potential and temperature on contact states made by hand, against closed forms."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from skfem import Basis, Element, ElementLineP1, ElementLineP2, MeshLine
from synthetic import fibrils, rails, touching, woven

from circuittex.base.errors import DesignError
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal
from circuittex.electrical.fields import Fields, solve_fields, solve_potentials, solve_probes
from circuittex.electrical.fields.line import fibril_line
from circuittex.electrical.fields.solution import Mesh
from circuittex.electrical.fields.system import build_system, outflow

AREA = np.pi * 0.15**2
FLOATING = 1e-10
"""Relative: what lies between two feet of a floating fibril is at most 3e-11 of a contact's resistance."""

LEFT, RIGHT = Terminal("left", (("warp1", -1),)), Terminal("right", (("warp1", 1),))
OTHER_LEFT, OTHER_RIGHT = Terminal("other-left", (("warp2", -1),)), Terminal("other-right", (("warp2", 1),))
TERMINALS = (LEFT, RIGHT, OTHER_LEFT, OTHER_RIGHT)
THROUGH = Probe("through", "left", "right", 1.0)
ACROSS = Probe("across", "left", "other-left", 1.0)
OVER = Probe("over", "left", "other-right", 1.0)

PAPER_TERMINALS = (
    Terminal("left", (("warp2", -1),)),
    Terminal("right", (("warp2", 1),)),
    Terminal("parallel", (("warp3", -1),)),
    Terminal("perpendicular", (("weft2", 1),)),
)
PAPER_PROBES = tuple(Probe(name, name, "right", 1.0) for name in ("left", "parallel", "perpendicular"))


def rails_resistance(r: float, g: float, length: float) -> float:
    """Input resistance of two coupled rails, far ends open [coupled_rails in the project's benchmark table]."""
    return float(np.sqrt(2 * r / g) / np.tanh(np.sqrt(2 * r * g) * length))


def swapped(state: ContactState) -> ContactState:
    """The same contacts with a and b exchanged."""
    return replace(state, fibril_a=state.fibril_b, fibril_b=state.fibril_a, xi_a=state.xi_b, xi_b=state.xi_a)


def kirchhoff(state: ContactState, probe: Probe) -> float:
    """Current of 1 V over `probe` (of TERMINALS), by a dense conductance matrix; any contacts, reference conduction."""
    mesh = state.mesh
    places = [(f, x) for f in range(mesh.n_fibrils) for x in (0.0, mesh.length[f])]
    places += list(zip(state.fibril_a, state.xi_a, strict=True)) + list(zip(state.fibril_b, state.xi_b, strict=True))
    places = sorted({(int(f), float(x)) for f, x in places})
    number = {place: i for i, place in enumerate(places)}
    G = np.zeros((len(places), len(places)))

    def resistor(i: int, j: int, g: float) -> None:
        G[[i, j], [i, j]] += g
        G[[i, j], [j, i]] -= g

    for (f, x), (h, y) in pairwise(places):
        if f == h:
            resistor(number[f, x], number[h, y], mesh.electrical_conductivity[f] * mesh.area[f] / (y - x))
    for row in zip(state.fibril_a, state.xi_a, state.fibril_b, state.xi_b, state.conductance, strict=True):
        resistor(number[int(row[0]), float(row[1])], number[int(row[2]), float(row[3])], float(row[4]))
    ends = {t.name: t.ends[0] for t in TERMINALS}
    fixed = []
    for name in (probe.source, probe.sink):
        yarn, side = ends[name]
        f = mesh.yarn_names.index(yarn)
        fixed.append(number[f, 0.0 if side < 0 else float(mesh.length[f])])
    free = np.setdiff1d(np.arange(len(G)), fixed)
    V = np.zeros(len(G))
    V[fixed[0]] = 1.0
    V[free] = np.linalg.solve(G[np.ix_(free, free)], -G[np.ix_(free, fixed)] @ V[fixed])
    return float(G[fixed[0]] @ V)


# closed forms


@pytest.mark.parametrize("mesh", ["feet", "mechanical"])
@pytest.mark.parametrize("elements", [1, 4, 7])
def test_wire_heating(mesh: str, elements: int) -> None:
    """sigma V^2 / (8 k) = 1.25 K at mid-span for sigma = 10 S/mm, k = 1 W/(mm K), 1 V [wire_heating]: exact, also
    where no node sits at the peak."""
    state = touching(fibrils([8.0], elements=elements))
    found = solve_fields(state, TERMINALS[:2], THROUGH, mesh=mesh)
    assert_allclose(found.peak_temperature, 1.25, rtol=1e-12)
    assert_allclose(found.currents, [10 * AREA / 8, -10 * AREA / 8], rtol=1e-12)
    assert_allclose(found.temperature, 5 * (found.xi / 8) * (1 - found.xi / 8), atol=1e-12)
    assert_allclose(found.potential, 1 - found.xi / 8, atol=1e-12)


def test_insulated_yarn_of_the_paper() -> None:
    """Ten fibrils of 8 mm carry 0.8836 A at 1 V, 0.2829 ohm for each of four segments [57]."""
    state = touching(fibrils(np.full(10, 8.0), yarn=[0] * 10))
    current = solve_fields(state, TERMINALS[:2], THROUGH).currents[0]
    assert current == pytest.approx(0.8836, abs=5e-5)
    assert 1 / current / 4 == pytest.approx(0.2829, abs=5e-5)


def test_two_touching_fibrils_of_different_conductivity() -> None:
    """In series: 3 mm of the first, the contact, 5 mm of the second; catches a lost sigma."""
    first, second, contact = 3.0 / (10.0 * AREA), 5.0 / (0.25 * AREA), 40.0
    mesh = fibrils([8.0, 8.0], sigma=[10.0, 0.25])
    state = touching(mesh, [0], [3.0], [1], [3.0], conductance=1 / contact)
    found = solve_fields(state, TERMINALS, OVER)
    total = first + contact + second
    assert_allclose(found.currents[0], 1 / total, rtol=1e-12)
    at = {(int(f), float(x)): v for f, x, v in zip(found.fibril, found.xi, found.potential, strict=True)}
    assert_allclose(at[0, 3.0], 1 - first / total, rtol=1e-12)
    assert_allclose(at[0, 8.0], 1 - first / total, rtol=1e-12)  # the free end floats with the contact
    assert_allclose(at[1, 3.0], second / total, rtol=1e-12)


def test_temperature_of_two_fibrils_that_share_heat() -> None:
    """A heated fibril with a cold one across its middle: T' balances by hand at the contact.

    At its middle the heated fibril has T0 = 1.25 K on its own and conducts 4 k A / L to its ends, and so does
    the cold one; h couples them: q = T0 / (1/h + 2 L / (4 k A)).
    """
    h = 0.02
    state = touching(fibrils([8.0, 8.0]), [0], [4.0], [1], [4.0], conductance=0.0, heat_conductance=h)
    found = solve_fields(state, TERMINALS, THROUGH)
    ends = 4 * AREA / 8.0
    q = 1.25 / (1 / h + 2 / ends)
    at = {(int(f), float(x)): t for f, x, t in zip(found.fibril, found.xi, found.temperature, strict=True)}
    assert_allclose(at[1, 4.0], q / ends, rtol=1e-12)
    assert_allclose(at[0, 4.0], 1.25 - q / ends, rtol=1e-12)
    assert_allclose(found.heat_out, found.heat, rtol=1e-12)


def test_contact_heat_half_to_each_side_or_none() -> None:
    """A contact far hotter than the fibrils: each side takes half of it, V I = the fibrils' heat without it."""
    state = touching(fibrils([8.0, 8.0]), [0], [4.0], [1], [4.0], conductance=1e-6)
    on = solve_fields(state, TERMINALS, ACROSS)
    off = solve_fields(state, TERMINALS, ACROSS, contact_heat=False)
    current = 1 / (1e6 + 2 * 4.0 / (10 * AREA))
    assert_allclose(on.heat, current, rtol=1e-10)
    assert_allclose(off.heat, current**2 * 2 * 4.0 / (10 * AREA), rtol=1e-8)
    middle = on.xi == 4.0
    rise = on.temperature[middle] - off.temperature[middle]
    assert_allclose(rise, 0.5 * current**2 * 1e6 / (4 * AREA / 8.0), rtol=1e-10)
    assert_allclose(off.heat_out, off.heat, rtol=1e-10)


def test_conduction_that_varies_along_the_axis() -> None:
    """Elements in series: R = sum h / (sigma A f); the peak is where the potential is half."""
    factor = np.array([1.0, 0.5, 2.0, 0.8])
    state = touching(fibrils([8.0]), axial_factor=factor)
    exact = 1 / np.sum(2.0 / (10 * AREA * factor))
    for mesh in ("feet", "mechanical"):
        found = solve_fields(state, TERMINALS[:2], THROUGH, mesh=mesh)
        assert_allclose(found.currents[0], exact, rtol=1e-12)
        assert_allclose(found.segment_current, exact, rtol=1e-12)
        assert_allclose([found.heat, found.heat_out], exact, rtol=1e-12)


# convergence


def test_rails_converge_with_the_contact_points() -> None:
    """Equally spaced contact points are a midpoint rule: the error falls fourfold when they double."""
    r, g, L = 0.5, 0.02, 8.0
    exact = rails_resistance(r, g, L)
    error = np.array(
        [1 / solve_fields(rails(r, g, L, n), TERMINALS, ACROSS).currents[0] - exact for n in (8, 16, 32, 64)]
    )
    assert abs(error[-1]) < 1e-4 * exact
    assert_allclose(np.log2(error[:-1] / error[1:]), 2.0, atol=0.1)


def test_mechanical_mesh_converges_to_the_circuit_at_second_order() -> None:
    """Between the contact points the true potential is linear; elements that straddle them smear it."""
    r, g, L = 0.5, 0.02, 8.0
    exact = solve_fields(rails(r, g, L, 512), TERMINALS, ACROSS).currents[0]
    error = np.array(
        [
            solve_fields(rails(r, g, L, 512, elements=n), TERMINALS, ACROSS, mesh="mechanical").currents[0] - exact
            for n in (4, 8, 16, 32)
        ]
    )
    assert np.all(error > 0)  # fewer degrees of freedom, more dissipated power at 1 V (Thomson)
    assert_allclose(np.log2(error[:-1] / error[1:]), 2.0, atol=0.1)


# balances and symmetries


def balanced(found: Fields) -> bool:
    return (
        abs(found.currents.sum()) <= 1e-10 * abs(found.currents[0])
        and abs(found.heat - found.voltage * found.currents[0]) <= 1e-10 * found.heat
        and abs(found.heat_out - found.heat) <= 1e-10 * found.heat
    )


@pytest.mark.parametrize("mesh", ["feet", "mechanical"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_heat_is_voltage_times_current(mesh: str, seed: int) -> None:
    for found in solve_probes(woven(seed=seed), PAPER_TERMINALS, PAPER_PROBES, mesh=mesh):
        assert found.currents[0] > 0
        assert balanced(found)


def test_feet_next_to_one_another_cost_no_digits() -> None:
    """Feet 1e-7 mm apart put conductances 1e11 times the contacts' into the matrix."""
    state = woven(per_yarn=2, points=4, seed=5)
    near = replace(state, xi_a=np.round(np.minimum(state.xi_a, 7.9), 1) + 1e-7 * np.arange(state.n_contacts))
    for found in solve_probes(near, PAPER_TERMINALS, PAPER_PROBES):
        assert balanced(found)


@pytest.mark.parametrize("mesh", ["feet", "mechanical"])
@pytest.mark.parametrize("weaker", [1e-3, 1e-9, 1e-14])
def test_a_fibril_that_floats_on_weak_contacts(weaker: float, mesh: Mesh) -> None:
    """Two fibrils joined by a third that nothing else holds: three resistances in series, and the third at half.

    The contacts are up to 1e14 times weaker than a segment between their feet, so that a matrix which adds the two
    keeps nothing of the contacts: found by drawing designs at random, where potentials of 1e4 V for 1 V came out.
    """
    gap = 1e-6
    contact = 1e-2 * weaker
    feet = np.array([4.0 - 3 * gap, 4.0 - gap, 4.0 + gap, 4.0 + 3 * gap])
    state = touching(fibrils([8.0] * 3), [0, 0, 1, 1], [4.0] * 4, [2] * 4, feet, conductance=np.full(4, contact))
    found = solve_fields(state, TERMINALS, ACROSS, mesh=mesh)
    fibril = 8.0 / (10.0 * AREA)
    total = fibril + 2 / (2 * contact)
    assert_allclose(found.currents[0] * total, 1.0, rtol=FLOATING)
    assert_allclose(found.potential[found.fibril == 2], 0.5, rtol=FLOATING)


def test_equals_dense_kirchhoff() -> None:
    rng = np.random.default_rng(7)
    xi = rng.uniform(0, 8, (2, 12))
    mesh = fibrils([8.0, 8.0], sigma=[10.0, 2.0])
    state = touching(mesh, np.tile([0, 1], 6), xi[0], np.tile([1, 0], 6), xi[1], conductance=rng.uniform(0.001, 1, 12))
    for probe in (THROUGH, ACROSS, OVER):
        assert_allclose(solve_fields(state, TERMINALS, probe).currents[0], kirchhoff(state, probe), rtol=1e-11)


def test_swapping_the_sides_of_contacts_changes_nothing() -> None:
    state = woven(per_yarn=2, points=4)
    for a, b in zip(
        solve_probes(state, PAPER_TERMINALS, PAPER_PROBES),
        solve_probes(swapped(state), PAPER_TERMINALS, PAPER_PROBES),
        strict=True,
    ):
        assert_allclose(a.currents, b.currents, rtol=1e-12)
        assert_allclose(a.temperature, b.temperature, rtol=1e-11, atol=1e-16)


def test_turning_every_fibril_round_changes_nothing() -> None:
    state = woven(per_yarn=2, points=4)
    length = state.mesh.length
    turned = replace(state, xi_a=length[state.fibril_a] - state.xi_a, xi_b=length[state.fibril_b] - state.xi_b)
    terminals = [Terminal(t.name, tuple((yarn, -side) for yarn, side in t.ends)) for t in PAPER_TERMINALS]
    for a, b in zip(
        solve_probes(state, PAPER_TERMINALS, PAPER_PROBES), solve_probes(turned, terminals, PAPER_PROBES), strict=True
    ):
        assert_allclose(a.currents, b.currents, rtol=1e-12)
        assert_allclose(a.peak_temperature, b.peak_temperature, rtol=1e-11)


def test_several_probes_at_once_are_the_same_as_one_by_one() -> None:
    state = woven(per_yarn=2, points=4)
    together = solve_probes(state, PAPER_TERMINALS, PAPER_PROBES)
    for probe, found in zip(PAPER_PROBES, together, strict=True):
        alone = solve_fields(state, PAPER_TERMINALS, probe)
        assert_allclose(alone.potential, found.potential, rtol=1e-13, atol=1e-15)
        assert_allclose(alone.temperature, found.temperature, rtol=1e-12, atol=1e-16)


@pytest.mark.parametrize("mesh", ["feet", "mechanical"])
def test_potentials_without_temperatures_are_the_same(mesh: Mesh) -> None:
    state = woven(per_yarn=2, points=4)
    whole = solve_probes(state, PAPER_TERMINALS, PAPER_PROBES, mesh=mesh)
    found = solve_potentials(state, PAPER_TERMINALS, PAPER_PROBES, mesh=mesh)
    assert solve_potentials(state, PAPER_TERMINALS, [], mesh=mesh) == ()
    for one, other in zip(whole, found, strict=True):
        assert (one.voltage, one.terminals) == (other.voltage, other.terminals)
        for name in ("currents", "fibril", "xi", "potential"):
            assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("element", [ElementLineP1(), ElementLineP2()])
def test_what_leaves_element_by_element_is_what_the_stiffness_says(element: Element) -> None:
    state = woven(per_yarn=2, points=4)
    line = fibril_line(state, refine=False)
    axes = MeshLine(line.xi[None, :], line.segments.T, sort_t=False, validate=False)
    system = build_system(Basis(axes, element), line, line.conduction, state.conductance)
    x = np.random.default_rng(1).normal(size=system.stiffness.shape[0])
    expected = system.stiffness @ x
    assert_allclose(outflow(system, x), expected, atol=1e-12 * np.abs(expected).max())


def test_linear_in_the_voltage_and_quadratic_in_temperature() -> None:
    state = rails(0.5, 0.02, 8.0, 16)
    one, three = (solve_fields(state, TERMINALS, replace(ACROSS, voltage=v)) for v in (1.0, -3.0))
    assert_allclose(three.currents, -3 * one.currents, rtol=1e-12)
    assert_allclose(three.peak_temperature, 9 * one.peak_temperature, rtol=1e-12)


def test_adding_a_contact_never_lowers_a_current() -> None:
    """Rayleigh's monotonicity law."""
    state = woven(per_yarn=2, points=4)
    more = replace(state, conductance=state.conductance * np.where(np.arange(state.n_contacts) == 3, 2.0, 1.0))
    for probe in PAPER_PROBES:
        before, after = (solve_fields(s, PAPER_TERMINALS, probe).currents[0] for s in (state, more))
        assert after >= before * (1 - 1e-12)


def test_nodes_of_the_mechanical_mesh_are_those_of_the_mechanics() -> None:
    mesh = fibrils([8.0, 6.0], elements=3, order=2)
    found = solve_fields(touching(mesh, [0], [1.0], [1], [2.0]), TERMINALS, THROUGH, mesh="mechanical")
    assert_array_equal(found.xi, mesh.xi)
    assert_array_equal(found.fibril, mesh.node_fibril)


# islands and insulators


def test_islands_are_reported_and_left_out() -> None:
    """Fibrils 2 and 3 touch each other only; fibril 4 touches nothing; fibril 5 insulates."""
    mesh = fibrils(np.full(6, 8.0), sigma=[10.0, 10.0, 10.0, 10.0, 10.0, 0.0])
    state = touching(mesh, [0, 2, 0], [4.0, 4.0, 5.0], [1, 3, 5], [4.0, 4.0, 5.0], heat_conductance=0.01)
    found = solve_fields(state, TERMINALS, THROUGH)
    assert_array_equal(found.unreached, [2, 3, 4])
    assert_array_equal(np.isnan(found.potential), found.fibril >= 2)
    assert np.all(np.isfinite(found.temperature))
    assert found.temperature[(found.fibril == 5) & (found.xi == 5.0)].item() > 0  # an insulator is warmed all the same
    assert_array_equal(found.segment_current[found.fibril[found.segments[:, 0]] >= 2], 0.0)
    assert_allclose(found.currents[0], 10 * AREA / 8, rtol=1e-12)


def test_terminals_that_are_not_connected_carry_nothing() -> None:
    found = solve_fields(touching(fibrils([8.0, 8.0])), TERMINALS, ACROSS)
    assert_array_equal(found.currents, 0.0)
    assert found.heat == found.heat_out == found.peak_temperature == 0.0
    assert_allclose(found.potential, np.where(found.fibril == 0, 1.0, 0.0), atol=0)
    assert found.unreached.size == 0


def test_wholly_insulating_source() -> None:
    found = solve_fields(touching(fibrils([8.0, 8.0], sigma=[0.0, 1.0])), TERMINALS, ACROSS)
    assert_array_equal(found.currents, 0.0)
    assert_array_equal(np.isnan(found.potential), found.fibril == 0)


# bad input


def test_unknown_names_are_refused() -> None:
    state = touching(fibrils([8.0, 8.0]))
    with pytest.raises(DesignError, match=r"terminal: 'lef' .* left, other-left, other-right, right"):
        solve_fields(state, TERMINALS, Probe("p", "lef", "right", 1.0))
    with pytest.raises(DesignError, match=r"terminal left: \('weft9', 1\)"):
        solve_fields(state, [Terminal("left", (("weft9", 1),)), RIGHT], THROUGH)
    with pytest.raises(DesignError, match="mesh: 'foot'"):
        solve_fields(state, TERMINALS, THROUGH, mesh="foot")  # type: ignore[arg-type]


def test_terminals_that_share_an_end_are_refused() -> None:
    both = Terminal("both", (("warp1", -1), ("warp1", 1)))
    with pytest.raises(DesignError, match="both hold an end of fibril 0"):
        solve_fields(touching(fibrils([8.0])), [LEFT, both], Probe("p", "left", "both", 1.0))


@pytest.mark.parametrize("xi", [-0.1, 8.1, np.nan])
def test_feet_beside_their_fibril_are_refused(xi: float) -> None:
    with pytest.raises(DesignError, match=r"xi_b\[0\]"):
        solve_fields(touching(fibrils([8.0, 8.0]), [0], [1.0], [1], [xi]), TERMINALS, ACROSS)
