"""The documentation's example of a law of one's own: it is ten lines, and it conducts as it says."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pressed import FORCE, FOUND, SIGMA, SPOT, pressed

import circuittex as ct
from circuittex.base.errors import DesignError
from circuittex.contact.conductance import PER_TOUCH
from circuittex.design import contact_laws

pytestmark = pytest.mark.xdist_group("own_contact_law")  # what its fixtures make serves one worker

PAGE = Path(__file__).parent.parent / "docs" / "add_contact_law.md"


@pytest.fixture
def example() -> Iterator[dict[str, Any]]:
    """What the page's script leaves behind; its law is forgotten afterwards."""
    (text,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    found: dict[str, Any] = {"said": StringIO(), "text": text}
    with redirect_stdout(found["said"]):
        exec(text, found)
    yield found
    for known in (PER_TOUCH, contact_laws._ADDED):
        known.pop("rough", None)  # type: ignore[attr-defined]


def with_law(law: str) -> dict[str, Any]:
    design = tomllib.loads(ct.starter())
    design["contact"]["law"] = law
    return design


def test_the_example_conducts_as_it_says(example: dict[str, Any]) -> None:
    """n = F / (H pi s^2) spots: G = 2 sigma / (1/(n s) + 1/a), a = R/10 the radius of the touch."""
    number = FORCE / (600.0 * np.pi * 1e-8)
    expected = 2 * SIGMA / (1 / (number * 1e-4) + 1 / SPOT)
    assert pressed("rough").conductance.sum() == pytest.approx(expected, rel=FOUND)
    assert float(example["said"].getvalue()) > 0.0


def test_it_is_ten_lines(example: dict[str, Any]) -> None:
    lines = [line for line in example["text"].splitlines() if line.strip()]
    assert lines.index('ct.add_contact_law("rough", rough)') < 10


def test_a_file_can_name_it_once_it_is_known(example: dict[str, Any]) -> None:
    assert ct.parse_design(with_law("rough")).contact.law == "rough"
    with pytest.raises(DesignError, match=r"contact\.law: 'smooth' .* 'power', .*'rough'"):
        ct.parse_design(with_law("smooth"))
    assert ct.design_hash(ct.parse_design(with_law("rough"))) != ct.design_hash(ct.parse_design(with_law("holm")))
    assert ct.design_hash(ct.parse_design(with_law("paper"))) == ct.design_hash(
        ct.parse_design(tomllib.loads(ct.starter()))
    )


@pytest.mark.parametrize(
    "wrong", [lambda t: 1.0, lambda t: -t.force, lambda t: t.force * np.nan], ids=["one", "-", "nan"]
)
def test_what_no_law_may_return(example: dict[str, Any], wrong: Any) -> None:
    ct.add_contact_law("rough", wrong)
    with pytest.raises(DesignError, match=r"contact law 'rough': .* must return 1 finite conductances >= 0 S"):
        pressed("rough")


def test_names_of_the_package_stay_its_own() -> None:
    for name in ("holm", "a law"):
        with pytest.raises(DesignError, match="contact law: "):
            ct.add_contact_law(name, lambda touches: touches.force)
