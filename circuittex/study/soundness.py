"""Whether an equilibrium may be recorded: its fibrils in their order, and not too deep inside one another."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import PenetrationError
from circuittex.contact.curve import CurveTable, curve_table
from circuittex.contact.passing import chords, likely_cause
from circuittex.contact.state import ContactState
from circuittex.geometry.crossings import Lines, changed, drafted, windings
from circuittex.geometry.mesh import FibrilMesh, pair_label
from circuittex.results.records import Study
from circuittex.results.soundness import deepest_overlap
from circuittex.study.plan import Step


def check_sound(study: Study, step: Step, r: Floats, contacts: ContactState) -> None:
    """Refuse a state with nodes r (N, 3) whose fibrils passed through one another, or overlap beyond the limit.

    Raises `PenetrationError`, with one sentence that names the state, the pair and the likely cause.
    """
    mesh, numerics, law = study.mesh, study.design.numerics, study.design.contact
    wrong = passed_through(study, step, r)
    if len(wrong):
        first, second = wrong[0].tolist()
        others = f" (and {len(wrong) - 1} other pairs)" if len(wrong) > 1 else ""
        what = f"{pair_label(mesh, first, second)} have passed through one another{others}"
        raise PenetrationError(f"{step.name}: {what}; {likely_cause(mesh, law, first, second)}")
    overlap, first, second = deepest_overlap(contacts)
    if overlap >= numerics.overlap_limit:
        what = f"{pair_label(mesh, first, second)} overlap by {overlap:.2f} of R + R'"
        limit = f"a state is recorded below {numerics.overlap_limit:g} (numerics.overlap_limit)"
        raise PenetrationError(f"{step.name}: {what}, {limit}; {likely_cause(mesh, law, first, second)}")


def passed_through(study: Study, step: Step, r: Floats) -> Ints:
    """(K, 2) the pairs of fibrils that are not on the sides of one another that the draft says.

    Parallel ones are compared with the start. The lines are seen in its plane, to which the inverse of the average
    gradient takes the clamped ends back. Parallel fibrils with free ends may go round one another there: they are left
    out.
    """
    mesh = study.mesh
    axis, table = mesh.yarn_axis[mesh.yarn], curve_table(mesh)
    start = windings(_lines(mesh, table, study.initial.r, np.eye(2)))
    now = windings(_lines(mesh, table, r, step.after))
    woven = changed(drafted(np.array(study.design.weave.draft), mesh.yarn), now)
    beside = changed(start, now)
    held = axis[beside[:, 0]] != ("x", "y", "").index(step.free)
    return np.concatenate(
        [woven[axis[woven[:, 0]] != axis[woven[:, 1]]], beside[held & (axis[beside[:, 0]] == axis[beside[:, 1]])]]
    )


def _lines(mesh: FibrilMesh, table: CurveTable, r: Floats, gradient: Floats) -> Lines:
    """The contact curves as polylines, their plane moved back by the inverse of the gradient (2, 2)."""
    points = chords(table, r)
    inner, last = points[:, :-1].reshape(-1, 3), r[mesh.end_nodes(+1)]
    first = points.shape[1] - 1
    stops = first * table.first_interval
    lines = np.insert(inner, stops[1:], last, axis=0)
    lines[:, :2] = lines[:, :2] @ np.linalg.inv(gradient).T
    return Lines(lines, stops + np.arange(len(stops)), mesh.yarn_axis[mesh.yarn])
