"""Geometry: from a design to the centre lines, directors and flat mesh of its fibrils."""

from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh

__all__ = ["FibrilMesh", "build_mesh"]
