"""Where the electrodes of a panel are: the owner of each crossing's two nodes and of each yarn end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from circuittex.base.frozen import frozen
from circuittex.design.checks import refuse
from circuittex.study.panel.cutting import Flags, Severed, within
from circuittex.study.panel.statement import Electrode, Panel, yarns_named

Numbers = NDArray[np.int32]
_EDGES = {"left": ("warp", 0), "right": ("warp", 1), "bottom": ("weft", 0), "top": ("weft", 1)}


@frozen
class Owners:
    """Numbers of electrodes, -1 where there is none."""

    crossing: Numbers
    """(2, n, m) of the node on the warp and on the weft yarn of each crossing."""
    warp: Numbers
    """(n, 2) of the minus and the plus end of each warp yarn."""
    weft: Numbers
    """(m, 2) of the minus and the plus end of each weft yarn."""
    notes: tuple[str, ...]
    """Edges of which some yarn ends are cut or insulating."""


def owners(panel: Panel, gone: Severed, conducts: tuple[Flags, Flags]) -> Owners:
    """The electrode of each place; `conducts` tells it of the warp yarns (n,) and of the weft yarns (m,).

    Raises `DesignError` for an electrode on a yarn end that is cut off or insulating, one that touches nothing, and
    two that touch the same place.
    """
    n, m = panel.shape
    crossing = np.full((2, n, m), -1, dtype=np.int32)
    ends = {"warp": np.full((n, 2), -1, dtype=np.int32), "weft": np.full((m, 2), -1, dtype=np.int32)}
    live = {"warp": conducts[0], "weft": conducts[1]}
    attached = {"warp": ~gone.warp[:, [0, -1]], "weft": ~gone.weft[[0, -1]].T}
    notes: list[str] = []
    for number, electrode in enumerate(panel.electrodes):
        at = f"electrodes.{electrode.name}"
        for word in electrode.ends:
            way, which, sign = yarns_named(word, panel.shape, f"{at}.ends", ends=True)
            side = (sign + 1) // 2
            if not live[way][which].all():
                yarn = which.start + int(np.argmin(live[way][which]))
                raise refuse(f"{at}.ends", word, f"{way}{yarn + 1} is insulating")
            if not attached[way][which, side].all():
                yarn = which.start + int(np.argmin(attached[way][which, side]))
                raise refuse(f"{at}.ends", word, f"this end of {way}{yarn + 1} is cut off before its first crossing")
            _claim(ends[way][which, side], live[way][which], number, panel.electrodes, word)
        if electrode.edge:
            way, side = _EDGES[electrode.edge]
            usable = live[way] & attached[way][:, side]
            if not usable.any():
                raise refuse(f"{at}.edge", electrode.edge, "every yarn end there is cut off or insulating")
            if not usable.all():
                notes.append(f"{at}: {int((~usable).sum())} of its yarn ends are cut off or insulating")
            _claim(ends[way][:, side], usable, number, panel.electrodes, electrode.edge)
        if electrode.rectangle is not None:
            box = within(panel, electrode.rectangle)
            there = ~gone.crossing[box]
            usable = np.stack([there & live["warp"][box[0], None], there & live["weft"][None, box[1]]])
            if not usable.any():
                allowed = "there is no crossing of a conducting yarn in it that is not cut out; the panel reaches from "
                width, height = panel.size
                raise refuse(f"{at}.rectangle", electrode.rectangle, f"{allowed}(0, 0) to ({width:g}, {height:g}) mm")
            _claim(crossing[(slice(None), *box)], usable, number, panel.electrodes, "its rectangle")
    return Owners(crossing, ends["warp"], ends["weft"], tuple(notes))


def _claim(places: Numbers, wanted: Flags, number: int, electrodes: Sequence[Electrode], what: object) -> None:
    """Give places, a view, to an electrode."""
    taken = places[wanted]
    other = taken[(taken >= 0) & (taken != number)]
    if len(other):
        first = electrodes[int(other[0])].name
        raise refuse(f"electrodes.{electrodes[number].name}", what, f"electrode {first!r} touches the same place")
    places[wanted] = number
