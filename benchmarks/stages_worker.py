"""A process that runs stages of the paper's study when it is told to; `parts.py` starts it.

    python benchmarks/parts.py

Each line that it reads is a name of `parts.py`, or "off" for the paper's cell as it is, and a stage; it answers with
the stage's processor seconds and iterations. With the PYTHONPATH of an older version it measures that one: what is
imported here is in both.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from circuittex.contact.extract import contacts_of
from circuittex.design import Design, design_hash, plain_weave, uniaxial
from circuittex.electrical.fields import solve_probes
from circuittex.electrical.network.ports import port_matrix
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pattern import build_pattern
from circuittex.netlist import deck, subcircuit
from circuittex.relaxation.relax import force_terms
from circuittex.results.records import Study
from circuittex.study.circuits import state_circuits
from circuittex.study.export import simplified
from circuittex.study.plan import plan
from circuittex.study.record import reach, record_state

OFF = "off"
RELAXATION, STEP, ASSEMBLY, CONTACTS = "first relaxation", "step of 2.5 %", "assembly", "contacts"
FIELDS, CIRCUITS, NETLISTS, RECORDING = "fields", "circuits", "netlists", "recording"
STAGES = (RELAXATION, STEP, ASSEMBLY, CONTACTS, FIELDS, CIRCUITS, NETLISTS, RECORDING)


def cell() -> Design:
    """The paper's cell with one state of its loading path."""
    return plain_weave(loading=(uniaxial("stretch", (0.025,)),))


class Case:
    """A design and the states that it has been brought to; those of another where its mechanics are the same."""

    def __init__(self, design: Design, like: Case | None = None) -> None:
        mesh, self.like, self.relaxed, self.stretched = build_mesh(design), like, None, None
        self.study = Study(
            version="",
            design=design,
            design_hash=design_hash(design),
            mesh=mesh,
            initial=initial_configuration(mesh),
            records=(),
        )

    def __getitem__(self, stage: str) -> Callable[[], Any]:
        """What is timed of a stage; what it needs is made here, if it is not there."""
        study, design, mesh = self.study, self.study.design, self.study.mesh
        first, second = plan(design)
        if stage == RELAXATION:
            return lambda: self._keep("relaxed", reach(study, first, study.initial, MultifrontalSolver, _silent))
        before = self._state("relaxed", RELAXATION).equilibrium.configuration
        if stage == STEP:
            return lambda: self._keep("stretched", reach(study, second, before, MultifrontalSolver, _silent))
        if stage == ASSEMBLY:
            return self._assembly(before)
        stretched = self._state("stretched", STEP)
        if stage == RECORDING:
            return lambda: record_state(study, second, stretched, _silent)
        if stage == CONTACTS:
            return lambda: contacts_of(design, mesh, stretched.equilibrium.configuration)
        if stage == FIELDS:
            return lambda: solve_probes(self._contacts, design.terminals, design.probes)
        if stage == CIRCUITS:
            return self._circuits
        circuits = self._circuits()
        return lambda: (subcircuit(circuits.yarn_ends, "cell"), *(deck(each, _drive(each)) for each in circuits.probes))

    def _keep(self, name: str, state: Any) -> Any:
        setattr(self, name, state)
        return state

    def _state(self, name: str, stage: str) -> Any:
        of = self.like or self
        return getattr(of, name) or of[stage]()

    @cached_property
    def _contacts(self) -> Any:
        return self[CONTACTS]()

    def _circuits(self) -> Any:
        design = self.study.design
        circuits = state_circuits(simplified(design, self._contacts), design.terminals, design.probes)
        port_matrix(circuits.conducting)
        return circuits

    def _assembly(self, configuration: Any) -> Callable[[], Any]:
        """Energy, gradient and tangent of beams and contact at a state whose pattern is known."""
        space, *terms = force_terms(self.study.mesh, self.study.design)
        q = space.vector(configuration)
        for term in terms:
            term.prepare(q)
        full, point = (np.concatenate(pairs) for pairs in zip(*(term.pairs() for term in terms), strict=True))
        pattern = build_pattern(len(q) // 9, full, point, q.reshape(-1, 9)[:, :3].copy())

        def assembled() -> None:
            gradient, data, softening = np.zeros(len(q)), np.zeros(pattern.nnz), np.zeros(pattern.nnz)
            for term in terms:
                term.assemble(q, pattern, gradient, data, softening)

        return assembled


def timed(piece: Callable[[], Any]) -> tuple[float, int]:
    """Processor seconds of a piece, and its iterations where it has any."""
    clock = time.process_time()
    result = piece()
    return time.process_time() - clock, getattr(result, "iterations", 0)


def warm_up() -> None:
    """Every stage once on a small cell, so that what is compiled is there."""
    design = plain_weave(yarns=2, rows=(1,), loading=(uniaxial("stretch", (0.01,)),))
    case = Case(replace(design, numerics=replace(design.numerics, elements=4)))
    for stage in STAGES:
        case[stage]()


def _drive(circuit: Any) -> dict[str, float]:
    return {circuit.ports[0]: 1.0, circuit.ports[1]: 0.0}


def _silent(_: str) -> None:
    pass


def main() -> None:
    warm_up()
    cases = {OFF: Case(cell())}
    print(json.dumps("ready"), flush=True)
    for line in sys.stdin:
        part, stage = json.loads(line)
        if part not in cases:
            from parts import MECHANICAL, PARTS  # not of an older version

            design = PARTS[part](cell())
            cases[part] = Case(design, None if part in MECHANICAL else cases[OFF])
        print(json.dumps(timed(cases[part][stage])), flush=True)


if __name__ == "__main__":
    main()
