"""What a study is said to take before it begins, and that one which is too large never does."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from canned import Canned, canned_study, files
from small_design import SMALL

import circuittex.relaxation.cost as cost_module
import circuittex.solvers.cholesky as cholesky
import circuittex.solvers.elimination_tree as elimination_tree
import circuittex.study.forecast as forecast_module
from circuittex.base import memory
from circuittex.base.arrays import Floats
from circuittex.base.errors import CircuittexWarning, SizeError
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.design import Design, plain_weave
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.pattern import DOFS
from circuittex.mech.system import System
from circuittex.relaxation.cost import Cost, Size, measured_cost
from circuittex.relaxation.relax import WORTH_A_DESCENT, relax
from circuittex.solvers.cholesky import Cholesky
from circuittex.study.forecast import (
    Forecast,
    expected_iterations,
    forecast,
    foresee,
    memory_of,
    seconds,
)
from circuittex.study.rest import ENOUGH, Rest
from circuittex.study.run import run_study

STUDY = canned_study(3)


def crossing() -> Design:
    """One crossing of two yarns of ten fibrils: contacts, and fronts above one another."""
    design = plain_weave(yarns=1)
    return replace(design, numerics=replace(design.numerics, elements=4))


@pytest.fixture(scope="module")
def cell() -> tuple[Design, FibrilMesh, Cost]:
    design = crossing()
    mesh = build_mesh(design)
    return design, mesh, measured_cost(mesh, design, initial_configuration(mesh))


def made_up(nodes: int, seconds: float = 1.0) -> Cost:
    """A cost in which every part takes so many seconds."""
    return Cost(Size(nodes, 400 * nodes, 4000 * nodes), seconds, seconds, seconds, seconds, seconds)


# Sizes


def test_sizes_are_those_of_the_relaxation_itself(
    cell: tuple[Design, FibrilMesh, Cost], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its first pattern has as many entries, and its first factor holds as many values, to the last one."""
    design, mesh, cost = cell
    entries: list[int] = []
    held: list[int] = []
    renew, factor = System._renew, Cholesky.factor

    def watched(self: System, q: Floats) -> None:
        renew(self, q)
        assert self.pattern is not None
        entries.append(self.pattern.nnz)

    def watched_factor(self: Cholesky, values: Floats) -> cholesky.Solve | None:
        held.append(len(self._values))
        return factor(self, values)

    monkeypatch.setattr(System, "_renew", watched)
    monkeypatch.setattr(Cholesky, "factor", watched_factor)
    relax(mesh, design)
    assert cost.size == (mesh.n_nodes, entries[0], held[0])


def test_values_of_the_factor_are_those_that_elimination_fills(
    cell: tuple[Design, FibrilMesh, Cost], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unknown by unknown in a dense table of what is coupled, where fronts take in no others to save time: a front of
    the p = 3 or 6 unknowns of a block holds p^2 values of its triangle in place of p (p + 1) / 2, and all others are
    there."""
    design, mesh, real_cost = cell
    monkeypatch.setattr(elimination_tree, "FRONT", 0.0)
    monkeypatch.setattr(elimination_tree, "ADDITION", 0.0)
    found: list[Any] = []
    real = cost_module.analysed
    monkeypatch.setattr(cost_module, "analysed", lambda *a: found.extend([*a, real(*a)]) or found[-1])
    cost = measured_cost(mesh, design, initial_configuration(mesh))
    pattern, coupled, analysis = found
    n = DOFS * mesh.n_nodes
    rows, place = np.repeat(np.arange(n), np.diff(pattern.indptr)), np.argsort(analysis.permutation)
    i, j = place[rows[coupled.entries]], place[pattern.indices[coupled.entries]]
    filled = np.zeros((n, n), dtype=bool)
    filled[np.minimum(i, j), np.maximum(i, j)] = True
    for k in range(n):
        later = k + 1 + np.flatnonzero(filled[k, k + 1 :])
        filled[np.ix_(later, later)] = True
    values = int(np.triu(filled).sum())
    assert cost.size.factor == values + mesh.n_nodes * (3 + 15)
    assert real_cost.size.factor > cost.size.factor


def test_entries_are_known_before_the_matrix_and_its_factor(cell: tuple[Design, FibrilMesh, Cost]) -> None:
    design, mesh, cost = cell
    asked: list[Size] = []
    measured_cost(mesh, design, initial_configuration(mesh), asked.append)
    assert asked == [cost.size._replace(factor=0), cost.size]


def test_memory_counts_every_entry_and_value() -> None:
    """Beside a process itself; twice the entries and values are twice the bytes. Values that were not counted count
    for less than those that were."""
    small, large = Size(10, 10**6, 10**7), Size(20, 2 * 10**6, 2 * 10**7)
    assert memory_of(large) - memory_of(Size(0, 0, 0)) == pytest.approx(
        2 * (memory_of(small) - memory_of(Size(0, 0, 0)))
    )
    assert memory_of(small) > 8 * (small.factor + small.entries)
    assert memory_of(small._replace(factor=0)) < memory_of(small)


@pytest.mark.parametrize(
    ("size", "peak"),
    [
        (Size(3280, 1_257_480, 8_140_311), 0.571e9),
        (Size(12960, 5_070_384, 42_665_328), 1.594e9),
        (Size(51520, 20_362_464, 212_831_325), 5.806e9),
    ],
)
def test_memory_is_that_of_measured_weaves(size: Size, peak: float) -> None:
    """4 x 4, 8 x 8 and 16 x 16 yarns (docs/benchmarks.md). A quarter is less than what `TRUSTED` leaves for errors."""
    assert memory_of(size) == pytest.approx(peak, rel=0.25)


# Seconds


@pytest.mark.parametrize("unknowns", [1800, WORTH_A_DESCENT])
def test_iterations_grow_with_the_root_of_the_unknowns(unknowns: int) -> None:
    assert expected_iterations(4 * unknowns) == pytest.approx(2 * expected_iterations(unknowns))


@pytest.mark.parametrize("unknowns", [7560, WORTH_A_DESCENT + DOFS])
def test_a_machine_half_as_fast_takes_twice_as_long(unknowns: int) -> None:
    fast, slow = (forecast(made_up(unknowns // DOFS, seconds), True, 10.0, 1, None) for seconds in (0.5, 1.0))
    assert (slow.first, slow.step) == pytest.approx((2 * fast.first, 2 * fast.step))
    assert slow.memory == fast.memory


def test_a_descent_by_gradients_counts_where_there_is_one() -> None:
    """There an iteration costs a gradient and a solution in place of all parts."""
    cost = made_up(WORTH_A_DESCENT // DOFS + 1)
    dear = replace(cost, gradient=2 * cost.gradient)
    assert seconds(dear, 100.0, 4.0) - seconds(cost, 100.0, 4.0) == pytest.approx(100 * cost.gradient)
    cost = made_up(1000)
    assert seconds(replace(cost, gradient=9.0), 10.0, 4.0) == seconds(cost, 10.0, 4.0)


def test_workers_share_cores_and_add_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two on two cores: each is slower than one alone, both together are faster; each needs its memory."""
    monkeypatch.setattr(forecast_module, "available_cores", lambda: 2)
    cost = made_up(1000)
    alone, both = (forecast(cost, True, 10.0, workers, None) for workers in (1, 2))
    assert alone.step < both.step < 2 * alone.step
    assert alone.first == both.first
    assert 2 * alone.memory < both.memory < 3 * alone.memory
    scarce = forecast(cost, True, 10.0, 2, int(1.5 * alone.memory))
    assert (scarce.workers, scarce.step, scarce.memory) == (1, alone.step, alone.memory)


def test_a_relaxed_state_that_is_there_takes_no_time() -> None:
    assert forecast(made_up(1000), False, 10.0, 1, None).first == 0.0


# The words, and how they are corrected


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.mark.parametrize("factor", [0.1, 1.0, 10.0])
def test_a_wrong_forecast_is_corrected_as_states_are_finished(factor: float) -> None:
    """A step takes `factor` times what was foreseen, the relaxed state what was foreseen: each of the first steps
    corrects its part, and from then on the rate of the run itself counts and nothing else."""
    clock = Clock()
    foreseen = Forecast(first=300.0, step=100.0, workers=1, memory=1e9)
    rest = Rest(Counter({"": 1, "stretch": 10}), 11, 1, lambda _: None, clock, foreseen)
    assert rest.seconds() == pytest.approx(300.0 + 10 * 100.0)
    clock.now += 300.0
    rest.done("")
    wrong = []
    for state in range(1, 10):
        clock.now += factor * 100.0
        rest.done("stretch")
        wrong.append(abs(rest.seconds() / (factor * 100.0 * (10 - state)) - 1.0))
    assert wrong[ENOUGH - 1 :] == pytest.approx([0.0] * (10 - ENOUGH), abs=1e-12)
    assert np.all(np.diff(wrong) <= 1e-12), "never worse than before"


def test_what_the_relaxed_state_takes_corrects_the_steps() -> None:
    """A machine three times slower than it seemed at the start is so for every state."""
    clock = Clock()
    rest = Rest(Counter({"": 1, "a": 4, "b": 4}), 9, 2, lambda _: None, clock, Forecast(100.0, 60.0, 2, 1e9))
    assert rest.seconds() == pytest.approx(100.0 + 4 * 60.0)
    clock.now = 50.0
    assert rest.words() == "; 0/9, ~5 min left"
    clock.now = 200.0
    assert rest.seconds() == pytest.approx(4 * 2 * 60.0), "it is late already: so will be the others"
    clock.now = 300.0
    rest.done("")
    assert rest.seconds() == pytest.approx(4 * 3 * 60.0)


def test_a_relaxed_state_that_an_earlier_run_began_says_nothing_of_the_steps() -> None:
    clock, foreseen = Clock(), Forecast(100.0, 60.0, 1, 1e9)
    rest = Rest(Counter({"": 1, "a": 4}), 5, 1, lambda _: None, clock, foreseen, partly=True)
    clock.now = 10.0
    rest.done("")
    assert rest.seconds() == pytest.approx(4 * 60.0)


def test_fewer_workers_than_were_asked_for_are_told() -> None:
    rest = Rest(Counter({"a": 2, "b": 2}), 9, 4, lambda _: None, lambda: 0.0, Forecast(0.0, 60.0, 1, 4e9))
    assert rest.opening() == "about 4 min, 4.0 GB; 4 states, by 1 instead of 2 workers for want of memory"


def test_the_line_comes_first_and_moments_are_not_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Canned(STUDY).install(monkeypatch)
    measured: list[int] = []
    real = measured_cost
    monkeypatch.setattr(forecast_module, "measured_cost", lambda *a: measured.append(1) or real(*a))
    said: list[str] = []
    run_study(STUDY.design, tmp_path / "moments", workers=1, progress=said.append)
    assert (said[0], measured) == ("under a minute; 5 states\n", [])
    said.clear()
    monkeypatch.setattr(forecast_module, "MOMENTS", 0.0)
    run_study(STUDY.design, tmp_path / "measured", workers=1, progress=said.append)
    assert re.fullmatch(r"about \d+ (s|min), 0\.3 GB; 5 states\n", said[0])
    assert said[1].startswith("relaxed: iteration 1; 0/5")
    said.clear()
    run_study(STUDY.design, tmp_path / "measured", workers=1, progress=said.append)
    assert said[0] == "5 of 5 states are there already\n"
    assert len(measured) == 2, "a tiny weave to load what is compiled, and the design once"


# Too large


def test_a_design_that_is_far_too_large_is_refused_before_anything_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before its contacts are searched, and before results that are there are removed."""
    canned = Canned(STUDY).install(monkeypatch)
    run_study(STUDY.design, tmp_path, workers=1)
    before, done = files(tmp_path), len(canned.reached)
    monkeypatch.setattr(forecast_module, "available_memory", lambda: 100_000_000)
    monkeypatch.setattr(forecast_module, "measured_cost", None)
    with pytest.raises(SizeError, match=r"at least 0\.3 GB of memory, and 0\.1 GB are available; reduce") as refused:
        run_study(STUDY.design, tmp_path, workers=1, fresh=True)
    for word in ("numerics.elements", "fibrils of a yarn (1)", "yarns (4 x 4)"):
        assert word in str(refused.value)
    assert (files(tmp_path), len(canned.reached)) == (before, done)
    run_study(STUDY.design, tmp_path, workers=1)  # nothing to compute, and so nothing that is too large
    with pytest.raises(SizeError):
        run_study(STUDY.design, tmp_path / "new", workers=1)
    assert files(tmp_path / "new") == set(), "nor is a study begun, for which a start may have to be computed"


def test_a_factor_that_is_too_large_is_never_made(
    cell: tuple[Design, FibrilMesh, Cost], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its values are counted first. What is known before would just have passed."""
    design, _, cost = cell
    needed = memory_of(cost.size)
    monkeypatch.setattr(forecast_module, "MOMENTS", 0.0)
    monkeypatch.setattr(forecast_module, "available_memory", lambda: int(needed / forecast_module.TRUSTED) - 1)
    made: list[int] = []

    class Watched(Cholesky):
        def __init__(self, analysis: object) -> None:
            super().__init__(analysis)  # type: ignore[arg-type]
            made.append(self.analysis.size)

    monkeypatch.setattr(cost_module, "Cholesky", Watched)
    monkeypatch.setattr("circuittex.study.schedule.reach", None)
    with pytest.raises(SizeError, match=r"about 0\.3 GB"):
        run_study(design, workers=1)
    assert cost.size.factor not in made
    assert len(made) == 1, "the tiny weave's"


def test_what_may_be_too_large_by_an_estimate_is_tried(
    cell: tuple[Design, FibrilMesh, Cost], monkeypatch: pytest.MonkeyPatch
) -> None:
    design, mesh, cost = cell
    study = replace(STUDY, design=design, mesh=mesh, initial=initial_configuration(mesh), records=())
    monkeypatch.setattr(forecast_module, "MOMENTS", 0.0)
    monkeypatch.setattr(forecast_module, "available_memory", lambda: int(memory_of(cost.size)) - 1)
    with pytest.warns(CircuittexWarning, match=r"needs about 0\.3 GB of memory, and 0\.3 GB are available"):
        assert foresee(study, 1) is not None
    monkeypatch.setattr(forecast_module, "available_memory", lambda: None)
    assert foresee(study, 1) is not None, "where nothing is known nothing is refused"


def test_the_command_line_says_it_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "small.toml").write_text(SMALL, encoding="utf-8")
    monkeypatch.setattr(forecast_module, "available_memory", lambda: 1)
    assert main(["run", str(tmp_path / "small.toml"), "--out", str(tmp_path / "out"), "--quiet"]) == ExitCode.DESIGN
    text = capsys.readouterr().err
    assert text.startswith("circuittex: error: Small study: it needs at least 0.3 GB of memory, and 0.0 GB are avail")
    assert text.count("\n") == 1


# What there is


def test_available_memory_is_what_linux_says_up_to_the_limit_of_the_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    meminfo, limit = tmp_path / "meminfo", tmp_path / "memory.max"
    monkeypatch.setattr(memory, "MEMINFO", meminfo)
    monkeypatch.setattr(memory, "LIMITS", (limit, tmp_path / "none"))
    meminfo.write_text("MemTotal:  24000000 kB\nMemAvailable:   18000000 kB\n")
    assert memory.available_memory() == 18_000_000 * 1024
    limit.write_text("max\n")
    assert memory.available_memory() == 18_000_000 * 1024
    limit.write_text("4294967296\n")
    assert memory.available_memory() == 4 * 2**30


def test_elsewhere_it_is_what_is_built_in_or_unknown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "MEMINFO", tmp_path / "none")
    monkeypatch.setattr("os.sysconf", lambda name: {"SC_PHYS_PAGES": 1000, "SC_PAGE_SIZE": 4096}[name], raising=False)
    assert memory.available_memory() == 4_096_000
    monkeypatch.delattr("os.sysconf")
    assert memory.available_memory() is None
