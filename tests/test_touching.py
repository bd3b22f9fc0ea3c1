"""Amplitudes that let nothing start inside anything: seen by chords of the starting centre lines themselves."""

from __future__ import annotations

import copy
import tomllib
from dataclasses import replace
from typing import Any

import pytest
from scipy.spatial import cKDTree

from circuittex.base.errors import DesignError
from circuittex.design import Weave, parse_design, starter
from circuittex.geometry.centre_lines import centre_lines

DENSE = 240
"""Places from crossing to crossing: the nearest two of two fibrils miss their distance by less than `MISSED`."""
MISSED = 5e-3


def weave(yarn: dict[str, Any], **changes: Any) -> Weave:
    mapping = copy.deepcopy(tomllib.loads(starter()))
    mapping["yarns"]["conductive"] = {"material": "fibril"} | yarn
    mapping["weave"] |= {"amplitude": "auto"} | changes
    return parse_design(mapping).weave


def closest(cloth: Weave) -> float:
    """Smallest distance of a warp from a weft centre line, in parts of R + R'."""
    lines = centre_lines(cloth, DENSE * len(cloth.warp) + 1)
    warp = lines.yarn < len(cloth.warp)
    radius = cloth.warp[0].radius
    x = lines.position
    nearest, _ = cKDTree(x[~warp].reshape(-1, 3)).query(x[warp].reshape(-1, 3), distance_upper_bound=4 * radius)
    return float(nearest.min()) / (2 * radius)


@pytest.mark.parametrize(
    ("yarn", "changes"),
    [
        ({"rows": [3, 4, 3], "radius": 0.15, "spacing": 0.3}, {}),
        ({"rows": [1], "radius": 0.3, "spacing": 0.6}, {}),
        ({"filaments": 19, "radius": 0.05}, {"pitch": 1.0}),
        ({"filaments": 34, "radius": 0.05, "flattening": 4}, {"pitch": 1.8, "weft_pitch": 2.6}),
    ],
)
def test_warp_and_weft_touch_and_do_not_overlap(yarn: dict[str, Any], changes: dict[str, Any]) -> None:
    cloth = weave(yarn, **changes)
    assert closest(cloth) == pytest.approx(1.0, abs=MISSED)
    assert closest(replace(cloth, amplitude=0.95 * cloth.amplitude)) < 1 - 2 * MISSED  # a lower one would not do


def test_single_fibrils_far_apart_rise_by_their_radius() -> None:
    """Two straight cylinders at right angles touch where their axes are 2 R apart, H = R each."""
    cloth = weave({"rows": [1], "radius": 0.15, "spacing": 0.3}, pitch=12)
    assert cloth.amplitude == pytest.approx(0.15, rel=5e-3)


@pytest.mark.parametrize(
    ("yarn", "changes", "words"),
    [
        ({"rows": [4, 4, 4, 4], "radius": 0.2, "spacing": 0.4}, {"pitch": 1.3}, "too thick"),
        ({"rows": [1], "radius": 0.15, "spacing": 0.3}, {"weft_amplitude": 0.1}, "of warp and weft alike"),
    ],
)
def test_what_cannot_be_is_refused(yarn: dict[str, Any], changes: dict[str, Any], words: str) -> None:
    with pytest.raises(DesignError, match=words):
        weave(yarn, **changes)
