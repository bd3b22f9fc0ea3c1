"""The weave: which yarn passes over which, and how far apart they are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from math import pi

from circuittex.base.frozen import frozen, same
from circuittex.design.checks import instances, refuse, sequence, store, whole
from circuittex.design.declaration import check, choice, number
from circuittex.design.wave import PATHS, PEIRCE, SINE, Wave, cosine, peirce
from circuittex.design.yarn import MOST_OPEN, Material, Yarn

SAME = "same"
"""Stands for a length of the weft that is that of the warp."""


@frozen
class Direction:
    """The yarns of a weave that run in one direction."""

    name: str
    """'warp' or 'weft'."""
    yarns: tuple[Yarn, ...]
    """The kind of each."""
    pitch: float
    """Distance of the axes of neighbours, mm."""
    step: float
    """From crossing to crossing along a yarn, mm: the pitch of the yarns that it crosses."""
    crossings: int
    """Of each yarn."""
    amplitude: float
    """Height H of the axes above or below the mid-plane at a crossing, mm."""


@frozen
class Weave:
    """Which yarn passes over which, and how far apart they are.

    ``draft[i][j] = 1``: warp i passes over weft j. Warp yarns run along x (the first has the
    smallest y), weft yarns along y (the first has the smallest x).
    """

    draft: tuple[tuple[int, ...], ...]
    """One row for each warp yarn, one column for each weft yarn."""
    warp: tuple[Yarn, ...]
    """The kind of each warp yarn."""
    weft: tuple[Yarn, ...]
    """The kind of each weft yarn."""
    pitch: float = field(metadata=number("mm", "between the axes of neighbouring warp yarns", shown="2.5 mm", above=0))
    """Distance of the axes of neighbouring warp yarns, mm."""
    amplitude: float = field(
        metadata=number(
            "mm", "height H of a warp axis above or below the mid-plane at a crossing", shown="0.46 mm", at_least=0
        )
    )
    """Height H of a warp yarn's axis above or below the mid-plane at a crossing, mm."""
    weft_pitch: float | str = field(
        default=SAME,
        metadata=number(
            "mm", 'between the axes of neighbouring weft yarns; "same": as the warp', shown=SAME, above=0, words=(SAME,)
        ),
    )
    """Distance of the axes of neighbouring weft yarns, mm; 'same': as that of the warp's."""
    weft_amplitude: float | str = field(
        default=SAME,
        metadata=number("mm", 'H of the weft; "same": as the warp', shown=SAME, at_least=0, words=(SAME,)),
    )
    """Height of a weft yarn's axis above or below the mid-plane at a crossing, mm; 'same': as that of the warp's."""
    path: str = field(
        default=SINE,
        kw_only=True,
        metadata=choice(
            'of the yarn axes: the paper\'s "sine", or "peirce", arcs about the crossing yarns and straight pieces',
            PATHS,
            shown=SINE,
        ),
    )
    """'sine', or 'peirce': arcs about the crossing yarns, whose axes are H + H' away, and straight pieces between."""

    def __post_init__(self) -> None:
        store(
            self,
            draft=check_draft(self.draft, "weave.draft"),
            warp=instances(self.warp, "weave.warp", Yarn, "Yarn"),
            weft=instances(self.weft, "weave.weft", Yarn, "Yarn"),
        )
        check(self, "weave")
        for which, wanted in (("warp", len(self.draft)), ("weft", len(self.draft[0]))):
            if len(getattr(self, which)) != wanted:
                side = "row" if which == "warp" else "column"
                raise refuse(
                    f"weave.{which}", len(getattr(self, which)), f"the draft needs {wanted} yarns, one for each {side}"
                )
        self._check_names()
        self._check_proportions()
        self._check_curvature()

    def _check_names(self) -> None:
        # Resistances are fitted and listed by name: two kinds under one would share what neither has.
        materials = (material for yarn in self.yarns for material in (*yarn.materials, *yarn.surfaces))
        named: tuple[tuple[str, Iterable[Yarn | Material]], ...] = (("yarns", self.yarns), ("materials", materials))
        for kind, things in named:
            known: dict[str, Yarn | Material] = {}
            for each in things:
                if not same(known.setdefault(each.name, each), each):
                    raise refuse(f"{kind}.{each.name}", each.name, f"two different {kind} have this name")

    def _check_proportions(self) -> None:
        # Lengths against one another, so that a design of any size is judged alike.
        for direction in self.directions:
            pitch = direction.pitch
            for yarn in direction.yarns:
                at = f"yarns.{yarn.name}"
                for key in ("spacing", "row_spacing"):
                    if getattr(yarn, key) > pitch:
                        allowed = f"it must be at most the pitch of the weave, {pitch:g} mm"
                        raise refuse(f"{at}.{key}", getattr(yarn, key), allowed)
                if (max(yarn.rows) - 1) * yarn.spacing > pitch:
                    allowed = f"a row of {max(yarn.rows)} fibrils must not be wider than the pitch, {pitch:g} mm"
                    raise refuse(f"{at}.spacing", yarn.spacing, allowed)
        radius = min(yarn.radius for yarn in self.yarns)
        for direction in self.directions:
            if direction.amplitude > direction.step:
                allowed = f"it must be at most the pitch, {direction.step:g} mm: no yarn is as steep"
                raise refuse(self.key(direction, "amplitude"), direction.amplitude, allowed)
            if direction.pitch > MOST_OPEN * radius:
                allowed = f"it must be at most {MOST_OPEN * radius:g} mm, {MOST_OPEN:g} of the smallest radii"
                raise refuse(self.key(direction, "pitch"), direction.pitch, allowed)

    def _check_curvature(self) -> None:
        if self.path == PEIRCE:
            self._check_arcs()
            return
        # The section at a crest turns inside out where R >= radius of curvature = step^2 / (pi^2 H).
        for direction in self.directions:
            radius = max(yarn.radius for yarn in direction.yarns)
            largest = direction.step**2 / (pi**2 * radius)
            if direction.amplitude >= largest:
                raise refuse(
                    self.key(direction, "amplitude"),
                    direction.amplitude,
                    f"fibrils of radius {radius:g} mm at a pitch of {direction.step:g} mm cannot bend that far; "
                    f"it must be < {largest:.4g} mm (pitch^2 / (pi^2 radius))",
                )

    def _check_arcs(self) -> None:
        apart, radius = self.apart, max(yarn.radius for yarn in self.yarns)
        if not apart > radius:
            allowed = f"axes {apart:g} mm apart: fibrils of radius {radius:g} mm cannot bend about one another"
            raise refuse("weave.path", PEIRCE, allowed)
        for direction in self.directions:
            if not peirce(direction.step, direction.amplitude, apart).straight >= 0.0:
                near = f"{direction.step:g} mm from crossing to crossing, with axes {apart:g} mm apart there"
                allowed = f"the {direction.name} is jammed: {near}, leave its arcs no room"
                raise refuse("weave.path", PEIRCE, allowed)

    @property
    def apart(self) -> float:
        """Distance of the axes of two yarns at their crossing, mm."""
        warp, weft = self.directions
        return warp.amplitude + weft.amplitude

    def wave(self, direction: Direction) -> Wave:
        """The wave of the yarns of a direction from crossing to crossing."""
        if self.path == SINE or direction.amplitude == 0.0:
            return cosine
        return peirce(direction.step, direction.amplitude, self.apart).at

    @property
    def directions(self) -> tuple[Direction, Direction]:
        """The warp and the weft, with the lengths of each.

        >>> from circuittex.design import plain_weave
        >>> from dataclasses import replace
        >>> [each.step for each in replace(plain_weave().weave, weft_pitch=1.5).directions]
        [1.5, 2.0]
        """
        pitch = self.pitch if isinstance(self.weft_pitch, str) else self.weft_pitch
        amplitude = self.amplitude if isinstance(self.weft_amplitude, str) else self.weft_amplitude
        return (
            Direction("warp", self.warp, self.pitch, pitch, len(self.weft), self.amplitude),
            Direction("weft", self.weft, pitch, self.pitch, len(self.warp), amplitude),
        )

    def key(self, direction: Direction, length: str) -> str:
        """Dotted name of the key that states the 'pitch' or the 'amplitude' of a direction."""
        own = direction.name == "weft" and getattr(self, f"weft_{length}") != SAME
        return f"weave.weft_{length}" if own else f"weave.{length}"

    @property
    def least_pitch(self) -> float:
        """The smaller of the distances of neighbouring yarns, mm."""
        return min(direction.pitch for direction in self.directions)

    @property
    def yarns(self) -> tuple[Yarn, ...]:
        """All yarns, the warp first: the order of the mesh."""
        return self.warp + self.weft

    @property
    def yarn_names(self) -> tuple[str, ...]:
        """warp1, warp2, ..., weft1, weft2, ... in the order of `yarns`."""
        warp = tuple(f"warp{i + 1}" for i in range(len(self.warp)))
        return warp + tuple(f"weft{j + 1}" for j in range(len(self.weft)))


def check_draft(draft: object, field: str) -> tuple[tuple[int, ...], ...]:
    """The draft as a rectangular matrix of 0 and 1.

    >>> check_draft([[1, 0], [0, 1]], "weave.draft")
    ((1, 0), (0, 1))
    """
    wanted = "rows of 0 and 1, one row for each warp yarn"
    rows = [sequence(row, f"{field}[{i}]", wanted) for i, row in enumerate(sequence(draft, field, wanted))]
    if not rows:
        raise refuse(field, draft, f"it must be a list of {wanted}")
    for i, row in enumerate(rows):
        if not row:
            raise refuse(f"{field}[{i}]", row, f"it must be a list of {wanted}")
        if len(row) != len(rows[0]):
            raise refuse(f"{field}[{i}]", row, f"every row must have as many entries as the first, {len(rows[0])}")
    return tuple(
        tuple(whole(cell, f"{field}[{i}][{j}]", 0, 1) for j, cell in enumerate(row)) for i, row in enumerate(rows)
    )
