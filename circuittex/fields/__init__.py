"""Potential and temperature of all fibrils on a contact state, by finite elements (scikit-fem)."""

from circuittex.fields.solution import Fields, solve_fields, solve_probes

__all__ = ["Fields", "solve_fields", "solve_probes"]
