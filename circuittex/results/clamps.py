"""What the clamps of the yarns come to: tension and extension of each yarn."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.results.records import Study

REST = np.eye(2)


def tensions(mesh: FibrilMesh, reaction: Floats, gradient: Floats = REST) -> Floats:
    """(Y,) tension of each yarn, N: the mean of its two clamps' forces `reaction` (N, 3) along it.

    A yarn along the axis k lies along F e_k at the average deformation `gradient` F (2, 2).
    """
    along = (gradient / np.hypot(*gradient)).T[mesh.yarn_axis]
    tension: Floats = (_apart(mesh, reaction) * along).sum(axis=1) / 2
    return tension


def extensions(mesh: FibrilMesh, configuration: Configuration) -> Floats:
    """(Y,) strain of the distance between the two ends of each yarn, in the plane, since the mesh was laid out.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> from circuittex.mech.configuration import initial_configuration
    >>> mesh = build_mesh(plain_weave(yarns=2))
    >>> extensions(mesh, initial_configuration(mesh)).tolist()
    [0.0, 0.0, 0.0, 0.0]
    """
    now, laid_out = (np.hypot(*end_to_end(mesh, r).T) for r in (configuration.r, mesh.position))
    strain: Floats = now / laid_out - 1.0
    return strain


def end_to_end(mesh: FibrilMesh, r: Floats) -> Floats:
    """(Y, 2) the way in the plane from the minus to the plus end of each yarn, mm: the mean of its fibrils' at nodes r
    (N, 3)."""
    way: Floats = _apart(mesh, r) / np.bincount(mesh.yarn, minlength=len(mesh.yarn_axis))[:, None]
    return way


def _apart(mesh: FibrilMesh, of_node: Floats) -> Floats:
    """(Y, 2) x and y of what stands at the plus ends less that at the minus ends, summed over each yarn's fibrils."""
    each, total = of_node[mesh.end_nodes(+1), :2] - of_node[mesh.end_nodes(-1), :2], np.zeros((len(mesh.yarn_axis), 2))
    np.add.at(total, mesh.yarn, each)
    return total


def clamp_statement(study: Study) -> tuple[str, ...]:
    """Sentences that say how far clamps under a given force have slid in the relaxed state; none where all are held."""
    if study.design.clamps.held or not study.records:
        return ()
    relaxed, sentences = study.records[0], []
    each = extensions(study.mesh, relaxed.configuration), tensions(study.mesh, relaxed.reaction)
    for k, (name, force) in enumerate(zip(("warp", "weft"), study.design.clamps.forces, strict=True)):
        if force is not None:
            strain, tension = (values[study.mesh.yarn_axis == k] for values in each)
            reached = f"{tension.min():.4g} to {tension.max():.4g} N"
            sentences.append(
                f"Under {force:.4g} N a yarn (reached: {reached}) the clamps of the {name} slid by "
                f"{100 * strain.min():+.3g} to {100 * strain.max():+.3g} % of their distance ({relaxed.name})."
            )
    return tuple(sentences)
