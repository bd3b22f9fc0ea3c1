"""A small script that judges by itself: a fibril between two legs of another."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

HAIRPIN = Path(__file__).parent / "cases" / "hairpin.py"


def test_the_script_ends_well(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(HAIRPIN), run_name="__main__")
    assert ended.value.code == 0
    assert "lower leg 0.2065 N, on the upper 0.2065 N; expected on each 0.2000 N" in capsys.readouterr().out
