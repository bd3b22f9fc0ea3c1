"""Members of an ensemble that start from those of another: which state each takes, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from members_here import compute_here

from circuittex.base.errors import DesignError, FolderError, StoreError
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.design import Design, plain_weave, starter, uniaxial
from circuittex.results.store import load_study
from circuittex.study.ensemble import run_ensemble
from circuittex.study.ensemble.page import page
from circuittex.study.ensemble.perturbation import member_design, perturbed
from circuittex.study.ensemble.start import member_starts
from circuittex.study.run import run_study

pytestmark = pytest.mark.xdist_group("ensemble_start")  # what its fixtures make serves one worker

TINY = plain_weave(yarns=2, rows=(1, 2), loading=(uniaxial("stretch", (0.02,)),))
TINY = replace(TINY, numerics=replace(TINY.numerics, elements=4), probes=(), terminals=())
STIFFER = replace(TINY, name="stiffer", contact=replace(TINY.contact, penalty=5.5), loading=())
SAME = 1e-7
"""Relative: energies of equilibria that are one, each within the tolerance of 2e-5, which enters an energy squared."""


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An ensemble of two members."""
    folder = tmp_path_factory.mktemp("source")
    with pytest.MonkeyPatch.context() as patch:
        compute_here(patch)
        assert run_ensemble(TINY, folder, members=2).failures == ("", "")
    return folder


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    return compute_here(monkeypatch)


def start_of(folder: Path, number: int) -> str:
    return load_study(folder / "members" / f"{number:04d}").start


def test_each_member_starts_from_its_own_state_and_saves_iterations(
    here: list[str], source: Path, tmp_path: Path
) -> None:
    """A member that the other ensemble lacks starts from its initial weave, to where it goes by itself."""
    found = run_ensemble(STIFFER, tmp_path, members=3, start=str(source))
    assert found.failures == ("", "", "")
    for number in range(2):
        there = load_study(source / "members" / f"{number:04d}")
        study = load_study(tmp_path / "members" / f"{number:04d}")
        assert study.start == f"state relaxed of {TINY.name!r}, design {there.design_hash}"
        # with the same packings the initial weaves are one, so that the start is the state itself
        np.testing.assert_allclose(study.initial.x, there.records[0].configuration.x, rtol=0, atol=1e-14)
        direct = run_study(member_design(perturbed(STIFFER), number))
        assert study.records[0].iterations < direct.records[0].iterations / 2
        assert study.records[0].energy == pytest.approx(direct.records[0].energy, rel=SAME)
    assert start_of(tmp_path, 2) == "initial"
    head = json.loads((source / "ensemble.json").read_text())
    words = f"members' state relaxed of {TINY.name!r}, design {head['design_hash']}"
    assert (found.start, json.loads((tmp_path / "ensemble.json").read_text())["start"]) == (words, words)
    assert "members&#39; state relaxed" in page(found, {})
    here.clear()
    assert run_ensemble(STIFFER, tmp_path, members=3, start=f"{source}:relaxed").seeds == found.seeds
    assert here == [], "what is finished is not computed again"
    with pytest.raises(FolderError, match="an ensemble with another start"):
        run_ensemble(STIFFER, tmp_path, members=3)


def test_a_folder_of_an_older_version_has_initial_starts(here: list[str], source: Path, tmp_path: Path) -> None:
    run_ensemble(STIFFER, tmp_path, members=1)
    path = tmp_path / "ensemble.json"
    kept = json.loads(path.read_text())
    assert kept.pop("start") == "initial"
    path.write_text(json.dumps(kept))
    here.clear()
    assert run_ensemble(STIFFER, tmp_path, members=1).start == "initial"
    assert here == []
    with pytest.raises(FolderError, match=r"another start \(initial, and this is members' state"):
        run_ensemble(STIFFER, tmp_path, members=1, start=str(source))


def refused(design: Design, out: Path, start: object) -> str:
    """The message, of one sentence, with which a start is refused; nothing is written."""
    with pytest.raises(DesignError) as error:
        run_ensemble(design, out, members=2, start=start)  # type: ignore[arg-type]
    assert not out.exists()
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.usefixtures("here")
def test_what_is_no_start_is_refused_before_any_work(source: Path, tmp_path: Path) -> None:
    out, member = tmp_path / "out", source / "members" / "0000"
    large = plain_weave(yarns=4, rows=(1,))
    for design in (STIFFER, large):
        assert "'tiled' is not usable; no cell repeats in a random packing" in refused(design, out, "tiled")
    assert "start: None is not usable; it must be 'initial' or FOLDER" in refused(STIFFER, out, None)
    for folder in (member, member / "results.h5", tmp_path / "nowhere"):
        assert "from one state all would find equilibria near that one" in refused(STIFFER, out, str(folder))
    assert "none of these members has a state 'stretch-9' there" in refused(STIFFER, out, f"{source}:stretch-9")
    assert "a relaxed state, without strain" in refused(STIFFER, out, f"{source}:stretch-0.02")
    wide = replace(large, numerics=STIFFER.numerics)  # whose default twist is less, since its yarns are longer
    for other in (replace(STIFFER, packing=replace(perturbed(STIFFER).packing, seed=1)), wide):
        assert "its packings must be those of this ensemble" in refused(other, out, str(source))


@pytest.mark.usefixtures("here")
def test_other_fibrils_in_the_same_packings_are_refused(source: Path, tmp_path: Path) -> None:
    """The amplitudes may be stated, and then other yarns have the same."""
    single = plain_weave(yarns=2, rows=(1,))
    single = replace(single, numerics=STIFFER.numerics, packing=perturbed(TINY).packing)
    assert "its yarns must have as many fibrils" in refused(single, tmp_path / "out", str(source))


def test_a_damaged_member_is_not_passed_over(source: Path, tmp_path: Path) -> None:
    """It has a state that cannot be read: that is another thing than none."""
    copy = tmp_path / "members" / "0000"
    copy.mkdir(parents=True)
    (tmp_path / "ensemble.json").write_text((source / "ensemble.json").read_text())
    (copy / "results.h5").write_bytes(b"nothing")
    with pytest.raises(StoreError):
        member_starts(perturbed(STIFFER), str(tmp_path), range(2))


def test_the_command_hands_the_start_on(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "weave.toml"
    file.write_text(starter(), encoding="utf-8")
    words = ["ensemble", str(file), "--members", "2", "--out", str(tmp_path / "e"), "--quiet", "--start", "tiled"]
    assert main(words) == ExitCode.DESIGN
    assert "start: 'tiled' is not usable" in capsys.readouterr().err
