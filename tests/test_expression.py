"""Numbers and arithmetic of decks of others: suffixes, precedence, and what is refused."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from circuittex.electrical.spice.expression import compile_expression, evaluate, read_number

SUFFIX = {"T": 1e12, "g": 1e9, "Meg": 1e6, "K": 1e3, "": 1.0, "m": 1e-3, "U": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15}


@pytest.mark.parametrize("suffix", sorted(SUFFIX))
@pytest.mark.parametrize("unit", ["", "ohm", "V"])
def test_suffixes(suffix: str, unit: str) -> None:
    assert_allclose(read_number(f"2.5{suffix}{unit}".lower()), 2.5 * SUFFIX[suffix], rtol=1e-15)


def test_a_mil_is_25_micrometres() -> None:
    assert read_number("2mil") == 2 * 25.4e-6


@pytest.mark.parametrize("text", ["2k2", "5a", "1e", "1x", "", "k", "0x10", "1e99999", "nan", "inf", "1_0", "--1"])
def test_numbers_that_are_none_or_mean_two_things(text: str) -> None:
    with pytest.raises(ValueError):
        read_number(text)


@given(st.lists(st.tuples(st.sampled_from("+-*/"), st.floats(0.5, 2.0)), min_size=1, max_size=20))
def test_arithmetic_is_that_of_python(terms: list[tuple[str, float]]) -> None:
    text = "1.0" + "".join(f" {sign} {value!r}" for sign, value in terms)
    assert evaluate(compile_expression(text), {}.__getitem__) == eval(text)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("-2^2", -4.0),
        ("2**-1", 0.5),
        ("(1-3)*2^3", -16.0),
        ("2*-3", -6.0),
        ("8/4/2", 1.0),
        ("7-2-1", 4.0),
        ("log(exp(3))", 3.0),
        ("max(1,min(5,3))", 3.0),
        ("((((1))))", 1.0),
        ("+ - 1k", -1000.0),
    ],
)
def test_expressions(text: str, value: float) -> None:
    assert math.isclose(evaluate(compile_expression(text), {}.__getitem__), value, rel_tol=1e-15)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("2^3^2", "needs parentheses"),
        ("1 2", "not expected"),
        ("(1", "'\\)' is missing"),
        ("", "not expected"),
        ("sin(1)", "none of the functions sqrt"),
        ("__import__('os')", "none of the functions"),
        ("a.b", "not expected"),
        ("a[0]", "not expected"),
        ("min(1)", "',' is missing"),
        ("1k+2mil", "disagree about mil"),
        ("(" * 60 + "1" + ")" * 60, "more than 50"),
        ("-" * 60 + "1", "more than 50"),
        ("1+" * 600 + "1", "longer than the 1000"),
    ],
)
def test_expressions_that_are_refused(text: str, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        compile_expression(text)


@pytest.mark.parametrize("text", ["(-2)^3", "(1-9)**2", "(-1)^0.5"])
def test_powers_of_negative_numbers_are_refused(text: str) -> None:
    """ngspice takes (-2)^3 for 8."""
    with pytest.raises(ValueError, match="which is negative: simulators disagree"):
        evaluate(compile_expression(text), {}.__getitem__)


@pytest.mark.parametrize("text", ["1/0", "sqrt(-1)", "log(0)", "exp(1000)", "9^9999", "1e308*10"])
def test_expressions_without_a_value(text: str) -> None:
    with pytest.raises(ValueError, match="no finite value"):
        evaluate(compile_expression(text), {}.__getitem__)
