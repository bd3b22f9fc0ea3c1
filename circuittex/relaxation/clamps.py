"""Clamps that slide along their yarns under a given force, as unknowns of the relaxation."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.load import DeadLoad
from circuittex.mech.motions import Motions
from circuittex.mech.pattern import DOFS

REST = np.eye(2)


@frozen
class Sliding:
    """The yarns whose tension is given: one motion each, that of its clamps away from one another."""

    motions: Motions
    """How the ends of their fibrils move."""
    load: DeadLoad
    """The tensions, in equal parts on the fibril ends; its potential is zero where the mesh was laid out."""


def sliding(mesh: FibrilMesh, design: Design, axes: str, gradient: Floats = REST) -> Sliding | None:
    """The clamps of the yarns along `axes` ('x', 'y', 'xy' or '') that a design gives a force for; None if there are
    none.

    At an average deformation gradient F (2, 2) they slide along F e_k, the direction in which F lays yarns along the
    axis k: by p F e_k / F_kk at the plus end, and by as much the other way at the minus end. With the tension T of the
    yarn the potential is -2 T p |F e_k| / F_kk, and its tension at a minimum the mean of the two clamps' forces
    along F e_k.
    """
    given = {k: force for k, force in enumerate(design.clamps.forces) if force is not None and "xy"[k] in axes}
    ends, side = mesh.ends, np.repeat([-1.0, 1.0], mesh.n_fibrils)
    yarns = [yarn for yarn in range(len(mesh.yarn_axis)) if mesh.yarn_axis[yarn] in given]
    if not yarns:
        return None
    force, rows, leaders = np.zeros(DOFS * mesh.n_nodes), [], []
    for number, yarn in enumerate(yarns):
        k = int(mesh.yarn_axis[yarn])
        own = np.tile(mesh.yarn == yarn, 2)
        along, node, sense = gradient[:, k] / gradient[k, k], ends[own], side[own]
        for component in np.flatnonzero(along):
            unknown = DOFS * node + component
            rows.append((unknown, np.full(len(node), number), along[component] * sense))
            force[unknown] = 2 * given[k] / len(node) * sense * along[component] / np.hypot(*along)
        leaders.append(DOFS * node[-1] + k)
    origin = initial_configuration(mesh).x.ravel()
    unknown, motion, part = (np.concatenate(column) for column in zip(*rows, strict=True))
    return Sliding(Motions(unknown, motion, part, np.array(leaders)), DeadLoad(force, origin))
