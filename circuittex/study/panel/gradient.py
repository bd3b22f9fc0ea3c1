"""How the resistance between two electrodes changes with every cell, by the adjoint.

With one ampere from one electrode to the other, the others open, the adjoint solution of a symmetric network is the
solution itself (Tellegen): dR_ab / dR_k = i_k^2 with i_k the current through resistor k per ampere. One solution gives
the derivatives with every resistance, and the slopes of Ry and Rc with strain those with every strain.
"""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.design.checks import refuse
from circuittex.study.panel.solution import PanelSolution, at_crossings, resistor_currents, segments
from circuittex.study.panel.wiring import WARP, WEFT


@frozen
class PanelGradient:
    """Derivatives of the resistance between two electrodes with respect to what each of n x m cells is."""

    source: str
    """Electrode."""
    sink: str
    """Electrode."""
    resistance: float
    """R between them, the others open, ohm."""
    strain: Floats
    """(n, m) dR / d strain, ohm; 0 where strain is clamped."""
    crossing: Floats
    """(n, m) dR / dRc [1]."""
    warp: Floats
    """(n, m) dR / dRy of the warp yarn [1]."""
    weft: Floats
    """(n, m) dR / dRy of the weft yarn [1]."""


def panel_gradient(solution: PanelSolution, source: str, sink: str) -> PanelGradient:
    """The gradient of the resistance between two electrodes with respect to strain, Rc and Ry of every cell.

    Raises `DesignError` for an unknown electrode and two that nothing joins.

    >>> from circuittex.study.panel.cells import CellResistances
    >>> from circuittex.study.panel.solution import solve_panel
    >>> from circuittex.study.panel.statement import Electrode, Panel
    >>> ends = (Electrode("a", ends=("warp1-",)), Electrode("b", ends=("weft1+",)))
    >>> panel_gradient(solve_panel(Panel((1, 1), CellResistances(2.0, 2.0, 5.0), ends)), "a", "b").warp.tolist()
    [[0.5]]
    """
    a, b = (_number(solution, name) for name in (source, sink))
    if a == b:
        raise refuse("gradients", [source, sink], "they must be two different electrodes")
    ohm = float(solution.resistance[a, b])
    if not np.isfinite(ohm):
        raise refuse("gradients", [source, sink], "nothing joins these electrodes")
    wiring = solution.wiring
    own = np.flatnonzero(wiring.island == wiring.island[a])
    free = own[own != b]
    G = solution.ports.conductance[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.diag(G))
    volts = np.zeros(len(wiring.island))
    volts[free] = scale * np.linalg.solve(G * np.outer(scale, scale), scale * (free == a))
    share = resistor_currents(wiring, solution.basis, volts) ** 2
    warp, weft = (0.5 * (each[:, :-1] + each[:, 1:]) for each in (segments(wiring, share, k) for k in (WARP, WEFT)))
    weft = weft.T
    local = wiring.local
    # A seam beside Rc takes a part of the current: what is left goes with (R / Rc)^2, R of both.
    both = at_crossings(wiring, wiring.resistance)
    crossing = at_crossings(wiring, share) * (both / local.crossing) ** 2
    strain = sum(
        part * np.where(np.isfinite(value), value, 0.0) * slope
        for part, value, slope in (
            (warp, local.warp, local.warp_slope),
            (weft, local.weft, local.weft_slope),
            (crossing, local.crossing, local.crossing_slope),
        )
    )
    return PanelGradient(source, sink, ohm, np.asarray(strain), crossing, warp, weft)


def _number(solution: PanelSolution, name: str) -> int:
    if name not in solution.electrodes:
        raise refuse("gradients", name, f"the panel's electrodes are {', '.join(solution.electrodes)}")
    return solution.electrodes.index(name)
