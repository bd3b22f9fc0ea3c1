"""The states of a study: their names, their order, and which state each of them starts from."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.design import Design, Loading
from circuittex.design.clamps import gripped
from circuittex.design.grid import starting_state
from circuittex.study.export import state_word

RELAXED = "relaxed"
"""Name of the state without loading, where loading paths start."""


@frozen
class Step:
    """One state to reach."""

    name: str
    """Its name; unique in the study."""
    previous: str
    """Name of the state that it starts from; empty for the relaxed state."""
    loading: str
    """Name of the loading path; empty for the relaxed state."""
    strain: float
    """The strain that labels it."""
    before: Floats
    """(2, 2) average deformation gradient of the state that it starts from."""
    after: Floats
    """(2, 2) its own average deformation gradient."""
    free_edges: str
    """Edges that are not held: 'x', 'y' or none."""
    gripped: str = ""
    """Axes along which the loading moves the clamps, whatever their force."""


def plan(design: Design) -> tuple[Step, ...]:
    """All states of a design in their canonical order: the relaxed one, then loading by loading as the design has them.

    >>> from circuittex.design import plain_weave, shear
    >>> [(step.previous, step.name) for step in plan(plain_weave(loading=(shear("shear", (0.05, 0.1)),)))]
    [('', 'relaxed'), ('relaxed', 'shear-0.05'), ('shear-0.05', 'shear-0.1')]
    """
    rest = np.eye(2)
    steps = [Step(RELAXED, "", "", 0.0, rest, rest, "")]
    every = state_names(design.loading)
    for number, (loading, names) in enumerate(zip(design.loading, every, strict=True)):
        place = starting_state(design.loading, number)
        previous, before = (every[place[0]][place[1]] if place else RELAXED), np.array(loading.start)
        for name, strain, gradient in zip(names, loading.strains, loading.gradients, strict=True):
            after = np.array(gradient)
            steps.append(Step(name, previous, loading.name, strain, before, after, loading.free, gripped(loading)))
            previous, before = name, after
    return tuple(steps)


def state_names(loading: Sequence[Loading]) -> tuple[tuple[str, ...], ...]:
    """A name for each state of each loading path: its name and the strain, numbered where one recurs.

    Names are unique over the whole study, in files and as words of a netlist, which know neither case nor signs.

    >>> from circuittex.design import shear
    >>> state_names([shear("cycle", (0.05, 0.1, 0.05)), shear("back", (-0.05,))])
    (('cycle-0.05', 'cycle-0.1', 'cycle-0.05-2'), ('back--0.05',))
    """
    taken: set[str] = set()

    def unique(name: str) -> str:
        choices = (name if number == 1 else f"{name}-{number}" for number in count(1))
        unused = next(choice for choice in choices if state_word(choice) not in taken)
        taken.add(state_word(unused))
        return unused

    return tuple(tuple(unique(f"{each.name}-{strain:.6g}") for strain in each.strains) for each in loading)
