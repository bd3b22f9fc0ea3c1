"""Which start a run has, what is recorded of it, and what a run that goes on makes of it."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from canned import Canned, canned_study
from small_design import SMALL

from circuittex.base.errors import DesignError, FolderError, StoreError
from circuittex.base.frozen import same
from circuittex.design import Design, Packing, parse_design
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.results.effort import effort
from circuittex.results.records import Study
from circuittex.results.store import load_study, write_study_start
from circuittex.results.summary import summary
from circuittex.study import start as starts
from circuittex.study.run import run_study

pytestmark = pytest.mark.xdist_group("study_start")  # what its fixtures make serves one worker

STUDY = canned_study(2)
COPIES = "tiled, from 2 x 2 yarns"
WIDE = SMALL.replace("[[0, 1], [1, 0]]", "[[0, 1, 0, 1], [1, 0, 1, 0]]")
SAME = 1e-7
"""Relative: energies of equilibria that are one, each within the tolerance of 2e-5, which enters an energy squared."""


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run from copies, without its report; test_documentation.py runs the command."""
    folder = tmp_path_factory.mktemp("computed")
    write_study_start(folder / "results.h5", run_study(parsed(WIDE), start="tiled", branches=True))
    return folder


def parsed(text: str) -> Design:
    return parse_design(tomllib.loads(text))


def test_a_run_says_where_it_started_and_ends_where_others_do(computed: Path) -> None:
    study = load_study(computed)
    assert study.start == COPIES
    woven = initial_configuration(study.mesh)
    assert np.array_equal(study.initial.r[study.mesh.ends], woven.r[study.mesh.ends])
    assert not same(study.initial, woven)
    direct = run_study(study.design)
    assert study.records[0].energy == pytest.approx(direct.records[0].energy, rel=SAME)
    assert (summary(study)["start"], summary(direct)["start"]) == (COPIES, "initial")
    assert f"not start from the initial weave: {COPIES}." in " ".join(effort(study))
    assert "start" not in " ".join(effort(direct))
    assert study.branches[0].verdict == "same branch", "the check starts where the run did"


def test_a_run_from_a_stored_state_names_it(computed: Path, tmp_path: Path) -> None:
    source = load_study(computed)
    design = replace(source.design, name="stiffer", contact=replace(source.design.contact, penalty=6.0))
    for wanted in (str(computed), f"{computed / 'results.h5'}:relaxed"):
        study = run_study(design, start=wanted)
        assert study.start == f"state relaxed of 'Small study', design {source.design_hash}"
        assert same(study.initial, starts.chosen(study, wanted, _nothing, print).configuration())
    assert study.records[0].energy == pytest.approx(run_study(design).records[0].energy, rel=SAME)


def _nothing() -> None:
    raise AssertionError("a stored state needs no relaxation")


@pytest.mark.parametrize(
    ("wanted", "error", "words"),
    [
        ("tiles", StoreError, "tiles: there is no results file here"),
        (None, DesignError, "start: None is not usable; it must be 'initial', 'tiled' or FILE"),
        ("OUT:stretch-9", DesignError, "stretch-9' is not usable; recorded states: relaxed"),
        ("OUT", DesignError, "its yarns must have as many fibrils"),
        ("tiled", DesignError, "no cell repeats in a random packing"),
    ],
)
def test_what_is_no_start_is_refused_before_anything_is_written(
    computed: Path, tmp_path: Path, wanted: str, error: type[Exception], words: str
) -> None:
    design = parsed(SMALL if wanted == "OUT" else WIDE)
    design = replace(design, packing=Packing(seed=1, lateral=0.001))
    with pytest.raises(error, match=words.replace("(", r"\(")) as refused:
        run_study(design, tmp_path / "out", start=wanted.replace("OUT", str(computed)) if wanted else wanted)
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "out").exists()


def moved(study: Study) -> Study:
    """The study as it would be from another start."""
    x = study.initial.x.copy()
    x[:, 0, 2] *= 0.99
    return replace(study, initial=Configuration(x), start=COPIES)


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A start that is made without a relaxation and counts how often it is."""
    made: list[str] = []

    def tiled(*_: object, solver: object, report: Callable[[int, float], None]) -> Configuration:
        report(3, 1e-3)
        made.append("tiled")
        return moved(STUDY).initial

    monkeypatch.setattr(starts, "tiled", tiled)
    return made


def test_a_run_goes_on_with_the_start_that_it_had(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, counted: list[str]
) -> None:
    canned, said = Canned(moved(STUDY)).install(monkeypatch), []

    def killed(name: str) -> None:
        raise KeyboardInterrupt

    canned.before = killed
    with pytest.raises(KeyboardInterrupt):
        run_study(STUDY.design, tmp_path, workers=1, start="tiled", progress=said.append)
    assert said[0] == "start of 2 x 2 yarns: iteration 3, largest free force 1.0e-03 N"
    canned.before = lambda name: None
    with pytest.raises(FolderError, match=f"another start, {COPIES}, and this is initial; .*--fresh"):
        run_study(STUDY.design, tmp_path, workers=1)
    study = run_study(STUDY.design, tmp_path, workers=1, start="tiled")
    assert counted == ["tiled"], "the start is in the file and not made again"
    assert same(study, moved(STUDY))
    assert same(load_study(tmp_path), study)
    with pytest.raises(FolderError, match="another start"):
        run_study(STUDY.design, tmp_path, workers=1)
    Canned(STUDY).install(monkeypatch)
    assert same(run_study(STUDY.design, tmp_path, workers=1, fresh=True), STUDY)


def test_a_start_that_fails_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, counted: list[str]
) -> None:
    def fails(*_: object, **__: object) -> Configuration:
        raise DesignError("start", "tiled", "in it fibrils are wrong")

    Canned(STUDY).install(monkeypatch)
    run_study(STUDY.design, tmp_path, workers=1)
    before = (tmp_path / "results.h5").read_bytes()
    monkeypatch.setattr(starts, "tiled", fails)
    with pytest.raises(DesignError, match="fibrils are wrong"):
        run_study(STUDY.design, tmp_path, workers=1, start="tiled", fresh=True)
    assert (tmp_path / "results.h5").read_bytes() == before


def test_the_initial_weave_is_not_written_as_a_start(tmp_path: Path) -> None:
    """So that files of such runs stay those that older versions read."""
    for name, study in (("initial", STUDY), ("copies", moved(STUDY))):
        path = tmp_path / f"{name}.h5"
        write_study_start(path, study)
        with h5py.File(path) as file:
            assert ("start" in file.attrs) == (name == "copies")
            assert ("start:" in file.attrs["about"]) == (name == "copies")
        assert same(load_study(path), study)


def test_a_changed_start_is_noticed(tmp_path: Path) -> None:
    write_study_start(tmp_path / "results.h5", moved(STUDY))
    with h5py.File(tmp_path / "results.h5", "r+") as file:
        file.attrs["start"] = "tiled, from 1 x 1 yarns"
    with pytest.raises(StoreError, match="does not match its digest"):
        load_study(tmp_path)
