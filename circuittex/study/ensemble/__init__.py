"""Ensembles: the same design with many random packings, each a full study, and the spread of their results."""

from circuittex.study.ensemble.result import Ensemble, percentiles
from circuittex.study.ensemble.run import run_ensemble

__all__ = ["Ensemble", "percentiles", "run_ensemble"]
