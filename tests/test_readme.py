"""The README's example runs as it stands, and its two routes agree."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.S)
    exec(compile(example, str(README), "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    by_fields, by_circuit, heat = map(float, re.findall(r"-?\d+\.\d+", lines[0]))
    assert by_fields == by_circuit
    assert heat == pytest.approx(by_fields, abs=2e-6)  # V I at 1 V, both printed to six digits
    assert lines[1].startswith("*")


def test_every_file_that_it_names_exists() -> None:
    links = re.findall(r"\]\((?!http)([^)]+)\)", README.read_text(encoding="utf-8"))
    assert links
    assert [link for link in links if not (README.parent / link).exists()] == []
