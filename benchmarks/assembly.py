"""Compiled assembly of the beams against their scikit-fem forms, on coarse meshes of one crossing of the paper's cell.

    python benchmarks/assembly.py [--nodes 4] [--repeats 3]

Both give gradient and tangent of the same state; the table also shows by how much their tangents differ. The time
of both grows with the number of elements, so a few of them show the ratio. The form is the readable definition of
the beam, written for the eye and not for speed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from measure import Table, arguments, paired, publish, ratio

from circuittex.design import Design, plain_weave
from circuittex.geometry.weave import build_mesh
from circuittex.mech.beam import Beam
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.form import BeamForm
from circuittex.mech.pattern import build_pattern
from circuittex.mech.space import beam_space

HEAD = ["order", "elements", "section points", "scikit-fem ms", "compiled ms", "ratio", "relative difference"]


def compare(design: Design, repeats: int) -> list[object]:
    """One row of the table: times of one gradient and tangent of all fibrils, and how far the two tangents differ."""
    mesh, degree = build_mesh(design), design.numerics.section_degree
    space = beam_space(mesh)
    q = space.vector(initial_configuration(mesh))
    beam, form = Beam(space, degree=degree), BeamForm(mesh, degree=degree)
    pattern = build_pattern(mesh.n_nodes, *beam.pairs())

    tangents: dict[str, sp.csr_array] = {}

    def compiled() -> None:
        gradient, data, softening = np.zeros(len(q)), np.zeros(pattern.nnz), np.zeros(pattern.nnz)
        beam.assemble(q, pattern, gradient, data, softening)
        tangents["compiled"] = sp.csr_array((data, pattern.indices, pattern.indptr), shape=(len(q), len(q)))

    def readable() -> None:
        form.residual(q)
        tangents["form"] = sp.triu(form.tangent(q))

    seconds = paired({"compiled": compiled, "form": readable}, repeats)
    difference = float(abs(tangents["compiled"] - tangents["form"]).max() / abs(tangents["form"]).max())
    times = [1e3 * float(np.median(seconds[name])) for name in ("form", "compiled")]
    quotient = ratio(seconds["form"], seconds["compiled"])
    return [mesh.order, len(mesh.elements), beam.elements.weight.shape[-1], *times, quotient, difference]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--nodes", type=int, default=4, help="nodes of a fibril, less one")
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    base = plain_weave(yarns=1)
    numerics = [replace(base.numerics, order=order, elements=options.nodes // order) for order in (1, 2)]
    rows = [compare(replace(base, numerics=n), options.repeats) for n in numerics]
    publish(options, [Table("Gradient and tangent of all fibrils, ms (median):", HEAD, rows)])


if __name__ == "__main__":
    main()
