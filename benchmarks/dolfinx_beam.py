"""Assembly of gradient and tangent of all beams, against FEniCSx on the same elements, quadrature and state.

    python benchmarks/dolfinx_beam.py [--elements 20] [--repeats 15] [--python /usr/bin/python3]

dolfinx runs in a process of its own with the system's interpreter (Debian: apt-get install python3-dolfinx) and is
asked for its assemblies in turn with circuittex's. Three forms are tried, all compiled with -O3 -march=native
-ffast-math: the energy differentiated by UFL, stress and its change written by hand, both with all points of the
section, and circuittex's own reduction to moments of the section, written in UFL. Both programs run on one core and are
timed by the processor's clock; the last rows let circuittex use all cores and are timed by the wall's. dolfinx fills
a PETSc matrix (all of it), circuittex the upper triangle and, beside, the energy; compilation is not counted.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from measure import Seconds, Table, arguments, fail, publish, ratio

from circuittex.design import Design, plain_weave
from circuittex.geometry.weave import build_mesh
from circuittex.mech.beam import Beam
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.pattern import Pattern, build_pattern
from circuittex.mech.section import disk_rule
from circuittex.mech.space import BeamSpace, beam_space

WORKER = Path(__file__).with_name("dolfinx_worker.py")
OURS = "circuittex"
WALL, PROCESSOR = 0, 1
HEAD = [
    "cores of circuittex",
    "form in UFL",
    "dolfinx ms",
    "circuittex ms",
    "ratio",
    "difference of gradients",
    "of tangents",
]
MISSING = "dolfinx is needed by {python} (Debian: apt-get install python3-dolfinx), or another interpreter: --python"


class Ours:
    """circuittex's side: the beams of a design in a state off their rest."""

    def __init__(self, design: Design) -> None:
        mesh, self.degree = build_mesh(design), design.numerics.section_degree
        if np.ptp(mesh.radius) > 0 or np.any(mesh.poisson_ratio != 0):
            fail("the forms of this benchmark are those of equal fibrils with Poisson ratio 0")
        self.space: BeamSpace = beam_space(mesh)
        q = self.space.vector(initial_configuration(mesh))
        self.q = q + 0.01 * np.random.default_rng(0).uniform(-1, 1, len(q))
        self.beam = Beam(self.space, degree=self.degree)
        self.pattern: Pattern = build_pattern(mesh.n_nodes, *self.beam.pairs())
        self.gradient, self.data, self.nothing = (
            np.zeros(len(q)),
            np.zeros(self.pattern.nnz),
            np.zeros(self.pattern.nnz),
        )

    def assemble(self) -> None:
        """Gradient and tangent from nothing."""
        self.gradient[:], self.data[:] = 0.0, 0.0
        self.beam.assemble(self.q, self.pattern, self.gradient, self.data, self.nothing)

    def save(self, path: Path) -> None:
        """What the other side needs."""
        mesh = self.space.mesh
        points, share = disk_rule(self.degree)
        np.savez(
            path,
            xi=mesh.xi,
            elements=mesh.elements,
            x=self.space.configuration(self.q).x,
            points=points * mesh.radius[0],
            area=share * mesh.area[0],
            mu=mesh.youngs_modulus[0] / 2,
        )

    def differences(self, answer: Any) -> tuple[float, float]:
        """Largest differences of its gradient and tangent from ours, relative to our largest entry."""
        self.assemble()
        n = len(self.q)
        upper = sp.csr_array((self.data, self.pattern.indices, self.pattern.indptr), shape=(n, n))
        at = (9 * answer["node"][:, None] + np.arange(9)).ravel()
        tangent = (upper + sp.triu(upper, 1).T).tocsr()[at][:, at]
        theirs = sp.csr_array((answer["value"], answer["column"], answer["start"]), shape=(n, n))
        gradient = np.abs(answer["gradient"] - self.gradient[at]).max() / np.abs(self.gradient).max()
        return float(gradient), float(abs(theirs - tangent).max() / abs(tangent).max())


@contextmanager
def dolfinx(python: str, folder: Path) -> Iterator[tuple[list[str], Callable[[str], list[float]]]]:
    """The forms of a running worker, and a function that asks for the wall's and the
    processor's seconds of one assembly of a form."""
    found = subprocess.run([python, "-c", "import dolfinx"], capture_output=True, check=False)
    if found.returncode != 0:
        fail(MISSING.format(python=python))
    command = [python, str(WORKER), str(folder)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        forms = []
        for line in process.stdout:
            forms.append(line.removeprefix("ready").strip())
            if len(forms) == 3:
                break
        if len(forms) < 3:
            fail(f"the dolfinx worker ended after {len(forms)} forms")

        def ask(form: str) -> list[float]:
            process.stdin.write(f"{form}\n")
            process.stdin.flush()
            return [float(word) for word in process.stdout.readline().split()]

        yield forms, ask
        process.stdin.close()


@contextmanager
def cores(wanted: set[int]) -> Iterator[None]:
    """Run on these cores, where the system can be told so."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, wanted)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def compare(ours: Ours, python: str, repeats: int) -> Table:
    """One row for each form on one core, and again with all cores for circuittex."""
    everywhere = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set(range(os.cpu_count() or 1))
    one = {max(everywhere)}
    rows: list[list[object]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        ours.save(folder / "case.npz")
        with cores(one):
            worker = dolfinx(python, folder)
            forms, ask = worker.__enter__()
        try:
            far = {form: ours.differences(np.load(folder / f"answer-{form}.npz")) for form in forms}
            for mine, clock in ((one, PROCESSOR), (everywhere, WALL)):
                with cores(mine):
                    seconds = alternate(ours, forms, ask, repeats)[clock]
                own = 1e3 * float(np.median(seconds[OURS]))
                for form in forms:
                    times = 1e3 * float(np.median(seconds[form])), own, ratio(seconds[form], seconds[OURS])
                    rows.append([len(mine), form, *times, *far[form]])
        finally:
            worker.__exit__(None, None, None)
    elements = len(ours.space.mesh.elements)
    title = f"Gradient and tangent of {elements} elements of order {ours.space.mesh.order}, "
    title += f"{ours.beam.elements.weight.shape[1]} points along and {ours.beam.elements.weight.shape[2]} across each; "
    title += "one core by the processor's clock, more by the wall's:"
    return Table(title, HEAD, rows)


def alternate(
    ours: Ours, forms: list[str], ask: Callable[[str], list[float]], repeats: int
) -> list[dict[str, Seconds]]:
    """The wall's and the processor's seconds of our assembly and of each form, in turn, after a first round."""

    def own() -> list[float]:
        clock, processor = time.perf_counter(), time.process_time()
        ours.assemble()
        return [time.perf_counter() - clock, time.process_time() - processor]

    rounds = np.array([[own(), *map(ask, forms)] for _ in range(repeats + 1)])[1:]
    return [dict(zip([OURS, *forms], rounds[:, :, k].T, strict=True)) for k in (0, 1)]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--elements", type=int, default=20, help="elements of a fibril")
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--python", default="/usr/bin/python3", help="an interpreter that has dolfinx")
    options = parser.parse_args()
    base = plain_weave()
    design = replace(base, numerics=replace(base.numerics, elements=options.elements))
    publish(options, [compare(Ours(design), options.python, options.repeats)])


if __name__ == "__main__":
    main()
