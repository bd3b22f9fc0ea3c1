"""What is measured: probes between terminals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace

from circuittex.base.frozen import frozen
from circuittex.design.checks import name, real, refuse, sequence, store
from circuittex.design.weave import Weave

HIGHEST_VOLTAGE = 1e5
"""V: in air, sparks leap over a cell long before."""
DRIVES = {"voltage": "V", "current": "A", "power_density": "W/mm2"}
"""By what a probe may be driven, and the units of it."""
ONE_DRIVE = "give one of voltage, current and power_density"
PER_CM2 = 100.0
"""W/mm2 in W/cm2."""


@frozen
class Terminal:
    """A named set of yarn ends whose fibril ends are joined.

    >>> Terminal("right", (("warp2", +1),)).ends
    (('warp2', 1),)
    """

    name: str
    """What it is called."""
    ends: tuple[tuple[str, int], ...]
    """(yarn name, side): -1 for the end at xi3 = 0, +1 for the end at xi3 = L."""

    def __post_init__(self) -> None:
        at = f"terminals.{name(self.name, 'terminals')}"
        wanted = "yarn ends such as ('warp2', +1)"
        ends = [sequence(end, at, "a yarn's name and a side, -1 or +1") for end in sequence(self.ends, at, wanted)]
        if not ends:
            raise refuse(at, [], "it must list at least one yarn end, such as 'warp2+'")
        seen: dict[tuple[str, int], None] = {}
        for end in ends:
            if len(end) != 2:
                raise refuse(at, end, f"it must list {wanted}")
            yarn, side = name(end[0], at), int(real(end[1], at))
            if end[1] not in (-1, 1):
                raise refuse(at, end[1], "the side of a yarn end must be -1 or +1")
            if (yarn, side) in seen:
                raise refuse(at, f"{yarn}{'+' if side > 0 else '-'}", "it is listed twice")
            seen[yarn, side] = None
        store(self, ends=tuple(seen))


@frozen
class Probe:
    """A measurement: current flows from the source terminal, at `voltage`, to the sink, at 0 V.

    In place of the voltage the current may be stated, or the power for each area of the fabric. The circuit is linear,
    with a conductance G between source and sink in each state, so that these are the voltages I / G and sqrt(P / G).

    >>> Probe("straight", "left", "right", 1.0).voltage
    1.0
    >>> Probe("heater", "left", "right", current=0.1).drive
    '0.1 A'
    """

    name: str
    """What it is called."""
    source: str
    """Terminal name."""
    sink: str
    """Terminal name."""
    voltage: float = 0.0
    """Of the source above the sink, V; 0 where something else is stated, from which it follows in each state."""
    current: float | None = field(default=None, kw_only=True)
    """Into the source, A; None where something else is stated."""
    power_density: float | None = field(default=None, kw_only=True)
    """Power that the source feeds in for each area of the fabric, W/mm2; None where something else is stated."""

    def __post_init__(self) -> None:
        at = f"probes.{name(self.name, 'probes.name')}"
        store(
            self, voltage=real(self.voltage, f"{at}.voltage", "V", at_least=-HIGHEST_VOLTAGE, at_most=HIGHEST_VOLTAGE)
        )
        store(self, source=name(self.source, f"{at}.source"), sink=name(self.sink, f"{at}.sink"))
        if self.current is not None:
            store(self, current=real(self.current, f"{at}.current", "A"))
            if self.current == 0.0:
                raise refuse(f"{at}.current", self.current, "it must not be 0 A, or nothing is measured")
        if self.power_density is not None:
            store(self, power_density=real(self.power_density, f"{at}.power_density", "W/mm2", above=0))
        stated = [key for key in DRIVES if getattr(self, key)]
        if not stated:
            raise refuse(f"{at}.voltage", self.voltage, "it must not be 0 V, or no current flows")
        if len(stated) > 1:
            raise refuse(f"{at}.{stated[1]}", getattr(self, stated[1]), ONE_DRIVE)
        if self.source == self.sink:
            raise refuse(f"{at}.sink", self.sink, "it must be another terminal than the source")

    @property
    def drive(self) -> str:
        """What is stated, for people.

        >>> Probe("heater", "left", "right", power_density=1e-3).drive
        '0.1 W/cm2'
        """
        if self.current is not None:
            return f"{self.current:g} A"
        return f"{self.voltage:g} V" if self.power_density is None else f"{PER_CM2 * self.power_density:g} W/cm2"

    @property
    def stated(self) -> str:
        """The key that is stated: one of `DRIVES`.

        >>> Probe("straight", "left", "right", 1.0).stated
        'voltage'
        """
        return next(key for key in DRIVES if getattr(self, key))

    def at(self, voltage: float) -> Probe:
        """The same probe, driven by a voltage.

        >>> Probe("heater", "left", "right", current=0.1).at(2.0).drive
        '2 V'
        """
        return replace(self, voltage=voltage, current=None, power_density=None)


def check_terminals(terminals: Sequence[Terminal], weave: Weave) -> None:
    """Refuse terminals of yarns that a weave has not."""
    known = weave.yarn_names
    for terminal in terminals:
        for yarn, side in terminal.ends:
            if yarn not in known:
                label = f"{yarn}{'+' if side > 0 else '-'}"
                n, m = len(weave.warp), len(weave.weft)
                allowed = f"the weave has the yarns warp1 to warp{n} and weft1 to weft{m}"
                raise refuse(f"terminals.{terminal.name}", label, allowed)


def check_probes(probes: Sequence[Probe], terminals: Sequence[Terminal], weave: Weave) -> None:
    """Refuse probes between what is no terminal, or that cannot be driven as stated."""
    ends = {terminal.name: terminal.ends for terminal in terminals}
    yarns = dict(zip(weave.yarn_names, weave.yarns, strict=True))
    for probe in probes:
        at = f"probes.{probe.name}"
        for role in ("source", "sink"):
            if getattr(probe, role) not in ends:
                listed = ", ".join(map(repr, ends)) or "none"
                allowed = f"it must be the name of a terminal; there are {listed}"
                raise refuse(f"{at}.{role}", getattr(probe, role), allowed)
        shared = set(ends[probe.source]) & set(ends[probe.sink])
        if shared:
            yarn, side = min(shared)
            allowed = f"it shares the yarn end {yarn}{'+' if side > 0 else '-'} with the source {probe.source!r}"
            raise refuse(f"{at}.sink", probe.sink, allowed)
        for terminal in () if probe.voltage else (probe.source, probe.sink):
            if not any(yarns[yarn].conducts for yarn, _ in ends[terminal]):
                allowed = f"no yarn of the terminal {terminal!r} conducts, so that only a voltage can be applied"
                raise refuse(f"{at}.{probe.stated}", probe.drive, allowed)
