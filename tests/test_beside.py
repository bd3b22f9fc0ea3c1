"""`circuittex report RESULTS --beside OTHER`: both parameter sets of the paper's cell in one table of claims."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest
from synthetic_study import synthetic_study

from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.design import plain_weave
from circuittex.results.records import Study
from circuittex.results.store import write_study_start

CODE = synthetic_study(3, contacts=10, loadings=("stretch", "shear"))
TABLE = replace(CODE, design=replace(CODE.design, weave=plain_weave("paper-table").weave))
OTHER_CELL = replace(CODE, design=replace(CODE.design, weave=replace(CODE.design.weave, amplitude=0.5)))


@pytest.fixture(autouse=True)
def _nothing_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_module("circuittex.results.report.page"), "save_figures", lambda study, folder: {})


def stored(folder: Path, study: Study) -> str:
    folder.mkdir()
    write_study_start(folder / "results.h5", study)
    return str(folder)


def test_both_sets_share_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, table = stored(tmp_path / "code", CODE), stored(tmp_path / "table", TABLE)
    before = (tmp_path / "table" / "results.h5").read_bytes()
    assert main(["report", code]) == 0
    alone = (tmp_path / "code" / "report.html").read_text("utf-8")
    assert alone.count('<th scope="col">paper-') == 1
    assert main(["report", code, "--beside", table]) == 0
    both = (tmp_path / "code" / "report.html").read_text("utf-8")
    assert '<th scope="col">paper-code</th><th scope="col">paper-table</th>' in both
    assert "Claims of the paper, paper-table" in both
    assert [file.name for file in (tmp_path / "table").iterdir() if "lock" not in file.name] == ["results.h5"]
    assert (tmp_path / "table" / "results.h5").read_bytes() == before


@pytest.mark.parametrize(("own", "other", "named"), [(CODE, OTHER_CELL, "other"), (OTHER_CELL, CODE, "own")])
def test_other_cells_have_no_claims_to_compare(
    own: Study, other: Study, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folders = [stored(tmp_path / "own", own), stored(tmp_path / "other", other)]
    assert main(["report", folders[0], "--beside", folders[1]]) == ExitCode.DESIGN
    text = capsys.readouterr().err
    assert f"{tmp_path / named} must be a study of the paper's cell" in text
    assert not (tmp_path / "own" / "report.html").exists()


def test_results_that_are_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = stored(tmp_path / "code", CODE)
    assert main(["report", code, "--beside", str(tmp_path / "none")]) == ExitCode.FILES
    assert "there is no results file here" in capsys.readouterr().err
