"""A made-up study with the shapes, sizes and order of magnitude of a real one; nothing in it was computed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.contact.state import ContactState
from circuittex.design import Design, Loading, design_hash, plain_weave
from circuittex.electrical.fields import Fields
from circuittex.fit import Fit
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.results.records import Record, Study
from circuittex.results.verification import Verification

INSULATED = 2.0 / (10 * np.pi * 0.15**2 * 10.0)
"""Ry of an insulated yarn segment of the paper's cell [57], ohm: 0.2829."""


def synthetic_study(
    states: int = 3,
    *,
    contacts: int = 300,
    rows: tuple[int, ...] = (3, 4, 3),
    loadings: tuple[str, ...] = ("stretch",),
    name: str = "made-up weave",
    seed: int = 0,
) -> Study:
    """The relaxed state and `states` - 1 strained ones on each of `loadings`, with `contacts` contact points each."""
    rng = np.random.default_rng(seed)
    strains = tuple(0.025 * step for step in range(1, states))
    loading = tuple(
        Loading(each, tuple(_gradient(each, strain) for strain in strains), strains) for each in loadings if strains
    )
    design = plain_weave(rows=rows, loading=loading)
    design = Design(
        name=name,
        weave=design.weave,
        contact=design.contact,
        loading=loading,
        terminals=design.terminals,
        probes=design.probes,
        electrical=design.electrical,
        numerics=design.numerics,
    )
    mesh = build_mesh(design)
    records = [_record(design, mesh, "", 0.0, contacts, rng)]
    records += [_record(design, mesh, each, strain, contacts, rng) for each in loadings for strain in strains]
    return Study(
        version="0.0.0",
        design=design,
        design_hash=design_hash(design),
        mesh=mesh,
        initial=initial_configuration(mesh),
        records=tuple(records),
    )


def _gradient(loading: str, strain: float) -> tuple[tuple[float, float], tuple[float, float]]:
    return ((1.0, 0.0), (strain, 1.0)) if loading == "shear" else ((1.0 + strain, 0.0), (0.0, 1.0))


def _record(
    design: Design, mesh: FibrilMesh, loading: str, strain: float, contacts: int, rng: np.random.Generator
) -> Record:
    gradient = np.array(_gradient(loading, strain))
    slope = 4.0 if loading == "shear" else 18.0
    state = _contacts(mesh, contacts, rng)
    clamp_force = np.array([[1.49 + slope * strain, 0.01, 0.002], [0.001, 1.49 + 2 * strain, -0.01]])
    return Record(
        name=f"{loading}-{strain:.4f}" if loading else "relaxed",
        loading=loading,
        strain=strain,
        gradient=gradient,
        configuration=_flattened(mesh, gradient),
        residual=3e-8,
        iterations=52 if not loading else 14,
        parts=1,
        history=rng.random((5, 4)),
        clamp_force=clamp_force,
        end_force=_end_force(mesh, clamp_force),
        energy=0.4 + 8.0 * strain * (1.49 + slope * strain / 2),
        section_force=0.03 + 0.01 * np.sin(mesh.xi[mesh.elements[:, 0]] + mesh.element_fibril) + 0.2 * strain,
        contacts=state,
        fields=tuple(_fields(design, mesh, state, number, strain, rng) for number in range(len(design.probes))),
        fit=with_network(
            Fit(
                Ry=0.2827 - 0.01 * strain,
                Rc=210.0 - 10.0 * slope * strain,
                residual=0.03,
                covariance=np.array([[1e-6, 0.0], [0.0, 4.0]]),
                weighting="relative",
                warnings=(),
                currents=np.array([0.884, 0.0066, 0.0078]),
            ),
            (len(design.weave.warp), len(design.weave.weft)),
        ),
        reduced_difference=3e-12,
        field_convergence=np.empty((0, 2)) if loading else np.array([[0.2, 4e-6], [0.1, 1e-6], [0.05, 2.5e-7]]),
        levels=2,
        verification=Verification(
            routes=("fields", "nodal", "ngspice"),
            max_voltage_difference=4e-13,
            max_current_difference=2e-12,
            native_difference=3e-13,
            ngspice_limit=5e-12,
            merge_error=0.004,
            field_difference=0.011,
            fields_seconds=0.4,
            nodal_seconds=0.1,
            ngspice_seconds=2.5,
            ngspice_checked=True,
            note="",
        ),
        netlist=f"netlists/{loading or 'relaxed'}-{strain:.4f}.cir",
    )


def _end_force(mesh: FibrilMesh, clamp_force: Floats) -> Floats:
    """The total forces on the fibrils' plus ends in equal parts, and against them at the minus ends."""
    axis = mesh.yarn_axis[mesh.yarn]
    share = clamp_force[axis] / np.bincount(axis)[axis, None]
    return np.concatenate([-share, share])


def _flattened(mesh: FibrilMesh, gradient: Floats) -> Configuration:
    """The wave lower, the three rows pressed into two, all points moved by the gradient."""
    x = initial_configuration(mesh).x.copy()
    fibril = mesh.node_fibril
    centre = np.zeros((len(mesh.yarn_names), mesh.first_node[1], 3))
    per_node = mesh.yarn[fibril]
    index = np.arange(mesh.n_nodes) - mesh.first_node[fibril]
    np.add.at(centre, (per_node, index), x[:, 0])
    centre /= np.bincount(mesh.yarn)[:, None, None]
    offset = x[:, 0] - centre[per_node, index]
    middle = np.abs(offset[:, 2]) < 0.1
    up = np.arange(mesh.n_fibrils)[fibril] % 2 == 0
    lift = np.where(middle, np.where(up, 0.16, -0.16), 0.52 * offset[:, 2])
    x[:, 0] = centre[per_node, index] * [1.0, 1.0, 0.8]
    across = np.where(mesh.yarn_axis[per_node] == 0, 1, 0)
    x[np.arange(mesh.n_nodes), 0, across] += 1.6 * offset[np.arange(mesh.n_nodes), across]
    x[:, 0, 2] += lift
    x[:, 0, :2] = x[:, 0, :2] @ gradient.T
    return Configuration(x)


def _contacts(mesh: FibrilMesh, count: int, rng: np.random.Generator) -> ContactState:
    a = rng.integers(0, mesh.n_fibrils, count)
    b = (a + rng.integers(1, mesh.n_fibrils, count)) % mesh.n_fibrils
    load = rng.random(count) * 0.2
    return ContactState(
        mesh=mesh,
        fibril_a=a,
        fibril_b=b,
        xi_a=rng.random(count) * mesh.length[a],
        xi_b=rng.random(count) * mesh.length[b],
        gap=-load / 5.0,
        line_load=load,
        width=np.sqrt(load) * 0.1,
        weight=np.full(count, 0.05),
        conductance=np.sqrt(load) * 5e-5,
        heat_conductance=np.sqrt(load) * 5e-4,
        axial_factor=np.ones(len(mesh.elements)),
    )


def _fields(
    design: Design, mesh: FibrilMesh, state: ContactState, number: int, strain: float, rng: np.random.Generator
) -> Fields:
    probe = design.probes[number]
    fibril = np.concatenate([np.tile(np.arange(mesh.n_fibrils), 2), state.fibril_a, state.fibril_b])
    xi = np.concatenate([0.0 * mesh.length, mesh.length, state.xi_a, state.xi_b])
    order = np.lexsort((xi, fibril))
    fibril, xi = fibril[order], xi[order]
    first = np.flatnonzero(np.diff(fibril) == 0)
    terminals = {terminal.name: terminal.ends for terminal in design.terminals}
    driven = {mesh.yarn_names.index(yarn) for end in (probe.source, probe.sink) for yarn, _ in terminals[end]}
    share = np.where(np.isin(mesh.yarn, list(driven)), 1.0, 0.05)[fibril]
    total = (0.884, 0.0065, 0.0079)[number % 3] * (1.0 + strain)
    along = xi / mesh.length[fibril]
    temperature = total * share * along * (1.0 - along)
    potential = np.where(fibril == mesh.n_fibrils - 1, np.nan, 1.0 - along)
    return Fields(
        probe=probe.name,
        voltage=1.0,
        terminals=(probe.source, probe.sink),
        currents=np.array([total, -total]),
        fibril=fibril,
        xi=xi,
        potential=potential,
        temperature=temperature,
        segments=np.stack([first, first + 1], axis=1),
        segment_current=total / 10 * share[first] * (0.9 + 0.1 * rng.random(len(first))),
        heat=total,
        heat_out=total,
        peak_temperature=float(temperature.max()),
        unreached=np.array([mesh.n_fibrils - 1]),
    )


def with_network(fit: Fit, shape: tuple[int, int]) -> Fit:
    """A fit of one pair with its network of a weave of `shape`."""
    return replace(
        fit,
        kinds=("conductive",),
        kind_resistance=np.array([fit.Ry]),
        pairs=("conductive x conductive",),
        pair_resistance=np.array([fit.Rc]),
        yarns=np.full(sum(shape), fit.Ry),
        crossings=np.full(shape, fit.Rc),
        pair_errors=np.array([0.06, 0.02]),
    )
