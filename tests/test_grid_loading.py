"""Loadings that make a grid of two strains: how they are stated, planned, stored and labelled."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from library_cases import grid_study

from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.design import Loading, design_hash, parse_design, plain_weave, shear, starter, strain_grid, uniaxial
from circuittex.results.loadings import by_loading
from circuittex.results.store import load_study, write_study_start
from circuittex.results.vtk.vtu import write_collections
from circuittex.study.plan import plan


def stated(**keys: Any) -> tuple[Loading, ...]:
    """The loadings of the starter design with one loading 'pull' of kind 'grid'."""
    return parse_design({**tomllib.loads(starter()), "loading": [{"name": "pull", "kind": "grid", **keys}]}).loading


FIRST = {"axis": "x", "strain": "10 %", "steps": 2}
THEN = {"axis": "shear", "strains": [-0.02, "-4 %"]}


def test_a_grid_goes_along_one_axis_and_from_each_state_along_the_other() -> None:
    """All nine states once, each with a gradient of its own, and each one step from the one it starts from."""
    loading = stated(first=FIRST, then=THEN)
    assert same(loading, strain_grid("pull", "x", (0.05, 0.1), "shear", (-0.02, -0.04)))
    steps = plan(plain_weave(loading=loading))
    assert [(step.previous, step.name) for step in steps] == [
        ("", "relaxed"),
        ("relaxed", "pull-x-0.05"),
        ("pull-x-0.05", "pull-x-0.1"),
        ("relaxed", "pull-x0-shear--0.02"),
        ("pull-x0-shear--0.02", "pull-x0-shear--0.04"),
        ("pull-x-0.05", "pull-x0p05-shear--0.02"),
        ("pull-x0p05-shear--0.02", "pull-x0p05-shear--0.04"),
        ("pull-x-0.1", "pull-x0p1-shear--0.02"),
        ("pull-x0p1-shear--0.02", "pull-x0p1-shear--0.04"),
    ]
    reached = {(float(step.after[0, 0]), float(step.after[1, 0])) for step in steps}
    assert reached == {(x, s) for x in (1.0, 1.05, 1.1) for s in (0.0, -0.02, -0.04)}
    gradients = {step.name: step.after for step in steps}
    for step in steps[1:]:
        np.testing.assert_array_equal(step.before, gradients[step.previous])


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"first": FIRST}, r"loading\.pull\.then: nothing .*missing"),
        ({"first": FIRST, "then": 3}, r"loading\.pull\.then: 3 .*table"),
        ({"first": FIRST, "then": {"axis": "x", "strains": [0.1]}}, r"loading\.pull\.then\.axis: 'x' .*'y', 'shear'"),
        ({"first": {**FIRST, "axis": "z"}, "then": THEN}, r"loading\.pull\.first\.axis: 'z' .*'x', 'y', 'shear'"),
        ({"first": {**FIRST, "unload": True}, "then": THEN}, r"loading\.pull\.first\.unload: True .*unknown"),
        ({"first": FIRST, "then": THEN, "free": "y"}, r"loading\.pull\.free: 'y' .*'first', 'then'"),
        ({"first": {"axis": "x", "strains": [0.1, 0.05]}, "then": THEN}, r"first\.strains: .*further than the last"),
        ({"first": {"axis": "x", "strains": [0.0, 0.05]}, "then": THEN}, r"first\.strains: .*from 0 in one direction"),
        ({"first": {"axis": "x", "strains": [-0.01, 0.05]}, "then": THEN}, r"first\.strains: .*in one direction"),
        ({"first": FIRST, "then": {"axis": "y", "strain": 9, "steps": 1}}, r"loading\.pull\.then\.strain: 9"),
        (
            {"first": {**FIRST, "steps": 9999}, "then": {"axis": "y", "strain": 0.1, "steps": 9}},
            r"loading\.pull\.then: 100000 .*at most 10000 states",
        ),
    ],
)
def test_grids_that_cannot_be_used(keys: dict[str, Any], said: str) -> None:
    with pytest.raises(DesignError, match=said):
        stated(**keys)


def test_a_loading_starts_from_a_state_of_one_before_it_with_the_same_ends_held() -> None:
    first = uniaxial("first", (0.05, 0.1))
    second = replace(shear("second", (0.1,)), start=first.gradients[0])
    steps = plan(plain_weave(loading=(first, second)))
    assert (steps[-1].name, steps[-1].previous) == ("second-0.1", "first-0.05")
    for loading in ((second, first), (uniaxial("first", (0.05,), free="y"), second), (second,)):
        with pytest.raises(DesignError, match=r"loading\.second\.start: .*a loading before it"):
            plain_weave(loading=loading)


def test_where_a_loading_starts_counts_in_the_hash_and_rest_does_not() -> None:
    first, second = uniaxial("first", (0.05,)), shear("second", (0.1,))
    plain = plain_weave(loading=(first, second))
    moved = plain_weave(loading=(first, replace(second, start=first.gradients[0])))
    assert design_hash(plain) != design_hash(moved)
    again = replace(second, start=((1.0, 0.0), (0.0, 1.0)))
    assert design_hash(plain_weave(loading=(first, again))) == design_hash(plain)


def test_a_path_begins_with_the_state_it_starts_from_in_results_and_files(tmp_path: Path) -> None:
    study = grid_study()
    write_study_start(tmp_path / "results.h5", study)
    study = load_study(tmp_path)
    labels = {name: [(r.name, r.strain) for r in records] for name, records in by_loading(study).items()}
    assert labels["pull-x"] == [("relaxed", 0.0), ("pull-x-0.025", 0.025), ("pull-x-0.06", 0.06)]
    assert labels["pull-x0p06-shear"] == [
        ("pull-x-0.06", 0.0),
        ("pull-x0p06-shear--0.01", -0.01),
        ("pull-x0p06-shear--0.04", -0.04),
    ]
    files = write_collections(tmp_path, study)
    first = [ElementTree.parse(file).getroot().find("Collection/DataSet") for file in files]
    assert [(each.attrib["file"], each.attrib["timestep"]) for each in first if each is not None] == [
        ("relaxed.vtu", "0.0"),
        ("relaxed.vtu", "0.0"),
        ("pull-x-0.025.vtu", "0.0"),
        ("pull-x-0.06.vtu", "0.0"),
    ]
