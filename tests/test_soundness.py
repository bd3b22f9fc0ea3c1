"""What may not be recorded is not, and what cannot be right is said: order, overlap, stress, temperature."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from fabrics import fibrils_through, small_cell, straight
from plan_view import side
from synthetic_study import synthetic_study

from circuittex.base.errors import ConvergenceError, PenetrationError
from circuittex.contact.extract import contact_state
from circuittex.design import ContactLaw, Design, biaxial, equal_steps
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.beam import Beam
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.space import beam_space
from circuittex.results.records import Record, Study
from circuittex.results.soundness import (
    HOT,
    deepest_overlap,
    doubt_statement,
    doubts,
    section_stress,
    strength,
    surface_stress,
)
from circuittex.results.store import load_study
from circuittex.results.summary import summary, table
from circuittex.study.plan import plan
from circuittex.study.run import run_study
from circuittex.study.soundness import check_sound

STUDY = synthetic_study(3, contacts=40)


def quiet(record: Record, **changes: object) -> Record:
    """The record with overlaps, forces and temperatures that nobody doubts, but for what is changed."""
    contacts = replace(record.contacts, gap=np.full(record.contacts.n_contacts, -0.01))
    fields = tuple(replace(field, peak_temperature=1.0) for field in record.fields)
    rest = unbent(contacts.mesh)
    calm = replace(
        record, contacts=contacts, fields=fields, configuration=rest, section_force=0.0 * record.section_force
    )
    return replace(calm, **changes)


def unbent(mesh: FibrilMesh) -> Configuration:
    """Every fibril straight along x."""
    x = np.zeros((mesh.n_nodes, 3, 3))
    x[:, 0, 0], x[:, 1, 1], x[:, 2, 2] = mesh.xi, 1.0, 1.0
    return Configuration(x)


def study_of(*records: Record) -> Study:
    return replace(STUDY, records=records)


def overlapping(record: Record, share: float) -> Record:
    """The record whose contact 5 overlaps by `share` of R + R'."""
    contacts = quiet(record).contacts
    gap, radius = contacts.gap.copy(), contacts.mesh.radius
    gap[5] = -share * (radius[contacts.fibril_a[5]] + radius[contacts.fibril_b[5]])
    return quiet(record, contacts=replace(contacts, gap=gap))


# ---- what the numbers are ---------------------------------------------------------------------------------


def test_the_deepest_overlap_is_that_of_the_geometry() -> None:
    """Two straight fibrils that cross at a distance of 0.2, of radii 0.15 and 0.1: 0.05 of 0.25."""
    lines = [straight([-1, 0, 0], [1, 0, 0], 7), straight([0, -1, 0.2], [0, 1, 0.2], 7)]
    mesh = fibrils_through(lines, radius=[0.15, 0.1])
    state = contact_state(mesh, initial_configuration(mesh), ContactLaw(5.0, 0.01, 0.1), per_element=5)
    overlap, first, second = deepest_overlap(state)
    assert overlap == pytest.approx(0.05 / 0.25, rel=1e-12)  # five points an element: the middle one is at the crossing
    assert (first, second) == (0, 1)
    apart = replace(mesh, position=mesh.position * [1.0, 1.0, 2.0])
    none = contact_state(apart, initial_configuration(apart), ContactLaw(5.0, 0.01, 0.1), per_element=5)
    assert deepest_overlap(none)[0] == 0.0


def test_the_stress_is_the_force_over_the_reference_area() -> None:
    record = quiet(STUDY.records[0])
    mesh = record.contacts.mesh
    pulled = replace(record, section_force=3.0 * np.pi * mesh.radius[mesh.element_fibril] ** 2)
    np.testing.assert_allclose(section_stress(pulled), 3.0, rtol=1e-14)


@pytest.mark.parametrize("plane", [0.0, 0.7])
def test_bending_to_a_circle_stresses_the_surface(plane: float) -> None:
    """E R / rho, whatever the directors' turn about the axis; tension adds to it."""
    record = quiet(STUDY.records[0])
    mesh = record.contacts.mesh
    rho, fibril = 3.0, mesh.element_fibril
    angle, zero = mesh.xi / rho, 0.0 * mesh.xi
    inwards = np.stack([-np.sin(angle), np.cos(angle), zero], axis=1)
    across = np.broadcast_to([0.0, 0.0, 1.0], inwards.shape)
    r = rho * np.stack([np.sin(angle), 1.0 - np.cos(angle), zero], axis=1)
    g1 = np.cos(plane) * inwards + np.sin(plane) * across
    g2 = -np.sin(plane) * inwards + np.cos(plane) * across
    bent = replace(record, configuration=Configuration(np.stack([r, g1, g2], axis=1)))
    known = (mesh.youngs_modulus * mesh.radius / rho)[fibril]
    # The chord of an element of angle a is a^2 / 24 shorter than its arc.
    arc = np.abs(np.diff(mesh.xi[mesh.elements[:, [0, -1]]], axis=1)).max() / rho
    assert arc**2 / 24 < 0.01
    np.testing.assert_allclose(surface_stress(bent), known, rtol=1.01 * arc**2 / 24)
    pulled = replace(bent, section_force=2.0 * mesh.area[fibril])
    np.testing.assert_allclose(surface_stress(pulled), surface_stress(bent) + 2.0, rtol=1e-14)


@pytest.mark.parametrize(("core", "shell"), [(2.5e3, 80e3), (200e3, 50.0)])
def test_a_coated_fibril_is_stressed_layer_by_layer(core: float, shell: float) -> None:
    """E_i (epsilon + R_i / rho) in shell and core, epsilon of the force on E_c A_c + E_s A_s; a plating carries more
    than the mean modulus has it, and a steel core in a soft coat carries nearly all."""
    record = quiet(STUDY.records[0])
    rho, strain, bare = 2.0, 1e-3, record.contacts.mesh
    R = float(bare.radius[0])
    t, number = 0.02 * R, len(bare.radius)
    inside = R - t
    whole = core * inside**2 + shell * (R**2 - inside**2)  # E A / pi
    bends = np.sqrt((core * inside**4 + shell * (R**4 - inside**4)) / whole)  # 2 sqrt(EI / EA)
    mesh = replace(
        bare,
        youngs_modulus=np.full(number, whole / R**2),
        bending_radius=np.where(np.arange(number) > 0, bends, R),
        shell_thickness=np.where(np.arange(number) > 0, t, 0.0),  # the first is bare
    )
    angle, x = mesh.xi / rho, np.array(record.configuration.x)
    x[:, 1] = np.stack([-np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
    x[:, 0] = rho * np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1)
    force = np.full(len(mesh.elements), strain * np.pi * whole)
    bent = replace(
        record, contacts=replace(record.contacts, mesh=mesh), configuration=Configuration(x), section_force=force
    )
    arc = np.abs(np.diff(mesh.xi[mesh.elements[:, [0, -1]]], axis=1)).max() / rho
    known = max(shell * (strain + R / rho), core * (strain + inside / rho))
    first = mesh.element_fibril == 0
    found = surface_stress(bent)
    np.testing.assert_allclose(found[~first], known, rtol=1.01 * arc**2 / 24)
    np.testing.assert_allclose(found[first], whole / R**2 * (strain + R / rho), rtol=1.01 * arc**2 / 24)


def test_a_stretched_fibril_is_not_bent() -> None:
    """E epsilon at its surface, up to the next order in epsilon; the force is that of the beam."""
    record, strain = quiet(STUDY.records[0]), 1e-4
    mesh = record.contacts.mesh
    x = np.array(unbent(mesh).x)
    x[:, 0, 0] *= 1.0 + strain
    nu = mesh.poisson_ratio[mesh.node_fibril][:, None, None]
    x[:, 1:] *= 1.0 - nu * strain
    space = beam_space(mesh)
    force = np.linalg.norm(Beam(space).section_force(x.ravel()), axis=1)
    stretched = replace(record, configuration=Configuration(x), section_force=force)
    np.testing.assert_allclose(surface_stress(stretched), strain * mesh.youngs_modulus[mesh.element_fibril], rtol=1e-3)


def test_bending_alone_is_reason_to_doubt() -> None:
    """Nylon of 3 GPa in a circle of radius 4 R: E R / rho is a quarter of E, of which no fibre bears a fifth."""
    record = quiet(STUDY.records[0])
    mesh = replace(record.contacts.mesh, youngs_modulus=np.full(record.contacts.mesh.n_fibrils, 3e3))
    record = replace(record, contacts=replace(record.contacts, mesh=mesh))
    rho = 4.0 * mesh.radius[mesh.node_fibril]
    angle, x = mesh.xi / rho, np.array(record.configuration.x)
    x[:, 1] = np.stack([-np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
    x[:, 0] = rho[:, None] * np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1)
    assert doubts(study_of(record), record) == ()
    (doubt,) = doubts(study_of(record), replace(record, configuration=Configuration(x)))
    assert doubt.kind == "stress"
    assert "bending included" in doubt.text


def test_no_known_fibre_is_stronger_than_the_limit() -> None:
    """Modulus and strength, MPa, of the strongest of their kind: handbooks' values, rounded up."""
    fibres = {
        "elastane": (10.0, 10.0),  # nominal stress at break of bare spandex, some 10 cN/tex
        "nylon 6.6, technical": (6e3, 1e3),
        "polyester, technical": (15e3, 1.2e3),
        "para-aramid": (130e3, 3.6e3),
        "carbon T1100G": (324e3, 7e3),
        "music wire": (205e3, 4e3),
        "E-glass": (73e3, 3.5e3),
    }
    for modulus, known in fibres.values():
        assert strength(np.array([modulus])) >= known


# ---- doubts -----------------------------------------------------------------------------------------------


def test_a_sound_study_has_no_doubts() -> None:
    study = study_of(*map(quiet, STUDY.records))
    assert doubt_statement(study) == ()
    assert "Do not trust" not in table(study)
    assert all(state["doubts"] == [] for state in summary(study)["states"])


def test_every_kind_of_doubt_names_state_value_and_reason() -> None:
    first, second, third = STUDY.records
    mesh = first.contacts.mesh
    stress = 20.0 * mesh.youngs_modulus[mesh.element_fibril]
    pulled = quiet(second, section_force=stress * mesh.area[mesh.element_fibril])
    hot = tuple(replace(field, peak_temperature=1e4) for field in first.fields)
    study = study_of(overlapping(first, 0.31), pulled, quiet(third, fields=hot))
    overlap, tension, heat = doubt_statement(study)
    assert overlap.startswith(f"Do not trust {first.name}: fibrils overlap by 0.31 of R + R' (warned of from 0.3 on")
    assert tension.startswith(
        f"Do not trust {second.name}: the stress reaches 200 MPa, bending included, in warp1: no material of"
    )
    assert "more than 10 MPa" in tension
    assert heat.startswith(f"Do not trust {third.name}: the temperature rises by up to 1e+04 K")
    assert "no heat is lost to the air" in heat
    for sentence in (overlap, tension, heat):
        assert sentence in table(study)
    states = summary(study)["states"]
    assert [len(state["doubts"]) for state in states] == [1, 1, 1]
    assert states[0]["deepest_overlap"] == pytest.approx(0.31)
    assert states[1]["largest_stress_MPa"] == pytest.approx(200.0)


def test_one_sentence_tells_the_worst_of_many_states() -> None:
    shares = (0.35, 0.45, 0.4)
    study = study_of(*(overlapping(record, share) for record, share in zip(STUDY.records, shares, strict=True)))
    (sentence,) = doubt_statement(study)
    assert sentence.startswith(
        f"Do not trust {STUDY.records[1].name} and, less, in 2 other states: fibrils overlap by 0.45"
    )


@pytest.mark.parametrize(("share", "warned"), [(0.19, 0), (0.21, 1)])
def test_the_warning_begins_where_the_design_says(share: float, warned: int) -> None:
    numerics = replace(STUDY.design.numerics, overlap_warning=0.2)
    study = replace(STUDY, design=replace(STUDY.design, numerics=numerics))
    assert len(doubts(study, overlapping(STUDY.records[0], share))) == warned


def test_a_state_without_probes_or_contacts_is_no_reason_to_doubt() -> None:
    """Its peak temperature is nan."""
    assert doubts(STUDY, quiet(STUDY.records[0], fields=())) == ()
    assert not np.isfinite(quiet(STUDY.records[0], fields=()).peak_temperature)
    assert HOT > 0


# ---- what is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("limit", "share"), [(0.5, 0.51), (0.2, 0.21)])
def test_a_state_with_too_deep_an_overlap_is_refused_from_the_limit_on(limit: float, share: float) -> None:
    design, mesh = small_cell((1,), elements=8)
    design = replace(design, numerics=replace(design.numerics, overlap_limit=limit))
    study = replace(STUDY, design=design, mesh=mesh, initial=initial_configuration(mesh), records=())
    state = contact_state(mesh, study.initial, design.contact, per_element=1)
    (step,) = plan(design)

    def gap(part: float) -> object:
        one = np.array([0])
        rows = {name: getattr(state, name)[:1] for name in ("xi_a", "xi_b", "line_load", "width", "weight")}
        rows |= {name: getattr(state, name)[:1] for name in ("conductance", "heat_conductance")}
        return replace(state, fibril_a=one, fibril_b=one + 2, gap=np.array([-part * 0.3]), **rows)

    check_sound(study, step, mesh.position, gap(share - 0.02))  # type: ignore[arg-type]
    with pytest.raises(PenetrationError) as caught:
        check_sound(study, step, mesh.position, gap(share))  # type: ignore[arg-type]
    message = str(caught.value)
    assert message.startswith(f"relaxed: fibril 1 of warp1 and fibril 1 of weft1 overlap by {share:.2f} of R + R'")
    assert f"below {limit:g} (numerics.overlap_limit)" in message


def slack(strain: float, steps: int) -> Design:
    """Case 02: two by two yarns of one fibril, compressed both ways until the slack fibrils look for a way out."""
    design, _ = small_cell((1,), elements=10)
    weave = replace(design.weave, amplitude=0.2)
    loading = (biaxial("compress", equal_steps(strain, steps)),)
    return replace(design, weave=weave, loading=loading, probes=(), terminals=())


@pytest.mark.parametrize("steps", [1, 3])
def test_slack_fibrils_keep_their_sides_whatever_the_number_of_steps(steps: int) -> None:
    study = run_study(slack(-0.3, steps))
    mesh, draft = study.mesh, np.array(study.design.weave.draft)
    assert len(study.records) == steps + 1
    for record in study.records:
        lines = [record.configuration.r[a:b] for a, b in zip(mesh.first_node, mesh.first_node[1:], strict=False)]
        seen = [[side(warp, weft) for weft in lines[2:]] for warp in lines[:2]]
        np.testing.assert_array_equal(seen, draft)


def test_a_penalty_too_soft_for_its_fibrils_ends_the_run_with_nothing_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 01: fibrils of 3 GPa held apart by 5 N/mm2."""
    undrawn(monkeypatch)
    design, _ = small_cell((1,), elements=10)
    yarn = design.weave.warp[0]
    stiff = replace(yarn, materials=tuple(replace(m, youngs_modulus=3e3) for m in yarn.materials))
    weave = replace(design.weave, warp=(stiff,) * 2, weft=(stiff,) * 2, amplitude=0.15)
    with pytest.raises(ConvergenceError, match=r"^relaxed: fibril 1 of warp") as caught:
        run_study(replace(design, weave=weave), tmp_path)
    assert isinstance(caught.value, PenetrationError)
    assert "the penalty of 5 N/mm2 is too soft for them: Hertz's theory gives 750 N/mm2" in str(caught.value)
    assert load_study(tmp_path / "results.h5").records == ()
    stated = replace(design, weave=weave, contact=ContactLaw("hertz", 0.01, 0.1))
    study = run_study(stated, tmp_path, fresh=True)
    assert deepest_overlap(study.records[0].contacts)[0] < 0.1
    assert json.loads((tmp_path / "summary.json").read_text("utf-8"))["states"][0]["doubts"] == []
