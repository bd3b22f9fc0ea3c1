"""Potential and temperature of all fibrils on a contact state, by finite elements (scikit-fem)."""

from circuittex.electrical.fields.coefficients import Coefficients, at_temperatures, coefficients_of
from circuittex.electrical.fields.cooling import COLD_ENDS, Cooling, cooling_of
from circuittex.electrical.fields.solution import Fields, Potential, solve_fields, solve_potentials, solve_probes
from circuittex.electrical.fields.steady import solve_steady

__all__ = [
    "COLD_ENDS",
    "Coefficients",
    "Cooling",
    "Fields",
    "Potential",
    "at_temperatures",
    "coefficients_of",
    "cooling_of",
    "solve_fields",
    "solve_potentials",
    "solve_probes",
    "solve_steady",
]
