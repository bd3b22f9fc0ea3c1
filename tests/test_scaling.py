"""No number in the package has a hidden unit: a design at another scale takes the same steps, bit for bit.

Lengths times s, moduli times m: forces go with m s^2, energies with m s^3, and no density matters. With sigma times c,
sigma_c times c/s, k times h and h_c times h/s, currents go with c s, resistances with 1/(c s) and temperatures with c/h
(`model.md`, "Scales"). For powers of two these products are exact, so nothing but equality will do.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from fabrics import resized

from circuittex.contact.extract import contacts_of
from circuittex.design import Design, Material, Packing, plain_weave
from circuittex.electrical.fields import solve_probes
from circuittex.electrical.network.circuit import build_circuit, build_circuits
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.network.ports import port_matrix
from circuittex.fit import fit_network
from circuittex.geometry.weave import build_mesh
from circuittex.relaxation.increment import advance
from circuittex.relaxation.relax import Equilibrium, relax
from circuittex.study.circuits import conducting_ends
from circuittex.study.export import simplified

pytestmark = pytest.mark.xdist_group("scaling")  # what its fixtures make serves one worker

RANGE = range(-12, 11)
"""Exponents of two: from 1/4096 to 1024."""


class Scale(NamedTuple):
    """Exponents of the factors of lengths, moduli, densities, sigma and k."""

    s: int = 0
    m: int = 0
    d: int = 0
    c: int = 0
    h: int = 0


def paper() -> Design:
    """Three of the paper's fibrils a yarn: a descent of some thirty iterations with refused factors and short steps."""
    design = plain_weave(yarns=2, rows=(1, 2))
    return replace(design, numerics=replace(design.numerics, elements=6))


def mixed() -> Design:
    """Two kinds of yarns in a random packing, Hertz's penalty, linear elements, conduction in the current frame."""
    design = plain_weave(yarns=2, rows=(2,))
    warp, weave = design.weave.warp[0], design.weave
    stiff = replace(
        warp.materials[0], name="stiff", youngs_modulus=35.0, poisson_ratio=0.3, electrical_conductivity=3.0
    )
    weft = replace(warp, name="weft", radius=0.11, spacing=0.25, materials=(stiff, warp.materials[0]))
    return replace(
        design,
        weave=replace(weave, warp=(warp, warp), weft=(weft, weft), amplitude=0.3),
        contact=replace(design.contact, penalty="hertz"),
        electrical=replace(design.electrical, conduction="current"),
        numerics=replace(design.numerics, elements=10, order=1),
        packing=Packing(seed=3, lateral=0.01, vertical=0.02, twist=0.005, phase=0.03),
    )


def scaled(design: Design, scale: Scale) -> Design:
    """The design with its lengths, moduli and so on multiplied."""
    s, m, d, c, h = (2.0**exponent for exponent in scale)

    def material(of: Material) -> Material:
        return replace(
            of,
            youngs_modulus=m * of.youngs_modulus,
            density=d * of.density,
            electrical_conductivity=c * of.electrical_conductivity,
            thermal_conductivity=h * of.thermal_conductivity,
        )

    law, packing = design.contact, design.packing
    return replace(
        design,
        weave=resized(design.weave, s, material),
        contact=replace(
            law,
            penalty=law.penalty if isinstance(law.penalty, str) else m * law.penalty,
            conductivity=c / s * law.conductivity,
            heat_transfer=h / s * law.heat_transfer,
        ),
        packing=replace(
            packing,
            lateral=s * packing.lateral,
            vertical=s * packing.vertical,
            twist=packing.twist / s,
            phase=s * packing.phase,
        ),
    )


def mechanics(found: Equilibrium, scale: Scale) -> dict[str, object]:
    """Every number of an equilibrium, the scale taken out."""
    s, m, *_ = (2.0**exponent for exponent in scale)
    force, energy = m * s * s, m * s * s * s
    return {
        "iterations": found.iterations,
        "history": found.history / [force, energy, 1.0, 1.0],
        "configuration": found.configuration.x / [[s], [1.0], [1.0]],
        "reaction": found.reaction / force,
        "section force": found.section_force / force,
        "energy": found.energy / energy,
        "residual": found.residual / force,
    }


def electrics(design: Design, found: Equilibrium, scale: Scale) -> dict[str, object]:
    """Every number that follows from an equilibrium, the scale taken out."""
    s, m, _, c, h = (2.0**exponent for exponent in scale)
    contacts = contacts_of(design, build_mesh(design), found.configuration)
    fields = solve_probes(contacts, design.terminals, design.probes)
    probe, simple = design.probes[1], simplified(design, contacts).contacts
    ports = port_matrix(build_circuit(simple, conducting_ends(contacts.mesh)))
    fit = fit_network([each.currents[0] for each in fields], design, ports)
    assert np.isfinite(fit.kind_resistance).all()
    circuit = build_circuits(simple, [[t for t in design.terminals if t.name in (probe.source, probe.sink)]])[0]
    nodal = solve_nodal(circuit, {probe.source: probe.voltage, probe.sink: 0.0})
    siemens = c * s
    return {
        "line load": contacts.line_load / (m * s),
        "half-width": contacts.width / s,
        "feet": (contacts.xi_a / s, contacts.xi_b / s),
        "conductance": contacts.conductance / siemens,
        "heat conductance": contacts.heat_conductance / (h * s),
        "potential": tuple(each.potential for each in fields),
        "current": tuple(each.currents / siemens for each in fields),
        "heat": tuple(each.heat / siemens for each in fields),
        "temperature": tuple(each.temperature / (c / h) for each in fields),
        "peak": tuple(each.peak_temperature / (c / h) for each in fields),
        "circuit": (circuit.resistor_nodes, circuit.resistance * siemens),
        "node voltage": nodal.voltage,
        "port current": nodal.port_current / siemens,
        "Ry": fit.Ry * siemens,
        "Rc": fit.Rc * siemens,
        "by kind": (fit.kind_resistance * siemens, fit.pair_resistance * siemens, fit.crossings * siemens),
        "fit": (fit.covariance * siemens**2, fit.residual, fit.currents / siemens),
    }


def job(design: Design, scale: Scale) -> dict[str, object]:
    """The relaxed state and the next one with all that follows from them, at the scale, which is then taken out."""
    there = scaled(design, scale)
    mesh = build_mesh(there)
    rest = relax(mesh, there)
    pulled = advance(mesh, there, rest.configuration, np.eye(2), np.diag([1.02, 1.0]), free_edges="y").equilibrium
    return {
        f"{key} {state}": value
        for state, found in (("relaxed", rest), ("stretched", pulled))
        for key, value in (mechanics(found, scale) | electrics(there, found, scale)).items()
    }


def differing(one: dict[str, object], other: dict[str, object]) -> list[str]:
    """The names of what is not the same to the last bit."""

    def equal(a: object, b: object) -> bool:
        if isinstance(a, tuple) and isinstance(b, tuple):
            return len(a) == len(b) and all(map(equal, a, b))
        return np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True)

    assert one.keys() == other.keys()
    return [key for key in one if not equal(one[key], other[key])]


@pytest.fixture(scope="module", params=[paper, mixed])
def whole(request: pytest.FixtureRequest) -> tuple[Design, dict[str, object]]:
    design = request.param()
    return design, job(design, Scale())


@pytest.mark.parametrize(
    "scale",
    [
        Scale(s=-1),
        Scale(s=-12, m=3, d=-9),
        Scale(s=10, m=-12, d=10),
        Scale(m=1),
        Scale(m=10, d=-12, c=3, h=-4),
        Scale(c=-5, h=2),
        Scale(-12, -12, -12, 7, 5),
        Scale(10, 10, 10, -3, 1),
    ],
    ids=str,
)
def test_a_job_is_the_same_at_every_scale(whole: tuple[Design, dict[str, object]], scale: Scale) -> None:
    design, known = whole
    assert differing(job(design, scale), known) == []


@pytest.mark.parametrize("exponent", RANGE)
def test_a_relaxation_is_the_same_at_every_scale(exponent: int) -> None:
    """The whole range, in each alone and together; the descent leaves a saddle on its way."""
    design = plain_weave(yarns=2, rows=(3,))
    design = replace(design, numerics=replace(design.numerics, elements=4), weave=replace(design.weave, amplitude=0.2))

    def relaxed(scale: Scale) -> dict[str, object]:
        there = scaled(design, scale)
        return mechanics(relax(build_mesh(there), there), scale)

    known = relaxed(Scale())
    k, other = exponent, -2 - exponent
    for scale in (Scale(s=k), Scale(m=k), Scale(d=k), Scale(k, k, k), Scale(k, other, k), Scale(other, other, k)):
        assert differing(relaxed(scale), known) == [], scale
