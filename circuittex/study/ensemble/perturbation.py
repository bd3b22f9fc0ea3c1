"""How much the packings of an ensemble differ, and the seed of each member."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from circuittex.design import Design, Weave
from circuittex.design.packing import Packing
from circuittex.geometry.packing import section_offsets

SHARE = 0.05
"""Default standard deviation of each perturbation, over the radius of a fibril."""


def default_packing(weave: Weave, seed: int = 0) -> Packing:
    """Amplitudes for a design that states none: each of the four moves a fibril by 5 % of the smallest radius.

    Lateral and vertical offsets and the shift of the waves have that standard deviation. So has, by the twist, the
    path of the fibril farthest from the axis of its yarn at the end of the longest yarn. This is little against the
    distances that fibrils move when they settle, and much against rounding: what it changes is which of the nearly
    equal equilibria a frictionless cell finds.

    >>> from circuittex.design import plain_weave
    >>> packing = default_packing(plain_weave().weave)
    >>> round(packing.lateral, 6), round(packing.twist, 6)
    (0.0075, 0.000663)
    """
    size = SHARE * min(yarn.radius for yarn in weave.yarns)
    length = max(direction.crossings * direction.step for direction in weave.directions)
    farthest = max(float(np.hypot(*section_offsets(yarn).T).max()) for yarn in weave.yarns)
    twist = size / (np.pi * length * farthest) if farthest > 0.0 else 0.0
    twist = min(twist, 0.25 / weave.least_pitch)
    return Packing(seed=seed, lateral=size, vertical=size, twist=twist, phase=min(size, weave.least_pitch / 4.0))


def perturbed(design: Design, seed: int | None = None) -> Design:
    """The design with the amplitudes and the seed of the ensemble in its packing."""
    packing = design.packing
    if packing.regular:
        packing = default_packing(design.weave, packing.seed)
    return replace(design, packing=packing if seed is None else replace(packing, seed=seed))


def member_seed(seed: int, number: int) -> int:
    """The seed of member `number` (from 0) of the ensemble with `seed`, however many members it has.

    53 bits, so that any program that reads JSON keeps all of them.

    >>> member_seed(0, 0), member_seed(0, 1)
    (4232842298785526, 2383740928328724)
    """
    state = np.random.SeedSequence(seed, spawn_key=(number,)).generate_state(1, np.uint64)
    return int(state[0]) >> 11


def member_design(design: Design, number: int) -> Design:
    """The design of member `number`: `design` with the amplitudes of its packing and the member's own seed."""
    return replace(design, packing=replace(design.packing, seed=member_seed(design.packing.seed, number)))
