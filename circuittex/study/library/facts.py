"""What a library says of itself: levels, paths, errors of what is written, and which level to use."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.electrical.network.ports import PortMatrix, port_matrix
from circuittex.results.heating import rated_currents
from circuittex.results.records import Study
from circuittex.study.library.accuracy import Errors, compared
from circuittex.study.library.bicubic import left_out
from circuittex.study.library.fit_corners import FitCorner, fit_corners
from circuittex.study.library.interpolation import without
from circuittex.study.library.levels import CRIMPED, Levels, levels, port_matrices
from circuittex.study.library.network import WITHIN, matrix_at, ports_network
from circuittex.study.library.parts import Part
from circuittex.study.library.reduction import TOLERANCES, Reduction, corners, exact, thin, tolerances
from circuittex.study.library.resistivity import at_end, differs
from circuittex.study.library.strain_grid import StrainGrid, grids
from circuittex.study.library.strain_path import StrainPath, paths

GOOD = 0.01
"""A level is recommended where no pair of pins in any state errs by more, in resistance and in its change."""
JOINED = "crimped: the fibrils of every yarn end are joined in its pin"
APART = "free: pins are the design's terminals; fibril ends of no terminal are insulated one by one"


@frozen
class Facts:
    """What was found out about a study before its library is written."""

    levels: Levels
    """What stands between the pins in every state."""
    reductions: tuple[Reduction, ...]
    """Of the ports: the exact one, a thinned one where asked for, and the corners of an ensemble."""
    fit_corners: tuple[FitCorner, ...]
    """Of the networks of Ry and Rc, of an ensemble."""
    paths: tuple[StrainPath, ...]
    """The ways along which strain is an input."""
    grids: tuple[StrainGrid, ...]
    """The pairs of strains that are inputs together."""
    errors: dict[str, Errors]
    """Of 'cell' and 'ports_thin', in all states, where they are there."""
    left_out: dict[str, Errors]
    """By the word of a path: errors of its inner states found from all others; by that of a grid: errors of its states
    found without their lines."""
    rise: float
    """K: what the rated currents warm the hottest fibril by."""
    rated: Floats
    """(S, n) rated current of each probe in each state, A."""
    ends: str
    """'crimped' or 'free'."""

    between_tolerances: float
    """Largest relative error of a resistance between two pins in any state half way to an end of the tolerances."""

    @property
    def tolerance(self) -> tuple[float, float] | None:
        """Largest relative fall and rise of a resistance between two pins in any state; None where none is stated."""
        ends = [each for each in self.reductions if each.end in TOLERANCES]
        if not ends:
            return None
        low, high = (compared(self.levels.ports, each.ports).worst[0] for each in ends)
        return -low, high

    @property
    def recommended(self) -> str:
        """'cell' where it errs by at most `GOOD`, else 'ports', which are exact."""
        worst = self.errors["cell"].worst if "cell" in self.errors else (np.inf,)
        return "cell" if np.nanmax(worst) <= GOOD else "ports"

    def notes(self, part: Part) -> list[tuple[str, str]]:
        """What the comments of a file say of its errors."""
        found = [("yarn ends", JOINED if self.ends == CRIMPED else APART)]
        level = part.level + part.end
        if level in self.errors:
            found.append(("errors over all pairs of pins and all states", _words(self.errors[level])))
        elif level == "ports":
            found.append(("errors", "none: the exact reduction of the detailed network to its pins"))
        if part.end == f"_{WITHIN}":
            text = f"exact at -1, 0 and 1; resistances err by {self.between_tolerances:.1e} at worst half way"
            found.append((WITHIN, text))
        if part.path in self.left_out:
            found.append((f"errors of ports at {_which(part)}", _words(self.left_out[part.path])))
        if part.path:
            for axis in part.network.axes:
                low, high = axis.range
                text = f"from {low!r} to {high!r}; beyond, the last values, and out_of_range is 1 V"
                found.append((axis.word, text))
        if len(part.network.tc):
            found.append(("temperature", _temperature(part)))
        return found


def _which(part: Part) -> str:
    """The states whose errors of interpolation are stated."""
    return "states by the grid without their lines" if part.network.grid else "inner states by all others"


def facts_of(
    study: Study, ends: str, error: float, rise: float, members: Iterable[Study], combine: Sequence[str] = ()
) -> Facts:
    """Reduce, fit, thin where an error is allowed, find the corners of `members`, and compare.

    Raises `DesignError` where the grid of the strains `combine` is not complete.
    """
    meshes = grids(study, combine)
    known = levels(study, ends)
    errors = {}
    if not known.reason:
        found = [port_matrix(circuit, known.pins) for circuit in known.cells]
        errors["cell"] = compared(known.ports, found)
    reductions = [exact(known.ports)]
    if error:
        reductions.append(thin(known.ports, error))
        errors["ports_thin"] = compared(known.ports, reductions[-1].ports)
    packings, fits = [], []
    for member in members:  # one at a time: they are large
        packings.append(port_matrices(member, ends, known.pins))
        fits.append(levels(member, ends))
    if packings:
        reductions += corners(packings)
    between = 0.0
    if differs(study.design, "tolerance"):
        at = {share: port_matrices(study, ends, known.pins, at_end(share)) for share in (-1.0, -0.5, 0.5, 1.0)}
        reductions += tolerances(at[-1.0], at[1.0])
        for end in (-1.0, 1.0):
            middle = [_half_way(*pair) for pair in zip(known.ports, at[end], strict=True)]
            between = max(between, compared(at[end / 2], middle).worst[0])
    ways = paths(study)
    left = {way.word: _left_out(known, way) for way in ways if len(way.strain) > 2}
    left |= {grid.word: _left_out_of_grid(known, grid) for grid in meshes if grid.records.size > 4}
    at_corners = fit_corners(known, fits)
    rated = rated_currents(study, rise)
    return Facts(known, tuple(reductions), at_corners, ways, meshes, errors, left, rise, rated, ends, between)


def _half_way(one: PortMatrix, other: PortMatrix) -> PortMatrix:
    """The ports whose resistors have the mean resistance of two."""
    g, h = -one.conductance, -other.conductance
    mean = np.divide(2.0 * g * h, g + h, out=np.zeros_like(g), where=(g > 0.0) & (h > 0.0))
    return PortMatrix(one.ports, np.diag(mean.sum(axis=1)) - mean)


def _left_out(known: Levels, way: StrainPath) -> Errors:
    """Errors of the ports of each inner state of a path where they are interpolated from all others."""
    own = [known.ports[k] for k in way.records]
    network = ports_network(own, way.strain)
    inner = range(1, len(own) - 1)
    found = [matrix_at(network, without(network.strain, network.conductance, k)) for k in inner]
    relaxed = own[int(np.argmin(np.abs(way.strain)))]
    return compared([relaxed, *own[1:-1]], [relaxed, *found])


def _left_out_of_grid(known: Levels, grid: StrainGrid) -> Errors:
    """Errors of the ports of each state but the corners, interpolated without the lines on which it lies inside."""
    states = grid.records.ravel()
    own = [known.ports[k] for k in states]
    network = ports_network(own, np.arange(float(len(own))))
    on = network.conductance.reshape(*grid.records.shape, -1)
    exact, found = [], []
    for k, (i, j) in enumerate(np.ndindex(grid.records.shape)):
        if (rest := left_out(grid.first, grid.second, on, i, j)) is not None:
            exact.append(own[k])
            found.append(matrix_at(network, rest))
    relaxed = known.ports[grid.records[np.argmin(np.abs(grid.first)), np.argmin(np.abs(grid.second))]]
    return compared([relaxed, *exact], [relaxed, *found])


def _temperature(part: Part) -> str:
    """What a part with temperature coefficients says of them."""
    if np.isnan(part.drift):
        return "tc1 and tc2 of each resistor, from 27 C"
    return f"tc1 and tc2 of each resistor, from 27 C; R(T)/R(27 C) errs by {part.drift:.1e} at worst within 50 K"


def _words(errors: Errors) -> str:
    (R, c), (Rm, cm) = errors.worst, errors.median
    if np.isnan(c):
        return f"resistance {R:.2%} at worst, {Rm:.2%} in the median; nothing changes by more than 1 %"
    return f"resistance {R:.2%} at worst, {Rm:.2%} in the median; its change {c:.2%} at worst, {cm:.2%} in the median"
