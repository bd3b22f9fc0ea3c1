"""What the probes of a state release, for each area of the fabric, and where it goes."""

from __future__ import annotations

import numpy as np

from circuittex.base.frozen import frozen
from circuittex.results.records import Record, Study

PER_CM2 = 100.0
"""W/mm2 in W/cm2."""


@frozen
class Heating:
    """One probe on one state."""

    probe: str
    """Its name."""
    power: float
    """Joule heat, W."""
    power_density: float
    """For each area of the fabric, W/cm2."""
    along: float
    """Part of it that leaves along the yarns; the rest goes out at their ends. nan where nothing is released."""
    rise: float
    """Largest temperature rise, K."""

    def as_numbers(self) -> dict[str, str | float]:
        """By names with units, for summary.json."""
        return {
            "probe": self.probe,
            "power_W": self.power,
            "power_density_W_cm2": self.power_density,
            "peak_temperature_K": self.rise,
            "along_yarns": self.along,
        }


def heating(study: Study, record: Record) -> tuple[Heating, ...]:
    """The heat of each probe, on the area of the cell: its spans times the determinant of the average gradient."""
    warps, wefts = study.design.weave.directions
    area = warps.crossings * warps.step * wefts.crossings * wefts.step * float(np.linalg.det(record.gradient))
    return tuple(
        Heating(
            field.probe,
            field.heat,
            PER_CM2 * field.heat / area,
            field.heat_lost / field.heat if field.heat > 0.0 else float("nan"),
            field.peak_temperature,
        )
        for field in record.fields
    )
