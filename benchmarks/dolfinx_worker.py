"""FEniCSx assembles the beam: run by `dolfinx_beam.py` with an interpreter that has dolfinx, and knows no circuittex.

    python3 benchmarks/dolfinx_worker.py FOLDER

Reads FOLDER/case.npz, writes its gradient and tangent to FOLDER/answer-FORM.npz for every form, says "ready FORM", and
from then on answers every line "FORM" on its standard input with the seconds of one assembly of gradient and tangent,
by the wall's clock and by the processor's.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from petsc4py import PETSc

COMPILER = "-O3 -march=native -ffast-math"


def columns(t: Any, x: float, y: float) -> Any:
    """F = [g1 | g2 | r' + x g1' + y g2'] of the field t of nine unknowns."""
    d = t.dx(0)
    parts = [
        [t[3 + c] for c in range(3)],
        [t[6 + c] for c in range(3)],
        [d[c] + x * d[3 + c] + y * d[6 + c] for c in range(3)],
    ]
    return ufl.as_matrix([[part[c] for part in parts] for c in range(3)])


def derived(u: Any, v: Any, w: Any, case: Any, mu: Any) -> tuple[Any, Any]:
    """The energy, differentiated twice by UFL."""
    energy = 0.0
    for (x, y), area in zip(case["points"].tolist(), case["area"].tolist(), strict=True):
        F = columns(u, x, y)
        energy += area * (mu / 2 * (ufl.inner(F, F) - 3) - mu * ufl.ln(ufl.det(F)))
    gradient = ufl.derivative(energy * line(case), u, v)
    return gradient, ufl.derivative(gradient, u, w)


def by_hand(u: Any, v: Any, w: Any, case: Any, mu: Any) -> tuple[Any, Any]:
    """Stress and its change written down, at every point of the section."""
    gradient = tangent = 0.0
    for (x, y), area in zip(case["points"].tolist(), case["area"].tolist(), strict=True):
        F, dV, dW = (columns(t, x, y) for t in (u, v, w))
        inverse = ufl.inv(F).T
        gradient += area * mu * ufl.inner(F - inverse, dV)
        tangent += area * mu * (ufl.inner(dW, dV) + ufl.inner(inverse * dW.T * inverse, dV))
    return gradient * line(case), tangent * line(case)


def by_moments(u: Any, v: Any, w: Any, case: Any, mu: Any) -> tuple[Any, Any]:
    """The reduction of circuittex's own kernel (`circuittex.mech.kernels`) in UFL: nine moments of the section."""
    points, area = case["points"], case["area"]
    xi = np.column_stack([np.ones(len(area)), points])
    fixed = np.einsum("s,si,sj->ij", area, xi, xi)

    def parts(t: Any) -> tuple[Any, ...]:
        d = t.dx(0)
        vectors = [
            [t[3 + c] for c in range(3)],
            [t[6 + c] for c in range(3)],
            *([d[3 * i + c] for c in range(3)] for i in range(3)),
        ]
        return tuple(ufl.as_vector(each) for each in vectors)

    (g1, g2, *f), (v1, v2, *vf), (w1, w2, *wf) = parts(u), parts(v), parts(w)
    cross, dot = ufl.cross, ufl.dot
    normal = cross(g1, g2)
    by_v, by_w = cross(v1, g2) + cross(g1, v2), cross(w1, g2) + cross(g1, w2)
    both = cross(v1, w2) + cross(w1, v2)
    j = [dot(normal, f[i]) for i in range(3)]
    dv = [dot(by_v, f[i]) + dot(normal, vf[i]) for i in range(3)]
    dw = [dot(by_w, f[i]) + dot(normal, wf[i]) for i in range(3)]
    dvw = [dot(both, f[i]) + dot(by_v, wf[i]) + dot(by_w, vf[i]) for i in range(3)]
    J = [sum(float(row[i]) * j[i] for i in range(3)) for row in xi]

    def p(i: int) -> Any:
        return sum(-mu * float(a * row[i]) / each for a, row, each in zip(area, xi, J, strict=True))

    def moment(i: int, k: int) -> Any:
        return sum(mu * float(a * row[i] * row[k]) / each**2 for a, row, each in zip(area, xi, J, strict=True))

    def quadratic(a1: Any, a2: Any, af: Any) -> Any:
        total = float(area.sum()) * (dot(a1, v1) + dot(a2, v2))
        for i, k in np.argwhere(abs(fixed) > 1e-12 * fixed.max()):
            total += float(fixed[i, k]) * dot(af[i], vf[k])
        return mu * total

    ps = [p(i) for i in range(3)]
    gradient = quadratic(g1, g2, f) + sum(ps[i] * dv[i] for i in range(3))
    tangent = quadratic(w1, w2, wf) + sum(ps[i] * dvw[i] for i in range(3))
    tangent += sum(moment(i, k) * dv[i] * dw[k] for i in range(3) for k in range(3))
    return gradient * line(case), tangent * line(case)


FORMS = {"derived by UFL": derived, "stress by hand": by_hand, "section moments": by_moments}


def line(case: Any) -> Any:
    """The measure along the axes, with the points of the element's reduced rule."""
    order = case["elements"].shape[1] - 1
    return ufl.dx(metadata={"quadrature_degree": 2 * order - 1, "quadrature_scheme": "default"})


def space(case: Any) -> tuple[Any, np.ndarray]:
    """The space of the nine unknowns, and the number of circuittex's node for each of its blocks."""
    xi, elements = case["xi"], case["elements"]
    order = elements.shape[1] - 1
    vertices, index = np.unique(elements[:, [0, -1]], return_inverse=True)
    interval = ufl.Mesh(ufl.VectorElement("Lagrange", ufl.Cell("interval", geometric_dimension=1), 1))
    grid = mesh.create_mesh(MPI.COMM_SELF, index.reshape(-1, 2).astype(np.int64), xi[vertices][:, None], interval)
    V = fem.VectorFunctionSpace(grid, ("Lagrange", order), dim=9)
    at, node = grid.geometry.x[:, 0], np.empty(len(xi), dtype=int)
    for cell, original in enumerate(grid.topology.original_cell_index):
        corners, blocks, nodes = grid.geometry.dofmap.links(cell), V.dofmap.cell_dofs(cell), elements[original]
        ends = nodes[[0, -1]] if at[corners[0]] < at[corners[1]] else nodes[[-1, 0]]
        node[blocks] = [*ends, *nodes[1:-1]]
    return V, node


class Assembly:
    """Gradient and tangent of one form."""

    def __init__(self, form: Any, V: Any, q: np.ndarray, case: Any) -> None:
        u = fem.Function(V)
        u.x.array[:] = q
        mu = fem.Constant(V.mesh, PETSc.ScalarType(case["mu"]))
        jit = {"cffi_extra_compile_args": COMPILER.split(), "cffi_libraries": ["m"]}
        forms = form(u, ufl.TestFunction(V), ufl.TrialFunction(V), case, mu)
        self.gradient_form, self.tangent_form = (fem.form(each, jit_params=jit) for each in forms)
        self.gradient = fem.petsc.create_vector(self.gradient_form)
        self.tangent = fem.petsc.create_matrix(self.tangent_form)

    def assemble(self) -> str:
        """Seconds of one gradient and tangent, by the wall's clock and by the processor's."""
        clock, processor = time.perf_counter(), time.process_time()
        with self.gradient.localForm() as local:
            local.set(0.0)
        fem.petsc.assemble_vector(self.gradient, self.gradient_form)
        self.tangent.zeroEntries()
        fem.petsc.assemble_matrix(self.tangent, self.tangent_form)
        self.tangent.assemble()
        return f"{time.perf_counter() - clock} {time.process_time() - processor}"


def main() -> None:
    folder = Path(sys.argv[1])
    case = np.load(folder / "case.npz")
    V, node = space(case)
    q = case["x"].reshape(-1, 9)[node].ravel()
    assemblies = {}
    for name in FORMS:
        assembly = assemblies[name] = Assembly(FORMS[name], V, q, case)
        assembly.assemble()
        start, column, value = assembly.tangent.getValuesCSR()
        answer = {"node": node, "gradient": assembly.gradient.array, "start": start, "column": column, "value": value}
        np.savez(folder / f"answer-{name}.npz", **answer)
        print(f"ready {name}", flush=True)
    for request in sys.stdin:
        print(assemblies[request.strip()].assemble(), flush=True)


if __name__ == "__main__":
    main()
