"""The whole design, the choices of model and numerics in it, and its hash."""

from __future__ import annotations

import hashlib
import json
from dataclasses import field, fields, is_dataclass

from circuittex.base.frozen import frozen, same
from circuittex.design.checks import distinct, instance, instances, refuse, store, title
from circuittex.design.clamps import Clamps, check_clamps
from circuittex.design.contact import ContactLaw
from circuittex.design.declaration import check, choice, count, flag, number, relative
from circuittex.design.experiment import Loading
from circuittex.design.grid import starting_state
from circuittex.design.packing import Packing
from circuittex.design.probe import Probe, Terminal, check_probes, check_terminals
from circuittex.design.resolution import Resolution, resolution
from circuittex.design.units import parse
from circuittex.design.weave import Weave

FORMAT = 1
"""The layout described by the starter design."""
AUTO = "auto"
"""Stands for a length that follows from the weave."""
LINEAR, NONLINEAR = "linear", "nonlinear"
"""How temperatures follow from heat (`Electrical.heating`)."""
MOST_ELEMENTS = 500_000
"""Elements of a whole fabric: what a large workstation can hold."""


@frozen
class Electrical:
    """Choices of the electrical model.

    >>> Electrical().conduction
    'reference'
    """

    conduction: str = field(
        default="reference",
        metadata=choice(
            '"reference": sigma constant in the reference frame (the paper\'s law); "current": in the current frame, '
            "stretched fibrils resist more",
            ("reference", "current"),
            shown="reference",
        ),
    )
    """'reference': sigma constant in the reference frame (the paper's law); 'current': the material keeps
    its conductivity in the current frame, so that a stretched fibril resists more."""
    contact_heat: bool = field(
        default=True, metadata=flag("whether the Joule heat of the contacts warms the fibrils", shown=True)
    )
    """Whether the Joule heat of the contacts warms the fibrils, half to each side."""
    heat_loss: float = field(
        default=0.0,
        kw_only=True,
        metadata=number(
            "W/(mm2 K)",
            "h >= 0 from the outline of each yarn to the air; its fibrils share it; still air takes 5 to 25 W/(m2 K)",
            shown="0 W/(m2 K)",
            at_least=0,
            at_most=1,
        ),
    )
    """h, W/(mm2 K): heat that leaves along the outline of each yarn, for each kelvin above the surroundings."""
    emissivity: float = field(
        default=0.0,
        kw_only=True,
        metadata=number(
            "1",
            "of the same outline, 0 to 1, for surroundings at 300 K; linear in the rise: textiles 0.9, metal 0.05",
            shown="0.0",
            at_least=0,
            at_most=1,
        ),
    )
    """Emissivity of the outline of each yarn, in surroundings at 300 K."""
    thermal_ends: float | str = field(
        default="cold",
        kw_only=True,
        metadata=number(
            "K/W",
            '"cold": fibril ends stay as cool as the surroundings (the paper\'s); "insulated"; or the thermal '
            "resistance of each yarn end",
            shown="cold",
            above=0,
            words=("cold", "insulated"),
        ),
    )
    """'cold': fibril ends stay as cool as the surroundings; 'insulated'; or the resistance of each yarn end, K/W."""
    heating: str = field(
        default=LINEAR,
        kw_only=True,
        metadata=choice(
            '"linear": resistances as stated, those of 27 C, and radiation linear in the rise; "nonlinear": they '
            "follow tc1 and tc2 to the temperatures of each probe, and radiation goes with T^4",
            (LINEAR, NONLINEAR),
            shown=LINEAR,
        ),
    )
    """'linear': resistances as stated, those of 27 C, and radiation linear in the rise; 'nonlinear': resistances follow
    tc1 and tc2 to the temperatures that each probe makes, and radiation goes with T^4."""
    permittivity: float = field(
        default=1.0,
        kw_only=True,
        metadata=number(
            "1",
            "of what is between the yarns, relative to the vacuum, for capacitances of exported parts only; air 1, "
            "polyester 3, skin some 1e3",
            shown="1.0",
            at_least=1,
            at_most=1e5,
        ),
    )
    """Relative permittivity of what is between the yarns, for capacitances of exported parts."""

    rated_rise: float = field(
        default=10.0,
        kw_only=True,
        metadata=number(
            "K",
            "of the hottest point, for which currents and powers are rated in report, summary and libraries",
            shown="10 K",
            above=0,
        ),
    )
    """Rise of the hottest point, K, for which currents and powers are rated."""

    fit: str = field(
        default="auto",
        metadata=choice(
            'what the reduced network is fitted to. "all-pairs": the resistances between all yarn ends, with one for '
            'each crossing; "probes": the probe currents, one Ry and one Rc (the paper\'s fit); "auto": the probes '
            "where all yarns are of one kind, else all pairs",
            ("auto", "probes", "all-pairs"),
            shown="all-pairs",
        ),
    )
    """'auto' or 'probes': Ry and Rc are fitted to the probe currents, one of each (the paper's fit [47]); 'all-pairs',
    or 'auto' where yarns of several kinds conduct: to the resistances between all yarn ends, crossing by crossing."""

    def __post_init__(self) -> None:
        check(self, "electrical")
        if self.thermal_ends == "insulated" and not (self.heat_loss or self.emissivity):
            allowed = "heat must leave somewhere: it needs electrical.heat_loss or electrical.emissivity > 0"
            raise refuse("electrical.thermal_ends", self.thermal_ends, allowed)


@frozen
class Numerics:
    """Choices of the discretisation and of the solver; the defaults are stated here and nowhere else.

    >>> Numerics().elements
    20
    """

    elements: int | str = field(
        default=20,
        metadata=count(
            'of each fibril, at least 2; "auto": as its bends and contacts ask for',
            2,
            10_000,
            shown=AUTO,
            words=(AUTO,),
        ),
    )
    """Elements of each fibril, or 'auto' (`Design.resolution`)."""
    order: int = field(default=2, metadata=count("of the elements, 1 or 2", 1, 2, shown="2"))
    """Polynomial order of the elements, 1 or 2."""
    contact_points: int | str = field(
        default=4, metadata=count('of each element, 1 to 40; "auto"', 1, 40, shown=AUTO, words=(AUTO,))
    )
    """Contact points of each element, on either side, or 'auto' (`Design.resolution`)."""
    section_degree: int = field(
        default=7, metadata=count("of the quadrature rule over the section, 6 to 15", 6, 15, shown="7")
    )
    """Degree of the section's quadrature rule. Below 6 its points tell how a fibril is spun about its axis, which
    a round fibril does not know, and the relaxation creeps along that spin."""
    tolerance: float | str = field(
        default=2e-5,
        metadata=relative(
            "N",
            "largest free force that counts as equilibrium, in parts of the forces on its fibril; or in newtons",
            shown="2e-5",
            at_most=0.1,
        ),
    )
    """Largest free force at equilibrium: a number in parts of the largest force on its fibril, a text such as
    '1e-06 N' as it is. Of moments on directors half a pitch is the lever."""
    max_iterations: int = field(
        default=200,
        metadata=count(
            "Newton iterations of a descent before it is given up or its step halved", 1, 100_000, shown="200"
        ),
    )
    """Newton iterations of a descent before it is given up; an increment of a loading path is then made in halves."""
    overlap_warning: float = field(
        default=0.3,
        metadata=number(
            "1",
            "overlap of two fibrils over R + R' from which on a state comes with a warning",
            shown="0.3",
            above=0,
            at_most=1,
        ),
    )
    """Overlap of two fibrils over R + R' from which on a state comes with a warning: the law of contact is for small
    ones."""
    overlap_limit: float = field(
        default=0.5,
        metadata=number(
            "1", "the same from which on a state is not recorded but an error", shown="0.5", above=0, at_most=1
        ),
    )
    """Overlap over R + R' from which on a state is not recorded: the law of contact means nothing there."""
    merge_length: float | str = field(
        default=AUTO,
        metadata=number(
            "mm",
            'netlists: contacts of a fibril pair in bins of this length merge; 0: none; "auto": half a pitch',
            shown=AUTO,
            at_least=0,
            words=(AUTO,),
        ),
    )
    """Contacts of a fibril pair within bins of this length become one resistor in the netlists, mm; 0 keeps all. At
    most the length of the longest fibril. 'auto': half a pitch."""
    snap_length: float | str = field(
        default=AUTO,
        metadata=number(
            "mm",
            'netlists: feet closer than this on a fibril share a node; 0: none; "auto": 1/2000 of the pitch, or a '
            "tenth of an element",
            shown=AUTO,
            at_least=0,
            words=(AUTO,),
        ),
    )
    """Feet closer than this on a fibril share a node in the netlists, mm; 0 keeps all. At most a tenth of the
    shortest element: feet that lie as far apart as contact points must stay apart. 'auto': that, or 1/2000 of the pitch
    where it is less."""
    drop_fraction: float = field(
        default=1e-6,
        metadata=number(
            "1",
            "netlists: contacts below this fraction of the largest are left out",
            shown="1e-6",
            at_least=0,
            at_most=0.5,
        ),
    )
    """Contacts below this fraction of the largest conductance are left out of the netlists."""

    def __post_init__(self) -> None:
        check(self, "numerics")

    @property
    def allowed(self) -> str:
        """The tolerance in words, for a sentence.

        >>> Numerics().allowed
        '2e-05 of the forces on its fibril'
        """
        return self.tolerance if isinstance(self.tolerance, str) else f"{self.tolerance:g} of the forces on its fibril"

    @property
    def relative_tolerance(self) -> float:
        """The tolerance in parts of the forces; 0 where it is stated in N."""
        return 0.0 if isinstance(self.tolerance, str) else self.tolerance

    @property
    def force_tolerance(self) -> float:
        """The tolerance in N; 0 where it is stated in parts of the forces.

        >>> Numerics(tolerance="1 uN").force_tolerance
        1e-06
        """
        return parse(self.tolerance, "N", "numerics.tolerance") if isinstance(self.tolerance, str) else 0.0


@frozen
class Design:
    """Everything a study is about."""

    name: str
    """A title: any text without control characters."""
    weave: Weave
    """The textile."""
    contact: ContactLaw
    """How its fibrils touch."""
    loading: tuple[Loading, ...] = ()
    """The loading paths, each from the relaxed state or a state of one before it."""
    terminals: tuple[Terminal, ...] = ()
    """Yarn ends whose fibril ends are joined."""
    probes: tuple[Probe, ...] = ()
    """What is measured between terminals."""
    electrical: Electrical = Electrical()
    """Choices of the electrical model."""
    numerics: Numerics = Numerics()
    """Choices of the discretisation and of the solver."""
    packing: Packing = Packing()
    """Random departures from the regular packing."""
    clamps: Clamps = Clamps()
    """What holds the ends of the yarns."""

    def __post_init__(self) -> None:
        title(self.name, "name")
        for key, one in (
            *(("weave", Weave), ("contact", ContactLaw), ("electrical", Electrical)),
            *(("numerics", Numerics), ("packing", Packing), ("clamps", Clamps)),
        ):
            instance(getattr(self, key), key, one)
        for key, each in (("loading", Loading), ("terminals", Terminal), ("probes", Probe)):
            store(self, **{key: instances(getattr(self, key), key, each, each.__name__)})
        distinct(tuple(loading.name for loading in self.loading), "loading.name")
        for place in range(len(self.loading)):
            starting_state(self.loading, place)
        distinct(tuple(terminal.name for terminal in self.terminals), "terminals")
        distinct(tuple(probe.name for probe in self.probes), "probes.name")
        self._check_size()
        self._check_lengths()
        self._check_packing()
        check_clamps(self.clamps, self.weave, self.loading)
        self._check_pairs()
        self._check_heating()
        check_terminals(self.terminals, self.weave)
        check_probes(self.probes, self.terminals, self.weave)

    @property
    def resolution(self) -> Resolution:
        """Elements of each fibril and contact points of each element, those that are 'auto' from the fibrils."""
        numerics = self.numerics
        elements = numerics.elements if isinstance(numerics.elements, int) else None
        wanted = resolution(self.weave, self.contact, numerics.order, elements)
        points = numerics.contact_points
        return Resolution(wanted.elements, points if isinstance(points, int) else wanted.contact_points)

    def _check_size(self) -> None:
        fibrils = sum(yarn.n_fibrils for yarn in self.weave.yarns)
        crossings = max(len(self.weave.warp), len(self.weave.weft))
        elements, order = self.resolution.elements, self.numerics.order
        if fibrils * elements > MOST_ELEMENTS:
            allowed = f"{fibrils} fibrils of that many elements exceed {MOST_ELEMENTS} elements in all"
            raise refuse("numerics.elements", elements, allowed)
        # Two steps from node to node a crossing are the least that can follow a 1/1 yarn: crests and mid-plane.
        if elements * order < 2 * crossings:
            least = -(-2 * crossings // order)
            allowed = f"it must be at least {least}: two nodes for each of {crossings} crossings, at order {order}"
            raise refuse("numerics.elements", elements, allowed)

        if elements * order < 3:
            least = -(-3 // order)
            allowed = f"it must be at least {least}: contact needs four nodes on every fibril, at order {order}"
            raise refuse("numerics.elements", elements, allowed)

    def _check_lengths(self) -> None:
        weave, most = self.weave, self._largest_snap
        fibril = max(direction.crossings * direction.step for direction in weave.directions)
        if self.snap_length > most:
            allowed = f"it must be at most {most:.4g} mm, a tenth of the shortest element"
            raise refuse("numerics.snap_length", self.snap_length, allowed)
        if self.merge_length > fibril:
            allowed = f"it must be at most {fibril:.4g} mm, the length of the longest fibril"
            raise refuse("numerics.merge_length", self.merge_length, allowed)

    @property
    def _largest_snap(self) -> float:
        """A tenth of the shortest element, mm."""
        shortest = min(direction.crossings * direction.step for direction in self.weave.directions)
        return shortest / self.resolution.elements / 10

    @property
    def merge_length(self) -> float:
        """`Numerics.merge_length` in mm."""
        stated = self.numerics.merge_length
        return self.weave.least_pitch / 2 if isinstance(stated, str) else stated

    @property
    def snap_length(self) -> float:
        """`Numerics.snap_length` in mm."""
        stated = self.numerics.snap_length
        return min(self.weave.least_pitch / 2000, self._largest_snap) if isinstance(stated, str) else stated

    def _check_packing(self) -> None:
        # Beyond these no random packing keeps its fibrils apart, and a twist could not be followed by the mesh.
        radius = min(yarn.radius for yarn in self.weave.yarns)
        pitch = self.weave.least_pitch
        largest = {
            "lateral": (radius, "mm, the smallest radius"),
            "vertical": (radius, "mm, the smallest radius"),
            "twist": (0.25 / pitch, "turns/mm, a quarter of a turn a pitch"),
            "phase": (pitch / 4.0, "mm, a quarter of the pitch"),
        }
        for key, (most, meaning) in largest.items():
            if getattr(self.packing, key) > most:
                raise refuse(f"packing.{key}", getattr(self.packing, key), f"it must be at most {most:.4g} {meaning}")

    def _check_pairs(self) -> None:
        known = dict.fromkeys(material.name for yarn in self.weave.yarns for material in yarn.surfaces)
        for pair in self.contact.pairs:
            for material in pair.materials:
                if material not in known:
                    allowed = "it must be a material that fibrils of the weave touch with: " + ", ".join(
                        map(repr, known)
                    )
                    raise refuse("contact.pairs.materials", material, allowed)

    def _check_heating(self) -> None:
        electrical, yarns = self.electrical, self.weave.yarns
        fibrils = [each for yarn in yarns for each in (*yarn.materials, *yarn.surfaces)]
        follows = any(each.tc1 or each.tc2 for each in fibrils) or any(
            each.tc1 or each.tc2 for each in (self.contact, *self.contact.pairs)
        )
        if electrical.heating == NONLINEAR and not (electrical.emissivity or follows):
            allowed = "nothing of the design is nonlinear: state tc1 or tc2 of what conducts, or electrical.emissivity"
            raise refuse("electrical.heating", electrical.heating, allowed)


def design_hash(design: Design) -> str:
    """SHA-256 of what the design means, in hexadecimal: independent of file layout and spelling of units.

    >>> from circuittex.design import plain_weave
    >>> design_hash(plain_weave()) == design_hash(plain_weave("paper-table"))
    False
    """
    text = json.dumps({"format": FORMAT, "design": _canonical(design)}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _canonical(value: object) -> object:
    """Plain lists, dictionaries and repr'd floats, so that the text is the same in every process."""
    if is_dataclass(value) and not isinstance(value, type):
        # What is as the default has it is left out, so that a key which older designs lack leaves their hash alone.
        said = {each.name: getattr(value, each.name) for each in fields(value)}
        left_out = {each.name for each in fields(value) if same(said[each.name], each.default)}
        return {name: _canonical(part) for name, part in said.items() if name not in left_out}
    if isinstance(value, tuple | list):
        return [_canonical(item) for item in value]
    return repr(value) if isinstance(value, float) else value
