"""A study as a whole: the names of its states, and what a run does to a folder that holds an earlier one."""

from __future__ import annotations

from pathlib import Path

import pytest
from fabrics import small_cell
from synthetic_study import synthetic_study

from circuittex.design import Loading, shear
from circuittex.errors import DesignError
from circuittex.export import simplified, write_netlists
from circuittex.plot import FIGURES
from circuittex.spice_names import safe_name
from circuittex.store import load_study, write_study_start
from circuittex.study import run_study, state_names
from circuittex.summary import write_summary
from circuittex.vtu import write_collections, write_vtu

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


def files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


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
        write_netlists(
            tmp_path / "netlists", study.design, record.name, simplified(study.design, record.contacts), record.fit
        )
    write_collections(tmp_path / "vtu", study.records)
    for figure in FIGURES:  # drawing takes long and has tests of its own
        for kind in ("png", "svg"):
            (tmp_path / "figures" / f"{figure}.{kind}").touch()
    for name, text in FOREIGN.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def test_an_interrupted_rerun_leaves_nothing_of_the_run_before(used: Path) -> None:
    def interrupt(_: str) -> None:
        raise KeyboardInterrupt

    assert len(files(used)) == 3 + 3 * 5 + 3 + 1 + 2 * len(FIGURES) + len(FOREIGN)
    design, _ = small_cell(elements=4)
    with pytest.raises(KeyboardInterrupt):
        run_study(design, used, progress=interrupt)
    assert files(used) == {*FOREIGN, "results.h5"}
    assert {name: (used / name).read_text(encoding="utf-8") for name in FOREIGN} == FOREIGN
    left = load_study(used / "results.h5")
    assert (left.design.name, left.records) == (design.name, ())


def test_a_design_that_cannot_be_laid_out_removes_nothing(used: Path) -> None:
    before = files(used)
    design, _ = small_cell()
    yarn = design.weave.warp[0]
    crowded = type(yarn)(yarn.name, yarn.rows, yarn.radius, yarn.spacing / 4, yarn.row_spacing, yarn.materials)
    weave = type(design.weave)(
        design.weave.draft, (crowded,) * 2, (crowded,) * 2, design.weave.pitch, design.weave.amplitude
    )
    with pytest.raises(DesignError, match="inside one another"):
        run_study(type(design)("crowded", weave, design.contact), used)
    assert files(used) == before


@pytest.mark.parametrize(
    "loading",
    [
        (shear("a", (1.0, 1.0)), shear("a-1", (2.0,))),  # a-1-2 twice
        (shear("a-", (5.0,)), shear("a", (-5.0,))),  # a--5 twice
        (shear("a", (0.05, -0.05)),),  # signs are no letters in a netlist
        (shear("a_0", (5.0,)), shear("a-0", (5.0,))),
        (shear("a", (1.0, 1.0 + 1e-12, 1.0)),),  # equal to the digits shown
    ],
)
def test_every_state_has_a_name_of_its_own(loading: tuple[Loading, ...]) -> None:
    names = state_names(loading)
    assert [len(path) for path in names] == [len(path.strains) for path in loading]
    flat = [name for path in names for name in path]
    assert len({name.lower() for name in flat}) == len(flat)
    assert all(name.startswith(path.name) for path, group in zip(loading, names, strict=True) for name in group)


def test_names_stay_plain_where_they_can() -> None:
    assert state_names((shear("stretch", (0.025, 0.05, -0.05)), shear("back", (0.05,)))) == (
        ("stretch-0.025", "stretch-0.05", "stretch--0.05"),
        ("back-0.05",),
    )
    assert safe_name("stretch-0.05") == safe_name("stretch--0.05")  # why the sub-circuits spell the minus out
