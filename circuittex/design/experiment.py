"""What is done to a textile: the loadings."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import hypot, inf

import numpy as np

from circuittex.base.frozen import frozen
from circuittex.design.checks import instance, name, one_of, real, refuse, sequence, store, whole

Gradient = tuple[tuple[float, float], tuple[float, float]]
"""In-plane deformation gradient ((Fxx, Fxy), (Fyx, Fyy))."""
REST: Gradient = ((1.0, 0.0), (0.0, 1.0))
LEAST_STRETCH, MOST_STRETCH = 0.1, 5.0
"""Principal stretches of the cell: no fabric is stretched or crushed further, and no model of one would hold."""
MOST_STATES = 10_000
"""Recorded states of one loading."""


@frozen
class Loading:
    """A sequence of recorded states, each an average in-plane deformation gradient from the relaxed state; each starts
    from the one before it, the first from the relaxed state unless told otherwise.

    >>> Loading("stretch", (((1.025, 0.0), (0.0, 1.0)),), (0.025,)).strains
    (0.025,)
    """

    name: str
    """What it is called."""
    gradients: tuple[Gradient, ...]
    """((Fxx, Fxy), (Fyx, Fyy)) of each state."""
    strains: tuple[float, ...]
    """The strain that labels each state."""
    free: str = ""
    """'x' or 'y': the ends of all yarns along that axis are let go, as the lateral edges of a strip test."""
    start: Gradient = REST
    """Gradient of the state that it starts from: the relaxed one, or one of a loading before it (`starting_state`)."""

    def __post_init__(self) -> None:
        at = loading_field(self.name)
        gradients = sequence(self.gradients, f"{at}.gradients", "matrices [[Fxx, Fxy], [Fyx, Fyy]]")
        strains = check_strains(self.strains, f"{at}.strains")
        if not gradients:
            raise refuse(f"{at}.gradients", self.gradients, "at least one state is needed")
        if len(strains) != len(gradients):
            raise refuse(f"{at}.strains", len(strains), f"{len(gradients)} gradients need one strain each as a label")
        store(
            self,
            gradients=tuple(check_gradient(F, f"{at}.gradients[{i}]") for i, F in enumerate(gradients)),
            strains=strains,
            start=check_gradient(self.start, f"{at}.start"),
        )
        check_free_edges(self.free, self.gradients, f"{at}.free")


def uniaxial(name: str, strains: Sequence[float], axis: str = "x", free: str = "") -> Loading:
    """Stretch along `axis` with the other direction held, or `free`: F = I + e e_axis x e_axis.

    >>> uniaxial("stretch", equal_steps(0.1, 4)).gradients[3]
    ((1.1, 0.0), (0.0, 1.0))
    """
    at = loading_field(name)
    strains = check_strains(strains, f"{at}.strains")
    along_x = one_of(axis, f"{at}.axis", ("x", "y")) == "x"
    gradients = tuple(((1.0 + e, 0.0), (0.0, 1.0)) if along_x else ((1.0, 0.0), (0.0, 1.0 + e)) for e in strains)
    return Loading(name, gradients, strains, free)


def biaxial(name: str, strains: Sequence[float]) -> Loading:
    """Equal stretch of both directions: F = (1 + e) I.

    >>> biaxial("swell", [0.5]).gradients
    (((1.5, 0.0), (0.0, 1.5)),)
    """
    strains = check_strains(strains, f"{loading_field(name)}.strains")
    return Loading(name, tuple(((1.0 + e, 0.0), (0.0, 1.0 + e)) for e in strains), strains)


def shear(name: str, strains: Sequence[float], free: str = "") -> Loading:
    """Simple shear, y displacement proportional to X: F = I + g e2 x e1.

    >>> shear("shear", [0.25]).gradients
    (((1.0, 0.0), (0.25, 1.0)),)
    """
    strains = check_strains(strains, f"{loading_field(name)}.strains")
    return Loading(name, tuple(((1.0, 0.0), (g, 1.0)) for g in strains), strains, free)


def load_unload(loading: Loading) -> Loading:
    """The loading, then the same states back to where it started: the relaxed cell's gradient, F = I, at strain 0.

    >>> load_unload(uniaxial("cycle", (0.05, 0.1))).strains
    (0.05, 0.1, 0.05, 0.0)
    """
    instance(loading, "loading", Loading)
    gradients = (*loading.gradients, *loading.gradients[-2::-1], REST)
    return Loading(loading.name, gradients, (*loading.strains, *loading.strains[-2::-1], 0.0), loading.free)


def equal_steps(strain: float, steps: int) -> tuple[float, ...]:
    """`steps` strains up to `strain`, each the float nearest to its decimal value.

    >>> equal_steps(0.1, 4)
    (0.025, 0.05, 0.075, 0.1)
    """
    exact = Fraction(repr(real(strain, "strain")))
    steps = whole(steps, "steps", 1, MOST_STATES)
    return tuple(float(exact * i / steps) for i in range(1, steps + 1))


def loading_field(of: object) -> str:
    """The field of the loading called `of`, whose name must be one before it stands in any message.

    >>> loading_field("stretch")
    'loading.stretch'
    """
    return f"loading.{name(of, 'loading.name')}"


def check_strains(strains: object, field: str) -> tuple[float, ...]:
    """The strains that label the states of a loading.

    >>> check_strains([0.05, 0.1], "loading.stretch.strains")
    (0.05, 0.1)
    """
    return tuple(real(e, f"{field}[{i}]") for i, e in enumerate(sequence(strains, field, "numbers")))


def check_free_edges(free: str, gradients: Sequence[Gradient], field: str) -> None:
    """Refuse to free the edges that a loading is about: what is left held must be moved, or nothing moved at all.

    >>> check_free_edges("y", uniaxial("strip", (0.1,)).gradients, "loading.strip.free")
    """
    if not one_of(free, field, ("", "x", "y")) or all(F == REST for F in gradients):
        return
    held = 1 if free == "x" else 0  # the axis along which the clamped yarns run
    if all((F[0][held], F[1][held]) == (REST[0][held], REST[1][held]) for F in gradients):
        left = "xy"[held]
        raise refuse(field, free, f"nothing would be loaded: no state moves the ends of the yarns along {left!r}")


def check_gradient(gradient: object, field: str) -> Gradient:
    """An in-plane deformation gradient with positive determinant.

    >>> check_gradient([[1.1, 0], [0, 1]], "loading.stretch.gradients[0]")
    ((1.1, 0.0), (0.0, 1.0))
    """
    shape = "it must be a matrix [[Fxx, Fxy], [Fyx, Fyy]]"
    if isinstance(gradient, np.ndarray):
        gradient = gradient.tolist()
    if not isinstance(gradient, list | tuple) or len(gradient) != 2:
        raise refuse(field, gradient, shape)
    rows = [row.tolist() if isinstance(row, np.ndarray) else row for row in gradient]
    if any(not isinstance(row, list | tuple) or len(row) != 2 for row in rows):
        raise refuse(field, gradient, shape)
    (xx, xy), (yx, yy) = (tuple(real(v, f"{field}[{i}]") for v in row) for i, row in enumerate(rows))
    if not 0.0 < xx * yy - xy * yx < inf:
        raise refuse(field, gradient, "its determinant must be > 0 (no area may vanish or turn over)")
    # Sum and difference of the two principal stretches.
    both, apart = hypot(xx + yy, xy - yx), hypot(xx - yy, xy + yx)
    least, most = (both - apart) / 2.0, (both + apart) / 2.0
    if least < LEAST_STRETCH or most > MOST_STRETCH:
        allowed = f"it stretches the cell by factors of {least:.3g} and {most:.3g}"
        raise refuse(field, gradient, f"{allowed}; from {LEAST_STRETCH:g} to {MOST_STRETCH:g} are allowed")
    return (xx, xy), (yx, yy)
