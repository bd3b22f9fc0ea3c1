"""What an ensemble measures in every state: clamp forces, probe currents and voltages, Ry and Rc."""

from __future__ import annotations

from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.fit import network_names
from circuittex.results.heating import driven_otherwise
from circuittex.results.records import Record

SIDES = ("warp", "weft")


@frozen
class Quantity:
    """One number of a state.

    >>> Quantity("Ry", "ohm").column
    'Ry_ohm'
    """

    name: str
    """For example 'warp_Fx', 'current_straight', 'Ry'."""
    unit: str

    @property
    def column(self) -> str:
        """Name and unit as one word."""
        return f"{self.name}_{self.unit}"


def quantities(design: Design) -> tuple[Quantity, ...]:
    """Everything that is measured in a state of `design`, in order.

    Forces are those of the clamps on the +x ends of the warp and the +y ends of the weft [40, 41].

    >>> from circuittex.design import plain_weave
    >>> [quantity.name for quantity in quantities(plain_weave(yarns=1))][5:]
    ['weft_Fz', 'current_straight', 'current_perpendicular', 'Ry', 'Rc']

    A probe that is driven by a current or a power has its voltage beside the current, which follows in each state.
    Where there are several kinds of yarn, each has its Ry and each pair of kinds that cross its Rc: 'Ry_copper_warp'.
    """
    forces = [Quantity(f"{side}_F{axis}", "N") for side in SIDES for axis in "xyz"]
    currents = [Quantity(f"current_{probe.name}", "A") for probe in design.probes]
    currents += [Quantity(f"voltage_{design.probes[k].name}", "V") for k in driven_otherwise(design)]
    names = [name for each in network_names(design) for name in each] if design.probes else []
    network = [Quantity(name.replace(" ", "_"), "ohm") for name in names]
    return (*forces, *currents, *network)


def measure(design: Design, record: Record) -> list[float]:
    """The values of a recorded state of a design, in the order of `quantities`."""
    network = record.outcome.network if record.fields else ()
    volts = [record.fields[k].voltage for k in driven_otherwise(design)]
    return [*map(float, record.clamp_force.ravel()), *record.currents, *volts, *map(float, network)]
