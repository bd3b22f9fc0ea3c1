"""Units: every spelling of a quantity gives the same float, and nothing else passes."""

from __future__ import annotations

from contextlib import suppress
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from circuittex.base.errors import DesignError
from circuittex.design.units import parse

SPELLINGS = [
    ("0.15 mm", "mm", 0.15),
    ("150um", "mm", 0.15),
    ("150 µm", "mm", 0.15),
    ("150 \u03bcm", "mm", 0.15),
    ("1.5e-4 m", "mm", 0.15),
    ("150000 nm", "mm", 0.15),
    ("0.015 cm", "mm", 0.15),
    ("10 MPa", "MPa", 10.0),
    ("10 N/mm2", "MPa", 10.0),
    ("10 N/mm^2", "MPa", 10.0),
    ("10 N mm⁻²", "MPa", 10.0),
    ("10 N/mm**2", "MPa", 10.0),
    ("0.01 GPa", "MPa", 10.0),
    ("10000 kN/m²", "MPa", 10.0),
    ("1 W/(mm K)", "W/(mm K)", 1.0),
    ("1 W/mm/K", "W/(mm K)", 1.0),
    ("1 W mm^-1 K^-1", "W/(mm K)", 1.0),
    ("1000 W/(m·K)", "W/(mm K)", 1.0),
    ("1 J/(s*mm*K)", "W/(mm K)", 1.0),
    ("10 S/mm", "S/mm", 10.0),
    ("10 1/(ohm mm)", "S/mm", 10.0),
    ("10 1/(Ω mm)", "S/mm", 10.0),
    ("10 A/(V mm)", "S/mm", 10.0),
    ("0.01 A/(mm2 V)", "S/mm2", 0.01),
    ("10 kS/m²", "S/mm2", 0.01),
    ("1 g/mm3", "g/mm3", 1.0),
    ("1000000 kg/m3", "g/mm3", 1.0),
    ("1 V", "V", 1.0),
    ("1000 mV", "V", 1.0),
    ("1 W/A", "V", 1.0),
    ("10 %", "1", 0.1),
    ("-2.5%", "1", -0.025),
    ("0.1", "1", 0.1),
    ("  .5  ", "1", 0.5),
    ("1e-6 N", "N", 1e-6),
    ("0 mm", "mm", 0.0),
    ("0e-999999999 m", "mm", 0.0),
    ("1e-999999999 m", "mm", 0.0),
    (3, "mm", 3.0),
    (0.25, "mm", 0.25),
]


@pytest.mark.parametrize(("text", "unit", "value"), SPELLINGS)
def test_spelling(text: float | int | str, unit: str, value: float) -> None:
    result = parse(text, unit, "field")
    assert result == value  # exactly: the conversion is rounded once
    assert isinstance(result, float)


MALFORMED = [
    ("", "mm"),
    ("mm", "mm"),
    ("0.15", "mm"),
    ("0.15 furlong", "mm"),
    ("0.15 Mm2", "mm"),
    ("10 S/mm", "mm"),
    ("1 W/(mm K", "W/(mm K)"),
    ("1 W/mm K)", "W/(mm K)"),
    ("1 W/(mm2 K)", "W/(mm K)"),
    ("1 W/mm K", "W/(mm K)"),  # read from the left, so K is in the numerator
    ("1 W//mm", "W/mm"),
    ("1 W/", "W/mm"),
    ("1 /mm", "1/mm"),
    ("1 ()", "mm"),
    ("1 m%", "1"),
    ("1 mm22", "mm"),
    ("1,5 mm", "mm"),
    ("1.5.2 mm", "mm"),
    ("1_000 mm", "mm"),
    ("٣ mm", "mm"),  # Arabic digit
    ("nan mm", "mm"),
    ("inf", "1"),
    ("1e400 mm", "mm"),
    ("1e308 Gm", "mm"),
    ("1e999999999 mm", "mm"),
    ("1 " + "(" * 10_000, "mm"),
    ("5 mm", "1"),
    (float("nan"), "mm"),
    (float("inf"), "1"),
    (10**400, "mm"),
    (True, "mm"),
    (None, "mm"),
    ([1.0], "1"),
]


@pytest.mark.parametrize(("value", "unit"), MALFORMED)
def test_malformed_is_one_error(value: object, unit: str) -> None:
    with pytest.raises(DesignError) as caught:
        parse(value, unit, "weave.pitch")  # type: ignore[arg-type]
    assert caught.value.field == "weave.pitch"
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 250


@given(st.floats(min_value=1e-200, max_value=1e200))
def test_number_in_its_own_unit_is_unchanged(value: float) -> None:
    assert parse(f"{value!r} W/(mm2 K)", "W/(mm2 K)", "field") == parse(value, "W/(mm2 K)", "field") == value


@given(
    st.decimals(min_value="-1e6", max_value="1e6", allow_nan=False, places=9),
    st.sampled_from([("um", -3), ("mm", 0), ("cm", 1), ("m", 3), ("km", 6), ("nm", -6)]),
)
def test_prefixes_are_exact(value: object, prefix: tuple[str, int]) -> None:
    symbol, power = prefix
    assert parse(f"{value} {symbol}", "mm", "field") == float(Fraction(str(value)) * Fraction(10) ** power)


@given(st.text(max_size=60))
def test_any_text_gives_a_number_or_a_design_error(text: str) -> None:
    with suppress(DesignError):
        assert isinstance(parse(text, "mm", "field"), float)
