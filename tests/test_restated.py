"""A design in units of its fibrils' own: the same fabric, and what is said of it is in N and mm all the same."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fabrics import resized
from hypothesis import given, settings
from hypothesis import strategies as st

from circuittex.base.errors import ConvergenceError, PenetrationError
from circuittex.base.frozen import same
from circuittex.design import ContactLaw, Design, load_design, plain_weave
from circuittex.design.packing import Packing
from circuittex.design.restated import restated
from circuittex.geometry.weave import build_mesh
from circuittex.relaxation.relax import relax
from circuittex.relaxation.units import own_units

CELL = load_design(Path(__file__).parent / "cases" / "cell.toml")
PRINTED = 6e-3
"""Half a unit of the last of the three digits that messages have."""


def written(design: Design, s: float, m: float) -> Design:
    """The design with lengths times s and moduli times m, each product as it is rounded."""
    law = design.contact
    return replace(
        design,
        weave=resized(design.weave, s, lambda each: replace(each, youngs_modulus=m * each.youngs_modulus)),
        contact=law if isinstance(law.penalty, str) else replace(law, penalty=m * law.penalty),
    )


@settings(max_examples=50, deadline=None)
@given(s=st.floats(1e-3, 1e3), m=st.floats(1e-3, 1e5))
def test_a_design_at_any_scale_is_the_same_in_units_of_its_own(s: float, m: float) -> None:
    """To the last bit, which is what makes it take the same steps."""
    design = plain_weave(yarns=2, rows=(1, 2))
    design = replace(design, numerics=replace(design.numerics, elements=10, contact_points=4))
    there = written(design, s, m)
    units = own_units(build_mesh(there), there)
    assert same(restated(there, units.length, units.modulus), design)


@pytest.mark.parametrize("radius", [0.0313, 0.0339])
def test_what_is_allowed_to_the_last_digit_is_so_in_any_units(radius: float) -> None:
    """Each at its limit, where the last of a dozen digits of a quotient may round it beyond: two of five radii did."""
    cell = written(plain_weave(yarns=2, rows=(1,)), radius / 0.15, 1.0)
    pitch = round(13.3 * radius, 4)
    design = replace(cell, weave=replace(cell.weave, pitch=pitch))
    elements = design.numerics.elements
    assert isinstance(elements, int)
    numerics = replace(design.numerics, merge_length=2.0 * pitch, snap_length=2.0 * pitch / elements / 10)
    there = replace(design, packing=Packing(phase=pitch / 4.0), numerics=numerics)
    units = own_units(build_mesh(design), design)
    phase = restated(there, units.length, units.modulus).packing.phase
    assert phase == pytest.approx(pitch / 4.0 / units.length, rel=1e-11)


def test_stiff_fibrils_with_soft_contacts_have_units_of_their_own() -> None:
    """Of 400 GPa, as carbon, by a penalty of 0.001 N/mm2: no material is of 2e9 MPa, a number in other units may be."""
    cell = written(plain_weave(yarns=2, rows=(1,)), 1.0, 4e4)
    design = replace(cell, contact=ContactLaw(0.001, 0.01, 0.1))
    units = own_units(build_mesh(design), design)
    there = restated(design, units.length, units.modulus).weave.warp[0].materials[0]
    assert there.youngs_modulus == pytest.approx(2e9, rel=1e-11)


def test_forces_go_with_the_modulus_and_the_square_of_lengths() -> None:
    design = replace(CELL, numerics=replace(CELL.numerics, tolerance="1e-06 N"))
    there = restated(design, 0.1, 1000.0)
    assert there.numerics.force_tolerance == pytest.approx(1e-7, rel=1e-11)
    assert there.weave.warp[0].materials[0].youngs_modulus == pytest.approx(0.01, rel=1e-11)
    assert there.weave.warp[0].materials[0].electrical_conductivity == 10.0


def test_errors_and_progress_are_told_in_newtons() -> None:
    s, m = 0.01, 300.0
    told: dict[float, list[float]] = {1.0: [], s: []}
    errors = []
    for at, design in ((1.0, CELL), (s, written(CELL, s, m))):
        short = replace(design, numerics=replace(design.numerics, max_iterations=4))
        with pytest.raises(ConvergenceError, match=r"a free force of .* N is left") as caught:
            relax(build_mesh(short), short, report=lambda _, residual, at=at: told[at].append(residual))  # type: ignore[misc]
        errors.append(caught.value)
    force = m * s * s
    one, other = errors
    np.testing.assert_allclose(told[s], force * np.array(told[1.0]), rtol=1e-12)
    np.testing.assert_allclose(other.history, one.history * [force, force * s, 1, 1], rtol=1e-12)
    left, limit = (np.array([float(each) for each in re.findall(r"([\d.e+-]+) N\b", str(error))]) for error in errors)
    np.testing.assert_allclose(limit, force * left, rtol=PRINTED)


def test_a_penalty_too_soft_is_told_in_newtons_per_square_millimetre() -> None:
    """Of 3 GPa by the paper's 5 N/mm2, at a tenth of the paper's size: 750 N/mm2 by Hertz."""
    soft = replace(written(plain_weave(yarns=2, rows=(1,)), 0.1, 300.0), contact=ContactLaw(5.0, 0.01, 0.1))
    with pytest.raises(PenetrationError, match=r"penalty of 5 N/mm2 .* gives 750 N/mm2"):
        relax(build_mesh(soft), soft)


def test_the_papers_cells_are_computed_as_they_are_printed() -> None:
    design = plain_weave(yarns=2)
    units = own_units(build_mesh(design), design)
    assert (units.length, units.modulus) == (1.0, 1.0)
