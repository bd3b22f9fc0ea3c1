"""What yarns are made of: materials, and how their fibrils lie in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from circuittex.base.frozen import frozen
from circuittex.design.checks import instance, instances, name, refuse, sequence, store, whole
from circuittex.design.coating import bending_radius, coated, shell_share
from circuittex.design.declaration import Key, check, number

MOST_FIBRILS = 10_000
"""Fibrils of one yarn."""
MOST_OPEN = 1e5
"""Pitch over the smallest radius: the most open scrims of the thinnest fibrils have some 1e4."""
STIFFEST, HEAVIEST, MOST_CONDUCTIVE, THICKEST = 1e9, 1e6, 1e9, 1e4
"""MPa, g/mm3, S/mm and W/(mm K), mm: a thousand times and more beyond diamond, osmium, silver and a ship's rope, which
leaves room for designs in units of another scale and none for slips of the pen."""
PATH = "path"
"""A crimp such that the natural length is that of the woven path."""
SHORTEST, LONGEST = -0.3, 3.0
"""Crimps: from fibrils that the loom stretched by half to the crimp of a terry loop."""
STEEPEST = 0.0099
"""1/K: with this tc1, or its square as tc2, a resistance stays positive as far as 50 K from 27 C."""


def coefficient(power: int, note: str) -> Mapping[str, Key]:
    """Metadata of a temperature coefficient in 1/K to that power.

    >>> coefficient(2, "of the resistivity")["key"].allowed
    '>= -9.801e-05 and <= 9.801e-05 1/K2'
    """
    most = STEEPEST**power
    return number("1/K" if power == 1 else f"1/K{power}", note, shown="0.0", at_least=-most, at_most=most)


def tolerated(note: str) -> Mapping[str, Key]:
    """Metadata of a tolerance, in parts of what is stated.

    >>> tolerated("relative")["key"].check(0.05, "tolerance")
    0.05
    """
    return number("1", note, shown="0.0", at_least=0, at_most=0.9)


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
        metadata=coefficient(1, "of the resistivity, per kelvin from 27 C; for parts, and `electrical.heating`"),
    )
    """Linear temperature coefficient of the resistivity, 1/K: times
    1 + tc1 dT + tc2 dT^2, dT from 27 C, SPICE's tnom."""
    tc2: float = field(
        default=0.0,
        metadata=coefficient(2, "of the resistivity, per kelvin squared"),
    )
    """Quadratic temperature coefficient of the resistivity, 1/K2."""
    tolerance: float = field(
        default=0.0,
        metadata=tolerated("relative, of the resistivity; for exported parts only"),
    )
    """Tolerance of the resistivity, relative: from 1 - tolerance to 1 + tolerance of what is stated."""

    def __post_init__(self) -> None:
        check(self, f"materials.{name(self.name, 'materials')}")


@frozen
class Yarn:
    """A kind of yarn: parallel fibrils packed in rows, the bottom row first.

    Fibrils are numbered row by row, within a row towards growing y (warp) or x (weft). Each is of one material, or a
    core of it in a shell.

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
    """One for each fibril; of its core, where the fibrils are coated."""
    shell: Material | None = None
    """What every fibril is coated with."""
    shell_thickness: float = field(
        default=0.0,
        metadata=number("mm", "of the shell on every fibril, within its radius; 0: none", shown="0 mm", at_least=0),
    )
    """Of the shell on every fibril, mm, within the radius."""
    crimp: float | str = field(
        default=0.0,
        kw_only=True,
        metadata=number(
            "1",
            'natural length of its fibrils over the span, less 1; "path": as long as they are woven, so that none is '
            "stretched",
            shown="0 %",
            at_least=SHORTEST,
            at_most=LONGEST,
            words=(PATH,),
        ),
    )
    """Natural length of the fibrils over the straight span, less 1: what is woven in; 'path': that of the path."""
    heat_set: float = field(
        default=0.0,
        kw_only=True,
        metadata=number(
            "1",
            "part of the woven bends that is natural: 0 for straight fibrils, 1 for a yarn set in its weave",
            shown="0.0",
            at_least=0,
            at_most=1,
        ),
    )
    """Part of the woven bends in the natural shape: the angle between a fibril and its yarn's axis is times this."""

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
        self._check_shell(at)

    def _check_shell(self, at: str) -> None:
        if self.shell is not None:
            instance(self.shell, f"{at}.shell", Material)
        elif self.shell_thickness > 0.0:
            raise refuse(f"{at}.shell_thickness", self.shell_thickness, "it needs a shell, the name of a material")
        if self.shell_thickness >= self.radius:
            allowed = f"it must be less than the radius of {self.radius:.4g} mm, of which it is a part"
            raise refuse(f"{at}.shell_thickness", self.shell_thickness, allowed)

    @property
    def n_fibrils(self) -> int:
        return sum(self.rows)

    @property
    def coated(self) -> bool:
        """Whether its fibrils have a shell."""
        return self.shell is not None and self.shell_thickness > 0.0

    @property
    def fibrils(self) -> tuple[Material, ...]:
        """What each fibril is along its axis: its material, or one with the sums of core and shell (`coated`).

        >>> nylon = Material("nylon", 2e3, 0.4, 1.0, 0.0, 1.0)
        >>> silver = Material("silver", 2e3, 0.4, 2.0, 100.0, 1.0)
        >>> Yarn("plated", (1,), 1.0, 2.0, 2.0, (nylon,), silver, 0.5).fibrils[0].electrical_conductivity
        75.0
        """
        if self.shell is None or not self.coated:
            return self.materials
        shell, share = self.shell, shell_share(self.radius, self.shell_thickness)
        alike = {core: Material(core.name, **coated(core, shell, share)) for core in dict.fromkeys(self.materials)}
        return tuple(alike[core] for core in self.materials)

    @property
    def conducts(self) -> bool:
        """Whether any of its fibrils does, along its axis."""
        return any(material.electrical_conductivity > 0.0 for material in self.fibrils)

    @property
    def surfaces(self) -> tuple[Material, ...]:
        """What each fibril touches others with: its shell, or its material where it has none."""
        return self.materials if self.shell is None or not self.coated else (self.shell,) * self.n_fibrils

    @property
    def bending_radii(self) -> tuple[float, ...]:
        """Radius of the homogeneous section that bends as each fibril does (`bending_radius`), mm."""
        if self.shell is None or not self.coated:
            return (self.radius,) * self.n_fibrils
        modulus, share = self.shell.youngs_modulus, shell_share(self.radius, self.shell_thickness)
        return tuple(bending_radius(self.radius, core.youngs_modulus, modulus, share) for core in self.materials)


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
