"""The whole design, the choices of model and numerics in it, and its hash."""

from __future__ import annotations

import hashlib
import json
from dataclasses import fields, is_dataclass

from circuittex.base.frozen import frozen
from circuittex.design.checks import distinct, one_of, real, refuse, store, title, truth, whole
from circuittex.design.experiment import Loading, Probe, Terminal
from circuittex.design.fabric import ContactLaw, Weave
from circuittex.design.packing import Packing

FORMAT = 1
"""The layout described by the starter design."""
MOST_ELEMENTS = 500_000
"""Elements of a whole fabric: what a large workstation can hold."""


@frozen
class Electrical:
    """Choices of the electrical model.

    >>> Electrical().conduction
    'reference'
    """

    conduction: str = "reference"
    """'reference': sigma constant in the reference frame (the paper's law); 'current': the material keeps
    its conductivity in the current frame, so that a stretched fibril resists more."""
    contact_heat: bool = True
    """Whether the Joule heat of the contacts warms the fibrils, half to each side."""

    def __post_init__(self) -> None:
        one_of(self.conduction, "electrical.conduction", ("reference", "current"))
        truth(self.contact_heat, "electrical.contact_heat")


@frozen
class Numerics:
    """Choices of the discretisation and of the solver; the defaults are stated here and nowhere else.

    >>> Numerics().elements
    20
    """

    elements: int = 20
    """Elements of each fibril."""
    order: int = 2
    """Polynomial order of the elements, 1 or 2."""
    contact_points: int = 4
    """Contact points of each element, on either side."""
    section_degree: int = 7
    """Degree of the section's quadrature rule. Below 6 its points tell how a fibril is spun about its axis, which
    a round fibril does not know, and the relaxation creeps along that spin."""
    tolerance: float = 1e-6
    """Largest free force at equilibrium, N."""
    max_iterations: int = 200
    """Newton iterations before a relaxation is given up; an increment of a loading path is then made in halves."""
    overlap_warning: float = 0.3
    """Overlap of two fibrils over R + R' from which on a state comes with a warning: the law of contact is for small
    ones."""
    overlap_limit: float = 0.5
    """Overlap over R + R' from which on a state is not recorded: the law of contact means nothing there."""
    merge_length: float = 1.0
    """Contacts of a fibril pair within bins of this length become one resistor in the netlists, mm; 0 keeps all. At
    most the length of the longest fibril."""
    snap_length: float = 1e-3
    """Feet closer than this on a fibril share a node in the netlists, mm; 0 keeps all. At most a tenth of the
    shortest element: feet that lie as far apart as contact points must stay apart."""
    drop_fraction: float = 1e-6
    """Contacts below this fraction of the largest conductance are left out of the netlists."""

    def __post_init__(self) -> None:
        at = "numerics"
        store(
            self,
            elements=whole(self.elements, f"{at}.elements", 2, 10_000),
            order=whole(self.order, f"{at}.order", 1, 2),
            contact_points=whole(self.contact_points, f"{at}.contact_points", 1, 20),
            section_degree=whole(self.section_degree, f"{at}.section_degree", 6, 15),
            tolerance=real(self.tolerance, f"{at}.tolerance", "N", above=0),
            max_iterations=whole(self.max_iterations, f"{at}.max_iterations", 1, 100_000),
            overlap_warning=real(self.overlap_warning, f"{at}.overlap_warning", above=0, at_most=self.overlap_limit),
            overlap_limit=real(self.overlap_limit, f"{at}.overlap_limit", above=0, at_most=1),
            merge_length=real(self.merge_length, f"{at}.merge_length", "mm", at_least=0),
            snap_length=real(self.snap_length, f"{at}.snap_length", "mm", at_least=0),
            drop_fraction=real(self.drop_fraction, f"{at}.drop_fraction", at_least=0, at_most=0.5),
        )


@frozen
class Design:
    """Everything a study is about."""

    name: str
    """A title: any text without control characters."""
    weave: Weave
    contact: ContactLaw
    loading: tuple[Loading, ...] = ()
    terminals: tuple[Terminal, ...] = ()
    probes: tuple[Probe, ...] = ()
    electrical: Electrical = Electrical()
    numerics: Numerics = Numerics()
    packing: Packing = Packing()

    def __post_init__(self) -> None:
        title(self.name, "name")
        distinct(tuple(loading.name for loading in self.loading), "loading.name")
        distinct(tuple(terminal.name for terminal in self.terminals), "terminals")
        distinct(tuple(probe.name for probe in self.probes), "probes.name")
        self._check_size()
        self._check_lengths()
        self._check_packing()
        self._check_terminals()
        self._check_probes()

    def _check_size(self) -> None:
        fibrils = sum(yarn.n_fibrils for yarn in self.weave.yarns)
        crossings = max(len(self.weave.warp), len(self.weave.weft))
        elements, order = self.numerics.elements, self.numerics.order
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
        weave, numerics = self.weave, self.numerics
        lengths = len(weave.warp) * weave.pitch, len(weave.weft) * weave.pitch
        element, fibril = min(lengths) / numerics.elements, max(lengths)
        if numerics.snap_length > element / 10:
            allowed = f"it must be at most {element / 10:.4g} mm, a tenth of the shortest element"
            raise refuse("numerics.snap_length", numerics.snap_length, allowed)
        if numerics.merge_length > fibril:
            allowed = f"it must be at most {fibril:.4g} mm, the length of the longest fibril"
            raise refuse("numerics.merge_length", numerics.merge_length, allowed)

    def _check_packing(self) -> None:
        # Beyond these no random packing keeps its fibrils apart, and a twist could not be followed by the mesh.
        radius = min(yarn.radius for yarn in self.weave.yarns)
        pitch = self.weave.pitch
        largest = {
            "lateral": (radius, "mm, the smallest radius"),
            "vertical": (radius, "mm, the smallest radius"),
            "twist": (0.25 / pitch, "turns/mm, a quarter of a turn a pitch"),
            "phase": (pitch / 4.0, "mm, a quarter of the pitch"),
        }
        for key, (most, meaning) in largest.items():
            if getattr(self.packing, key) > most:
                raise refuse(f"packing.{key}", getattr(self.packing, key), f"it must be at most {most:.4g} {meaning}")

    def _check_terminals(self) -> None:
        known = self.weave.yarn_names
        for terminal in self.terminals:
            for yarn, side in terminal.ends:
                if yarn not in known:
                    label = f"{yarn}{'+' if side > 0 else '-'}"
                    n, m = len(self.weave.warp), len(self.weave.weft)
                    raise refuse(
                        f"terminals.{terminal.name}",
                        label,
                        f"the weave has the yarns warp1 to warp{n} and weft1 to weft{m}",
                    )

    def _check_probes(self) -> None:
        ends = {terminal.name: terminal.ends for terminal in self.terminals}
        for probe in self.probes:
            for role in ("source", "sink"):
                if getattr(probe, role) not in ends:
                    listed = ", ".join(map(repr, ends)) or "none"
                    raise refuse(
                        f"probes.{probe.name}.{role}",
                        getattr(probe, role),
                        f"it must be the name of a terminal; there are {listed}",
                    )
            shared = set(ends[probe.source]) & set(ends[probe.sink])
            if shared:
                yarn, side = min(shared)
                raise refuse(
                    f"probes.{probe.name}.sink",
                    probe.sink,
                    f"it shares the yarn end {yarn}{'+' if side > 0 else '-'} with the source {probe.source!r}",
                )


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
        return {field.name: _canonical(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, tuple | list):
        return [_canonical(item) for item in value]
    return repr(value) if isinstance(value, float) else value
