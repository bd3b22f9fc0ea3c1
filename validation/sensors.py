"""A woven sensor under stretch."""

# ruff: noqa: E501 (sentences of the page)
from __future__ import annotations

from dataclasses import replace
from math import inf, pi, sqrt

import numpy as np
from bundle import bundle, plain
from comparison import Band, Comparison, Input, Point, Source

import circuittex as ct

SENSOR = Source(
    "SN Appl. Sci.",
    "SN Applied Sciences 2 (2020), abstract: 'relatively small (GF < 2) and nonlinearity'; stage I, the fabric's geometry: fewer 'interweaving points (nw)' or "
    "more 'arrangement density of warp yarn (Nj)' give 'improved sensitivity on warp direction'; stage II, the yarns' deformation: more points or less density",
    "https://doi.org/10.1007/s42452-019-1857-6",
)
THREAD = Source(
    "library",
    "the yarn silver_nylon_117_17x2 of this program, after DFRobot's wiki",
    "https://github.com/jimaobian/DFRobotWiki/wiki",
)
BASE, WARPS, WEFTS = (10.0, 10.0), (13.0, 10.0), (10.0, 13.0)
"""Warps and wefts a cm."""


def sensitivity(threads: tuple[float, float], skin: float, free: str) -> tuple[float, float]:
    """Gauge factor of the warps at first and once they are straight."""
    section = 234e-7 / 1.14e-3
    yarn = bundle(
        "thread", 2 * sqrt(section / (0.6 * pi)), section, 3e3, sqrt(section / 34 / pi), skin, conductance=1 / 0.269
    )
    ends = [ct.Terminal(name, (("warp1", side), ("warp2", side))) for name, side in (("a", -1), ("b", 1))]
    pull = ct.uniaxial("stretch", (0.005, 0.01, *np.linspace(0.02, 0.14, 7)), "x", free)
    design = replace(
        plain("sensor", yarn, yarn, (10 / threads[0], 10 / threads[1]), pull),
        terminals=tuple(ends),
        probes=(ct.Probe("along", "a", "b", 1.0),),
        electrical=ct.Electrical(conduction="current"),
    )
    study = ct.run_study(design)
    strain = np.array([record.strain for record in study.records])
    ohm = np.array([1 / float(record.currents[0]) for record in study.records])
    first, last = np.searchsorted(strain, 0.01 - 1e-9), -2
    return (ohm[first] / ohm[0] - 1) / 0.01, (ohm[-1] - ohm[last]) / ohm[0] / (strain[-1] - strain[last])


def stretched() -> Comparison:
    cases = [(skin, free) for skin in (100.0, 1000.0) for free in ("", "y")]
    found = {
        threads: np.array([sensitivity(threads, skin, free) for skin, free in cases])
        for threads in (BASE, WARPS, WEFTS)
    }

    def band(values: object) -> Band:
        return Band(float(np.min(values)), float(np.max(values)))  # type: ignore[call-overload]

    base, warps, wefts = (found[threads] for threads in (BASE, WARPS, WEFTS))
    return Comparison(
        title="The resistance of a woven sensor along a stretched yarn",
        measured="Gauge factor, (change of resistance) / strain, along the warp: below 2, and which way it goes with the weave, while the crimp is pulled out (I) and after (II).",
        sources=(SENSOR, THREAD),
        inputs=(
            Input("yarns", "234 dtex of nylon in 34 filaments, 269 ohm/m", THREAD),
            Input("thickness", "filaments fill 60 % of a round yarn", None, "two loosely twisted plies"),
            Input("warps and wefts a cm", "10 and 10; 13 and 10; 10 and 13", None, "the abstract has no numbers"),
            Input("stages", "the first 1 %; 12 to 14 %", None, "the crimp of these is 3 to 5 %"),
            Input("'interweaving points'", "wefts a cm", None, "as it is read here"),
            Input("resistivity", "constant", None, "elastic; a plating that does not crack"),
        ),
        computed="Both warps from end to end, as cores in skins of 0.1 and of 1 GPa that stretch and bend as free filaments; wefts held and let go. Both make the band.",
        unit="gauge factor, or ratio of two",
        points=(
            Point("10 x 10, I", Band(0.0, 2.0), band(base[:, 0])),
            Point("10 x 10, II", Band(0.0, 2.0), band(base[:, 1])),
            Point("more warps over fewer, I", Band(1.0, inf), band(warps[:, 0] / base[:, 0])),
            Point("more wefts over fewer, I", Band(0.0, 1.0), band(wefts[:, 0] / base[:, 0])),
            Point("more warps over fewer, II", Band(0.0, 1.0), band(warps[:, 1] / base[:, 1])),
            Point("more wefts over fewer, II", Band(1.0, inf), band(wefts[:, 1] / base[:, 1])),
        ),
        meaning="The crimp is pulled out before the metal is stretched: less comes of it than the 2 of a wire, and less still where the warp waves more. "
        "That leaves the second stage: once straight, a yarn that waved more has been stretched less, and its gauge factor, 2 (1 + strain) / (1 + crimp)^2, is smaller, not larger. "
        "What makes theirs larger is within their yarns, not in the weave's geometry. More warps go their way in that stage by less than a hundredth, which says little.",
    )
