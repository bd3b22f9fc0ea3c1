"""Yarns by count, filaments and resistance per length: against the trade's own definitions and by enumeration."""

from __future__ import annotations

import copy
import tomllib
from itertools import product
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from circuittex.base.errors import DesignError
from circuittex.design import Design, fibril_radius, hexagonal_rows, parse_design, starter
from circuittex.electrical.network.matching import groups
from circuittex.geometry.packing import section_offsets

ROUNDING = 1e-12
"""Relative, of a few products and roots."""
TRADE = {
    "material": "fibril",
    "filaments": 34,
    "linear_density": "235 dtex",
    "resistance": "150 ohm/m",
}


def stated(yarn: dict[str, Any], **material: Any) -> Design:
    """The starter design with this yarn, and its material without a conductivity of its own."""
    mapping = copy.deepcopy(tomllib.loads(starter()))
    mapping["yarns"]["conductive"] = yarn
    del mapping["materials"]["fibril"]["electrical_conductivity"]
    mapping["materials"]["fibril"] |= {"density": "1.14 g/cm3"} | material
    mapping["weave"] |= {"amplitude": "0.2 mm"}
    return parse_design(mapping)


def test_a_kilometre_of_the_yarn_weighs_what_its_count_says() -> None:
    """235 dtex: 23.5 g/km. Nylon filaments of 235/34 are known to be 28 um thick."""
    yarn = stated(TRADE).weave.warp[0]
    volume = 1e6 * yarn.n_fibrils * pi * yarn.radius**2
    assert volume * 1.14e-3 == pytest.approx(23.5, rel=ROUNDING)
    assert 2e3 * yarn.radius == pytest.approx(28, abs=0.5)


@pytest.mark.parametrize("count", ["23.5 tex", "235 dtex", "211.5 den", "23.5 mg/m", 23.5e-6])
def test_counts_in_any_unit_are_one(count: object) -> None:
    radius = stated(TRADE | {"linear_density": count}).weave.warp[0].radius
    assert radius == pytest.approx(stated(TRADE).weave.warp[0].radius, rel=ROUNDING)


def test_a_metre_of_the_yarn_has_its_resistance() -> None:
    """A segment from crossing to crossing is r' times the pitch, which is what the reduced network starts from."""
    design = stated(TRADE)
    grouping = groups(design, each_crossing=False)
    assert grouping.start[0] == pytest.approx(0.15 * design.weave.pitch, rel=ROUNDING)


def test_mixed_fibrils_weigh_by_their_own_densities() -> None:
    """Two of steel and one of nylon: T = pi R² (2 x 7.9e-3 + 1.1e-3)."""
    mapping = copy.deepcopy(tomllib.loads(starter()))
    mapping["materials"] = {
        "steel": mapping["materials"]["fibril"] | {"density": "7.9 g/cm3"},
        "nylon": mapping["materials"]["fibril"] | {"density": "1.1 g/cm3"},
    }
    mapping["yarns"]["conductive"] = {
        "filaments": 3,
        "materials": ["steel", "steel", "nylon"],
        "linear_density": "30 tex",
    }
    radius = parse_design(mapping).weave.warp[0].radius
    assert radius == pytest.approx(sqrt(30e-6 / (pi * 16.9e-3)), rel=ROUNDING)


def test_filaments_touch_and_none_overlap() -> None:
    yarn = stated(TRADE).weave.warp[0]
    distances = pdist(section_offsets(yarn))
    assert distances.min() == pytest.approx(2 * yarn.radius, rel=1e-9)  # touching, up to rounding
    # In a hexagonal packing of n filaments there are close to 3 n touching pairs, less those at the rim.
    assert (distances < 2 * yarn.radius * (1 + 1e-6)).sum() > 2 * yarn.n_fibrils


def spread(rows: tuple[int, ...], aspect: float) -> float:
    """Sum of (x/a)² + (z a)² of filaments a unit apart."""
    return sum(
        (k - (n - 1) / 2) ** 2 / aspect + aspect * 0.75 * (row - (len(rows) - 1) / 2) ** 2
        for row, n in enumerate(rows)
        for k in range(n)
    )


@pytest.mark.parametrize("n", range(1, 15))
@pytest.mark.parametrize("aspect", [1.0, 2.5])
def test_no_other_rows_are_closer_together(n: int, aspect: float) -> None:
    """By enumeration of all sequences of rows that differ by one."""
    least = np.inf
    for first in range(1, n + 1):
        for length in range(n):
            for steps in product((-1, 1), repeat=length):
                rows = tuple(np.cumsum((first, *steps)).tolist())
                if min(rows) > 0 and sum(rows) == n:
                    least = min(least, spread(rows, aspect))
    found = hexagonal_rows(n, aspect)
    assert sum(found) == n
    assert spread(found, aspect) == pytest.approx(least, rel=ROUNDING)


@pytest.mark.parametrize(("flattening", "shape"), [(1.0, 1.0), (3.0, 3.0), (6.0, 6.0)])
def test_the_outline_is_as_flat_as_asked_for(flattening: float, shape: float) -> None:
    """The ratio of the standard deviations of places is that of the axes of a full ellipse, within a row's height."""
    rows = hexagonal_rows(300, flattening)
    heights = np.repeat(np.arange(len(rows)) * sqrt(0.75), rows)
    across = np.concatenate([np.arange(n) - (n - 1) / 2 for n in rows])
    assert across.std() / heights.std() == pytest.approx(shape, rel=0.1)


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ({"radius": 0.1}, "yarns.conductive.radius", "not both"),
        ({"rows": [3, 4]}, "yarns.conductive.rows", "not both"),
        ({"filaments": 0}, "yarns.conductive.filaments", "from 1 to 2000"),
        ({"filaments": 3.5}, "yarns.conductive.filaments", "whole number"),
        ({"flattening": 0.5}, "yarns.conductive.flattening", ">= 1"),
        ({"linear_density": "235 mm"}, "yarns.conductive.linear_density", "same dimension"),
        ({"linear_density": "-1 tex"}, "yarns.conductive.linear_density", "> 0"),
        ({"resistance": "0 ohm/m"}, "yarns.conductive.resistance", "> 0"),
        ({"resistance": "5 ohm"}, "yarns.conductive.resistance", "same dimension"),
        ({"material": "silver"}, "yarns.conductive.material", "'fibril'"),
    ],
)
def test_what_cannot_be_is_refused(change: dict[str, Any], field: str, words: str) -> None:
    with pytest.raises(DesignError, match=words) as caught:
        stated(TRADE | change)
    assert caught.value.field == field


def test_a_conductivity_is_stated_once() -> None:
    with pytest.raises(DesignError, match="states it already"):
        stated(TRADE, electrical_conductivity="10 S/mm")
    mapping = copy.deepcopy(tomllib.loads(starter()))
    del mapping["materials"]["fibril"]["electrical_conductivity"]
    mapping["yarns"] = {"conductive": TRADE, "other": TRADE | {"resistance": "100 ohm/m"}}
    with pytest.raises(DesignError, match="two conductivities"):
        parse_design(mapping)


def test_python_has_the_same_numbers() -> None:
    assert fibril_radius(235e-7, 34, 1.14e-3) == pytest.approx(stated(TRADE).weave.warp[0].radius, rel=ROUNDING)
