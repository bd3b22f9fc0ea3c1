"""Potential and temperature of all fibrils on a contact state, by finite elements (scikit-fem)."""

from circuittex.electrical.fields.solution import Fields, Potential, solve_fields, solve_potentials, solve_probes

__all__ = ["Fields", "Potential", "solve_fields", "solve_potentials", "solve_probes"]
