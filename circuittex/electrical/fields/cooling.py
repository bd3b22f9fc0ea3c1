"""How heat leaves the fibrils: along their surface, and through their ends."""

from __future__ import annotations

from dataclasses import field
from math import pi, sqrt

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.design import Design, Yarn
from circuittex.design.statement import LINEAR
from circuittex.geometry.mesh import FibrilMesh

STEFAN_BOLTZMANN = 5.670374419e-14
"""W/(mm2 K4) (CODATA 2018)."""
SURROUNDINGS = 300.0
"""K, near 27 C: where radiation is linear in the rise, and where its surroundings are. At a rise of 50 K it is 28 %
more than that."""


@frozen
class Cooling:
    """What F fibrils hand over for each kelvin above the surroundings."""

    loss: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) along the axis, W/(mm K); empty where nothing leaves along it."""
    end: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) through each of a fibril's ends, W/K, 0 for insulated ends; empty where all ends stay as cool as the
    surroundings."""
    radiating: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) emissivity times sigma times outline, W/(mm K4), of what radiates with T^4, which `loss` does not count;
    empty where nothing does."""


COLD_ENDS = Cooling()
"""The paper's: no loss along the fibrils, whose ends stay as cool as the surroundings."""


def cooling_of(design: Design, mesh: FibrilMesh) -> Cooling:
    """The cooling that a design asks for.

    A yarn hands over (h + 4 e sigma T^3) times its outline for each length and kelvin, with the coefficient h
    (`Electrical.heat_loss`), the emissivity e and T the temperature of the surroundings; its fibrils take equal parts.
    With `Electrical.heating` "nonlinear" it is h alone, and e sigma ((T + rise)^4 - T^4) comes to it.
    """
    electrical = design.electrical
    h, radiates = electrical.heat_loss, electrical.emissivity * STEFAN_BOLTZMANN
    if linear := electrical.heating == LINEAR:
        h = electrical.heat_loss + 4.0 * electrical.emissivity * STEFAN_BOLTZMANN * SURROUNDINGS**3
    fibrils = np.array([yarn.n_fibrils for yarn in design.weave.yarns], dtype=np.float64)
    loss = end = radiating = np.empty(0)
    if h > 0.0:
        loss = h * (np.array([outline(yarn) for yarn in design.weave.yarns]) / fibrils)[mesh.yarn]
    if radiates > 0.0 and not linear:
        radiating = radiates * (np.array([outline(yarn) for yarn in design.weave.yarns]) / fibrils)[mesh.yarn]
    if not isinstance(electrical.thermal_ends, str):
        end = (1.0 / (electrical.thermal_ends * fibrils))[mesh.yarn]
    elif electrical.thermal_ends == "insulated":
        end = np.zeros(mesh.n_fibrils)
    return Cooling(loss, end, radiating)


def outline(yarn: Yarn) -> float:
    """Circumference of the ellipse as wide and as high as the rows of a yarn, mm.

    Ramanujan's formula, exact for a circle and within 1e-4 for ellipses up to ten times as wide as high.

    >>> from circuittex.design import plain_weave
    >>> round(outline(plain_weave(rows=(1,)).weave.warp[0]) / (2 * pi * 0.15), 12)
    1.0
    """
    a = (max(yarn.rows) - 1) * yarn.spacing / 2.0 + yarn.radius
    b = (len(yarn.rows) - 1) * yarn.row_spacing / 2.0 + yarn.radius
    flat = ((a - b) / (a + b)) ** 2
    return pi * (a + b) * (1.0 + 3.0 * flat / (10.0 + sqrt(4.0 - 3.0 * flat)))
