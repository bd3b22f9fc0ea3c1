"""The second simulator: optional on a developer's machine, required where everything is checked."""

from __future__ import annotations

import os
import shutil

import pytest

GNUCAP = shutil.which("gnucap")
needs_gnucap = pytest.mark.skipif(
    GNUCAP is None and "CI" not in os.environ, reason="gnucap is not installed; `.ci/setup gnucap` does it"
)
"""In CI the test runs, and fails, where `.ci/setup gnucap` did not install it."""
