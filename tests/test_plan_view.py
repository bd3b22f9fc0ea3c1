"""The check of sides that the drawn designs rely on, where lines cross at their nodes."""

from __future__ import annotations

import numpy as np
from plan_view import side


def test_lines_that_cross_at_nodes_cross_once() -> None:
    """Rounding took the node of a symmetric cell from both of the segments that meet there: 0 was found for 1."""
    t = np.linspace(-1.0, 1.0, 9)
    rng = np.random.default_rng(0)
    for angle in rng.uniform(0.1, 0.7, 500):
        c, s, aside = np.cos(angle), np.sin(angle), [*rng.normal(size=2), 0.0]
        warp = np.stack([c * t, s * t, np.full(9, 0.1)], axis=1) + aside
        weft = np.stack([-s * t, c * t, np.zeros(9)], axis=1) + aside
        assert side(warp, weft) == 1
        assert side(warp - [0, 0, 0.2], weft) == 0
