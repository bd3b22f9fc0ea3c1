"""The network of a panel: which nodes there are, and which resistors lie between them.

There is a node on the warp and on the weft yarn of every crossing; those of an electrode are one. A yarn's resistor
between two crossings is the sum of the two arms Ry/2 that meet there. One arm leads on to a yarn end, where an
electrode has it: nothing flows to the others.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.study.panel.cells import LocalResistances, local_resistances
from circuittex.study.panel.cutting import Flags, Severed, severed, within
from circuittex.study.panel.electrodes import Numbers, owners
from circuittex.study.panel.statement import Panel, check_crossing, yarns_named

WARP, WEFT, CROSSING = 0, 1, 2


@frozen
class Wiring:
    """The K nodes and R resistors of a panel that its P electrodes reach; node p < P is electrode p."""

    panel: Panel
    """What was wired."""
    local: LocalResistances
    """Resistances of the cells."""
    node: Numbers
    """(2, n, m) node on the warp and on the weft yarn of each crossing; -1 where no electrode reaches."""
    n_nodes: int
    """K."""
    ends: Numbers
    """(2, R) nodes of each resistor."""
    resistance: Floats
    """(R,) ohm."""
    kind: NDArray[np.int8]
    """(R,) `WARP` or `WEFT` segment, or `CROSSING`."""
    place: Numbers
    """(R,) flat number of the crossing in (n, m), or of the segment in (n, m + 1) warp or (n + 1, m) weft ones."""
    island: Numbers
    """(P,) number of the connected part that each electrode belongs to."""
    notes: tuple[str, ...]
    """What was left out or clamped."""


def wire(panel: Panel) -> Wiring:
    """The network of a panel.

    Raises `DesignError` for electrodes that touch nothing or the same place, and strains beyond what is known.

    >>> from circuittex.study.panel.cells import CellResistances
    >>> from circuittex.study.panel.statement import Electrode
    >>> ends = (Electrode("a", ends=("warp1-",)), Electrode("b", ends=("weft1+",)))
    >>> wire(Panel((1, 1), CellResistances(2.0, 2.0, 5.0), ends)).resistance.tolist()
    [1.0, 1.0, 5.0]
    """
    (n, m), count = panel.shape, len(panel.electrodes)
    local = local_resistances(panel.cells, panel.strain, panel.outside)
    gone, conducts = severed(panel), _conducting(panel, local)
    owner = owners(panel, gone, conducts)
    grid = count + np.arange(2 * n * m, dtype=np.int32).reshape(2, n, m)
    grid = np.where(owner.crossing >= 0, owner.crossing, grid)
    parts = [
        _along(WARP, grid[0], owner.warp, local.warp, gone.warp, conducts[0]),
        _along(WEFT, grid[1].T, owner.weft, local.weft.T, gone.weft.T, conducts[1]),
        _across(panel, grid, local, gone, conducts),
    ]
    a, b, ohm, kind, place = (np.concatenate(each) for each in zip(*parts, strict=True))
    size = count + 2 * n * m
    graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(size, size))
    label = connected_components(graph, directed=False)[1]
    reached = np.isin(label, label[:count])
    number = np.where(reached, np.cumsum(reached, dtype=np.int32) - 1, np.int32(-1))
    there = reached[a]
    return Wiring(
        panel=panel,
        local=local,
        node=number[grid],
        n_nodes=int(reached.sum()),
        ends=np.stack([number[a[there]], number[b[there]]]),
        resistance=ohm[there],
        kind=kind[there],
        place=place[there],
        island=label[:count].astype(np.int32),
        notes=(*owner.notes, *_notes(panel, local, number[grid], gone, conducts)),
    )


Part = tuple[Numbers, Numbers, Floats, NDArray[np.int8], Numbers]


def _conducting(panel: Panel, local: LocalResistances) -> tuple[Flags, Flags]:
    """Which warp yarns (n,) and weft yarns (m,) conduct."""
    found: dict[str, Flags] = {
        "warp": np.asarray(np.isfinite(local.warp).all(axis=1)),
        "weft": np.asarray(np.isfinite(local.weft).all(axis=0)),
    }
    for word in panel.insulating:
        way, which, _ = yarns_named(word, panel.shape, "panel.insulating")
        found[way][which] = False
    return found["warp"], found["weft"]


def _along(kind: int, grid: Numbers, ends: Numbers, Ry: Floats, gone: Flags, conducts: Flags) -> Part:
    """Segments of all yarns of one direction; arrays have a row for each yarn and a column for each crossing."""
    line = np.concatenate([ends[:, :1], grid, ends[:, 1:]], axis=1)
    a, b = line[:, :-1], line[:, 1:]
    arm = np.pad(0.5 * Ry, ((0, 0), (1, 1)))
    there = (a >= 0) & (b >= 0) & (a != b) & ~gone & conducts[:, None]
    number: Numbers = np.arange(a.size, dtype=np.int32)
    place = number.reshape(a.shape) if kind == WARP else number.reshape(a.shape[::-1]).T
    ohm = (arm[:, :-1] + arm[:, 1:])[there]
    return a[there], b[there], ohm, np.full(len(ohm), kind, dtype=np.int8), place[there]


def _across(panel: Panel, grid: Numbers, local: LocalResistances, gone: Severed, conducts: tuple[Flags, Flags]) -> Part:
    """The crossings with the seams beside them."""
    siemens = 1.0 / local.crossing
    for seam in panel.seams:
        if seam.rectangle is not None:
            siemens[within(panel, seam.rectangle)] += 1.0 / seam.resistance
        else:
            at = np.array([check_crossing(pair, panel.shape) for pair in seam.crossings]) - 1
            siemens[at[:, 0], at[:, 1]] += 1.0 / seam.resistance
    a, b = grid
    there = (siemens > 0.0) & (a != b) & ~gone.crossing & conducts[0][:, None] & conducts[1][None, :]
    place = np.flatnonzero(there).astype(np.int32)
    return a[there], b[there], 1.0 / siemens[there], np.full(len(place), CROSSING, dtype=np.int8), place


def _notes(
    panel: Panel, local: LocalResistances, node: Numbers, gone: Severed, conducts: tuple[Flags, Flags]
) -> list[str]:
    """What a user should know of what was clamped and what no electrode reaches."""
    notes = []
    if local.clamped:
        low, high = panel.cells.strain[0], panel.cells.strain[-1]
        notes.append(
            f"strain: {local.clamped} cells lie beyond what is known, {low:g} to {high:g}: they have the last values"
        )
    live = np.stack(np.broadcast_arrays(conducts[0][:, None], conducts[1][None, :])) & ~gone.crossing
    lost = np.argwhere(live & (node < 0))
    if len(lost):
        layer, i, j = lost[0]
        where = f"warp{i + 1} at weft{j + 1}" if layer == 0 else f"weft{j + 1} at warp{i + 1}"
        notes.append(f"no electrode reaches {len(lost)} places of yarns, the first is {where}: they are left out")
    return notes
