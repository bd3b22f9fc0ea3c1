"""Where the first relaxation of a study starts: what a user may choose, and what is recorded of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.mech.linear import LinearSolver
from circuittex.relaxation.starts import START, from_state, repeated_cell, tiled
from circuittex.results.records import INITIAL, Study
from circuittex.results.store import load_study
from circuittex.study.plan import RELAXED

TILED = "tiled"


@frozen
class Start:
    """A start that was chosen, and how to make it."""

    words: str
    """What is recorded of it (`Study.start`)."""
    configuration: Callable[[], Configuration]
    """The configuration, which may take a relaxation.

    Raises `DesignError` where it cannot be a start, `ConvergenceError` where a smaller cell has no equilibrium."""


def chosen(study: Study, wanted: str, solver: Callable[[], LinearSolver], say: Callable[[str], None]) -> Start:
    """The start of a study that `wanted` names: 'initial', 'tiled', or FILE[:STATE], a stored state ('relaxed').

    Errors: `DesignError` where the design has no such start or the state is none for it; `StoreError` where there is no
    such file.
    """
    mesh, design = study.mesh, study.design
    if not isinstance(wanted, str):
        raise DesignError(START, wanted, "it must be 'initial', 'tiled' or FILE[:STATE]")
    if wanted == INITIAL:
        return Start(INITIAL, lambda: study.initial)
    if wanted == TILED:
        small = repeated_cell(design).weave
        size = f"{len(small.warp)} x {len(small.weft)} yarns"

        def report(iteration: int, residual: float) -> None:
            say(f"start of {size}: iteration {iteration}, largest free force {residual:.1e} N")

        return Start(f"{TILED}, from {size}", lambda: tiled(mesh, design, solver=solver(), report=report))
    return stored(mesh, design, wanted)


def stored(mesh: FibrilMesh, design: Design, wanted: str) -> Start:
    """The start from the state that FILE[:STATE] names.

    Errors: `DesignError` where the state is none for this design; `StoreError` where there is no such file.
    """
    file, state = place(wanted)
    source = load_study(file)
    found = next((record for record in source.records if record.name == state), None)
    if found is None:
        names = ", ".join(record.name for record in source.records) or "none"
        raise DesignError(START, wanted, f"recorded states: {names}")
    try:
        configuration = from_state(mesh, design, found.configuration, source.mesh)
    except DesignError as error:
        raise DesignError(START, wanted, error.allowed) from error
    return Start(f"state {state} of {source.design.name!r}, design {source.design_hash}", lambda: configuration)


def place(wanted: str) -> tuple[Path, str]:
    """The file, or folder, and the state that FILE[:STATE] names; the relaxed one where none is named."""
    file, colon, state = wanted.rpartition(":")
    return (Path(file), state) if colon and not Path(wanted).exists() else (Path(wanted), RELAXED)
