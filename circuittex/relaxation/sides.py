"""Whether fibrils are still on the sides of one another that they were woven to."""

from __future__ import annotations

from typing import Any

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import PenetrationError
from circuittex.contact.curve import CurveTable, curve_table
from circuittex.contact.passing import chords, likely_cause
from circuittex.design import Design
from circuittex.geometry.crossings import Lines, against_draft, beside, changed, woven
from circuittex.geometry.mesh import FibrilMesh, pair_label

REST = np.eye(2)


def check_sides(
    mesh: FibrilMesh, design: Design, r: Floats, gradient: Floats, free_edges: str = "", history: Any = ()
) -> None:
    """Refuse nodes r (N, 3) at which fibrils have passed through one another or slipped off one another's ends.

    `gradient` (2, 2) is the average one from the start to r; yarns along `free_edges`, 'x' or 'y', have free ends;
    `history` is that of the descent which led there, for the error.

    Raises `PenetrationError`, with one sentence that names the first pair and the likely cause.
    """
    wrong, gone = passed_through(mesh, design, r, gradient, free_edges)
    pairs = wrong if len(wrong) else gone
    if not len(pairs):
        return
    first, second = pairs[0].tolist()
    others = f" (and {len(pairs) - 1} other pairs)" if len(pairs) > 1 else ""
    if len(wrong):
        what, cause = (
            "have passed through one another or round an end",
            likely_cause(mesh, design.contact, first, second),
        )
    else:
        what, cause = (
            "do not cross any more: one has slipped off the other's end",
            "the cell is too small for that load",
        )
    raise PenetrationError(f"{pair_label(mesh, first, second)} {what}{others}; {cause}", history)


def passed_through(
    mesh: FibrilMesh, design: Design, r: Floats, gradient: Floats, free_edges: str = ""
) -> tuple[Ints, Ints]:
    """The pairs (K, 2) of fibrils that are not on the sides of one another that the draft says, and those that left it.

    Parallel ones are compared with the start, which is that of the mesh. The lines are seen in its plane, to which the
    inverse of the average gradient takes the clamped ends back. Fibrils with free ends may leave those that they cross,
    and go round parallel ones: such pairs are left out.
    """
    table, axis = curve_table(mesh), mesh.yarn_axis[mesh.yarn]
    start, now = _lines(mesh, table, mesh.position, REST), _lines(mesh, table, r, gradient)
    wrong, gone = against_draft(woven(now), np.array(design.weave.draft), mesh.yarn)
    parallel = changed(beside(start), beside(now))
    held = axis[parallel[:, 0]] != ("x", "y", "").index(free_edges)
    return np.concatenate([wrong, parallel[held]]), gone[: 0 if free_edges else None]


def _lines(mesh: FibrilMesh, table: CurveTable, r: Floats, gradient: Floats) -> Lines:
    """The contact curves as polylines, their plane moved back by the inverse of the gradient."""
    points = chords(table, r)
    many = points.shape[1] - 1
    stops = many * table.first_interval
    lines = np.insert(points[:, :-1].reshape(-1, 3), stops[1:], r[mesh.end_nodes(+1)], axis=0)
    lines[:, :2] = lines[:, :2] @ np.linalg.inv(gradient).T
    return Lines(lines, stops + np.arange(len(stops)), mesh.yarn_axis[mesh.yarn])
