"""The current that warms the hottest fibril by a stated number of kelvin."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.results.records import Study


def rated_currents(study: Study, rise: float) -> Floats:
    """(S, n) current in A of each probe in each state at which the largest temperature rise is `rise`, K.

    The equations of a probe are linear and its heat is quadratic in the voltage: the rise goes with the square of
    the current, so that I = |I_probe| sqrt(rise / peak). nan where nothing is warmed.
    """
    current = np.array([record.currents for record in study.records]).reshape(len(study.records), -1)
    peak = np.array([[each.peak_temperature for each in record.fields] for record in study.records])
    peak = peak.reshape(current.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(peak > 0.0, np.abs(current) * np.sqrt(rise / peak), np.nan)
