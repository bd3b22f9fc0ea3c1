"""A study whose states are made up beforehand: what a run does around its computations, without their time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest
from synthetic_study import synthetic_study

from circuittex import __version__
from circuittex.base.arrays import Floats
from circuittex.base.frozen import same
from circuittex.mech.checkpoint import NONE, Checkpoints
from circuittex.mech.configuration import Configuration
from circuittex.relaxation.increment import Increment
from circuittex.relaxation.relax import Equilibrium
from circuittex.results.records import Study
from circuittex.study.circuits import state_circuits
from circuittex.study.export import simplified
from circuittex.study.plan import Step, plan
from circuittex.study.record import Recorded


def canned_study(states: int = 3, loadings: tuple[str, ...] = ("stretch", "shear")) -> Study:
    """The relaxed state and `states` - 1 on each loading, named as a run names them."""
    study = synthetic_study(states, contacts=10, rows=(1,), loadings=loadings)
    steps = plan(study.design)
    records = tuple(
        replace(record, name=step.name, netlist=f"netlists/{step.name}.sub")
        for step, record in zip(steps, study.records, strict=True)
    )
    return replace(study, version=__version__, records=records)


class Canned:
    """Stands for the tasks of a study and knows their results; checks what each of them is given."""

    def __init__(self, study: Study) -> None:
        self.study = study
        self.records = {record.name: record for record in study.records}
        self.reached: list[str] = []
        """Names of the states that were computed."""
        self.before: Callable[[str], None] = lambda name: None
        """Called before a state is reached."""

    def reach(
        self,
        study: Study,
        step: Step,
        start: Configuration,
        solver: object,
        say: Callable[[str], None],
        checkpoints: Checkpoints = NONE,
    ) -> Increment:
        assert study.records == ()
        known = self.records[step.previous].configuration if step.previous else self.study.initial
        assert same(start, known)
        say(f"{step.name}: iteration 1")
        self.before(step.name)
        self.reached.append(step.name)
        return increment(self.records[step.name].configuration)

    def record_state(self, study: Study, step: Step, reached: Increment, say: Callable[[str], None]) -> Recorded:
        record = self.records[step.name]
        assert same(reached.equilibrium.configuration, record.configuration)
        design = study.design
        return Recorded(record, state_circuits(simplified(design, record.contacts), design.terminals, design.probes))

    def install(self, monkeypatch: pytest.MonkeyPatch) -> Canned:
        """Take the place of the computations and of the report, whose drawing takes long."""
        for module in ("study.run", "study.schedule"):
            monkeypatch.setattr(f"circuittex.{module}.reach", self.reach)
        monkeypatch.setattr("circuittex.study.schedule.record_state", self.record_state)
        monkeypatch.setattr("circuittex.study.folder.write_report", report)
        return self


def increment(configuration: Configuration) -> Increment:
    nothing: Floats = configuration.r * 0.0
    return Increment(Equilibrium(configuration, nothing, nothing, 0.0, 0.0, 1, nothing), 1, 1)


def report(folder: Path, study: Study) -> None:
    (folder / "report.html").write_text(" ".join(record.name for record in study.records), encoding="utf-8")


def files(folder: Path) -> set[str]:
    """All files below `folder` but the lock's."""
    return {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and path.name != ".circuittex.lock"
    }


def untimed(study: Study) -> Study:
    """The study without the seconds that its verification took: all the rest repeats bit for bit."""
    none = {"fields_seconds": 0.0, "nodal_seconds": 0.0, "ngspice_seconds": 0.0}
    return replace(
        study,
        records=tuple(replace(record, verification=replace(record.verification, **none)) for record in study.records),
    )


def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports and data sheets without their pictures, which take longer than a small cell and have their own tests."""
    monkeypatch.setattr("circuittex.study.library.datasheet.save_figures", lambda *_: {})
    monkeypatch.setattr(import_module("circuittex.results.report.page"), "save_figures", lambda study, folder: {})
