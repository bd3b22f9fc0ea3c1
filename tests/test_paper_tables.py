"""The script that writes the tables of docs/paper.md."""

from __future__ import annotations

import importlib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest
from synthetic_study import synthetic_study

from circuittex.design import plain_weave
from circuittex.results.claims import CLAIMS

ROOT = Path(__file__).parents[1]
STUDY = synthetic_study(3, contacts=40, loadings=("stretch", "shear"))
TABLE = replace(STUDY, design=replace(STUDY.design, weave=plain_weave("paper-table").weave))


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    return importlib.import_module("paper_tables")


def test_the_page_takes_every_table_and_keeps_its_text(
    script: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "paper.md"
    page.write_text((ROOT / "docs" / "paper.md").read_text("utf-8"), "utf-8")
    studies = {tmp_path / "a" / "results.h5": STUDY, tmp_path / "b" / "results.h5": TABLE}
    monkeypatch.setattr(script, "load_study", studies.__getitem__)
    arguments = [str(tmp_path / "a"), str(tmp_path / "b"), "--page", str(page)]
    script.main(arguments)
    first = page.read_text("utf-8")
    assert first.startswith("# The paper's study\n")
    for record in STUDY.records:
        assert first.count(f"| {record.name} | {record.clamp_force[0, 0]:.4f} |") == 2  # once for each set
        assert f"| {record.fit.Rc:.2f} | {record.iterations} |" in first
    for claim in CLAIMS:
        assert first.count(f"| {claim.states} (") == 1
    script.main(arguments)
    assert page.read_text("utf-8") == first


def test_every_line_of_a_table_has_as_many_columns(script: ModuleType) -> None:
    for name, text in script.tables([STUDY, TABLE]).items():
        lines = [line for line in text.splitlines() if line.startswith("|")]
        assert name == "reasons" or lines or text == "No error estimate was computed."
        assert len({line.count("|") for line in lines}) <= 1


def test_other_studies_and_pages_without_a_place_are_refused(script: ModuleType) -> None:
    with pytest.raises(SystemExit, match="paper's cell"):
        script.tables([STUDY, replace(STUDY, records=())])
    with pytest.raises(SystemExit, match="one <!-- claims -->"):
        script.filled("no place", "claims", "table")
