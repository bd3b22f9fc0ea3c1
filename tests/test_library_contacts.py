"""The level that a library recommends, over five orders of magnitude of the contacts' conductivity.

The mechanics do not know sigma_c: one set of states serves all. What the sub-circuits answer is read from their text
and eliminated by plain matrices, the detailed network as the others.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from library_cases import resistor_matrix

from circuittex.base.arrays import Floats
from circuittex.contact.extract import contacts_of
from circuittex.design import plain_weave, uniaxial
from circuittex.electrical.network.ports import PortMatrix
from circuittex.results.records import Study
from circuittex.study.library.accuracy import CHANGED
from circuittex.study.library.cell import Cell
from circuittex.study.library.facts import facts_of
from circuittex.study.library.levels import CRIMPED, detailed
from circuittex.study.library.parts import fixed_parts
from circuittex.study.library.subcircuit import library_text
from circuittex.study.run import run_study

ALLOWED = 0.01
"""The library's promise: relative, of every resistance and of every change of one by more than 1 %."""
STATED = 1e-6
"""Absolute, of the error that a file states: two eliminations of networks that span ten orders of magnitude."""


@pytest.fixture(scope="module")
def computed() -> Study:
    """Two yarns by two of two fibrils each, relaxed and stretched twice."""
    design = plain_weave(yarns=2, rows=(1, 1), loading=(uniaxial("stretch", (0.05, 0.1)),))
    numerics = replace(design.numerics, elements=10)
    return run_study(replace(design, numerics=numerics, terminals=(), probes=()), workers=1)


def with_sigma_c(study: Study, factor: float) -> Study:
    law = replace(study.design.contact, conductivity=factor * study.design.contact.conductivity)
    design = replace(study.design, contact=law)
    records = tuple(
        replace(each, contacts=contacts_of(design, study.mesh, each.configuration), ports=PortMatrix())
        for each in study.records
    )
    return replace(study, design=design, records=records)


def between_pins(text: str) -> Floats:
    """(pairs,) resistances between the pins of a file, all others open."""
    _, G = resistor_matrix(text)
    inverse = np.pad(np.linalg.inv(G[1:, 1:]), ((1, 0), (1, 0)))  # the first pin grounded
    own = np.diag(inverse)
    return np.asarray((own[:, None] + own - inverse - inverse.T)[np.triu_indices(len(own), 1)])


def test_the_recommended_level_is_within_one_percent_whatever_contacts_conduct(computed: Study) -> None:
    recommended = []
    for factor in (1.0, 1e2, 1e3, 1e4, 1e5):
        study = with_sigma_c(computed, factor)
        known = facts_of(study, CRIMPED, 0.0, 10.0, ())
        ohm: dict[str, list[Floats]] = {"detailed": [], "ports": [], "cell": []}
        for number, record in enumerate(study.records):
            circuit = detailed(study.design, record, CRIMPED)
            for part in fixed_parts("x", study.design, known.levels, known.reductions, number, circuit):
                if part.level in ohm:
                    cell = Cell(part.name, part.level, "", part.pins, (), "x.lib", "ngspice")
                    ohm[part.level].append(between_pins(library_text(cell, part.network, [])))
        exact, found, cell_ohm = (np.array(ohm[level]) for level in ("detailed", known.recommended, "cell"))
        assert len(exact) == 3
        assert np.abs(found / exact - 1.0).max() <= ALLOWED
        change = exact / exact[0] - 1.0
        counts = np.abs(change) > CHANGED
        assert counts.any(), "stretch changes resistances across contacts"
        assert np.abs((found / found[0] - 1.0)[counts] / change[counts] - 1.0).max() <= ALLOWED
        assert known.errors["cell"].worst[0] == pytest.approx(np.abs(cell_ohm / exact - 1.0).max(), abs=STATED)
        recommended.append(known.recommended)
    assert recommended[0] == "cell", "where contacts are what resists, Ry and Rc are all there is"
    assert recommended[-1] == "ports", "where they conduct as well as fibrils, current spreads along a crossing"
