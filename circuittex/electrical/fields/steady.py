"""The steady state of a probe whose resistances follow its temperatures and which radiates: Newton's method."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import copysign, sqrt

import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, ElementLineP1, ElementLineP2, MeshLine

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import DesignError
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal
from circuittex.electrical.fields.coefficients import Coefficients
from circuittex.electrical.fields.cooling import Cooling
from circuittex.electrical.fields.flow import Flow, electric_conductance, flow_of, joule_heat
from circuittex.electrical.fields.line import FibrilLine
from circuittex.electrical.fields.solution import Fields, Mesh, fields_of, line_of, losses, thermal_anchor
from circuittex.electrical.fields.system import System, build_system, measured, outflow, peak
from circuittex.electrical.fields.tangent import (
    Resistors,
    Tangent,
    linearised,
    radiated,
    resistor_values,
    resistors_of,
)

TOLERANCE = 1e-10
"""Largest last correction of a temperature over the largest rise. Newton's method converges at second order: what is
left is its square."""
CONTRACTION = 0.5
"""Each correction is at most this part of the one before, or the drive is raised in smaller steps: then no solution is
jumped over, and that on the way from the cold state is found."""
MOST = 30
"""Corrections at a drive: with that contraction enough for any tolerance."""
PEAK = 1e-9
"""Relative difference of the largest rise from the one for which current and power are rated."""
LEAST = 1e-3
"""Step of the drive, in parts of what has been reached, that is not halved further."""
NONE = 1e-20
"""Part of what is wanted below which nothing is looked for: 100 kV in place of 10 uV."""
EXPONENTS = {"voltage": 0, "power_density": 1, "current": 2}
"""n in p G^n = const for what is stated of a probe: p = V^2 itself, the power p G, or the square of the current."""

_State = tuple[Floats, float]
"""(N,) temperatures and the square of the voltage between the terminals."""


def solve_steady(
    contacts: ContactState,
    terminals: Sequence[Terminal],
    probe: Probe,
    coefficients: Coefficients,
    *,
    cooling: Cooling,
    area: float = 0.0,
    contact_heat: bool = True,
    mesh: Mesh = "feet",
    rise: float = 0.0,
) -> Fields:
    """Solve [38] and [37] together for one probe, at the temperatures that follow from it.

        sum ∫ sigma A / f(T) V' dV' + sum G / f(T) [V][dV] = 0,  f = 1 + tc1 T + tc2 T^2
        sum ∫ k A T' dT' + sum ∫ (g T + r ((Ts + T)^4 - Ts^4)) dT + sum h_c a w [T][dT] = Joule heat of these V

    f of an element of the mechanics is its mean, that of a contact at the mean of its two temperatures; g and r are
    the `loss` and `radiating` of `cooling`, Ts = 300 K. By Newton's method for V, T and f at once, from the cold state,
    to a last correction of `TOLERANCE`. Where a correction is more than half of the one before, or a resistance is not
    positive, the drive, which is the square of a voltage or current, or a power, is raised in smaller steps. So the
    state is the one that is reached when the drive is raised from nothing, and where there is none, at a fold or where
    the rise has no bound, its steps become shorter than `LEAST`.

    The probe is driven as it states; for a power by area that is of `area`, mm2. With `rise`, K, the current and the
    power are rated at which the hottest point rises by that, whatever drives it: the same equations, with the rise
    given and the voltage sought. The result tells its voltage, and the factors f, with which `at_temperatures` gives
    the circuit. A straight fibril of the paper's that is cooled at its ends, whose resistivity rises by 0.4 % for each
    kelvin and that is given 10 V:

    >>> from circuittex.design import plain_weave
    >>> from circuittex.electrical.fields.cooling import COLD_ENDS
    >>> from circuittex.geometry.weave import build_mesh
    >>> design = plain_weave("paper-code")
    >>> mesh, nobody, nothing = build_mesh(design), np.zeros(0, dtype=int), np.zeros(0)
    >>> untouched = ContactState(mesh, nobody, nobody, *[nothing] * 8, np.ones(len(mesh.elements)))
    >>> copper = Coefficients(np.tile([0.004, 0.0], (mesh.n_fibrils, 1)), np.zeros((0, 2)))
    >>> probe = design.probes[0].at(10.0)
    >>> found = solve_steady(untouched, design.terminals, probe, copper, cooling=COLD_ENDS)
    >>> bool(found.currents[0] < 8.836), bool(abs(found.heat / found.heat_out - 1) < 1e-9)
    (True, True)

    Raises DesignError where a terminal is unknown, no current flows by which a probe could be driven as it states, or
    there is thermal runaway before the drive is reached. It says how far it can be raised.
    """
    if probe.stated == "power_density" and not area > 0.0:
        raise DesignError("area", area, "a power by area needs it, in mm2")
    line, axes = line_of(contacts, mesh, elements=True)
    problem = _Problem(contacts, terminals, probe, coefficients, cooling, contact_heat, line, axes)
    wanted = {"voltage": probe.voltage**2, "current": (probe.current or 0.0) ** 2}
    drive = wanted.get(probe.stated, (probe.power_density or 0.0) * area)
    cold = np.zeros(problem.thermal.basis.N), 0.0
    reached, (T, power) = _raised(lambda part, state: _newton(problem, state, drive=part * drive), cold)
    if reached < 1.0:
        raise _runaway(probe, reached)
    return replace(problem.fields(T, power), rated=_rated(problem, T, power, rise) if rise else np.empty(0))


def _raised(step: Callable[[float, _State], _State | None], state: _State) -> tuple[float, _State]:
    """Go to the whole of what is wanted, in parts where it must be: the part that was reached, and its state."""
    reached, size = 0.0, 1.0
    while reached < 1.0:
        part = min(1.0, reached + size)
        found = step(part, state)
        if found is not None:
            reached, state, size = part, found, 2.0 * size
            continue
        size = 0.25 * (part - reached)
        if size < max(LEAST * reached, NONE):
            break
    return reached, state


def _rated(problem: _Problem, T: Floats, power: float, rise: float) -> Floats:
    """(3,) that rise of the hottest point, and current and power that the source feeds in then, K, A, W; nan where
    nothing is warmed, or not by that. From a solution T (N,) at the square of a voltage, `power`.

    The hottest dof has what makes the hottest point, which lies beside it, rise by that.
    """
    basis, nothing = problem.thermal.basis, np.array([rise, np.nan, np.nan])
    if not peak(basis, T) > 0.0:
        return nothing
    hot, wanted = int(np.argmax(T)), rise * float(T.max()) / peak(basis, T)
    cold = np.zeros(len(T)), power * rise / peak(basis, T)
    reached, state = _raised(lambda part, state: _newton(problem, state, hot=hot, rise=part * wanted), cold)
    for _ in range(MOST):
        T, power = state
        if reached < 1.0:
            return nothing
        if abs(peak(basis, T) / rise - 1.0) < PEAK:
            break
        hot = int(np.argmax(T))
        wanted = rise * float(T[hot]) / peak(basis, T)
        again = _newton(problem, state, hot=hot, rise=wanted)
        reached, state = (0.0, state) if again is None else (1.0, again)
    else:
        return nothing
    _, _, unit = problem.flow(problem.resistors.factors(T)[0])
    conductance = float(unit.terminal_currents[0])
    return np.array([rise, sqrt(power) * conductance, power * conductance])


def _runaway(probe: Probe, reached: float) -> DesignError:
    """No steady state is reached at the drive of a probe, but at this part of it."""
    value = float(getattr(probe, probe.stated))
    most = abs(value) * (reached if probe.stated == "power_density" else sqrt(reached))
    unit = {"voltage": "V", "current": "A", "power_density": "W/mm2"}[probe.stated]
    allowed = (
        "thermal runaway: heat grows faster with the temperature than what leaves; there is a steady state, reached "
        f"from the cold, up to {most:.4g} {unit}"
    )
    return DesignError(f"probes.{probe.name}.{probe.stated}", value, allowed)


@dataclass(frozen=True)
class _Problem:
    """All that does not change with the temperature."""

    contacts: ContactState
    terminals: Sequence[Terminal]
    probe: Probe
    coefficients: Coefficients
    cooling: Cooling
    contact_heat: bool
    line: FibrilLine
    axes: MeshLine

    @cached_property
    def electric(self) -> System:
        """The potential's, as stated at 27 C."""
        conductance = electric_conductance(self.contacts)
        return build_system(Basis(self.axes, ElementLineP1()), self.line, self.line.conduction, conductance)

    @cached_property
    def thermal(self) -> System:
        """The temperature's, with what is linear of the losses."""
        basis = Basis(self.axes, ElementLineP2())
        bare = build_system(basis, self.line, self.line.thermal, self.contacts.heat_conductance)
        surface, through, _ = losses(self.line, bare, self.cooling)
        return replace(bare, loss=surface + through)

    @cached_property
    def resistors(self) -> Resistors:
        elements = len(self.contacts.mesh.elements)
        return resistors_of(self.line, self.electric, self.thermal, self.coefficients, self.contact_heat, elements)

    @cached_property
    def anchor(self) -> Ints | None:
        """From which dof the temperature of each is measured (`thermal_anchor`)."""
        _, cold = radiated(self.thermal.basis, self.radiating, np.zeros(self.thermal.basis.N))
        leaves = replace(self.thermal, loss=self.thermal.loss + cold)
        return thermal_anchor(self.line, leaves) if len(self.cooling.end) else None

    @cached_property
    def inside(self) -> Ints:
        """The dofs whose temperature is sought."""
        every = np.arange(self.thermal.basis.N)
        return every if len(self.cooling.end) else np.delete(every, self.line.ends)

    @cached_property
    def radiating(self) -> Floats:
        """(S,) W/(mm K4)."""
        owner = self.line.fibril[self.line.segments[:, 0]]
        return self.cooling.radiating[owner] if len(self.cooling.radiating) else np.zeros(len(owner))

    def flow(self, factors: Floats, voltage: float = 1.0) -> tuple[FibrilLine, System, Flow]:
        """The current at these factors of the resistances (M + C,)."""
        elements = self.resistors.elements
        line = replace(self.line, conduction=self.line.conduction / factors[:elements][self.line.element])
        conductance = electric_conductance(self.contacts) / factors[elements:]
        warm = replace(self.contacts, conductance=conductance)
        electric = build_system(Basis(self.axes, ElementLineP1()), line, line.conduction, conductance)
        return line, electric, flow_of(warm, line, electric, self.terminals, self.probe.at(voltage))

    def square(self, drive: float, conductance: float) -> float:
        """The square of the voltage at a drive."""
        if self.probe.stated == "voltage":
            return drive
        if not conductance > 0.0:
            allowed = "no current flows by which it could be driven as stated"
            raise DesignError(f"probes.{self.probe.name}.{self.probe.stated}", self.probe.drive, allowed)
        return drive / conductance ** EXPONENTS[self.probe.stated]

    def fields(self, T: Floats, power: float) -> Fields:
        """What is kept of the solution T (N,) at the square of a voltage."""
        factors, _ = self.resistors.factors(T)
        voltage = sqrt(power)
        probe = self.probe.at(copysign(voltage, self.probe.current or self.probe.voltage or 1.0))
        line, _, flow = self.flow(factors, probe.voltage)
        load = joule_heat(self.thermal, flow, self.contact_heat)
        surface, _, held = losses(line, self.thermal, self.cooling)
        found = fields_of(line, self.thermal, surface, self.cooling, probe, flow, load, T)
        away, _ = radiated(self.thermal.basis, self.radiating, T)
        ends = float(away[line.ends].sum()) if held else 0.0  # radiated beside the ends, not through them
        elements = self.resistors.elements
        return replace(
            found,
            heat_out=found.heat_out - ends,
            heat_lost=found.heat_lost + float(away.sum()),
            resistivity=factors[:elements],
            contact_resistivity=factors[elements:],
        )


def _newton(
    problem: _Problem, start: _State, *, drive: float = 0.0, hot: int | None = None, rise: float = 0.0
) -> _State | None:
    """The state at a drive, or that in which the dof `hot` rises by `rise`, from one at less; None where the iteration
    may not be trusted."""
    (T, power), before = start, np.inf
    for _ in range(MOST):
        factors, change = problem.resistors.factors(T)
        if not factors.min(initial=1.0) > 0.0:
            return None
        line, electric, flow = problem.flow(factors)
        if hot is None:
            power = problem.square(drive, float(flow.terminal_currents[0]))
        values = resistor_values(line, electric, flow)
        found = _correction(
            problem, (T, power), Tangent(flow.free, problem.inside, *values, factors, change), hot, rise
        )
        if found is None:
            return None
        correction, more = found
        T, power = T + correction, power * (1.0 + more)
        size = float(np.abs(correction).max())
        if size <= TOLERANCE * float(np.abs(T).max()):
            return (T, power) if power >= 0.0 else None
        if size > CONTRACTION * before:
            return None
        before = size
    return None


def _correction(
    problem: _Problem, state: _State, at: Tangent, hot: int | None, rise: float
) -> tuple[Floats, float] | None:
    """(N,) Newton's correction of T, and the relative one of the square of the voltage; None where there is none."""
    T, power = state
    resistors, inside = problem.resistors, at.inside
    away, more = radiated(problem.thermal.basis, problem.radiating, T)
    residual = outflow(problem.thermal, T) + away - power * (resistors.warms @ at.heat)
    move, cooling = measured(replace(problem.thermal, loss=problem.thermal.loss + more), problem.anchor)
    exponent = EXPONENTS[problem.probe.stated] if at.heat.any() else 0
    try:
        # COLAMD's factors have five to six times the entries: the pattern is nearly symmetric.
        matrix = splu(linearised(resistors, at, cooling, move, power, exponent, hot), permc_spec="MMD_AT_PLUS_A")
    except RuntimeError:  # singular: at a fold
        return None
    right = np.zeros(matrix.shape[0])
    right[len(at.free) : len(at.free) + len(inside)] = -(move.T @ residual)[inside]
    if hot is not None:
        right[-1] = rise - T[hot]
    solution = matrix.solve(right)
    correction = np.zeros(len(T))
    correction[inside] = solution[len(at.free) : len(at.free) + len(inside)]
    return move @ correction, 0.0 if hot is None else float(solution[-1])
