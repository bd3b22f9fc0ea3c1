"""How the current of a touch spreads in the shell of a coated fibril: closed forms against fields that are resolved."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fabrics import fibrils_through, straight
from skfem import Basis, BilinearForm, ElementQuad2, MeshQuad, condense, solve

from circuittex.base.arrays import Floats
from circuittex.contact.constriction import on_core, spot_on_shell, strip_on_shell
from circuittex.contact.extract import contact_state
from circuittex.contact.law import effective_modulus
from circuittex.design import ContactLaw
from circuittex.mech.configuration import initial_configuration

ONE = np.ones(1)
BETWEEN = 0.012
"""Relative: what a spot about as wide as its sheet is thick is off by, between two limits that are exact."""


def graded(first: float, last: float, at: float, n: int) -> Floats:
    """Places from first to last, closer together on both sides of `at`, where an electrode ends."""
    near = (np.arange(n + 1) / n) ** 3
    return np.unique(np.concatenate([at - (at - first) * near, at + (last - at) * near]))


def resistance(mesh: MeshQuad, weight: Any, high: Any, low: Any) -> float:
    """Between two electrodes of a body of sigma 1; the weight is its depth at a place."""
    basis = Basis(mesh, ElementQuad2())

    @BilinearForm
    def conduction(u: Any, v: Any, w: Any) -> Any:
        return weight(w.x) * (u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1])

    stiffness = conduction.assemble(basis)
    one, other = (basis.get_dofs(where).flatten() for where in (high, low))
    held = np.zeros(basis.N)
    held[one] = 1.0
    voltage = solve(*condense(stiffness, x=held, D=np.concatenate([one, other])))
    return 1.0 / float(voltage @ (stiffness @ voltage))


@pytest.mark.parametrize("size", [0.1, 0.5, 1.0, 3.0, 20.0])
def test_a_spot_on_a_sheet_against_its_field(size: float) -> None:
    """A disc of radius a on a plate of thickness t, fed at a far radius b, in r and z by finite elements.

    The form is exact to first order in a/t and t/a.
    """
    a, t = size, 1.0
    b = 8 * max(a, t)
    mesh = MeshQuad.init_tensor(graded(0.0, b, a, 24), t * (np.arange(25) / 24) ** 2)
    found = resistance(
        mesh,
        lambda x: 2 * np.pi * x[0],
        lambda x: (x[1] < 1e-9) & (x[0] < a + 1e-9),
        lambda x: x[0] > b - 1e-9,
    )
    spot = spot_on_shell(a * ONE, a * ONE, t * ONE, b * ONE)[0]
    assert 1 / (4 * spot) == pytest.approx(found, rel=BETWEEN)


def test_a_source_on_a_cylinder_exceeds_its_axis_by_the_logarithm() -> None:
    """Fourier's series around the cylinder, mean over a circle of radius a about the source: ln(R/a) / (2 pi).

    Each harmonic decays along the axis by itself, cos(n theta) exp(-n |z| / R) / (2 pi n); the circle is small.
    """
    a, n = 0.05, np.arange(1, 4000)[:, None]
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False) + 0.01
    z, theta = np.abs(a * np.cos(turn)), a * np.sin(turn)
    excess = (np.cos(n * theta) * np.exp(-n * z) / (2 * np.pi * n)).sum(axis=0)
    axis = -z / (4 * np.pi)
    whole = (excess + axis).mean()  # less what the axis's resistance counts from z = 0 on
    assert whole == pytest.approx(-np.log(a) / (2 * np.pi), rel=1e-3)


@pytest.mark.parametrize(("half", "t"), [(0.02, 0.05), (0.2, 0.05), (0.6, 0.02)])
def test_a_strip_on_a_tube_against_its_field(half: float, t: float) -> None:
    """The section of a tube of radius 1 with a strip on its outside, its current drawn evenly from all of it.

    In r and theta; mean of the potential over the section, power over current squared. The form has the outer
    radius for that of the middle of the tube, t/2 less.
    """
    theta, r = graded(0.0, np.pi, half, 40), 1 - t * (1 - np.arange(9) / 8)
    basis = Basis(MeshQuad.init_tensor(theta, r), ElementQuad2())

    @BilinearForm
    def conduction(u: Any, v: Any, w: Any) -> Any:
        return u.grad[0] * v.grad[0] / w.x[1] + w.x[1] * u.grad[1] * v.grad[1]

    @BilinearForm
    def area(u: Any, v: Any, w: Any) -> Any:
        return w.x[1] * u * v

    load = area.assemble(basis) @ np.ones(basis.N)
    held = basis.get_dofs(lambda x: (x[1] > 1 - 1e-9) & (x[0] < half + 1e-9)).flatten()
    voltage = solve(*condense(conduction.assemble(basis), load, D=held))
    found = float(load @ voltage) / load.sum() ** 2 / 2  # half a section has twice the resistance
    form = 1 / (4 * strip_on_shell(ONE, half * ONE, t * ONE, ONE))[0]
    assert form == pytest.approx(found, rel=0.6 * t)


def test_cores_that_conduct() -> None:
    """As well as the shell: a half space; not at all: the shell alone; better: a half space of the shell."""
    shell, bare = np.array([0.2]), np.array([1.0])
    assert [float(on_core(shell, bare, each * ONE)[0]) for each in (1.0, 0.0, 0.1, 0.5, 7.0)] == [
        1.0,
        0.2,
        0.2,
        0.5,
        1.0,
    ]


def test_two_plated_fibrils_that_cross() -> None:
    """2 ln(R / a) / (2 pi sigma t) for shells much thinner than the touch, with Hertz's a under their force."""
    lines = [straight([-1, 0, 0], [1, 0, 0], 40), straight([0, -1, 0.298], [0, 1, 0.298], 40)]
    R, t, sigma = 0.15, 1e-5, 50.0
    mesh = fibrils_through(lines, radius=R, sigma=[sigma, sigma])
    two = np.ones(2)
    plated = replace(mesh, surface_conductivity=sigma * two, bending_radius=R * two, shell_thickness=t * two)
    law, at = ContactLaw(5.0, 1.0, 0.1, law="holm"), initial_configuration(mesh)

    def conductance(core: float) -> tuple[float, float]:
        state = contact_state(replace(plated, core_conductivity=core * two), at, law, per_element=200)
        return float(state.conductance.sum()), float((state.line_load * state.weight).sum())

    thin, force = conductance(0.0)
    E, nu = mesh.youngs_modulus[:1], mesh.poisson_ratio[:1]
    a = float(np.cbrt(3 * force * R / (4 * effective_modulus(E, nu, E, nu)))[0])
    assert a > 100 * t
    assert thin == pytest.approx(np.pi * sigma * t / np.log(R / a), rel=0.01)
    bare = contact_state(mesh, at, law, per_element=200).conductance.sum()
    assert conductance(sigma)[0] == bare, "a core like its shell, bit for bit"
    assert thin < conductance(0.01 * sigma)[0] < bare
