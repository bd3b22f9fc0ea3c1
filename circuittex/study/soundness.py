"""Whether an equilibrium may be recorded: its fibrils in their order, and not too deep inside one another."""

from __future__ import annotations

from circuittex.base.arrays import Floats
from circuittex.base.errors import PenetrationError
from circuittex.contact.passing import likely_cause
from circuittex.contact.state import ContactState
from circuittex.geometry.mesh import pair_label
from circuittex.relaxation.sides import check_sides
from circuittex.results.records import Study
from circuittex.results.soundness import deepest_overlap
from circuittex.study.plan import Step


def check_sound(study: Study, step: Step, r: Floats, contacts: ContactState) -> None:
    """Refuse a state with nodes r (N, 3) whose fibrils passed through one another, or overlap beyond the limit.

    Raises `PenetrationError`, with one sentence that names the state, the pair and the likely cause.
    """
    mesh, design = study.mesh, study.design
    try:
        check_sides(mesh, design, r, step.after, step.free_edges)
    except PenetrationError as error:
        raise PenetrationError(f"{step.name}: {error}") from error
    overlap, first, second = deepest_overlap(contacts)
    if overlap >= design.numerics.overlap_limit:
        what = f"{pair_label(mesh, first, second)} overlap by {overlap:.2f} of R + R'"
        limit = f"a state is recorded below {design.numerics.overlap_limit:g} (numerics.overlap_limit)"
        raise PenetrationError(f"{step.name}: {what}, {limit}; {likely_cause(mesh, design.contact, first, second)}")
