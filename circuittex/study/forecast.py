"""What a study will take before it begins: seconds from one of each part of an iteration, measured on this machine, and
bytes from the entries of its matrices, counted.

How many iterations there will be nobody knows. What is expected was measured on weaves of 2 x 2 to 16 x 16 yarns of ten
fibrils, and on three designs of the documentation; docs/benchmarks.md has estimates beside what the runs took then.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from math import sqrt

from circuittex.base.compiled import available_cores
from circuittex.base.errors import CircuittexWarning, SizeError
from circuittex.base.frozen import frozen
from circuittex.base.memory import available_memory
from circuittex.design import Design, plain_weave
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.pattern import DOFS
from circuittex.relaxation.cost import Cost, Size, measured_cost
from circuittex.relaxation.relax import begins_with_gradients
from circuittex.results.records import Study
from circuittex.study.plan import plan

FIRST, OF_UNKNOWNS = 20.0, 7560
"""Iterations of Newton's method in a first relaxation of so many unknowns, 2 x 2 yarns; they go with the root of the
unknowns: 20, 30, 83, 159 were counted for 2 x 2 to 16 x 16, where this gives 20, 40, 79, 157."""
STEP = 1 / 3
"""Iterations of a step of a loading path in parts of those, by either method: by gradients 16 to 82 were counted for
4 x 4 yarns, 187 and 337 for 8 x 8."""
GRADIENTS, BESIDE, STEP_BESIDE = 4.3, 8, 4
"""Iterations by gradients for one of Newton's method, where a descent comes first (170, 314 and 577 to 799 were counted
for 4 x 4 to 16 x 16 yarns, where this gives 170, 338, 674), and what factorisations take beside them in iterations of
the latter, in a first relaxation and a step."""
TRIED = 1.2
"""What an iteration takes, in parts of one of each of its parts at the start: several factors may be tried, steps are
searched, and contacts come. 0.6 to 2 were measured."""
RECORD = 5.0
"""What it takes to record a state, fields, circuits and their verification, in iterations: 2 to 5 for the paper's
yarns, 15 for yarns whose elements have many contact points, 1 for single wires."""
SHARED = 0.5
"""A relaxation on a part of the cores takes longer by the inverse of that part to this power: 1.2 to 1.8 times on one
core of two."""

PROCESS, OF_ENTRIES, OF_FACTOR = 290e6, 17 * 8, 2 * 8
"""Bytes that a process needs at its most: for itself, for each entry of the pattern at the start, and for each value of
its factor then. Entries come to be up to 1.1 times as many, values 1.0 to 1.9 times, as contacts come; arrays live
beside one another. Peaks of weaves of 7,560 to 463,680 unknowns are 0.6 to 1 times what this gives; that of a crossing
of two yarns of 300 filaments, to which most contacts come later, is 1.03 times."""
LEAST_ENTRIES, LEAST_FILL = 126, 3
"""Entries of a node that touches nothing, of linear elements, and values of the factor for each entry: 3.6 to 11 were
counted. By these a design that is far too large is known before its matrices are built."""
TRUSTED = 1.5
"""Times the available memory from which on a run is refused; below, the estimate may be to blame."""

NOMINAL = 1.2e-5
"""s of an iteration for each unknown, on the machine of docs/benchmarks.md (8e-6 to 1.4e-5 below 60,000 unknowns)."""
LEAST_ELEMENTS = 4
"""Of a fibril that one of each part is tried on first."""
MOMENTS = 20.0
"""A study that takes no longer by that rate is not measured: that would cost more than it tells."""


@frozen
class Forecast:
    """What the states to come will take."""

    first: float
    """s until the relaxed state is recorded; 0 where it is there."""
    step: float
    """s of one worker for each other state."""
    workers: int
    """Loading paths to follow beside one another: as many as were asked for, or those for which there is memory."""
    memory: float
    """bytes of all processes at their most."""


def foresee(study: Study, workers: int) -> Forecast | None:
    """What the states that the study lacks will take with so many workers; None where there are none, or where they are
    a matter of moments.

    Warns where a process needs more memory than there is by an estimate that may be wrong.

    Raises `SizeError` where it needs more than that could explain.
    """
    design, mesh = study.design, study.mesh
    known = {record.name for record in study.records}
    steps = [step for step in plan(design) if step.name not in known]
    if not steps:
        return None
    available = available_memory()

    def admit(size: Size) -> None:
        check_memory(design, size, available)

    admit(Size(mesh.n_nodes, LEAST_ENTRIES * mesh.n_nodes, 0))
    newton = iterations_of_newton(DOFS * mesh.n_nodes)
    taken = [record.iterations for record in study.records if record.loading]
    each = sum(taken) / len(taken) if taken else STEP * expected_iterations(DOFS * mesh.n_nodes)
    paths = len({step.loading for step in steps if step.loading})
    count = len(steps) if known else len(steps) - 1
    nominal = (0.0 if known else newton + RECORD) + count * (STEP * newton + RECORD)
    if NOMINAL * DOFS * mesh.n_nodes * nominal < MOMENTS:
        return None
    tiny = plain_weave(yarns=1, rows=(1,))
    tiny = replace(tiny, numerics=replace(tiny.numerics, elements=LEAST_ELEMENTS))
    straight = build_mesh(tiny)
    measured_cost(straight, tiny, initial_configuration(straight))  # loads what is compiled, or compiles it
    start = study.records[-1].configuration if known else study.initial
    cost = measured_cost(mesh, design, start, admit)
    return forecast(cost, not known, each, min(workers, max(paths, 1)), available)


def forecast(cost: Cost, relaxed: bool, each: float, workers: int, available: int | None) -> Forecast:
    """What states take by the cost of a relaxation's parts, with `each` iterations for a step of a loading path.

    `relaxed` tells whether the relaxed state is among those to come; `available` are the bytes that there are.
    """
    one = memory_of(cost.size)
    if available is not None and workers > 1:
        workers = max(1, min(workers, int((available - PROCESS) // one)))
    threads = max(1, available_cores() // workers)
    slower, recording = (available_cores() / threads) ** SHARED, RECORD * cost.iteration
    return Forecast(
        first=seconds(cost, expected_iterations(DOFS * cost.size.nodes), BESIDE) + recording if relaxed else 0.0,
        step=slower * (seconds(cost, each, STEP_BESIDE) + recording),
        workers=workers,
        memory=workers * one + PROCESS if workers > 1 else one,
    )


def expected_iterations(unknowns: int) -> float:
    """Iterations that a first relaxation is expected to take, by gradients where it begins with these.

    >>> [round(expected_iterations(n)) for n in (7560, 29520, 116640, 463680)]
    [20, 170, 338, 674]
    """
    return (GRADIENTS if begins_with_gradients(unknowns) else 1.0) * iterations_of_newton(unknowns)


def iterations_of_newton(unknowns: int) -> float:
    """Iterations that a first relaxation is expected to take by Newton's method alone."""
    return FIRST * sqrt(unknowns / OF_UNKNOWNS)


def seconds(cost: Cost, iterations: float, beside: float) -> float:
    """What a relaxation takes in so many iterations, s; where these are by gradients, with `beside` of Newton's."""
    if begins_with_gradients(DOFS * cost.size.nodes):
        return iterations * (cost.gradient + cost.solution) + beside * TRIED * cost.iteration
    return TRIED * iterations * cost.iteration


def memory_of(size: Size) -> float:
    """Bytes that a process which relaxes and records such a cell needs at its most; at least these where the values of
    the factor have not been counted.

    >>> round(memory_of(Size(51520, 20_362_464, 212_831_325)) / 1e9, 1)  # 16 x 16 yarns, which took 5.8 GB
    6.5
    """
    return PROCESS + OF_ENTRIES * size.entries + OF_FACTOR * (size.factor or LEAST_FILL * size.entries)


def check_memory(design: Design, size: Size, available: int | None) -> None:
    """Refuse a design that is too large for this machine; warn of one that may be.

    Raises `SizeError`, with what is needed, what there is and what to reduce.
    """
    needed = memory_of(size)
    if available is None or needed <= available:
        return
    weave, elements = design.weave, design.resolution.elements
    fibrils = max(yarn.n_fibrils for yarn in weave.yarns)
    about = "about" if size.factor else "at least"
    words = (
        f"{design.name}: it needs {about} {gigabytes(needed)} of memory, and {gigabytes(available)} are available; "
        f"reduce numerics.elements ({elements}), the fibrils of a yarn ({fibrils}) or the yarns "
        f"({len(weave.warp)} x {len(weave.weft)})"
    )
    if needed > TRUSTED * available:
        raise SizeError(words)
    if size.factor:
        warnings.warn(f"{words}, should it not suffice", CircuittexWarning, stacklevel=2)


def gigabytes(number: float) -> str:
    """Bytes in words, no finer than they are known.

    >>> gigabytes(5.806e9), gigabytes(47.6e9)
    ('5.8 GB', '48 GB')
    """
    return f"{number / 1e9:.1f} GB" if number < 9.95e9 else f"{number / 1e9:.0f} GB"
