"""What drives the probes in a state: the voltage at which each carries the current, or takes the power, stated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt

from circuittex.base.errors import CircuitError
from circuittex.contact.state import ContactState
from circuittex.design import Design, Probe
from circuittex.design.probe import HIGHEST_VOLTAGE
from circuittex.electrical.fields import (
    Fields,
    Potential,
    coefficients_of,
    cooling_of,
    solve_potentials,
    solve_steady,
)
from circuittex.electrical.network.circuit import Circuit
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.network.one_pair import yarn_conductance
from circuittex.study.circuits import probe_circuits

SMALL = 1e-6
"""A probe with less than this part of a yarn's current: its digits are not those of the fields."""
CARRIED = 0.01
"""Relative difference of a current from what is stated: small ones are those of a solution with more digits."""
NOTHING = 1e-12
"""A probe with less than this part of a yarn's conductance carries no current: it is rounding of the solution."""


def at_voltages(design: Design, contacts: ContactState, area: float) -> Design:
    """The design with all probes driven by voltages, as a state asks for whose fabric has this `area`, mm2.

    The circuit is linear: with the current G at 1 V, the voltage is I / G for a stated current I, and sqrt(P S / G) for
    a stated power P for each area of the fabric, S. Where no current flows, or `HIGHEST_VOLTAGE` would not suffice, the
    probe is at 1 V; that what is stated is not reached is a doubt about the state (`results.soundness`).
    """
    others = tuple(probe for probe in design.probes if not probe.voltage)
    if not others:
        return design
    unit = replace(design, probes=tuple(probe.at(1.0) for probe in others))
    solved = solve_potentials(contacts, unit.terminals, unit.probes)
    conductance = told_currents(solved, probe_circuits(contacts, unit.terminals, unit.probes), unit)
    least = NOTHING * yarn_conductance(design)
    volts = {
        probe.name: _voltage(probe, siemens, area) if siemens > least else 1.0
        for probe, siemens in zip(others, conductance, strict=True)
    }
    return replace(
        design, probes=tuple(probe if probe.voltage else probe.at(volts[probe.name]) for probe in design.probes)
    )


def steady_fields(
    stated: Design, cold: Design, contacts: ContactState, potentials: Sequence[Potential], area: float = 0.0
) -> tuple[Fields, ...]:
    """The fields of a nonlinear design's probes at the temperatures that follow from them (`solve_steady`).

    `cold`: the design at the voltages that drive its probes at 27 C, with these `potentials`; a probe that does not
    carry there what is `stated` has nothing to carry it, and is driven by that voltage. `area` of the fabric, mm2.
    """
    cooling, coefficients = cooling_of(stated, contacts.mesh), coefficients_of(stated, contacts)
    found = []
    for probe, at, potential in zip(stated.probes, cold.probes, potentials, strict=True):
        current = probe.current or (probe.power_density or 0.0) * area / at.voltage
        carried = abs(float(potential.currents[0]) - current) < CARRIED * abs(current)
        found.append(
            solve_steady(
                contacts,
                stated.terminals,
                probe if probe.voltage or carried else at,
                coefficients,
                cooling=cooling,
                area=area,
                contact_heat=stated.electrical.contact_heat,
                rise=stated.electrical.rated_rise,
            )
        )
    return tuple(found)


def _voltage(probe: Probe, conductance: float, area: float) -> float:
    """The voltage that drives a probe, V; 1 where that is more than there can be, or too little to be told from 0."""
    if probe.current is not None:
        volts = probe.current / conductance
    else:
        assert probe.power_density is not None
        volts = sqrt(probe.power_density * area / conductance)
    return volts if 0.0 < abs(volts) <= HIGHEST_VOLTAGE else 1.0


def told_currents(fields: Sequence[Potential], circuits: Sequence[Circuit], design: Design) -> list[float]:
    """The currents of the probes, A; those that are lost in the rounding of the fields beside a yarn's, by the nodal
    solution, which keeps the digits of small currents. nan where these are lost, too."""
    largest = yarn_conductance(design)
    currents = []
    for field, circuit, probe in zip(fields, circuits, design.probes, strict=True):
        current = float(field.currents[0])
        if abs(current) < SMALL * largest * abs(probe.voltage):
            try:
                solution = solve_nodal(circuit, {probe.source: probe.voltage, probe.sink: 0.0})
                current = float(solution.port_current[circuit.ports.index(probe.source)])
            except CircuitError:  # lost in rounding there as well
                current = float("nan")
        currents.append(current)
    return currents
