"""What holds the ends of the yarns: a place, or a given force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from math import pi

from circuittex.base.frozen import frozen
from circuittex.design.checks import refuse
from circuittex.design.declaration import check, number
from circuittex.design.experiment import REST, Loading
from circuittex.design.weave import Weave

HELD = "held"
"""Stands for clamps that stay where the weave was laid out, or where a loading moves them."""


@frozen
class Clamps:
    """The tension of the yarns of either direction: the outcome of where their clamps are, or given.

    Under a given force the two clamps of a yarn move along it by the same distance, apart or towards one another; its
    fibrils end in them side by side. The force is the mean of the two clamps': they differ by what crossing yarns take
    up along the yarn, in a regular weave by nothing.

    >>> Clamps(weft_force=0.0).forces
    (None, 0.0)
    """

    warp_force: float | str = field(
        default=HELD,
        metadata=number(
            "N",
            '"held": the clamps of the warp stay where they are; or the tension of each warp yarn, 0 off the loom',
            shown=HELD,
            at_least=0,
            words=(HELD,),
        ),
    )
    """'held', or the tension of each warp yarn, N: its clamps slide along it until they pull with that."""
    weft_force: float | str = field(
        default=HELD,
        metadata=number("N", "the same of each weft yarn", shown=HELD, at_least=0, words=(HELD,)),
    )
    """The same of each weft yarn, N."""

    def __post_init__(self) -> None:
        check(self, "clamps")

    @property
    def forces(self) -> tuple[float | None, float | None]:
        """Given tension of each warp and each weft yarn, N; None where the clamps are held."""
        warp, weft = self.warp_force, self.weft_force
        return None if isinstance(warp, str) else warp, None if isinstance(weft, str) else weft

    @property
    def held(self) -> bool:
        """Whether no force is given.

        >>> Clamps().held
        True
        """
        return self.forces == (None, None)


def gripped(loading: Loading) -> str:
    """The axes along which a loading moves the clamps itself: those that it stretches in any of its states.

    >>> from circuittex.design import biaxial, shear, uniaxial
    >>> [gripped(each) for each in (uniaxial("a", (0.1,), axis="y"), biaxial("b", (0.1,)), shear("c", (0.1,)))]
    ['y', 'xy', '']
    """
    stretched = [any(gradient[k][k] != 1.0 for gradient in loading.gradients) for k in (0, 1)]
    return "".join(axis for axis, moved in zip("xy", stretched, strict=True) if moved)


def check_clamps(clamps: Clamps, weave: Weave, loadings: Sequence[Loading]) -> None:
    """Refuse forces that no yarn would bear, and loadings that contradict them.

    Raises `DesignError`, naming the field.
    """
    for name, yarns, force in zip(("warp", "weft"), (weave.warp, weave.weft), clamps.forces, strict=True):
        most = min(sum(m.youngs_modulus for m in yarn.fibrils) * pi * yarn.radius**2 for yarn in yarns)
        if force is not None and force > most:
            allowed = f"it must be at most {most:.4g} N, E A of the weakest yarn, at which its length more than doubles"
            raise refuse(f"clamps.{name}_force", force, allowed)
    for loading in loadings:
        for axis, force in zip("xy", clamps.forces, strict=True):
            if force and loading.free == axis:
                allowed = f"a force is given for the ends of the yarns along {axis!r} (clamps): they cannot be let go"
                raise refuse(f"loading.{loading.name}.free", loading.free, allowed)
        if not clamps.held and loading.start != REST:
            allowed = "under clamp forces the strain of other states is an outcome: it must start from the relaxed one"
            raise refuse(f"loading.{loading.name}.start", loading.start, allowed)
