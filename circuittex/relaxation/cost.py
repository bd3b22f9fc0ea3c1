"""What the parts of a relaxation cost on this machine: each done once, for the matrix that a relaxation starts with."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from circuittex.base.frozen import frozen
from circuittex.contact.law import largest_penalty
from circuittex.design import Design
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.mech.coupled import Coupled
from circuittex.mech.minimise import LARGEST_SHIFT
from circuittex.mech.multifrontal import analysed
from circuittex.mech.pattern import Pattern, count_entries, diagonal
from circuittex.mech.scales import fibril_scales
from circuittex.mech.system import System
from circuittex.mech.terms import ForceTerm
from circuittex.relaxation.relax import begins_with_gradients, force_terms
from circuittex.solvers.cholesky import Cholesky


class Size(NamedTuple):
    """How large the matrices are."""

    nodes: int
    entries: int
    """Places in the pattern of the tangent."""
    factor: int
    """Values in its factor; 0 as long as they have not been counted."""


@frozen
class Cost:
    """What the parts of a relaxation cost."""

    size: Size
    """How large its matrices are at the start."""
    assembly: float
    """s for one assembly with search and pattern."""
    analysis: float
    """s for the order of elimination and the fronts."""
    factorisation: float
    """s for the factor's values."""
    gradient: float
    """s for a gradient alone, its contacts searched before; 0 where nothing is descended by gradients."""
    solution: float
    """s for a solution with the factor."""

    @property
    def iteration(self) -> float:
        """s for one of each part of an iteration of Newton's method."""
        return self.assembly + self.analysis + self.factorisation + self.solution


def measured_cost(
    mesh: FibrilMesh, design: Design, start: Configuration, admit: Callable[[Size], None] | None = None
) -> Cost:
    """The cost of a relaxation that begins at `start`, from one of each of its parts.

    `admit` is asked before each part that needs much memory, with what is known of the size by then: entries first and
    later values of the factor, both counted and not estimated. It raises where that is too much.

    >>> from dataclasses import replace
    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> from circuittex.mech.configuration import initial_configuration
    >>> design = plain_weave(yarns=1, rows=(1,))
    >>> design = replace(design, numerics=replace(design.numerics, elements=4))
    >>> mesh = build_mesh(design)
    >>> measured_cost(mesh, design, initial_configuration(mesh)).size.nodes
    18
    """
    space, beam, contact = force_terms(mesh, design)
    scales = fibril_scales(space, design.weave.least_pitch, largest_penalty(mesh, design.contact))
    terms: list[ForceTerm] = [beam, contact]
    q, clock = space.vector(start), _Clock()
    for term in terms:
        term.prepare(q)
    searched = clock()
    if admit is not None:
        full, point = (np.concatenate(both) for both in zip(*(term.pairs() for term in terms), strict=True))
        admit(Size(mesh.n_nodes, count_entries(mesh.n_nodes, full, point), 0))
    system = System(terms, scales, space.fixed, len(q))
    clock()
    pattern, _, gradient = system.assemble(q)
    assembled = clock()
    values, coupled = system.matrix(_largest_shift(system, pattern), 1.0), Coupled()
    clock()
    coupled.renew(pattern, values)
    analysis = analysed(pattern, coupled)
    ordered = clock()
    size = Size(mesh.n_nodes, pattern.nnz, analysis.size)
    if admit is not None:
        admit(size)
    cholesky = Cholesky(analysis)
    clock()
    solve = cholesky.factor(values[coupled.entries])
    factorised = clock()
    if solve is not None:  # else the relaxation will fail, and says why
        solve(gradient)
    solved = clock()
    gradient_in = 0.0
    if begins_with_gradients(space.n_dofs):
        system.slope(q)  # with a search
        clock()
        system.slope(q)
        gradient_in = clock()
    return Cost(
        size=size,
        assembly=searched + assembled,
        analysis=ordered,
        factorisation=factorised,
        gradient=gradient_in,
        solution=solved,
    )


def _largest_shift(system: System, pattern: Pattern) -> float:
    """The largest shift that Newton's method would try: with it the tangent is positive, whatever contacts do."""
    stiffness, metric = (np.delete(values[diagonal(pattern)], system.fixed) for values in (system.data, system.metric))
    return LARGEST_SHIFT * float((stiffness / metric).max())


class _Clock:
    """Each call gives the seconds since the last."""

    def __init__(self) -> None:
        self._last = time.perf_counter()

    def __call__(self) -> float:
        last, self._last = self._last, time.perf_counter()
        return self._last - last
