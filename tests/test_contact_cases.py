"""Small scripts that judge by themselves: a fibril between two legs of another, and contacts that lie far apart."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

CASES = Path(__file__).parent / "cases"


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("hairpin", ["lower leg 0.2065 N, on the upper 0.2065 N; expected on each 0.2000 N"]),
        ("merge", ["merged [0.2, 3.6]", "2.396980 ohm, merged 2.396980 ohm, by hand 2.396980 ohm"]),
    ],
)
def test_the_script_ends_well(name: str, says: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(CASES / f"{name}.py"), run_name="__main__")
    assert ended.value.code == 0
    printed = capsys.readouterr().out
    assert all(text in printed for text in says)
