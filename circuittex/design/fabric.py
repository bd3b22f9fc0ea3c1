"""What a textile consists of: materials, yarns, the weave, and the law of contact between fibrils."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from math import pi
from typing import NamedTuple

from circuittex.base.frozen import frozen, same
from circuittex.design.checks import instances, name, refuse, sequence, store, whole
from circuittex.design.contact_laws import PAPER, POWER, known
from circuittex.design.declaration import check, number, word

MOST_FIBRILS = 10_000
"""Fibrils of one yarn."""
MOST_OPEN = 1e5
"""Pitch over the smallest radius: the most open scrims of the thinnest fibrils have some 1e4."""
STIFFEST, HEAVIEST, MOST_CONDUCTIVE, THICKEST = 1e9, 1e6, 1e9, 1e4
"""MPa, g/mm3, S/mm and W/(mm K), mm: a thousand times and more beyond diamond, osmium, silver and a ship's rope, which
leaves room for designs in units of another scale and none for slips of the pen."""
STEEPEST = 0.0099
"""1/K: with this tc1, or its square as tc2, a resistance stays positive as far as 50 K from 27 C."""


@frozen
class Material:
    """What a fibril is made of: compressible Neo-Hookean [1], ohmic, heat conducting.

    >>> Material("silver", 10.0, 0.0, 1.0, 10.0, 1.0).electrical_conductivity
    10.0
    """

    name: str
    """What it is called."""
    youngs_modulus: float = field(
        metadata=number(
            "MPa",
            "E > 0; the paper's Table I prints 1.26 MPa, its code used 10 MPa",
            shown="10 MPa",
            above=0,
            at_most=STIFFEST,
        )
    )
    """E, MPa."""
    poisson_ratio: float = field(metadata=number("1", "nu, 0 to 0.45", shown="0.0", at_least=0, at_most=0.45))
    """nu, from 0 to 0.45."""
    density: float = field(metadata=number("g/mm3", "rho > 0", shown="1 g/mm3", above=0, at_most=HEAVIEST))
    """rho, g/mm3."""
    electrical_conductivity: float = field(
        metadata=number(
            "S/mm", "sigma >= 0; 0 makes an insulating fibril", shown="10 S/mm", at_least=0, at_most=MOST_CONDUCTIVE
        )
    )
    """sigma, S/mm; 0 for an insulator."""
    thermal_conductivity: float = field(
        metadata=number("W/(mm K)", "k > 0", shown="1 W/(mm K)", above=0, at_most=MOST_CONDUCTIVE)
    )
    """k, W/(mm K)."""
    tc1: float = field(
        default=0.0,
        metadata=number(
            "1/K",
            "of the resistivity, per kelvin from 27 C; for exported parts only",
            shown="0.0",
            at_least=-STEEPEST,
            at_most=STEEPEST,
        ),
    )
    """Linear temperature coefficient of the resistivity, 1/K: times
    1 + tc1 dT + tc2 dT^2, dT from 27 C, SPICE's tnom."""
    tc2: float = field(
        default=0.0,
        metadata=number(
            "1/K2", "of the resistivity, per kelvin squared", shown="0.0", at_least=-(STEEPEST**2), at_most=STEEPEST**2
        ),
    )
    """Quadratic temperature coefficient of the resistivity, 1/K2."""
    tolerance: float = field(
        default=0.0,
        metadata=number(
            "1", "relative, of the resistivity; for exported parts only", shown="0.0", at_least=0, at_most=0.9
        ),
    )
    """Tolerance of the resistivity, relative: from 1 - tolerance to 1 + tolerance of what is stated."""

    def __post_init__(self) -> None:
        check(self, f"materials.{name(self.name, 'materials')}")


@frozen
class Yarn:
    """A kind of yarn: parallel fibrils packed in rows, the bottom row first.

    Fibrils are numbered row by row, within a row towards growing y (warp) or x (weft).

    >>> silver = Material("silver", 10.0, 0.0, 1.0, 10.0, 1.0)
    >>> Yarn("conductive", (3, 4, 3), 0.15, 0.3, 0.3, (silver,) * 10).n_fibrils
    10
    """

    name: str
    """What it is called."""
    rows: tuple[int, ...]
    """Fibrils in each row."""
    radius: float = field(metadata=number("mm", "of every fibril", shown="0.15 mm", above=0, at_most=THICKEST))
    """R of every fibril, mm."""
    spacing: float = field(metadata=number("mm", "between the axes of neighbours in a row", shown="0.3 mm", above=0))
    """Distance of neighbours within a row, mm."""
    row_spacing: float = field(
        metadata=number(
            "mm", "optional, between neighbouring rows, vertically; default: spacing", shown="0.3 mm", above=0
        )
    )
    """Vertical distance of neighbouring rows, mm."""
    materials: tuple[Material, ...]
    """One for each fibril."""

    def __post_init__(self) -> None:
        at = f"yarns.{name(self.name, 'yarns')}"
        rows = check_rows(self.rows, f"{at}.rows")
        materials = instances(self.materials, f"{at}.materials", Material, "Material")
        if len(materials) != sum(rows):
            raise refuse(
                f"{at}.materials", len(materials), f"{sum(rows)} fibrils (rows) need one material each, row by row"
            )
        store(self, rows=rows, materials=materials)
        check(self, at)

    @property
    def n_fibrils(self) -> int:
        return sum(self.rows)


def check_rows(rows: object, field: str) -> tuple[int, ...]:
    """The numbers of fibrils in each row, checked before anything of that size is made.

    >>> check_rows([3, 4, 3], "yarns.conductive.rows")
    (3, 4, 3)
    """
    items = sequence(rows, field, "the numbers of fibrils in each row, such as [3, 4, 3]")
    if not items:
        raise refuse(field, rows, "it must be a list with the number of fibrils in each row, such as [3, 4, 3]")
    checked = tuple(whole(n, f"{field}[{i}]", 1, MOST_FIBRILS) for i, n in enumerate(items))
    if sum(checked) > MOST_FIBRILS:
        raise refuse(field, sum(checked), f"a yarn has at most {MOST_FIBRILS} fibrils")
    return checked


SAME = "same"
"""Stands for a length of the weft that is that of the warp."""


class Direction(NamedTuple):
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
        materials = (material for yarn in self.yarns for material in yarn.materials)
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


HERTZ = "hertz"
"""The penalty P* = E*/2 of each pair of materials, with which a crossing of two cylinders is Hertz's contact."""


@frozen
class ContactProperties:
    """How two fibrils push, conduct and warm one another where they touch [28, 30, 31]."""

    penalty: float | str = field(
        metadata=number(
            "N/mm2",
            'P* > 0: force per mm of axis and mm of overlap; or "hertz": E*/2 of each pair of materials',
            shown=HERTZ,
            above=0,
            words=(HERTZ,),
        )
    )
    """P*, N/mm2: line load per overlap; or 'hertz', E*/2 with 1/E* = (1 - nu^2)/E + (1 - nu'^2)/E'."""
    conductivity: float = field(
        metadata=number(
            "S/mm2", "sigma_c >= 0; 0 insulates the fibrils from one another", shown="0.01 S/mm2", at_least=0
        )
    )
    """sigma_c, S/mm2."""
    heat_transfer: float = field(metadata=number("W/(mm2 K)", "h_c >= 0", shown="0.1 W/(mm2 K)", at_least=0))
    """h_c, W/(mm2 K)."""
    tc1: float = field(
        default=0.0,
        kw_only=True,
        metadata=number(
            "1/K",
            "of the resistance of contacts, per kelvin from 27 C; for exported parts only",
            shown="0.0",
            at_least=-STEEPEST,
            at_most=STEEPEST,
        ),
    )
    """Linear temperature coefficient of the resistance 1/sigma_c, 1/K: times
    1 + tc1 dT + tc2 dT^2, dT from 27 C, SPICE's tnom."""
    tc2: float = field(
        default=0.0,
        kw_only=True,
        metadata=number(
            "1/K2",
            "of the resistance of contacts, per kelvin squared",
            shown="0.0",
            at_least=-(STEEPEST**2),
            at_most=STEEPEST**2,
        ),
    )
    """Quadratic temperature coefficient of the resistance 1/sigma_c, 1/K2."""
    tolerance: float = field(
        default=0.0,
        kw_only=True,
        metadata=number(
            "1",
            "relative, of the resistance of contacts; for exported parts only",
            shown="0.0",
            at_least=0,
            at_most=0.9,
        ),
    )
    """Tolerance of the resistance 1/sigma_c, relative: from 1 - tolerance to 1 + tolerance of what is stated."""
    law: str = field(
        default=PAPER,
        kw_only=True,
        metadata=word("how its conductance follows from load and shape: the page on the model", known, shown=PAPER),
    )
    """The law of its conductance."""
    reference_conductance: float = field(
        default=0.0,
        kw_only=True,
        metadata=number("S", 'G0 of the law "power", G0 (F/F0)^n', shown="0 S", at_least=0),
    )
    """G0 of the law 'power', S: conductance of a touch under the force F0."""
    reference_force: float = field(
        default=0.0, kw_only=True, metadata=number("N", 'F0 of the law "power"', shown="0 N", at_least=0)
    )
    """F0 of the law 'power', N."""
    exponent: float = field(
        default=0.0,
        kw_only=True,
        metadata=number(
            "1",
            'n of the law "power": 1/3 for one elastic spot, 1/2 for a plastic one, near 1 for many',
            shown="0.0",
            at_least=0,
            at_most=2,
        ),
    )
    """Exponent n of the law 'power'."""

    def _check(self, at: str) -> None:
        check(self, at)
        for key in ("reference_conductance", "reference_force", "exponent"):
            if self.law == POWER and getattr(self, key) == 0.0:
                raise refuse(f"{at}.{key}", getattr(self, key), f"it must be > 0 where {at}.law is {POWER!r}")


@frozen
class MaterialPair(ContactProperties):
    """The contact between fibrils of two materials, where it differs from that of the rest.

    >>> MaterialPair("hertz", 0.0, 0.1, ("silver", "nylon")).materials
    ('silver', 'nylon')
    """

    materials: tuple[str, str]
    """Names of the two, in any order; the same twice for a material with itself."""

    def __post_init__(self) -> None:
        at, wanted = "contact.pairs.materials", "the names of two materials"
        names = tuple(name(each, at) for each in sequence(self.materials, at, wanted))
        if len(names) != 2:
            raise refuse(at, list(names), f"it must be {wanted}")
        store(self, materials=names)
        self._check(f"contact.pairs.{'-'.join(names)}")


@frozen
class ContactLaw(ContactProperties):
    """The contact between fibrils: of all materials, or of those without an entry among the pairs.

    >>> ContactLaw(5.0, 0.01, 0.1).penalty
    5.0
    """

    pairs: tuple[MaterialPair, ...] = ()
    """Pairs of materials with properties of their own."""

    def __post_init__(self) -> None:
        self._check("contact")
        store(self, pairs=instances(self.pairs, "contact.pairs", MaterialPair, "MaterialPair"))
        seen: set[frozenset[str]] = set()
        for pair in self.pairs:
            if frozenset(pair.materials) in seen:
                raise refuse("contact.pairs", list(pair.materials), "the pair is listed twice")
            seen.add(frozenset(pair.materials))

    @property
    def laws(self) -> tuple[str, ...]:
        """The laws of conductance that it names.

        >>> ContactLaw(5.0, 0.01, 0.1, law="holm").laws
        ('holm',)
        """
        return (self.law, *(pair.law for pair in self.pairs))

    def between(self, one: str, other: str) -> ContactProperties:
        """The properties of the contact between two materials, by their names.

        >>> law = ContactLaw(5.0, 0.01, 0.1, (MaterialPair(5.0, 0.0, 0.1, ("silver", "nylon")),))
        >>> law.between("nylon", "silver").conductivity, law.between("silver", "silver").conductivity
        (0.0, 0.01)
        """
        return next((pair for pair in self.pairs if {*pair.materials} == {one, other}), self)
