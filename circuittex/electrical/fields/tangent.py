"""What changes with the temperature, and by how much: resistivities, heat and radiation, and Newton's tangent."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import block_array, coo_array, csr_array, diags_array, vstack
from skfem import BilinearForm, ElementLineP0, LinearForm

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.electrical.fields.coefficients import Coefficients
from circuittex.electrical.fields.cooling import SURROUNDINGS
from circuittex.electrical.fields.flow import Flow
from circuittex.electrical.fields.line import FibrilLine
from circuittex.electrical.fields.system import System


@LinearForm  # type: ignore[untyped-decorator]
def _radiated(v: Any, w: Any) -> Any:
    """∫ r ((Ts + T)^4 - Ts^4) v dxi, without the digits that the difference would lose."""
    hot = SURROUNDINGS + w.rise
    return w.density * w.rise * (hot + SURROUNDINGS) * (hot**2 + SURROUNDINGS**2) * v


@BilinearForm  # type: ignore[untyped-decorator]
def _radiated_more(u: Any, v: Any, w: Any) -> Any:
    """∫ 4 r (Ts + T)^3 u v dxi."""
    return 4.0 * w.density * (SURROUNDINGS + w.rise) ** 3 * u * v


def radiated(basis: Any, density: Floats, T: Floats) -> tuple[Floats, Any]:
    """(N,) what radiates from each dof at a rise T (N,), and (N, N) its tangent, of `density` (S,), W/(mm K4)."""
    given = {"density": basis.with_element(ElementLineP0()).interpolate(density), "rise": basis.interpolate(T)}
    return _radiated.assemble(basis, **given), csr_array(_radiated_more.assemble(basis, **given))


@frozen
class Resistors:
    """The R = S + C resistors of a field: the segments of the fibrils, then the contacts.

    Their resistances have M + C factors: the means of the M elements of the mechanics, and the contacts'.
    """

    line: FibrilLine
    thermal: System
    coefficients: Coefficients
    difference: Any
    """(R, K) from the nodes' potentials to the voltage across each resistor."""
    warms: Any
    """(N, R) where the heat of each resistor is released."""
    factor: Any
    """(R, M + C) which factor each resistor has."""
    share: Floats
    """(S, Q) weight of each quadrature point in the mean of its element."""
    elements: int
    """M."""

    def factors(self, T: Floats) -> tuple[Floats, Any]:
        """(M + C,) mean of f(T) over each element, its value at each contact, whose temperature is the mean of the two
        it joins; and (M + C, N) how they change with T."""
        line, basis, M = self.line, self.thermal.basis, self.elements
        owner, rise = line.fibril[line.segments[:, 0]], np.asarray(basis.interpolate(T))
        f, slope = self.coefficients.resistivity(owner, rise)
        along = np.bincount(line.element, (self.share * f).sum(axis=1), M)
        slope = self.share * slope
        shapes = [np.asarray(shape) for (shape,) in basis.basis]
        values = [np.sum(slope * shape, axis=1) for shape in shapes]
        dofs = basis.element_dofs
        rows = np.broadcast_to(line.element, dofs.shape).ravel()
        change = coo_array((np.concatenate(values), (rows, dofs.ravel())), shape=(M, basis.N))
        middle = 0.5 * (self.thermal.foot[0] + self.thermal.foot[1])
        there = middle @ T
        tc1, tc2 = self.coefficients.contact.T
        across = 1.0 + there * (tc1 + tc2 * there)
        return (
            np.concatenate([along, across]),
            vstack([change, diags_array(tc1 + 2.0 * tc2 * there) @ middle], format="csr"),
        )


def resistors_of(
    line: FibrilLine, electric: System, thermal: System, coefficients: Coefficients, contact_heat: bool, elements: int
) -> Resistors:
    """The resistors of a field on its line mesh."""
    basis, S = thermal.basis, len(line.segments)
    length = np.diff(line.xi[line.segments], axis=1)[:, 0]
    each = np.arange(S)
    ones = np.ones(S)
    along = coo_array(
        (np.concatenate([ones, -ones]), (np.tile(each, 2), line.segments.T.ravel())), shape=(S, len(line.xi))
    )
    weight = np.concatenate([np.sum(np.asarray(s) * basis.dx, axis=1) / length for (s,) in basis.basis])
    dofs = basis.element_dofs
    inside = coo_array((weight, (dofs.ravel(), np.broadcast_to(each, dofs.shape).ravel())), shape=(basis.N, S))
    feet = (0.5 if contact_heat else 0.0) * (thermal.foot[0] + thermal.foot[1])
    contacts = len(coefficients.contact)
    column = np.concatenate([line.element, elements + np.arange(contacts)])
    whole = np.bincount(line.element, length, elements)
    return Resistors(
        line=line,
        thermal=thermal,
        coefficients=coefficients,
        difference=vstack([along, electric.jump], format="csr"),
        warms=vstack([inside.T, feet], format="csr").T,
        factor=csr_array(
            (np.ones(len(column)), (np.arange(len(column)), column)), shape=(len(column), elements + contacts)
        ),
        share=basis.dx / whole[line.element][:, None],
        elements=elements,
    )


@frozen
class Tangent:
    """Where a field is linearised, at 1 V between its terminals."""

    free: Ints
    """Nodes whose potential is sought."""
    inside: Ints
    """Dofs whose temperature is sought."""
    conductance: Floats
    """(R,) S, of the resistors."""
    current: Floats
    """(R,) A, at 1 V."""
    heat: Floats
    """(R,) W, at 1 V."""
    factors: Floats
    """(M + C,) of the resistances."""
    change: Any
    """(M + C, N) of the factors with the temperature."""


def linearised(
    resistors: Resistors, at: Tangent, cooling: Any, move: Any, power: float, exponent: int, hot: int | None = None
) -> Any:
    """Newton's matrix for potential, temperature and factors and, if `exponent` > 0, the relative change of `power`.

    With v the potential at 1 V, the currents i, conductances g and heats h at 1 V, the factors f and their change W
    with T, and p = `power`, the square of the voltage, in p G^n = const (n = `exponent`):

        D^T g D dv - D^T (i / f) df                          = 0
        -2 p H i D dv + K dT + p H (h / f) df - p H h dp / p = -R
        -W dT + df                                           = 0
        -(n / G) sum (h / f) df + dp / p                     = 0

    where G = sum h, and G changes by -sum (h / f) df only, since the potential makes the power stationary; K is
    the tangent of what leaves each dof. With `hot` the last row is dT of that dof, whose rise is given in place of n.
    Temperatures are sought as `move` (N, N) makes them, dT = move dy; `cooling` (N, N) is move^T K move (`measured`).
    """
    D, S = resistors.difference, resistors.factor
    D = D[:, at.free]
    H = csr_array(move.T @ resistors.warms)[at.inside]
    by_factor = S @ diags_array(1.0 / at.factors)
    dV = D.T @ diags_array(at.conductance) @ D
    dV_df = -(D.T @ diags_array(at.current) @ by_factor)
    dT_dv = -2.0 * power * (H @ diags_array(at.current) @ D)
    heats = diags_array(at.heat) @ by_factor
    dT_df = power * (H @ heats)
    rows = [
        [dV, None, dV_df],
        [dT_dv, cooling[at.inside][:, at.inside], dT_df],
        [None, -csr_array(at.change @ move)[:, at.inside], diags_array(np.ones(len(at.factors)))],
    ]
    if exponent or hot is not None:
        column = -power * (H @ at.heat)
        rows[0].append(None)
        rows[1].append(csr_array(column[:, None]))
        rows[2].append(None)
    if hot is not None:
        rows.append([None, csr_array(move)[[hot]][:, at.inside], None, None])
    elif exponent:
        dG = np.asarray(heats.sum(axis=0)).ravel() * (-exponent / float(at.heat.sum()))
        rows.append([None, None, csr_array(dG[None, :]), csr_array(np.ones((1, 1)))])
    return block_array(rows, format="csc")


def resistor_values(line: FibrilLine, electric: System, flow: Flow) -> tuple[Floats, Floats, Floats]:
    """(R,) each: conductances, currents and heats of the resistors."""
    length = np.diff(line.xi[line.segments], axis=1)[:, 0]
    return (
        np.concatenate([line.conduction / length, electric.conductance]),
        np.concatenate([flow.along, flow.through]),
        np.concatenate([flow.fibril_heat * length, flow.contact_heat]),
    )
