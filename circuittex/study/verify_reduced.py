"""ngspice's word on the reduced network."""

from __future__ import annotations

import numpy as np

from circuittex.base.errors import NgspiceError
from circuittex.design import Design
from circuittex.electrical.network.circuit import yarn_end_name
from circuittex.electrical.spice.ngspice import run_decks
from circuittex.fit import Fit
from circuittex.netlist import deck, pin_names


def verify_reduced(design: Design, fit: Fit, *, timeout: float = 60.0) -> float:
    """Largest relative difference between the fit's probe currents and ngspice's for the same network.

    nan where ngspice did not answer, or where there is no network to ask about.
    """
    carried = np.isfinite(fit.currents) & (fit.currents != 0.0)
    probes = [probe for probe, there in zip(design.probes, carried, strict=True) if there]
    if not fit.known or not probes:
        return float("nan")
    circuit = fit.circuit()
    pins = dict(zip(circuit.ports, pin_names(circuit), strict=True))
    ends = {t.name: [yarn_end_name(yarn, side) for yarn, side in t.ends] for t in design.terminals}
    drives = [
        dict.fromkeys(ends[probe.sink], 0.0) | dict.fromkeys(ends[probe.source], probe.voltage) for probe in probes
    ]
    try:
        answers = run_decks([deck(circuit, drive) for drive in drives], timeout)
    except NgspiceError:
        return float("nan")
    currents = np.array(
        [
            -sum(float(data.plots[0].current(f"v{pins[end]}")[0]) for end in ends[probe.source])
            for data, probe in zip(answers, probes, strict=True)
        ]
    )
    return float(np.max(np.abs(currents / fit.currents[carried] - 1.0), initial=0.0))
