"""What a panel is: its yarns, the resistances of its cells, electrodes, cuts, seams and strain."""

from __future__ import annotations

import re
from dataclasses import field
from typing import Any

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.design.checks import LARGEST, distinct, is_name, one_of, real, refuse, store, title, whole
from circuittex.study.panel.cells import OUTSIDE, CellResistances

MOST_CELLS = 5_000_000
"""Cells of a panel: 15 million resistors, which take some GB."""
MOST_ELECTRODES = 512
MOST_VALUES = 500_000_000
"""Voltages that are kept, one at every node for each electrode: 4 GB."""
EDGES = ("left", "right", "bottom", "top")
"""Edges of a panel: the minus and plus ends of all warp yarns, and those of all weft yarns."""
_YARNS = re.compile(r"(warp|weft)([1-9][0-9]{0,8})(?:\.\.([1-9][0-9]{0,8}))?([+-]?)", re.ASCII)
_WANTED = "a yarn is written like 'warp3' and several like 'warp3..8'"

Box = tuple[float, float, float, float]
"""(x0, y0, x1, y1) of two corners of a rectangle, mm."""
Point = tuple[float, float]


@frozen
class Electrode:
    """Places of a panel that are joined: yarn ends, whole edges, and a rectangle's crossings.

    >>> Electrode("left", ends=("warp1..4-",), voltage=5.0).voltage
    5.0
    """

    name: str
    """What it is called; its pin in netlists."""
    ends: tuple[str, ...] = ()
    """Yarn ends: 'warp3-' (its end with the smallest x), 'weft2+', and 'warp3..8-' for several."""
    edge: str = ""
    """'left' and 'right' have the ends of all warp yarns, 'bottom' and 'top' those of all weft yarns."""
    rectangle: Box | None = None
    """Both yarns of every crossing in it are joined [mm]."""
    voltage: float | None = None
    """At which it is held, V."""
    current: float | None = None
    """That is fed in, A; an electrode with neither voltage nor current is open."""

    def __post_init__(self) -> None:
        at = "electrodes"
        if not isinstance(self.name, str) or not is_name(self.name):
            raise refuse(at, self.name, "a name is a letter followed by at most 39 letters, digits, '_' or '-' (ASCII)")
        at = f"electrodes.{self.name}"
        ends = (self.ends,) if isinstance(self.ends, str) else tuple(self.ends)
        if self.edge:
            one_of(self.edge, f"{at}.edge", EDGES)
        if not (ends or self.edge or self.rectangle is not None):
            raise refuse(at, "nothing", "it needs ends, such as ['warp1-'], an edge, or a rectangle")
        if self.voltage is not None and self.current is not None:
            raise refuse(f"{at}.current", self.current, "an electrode has a voltage or a current, not both")
        store(self, ends=ends, rectangle=_box(self.rectangle, f"{at}.rectangle"))
        for key, unit in (("voltage", "V"), ("current", "A")):
            value = getattr(self, key)
            if value is not None:
                store(self, **{key: real(value, f"{at}.{key}", unit, at_least=-1e6, at_most=1e6)})

    @property
    def driven(self) -> bool:
        """Whether it is held at a voltage or fed with a current other than none."""
        return self.voltage is not None or bool(self.current)


@frozen
class Cut:
    """Yarns cut along a line, or everything cut out of a rectangle.

    >>> Cut(line=((10, 0), (10, 30))).line
    ((10.0, 0.0), (10.0, 30.0))
    """

    line: tuple[Point, Point] | None = None
    """Both ends of it, mm; every yarn that it crosses is cut there."""
    rectangle: Box | None = None
    """Yarn segments that reach into it, and the crossings in it, are gone [mm]."""

    def __post_init__(self) -> None:
        if (self.line is None) == (self.rectangle is None):
            raise refuse("cuts", self.line or "nothing", "a cut has either a line or a rectangle")
        store(self, line=_line(self.line, "cuts.line"), rectangle=_box(self.rectangle, "cuts.rectangle"))


@frozen
class Seam:
    """Crossings whose two yarns are joined by a resistance beside their own.

    >>> Seam(0.5, crossings=((1, 2),)).resistance
    0.5
    """

    resistance: float
    """From yarn to yarn at each crossing, ohm."""
    crossings: tuple[tuple[int, int], ...] = ()
    """(warp, weft) numbers of the crossings, from 1."""
    rectangle: Box | None = None
    """All crossings in it [mm]."""

    def __post_init__(self) -> None:
        at = "seams"
        store(self, resistance=real(self.resistance, f"{at}.resistance", "ohm", above=0))
        if bool(len(self.crossings)) == (self.rectangle is not None):
            raise refuse(at, "both" if self.crossings else "nothing", "a seam has either crossings or a rectangle")
        pairs = []
        for k, pair in enumerate(self.crossings):
            if isinstance(pair, str) or not hasattr(pair, "__len__") or len(pair) != 2:
                raise refuse(f"{at}.crossings[{k}]", pair, "it must be a pair [warp, weft] of numbers from 1")
            pairs.append(tuple(whole(number, f"{at}.crossings[{k}]", 1, MOST_CELLS) for number in pair))
        store(self, crossings=tuple(pairs), rectangle=_box(self.rectangle, f"{at}.rectangle"))


@frozen
class Panel:
    """A fabric of n warp and m weft yarns with what is connected, cut, sewn and strained.

    The panel lies between (0, 0) and (m pitch, n pitch); the crossing of warp i and weft j, counted from 1, is at
    x = (j - 1/2) pitch, y = (i - 1/2) pitch.

    >>> ends = (Electrode("left", edge="left", voltage=1.0), Electrode("right", edge="right", voltage=0.0))
    >>> Panel((4, 6), CellResistances(0.28, 0.28, 300.0), ends).size
    (6.0, 4.0)
    """

    shape: tuple[int, int]
    """(n, m) warp and weft yarns."""
    cells: CellResistances
    """Ry and Rc as functions of strain."""
    electrodes: tuple[Electrode, ...]
    """(P,) what is connected."""
    strain: Floats = field(default_factory=lambda: np.zeros((1, 1)))
    """(n, m) strain of each cell, or one for all."""
    pitch: float = 1.0
    """Distance of neighbouring yarns, mm."""
    cuts: tuple[Cut, ...] = ()
    """What is cut."""
    seams: tuple[Seam, ...] = ()
    """What is joined."""
    insulating: tuple[str, ...] = ()
    """Yarns that do not conduct: 'warp3', 'weft2..5'."""
    outside: str = "refuse"
    """What becomes of cells strained beyond what is known: 'refuse', or 'clamp' them there with a note."""
    name: str = "panel"
    """A title."""

    def __post_init__(self) -> None:
        shape = check_shape(self.shape)
        if not isinstance(self.cells, CellResistances):
            raise refuse("resistance", self.cells, "it must be CellResistances")
        strain = np.array(self.strain, dtype=np.float64)
        if strain.ndim == 0:
            strain = strain.reshape(1, 1)
        if strain.shape not in ((1, 1), shape):
            raise refuse("strain", strain.shape, f"it must be one number or an array {shape}, (warp, weft)")
        if not np.isfinite(strain).all():
            where = np.argwhere(~np.isfinite(strain))[0]
            raise refuse(
                "strain", f"{strain[tuple(where)]} at warp{where[0] + 1}, weft{where[1] + 1}", "it must be finite"
            )
        strain = np.broadcast_to(strain, shape)
        insulating = (self.insulating,) if isinstance(self.insulating, str) else tuple(self.insulating)
        electrodes = tuple(self.electrodes)
        if not electrodes:
            raise refuse("electrodes", "nothing", "a panel needs at least one electrode")
        if len(electrodes) > MOST_ELECTRODES:
            raise refuse("electrodes", len(electrodes), f"a panel has at most {MOST_ELECTRODES}")
        most = MOST_VALUES // (2 * shape[0] * shape[1])
        if len(electrodes) > most:
            raise refuse("electrodes", len(electrodes), f"a panel of {shape[0]} x {shape[1]} cells has at most {most}")
        distinct(tuple(each.name for each in electrodes), "electrodes")
        store(
            self,
            shape=shape,
            pitch=real(self.pitch, "panel.pitch", "mm", above=0),
            outside=one_of(self.outside, "strain.outside", OUTSIDE),
            name=title(self.name, "name"),
            strain=strain,
            insulating=insulating,
            electrodes=electrodes,
            cuts=tuple(self.cuts),
            seams=tuple(self.seams),
        )
        for k, yarn in enumerate(insulating):
            yarns_named(yarn, shape, f"panel.insulating[{k}]")
        for k, cut in enumerate(self.cuts):
            corners = cut.rectangle if cut.line is None else (*np.min(cut.line, axis=0), *np.max(cut.line, axis=0))
            self._check_inside(f"cuts[{k}]", cut.rectangle or cut.line, corners)
        for k, seam in enumerate(self.seams):
            self._check_inside(f"seams[{k}].rectangle", seam.rectangle, seam.rectangle)

    def _check_inside(self, at: str, stated: object, corners: tuple[float, ...] | None) -> None:
        """Refuse what lies beside the panel and would do nothing."""
        if corners is None:
            return
        (x0, y0, x1, y1), (width, height) = corners, self.size
        if x1 < 0.0 or y1 < 0.0 or x0 > width or y0 > height:
            raise refuse(
                at, stated, f"it lies beside the panel, which reaches from (0, 0) to ({width:g}, {height:g}) mm"
            )

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, mm."""
        return self.shape[1] * self.pitch, self.shape[0] * self.pitch

    @property
    def x(self) -> Floats:
        """(m,) places of the weft yarns, mm."""
        return places(self.shape[1], self.pitch)

    @property
    def y(self) -> Floats:
        """(n,) places of the warp yarns, mm."""
        return places(self.shape[0], self.pitch)


def places(count: int, pitch: float) -> Floats:
    """Where that many yarns lie beside one another, mm.

    >>> places(3, 2.0).tolist()
    [1.0, 3.0, 5.0]
    """
    return np.asarray((np.arange(count) + 0.5) * pitch, dtype=np.float64)


def check_shape(shape: Any) -> tuple[int, int]:
    """Numbers of warp and weft yarns, refused before any work where there are too many.

    >>> check_shape((30000, 30000))
    Traceback (most recent call last):
    circuittex.base.errors.DesignError: panel: '30000 x 30000 cells' is not usable; a panel has at most 5000000 cells
    """
    if isinstance(shape, str) or not hasattr(shape, "__len__") or len(shape) != 2:
        raise refuse("panel", shape, "its shape must be two whole numbers, of warp and weft yarns")
    n = whole(shape[0], "panel.warp", 1, MOST_CELLS)
    m = whole(shape[1], "panel.weft", 1, MOST_CELLS)
    if n * m > MOST_CELLS:
        raise refuse("panel", f"{n} x {m} cells", f"a panel has at most {MOST_CELLS} cells")
    return n, m


def yarns_named(text: object, shape: tuple[int, int], path: str, *, ends: bool = False) -> tuple[str, slice, int]:
    """Direction, numbers (from 0) and side of the yarns that a word such as 'warp3..8-' names.

    >>> yarns_named("weft2..4+", (4, 6), "electrodes.a.ends", ends=True)
    ('weft', slice(1, 4, None), 1)
    """
    match = _YARNS.fullmatch(text) if isinstance(text, str) else None
    if match is None or bool(match[4]) != ends:
        wanted = "an end is written like 'warp3-' or 'weft2+', and several like 'warp3..8-'" if ends else _WANTED
        raise refuse(path, text, wanted)
    way, first = match[1], int(match[2])
    last = int(match[3] or first)
    count = shape[0] if way == "warp" else shape[1]
    if not first <= last <= count:
        raise refuse(path, text, f"the panel has {way}1 to {way}{count}")
    return way, slice(first - 1, last), -1 if match[4] == "-" else 1


def check_crossing(pair: tuple[int, int], shape: tuple[int, int]) -> tuple[int, int]:
    """A pair of numbers of a warp and a weft yarn, from 1, if the panel has both.

    >>> check_crossing((2, 3), (4, 6))
    (2, 3)
    """
    if not (1 <= pair[0] <= shape[0] and 1 <= pair[1] <= shape[1]):
        raise refuse(
            "seams.crossings", list(pair), f"the panel has warp1 to warp{shape[0]} and weft1 to weft{shape[1]}"
        )
    return pair


def _box(value: Any, path: str) -> Box | None:
    """Two corners of a rectangle, the lower left one first."""
    if value is None:
        return None
    x0, y0, x1, y1 = _numbers(value, 4, path, "it must be [x0, y0, x1, y1] in mm, two corners of the rectangle")
    if x0 == x1 or y0 == y1:
        raise refuse(path, value, "its corners must differ in x and in y")
    return min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)


def _line(value: Any, path: str) -> tuple[Point, Point] | None:
    if value is None:
        return None
    wanted = "it must be [[x0, y0], [x1, y1]] in mm, the two ends of the line"
    if isinstance(value, str) or not hasattr(value, "__len__") or len(value) != 2:
        raise refuse(path, value, wanted)
    first, last = (_numbers(point, 2, path, wanted) for point in value)
    if first == last:
        raise refuse(path, value, "its ends must differ")
    return (first[0], first[1]), (last[0], last[1])


def _numbers(value: Any, count: int, path: str, wanted: str) -> tuple[float, ...]:
    if isinstance(value, str) or not hasattr(value, "__len__") or len(value) != count:
        raise refuse(path, value, wanted)
    for number in value:
        if isinstance(number, bool) or not isinstance(number, int | float | np.number):
            raise refuse(path, value, wanted)
        if not abs(float(number)) <= LARGEST:
            raise refuse(path, value, "its numbers must be finite")
    return tuple(float(number) for number in value)
