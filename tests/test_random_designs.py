"""The short form of `random_designs.py`: each design drawn is verified or refused in one sentence."""

from __future__ import annotations

import pytest
from random_designs import drawn, outcome

from circuittex.base.errors import CircuittexError

SEEDS = range(12)
ONCE_WRONG = (35, 86, 89)
"""A floating fibril without a potential; a crossing next to a short whose network was not solved; 0 / 0 in a fit."""


@pytest.mark.parametrize("seed", SEEDS)
def test_drawn_design_is_verified_or_refused(seed: int) -> None:
    verdict, why = outcome(seed)
    assert verdict in ("verified", "refused"), why


@pytest.mark.parametrize("seed", ONCE_WRONG)
def test_design_that_went_wrong_is_verified(seed: int) -> None:
    assert outcome(seed) == ("verified", "")


def test_designs_differ() -> None:
    """They are not the same few again and again."""
    made = []
    for seed in SEEDS:
        try:
            made.append(drawn(seed))
        except CircuittexError:
            continue
    assert len({(design.weave.draft, design.weave.pitch) for design in made}) == len(made) > 5
