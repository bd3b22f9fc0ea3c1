"""Where the first relaxation of a weave may start, other than from the initial weave.

Each start is the initial weave with displacements added that are zero at ends whose clamps are held: those of a smaller
cell, over and over, or those of a state of a similar design. What the descent from there reaches is asked the same as
ever.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import ConvergenceError, DesignError, PenetrationError
from circuittex.design import Clamps, Design, Weave
from circuittex.design.statement import AUTO
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.linear import LinearSolver
from circuittex.relaxation.clamps import sliding
from circuittex.relaxation.relax import force_terms, relax
from circuittex.relaxation.sides import REST, check_sides
from circuittex.relaxation.transfer import field_at, transfer

ROUNDING = 1e-12
"""Parts of a fibril's length by which the ends of a yarn that slid side by side may differ."""
START = "start"
"""What the starts are called in messages: the argument of `run_study` and the option of the command."""


def repeat(weave: Weave) -> tuple[int, int]:
    """The fewest yarns of warp and of weft of which whole copies make the weave: all of them where nothing repeats.

    >>> from circuittex.design import plain_weave
    >>> repeat(plain_weave(yarns=8).weave), repeat(plain_weave(yarns=3).weave)
    ((2, 2), (3, 3))
    """
    columns = zip(*weave.draft, strict=True)
    rows = [(kind.name, row) for kind, row in zip(weave.warp, weave.draft, strict=True)]
    turned = [(kind.name, column) for kind, column in zip(weave.weft, columns, strict=True)]
    warp, weft = (
        next(n for n in range(1, len(of) + 1) if len(of) % n == 0 and of == of[:n] * (len(of) // n))
        for of in (rows, turned)
    )
    return warp, weft


def repeated_cell(design: Design) -> Design:
    """The smallest cell of which whole copies make the weave of a design, with elements as long as there or shorter.

    Its clamps are held, or copies would not meet.

    Raises `DesignError` where there is none: the draft does not repeat, or the packing is random.

    >>> from circuittex.design import plain_weave
    >>> small = repeated_cell(plain_weave())
    >>> small.weave.draft, small.numerics.elements
    (((0, 1), (1, 0)), 10)
    """
    weave, numerics, resolution = design.weave, design.numerics, design.resolution
    warps, wefts = len(weave.warp), len(weave.weft)
    warp, weft = repeat(weave)
    if (warp, weft) == (warps, wefts):
        raise DesignError(START, "tiled", f"the draft of {warps} x {wefts} yarns is no whole number of smaller cells")
    if not design.packing.regular:
        raise DesignError(START, "tiled", "no cell repeats in a random packing")
    wanted = max(-(-resolution.elements * warp // warps), -(-resolution.elements * weft // wefts))
    return replace(
        design,
        weave=replace(
            weave, draft=tuple(row[:weft] for row in weave.draft[:warp]), warp=weave.warp[:warp], weft=weave.weft[:weft]
        ),
        numerics=replace(
            numerics,
            elements=max(wanted, -(-3 // numerics.order)),  # contact needs four nodes on a fibril
            contact_points=resolution.contact_points,
            merge_length=AUTO,
            snap_length=AUTO,
        ),
        loading=(),
        terminals=(),
        probes=(),
        clamps=Clamps(),
    )


def tiled(
    mesh: FibrilMesh,
    design: Design,
    *,
    solver: LinearSolver | None = None,
    report: Callable[[int, float], None] | None = None,
) -> Configuration:
    """The start from copies of the smallest cell that the draft repeats (`repeated_cell`), relaxed between clamps.

    Every copy has the displacements of that cell from its initial weave, so that copies meet where they are clamped.
    `report` is told of every iteration of the small cell's relaxation.

    Raises `DesignError` where no cell repeats, or where copies of its equilibrium are no start (`check_start`);
    `ConvergenceError` where it has no equilibrium.
    """
    small = repeated_cell(design)
    cell = build_mesh(small)
    try:
        found = relax(cell, small, solver=solver, report=report).configuration
    except ConvergenceError as error:
        raise type(error)(f"the smaller cell of the start: {error}", error.history) from error
    start = laid_out(Configuration(found.x - initial_configuration(cell).x), cell, mesh)
    check_start(mesh, design, start, "tiled")
    return start


def laid_out(moved: Configuration, cell: FibrilMesh, mesh: FibrilMesh) -> Configuration:
    """The initial weave of `mesh`, each part of it moved like the part of the smaller `cell` that it repeats.

    `moved` are displacements of the cell's nodes. Where two copies of a fibril meet, the mean of both holds.
    """
    fibril = mesh.node_fibril
    axis = mesh.yarn_axis[mesh.yarn][fibril]
    copies = (_yarns(mesh) // _yarns(cell))[1 - axis]  # along a fibril, as many as of the yarns that it crosses
    elements, intervals = int(cell.first_element[1]), (np.diff(mesh.first_node) - 1)[fibril]
    # Which element of which copy a node lies in, and where: whole numbers, so that nested meshes are met exactly.
    number, part = np.divmod((np.arange(mesh.n_nodes) - mesh.first_node[fibril]) * copies * elements, intervals)
    source, t = _original(mesh, cell)[fibril], part / intervals
    starts = (number % elements == 0) & (part == 0)
    after = field_at(moved.x, cell, source, number % elements, t)
    before = field_at(
        moved.x, cell, source, np.where(starts, elements - 1, number % elements), np.where(starts, 1.0, t)
    )
    first, last = (number == 0)[:, None, None], (number == copies * elements)[:, None, None]
    mean = np.where(first, after, np.where(last, before, (before + after) / 2))
    return Configuration(initial_configuration(mesh).x + mean)


def _yarns(mesh: FibrilMesh) -> Ints:
    """(2,) the numbers of warp and of weft yarns."""
    return np.bincount(mesh.yarn_axis, minlength=2)


def _original(mesh: FibrilMesh, cell: FibrilMesh) -> Ints:
    """(F,) the fibril of the cell that each of the mesh repeats."""
    warps, yarn = _yarns(mesh)[0], mesh.yarn
    (few, others) = _yarns(cell)
    repeated = np.where(yarn < warps, yarn % few, few + (yarn - warps) % others)
    within = np.arange(mesh.n_fibrils) - np.searchsorted(yarn, yarn)
    return np.asarray(np.searchsorted(cell.yarn, repeated) + within)


def from_state(mesh: FibrilMesh, design: Design, state: Configuration, source: FibrilMesh) -> Configuration:
    """The start with the displacements, from its own initial weave, of a relaxed `state` of a similar weave.

    `source` is the mesh of the state, with as many warp and weft yarns, as many fibrils in each and any elements.
    Materials, radii, pitches and the contact may be others. Where a design gives clamps a force, they may have slid.

    Raises `DesignError` where it cannot be a start of this design (`check_start`).
    """
    counts = [[np.bincount(of.yarn)[of.yarn_axis == axis].tolist() for axis in (0, 1)] for of in (source, mesh)]
    if counts[0] != counts[1]:
        (warp, weft), (own_warp, own_weft) = counts
        raise DesignError(
            START,
            "state",
            "its yarns must have as many fibrils as this design's, warp and weft: "
            f"{warp} and {weft}, {own_warp} and {own_weft}",
        )
    moved = Configuration(state.x - initial_configuration(source).x)
    slid = _slid(moved, source, design)
    x = initial_configuration(mesh).x + transfer(moved, source, mesh).x
    moving = sliding(mesh, design, "xy")
    if moving is not None:  # side by side to the last digit, as the relaxation keeps them
        rows, origin = moving.motions.unknown, initial_configuration(mesh).x.ravel()
        x.ravel()[rows] = origin[rows] + moving.motions.part * slid[moving.motions.motion]
    start = Configuration(x)
    check_start(mesh, design, start, "state")
    return start


def _slid(moved: Configuration, source: FibrilMesh, design: Design) -> Floats:
    """(K,) how far the clamps of each yarn for which the design gives a force have slid; DesignError where any end has
    been displaced otherwise."""
    left, slid = moved.x.copy(), np.empty(0)
    moving = sliding(source, design, "xy")
    if moving is not None:
        motions = moving.motions
        slid = moved.x.ravel()[motions.leader]
        rest = left.ravel()[motions.unknown] - motions.part * slid[motions.motion]
        left.ravel()[motions.unknown] = np.where(np.abs(rest) > ROUNDING * source.length.max(), rest, 0.0)
    if np.any(left[source.ends, 0]):
        allowed = (
            "its clamps must be where they were woven, or have slid under a force that this design gives as well: a "
            "relaxed state, without strain"
        )
        raise DesignError(START, "state", allowed)
    return slid


def check_start(mesh: FibrilMesh, design: Design, start: Configuration, which: str) -> None:
    """Refuse a start with fibrils on the wrong side of one another or with sections inside out.

    Raises `DesignError` in one sentence; `which` start it is.
    """
    try:
        check_sides(mesh, design, start.r, REST)
    except PenetrationError as error:
        pair = str(error).partition(";")[0]
        raise DesignError(START, which, f"in it {pair}: take another, or the initial weave") from error
    space, beam, _ = force_terms(mesh, design)
    if not np.isfinite(beam.energy(space.vector(start))):
        raise DesignError(START, which, "in it a fibril's section is inside out: take another, or the initial weave")
