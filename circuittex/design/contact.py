"""The contact between fibrils: how they push, conduct and warm one another, by pairs of materials."""

from __future__ import annotations

from dataclasses import field

from circuittex.base.frozen import frozen
from circuittex.design.checks import instances, name, refuse, sequence, store
from circuittex.design.contact_laws import PAPER, POWER, known
from circuittex.design.declaration import check, number, word
from circuittex.design.yarn import coefficient, tolerated

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
        metadata=coefficient(1, "of the resistance of contacts, per kelvin from 27 C; as a material's"),
    )
    """Linear temperature coefficient of the resistance 1/sigma_c, 1/K: times
    1 + tc1 dT + tc2 dT^2, dT from 27 C, SPICE's tnom."""
    tc2: float = field(
        default=0.0,
        kw_only=True,
        metadata=coefficient(2, "of the resistance of contacts, per kelvin squared"),
    )
    """Quadratic temperature coefficient of the resistance 1/sigma_c, 1/K2."""
    tolerance: float = field(
        default=0.0,
        kw_only=True,
        metadata=tolerated("relative, of the resistance of contacts; for exported parts only"),
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
