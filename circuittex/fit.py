"""The reduced network [43-46] fitted to probe currents by least squares [47]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from circuittex.circuit import reached_part, reduced_circuit, yarn_end_name
from circuittex.design import Design
from circuittex.errors import CircuitError
from circuittex.frozen import frozen
from circuittex.geometry.mesh import Floats
from circuittex.nodal import solve_nodal

# A current below this fraction of the largest is none: it is rounding of the solution that it came from.
_NONE = 1e-12
# Rc / Ry of the start values, one for each decade, and how far beyond them the search may go.
_RATIOS = np.logspace(-8.0, 10.0, 19)
_BEYOND = 10.0
# A value is called undetermined where a relative error of the weighted currents comes back this many times larger.
_AMPLIFIED = 100.0


@frozen
class Fit:
    """The reduced network that comes closest to the currents of the probes."""

    Ry: float
    """Resistance of a yarn segment from crossing to crossing, ohm."""
    Rc: float
    """Resistance of a crossing, ohm; inf where no probe that crosses between yarns carries current."""
    residual: float
    """Root of the sum of squared misfits: relative ('relative') or in A ('absolute')."""
    covariance: Floats
    """(2, 2) of Ry and Rc, ohm2, from the misfit with two degrees of freedom spent; inf where nothing tells."""
    weighting: str
    """'relative' or 'absolute'."""
    warnings: tuple[str, ...]
    """What the probes do not determine; empty if all is well."""
    currents: Floats
    """(n,) probe currents of the fitted network, A."""


def fit_network(currents: Sequence[float] | Floats, design: Design, *, weighting: str = "relative") -> Fit:
    """Return the Ry and Rc whose reduced network has the probe currents (n,) in A of `design.probes`.

    'absolute' minimises Σ (I_network - I)² as [47] is written, 'relative' Σ (I_network / I - 1)². Probes across yarns
    carry about a hundredth of the current along one yarn, so in the absolute sum the little that the network cannot
    follow along the yarn outweighs all they say about Rc; relative misfits let every probe speak.

    Raises `CircuitError` for currents that are not one finite number for each probe, flow backwards, or all vanish.
    """
    if weighting not in ("relative", "absolute"):
        raise CircuitError(f"weighting: {weighting!r} is not usable; it must be 'relative' or 'absolute'")
    volts = np.array([probe.voltage for probe in design.probes])
    wanted = _checked(currents, volts)
    size = float(wanted.max())
    carries = wanted > _NONE * size
    scale: Floats = np.where(carries, wanted, size) if weighting == "relative" else 1.0 / np.abs(volts)
    insulated = network_conductances(design, 1.0, np.inf).sum(axis=1)
    if np.array_equal(carries, insulated > 0.0):
        return _without_contacts(insulated, wanted, scale, volts, weighting)
    return _with_contacts(design, wanted, scale, volts, weighting)


def network_conductances(design: Design, Ry: float, Rc: float) -> Floats:
    """Return the conductance of the reduced network at each probe, S, in two shares (n, 2): yarn arms and crossings.

    A share is the power Σ G ΔV² of those resistors over the squared probe voltage. Since the power is stationary in
    the potential, -share / Ry and -share / Rc are also the exact derivatives of the conductance with Ry and Rc.
    """
    shape = (len(design.weave.warp), len(design.weave.weft))
    whole = reduced_circuit(shape, Ry, Rc)
    ends = {t.name: [yarn_end_name(yarn, side) for yarn, side in t.ends] for t in design.terminals}
    shares = []
    for probe in design.probes:
        drive = dict.fromkeys(ends[probe.source], 1.0) | dict.fromkeys(ends[probe.sink], 0.0)
        part = reached_part(whole, drive)
        voltage = solve_nodal(part, drive).voltage
        power = np.diff(voltage[part.resistor_nodes], axis=1)[:, 0] ** 2 / part.resistance
        crossing = np.array([name.startswith("rc_") for name in part.resistor_names])
        shares.append((power[~crossing].sum(), power[crossing].sum()))
    return np.array(shares, dtype=np.float64).reshape(-1, 2)


def _checked(currents: Sequence[float] | Floats, volts: Floats) -> Floats:
    """Return I / U of each probe after looking at it."""
    found = np.asarray(currents, dtype=np.float64)
    if found.shape != volts.shape or not np.isfinite(found).all() or len(found) == 0:
        raise CircuitError(
            f"currents: {found.tolist()} is not usable; it must be one finite number for each of {len(volts)} probes"
        )
    conductance: Floats = found / volts
    if conductance.max() <= 0.0:
        raise CircuitError(f"currents: {found.tolist()} is not usable; at least one probe must carry current")
    if conductance.min() < -_NONE * conductance.max():
        raise CircuitError(f"currents: {found.tolist()} is not usable; no current may flow against its voltage")
    return conductance


def _without_contacts(insulated: Floats, wanted: Floats, scale: Floats, volts: Floats, weighting: str) -> Fit:
    """Fit Ry alone, in closed form: only probes along a yarn carry current, so the yarns are insulated."""
    model, target = insulated / scale, wanted / scale
    Ry = float(model @ model / (model @ target))
    misfit = model / Ry - target
    variance = _variance(misfit) * Ry**2 / float((model / Ry) @ (model / Ry))
    return Fit(
        Ry=Ry,
        Rc=float("inf"),
        residual=float(np.linalg.norm(misfit)),
        covariance=np.array([[variance, 0.0], [0.0, np.inf]]),
        weighting=weighting,
        warnings=("Rc is not determined: no probe between different yarns carries current",),
        currents=insulated / Ry * volts,
    )


def _with_contacts(design: Design, wanted: Floats, scale: Floats, volts: Floats, weighting: str) -> Fit:
    """Fit log Ry and log Rc, from the best of a table of ratios (given Rc / Ry, the best 1 / Ry is linear)."""
    target = wanted / scale
    start, best = np.zeros(2), np.inf
    for ratio in _RATIOS:
        model = network_conductances(design, 1.0, ratio).sum(axis=1) / scale
        siemens = float(model @ target / (model @ model))
        misfit = float(np.linalg.norm(siemens * model - target))
        if siemens > 0.0 and misfit < best:
            start, best = np.log([1.0 / siemens, ratio / siemens]), misfit

    def misfits(logs: Floats) -> Floats:
        difference: Floats = network_conductances(design, *np.exp(logs)).sum(axis=1) / scale - target
        return difference

    def jacobian(logs: Floats) -> Floats:
        return -network_conductances(design, *np.exp(logs)) / scale[:, None]

    reach = np.log(_BEYOND * np.array([1.0 / _RATIOS[0], _RATIOS[-1]]))
    low, high = start[0] - reach[0], start[0] + reach[1]
    found = least_squares(
        misfits,
        start,
        jacobian,
        bounds=([-np.inf, low], [np.inf, high]),
        xtol=1e-15,
        ftol=None,  # small misfits and slopes do not end the search: Rc may show in nothing but tiny currents
        gtol=None,
    )
    Ry, Rc = (float(value) for value in np.exp(found.x))
    spread, warnings = _spread(jacobian(found.x), float(np.abs(target).max()))
    if not low + 1.0 < found.x[1] < high - 1.0:
        warnings += (f"Rc is at the edge of the search, {Rc:.3g} ohm: no crossing resistance explains the currents",)
    if len(wanted) < 3:
        warnings += (f"{len(wanted)} probes leave no misfit to judge the fit by: the covariance is unknown",)
    values = np.array([Ry, Rc])
    variance = _variance(found.fun)
    covariance = variance * spread * np.outer(values, values) if np.isfinite(variance) else np.diag([np.inf, np.inf])
    return Fit(
        Ry=Ry,
        Rc=Rc,
        residual=float(np.linalg.norm(found.fun)),
        covariance=covariance,
        weighting=weighting,
        warnings=warnings,
        currents=network_conductances(design, Ry, Rc).sum(axis=1) * volts,
    )


def _variance(misfit: Floats) -> float:
    """Return the variance of one misfit, with two degrees of freedom spent on Ry and Rc."""
    return float(misfit @ misfit) / (len(misfit) - 2) if len(misfit) > 2 else float("inf")


def _spread(jacobian: Floats, size: float) -> tuple[Floats, tuple[str, ...]]:
    """Return (JᵀJ)⁻¹ of the logarithms, inf where J has lost its rank, and what must be said about it."""
    _, values, directions = np.linalg.svd(jacobian, full_matrices=True)
    values = np.concatenate([values, np.zeros(2 - len(values))])
    if values[-1] <= 1e-13 * values[0]:
        return np.diag([np.inf, np.inf]), ("the probes determine only one combination of Ry and Rc",)
    spread = (directions.T / values**2) @ directions
    warnings = tuple(
        f"{name} is hardly determined: an error of 1 % in the weighted currents moves it by {percent:.3g} %"
        for name, percent in zip(("Ry", "Rc"), np.sqrt(np.diag(spread)) * size, strict=True)
        if percent > _AMPLIFIED
    )
    return spread, warnings
