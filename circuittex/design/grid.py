"""A grid of strains along two axes: loadings that start from states of another one."""

from __future__ import annotations

from collections.abc import Sequence

from circuittex.design.checks import one_of, refuse
from circuittex.design.experiment import REST, Gradient, Loading, check_strains, loading_field

AXES = ("x", "y", "shear")
"""Stretch along x, stretch along y, and simple shear: Fxx - 1, Fyy - 1 and Fyx."""


def strain_grid(
    name: str, first: str, first_strains: Sequence[float], then: str, then_strains: Sequence[float]
) -> tuple[Loading, ...]:
    """The states of a rectangular grid: first along one axis, then from each of its states along the other.

    A loading NAME-FIRST goes from the relaxed state along the first axis, and one NAME-FIRSTa-THEN along the other
    from each strain a of the first, 0 among them: all states at a = 0.05 of 'pull' are those of 'pull-x0p05-y'. Strain
    as a label is that along the loading's own axis.

    >>> [(each.name, each.strains) for each in strain_grid("pull", "x", (0.05,), "y", (0.1, 0.2))]
    [('pull-x', (0.05,)), ('pull-x0-y', (0.1, 0.2)), ('pull-x0p05-y', (0.1, 0.2))]
    """
    at = loading_field(name)
    one_of(first, f"{at}.first.axis", AXES)
    rest = tuple(axis for axis in AXES if axis != first)
    one_of(then, f"{at}.then.axis", rest)
    first_strains = _outwards(first_strains, f"{at}.first.strains")
    then_strains = _outwards(then_strains, f"{at}.then.strains")
    along = tuple(_gradient({first: e}) for e in first_strains)
    rows = [Loading(f"{name}-{first}", along, first_strains)]
    for held, start in zip((0.0, *first_strains), (REST, *along), strict=True):
        gradients = tuple(_gradient({first: held, then: e}) for e in then_strains)
        word = f"{held:.6g}".replace(".", "p")
        rows.append(Loading(f"{name}-{first}{word}-{then}", gradients, then_strains, start=start))
    return tuple(rows)


def starting_state(loadings: Sequence[Loading], number: int) -> tuple[int, int] | None:
    """Which loading, and which state of it, the loading `number` starts from; None for the relaxed state.

    It is the first state with that gradient among the loadings before it whose ends are held alike. Raises
    `DesignError` where there is none.

    >>> starting_state(strain_grid("pull", "x", (0.05,), "y", (0.1,)), 2)
    (0, 0)
    """
    own = loadings[number]
    if own.start == REST:
        return None
    for k, other in enumerate(loadings[:number]):
        if other.free == own.free and own.start in other.gradients:
            return k, other.gradients.index(own.start)
    allowed = "it must be the gradient of a state of a loading before it, with the same ends held"
    raise refuse(f"loading.{own.name}.start", own.start, allowed)


def _gradient(strains: dict[str, float]) -> Gradient:
    x, y, shear = (strains.get(axis, 0.0) for axis in AXES)
    return ((1.0 + x, 0.0), (shear, 1.0 + y))


def _outwards(strains: object, field: str) -> tuple[float, ...]:
    """Strains that go away from 0, each further than the one before, so that no state of a grid comes twice."""
    strains = check_strains(strains, field)
    steps = [after - before for before, after in zip((0.0, *strains), strains, strict=False)]
    if not strains or not (min(steps) > 0.0 or max(steps) < 0.0):
        raise refuse(field, strains, "strains of a grid go from 0 in one direction, each further than the last")
    return strains
