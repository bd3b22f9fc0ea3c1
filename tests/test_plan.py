"""The plan of a study: names of its states, their order, and where each begins."""

from __future__ import annotations

import numpy as np
import pytest

from circuittex.design import Loading, plain_weave, shear, uniaxial
from circuittex.electrical.network.names import safe_name
from circuittex.study.plan import plan, state_names


@pytest.mark.parametrize(
    "loading",
    [
        (shear("a", (1.0, 1.0)), shear("a-1", (2.0,))),  # a-1-2 twice
        (shear("a-", (4.0,)), shear("a", (-4.0,))),  # a--4 twice
        (shear("a", (0.05, -0.05)),),  # signs are no letters in a netlist
        (shear("a_0", (4.0,)), shear("a-0", (4.0,))),
        (shear("a", (1.0, 1.0 + 1e-12, 1.0)),),  # equal to the digits shown
    ],
)
def test_every_state_has_a_name_of_its_own(loading: tuple[Loading, ...]) -> None:
    names = state_names(loading)
    assert [len(group) for group in names] == [len(each.strains) for each in loading]
    flat = [name for group in names for name in group]
    assert len({name.lower() for name in flat}) == len(flat)
    assert all(name.startswith(each.name) for each, group in zip(loading, names, strict=True) for name in group)


def test_names_stay_plain_where_they_can() -> None:
    assert state_names((shear("stretch", (0.025, 0.05, -0.05)), shear("back", (0.05,)))) == (
        ("stretch-0.025", "stretch-0.05", "stretch--0.05"),
        ("back-0.05",),
    )
    assert safe_name("stretch-0.05") == safe_name("stretch--0.05")  # why the sub-circuits spell the minus out


def test_every_path_starts_from_the_relaxed_state_and_goes_on_from_its_own() -> None:
    strip, turn = uniaxial("strip", (0.1, 0.2), free="y"), shear("turn", (0.3,))
    steps = plan(plain_weave(loading=(strip, turn)))
    assert [(step.name, step.previous, step.loading, step.strain, step.free_edges) for step in steps] == [
        ("relaxed", "", "", 0.0, ""),
        ("strip-0.1", "relaxed", "strip", 0.1, "y"),
        ("strip-0.2", "strip-0.1", "strip", 0.2, "y"),
        ("turn-0.3", "relaxed", "turn", 0.3, ""),
    ]
    for step, before, after in [
        (steps[1], np.eye(2), [[1.1, 0.0], [0.0, 1.0]]),
        (steps[2], [[1.1, 0.0], [0.0, 1.0]], [[1.2, 0.0], [0.0, 1.0]]),
        (steps[3], np.eye(2), [[1.0, 0.0], [0.3, 1.0]]),
    ]:
        np.testing.assert_array_equal(step.before, before)
        np.testing.assert_array_equal(step.after, after)
