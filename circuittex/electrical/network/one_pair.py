"""One Ry and one Rc fitted to probe currents by least squares: the paper's own network [47]."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.optimize import least_squares

from circuittex.base.arrays import Floats
from circuittex.base.binary import power_of_two
from circuittex.base.errors import CircuitError
from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.electrical.network.circuit import reached_part, reduced_circuit, yarn_end_name
from circuittex.electrical.network.nodal import solve_nodal

# A conductance below this fraction of that of an insulated yarn is none: it is rounding of the solution.
_NONE = 1e-12
# Rc / Ry of the start values, one for each decade, and how far beyond them the search may go.
_RATIOS = np.logspace(-8.0, 12.0, 21)
_BEYOND = 10.0
# A value is called undetermined where a relative error of the weighted currents comes back this many times larger.
_AMPLIFIED = 100.0
# A misfit below this fraction of the currents is rounding.
_EXACT = 1e-15


@frozen
class OnePair:
    """The values that come closest to the currents of the probes; fields as those of `circuittex.fit.Fit`."""

    Ry: float
    """Resistance of a yarn segment, ohm."""
    Rc: float
    """Resistance of a crossing, ohm."""
    residual: float
    """Root of the sum of squared misfits [1 or A]."""
    covariance: Floats
    """(2, 2) of Ry and Rc, ohm2."""
    weighting: str
    """'relative' or 'absolute'."""
    warnings: tuple[str, ...]
    """What the probes do not determine."""
    currents: Floats
    """(n,) probe currents of the fitted network, A."""


def fit_one_pair(currents: Sequence[float] | Floats, design: Design, *, weighting: str = "relative") -> OnePair:
    """Return the Ry and Rc whose reduced network has the probe currents (n,) in A of `design.probes` [47].

    'absolute' minimises Σ (I_network - I)² as [47] is written, 'relative' Σ (I_network / I - 1)². Probes across yarns
    carry about a hundredth of the current along one yarn, so in the absolute sum the little that the network cannot
    follow along the yarn outweighs all they say about Rc; relative misfits let every probe speak.

    What does not conduct has the value inf, and what the probes do not tell is nan; `warnings` says so. A probe
    carries nothing if its conductance is less than 1e-12 of that of an insulated yarn of the design.

    Raises `CircuitError` for currents that are not one finite number for each probe, or that flow backwards.
    """
    if weighting not in ("relative", "absolute"):
        raise CircuitError(f"weighting: {weighting!r} is not usable; it must be 'relative' or 'absolute'")
    volts = np.array([probe.voltage for probe in design.probes])
    wanted = checked(currents, design, volts)
    carries = wanted > 0.0
    insulated = network_conductances(design, 1.0, np.inf).sum(axis=1)
    if not carries.any():
        return _without_current(insulated, yarn_conductance(design), weighting)
    size = float(wanted.max())
    scale: Floats = np.where(carries, wanted, size) if weighting == "relative" else 1.0 / np.abs(volts)
    if np.array_equal(carries, insulated > 0.0):
        return _without_contacts(insulated, wanted, scale, volts, weighting)
    return _with_contacts(design, wanted, scale, volts, weighting)


def yarn_conductance(design: Design) -> float:
    """Return the largest Σ sigma π R² / L of an insulated yarn, with L its straight length across the cell, S.

    >>> from circuittex.design import plain_weave
    >>> round(yarn_conductance(plain_weave()), 4)
    0.8836
    """
    return max(
        sum(material.electrical_conductivity for material in yarn.fibrils)
        * np.pi
        * yarn.radius
        * yarn.radius
        / (direction.crossings * direction.step)
        for direction in design.weave.directions
        for yarn in direction.yarns
    )


def network_conductances(design: Design, Ry: float, Rc: float) -> Floats:
    """Return the conductance of the reduced network at each probe, S, in two shares (n, 2): yarn arms and crossings.

    A share is the power Σ G ΔV² of those resistors over the squared probe voltage. Since the power is stationary in
    the potential, -share / Ry and -share / Rc are also the exact derivatives of the conductance with Ry and Rc.
    """
    ends = {t.name: tuple(yarn_end_name(yarn, side) for yarn, side in t.ends) for t in design.terminals}
    pairs = tuple((ends[probe.source], ends[probe.sink]) for probe in design.probes)
    return _conductances((len(design.weave.warp), len(design.weave.weft)), pairs, Ry, Rc)


# The start values of the fit are the same for every state, and a misfit and its derivatives follow from one solution.
@lru_cache(maxsize=100)
def _conductances(
    shape: tuple[int, int], pairs: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...], Ry: float, Rc: float
) -> Floats:
    """`network_conductances` between the (source, sink) ends of each probe; nobody may write to what it returns."""
    whole = reduced_circuit(shape, Ry, Rc)
    shares = []
    for source, sink in pairs:
        drive = dict.fromkeys(source, 1.0) | dict.fromkeys(sink, 0.0)
        part = reached_part(whole, drive)
        voltage = solve_nodal(part, drive).voltage
        power = np.diff(voltage[part.resistor_nodes], axis=1)[:, 0] ** 2 / part.resistance
        crossing = np.array([name.startswith("rc_") for name in part.resistor_names])
        shares.append((power[~crossing].sum(), power[crossing].sum()))
    found = np.array(shares, dtype=np.float64).reshape(-1, 2)
    found.setflags(write=False)
    return found


def checked(currents: Sequence[float] | Floats, design: Design, volts: Floats) -> Floats:
    """Return I / U of each probe after looking at it; 0 where it is nothing but rounding."""
    found = np.asarray(currents, dtype=np.float64)
    if found.shape != volts.shape or not np.isfinite(found).all():
        raise CircuitError(
            f"currents: {found.tolist()} is not usable; it must be one finite number for each of {len(volts)} probes"
        )
    conductance: Floats = found / volts
    nothing = _NONE * yarn_conductance(design)
    if conductance.min(initial=0.0) < -max(nothing, _NONE * conductance.max(initial=0.0)):
        raise CircuitError(f"currents: {found.tolist()} is not usable; no current may flow against its voltage")
    return np.where(conductance > nothing, conductance, 0.0)


def _without_current(insulated: Floats, yarns: float, weighting: str) -> OnePair:
    """Say what follows from no current at all: something on the way of every probe does not conduct."""
    Ry = Rc = float("nan")
    if not len(insulated):
        warnings: tuple[str, ...] = ("there are no probes: Ry and Rc are not determined",)
    elif yarns == 0.0 or insulated.any():
        Ry = float("inf")
        warnings = ("no probe carries current: the yarns do not conduct, and Rc is not determined",)
    else:
        Rc = float("inf")
        warnings = ("no probe carries current: the crossings do not conduct, and Ry is not determined",)
    return OnePair(
        Ry=Ry,
        Rc=Rc,
        residual=0.0 if len(insulated) else float("nan"),
        covariance=np.diag([np.inf, np.inf]),
        weighting=weighting,
        warnings=warnings,
        currents=np.zeros(len(insulated)),
    )


def _without_contacts(insulated: Floats, wanted: Floats, scale: Floats, volts: Floats, weighting: str) -> OnePair:
    """Fit Ry alone, in closed form: only probes along a yarn carry current, so the yarns are insulated."""
    model, target = insulated / scale, wanted / scale
    Ry = float(model @ model / (model @ target))
    misfit = model / Ry - target
    variance = _variance(misfit) * Ry**2 / float((model / Ry) @ (model / Ry))
    asked = bool((insulated == 0.0).any())
    return OnePair(
        Ry=Ry,
        Rc=float("inf") if asked else float("nan"),
        residual=float(np.linalg.norm(misfit)),
        covariance=np.array([[variance, 0.0], [0.0, np.inf]]),
        weighting=weighting,
        warnings=(
            "Rc is not determined: no probe between different yarns carries current"
            if asked
            else "Rc is not determined: there is no probe between different yarns",
        ),
        currents=insulated / Ry * volts,
    )


def _with_contacts(design: Design, wanted: Floats, scale: Floats, volts: Floats, weighting: str) -> OnePair:
    """Fit log Ry and log Rc, from the best of a table of ratios (given Rc / Ry, the best 1 / Ry is linear)."""
    target = wanted / scale
    start, best = np.zeros(2), np.inf
    unit = power_of_two(float(wanted.max()))  # S: logarithms of pure numbers are rounded alike at every scale
    for ratio in _RATIOS:
        model = network_conductances(design, 1.0, ratio).sum(axis=1) / scale
        siemens = float(model @ target / (model @ model))
        size = float(np.linalg.norm(siemens * model - target))
        if siemens > 0.0 and size < best:
            start, best = np.log([unit / siemens, ratio]), size

    # The search is in log Ry and log Rc / Ry: bounds of the ratio keep the network solvable.
    def values(logs: Floats) -> tuple[float, float]:
        return float(np.exp(logs[0])) / unit, float(np.exp(logs[0] + logs[1])) / unit

    def misfits(logs: Floats) -> Floats:
        difference: Floats = network_conductances(design, *values(logs)).sum(axis=1) / scale - target
        return difference

    def jacobian(logs: Floats) -> Floats:
        return -network_conductances(design, *values(logs)) @ [[1.0, 0.0], [1.0, 1.0]] / scale[:, None]

    low, high = np.log([_RATIOS[0] / _BEYOND, _RATIOS[-1] * _BEYOND])
    logs = start
    if best > _EXACT * float(np.linalg.norm(target)):  # as one probe alone always is; the search would divide by 0
        logs = least_squares(
            misfits,
            start,
            jacobian,
            bounds=([-np.inf, low], [np.inf, high]),
            xtol=1e-15,
            ftol=None,  # small misfits and slopes do not end the search: Rc may show in nothing but tiny currents
            gtol=None,
        ).x
    misfit = misfits(logs)
    Ry, Rc = values(logs)
    shares = network_conductances(design, Ry, Rc)
    spread, warnings = _spread(-shares / scale[:, None], float(np.abs(target).max()))
    if not low + 1.0 < logs[1] < high - 1.0:
        warnings += ("Ry and Rc are not determined, at the edge of the search: no Rc explains the currents",)
    if len(wanted) < 3:
        warnings += (f"{len(wanted)} probes leave no misfit to judge the fit by: the covariance is unknown",)
    lost = np.isinf(np.diag(spread)) | (np.sqrt(np.diag(spread)) * float(np.abs(target).max()) > _AMPLIFIED)
    if not low + 1.0 < logs[1] < high - 1.0:
        lost[:] = True  # where one of them stands at an edge, the other has gone astray with it
    variance = _variance(misfit)
    covariance = (
        variance * spread * np.outer([Ry, Rc], [Ry, Rc]) if np.isfinite(variance) else np.diag([np.inf, np.inf])
    )
    return OnePair(
        Ry=float("nan") if lost[0] else Ry,
        Rc=float("nan") if lost[1] else Rc,
        residual=float(np.linalg.norm(misfit)),
        covariance=covariance,
        weighting=weighting,
        warnings=warnings,
        currents=shares.sum(axis=1) * volts,
    )


def _variance(misfit: Floats) -> float:
    """Return the variance of one misfit, with two degrees of freedom spent on Ry and Rc."""
    return float(misfit @ misfit) / (len(misfit) - 2) if len(misfit) > 2 else float("inf")


def _spread(jacobian: Floats, size: float) -> tuple[Floats, tuple[str, ...]]:
    """Return (JᵀJ)⁻¹ of the logarithms, inf where J has lost its rank, and what must be said about it."""
    _, values, directions = np.linalg.svd(jacobian, full_matrices=True)
    values = np.concatenate([values, np.zeros(2 - len(values))])
    if values[-1] <= 1e-13 * values[0]:
        return np.diag([np.inf, np.inf]), (
            "Ry and Rc are not determined: the probes determine only one combination of them",
        )
    spread = (directions.T / values**2) @ directions
    warnings = tuple(
        f"{name} is not determined: an error of 1 % in the weighted currents moves it by {percent:.3g} %"
        for name, percent in zip(("Ry", "Rc"), np.sqrt(np.diag(spread)) * size, strict=True)
        if percent > _AMPLIFIED
    )
    return spread, warnings
