"""What the probes of a state release, for each area of the fabric, where it goes, and what they may be driven by."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.design.probe import PER_CM2
from circuittex.electrical.fields import Fields
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.results.clamps import end_to_end
from circuittex.results.records import Record, Study


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
    voltage: float
    """Of the source above the sink, V."""
    rated_current: float
    """The current at which the largest rise is the rated one, A; nan where nothing is warmed, or nothing warms by that
    (a resistance that would have to be negative), and so the next two."""
    rated_power: float
    """The power that the source feeds in then, V I, W."""
    rated_power_density: float
    """For each area of the fabric, W/cm2."""

    def as_numbers(self) -> dict[str, str | float]:
        """By names with units, for summary.json."""
        return {
            "probe": self.probe,
            "voltage_V": self.voltage,
            "power_W": self.power,
            "power_density_W_cm2": self.power_density,
            "peak_temperature_K": self.rise,
            "along_yarns": self.along,
            "rated_current_A": self.rated_current,
            "rated_power_W": self.rated_power,
            "rated_power_density_W_cm2": self.rated_power_density,
        }


def heating(study: Study, record: Record) -> tuple[Heating, ...]:
    """The heat of each probe, and its ratings for the rise that the design states (`Electrical.rated_rise`)."""
    area = fabric_area(study.mesh, record.configuration)
    return tuple(_heating(field, area, study.design.electrical.rated_rise) for field in record.fields)


def _heating(field: Fields, area: float, rise: float) -> Heating:
    current, power = rating(field, rise)
    each = PER_CM2 / area if area > 0.0 else float("nan")  # a free yarn may have turned back on itself
    return Heating(
        probe=field.probe,
        power=field.heat,
        power_density=each * field.heat,
        along=field.heat_lost / field.heat if field.heat > 0.0 else float("nan"),
        rise=field.peak_temperature,
        voltage=field.voltage,
        rated_current=current,
        rated_power=power,
        rated_power_density=each * power,
    )


def driven_otherwise(design: Design) -> tuple[int, ...]:
    """Numbers of the probes that are not driven by a voltage, which follows in each state and is told then."""
    return tuple(number for number, probe in enumerate(design.probes) if not probe.voltage)


def fabric_area(mesh: FibrilMesh, configuration: Configuration) -> float:
    """Area of the cell in its plane, mm2: of the parallelogram of the mean ways from end to end of warp and of weft.

    Where all clamps are held these are its spans, times the determinant of the average gradient; clamps that slide
    under a force, and edges that were let go, count where they are.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> from circuittex.mech.configuration import initial_configuration
    >>> mesh = build_mesh(plain_weave())
    >>> round(fabric_area(mesh, initial_configuration(mesh)), 12)
    64.0
    """
    ways = end_to_end(mesh, configuration.r)
    warp, weft = (ways[mesh.yarn_axis == axis].mean(axis=0) for axis in (0, 1))
    return abs(float(warp[0] * weft[1] - warp[1] * weft[0]))


def rating(field: Fields, rise: float) -> tuple[float, float]:
    """The current, A, and the power of its source, W, with which a probe's largest temperature rise is `rise`, K.

    The equations of a probe are linear and its heat is quadratic in the voltage: the rise goes with the square of
    voltage and current, hence by sqrt(rise / peak). Where they are not linear these were solved for with the fields,
    for one rise. nan where nothing is warmed, or nothing warms by that, and for other rises than that.
    """
    current = float(field.currents[0])
    if len(field.rated):
        stated, rated, power = field.rated.tolist()
        return (rated, power) if stated == rise else (float("nan"), float("nan"))
    times = float(np.sqrt(rise / field.peak_temperature)) if field.peak_temperature > 0.0 else float("nan")
    return abs(current) * times, field.voltage * current * times * times


def rated_currents(study: Study, rise: float) -> Floats:
    """(S, n) current in A of each probe in each state at which the largest temperature rise is `rise`, K; nan where
    nothing is warmed, and for another rise than the design's where heating is nonlinear."""
    return np.array([[rating(f, rise)[0] for f in record.fields] for record in study.records])
