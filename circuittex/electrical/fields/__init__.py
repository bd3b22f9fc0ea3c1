"""Potential and temperature of all fibrils on a contact state, by finite elements (scikit-fem)."""

from circuittex.electrical.fields.cooling import COLD_ENDS, Cooling, cooling_of
from circuittex.electrical.fields.solution import Fields, Potential, solve_fields, solve_potentials, solve_probes

__all__ = [
    "COLD_ENDS",
    "Cooling",
    "Fields",
    "Potential",
    "cooling_of",
    "solve_fields",
    "solve_potentials",
    "solve_probes",
]
