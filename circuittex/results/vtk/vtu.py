"""Fibrils as tubes in VTU files, and PVD collections of them over strain, for ParaView."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np

from circuittex.base.arrays import Ints
from circuittex.base.atomic import replacing
from circuittex.geometry.mesh import FibrilMesh
from circuittex.results.loadings import by_loading
from circuittex.results.records import Record, Study
from circuittex.results.vtk import tubes

SIDES = 12
"""Quadrilaterals around a fibril."""


def write_vtu(path: str | Path, mesh: FibrilMesh, record: Record, sides: int = SIDES) -> None:
    """Write the fibrils of one recorded state as tubes (binary, compressed).

    The surface is r + R cos t g1 + R sin t g2 [9], `sides` quadrilaterals around and one for each piece between
    neighbouring mesh nodes along a fibril. Cell data: ``fibril``, ``yarn``, ``section_force_N``,
    ``nominal_stress_MPa``, ``contact_line_load_N_per_mm`` and for each probe ``current_A <probe>`` along +xi (mean over
    the piece). Point data: ``xi_mm`` and for each probe ``temperature_K <probe>`` and ``potential_V <probe>`` (nan
    where undefined).

    The stress is nominal, |∫ P E3 dA| / (pi R^2) in N/mm2: the magnitude of the force that a section carries, tension
    or compression and shear together, over its undeformed area. It is a mean over the section: bending, whose stresses
    cancel there, does not show.
    """
    nodes = tubes.spans(mesh)
    fibril = mesh.node_fibril
    force = record.section_force[tubes.span_element(mesh)]
    node_data = {"xi_mm": mesh.xi}
    span_data = {
        "fibril": fibril[nodes[:, 0]],
        "yarn": mesh.yarn[fibril[nodes[:, 0]]],
        "section_force_N": force,
        "nominal_stress_MPa": force / mesh.area[fibril[nodes[:, 0]]],
        "contact_line_load_N_per_mm": tubes.span_load(record.contacts),
    }
    for fields in record.fields:
        node_data[f"temperature_K {fields.probe}"] = tubes.at_nodes(mesh, fields, fields.temperature)
        node_data[f"potential_V {fields.probe}"] = tubes.at_nodes(mesh, fields, fields.potential)
        span_data[f"current_A {fields.probe}"] = tubes.span_current(mesh, fields)
    tube = meshio.Mesh(
        tubes.surface(mesh, record.configuration.x, sides).reshape(-1, 3),
        [("quad", quads(nodes, sides))],
        point_data={name: np.repeat(values, sides) for name, values in node_data.items()},
        cell_data={name: [np.repeat(values, sides)] for name, values in span_data.items()},
    )
    with replacing(path) as partial:
        meshio.write(partial, tube, file_format="vtu", binary=True, compression="zlib")


def quads(nodes: Ints, sides: int) -> Ints:
    """(I * sides, 4) corners of the quadrilaterals of the spans `nodes` (I, 2), normals outwards.

    Point s of node n has number n * sides + s.

    >>> quads(np.array([[0, 1]]), 3).tolist()
    [[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]]
    """
    this = np.arange(sides)
    following = (this + 1) % sides
    first, second = nodes[:, :1] * sides, nodes[:, 1:] * sides
    return np.stack([first + this, first + following, second + following, second + this], axis=-1).reshape(-1, 4)


def write_collections(folder: str | Path, study: Study) -> tuple[Path, ...]:
    """Write a collection ``<loading path>.pvd`` of the files ``<record name>.vtu`` in `folder` for each loading path.

    Every loading starts with the state that it starts from; a study without loading gets ``relaxed.pvd``.
    """
    written = []
    for name, states in by_loading(study).items():
        written.append(Path(folder) / f"{name or 'relaxed'}.pvd")
        write_pvd(written[-1], [(record.strain, f"{record.name}.vtu") for record in states])
    return tuple(written)


def write_pvd(path: str | Path, entries: Iterable[tuple[float, str]]) -> None:
    """Write a ParaView collection: (strain, VTU file relative to the collection) for each state, strain as time."""
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
    root.append(ElementTree.Comment("circuittex"))
    collection = ElementTree.SubElement(root, "Collection")
    for strain, file in entries:
        ElementTree.SubElement(collection, "DataSet", timestep=repr(strain), group="", part="0", file=file)
    ElementTree.indent(root)
    with replacing(path) as partial:
        ElementTree.ElementTree(root).write(partial, encoding="utf-8", xml_declaration=True)
