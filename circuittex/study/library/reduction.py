"""The reductions to the pins that a library holds: the exact one, a thinned one, and corners of an ensemble."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.electrical.network.ports import PortMatrix
from circuittex.study.library.thinning import thinned

CORNERS = {"_p05": 95.0, "_p50": 50.0, "_p95": 5.0}
"""End of a corner's name, a percentile of resistance -> that of the conductances, of all resistors at once."""

TOLERANCES = {"_tmin": "lowest", "_tmax": "highest"}
"""End of the name at an end of the tolerances -> where every resistivity is."""


@frozen
class Reduction:
    """Port matrices of every state, and what they are."""

    end: str
    """Of the names of its sub-circuits; empty for the exact one."""
    title: str
    """What it is, one line."""
    ports: tuple[PortMatrix, ...]
    """(S,) the state's matrices."""


def exact(ports: tuple[PortMatrix, ...]) -> Reduction:
    """The reduction itself."""
    return Reduction("", "exact reduction to the pins", ports)


def thin(ports: tuple[PortMatrix, ...], error: float) -> Reduction:
    """The reduction without those resistors that matter least."""
    return Reduction(
        "_thin", f"reduction to the pins, no resistance too high by more than {error:.3g}", thinned(ports, error)
    )


def tolerances(low: tuple[PortMatrix, ...], high: tuple[PortMatrix, ...]) -> tuple[Reduction, ...]:
    """The reductions with the resistivities of all materials and contacts at the low and the high end of tolerance.

    No combination of resistivities within the tolerances gives a resistance outside these two: raising a resistor
    never lowers one (Rayleigh).
    """
    return tuple(
        Reduction(end, f"reduction to the pins, every resistivity at the {where} of its tolerance", ports)
        for (end, where), ports in zip(TOLERANCES.items(), (low, high), strict=True)
    )


def corners(members: Sequence[tuple[PortMatrix, ...]]) -> tuple[Reduction, ...]:
    """The 5th, 50th and 95th percentile of resistance over M members of an ensemble, (S,) matrices each.

    In a corner every resistor between two pins is at that percentile of its own at once, which none of the members is:
    the corners lie further apart than the percentiles of the resistance between two pins. All conductances are
    positive, so that corners are passive like the members.

    >>> members = [(PortMatrix(("a", "b"), g * np.array([[1.0, -1.0], [-1.0, 1.0]])),) for g in (1.0, 2.0, 3.0)]
    >>> [round(1.0 / float(each.ports[0].conductance[0, 0]), 3) for each in corners(members)]
    [0.345, 0.5, 0.909]
    """
    if any(len(each) != len(members[0]) or each[0].ports != members[0][0].ports for each in members):
        raise DesignError("members", len(members), "all must have the same states and pins")
    found = []
    for end, percentile in CORNERS.items():
        matrices = []
        for state in zip(*members, strict=True):
            G = -np.percentile([-np.minimum(m.conductance, 0.0) for m in state], percentile, axis=0)
            np.fill_diagonal(G, 0.0)
            matrices.append(PortMatrix(state[0].ports, G - np.diag(G.sum(axis=1))))
        title = f"reduction to the pins, each resistor at percentile {end[2:]} of {len(members)} packings"
        found.append(Reduction(end, title, tuple(matrices)))
    return tuple(found)
