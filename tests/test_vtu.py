"""Tubes for ParaView: geometry and values against closed forms, files read back by an independent reader."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from synthetic import fibrils, touching
from synthetic_study import synthetic_study

from circuittex.base.arrays import Floats
from circuittex.electrical.fields import Fields
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import initial_configuration
from circuittex.results.vtk import tubes
from circuittex.results.vtk.vtu import write_collections, write_pvd, write_vtu

STUDY = synthetic_study(2, contacts=200)
TWO = fibrils([2.0, 3.0], elements=4)
"""Two straight fibrils with nodes every 0.5 mm and every 0.75 mm."""


def fields_on(mesh: FibrilMesh, fibril: list[int], xi: list[float], current: list[float]) -> Fields:
    """Nodes at the given places; `current` belongs to the segments between neighbours on one fibril."""
    owner, place = np.array(fibril), np.array(xi)
    first = np.flatnonzero(np.diff(owner) == 0)
    return Fields(
        probe="p",
        voltage=1.0,
        terminals=("a", "b"),
        currents=np.array([1.0, -1.0]),
        fibril=owner,
        xi=place,
        potential=np.where(owner == 1, np.nan, place),
        temperature=10.0 * owner + place,
        segments=np.stack([first, first + 1], axis=1),
        segment_current=np.array(current),
        heat=1.0,
        heat_out=1.0,
        peak_temperature=1.0,
        unreached=np.array([1]),
    )


FIELDS = fields_on(TWO, [0, 0, 0, 1, 1], [0.0, 0.75, 2.0, 0.0, 3.0], [4.0, 8.0, -1.0])


def test_surface_points_lie_on_the_sections() -> None:
    points = tubes.surface(TWO, initial_configuration(TWO).x, 12)
    np.testing.assert_allclose(np.linalg.norm(points - TWO.position[:, None], axis=2), 0.15, rtol=1e-14)
    np.testing.assert_allclose(points[..., 0], np.repeat(TWO.xi[:, None], 12, axis=1), atol=1e-15)


def test_spans_stay_on_one_fibril() -> None:
    nodes = tubes.spans(TWO)
    assert nodes.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4], [5, 6], [6, 7], [7, 8], [8, 9]]
    assert tubes.span_element(fibrils([1.0], elements=2, order=2)).tolist() == [0, 0, 1, 1]


def test_nodal_values_are_interpolated_along_each_fibril() -> None:
    np.testing.assert_allclose(tubes.at_nodes(TWO, FIELDS, FIELDS.temperature), 10.0 * TWO.node_fibril + TWO.xi)
    potential = tubes.at_nodes(TWO, FIELDS, FIELDS.potential)
    np.testing.assert_allclose(potential[:5], TWO.xi[:5])
    assert np.isnan(potential[5:]).all()


def test_mean_current_of_a_span_that_holds_a_foot() -> None:
    # On the span from 0.5 to 1 mm the current is 4 A up to 0.75 mm and 8 A beyond.
    np.testing.assert_allclose(tubes.span_current(TWO, FIELDS), [4, 6, 8, 8, -1, -1, -1, -1], rtol=1e-12)


def test_mean_current_does_not_depend_on_the_order_of_the_segments() -> None:
    turned = replace(FIELDS, segments=FIELDS.segments[::-1], segment_current=FIELDS.segment_current[::-1])
    np.testing.assert_array_equal(tubes.span_current(TWO, turned), tubes.span_current(TWO, FIELDS))


def test_contact_load_acts_on_both_fibrils() -> None:
    contacts = touching(TWO, [0, 1], [0.6, 3.0], [1, 0], [0.0, 2.0], weight=[0.1, 0.2])
    load = tubes.span_load(contacts)  # 0.05 N/mm over 0.1 and 0.2 mm of axis, on spans of 0.5 and 0.75 mm
    np.testing.assert_allclose(load, [0, 0.005 / 0.5, 0, 0.01 / 0.5, 0.005 / 0.75, 0, 0, 0.01 / 0.75], rtol=1e-12)


def read(path: Path) -> meshio.Mesh:
    return meshio.read(path)


def test_file_holds_tubes_and_values(tmp_path: Path) -> None:
    mesh, record = STUDY.mesh, STUDY.records[1]
    write_vtu(tmp_path / "state.vtu", mesh, record, sides=8)
    tube = read(tmp_path / "state.vtu")
    assert tube.points.shape == (8 * mesh.n_nodes, 3)
    assert tube.cells_dict["quad"].shape == (8 * (mesh.n_nodes - mesh.n_fibrils), 4)
    cells = {name: values[0] for name, values in tube.cell_data.items()}
    assert set(cells) == {
        *("fibril", "yarn", "section_force_N", "nominal_stress_MPa", "contact_line_load_N_per_mm"),
        *(f"current_A {fields.probe}" for fields in record.fields),
    }
    assert np.array_equal(np.unique(cells["fibril"]), np.arange(mesh.n_fibrils))
    assert set(np.unique(cells["section_force_N"])) == set(np.unique(record.section_force))
    hottest = max(float(tube.point_data[f"temperature_K {fields.probe}"].max()) for fields in record.fields)
    assert 0.9 * record.peak_temperature < hottest <= record.peak_temperature
    assert np.isnan(tube.point_data[f"potential_V {record.fields[0].probe}"]).sum() == 8 * 41  # one unreached fibril


def test_stress_is_the_section_force_over_the_undeformed_area(tmp_path: Path) -> None:
    """Fibrils of radius 0.15 mm that carry 0.1 N and, on one element, 0.2 N: 1.4147 and 2.8294 N/mm2."""
    force = np.full(len(STUDY.mesh.elements), 0.1)
    force[7] = 0.2
    write_vtu(tmp_path / "state.vtu", STUDY.mesh, replace(STUDY.records[1], section_force=force))
    stress = read(tmp_path / "state.vtu").cell_data["nominal_stress_MPa"][0]
    values, counts = np.unique(stress, return_counts=True)
    np.testing.assert_allclose(values, [1.41471, 2.82942], rtol=1e-5)
    assert counts[1] == 12 * STUDY.mesh.order


def test_quadrilaterals_face_outwards(tmp_path: Path) -> None:
    record = replace(STUDY.records[0], configuration=STUDY.initial)
    write_vtu(tmp_path / "state.vtu", STUDY.mesh, record)
    tube = read(tmp_path / "state.vtu")
    corners = tube.points[tube.cells_dict["quad"]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    axis: Floats = STUDY.mesh.position[tube.cells_dict["quad"] // 12].mean(axis=1)
    assert (np.einsum("ck,ck->c", normal, corners.mean(axis=1) - axis) > 0.0).all()


def test_contact_force_is_conserved(tmp_path: Path) -> None:
    record = STUDY.records[0]
    lengths = np.diff(STUDY.mesh.xi[tubes.spans(STUDY.mesh)], axis=1)[:, 0]
    total = 2.0 * record.contacts.line_load @ record.contacts.weight
    assert tubes.span_load(record.contacts) @ lengths == pytest.approx(total, rel=1e-12)


def test_collection_has_strain_as_time(tmp_path: Path) -> None:
    write_pvd(tmp_path / "all.pvd", [(0.0, "relaxed.vtu"), (0.025, "a & b.vtu")])
    sets = ElementTree.parse(tmp_path / "all.pvd").getroot().findall("Collection/DataSet")
    assert [(float(s.attrib["timestep"]), s.attrib["file"]) for s in sets] == [
        (0.0, "relaxed.vtu"),
        (0.025, "a & b.vtu"),
    ]


def test_every_loading_path_has_a_collection_that_starts_relaxed(tmp_path: Path) -> None:
    study = synthetic_study(2, contacts=4, rows=(1,), loadings=("stretch", "shear"))
    files = write_collections(tmp_path, study)
    assert [file.name for file in files] == ["stretch.pvd", "shear.pvd"]
    listed = [[s.attrib["file"] for s in ElementTree.parse(file).getroot().iter("DataSet")] for file in files]
    assert listed == [["relaxed.vtu", "stretch-0.0250.vtu"], ["relaxed.vtu", "shear-0.0250.vtu"]]
    (only,) = write_collections(tmp_path, replace(study, records=study.records[:1]))
    assert only.name == "relaxed.pvd"
