"""A first relaxation that is interrupted goes on from its last checkpoint and ends as any other, bit for bit."""

from __future__ import annotations

import errno
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from canned import files, report, untimed
from fabrics import small_cell

from circuittex.base.errors import CircuittexWarning
from circuittex.base.frozen import same
from circuittex.design import Clamps, Design, equal_steps, uniaxial
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech import descent, minimise
from circuittex.mech.checkpoint import Checkpoint, Checkpoints
from circuittex.mech.configuration import initial_configuration
from circuittex.relaxation.relax import Equilibrium, relax
from circuittex.relaxation.units import PLAIN, own_units
from circuittex.results.records import Study
from circuittex.study import unfinished as unfinished_module
from circuittex.study.run import run_study
from circuittex.study.unfinished import UNFINISHED, unfinished

pytestmark = pytest.mark.xdist_group("unfinished")  # what its fixtures make serves one worker

APART = 16
"""Iterations between checkpoints here: the cells take some 20 to 70."""
PATIENCE = 600.0
"""Seconds that a kernel may take to be compiled where the machine is busy."""


class Killed(BaseException):
    """The end of a process."""


@pytest.fixture
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    """Descents by gradients in small cells, and several checkpoints in each."""
    make_often(monkeypatch.setattr)


def make_often(put: Callable[[str, object], None]) -> None:
    put("circuittex.relaxation.relax.WORTH_A_DESCENT", 0)
    put("circuittex.mech.descent.LASTS", APART)
    put("circuittex.mech.descent.APART", APART)


def kept_by(design: Design, mesh: FibrilMesh) -> tuple[Equilibrium, list[Checkpoint]]:
    """A relaxation that nothing interrupts, and its checkpoints."""
    kept: list[Checkpoint] = []
    return relax(mesh, design, checkpoints=Checkpoints(keep=kept.append)), kept


def tell(told: list[tuple[int, float]], iteration: int, force: float) -> None:
    told.append((iteration, force))


def fine() -> Design:
    """A cell whose descent is made in units of its own fibrils."""
    design, _ = small_cell()
    kind = design.weave.warp[0]
    thin = replace(kind, radius=0.7 * kind.radius, spacing=0.7 * kind.spacing, row_spacing=0.7 * kind.row_spacing)
    return replace(design, weave=replace(design.weave, warp=(thin,) * 2, weft=(thin,) * 2))


def sliding() -> Design:
    return replace(small_cell()[0], clamps=Clamps(warp_force=0.02))


@pytest.mark.parametrize("cell", [lambda: small_cell()[0], fine, sliding])
def test_from_every_checkpoint_on_all_is_the_same(cell: Callable[[], Design], often: None) -> None:
    design = cell()
    mesh = build_mesh(design)
    assert same(own_units(mesh, design), PLAIN) == (cell is not fine)
    whole, kept = kept_by(design, mesh)
    assert same(whole, relax(mesh, design)), "whether somebody keeps them or not"
    assert [checkpoint.ended for checkpoint in kept] == [False] * (len(kept) - 1) + [True]
    assert len(kept) > 2
    assert np.all(np.diff([checkpoint.iteration for checkpoint in kept[:-1]]) >= APART)
    for checkpoint in kept:
        told: list[tuple[int, float]] = []
        following: list[Checkpoint] = []
        going_on = Checkpoints(checkpoint, following.append)
        found = relax(mesh, design, report=partial(tell, told), checkpoints=going_on)
        assert same(found, whole)
        assert told[0][0] == checkpoint.iteration
        assert same(tuple(following), tuple(kept[kept.index(checkpoint) + 1 :]))


def test_a_descent_that_gives_up_is_not_done_again(often: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(minimise, "descend", lambda *a, **k: descent.descend(*a, **(k | {"max_iterations": 24})))
    design, mesh = small_cell()
    whole, kept = kept_by(design, mesh)
    assert [(checkpoint.iteration, checkpoint.ended) for checkpoint in kept] == [(APART, False), (24, True)]
    assert len(whole.history) > 2, "Newton's method had something to do"
    for checkpoint in kept:
        assert same(relax(mesh, design, checkpoints=Checkpoints(checkpoint)), whole)


def test_what_is_remembered_would_show(often: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Candidates searched elsewhere and another order of elimination round otherwise: so they are forgotten."""
    monkeypatch.setattr(descent, "begin_anew", lambda system, solver: None)
    design, mesh = small_cell()
    whole, kept = kept_by(design, mesh)
    assert not all(same(relax(mesh, design, checkpoints=Checkpoints(checkpoint)), whole) for checkpoint in kept)


def test_small_cells_have_no_checkpoints() -> None:
    design, mesh = small_cell()
    assert kept_by(design, mesh)[1] == []


# Studies


def cell() -> Design:
    """Three fibrils a yarn without probes, stretched in one step."""
    design, _ = small_cell(section_degree=6)
    return replace(design, terminals=(), probes=(), loading=(uniaxial("stretch", equal_steps(0.02, 1)),))


@pytest.fixture
def quick(often: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("circuittex.study.folder.write_report", report)


def killed_after(number: int, folder: Path, **options: object) -> None:
    """A run that ends when so many checkpoints are on the disk."""
    with pytest.MonkeyPatch.context() as patch:
        keep, count = unfinished_module._keep, [0]

        def killing(*arguments: object) -> None:
            keep(*arguments)  # type: ignore[arg-type]
            count[0] += 1
            if count[0] == number:
                raise Killed

        patch.setattr(unfinished_module, "_keep", killing)
        with pytest.raises(Killed):
            run_study(cell(), folder, **options)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def whole() -> Study:
    with pytest.MonkeyPatch.context() as patch:
        make_often(patch.setattr)
        return untimed(run_study(cell(), workers=1))


@pytest.mark.parametrize("workers", [1, 2])
def test_a_run_that_is_killed_again_and_again(workers: int, whole: Study, quick: None, tmp_path: Path) -> None:
    said: list[str] = []
    for time_ in range(3):
        killed_after(1, tmp_path, workers=workers, progress=said.append)
        assert [text for text in said if "goes on" in text] == [
            f"the first relaxation goes on from iteration {APART * k}\n" for k in range(1, time_ + 1)
        ]
        assert files(tmp_path) == {"results.h5", UNFINISHED}
    assert same(untimed(run_study(cell(), tmp_path, workers=workers, progress=said.append)), whole)
    assert sum("relaxed: iteration 0," in text for text in said) == 1
    assert not (tmp_path / UNFINISHED).exists()


def test_starting_again_starts_from_the_beginning(whole: Study, quick: None, tmp_path: Path) -> None:
    killed_after(2, tmp_path, workers=1)
    (tmp_path / f"{UNFINISHED}.partial").touch()
    said: list[str] = []
    assert same(untimed(run_study(cell(), tmp_path, workers=1, fresh=True, progress=said.append)), whole)
    assert any("relaxed: iteration 0," in text for text in said)
    assert not any("goes on" in text for text in said)
    assert not any("circuittex" in name for name in files(tmp_path))


def test_what_a_kill_left_behind_the_state_goes(quick: None, tmp_path: Path) -> None:
    """The end came after the state was recorded and before the file was removed."""
    run_study(cell(), tmp_path, workers=1)
    (tmp_path / UNFINISHED).touch()
    run_study(cell(), tmp_path, workers=1)
    assert not (tmp_path / UNFINISHED).exists()


RUN = """
import sys
sys.path.insert(0, sys.argv[1])
from importlib import import_module
import test_unfinished
def put(place, value):
    module, name = place.rsplit(".", 1)
    setattr(import_module(module), name, value)
test_unfinished.make_often(put)
put("circuittex.study.folder.write_report", test_unfinished.report)
keep = test_unfinished.unfinished_module._keep
def slowly(*arguments):
    keep(*arguments)
    test_unfinished.time.sleep(0.3)  # for the signal to come before the end, however busy the machine is
test_unfinished.unfinished_module._keep = slowly
test_unfinished.run_study(test_unfinished.cell(), sys.argv[2], workers=1)
"""


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM])
def test_a_process_that_is_killed(end: signal.Signals, whole: Study, quick: None, tmp_path: Path) -> None:
    kept, deadline = tmp_path / UNFINISHED, time.monotonic() + PATIENCE
    with subprocess.Popen([sys.executable, "-c", RUN, str(Path(__file__).parent), str(tmp_path)]) as process:
        while not kept.exists():
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.01)
        process.send_signal(end)
        assert process.wait(PATIENCE) == -end
    said: list[str] = []
    assert same(untimed(run_study(cell(), tmp_path, workers=1, progress=said.append)), whole)
    assert any("goes on from iteration" in text for text in said)


# What is not used


def marked(folder: Path, **other: str) -> Checkpoint | None:
    """What is found in the folder by a study with these marks."""
    design, mesh = small_cell()
    study = Study(
        version=other.get("version", "1"),
        design=design,
        design_hash=other.get("design", "abc"),
        mesh=mesh,
        initial=initial_configuration(mesh),
        records=(),
    )
    if "start" in other:
        study = replace(study, initial=replace(study.initial, x=study.initial.x + 1e-9))
    checkpoints = unfinished(folder, study, other.get("solver", "own"), lambda _: None)
    if not other and checkpoints.reached is None and not (folder / UNFINISHED).exists():
        assert checkpoints.keep is not None
        q = study.initial.x.ravel()
        checkpoints.keep(Checkpoint(q, np.ones((2, len(q))), np.ones((2, len(q))), np.ones(2), 0.1, 0.2, 120, False))
    return checkpoints.reached


def test_what_was_kept_comes_back(tmp_path: Path) -> None:
    assert marked(tmp_path) is None
    found = marked(tmp_path)
    assert found is not None
    assert (found.shift, found.most, found.iteration, found.ended) == (0.1, 0.2, 120, False)
    assert found.steps.shape == found.turns.shape == (2, len(found.q))


@pytest.mark.parametrize("what", ["version", "design", "start", "solver"])
def test_that_of_something_else_is_not_used(what: str, tmp_path: Path) -> None:
    marked(tmp_path)
    with pytest.warns(CircuittexWarning, match=f"it is of another {what}, and the first relaxation starts from its"):
        assert marked(tmp_path, **{what: "other"}) is None


def shortened(data: bytes) -> bytes:
    return data[: len(data) // 2]


def flipped(data: bytes) -> bytes:
    """A bit of the unknowns is another; a checksum tells."""
    place = data.index(b"q.npy") + 500
    return data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :]


@pytest.mark.parametrize(
    "spoil", [shortened, flipped, lambda data: b"", lambda data: b"text", lambda data: bytes(9999)]
)
def test_a_damaged_one_is_not_used(spoil: Callable[[bytes], bytes], tmp_path: Path) -> None:
    marked(tmp_path)
    path = tmp_path / UNFINISHED
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.warns(CircuittexWarning, match="cannot be read"):
        assert marked(tmp_path) is None


def test_one_of_another_shape_is_not_used(tmp_path: Path) -> None:
    marked(tmp_path)
    path = tmp_path / UNFINISHED
    with np.load(path) as file:
        values = dict(file)
    np.savez(path, **values | {"q": values["q"][:-9]})
    with pytest.warns(CircuittexWarning, match=r"unknowns in place of"):
        assert marked(tmp_path) is None


def test_a_run_beside_a_damaged_one_starts_from_the_beginning(whole: Study, quick: None, tmp_path: Path) -> None:
    killed_after(1, tmp_path, workers=1)
    (tmp_path / UNFINISHED).write_bytes(b"damaged")
    with pytest.warns(CircuittexWarning, match="cannot be read"):
        found = run_study(cell(), tmp_path, workers=1)
    assert same(untimed(found), whole)


def test_a_disk_that_is_full_costs_no_result(
    whole: Study, quick: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(unfinished_module.np, "savez", full)
    with pytest.warns(CircuittexWarning, match=r"No space left on device; should this run be interrupted"):
        found = run_study(cell(), tmp_path, workers=1)
    assert same(untimed(found), whole)
    assert not any("circuittex" in name for name in files(tmp_path))
