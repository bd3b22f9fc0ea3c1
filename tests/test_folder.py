"""What a run does to a folder that holds results already: goes on, refuses, or starts again when it is told to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import pytest
from canned import Canned, canned_study, files, report
from fabrics import small_cell
from synthetic_study import synthetic_study

from circuittex.base.errors import DesignError, FolderError
from circuittex.base.frozen import same
from circuittex.results.plot import FIGURES
from circuittex.results.store import load_study, write_study_start
from circuittex.results.summary import write_summary
from circuittex.results.vtk.vtu import write_collections, write_vtu
from circuittex.study.circuits import state_circuits
from circuittex.study.export import simplified, write_netlists
from circuittex.study.folder import keep_record, open_study
from circuittex.study.run import run_study

FOREIGN = {
    "notes.txt": "mine",
    "netlists/bench.cir": "* my bench\n.include relaxed.sub\n.end\n",
    "netlists/README": "* circuittex made the others",
    "vtu/view.pvd": '<VTKFile type="Collection"></VTKFile>',
    "vtu/other.vtu": "<VTKFile></VTKFile>",
    "figures/mine.png": "Matplotlib",
    "figures/cell.pdf": "mine",
    "old/report.html": "an archived one",
}
STUDY = canned_study(2)


def contents(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in files(folder)}


@pytest.fixture
def used(tmp_path: Path) -> Path:
    """A folder with the results of a longer study, and with files of somebody else."""
    study = synthetic_study(3, contacts=10, rows=(1,))
    for name in ("netlists", "vtu", "figures", "old"):
        (tmp_path / name).mkdir()
    write_study_start(tmp_path / "results.h5", study)
    write_summary(tmp_path / "summary.json", study)
    (tmp_path / "report.html").write_text("a report", encoding="utf-8")
    for record in study.records:
        write_vtu(tmp_path / "vtu" / f"{record.name}.vtu", study.mesh, record, sides=3)
        circuits = state_circuits(
            simplified(study.design, record.contacts), study.design.terminals, study.design.probes
        )
        write_netlists(tmp_path / "netlists", study.design, record.name, circuits, record.fit, study.design.probes)
    write_collections(tmp_path / "vtu", study)
    for figure in FIGURES:  # drawing takes long and has tests of its own
        for kind in ("png", "svg"):
            (tmp_path / "figures" / f"{figure}.{kind}").touch()
    for name in ("results.h5.partial", "netlists/lost.sub.partial", "figures/lost.png.partial"):
        (tmp_path / name).touch()  # of a run that was killed
    for name, text in FOREIGN.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def test_starting_again_leaves_nothing_of_the_run_before(used: Path) -> None:
    def interrupt(_: str) -> None:
        raise KeyboardInterrupt

    assert len(files(used)) == 3 + 3 * 5 + 3 + 1 + 2 * len(FIGURES) + 3 + len(FOREIGN)
    design, _ = small_cell(elements=4)
    with pytest.raises(KeyboardInterrupt):
        run_study(design, used, fresh=True, progress=interrupt)
    assert files(used) == {*FOREIGN, "results.h5"}
    assert {name: (used / name).read_text(encoding="utf-8") for name in FOREIGN} == FOREIGN
    left = load_study(used / "results.h5")
    assert (left.design.name, left.records) == (design.name, ())


def test_a_design_that_cannot_be_laid_out_removes_nothing(used: Path) -> None:
    before = contents(used)
    design, _ = small_cell()
    yarn = replace(design.weave.warp[0], spacing=design.weave.warp[0].spacing / 4)
    weave = replace(design.weave, warp=(yarn,) * 2, weft=(yarn,) * 2)
    with pytest.raises(DesignError, match="inside one another"):
        run_study(replace(design, weave=weave), used, fresh=True)
    assert contents(used) == before


def changed(folder: Path) -> tuple[str, ...]:
    return load_study(folder / "results.h5").design_hash, STUDY.design_hash


def older(folder: Path) -> tuple[str, ...]:
    write_study_start(folder / "results.h5", replace(STUDY, version="0.0.1"))
    return "0.0.1", STUDY.version


def lacking(folder: Path) -> tuple[str, ...]:
    """As an older version left it, whose records had fewer fields."""
    write_study_start(folder / "results.h5", STUDY)
    with h5py.File(folder / "results.h5", "r+") as file:
        for record in file["states"].values():
            del record.attrs["energy"], record["end_force"]
    return str(folder / "results.h5"), "the fields of Record are not those of circuittex"


def damaged(folder: Path) -> tuple[str, ...]:
    (folder / "results.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    return (str(folder / "results.h5"), "cannot be read")


def foreign(folder: Path) -> tuple[str, ...]:
    with h5py.File(folder / "results.h5", "w") as file:
        file["x"] = 1.0
    return (str(folder / "results.h5"), "not a results file of circuittex")


def orphaned(folder: Path) -> tuple[str, ...]:
    (folder / "results.h5").unlink()
    return (str(folder), "no results.h5")


@pytest.mark.parametrize("spoil", [changed, older, lacking, damaged, foreign, orphaned])
def test_other_results_are_refused_and_stay(
    spoil: Callable[[Path], tuple[str, ...]], used: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    canned = Canned(STUDY).install(monkeypatch)
    said = spoil(used)
    before = contents(used)
    with pytest.raises(FolderError) as refused:
        run_study(STUDY.design, used, workers=1)
    message = str(refused.value)
    assert all(word in message for word in (*said, "--fresh"))
    assert "\n" not in message
    assert contents(used) == before
    assert canned.reached == []
    assert same(run_study(STUDY.design, used, workers=1, fresh=True), STUDY)


def test_the_names_of_old_states_do_not_survive_beside_new_ones(used: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Canned(STUDY).install(monkeypatch)
    run_study(STUDY.design, used, workers=1, fresh=True)
    assert {name for name in files(used) if name.endswith(".vtu")} == {
        "vtu/other.vtu",
        *(f"vtu/{record.name}.vtu" for record in STUDY.records),
    }
    assert {name: (used / name).read_text(encoding="utf-8") for name in FOREIGN} == FOREIGN


def test_files_that_are_missing_are_written_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    canned = Canned(STUDY).install(monkeypatch)
    said: list[str] = []
    run_study(STUDY.design, tmp_path, workers=1)
    whole = contents(tmp_path)
    assert len(whole) == 3 + 2 + 3 * (5 + 1)
    for name in ("summary.json", "report.html", "vtu/stretch.pvd", "vtu/relaxed.vtu", "netlists/relaxed_parallel.cir"):
        (tmp_path / name).unlink()
        assert same(run_study(STUDY.design, tmp_path, workers=1, progress=said.append), STUDY)
        assert contents(tmp_path) == whole
    assert len(canned.reached) == len(STUDY.records)
    assert said[0] == "3 of 3 states are there already\n"


def test_what_is_there_stays_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Canned(STUDY).install(monkeypatch)
    run_study(STUDY.design, tmp_path, workers=1)
    names = ["results.h5", "report.html", "vtu/relaxed.vtu", "netlists/relaxed.sub"]
    before = [(tmp_path / name).stat().st_mtime_ns for name in names]
    run_study(STUDY.design, tmp_path, workers=1)
    assert [(tmp_path / name).stat().st_mtime_ns for name in names] == before


def test_a_report_of_fewer_states_does_not_outlive_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Canned(STUDY).install(monkeypatch)
    study = open_study(tmp_path, replace(STUDY, records=()), lambda study: study)
    report(tmp_path, keep_record(tmp_path, study, STUDY.records[0]))  # as `circuittex report` does meanwhile
    run_study(STUDY.design, tmp_path, workers=1)
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == " ".join(r.name for r in STUDY.records)
