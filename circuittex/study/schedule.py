"""What of a study can be computed at a moment, and the computation of all of it, path beside path."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from circuittex.base.errors import CircuittexError, ConvergenceError
from circuittex.base.workers import Computers
from circuittex.mech.configuration import Configuration
from circuittex.mech.linear import LinearSolver
from circuittex.relaxation.increment import Increment
from circuittex.results.records import Study
from circuittex.study.plan import Step, plan
from circuittex.study.record import Recorded, reach, record_state

Solver = Callable[[], LinearSolver]
"""Makes a linear solver; a function that pickle finds by its name."""


def compute(
    study: Study,
    computers: Computers,
    solver: Solver,
    keep: Callable[[Study, Recorded], Study],
    reached: Mapping[str, Increment] | None = None,
) -> Study:
    """The study with all states of its design: those that it has stay, the others follow from them.

    `reached` are equilibria that are known already and only to be recorded. `keep` adds a record to the study; it is
    called for each new one, for the relaxed state first and on every path in the order of its states. A path that
    fails does not keep the others from their end. The order of the study's records is that of `plan`.

    Raises, when the others are done, the `ConvergenceError` of the paths that failed.
    """
    computation = _Computation(study, computers, solver, keep, {step.name: step for step in plan(study.design)})
    computation.begin(reached or {})
    return computation.run()


@dataclass
class _Computation:
    """Where a computation stands. A state takes two tasks, to reach it and to record it, and what follows it can be
    reached while it is recorded."""

    study: Study
    computers: Computers
    solver: Solver
    keep: Callable[[Study, Recorded], Study]
    steps: dict[str, Step]
    start: dict[str, Configuration] = field(default_factory=dict)
    """States to reach, and where from."""
    reached: dict[str, Increment] = field(default_factory=dict)
    """States to record."""
    running: set[str] = field(default_factory=set)
    recorded: dict[str, Recorded] = field(default_factory=dict)
    """Records that wait for the one before them to be kept."""
    kept: set[str] = field(default_factory=set)
    failures: dict[str, CircuittexError] = field(default_factory=dict)

    def begin(self, reached: Mapping[str, Increment]) -> None:
        known = {record.name: record.configuration for record in self.study.records} | {"": self.study.initial}
        self.kept = set(known)
        for name, step in self.steps.items():
            if step.previous in known and name not in known and name not in reached:
                self.start[name] = known[step.previous]
        for name, increment in reached.items():
            self._follow(self.steps[name], increment)

    def run(self) -> Study:
        while self._submit():
            name, result = self.computers.next()
            self.running.discard(name)
            if isinstance(result, CircuittexError):
                self._fail(self.steps[name], result)
            elif isinstance(result, Increment):
                self._follow(self.steps[name], result)
            else:
                self.recorded[name] = result
                if self.computers.size > 1:
                    self._submit()  # nobody need wait while files are written
                self._keep()
        if self.failures:
            raise _joined([self.failures[name] for name in self.steps if name in self.failures])
        rank = {name: number for number, name in enumerate(self.steps)}
        return replace(self.study, records=tuple(sorted(self.study.records, key=lambda record: rank[record.name])))

    def _submit(self) -> bool:
        """Give every idle computer the task that comes first in the order of the states; False if all is done."""
        head = replace(self.study, records=())
        for name, step in self.steps.items():
            if len(self.running) == self.computers.size:
                break
            if name in self.reached:
                self.computers.submit(name, record_state, head, step, self.reached.pop(name))
            elif name in self.start:
                self.computers.submit(name, reach, head, step, self.start.pop(name), self.solver)
            else:
                continue
            self.running.add(name)
        return bool(self.running)

    def _follow(self, step: Step, increment: Increment) -> None:
        """Have the state recorded and those that start from it reached."""
        if not self._lost(step):
            self.reached[step.name] = increment
            for following in self.steps.values():
                if following.previous == step.name:
                    self.start[following.name] = increment.equilibrium.configuration

    def _keep(self) -> None:
        """Keep the records whose predecessors are kept."""
        for name, step in self.steps.items():
            if step.previous in self.kept and name in self.recorded:
                recorded = self.recorded.pop(name)
                # What comes from another process has brought a copy of the mesh.
                contacts = replace(recorded.record.contacts, mesh=self.study.mesh)
                recorded = replace(recorded, record=replace(recorded.record, contacts=contacts))
                self.study = self.keep(self.study, recorded)
                self.kept.add(name)

    def _fail(self, step: Step, error: CircuittexError) -> None:
        self.failures[step.name] = error
        for tasks in (self.start, self.reached):
            for name in [name for name in tasks if self._lost(self.steps[name])]:
                del tasks[name]

    def _lost(self, step: Step) -> bool:
        """Whether the state or one on the way to it failed."""
        while step.name not in self.failures and step.previous:
            step = self.steps[step.previous]
        return step.name in self.failures


def _joined(errors: list[CircuittexError]) -> CircuittexError:
    """One error for all paths that failed."""
    first = errors[0]
    if len(errors) == 1 or not isinstance(first, ConvergenceError):
        return first
    return ConvergenceError("; ".join(map(str, errors)), first.history)
