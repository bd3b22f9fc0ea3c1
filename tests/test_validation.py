"""The comparisons with measurements: the page is what they say, and what they start from has a source or a reason."""

from __future__ import annotations

import importlib
import re
from math import log, pi
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

FOLDER = Path(__file__).parents[1] / "validation"
PAGE = (FOLDER.parent / "docs" / "validation.md").read_text(encoding="utf-8")
OTHER_MACHINES = 0.005
"""Relative: three digits are printed, and no relaxation is behind those that are computed here."""

ROUNDING = 1e-12
"""Relative: sums of a few products."""


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]\d+)?(?![\w.])", text)]


def test_the_page_has_what_is_computed(script: Any) -> None:
    """Those that take no relaxation, all of them again; words are the same, and numbers within what is printed."""
    rods = script("rods")
    found = [script("wires").compare(), rods.steel(), rods.brush(), rods.steel_rods(), *rods.compare()]
    found += [script("carbon").laminate(), script("carbon").pressed()]
    for comparison in found:
        mine = comparison.text().strip()
        start = PAGE.index(f"## {comparison.title}\n")
        theirs = PAGE[start : start + len(mine) + 20].split("\n## ")[0].strip()
        assert numbers(mine) == pytest.approx(numbers(theirs), rel=OTHER_MACHINES)
        assert re.sub(r"[\d.e+-]+", "", mine) == re.sub(r"[\d.e+-]+", "", theirs)


def test_misses_are_counted() -> None:
    agree, missed = PAGE.count("| agrees |"), PAGE.count("**missed** by")
    assert f"**{agree} of {agree + missed} numbers agree, {missed} are missed.**" in PAGE
    assert missed > 0


def test_bands_that_meet_agree(script: Any) -> None:
    comparison: ModuleType = script("comparison")
    band, point = comparison.Band, comparison.Point
    assert point("", band(1.0, 2.0), band(2.0, 3.0)).factor == 1.0
    assert point("", band(1.0, 2.0), band(4.0, 5.0)).factor == 2.0
    assert point("", band(2.0, 3.0), band(0.5, 1.0)).factor == 0.5


def test_an_input_without_a_source_needs_a_reason(script: Any) -> None:
    comparison: ModuleType = script("comparison")
    known, other = (comparison.Source(name, "A page") for name in ("one", "other"))
    made = dict.fromkeys(("title", "measured", "computed", "unit", "meaning"), "")
    for given in (comparison.Input("E", "1", None), comparison.Input("E", "1", other)):
        with pytest.raises(ValueError, match="source"):
            comparison.Comparison(**made, sources=(known,), inputs=(given,), points=())


def test_a_bundle_stretches_bends_and_conducts_as_its_filaments(script: Any) -> None:
    """72 free filaments of 27 um as one fibril of 0.115 mm: sums over the 72, and what the skin adds."""
    n, r, R, E, skin = 72, 0.0135, 0.0575, 4e3, 1e3
    one = pi * r**2
    yarn = script("bundle").bundle("yarn", 2 * R, n * one, E, r, skin, conductance=n * one * 50.0)
    (fibril,), (bent,) = yarn.fibrils, yarn.bending_radii
    stretched = fibril.youngs_modulus * pi * R**2
    assert stretched == pytest.approx(n * E * one, rel=ROUNDING)
    assert fibril.electrical_conductivity * pi * R**2 == pytest.approx(n * 50.0 * one, rel=ROUNDING)
    # the core has what the skin lacks of E A, so of E I too; the skin is a tube
    free = n * E * pi * r**4 / 4
    tube = skin * pi * (R**4 - r**4) / 4
    lacks = skin * pi * (R**2 - r**2) * r**2 / 4
    assert stretched * bent**2 / 4 == pytest.approx(free + tube - lacks, rel=ROUNDING)
    assert tube > 0.5 * free, "the skin is seen at all"


def test_fibres_on_a_plate_touch_in_hertz_strips(script: Any) -> None:
    """Fibres side by side on graphite at 1 MPa, by hand: strips of width 2 b, into which the current is constricted."""
    carbon = script("carbon")
    R, load = 0.0035, 1.0 * 2 * 0.0035  # N/mm: a fibre carries what is pressed on its width
    E = 1 / ((1 - 0.3**2) / 15e3 + (1 - 0.2**2) / 10e3)
    b = (4 * load * R / (pi * E)) ** 0.5
    length = 1 / (2 * R)  # mm of fibre on each mm2
    film = 1 / (2e4 * 2 * b * length)  # ohm mm2
    spread = (3.5 * 1.5e-2 + 1.5e-2) * (log(2 * R / b) + 1 / 8) / (pi * length)
    for law, expected in ((carbon.crossed, film), (carbon.holm, spread), (carbon.film, film + spread)):
        found = carbon.on_plate("graphite", 1.0, law, 1.0, 3.5, 2e4)
        assert found == pytest.approx(expected * 1e3 * 1e-2, rel=ROUNDING)  # mohm in an ohm, cm2 in a mm2
    assert 0.1 * spread < film < 10 * spread, "both are seen in their sum"


def test_the_film_of_the_rods_makes_up_for_what_they_lack(script: Any) -> None:
    """Hertz's circles by hand, six of them: a film on all of it, and metal of 1.5 times the least resistivity."""
    rods = script("rods")
    films = []
    for force in (0.1, 1.0, 10.0):
        for R in (0.75, 1.5):
            a = (3 * force * R / (4 * 206e3 / (2 * (1 - 0.29**2)))) ** (1 / 3)
            films.append((7.6e-3 / (0.102 * force) ** 0.5 - 1.5 * 1.0e-4 / (2 * a)) * pi * a**2)
    assert rods.steel_films() == pytest.approx((min(films), max(films)), rel=ROUNDING)


def test_heat_to_the_air_is_as_textbooks_tabulate(script: Any) -> None:
    """Morgan's (1975) table in three decades; the two correlations differ by up to a fifth, as their authors say."""
    air: ModuleType = script("air")
    for decade, expected in ((1e-4, 0.675 * 1e-4**0.058), (1.0, 1.02), (90.0, 1.02 * 90.0**0.148)):
        k, _, Ra = air._air(1.0, 400.0, 300.0)
        diameter = (decade / Ra) ** (1 / 3)
        assert air.morgan(diameter, 400.0, 300.0) * diameter / k == pytest.approx(expected, rel=1e-9)
        assert air.churchill_chu(diameter, 400.0, 300.0) * diameter / k == pytest.approx(expected, rel=0.2), (
            "of each other"
        )
    assert air.radiation(1.0, 301.0, 300.0) == pytest.approx(4 * 5.67e-8 * 300.5**3, rel=1e-3)
