"""What Python hands to a design's constructors: anything but the right types ends in one `DesignError` sentence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import circuittex as ct
from circuittex.base.frozen import same
from circuittex.design import plain_weave

DESIGN = plain_weave(yarns=2, rows=(1,))
WEAVE = DESIGN.weave
YARN = WEAVE.warp[0]
PAIR = ct.MaterialPair("hertz", 0.0, 0.1, ("silver", "nylon"))
LOADING = ct.Loading("pull", (((1.1, 0.0), (0.0, 1.0)),), (0.1,))
TEXTS = {"name", "source", "sink"}
RIGHT: list[tuple[Callable[..., Any], dict[str, Any]]] = [
    (ct.Terminal, {"name": "left", "ends": (("warp1", -1),)}),
    (ct.Probe, {"name": "p", "source": "left", "sink": "right", "voltage": 1.0}),
    (ct.Weave, {key: getattr(WEAVE, key) for key in ("draft", "warp", "weft", "pitch", "amplitude")}),
    (ct.Yarn, {key: getattr(YARN, key) for key in ("name", "rows", "radius", "spacing", "row_spacing", "materials")}),
    (ct.MaterialPair, {"penalty": 5.0, "conductivity": 0.1, "heat_transfer": 0.1, "materials": ("a", "b")}),
    (ct.ContactLaw, {"penalty": 5.0, "conductivity": 0.1, "heat_transfer": 0.1, "pairs": (PAIR,)}),
    (ct.Material, {"name": "m", "youngs_modulus": 1.0, "poisson_ratio": 0.0, "density": 1.0}
     | {"electrical_conductivity": 1.0, "thermal_conductivity": 1.0}),
    (ct.Loading, {"name": "pull", "gradients": LOADING.gradients, "strains": LOADING.strains, "free": ""}),
    (ct.uniaxial, {"name": "pull", "strains": (0.1,), "axis": "x", "free": ""}),
    (ct.biaxial, {"name": "pull", "strains": (0.1,)}),
    (ct.shear, {"name": "pull", "strains": (0.1,), "free": ""}),
    (ct.strain_grid, {"name": "pull", "first": "x", "first_strains": (0.1,), "then": "y", "then_strains": (0.1,)}),
    (ct.equal_steps, {"strain": 0.1, "steps": 2}),
    (ct.load_unload, {"loading": LOADING}),
    (ct.Design, {key: getattr(DESIGN, key) for key in ("name", "weave", "contact", "loading", "terminals", "probes")}
     | {"electrical": ct.Electrical(), "numerics": ct.Numerics(), "packing": ct.Packing()}),
]  # fmt: skip
GRID = next(i for i, (make, _) in enumerate(RIGHT) if make is ct.strain_grid)
NEVER = (None, True, float("nan"), float("inf"), object(), {1: 2}, b"left", 1j, np.array(None))
"""Right nowhere: no field of these constructors is a truth value."""
ARGUMENTS = [pytest.param(make, right, key, id=f"{make.__name__}-{key}") for make, right in RIGHT for key in right]


def refused(make: Callable[..., Any], arguments: dict[str, Any]) -> str:
    with pytest.raises(ct.DesignError) as caught:
        make(**arguments)
    return str(caught.value)


@pytest.mark.parametrize(("make", "right"), RIGHT)
def test_the_right_types_are_taken(make: Callable[..., Any], right: dict[str, Any]) -> None:
    make(**right)


@pytest.mark.parametrize(("make", "right", "key"), ARGUMENTS)
def test_what_is_right_nowhere_is_refused_in_one_sentence(
    make: Callable[..., Any], right: dict[str, Any], key: str
) -> None:
    for value in NEVER:
        assert "\n" not in refused(make, right | {key: value})


@pytest.mark.parametrize(("make", "right", "key"), ARGUMENTS)
def test_sequences_numbers_and_texts_are_told_apart(make: Callable[..., Any], right: dict[str, Any], key: str) -> None:
    value = right[key]
    if isinstance(value, tuple) and value:
        wrong: list[Any] = [iter(value), (each for each in value), "left", 3, 0.5]
        wrong += [set(range(len(value))), [None] * len(value), [[]] * len(value)]
    elif isinstance(value, str):
        wrong = [3, 0.5, ["x"], np.array([1.0])]
    elif isinstance(value, float | int):
        wrong = ["three", [1.0], (), np.array([1.0, 2.0])]
    else:
        wrong = [3, "left", [value]] if not isinstance(value, tuple) else [3, "left", iter(())]
    for each in wrong:
        assert "\n" not in refused(make, right | {key: each})


def test_arrays_are_taken_where_sequences_are() -> None:
    lists = ct.uniaxial("pull", [0.05, 0.1])
    assert same(ct.uniaxial("pull", np.array([0.05, 0.1])), lists)
    assert same(ct.Loading("pull", np.array(lists.gradients), np.array(lists.strains)), lists)
    assert same(replace(WEAVE, draft=np.array(WEAVE.draft)), WEAVE)
    assert same(replace(YARN, rows=np.array(YARN.rows)), YARN)
    assert same(replace(WEAVE, warp=list(WEAVE.warp)), WEAVE)
    assert same(ct.Terminal("left", [["warp1", np.int64(-1)]]), ct.Terminal("left", (("warp1", -1),)))
    assert same(replace(PAIR, materials=np.array(PAIR.materials)), PAIR)


def test_a_loadings_name_is_looked_at_before_a_message_has_it() -> None:
    name = [np.eye(2)]
    assert "loading.name" in refused(ct.uniaxial, {"name": name, "strains": None})
    assert "loading.name" in refused(ct.strain_grid, RIGHT[GRID][1] | {"name": name, "first_strains": None})


def test_materials_of_a_pair_are_two_names() -> None:
    for wrong in ("ab", ("a",), ("a", "b", "c"), {"a", "b"}, (1, 2), ("a", None)):
        assert "contact.pairs.materials" in refused(ct.MaterialPair, RIGHT[4][1] | {"materials": wrong})


ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from(["x", "y", "left", "warp1", YARN, YARN.materials[0], PAIR, LOADING, np.float64(0.1), np.eye(2)]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.lists(inner, max_size=3).map(tuple)
        | st.lists(inner, max_size=2).map(iter)
        | st.dictionaries(st.text(max_size=2), inner, max_size=2)
    ),
    max_leaves=6,
)


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_nothing_but_a_design_error_ends_a_constructor(data: st.DataObject) -> None:
    make, right = data.draw(st.sampled_from(RIGHT))
    changed = data.draw(st.dictionaries(st.sampled_from(list(right)), ANYTHING, min_size=1, max_size=2))
    message = ""
    try:
        make(**right | changed)
    except ct.DesignError as error:
        message = str(error)
    else:
        assert not any(value is None or isinstance(value, bool) for value in changed.values())
    assert "\n" not in message
