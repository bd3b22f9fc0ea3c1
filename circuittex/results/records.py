"""The results of a study: one `Record` for each recorded state, and the `Study` that holds them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState
from circuittex.design import Design
from circuittex.electrical.fields import Fields
from circuittex.electrical.network.ports import PortMatrix
from circuittex.fit import Fit
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.results.bifurcation import BranchCheck
from circuittex.results.discretisation import ErrorEstimate
from circuittex.results.outcome import Outcome, outcome
from circuittex.results.verification import Verification

INITIAL = "initial"
"""The start of a study that begins with the initial weave, as all do that are not told otherwise."""


@frozen
class Record:
    """Everything that is kept of one recorded equilibrium."""

    name: str
    """For example 'relaxed' or 'stretch-0.05'."""
    loading: str
    """Name of the loading path that led here; empty for the relaxed state."""
    strain: float
    """The strain that labels the state."""
    gradient: Floats
    """(2, 2) average in-plane deformation gradient from the relaxed state."""
    configuration: Configuration
    """Centre lines and directors at equilibrium."""
    residual: float
    """Largest free-dof force, N."""
    iterations: int
    """Iterations spent on this state, those of tries that did not converge included."""
    parts: int
    """Parts into which the increment to this state was halved; 1 where it converged as a whole."""
    history: Floats
    """(n, 4) per iteration of the last part: residual, energy, shift (`minimise`), step length [N, N mm, 1, 1]."""
    clamp_force: Floats
    """(2, 3) total force of the clamps on the +x ends of the warp and the +y ends of the weft, N [40, 41]."""
    end_force: Floats
    """(2F, 3) force of the clamps on each fibril end, in the order of `FibrilMesh.ends`, N; zero at ends that are not
    held, up to the residual."""
    energy: float
    """Stored elastic and contact energy, N mm."""
    section_force: Floats
    """(M,) magnitude of the section force |∫ P E3 dA| in each element, N."""
    contacts: ContactState
    """The contact state at full resolution."""
    fields: tuple[Fields, ...]
    """Potential and temperature for each probe, at full resolution."""
    fit: Fit
    """Reduced network fitted to the probe currents."""
    reduced_difference: float
    """Largest relative difference of the reduced network's probe currents between the fit and ngspice; nan where
    ngspice did not check it."""
    verification: Verification
    """How the routes to the currents and voltages agree."""
    field_convergence: Floats
    """(3, 2) node distance and largest relative current error [mm, 1] of the field on the mechanical mesh and on two
    refinements of it, against the circuit; (0, 2) where it was not studied."""
    levels: int
    """Levels in which the fibrils of the centre warp yarn lie at its centre crossing."""
    netlist: str
    """File of the detailed sub-circuit, relative to the results folder (if the study has one)."""
    ports: PortMatrix = PortMatrix()
    """The exact reduction of the circuit with merged contacts to the yarn ends."""

    @property
    def reaction(self) -> Floats:
        """(N, 3) force of the clamps on each node, N: that on the fibril ends, and zero inside."""
        reaction = np.zeros_like(self.configuration.r)
        reaction[self.contacts.mesh.ends] = self.end_force
        return reaction

    @property
    def currents(self) -> tuple[float, ...]:
        """Current of each probe into its source terminal, A."""
        return tuple(float(f.currents[0]) for f in self.fields)

    def driven(self, design: Design) -> Design:
        """The design with all probes driven by voltages: those that had them in this state, in place of what is stated
        of others."""
        if all(probe.voltage for probe in design.probes):
            return design
        pairs = zip(design.probes, self.fields, strict=True)
        return replace(design, probes=tuple(probe.at(field.voltage) for probe, field in pairs))

    @property
    def outcome(self) -> Outcome:
        """The numbers by which equilibria are told apart."""
        return outcome(self.clamp_force, self.currents, self.fit, self.energy)

    @property
    def peak_temperature(self) -> float:
        """Largest temperature rise over all probes, K."""
        return max((f.peak_temperature for f in self.fields), default=float("nan"))


@frozen
class Study:
    """A design and the states recorded for it."""

    version: str
    """Version of circuittex that computed it."""
    design: Design
    """What was computed."""
    design_hash: str
    """Hash of the design, as written in the netlists."""
    mesh: FibrilMesh
    """The fibrils."""
    initial: Configuration
    """The configuration before the first relaxation: the initial weave, or another start."""
    records: tuple[Record, ...]
    """The recorded states: the relaxed one, then loading by loading in the order of the design."""
    errors: tuple[ErrorEstimate, ...] = ()
    """Estimated discretisation errors, in the order of their states; not every state has one."""
    branches: tuple[BranchCheck, ...] = ()
    """Whether round-off chose the branch, in the order of the states; not every state has been checked."""
    start: str = INITIAL
    """Where the first relaxation started: 'initial', the initial weave, or another start in words."""

    def error_of(self, state: str) -> ErrorEstimate | None:
        """The error estimate of a state, if it has one."""
        return next((estimate for estimate in self.errors if estimate.state == state), None)

    def check_of(self, state: str) -> BranchCheck | None:
        """The check of a state's branch, if there is one."""
        return next((check for check in self.branches if check.state == state), None)

    def bifurcation_of(self, state: str) -> BranchCheck | None:
        """The check of a state's branch, if it found another one."""
        check = self.check_of(state)
        return check if check is not None and check.bifurcation else None


Examination = ErrorEstimate | BranchCheck
"""What is found out about a state after it was recorded, and names it."""
EXAMINATIONS: dict[type[Examination], str] = {ErrorEstimate: "errors", BranchCheck: "branches"}
"""Kind of examination -> the field of a `Study` that holds them."""


def with_examination(study: Study, examination: Examination) -> Study:
    """The study with one more examination, in the order of its states."""
    field = EXAMINATIONS[type(examination)]
    place = {record.name: number for number, record in enumerate(study.records)}
    found: list[Examination] = [*getattr(study, field), examination]
    changed: dict[str, Any] = {field: tuple(sorted(found, key=lambda each: place[each.state]))}
    return replace(study, **changed)
