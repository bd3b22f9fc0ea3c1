"""Ry and Rc from probe currents: recovered, weighted, with their uncertainty and what is not determined."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from electrical_cases import woven_grid_current
from electrical_reference import FOUR_DIGITS, INSULATED_SEGMENT_OHM, INSULATED_YARN_CURRENT, WOVEN_CURRENTS, WOVEN_RY
from hypothesis import given, settings
from hypothesis import strategies as st

from circuittex.base.errors import CircuitError
from circuittex.design import Probe, Terminal, plain_weave
from circuittex.electrical.network.one_pair import network_conductances
from circuittex.fit import fit_network

DESIGN = plain_weave()
ENDS = (
    (("warp2", -1), ("warp2", 1)),
    (("warp3", -1), ("warp2", 1)),
    (("weft2", 1), ("warp2", 1)),
)
RECOVERED = 1e-8


def grid_currents(Ry, Rc):
    return np.array([woven_grid_current(4, 4, Ry, Rc, *ends) for ends in ENDS])


@settings(max_examples=25)
@given(st.floats(-3.0, 3.0), st.floats(0.0, 6.0))
def test_values_are_recovered_from_synthetic_grids(log_ry, log_ratio):
    Ry, Rc = 10.0**log_ry, 10.0 ** (log_ry + log_ratio)
    fit = fit_network(grid_currents(Ry, Rc), DESIGN)
    assert fit.Ry == pytest.approx(Ry, rel=RECOVERED)
    assert fit.Rc == pytest.approx(Rc, rel=RECOVERED)
    assert fit.residual < RECOVERED


@pytest.mark.parametrize("Rc", [0.3, 3.0, 30.0, 300.0])
def test_absolute_weighting_recovers_values_as_well(Rc):
    fit = fit_network(grid_currents(0.2829, Rc), DESIGN, weighting="absolute")
    assert (fit.Ry, fit.Rc) == (pytest.approx(0.2829, rel=RECOVERED), pytest.approx(Rc, rel=RECOVERED))


@pytest.mark.parametrize("Rc", [1.0, 100.0, 1e5])
def test_nothing_is_said_where_the_probes_determine_both_values(Rc):
    assert fit_network(grid_currents(0.2829, Rc), DESIGN).warnings == ()


@pytest.mark.parametrize("Rc", WOVEN_CURRENTS)
def test_published_currents_give_the_published_network(Rc):
    fit = fit_network(WOVEN_CURRENTS[Rc], DESIGN)
    # Three decimals of 0.171 A are 0.3 %; so well are the two values known.
    assert fit.Ry == pytest.approx(WOVEN_RY, rel=5e-3)
    assert fit.Rc == pytest.approx(Rc, rel=2e-2)


@pytest.mark.parametrize("weighting", ["relative", "absolute"])
def test_insulated_yarns_leave_rc_undetermined(weighting):
    fit = fit_network([INSULATED_YARN_CURRENT, 0.0, 0.0], DESIGN, weighting=weighting)
    assert fit.Ry == pytest.approx(INSULATED_SEGMENT_OHM, abs=FOUR_DIGITS)
    assert fit.Rc == np.inf
    assert fit.covariance[1, 1] == np.inf
    assert fit.covariance[0, 0] == pytest.approx(0.0, abs=1e-20)
    assert "Rc is not determined" in fit.warnings[0]
    np.testing.assert_allclose(fit.currents, [INSULATED_YARN_CURRENT, 0.0, 0.0], rtol=1e-12)


def test_a_probe_across_yarns_without_current_beside_one_with_current_does_not_fit():
    fit = fit_network([0.9, 0.0, 0.1], DESIGN)
    assert fit.residual > 0.05
    assert np.isfinite([fit.Ry, fit.Rc]).all()


def test_currents_that_no_crossing_resistance_explains_are_reported():
    # Across yarns more than along one: Rc goes to the edge of the search.
    fit = fit_network([1.0, 5.0, 5.0], DESIGN)
    assert any("at the edge of the search" in warning for warning in fit.warnings)
    assert np.isnan([fit.Ry, fit.Rc]).all(), "Ry goes astray with it"


def test_contacts_that_hardly_conduct_keep_the_resistance_of_the_yarns():
    """Found in review: with Rc beyond the range of the search, Ry was six times too large and printed as known."""
    Ry, Rc = 0.28, 1e12
    fit = fit_network(network_conductances(DESIGN, Ry, Rc).sum(axis=1), DESIGN)
    assert fit.Ry == pytest.approx(Ry, rel=1e-9)
    assert fit.Rc == pytest.approx(Rc, rel=1e-6)


def test_without_a_probe_across_yarns_nothing_is_said_of_crossings():
    along = replace(DESIGN, probes=DESIGN.probes[:1])
    fit = fit_network([0.8836], along)
    assert fit.Ry == pytest.approx(0.2829, abs=1e-4)
    assert np.isnan(fit.Rc)
    assert not fit.known
    assert fit.warnings == ("Rc is not determined: there is no probe between different yarns",)


def test_derivatives_are_those_of_differences():
    Ry, Rc, h = 0.28, 3.0, 1e-5
    exact = -network_conductances(DESIGN, Ry, Rc) / [Ry, Rc]
    by_ry = (grid_currents(Ry + h, Rc) - grid_currents(Ry - h, Rc)) / (2 * h)
    by_rc = (grid_currents(Ry, Rc + h) - grid_currents(Ry, Rc - h)) / (2 * h)
    differences = np.stack([by_ry, by_rc], axis=1)
    np.testing.assert_allclose(exact, differences, rtol=1e-7)  # h² and 1e-16 / h both lie below


def test_conductances_that_are_remembered_cannot_be_changed():
    found = network_conductances(DESIGN, 0.28, 3.0)
    with pytest.raises(ValueError, match="read-only"):
        found[0] = 0.0


def test_covariance_is_that_of_the_scatter():
    # Relative noise of known size on the currents: the spread of the fits must be what the covariance says.
    rng = np.random.default_rng(3)
    clean, noise = grid_currents(0.2829, 20.0), 1e-3
    fits = [fit_network(clean * (1 + noise * rng.standard_normal(3)), DESIGN) for _ in range(40)]
    scatter = np.cov(np.log([[fit.Ry, fit.Rc] for fit in fits]).T)
    values = np.array([0.2829, 20.0])
    claimed = np.mean([fit.covariance for fit in fits], axis=0) / np.outer(values, values)
    # The mean of 40 variances of one degree of freedom each is good to 22 %: a factor of two is three times that.
    np.testing.assert_array_less(np.abs(np.log(np.diag(claimed) / np.diag(scatter))), np.log(2.0))
    assert np.all(np.linalg.eigvalsh(fits[0].covariance) >= 0.0)


def test_relative_misfits_let_the_weak_probes_speak():
    # Currents that no network has: absolute follows the strong probe, relative shares the misfit out.
    currents = grid_currents(0.2829, 200.0) * [1.0, 0.8, 1.2]
    absolute, relative = (fit_network(currents, DESIGN, weighting=w) for w in ("absolute", "relative"))
    assert np.linalg.norm(absolute.currents - currents) < np.linalg.norm(relative.currents - currents)
    assert np.linalg.norm(relative.currents / currents - 1) < np.linalg.norm(absolute.currents / currents - 1)
    assert relative.residual == pytest.approx(np.linalg.norm(relative.currents / currents - 1))
    assert absolute.residual == pytest.approx(np.linalg.norm(absolute.currents - currents))


def test_absolute_misfits_hardly_determine_a_large_rc_and_say_so():
    currents = grid_currents(0.2829, 1e4)
    assert any(
        w.startswith("Rc is not determined") for w in fit_network(currents, DESIGN, weighting="absolute").warnings
    )
    assert fit_network(currents, DESIGN).warnings == ()


def test_a_short_circuited_weave_hardly_determines_rc():
    fit = fit_network(grid_currents(1.0, 1e-5), DESIGN)
    assert any(warning.startswith("Rc is not determined") for warning in fit.warnings)


def test_one_probe_determines_one_combination():
    design = replace(DESIGN, probes=DESIGN.probes[1:2])
    fit = fit_network([0.2], design)
    assert fit.currents == pytest.approx([0.2])
    assert "only one combination" in fit.warnings[0]
    assert np.isinf(np.diag(fit.covariance)).all()


def test_two_probes_give_values_without_covariance():
    fit = fit_network(grid_currents(0.3, 5.0)[:2], replace(DESIGN, probes=DESIGN.probes[:2]))
    assert (fit.Ry, fit.Rc) == (pytest.approx(0.3, rel=RECOVERED), pytest.approx(5.0, rel=RECOVERED))
    assert "covariance is unknown" in fit.warnings[0]
    assert np.isinf(np.diag(fit.covariance)).all()


def test_probes_of_other_voltages_and_terminals_of_several_ends():
    joined = (Terminal("left", (("warp1", -1), ("warp4", -1))), Terminal("right", (("warp1", 1), ("weft1", -1))))
    probes = (
        Probe("one", "left", "right", -2.0),
        *(replace(probe, voltage=5.0) for probe in DESIGN.probes),
    )
    design = replace(DESIGN, terminals=(*DESIGN.terminals, *joined), probes=probes)
    currents = network_conductances(design, 0.4, 2.0).sum(axis=1) * [-2.0, 5.0, 5.0, 5.0]
    np.testing.assert_allclose(currents[1:], 5.0 * grid_currents(0.4, 2.0), rtol=1e-12)
    fit = fit_network(currents, design)
    assert (fit.Ry, fit.Rc) == (pytest.approx(0.4, rel=RECOVERED), pytest.approx(2.0, rel=RECOVERED))
    np.testing.assert_allclose(fit.currents, currents, rtol=RECOVERED)


@pytest.mark.parametrize(
    ("currents", "message"),
    [
        ([1.0, 0.5], "one finite number for each of 3 probes"),
        ([1.0, -0.1, 0.1], "no current may flow against its voltage"),
    ],
)
def test_currents_that_cannot_be_used(currents, message):
    with pytest.raises(CircuitError, match=message):
        fit_network(currents, DESIGN)


def test_without_probes_nothing_is_determined():
    fit = fit_network([], replace(DESIGN, probes=()))
    assert np.isnan([fit.Ry, fit.Rc, fit.residual]).all()
    assert fit.currents.shape == (0,)
    assert fit.warnings == ("there are no probes: Ry and Rc are not determined",)


def test_a_yarn_that_carries_nothing_but_rounding_does_not_conduct():
    fit = fit_network([-3e-21, 0.0, 0.0], DESIGN)
    assert (fit.Ry, fit.residual) == (np.inf, 0.0)
    assert np.isnan(fit.Rc)
    assert "the yarns do not conduct" in fit.warnings[0]


def test_probes_across_insulated_yarns_tell_that_crossings_do_not_conduct():
    fit = fit_network([1e-22, -3e-21], replace(DESIGN, probes=DESIGN.probes[1:]))
    assert np.isnan(fit.Ry)
    assert fit.Rc == np.inf
    assert "Ry is not determined" in fit.warnings[0]


def test_what_is_nothing_is_told_from_the_yarns_and_not_from_the_largest_current():
    """A picoampere across yarns is a current if that is all there is, and rounding if it is 1e-17 A."""
    design = replace(DESIGN, probes=DESIGN.probes[1:])
    assert fit_network([2e-12, 1e-12], design).Rc != np.inf  # too little to tell its value from Ry
    assert fit_network([2e-17, 1e-17], design).Rc == np.inf


@settings(max_examples=60, deadline=None)
@given(st.lists(st.sampled_from([-3e-21, 0.0, 1e-15, 1e-11, 1e-6, 1e-3, 0.8, 1.0, 50.0]), min_size=3, max_size=3))
def test_no_currents_that_can_flow_stop_the_fit(currents):
    fit = fit_network(currents, DESIGN)
    assert fit.currents.shape == (3,)
    assert np.isfinite([fit.Ry, fit.Rc]).all() or fit.warnings


def test_unknown_weighting():
    with pytest.raises(CircuitError, match="it must be 'relative' or 'absolute'"):
        fit_network([1.0, 0.1, 0.1], DESIGN, weighting="robust")
