"""The port matrix, and reduced networks matched to it: against single solutions, closed forms and known networks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from electrical_cases import network
from hypothesis import given, settings
from hypothesis import strategies as st

from circuittex.base.arrays import Floats
from circuittex.design import Design, Material, Yarn, plain_weave
from circuittex.electrical.network.circuit import Circuit, reduced_circuit
from circuittex.electrical.network.matching import groups, match_pairs, match_probes
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.network.ports import PortMatrix, port_matrix, resistances
from circuittex.fit import fit_network

EXACT = 1e-10
"""Relative: nodal solutions keep twelve digits, and a resistance between ports is a difference of a few of them."""
MATCHED = 1e-8
"""Relative: a search in logarithms that ends at steps of 1e-14, times the condition of the values."""
seeds = st.integers(0, 2**32 - 1)


def woven(seed: int, shape: tuple[int, int] = (2, 3)) -> tuple[Circuit, Floats, Floats]:
    """A reduced network with a resistance of its own for each yarn and crossing."""
    rng = np.random.default_rng(seed)
    Ry, Rc = np.exp(rng.normal(0.0, 1.0, sum(shape))), np.exp(rng.normal(2.0, 1.0, shape))
    return reduced_circuit(shape, Ry, Rc), Ry, Rc


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_every_pair_against_a_solution_of_its_own(seed: int) -> None:
    circuit, _, _ = woven(seed)
    matrix = port_matrix(circuit)
    between = resistances(matrix)
    for i in range(len(matrix.ports)):
        for j in range(i):
            drive = {matrix.ports[i]: 1.0, matrix.ports[j]: 0.0}
            current = solve_nodal(circuit, drive).port_current[i]
            assert between[i, j] == pytest.approx(1.0 / current, rel=EXACT)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_symmetric_and_passive(seed: int) -> None:
    G = port_matrix(woven(seed)[0]).conductance
    assert np.array_equal(G, G.T)
    assert np.all(G[~np.eye(len(G), dtype=bool)] <= 0.0)
    assert np.abs(G.sum(axis=1)).max() <= 1e-15 * np.abs(G).max() * len(G)


@settings(max_examples=20, deadline=None)
@given(seeds, st.integers(0, 5))
def test_another_conductor_never_raises_a_resistance(seed: int, crossing: int) -> None:
    """Rayleigh: a crossing of half the resistance."""
    circuit, Ry, Rc = woven(seed)
    better = Rc.copy()
    better.flat[crossing] /= 2
    less = resistances(port_matrix(reduced_circuit((2, 3), Ry, better)))
    assert np.all(less <= resistances(port_matrix(circuit)) * (1 + EXACT))


def test_small_beside_large_keeps_its_digits() -> None:
    """Two yarns of 1 ohm joined over 1e9 ohm: 1e9 + 1/2 + 1/2 between their ends, and 1 along each."""
    between = resistances(port_matrix(reduced_circuit((1, 1), 1.0, 1e9)))
    assert between[0, 1] == pytest.approx(1.0, rel=EXACT)
    assert between[0, 2] == pytest.approx(1e9 + 1.0, rel=EXACT)


def test_what_nothing_joins_is_infinitely_far() -> None:
    matrix = port_matrix(network([(0, 1, 2.0), (2, 3, 5.0)], [0, 1, 2, 3]))
    assert resistances(matrix)[0].tolist() == pytest.approx([0.0, 2.0, np.inf, np.inf])
    assert port_matrix(network([(0, 1, 2.0)], [0, 1]), ()).ports == ()


def mixed(yarns: int = 3) -> Design:
    """A weave of two kinds of warp and an insulating weft yarn."""
    design = plain_weave(yarns=yarns, rows=(1,))
    good, poor, none = (Material(n, 10.0, 0.0, 1.0, s, 1.0) for n, s in (("good", 10.0), ("poor", 0.5), ("none", 0.0)))
    kinds = {each.name: Yarn(each.name, (1,), 0.15, 0.3, 0.3, (each,)) for each in (good, poor, none)}
    weave = replace(
        design.weave,
        warp=(kinds["good"], kinds["poor"], kinds["good"]),
        weft=(kinds["good"], kinds["none"], kinds["poor"]),
    )
    return replace(design, weave=weave, probes=(), terminals=())


def test_kinds_directions_and_crossings_are_recovered_from_a_network() -> None:
    design = mixed()
    grouping = groups(design, each_crossing=True)
    assert grouping.yarns == ("good warp", "poor warp", "good weft", "poor weft")
    assert grouping.crossing_group[:, 1].tolist() == [-1, -1, -1]
    Ry = np.array([1.0, 20.0, 1.0, 1.1, np.inf, 25.0])
    Rc = np.exp(np.random.default_rng(0).normal(4.0, 1.0, (3, 3)))
    Rc[:, 1] = np.inf
    exact = port_matrix(reduced_circuit((3, 3), Ry, Rc))
    ends = [port for port in exact.ports if not port.startswith("weft2")]
    match = match_pairs(design, grouping, port_matrix(reduced_circuit((3, 3), Ry, Rc), ends))
    assert match.reasons == ()
    assert match.values[:4] == pytest.approx([1.0, 20.0, 1.1, 25.0], rel=MATCHED)
    assert match.values[4:] == pytest.approx(Rc[np.isfinite(Rc)], rel=MATCHED)
    fit = fit_network([], replace(design, electrical=replace(design.electrical, fit="all-pairs")), exact)
    assert fit.kind_resistance == pytest.approx([1.0, 20.0, 1.1, 25.0], rel=MATCHED)
    assert np.isnan(fit.Ry), "no one number stands for several kinds"
    assert fit.pair_errors[0] < MATCHED
    assert np.allclose(resistances(port_matrix(fit.circuit(), ends)), resistances(port_matrix(woven_of(Ry, Rc), ends)))


def woven_of(Ry: Floats, Rc: Floats) -> Circuit:
    return reduced_circuit((3, 3), Ry, Rc)


def test_derivatives_are_those_of_differences() -> None:
    """The search ends where the exact derivatives say: a wrong one would leave it short of the values."""
    design = plain_weave(yarns=2, rows=(1,))
    Rc = np.array([[3.0, 50.0], [700.0, 9.0]])
    match = match_pairs(design, groups(design, each_crossing=True), port_matrix(reduced_circuit((2, 2), 0.28, Rc)))
    assert match.values[-4:] == pytest.approx(Rc.ravel(), rel=MATCHED)


@pytest.mark.parametrize(("ratio", "lost"), [(1e7, ()), (1.0, ()), (1e-6, ("Rc",))])
def test_what_the_pairs_do_not_tell_is_said(ratio: float, lost: tuple[str, ...]) -> None:
    design = plain_weave(yarns=4)
    match = match_pairs(
        design, groups(design, each_crossing=True), port_matrix(reduced_circuit((4, 4), 0.28, 0.28 * ratio))
    )
    assert np.isnan(match.values).any() == bool(lost)
    assert all(any(reason.startswith(word) for word in lost) for reason in match.reasons)
    assert match.values[:2] == pytest.approx([0.28, 0.28], rel=1e-6)


def test_a_probe_that_carries_nothing_says_nothing_of_others() -> None:
    """One current cannot tell two resistances, and a zero along an insulator is no current."""
    design = plain_weave(yarns=2, rows=(1,))
    grouping = groups(design, each_crossing=False)
    match = match_probes(design, grouping, np.array([0.0, 1e-4, 0.0]))
    assert np.isnan(match.values).all()
    assert len(match.reasons) == 2


def test_no_data_is_no_value() -> None:
    design = plain_weave(yarns=2, rows=(1,))
    match = match_pairs(design, groups(design, each_crossing=True), PortMatrix())
    assert np.isnan(match.values).all()
    assert "say nothing" in match.reasons[0]


@pytest.mark.parametrize("times", [1.0, 0.8, 0.95, 1.25])
def test_yarns_that_touch_nowhere_are_known_and_their_crossings_not(times: float) -> None:
    """Found by drawing designs at random: where the search began at the answer, it ended in 0 / 0. Where yarns resist
    less than it expects, as those that are shorter than their span or cold, crossings that do not conduct had a
    resistance of some tenths of theirs, with which the pairs along the yarns are right, too."""
    design = plain_weave(yarns=2, rows=(1,))
    grouping = groups(design, each_crossing=True)
    alone = times * grouping.start[:2]
    match = match_pairs(design, grouping, port_matrix(reduced_circuit((2, 2), np.repeat(alone, 2), np.inf)))
    assert match.values[:2] == pytest.approx(alone, rel=MATCHED)
    assert np.isnan(match.values[2:]).all()
    assert np.isposinf(match.found[2:]).all()
    assert len(match.reasons) == 4


def test_yarns_apart_from_the_others_have_crossings_without_a_resistance() -> None:
    """Warp 1 touches weft 1 alone, warp 2 weft 2 alone, and of two rings neither knows of the other."""
    design = plain_weave(yarns=2, rows=(1,))
    Rc = np.array([[30.0, np.inf], [np.inf, 40.0]])
    match = match_pairs(design, groups(design, each_crossing=True), port_matrix(reduced_circuit((2, 2), 0.2, Rc)))
    assert match.found == pytest.approx([0.2, 0.2, *Rc.ravel()], rel=MATCHED)
    assert match.lost.tolist() == [False, False, False, True, True, False]
