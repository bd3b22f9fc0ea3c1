"""Mesh study: the relaxed and the once stretched paper cell with 10, 20 and 40 elements a fibril.

    python benchmarks/mesh_study.py [--parameters paper-code] [--elements 10 20 40]

A table of clamp forces, probe currents, Ry and Rc, and the time each mesh takes. All relax by Newton's method alone,
which leads 20 and 40 elements to the same branch, so that only the mesh differs; by gradients, with --gradients, they
come to different ones.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np
from measure import Table, arguments, publish

from circuittex.contact.extract import contacts_of
from circuittex.design import Design, plain_weave
from circuittex.electrical.fields import solve_probes
from circuittex.fit import fit_network
from circuittex.geometry.weave import build_mesh
from circuittex.relaxation import relax as relaxation
from circuittex.relaxation.relax import Equilibrium, clamp_force, move, relax

STRETCH = 1.025
HEAD = [
    "elements",
    "stretch",
    "Fx N",
    "Fy N",
    "I1 A",
    "I2 A",
    "I3 A",
    "Ry ohm",
    "Rc ohm",
    "iterations",
    "residual N",
    "s",
]


def rows(design: Design) -> list[list[object]]:
    """One table row for the relaxed state and one for a stretch of 2.5 %."""
    mesh, start = build_mesh(design), None
    found: list[list[object]] = []
    for stretch in (1.0, STRETCH):
        clock = time.perf_counter()
        state: Equilibrium = relax(mesh, design, start)
        seconds = time.perf_counter() - clock
        contacts = contacts_of(design, mesh, state.configuration)
        currents = [f.currents[0] for f in solve_probes(contacts, design.terminals, design.probes)]
        fit = fit_network(currents, design)
        force = clamp_force(mesh, state.reaction)
        cells = [f"{100 * (stretch - 1):.1f} %", f"{force[0, 0]:.5f}", f"{force[1, 1]:.5f}"]
        cells += [*(f"{current:.6f}" for current in currents), f"{fit.Ry:.5f}", f"{fit.Rc:.2f}"]
        found.append([design.numerics.elements, *cells, state.iterations, state.residual, seconds])
        start = move(state.configuration, np.eye(2), np.diag([STRETCH, 1.0]))
    return found


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--parameters", default="paper-code", choices=["paper-code", "paper-table"])
    parser.add_argument("--elements", type=int, nargs="+", default=[10, 20, 40])
    parser.add_argument("--points", type=int, default=4, help="contact points of an element")
    parser.add_argument("--degree", type=int, default=7, help="degree of the section's rule")
    parser.add_argument("--gradients", action="store_true", help="relax as a run does, by gradients first")
    options = parser.parse_args()
    if not options.gradients:
        vars(relaxation)["WORTH_A_DESCENT"] = sys.maxsize
    base = plain_weave(options.parameters)
    found: list[list[object]] = []
    for elements in options.elements:
        numerics = replace(
            base.numerics, elements=elements, contact_points=options.points, section_degree=options.degree
        )
        found += rows(replace(base, numerics=numerics))
    publish(options, [Table(f"The paper's cell, {options.parameters}:", HEAD, found)])


if __name__ == "__main__":
    main()
