"""Temperature coefficients of the resistors of parts, from the same circuits at three temperatures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.electrical.network.ports import PortMatrix, resistances
from circuittex.study.library.network import Network, matrix_at
from circuittex.study.library.parts import Part

STEP = 50.0
"""K either way of 27 C: there the written coefficients are exact where strain is no input."""
CHECKED = (-STEP, -STEP / 2, STEP / 2, STEP)
"""K from 27 C: where the coefficients are compared with exact reductions."""
DIGITS = 10
"""Of a coefficient: a resistance at 50 K is right to 1e-11."""


LEAST = 0.01
"""Part of a resistance that its parabola leaves at least."""


def coefficients(network: Network, cold: Network, warm: Network) -> Floats:
    """(R, 2) tc1 and tc2 of each resistor: the parabola through it at 27 C and `STEP` below and above.

    Where strain is an input, the mean over its states. A parabola that nearly vanishes on the way is of a fitted
    resistance that nothing determines, and that is another at each temperature: it has the mean of all others.

    >>> g = np.array([[0.5]])
    >>> line = [Network(("a", "b"), ("r",), (("a", "b"),), np.zeros(1), g / f) for f in (1.0, 0.805, 1.205)]
    >>> coefficients(*line).tolist()
    [[0.004, 2e-06]]
    """
    down, up = network.conductance / cold.conductance, network.conductance / warm.conductance
    tc1, tc2 = (up - down) / (2.0 * STEP), (up + down - 2.0) / (2.0 * STEP**2)
    inside = np.abs(tc1) < 2.0 * tc2 * STEP  # its least, 1 - tc1^2 / (4 tc2)
    known = ~(inside & (tc1**2 > 4.0 * (1.0 - LEAST) * tc2))
    pairs = zip(_over_states(tc1, known).tolist(), _over_states(tc2, known).tolist(), strict=True)
    return np.array([[_rounded(a, 1e-13), _rounded(b, 1e-15)] for a, b in pairs]).reshape(-1, 2)


def _over_states(values: Floats, known: NDArray[np.bool_]) -> Floats:
    """(R,) mean of values (K, R) over the states in which they are known, that of all resistors where none is."""
    count = known.sum(axis=0)
    own = np.where(known, values, 0.0).sum(axis=0) / np.maximum(count, 1)
    return np.where(count > 0, own, own[count > 0].mean() if count.any() else 0.0)


def _rounded(value: float, noise: float) -> float:
    return 0.0 if abs(value) < noise else float(f"{value:.{DIGITS}g}")


def with_temperature(
    parts: Sequence[Part],
    cold: Sequence[Part],
    warm: Sequence[Part],
    exact: Mapping[float, tuple[PortMatrix, ...]],
    states: Mapping[str, Ints],
) -> list[Part]:
    """The parts with coefficients, from the same parts at `STEP` below and above 27 C.

    Reductions with less or other resistors than the exact one have the coefficients of its resistors. `exact`: at 0
    and each of `CHECKED` kelvin, the ports of all states; `states`: those of each path, and of '' the state of parts
    without strain.
    """
    below, above = ({part.name: part.network for part in each} for each in (cold, warm))
    own = {(part.level, part.path): part.network for part in parts if not part.end}
    known: dict[tuple[str, str], tuple[Floats, float]] = {}
    found = []
    for part in parts:
        key = (part.level, part.path)
        if key not in known:
            name = part.name.replace(f"{part.level}{part.end}", part.level, 1)
            if name not in below or name not in above:  # no fit at that temperature, which has been said
                found.append(part)
                continue
            tc = coefficients(own[key], below[name], above[name])
            drift = np.nan if part.level in ("unit", "detailed") else _drift(own[key], tc, exact, states[part.path])
            known[key] = tc, drift
        tc, drift = known[key]
        by_name = dict(zip(own[key].names, tc.tolist(), strict=True))
        usual = tc.mean(axis=0).tolist()
        there = np.array([by_name.get(each, usual) for each in part.network.names]).reshape(-1, 2)
        found.append(replace(part, network=replace(part.network, tc=there), drift=drift))
    return found


def _drift(network: Network, tc: Floats, exact: Mapping[float, tuple[PortMatrix, ...]], states: Ints) -> float:
    """Largest relative error of R(T)/R(27 C) over all pairs of pins, these states, and the temperatures `CHECKED`."""
    worst = 0.0
    for row, state in zip(network.conductance, states.tolist(), strict=True):
        base, truth = resistances(matrix_at(network, row)), resistances(exact[0.0][state])
        joined = np.isfinite(truth) & (truth > 0.0)
        for kelvin in CHECKED:
            then = matrix_at(network, row / (1.0 + tc[:, 0] * kelvin + tc[:, 1] * kelvin**2))
            given = (resistances(then) / np.where(joined, base, 1.0))[joined]
            wanted = (resistances(exact[kelvin][state]) / np.where(joined, truth, 1.0))[joined]
            worst = max(worst, float(np.abs(given / wanted - 1.0).max(initial=0.0)))
    return worst
