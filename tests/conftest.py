"""Settings shared by all tests; they must hold before NumPy and numba are first imported."""

from __future__ import annotations

import os

# Parallel workers fill the cores by themselves: threads inside each of them would only compete.
if "PYTEST_XDIST_WORKER" in os.environ:
    for variable in ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
os.environ.setdefault("MPLBACKEND", "Agg")

from hypothesis import HealthCheck, settings

# The first example of a kernel pays for its compilation, so time says nothing about an example.
settings.register_profile("local", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("ci", parent=settings.get_profile("local"), derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")
