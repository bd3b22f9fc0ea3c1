"""Weaves whose warp and weft lie at different distances: by symmetry and in closed form."""

from __future__ import annotations

import copy
import tomllib
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.contact.extract import contacts_of
from circuittex.design import (
    ContactLaw,
    Design,
    Material,
    Numerics,
    Probe,
    Terminal,
    Weave,
    Yarn,
    design_hash,
    parse_design,
    plain_weave,
    starter,
)
from circuittex.electrical.fields import solve_probes
from circuittex.electrical.network.matching import groups
from circuittex.geometry import build_mesh
from circuittex.relaxation.relax import clamp_force, relax

TOLERANCE = 1e-4
"""Relative: two descents to mirror images of one equilibrium end within the tolerance of the forces, 2e-5, of it."""


def cell(warp_pitch: float, weft_pitch: float, warp_height: float, weft_height: float) -> Design:
    """Two by two yarns of two fibrils side by side, one probe along a yarn of each direction."""
    material = Material("fibril", 10.0, 0.0, 1.0, 10.0, 1.0)
    yarn = Yarn("pair", (2,), 0.15, 0.35, 0.35, (material, material))
    ends = {
        f"{name}{side}": ((f"{name}1", value),) for name in ("warp", "weft") for side, value in (("m", -1), ("p", 1))
    }
    return Design(
        "two pitches",
        Weave(((0, 1), (1, 0)), (yarn,) * 2, (yarn,) * 2, warp_pitch, warp_height, weft_pitch, weft_height),
        ContactLaw("hertz", 0.01, 0.1),
        terminals=tuple(Terminal(name, end) for name, end in ends.items()),
        probes=(Probe("warp", "warpm", "warpp", 1.0), Probe("weft", "weftm", "weftp", 1.0)),
        numerics=Numerics(elements=12),
    )


@cache
def found(*lengths: float) -> tuple[np.ndarray, list[float]]:
    """Pull of the clamps along warp and weft (N) and the probes' currents (A)."""
    design = cell(*lengths)
    mesh = build_mesh(design)
    state = relax(mesh, design)
    fields = solve_probes(contacts_of(design, mesh, state.configuration), design.terminals, design.probes)
    force = clamp_force(mesh, state.reaction)
    return np.array([force[0, 0], force[1, 1]]), [each.currents[0] for each in fields]


def test_exchanging_warp_and_weft_exchanges_the_answers() -> None:
    """Turned by a quarter and looked at from below a weave of pitches p, q is one of q, p."""
    force, current = found(2.4, 1.8, 0.2, 0.18)
    turned_force, turned_current = found(1.8, 2.4, 0.18, 0.2)
    assert turned_force[::-1] == pytest.approx(force, rel=TOLERANCE)
    assert turned_current[::-1] == pytest.approx(current, rel=TOLERANCE)
    # The directions do differ, by far more than the tolerance: a swap that is not made would show.
    assert abs(force[0] / force[1] - 1) > 0.1
    assert abs(current[0] / current[1] - 1) > 0.1


def test_equal_pitches_are_the_square_weave_bit_for_bit() -> None:
    assert same(build_mesh(cell(2.0, 2.0, 0.2, 0.2)), build_mesh(replace_with_same()))


def replace_with_same() -> Design:
    design = cell(2.0, 2.0, 0.2, 0.2)
    return replace(design, weave=replace(design.weave, weft_pitch="same", weft_amplitude="same"))


def test_old_designs_keep_their_hash() -> None:
    """What is as the default has it is no part of the hash: results of the paper's cell go on."""
    design = plain_weave()
    assert design_hash(replace(design, weave=replace(design.weave, weft_pitch="same"))) == design_hash(design)
    assert design_hash(replace(design, weave=replace(design.weave, weft_pitch=2.5))) != design_hash(design)


def test_yarns_are_as_long_as_what_they_cross_is_wide() -> None:
    mesh = build_mesh(cell(2.4, 1.8, 0.2, 0.18))
    warp = mesh.yarn < 2
    assert mesh.length[warp] == pytest.approx(2 * 1.8)
    assert mesh.length[~warp] == pytest.approx(2 * 2.4)
    y = mesh.position[mesh.first_node[:-1], 1]
    assert y[:4].reshape(2, 2).mean(axis=1) == pytest.approx([-1.2, 1.2])
    height = np.abs(mesh.position[:, 2])
    fibril = mesh.node_fibril
    assert height[mesh.yarn[fibril] < 2].max() == pytest.approx(0.2, rel=0.05)  # crests fall between nodes
    assert height[mesh.yarn[fibril] >= 2].max() == pytest.approx(0.18, rel=0.05)


def test_resistances_of_segments_follow_the_pitch_they_span() -> None:
    """r' = 1 / (2 sigma pi R²); a warp segment is as long as the weft's pitch."""
    grouping = groups(cell(2.4, 1.8, 0.2, 0.18), each_crossing=False)
    assert grouping.yarns == ("pair warp", "pair weft")
    per_mm = 1 / (2 * 10 * np.pi * 0.15**2)
    assert grouping.start[:2] == pytest.approx([1.8 * per_mm, 2.4 * per_mm])


def weave(**changes: Any) -> Weave:
    mapping = copy.deepcopy(tomllib.loads(starter()))
    del mapping["weave"]["pitch"], mapping["weave"]["weft_pitch"]
    mapping["weave"] |= changes
    return parse_design(mapping).weave


def test_threads_per_cm_are_pitches() -> None:
    assert same(weave(threads_per_cm=4), weave(pitch="2.5 mm"))
    assert same(weave(threads_per_cm=[5, 4]), weave(pitch="2 mm", weft_pitch="2.5 mm"))


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"threads_per_cm": 0}, "weave.threads_per_cm", "> 0"),
        ({"threads_per_cm": [4, 4, 4]}, "weave.threads_per_cm", "two"),
        ({"threads_per_cm": "4 mm"}, "weave.threads_per_cm", "plain number"),
        ({"threads_per_cm": 4, "pitch": 2}, "weave.pitch", "not both"),
        ({"pitch": 2.5, "weft_pitch": 0}, "weave.weft_pitch", "> 0"),
        ({"pitch": 2.5, "weft_pitch": "other"}, "weave.weft_pitch", "number"),
        ({"pitch": 2.5, "weft_pitch": 0.8}, "yarns.conductive.spacing", "wider than the pitch, 0.8"),
        ({"pitch": 2.5, "weft_amplitude": 2.6}, "weave.weft_amplitude", "at most the pitch, 2.5"),
        ({"pitch": 2.5, "weft_pitch": 1e6}, "weave.weft_pitch", "at most"),
    ],
)
def test_what_cannot_be_is_refused(changes: dict[str, Any], field: str, words: str) -> None:
    with pytest.raises(DesignError, match=words) as caught:
        weave(**changes)
    assert caught.value.field == field
