"""Peirce's geometry of a plain weave: arcs and straight pieces, and yarns that touch and do not overlap."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq, fsolve

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.design import Design, Weave, parse_design, plain_weave
from circuittex.design.wave import peirce
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import initial_configuration
from circuittex.relaxation.increment import advance
from circuittex.relaxation.relax import force_terms, relax

R, PITCH, WEFT_PITCH = 0.15, 2.0, 1.5
SHARE = 0.4
"""Part of the axes' distance that the warp's amplitude is: the weft has the more crimp."""
MESHED = 0.01
"""Of R + R': what twenty elements leave of an arc that ends within one of them, size^2 kappa / 16."""


def cell(**changes: object) -> Design:
    """Two by two yarns of one fibril that touch: H + H' = 2 R."""
    design = plain_weave(yarns=2, rows=(1,))
    stated: dict[str, object] = {"pitch": PITCH, "weft_pitch": WEFT_PITCH, "path": "peirce"}
    stated |= {"amplitude": SHARE * 2 * R, "weft_amplitude": (1 - SHARE) * 2 * R}
    return replace(design, weave=replace(design.weave, **stated | changes))  # type: ignore[arg-type]


def by_peirce(p: float, h: float, D: float) -> tuple[float, float]:
    """l and theta, from both of his equations at once."""

    def off(x: tuple[float, float]) -> list[float]:
        length, angle = x
        straight = length - D * angle
        return [
            straight * np.cos(angle) + D * np.sin(angle) - p,
            straight * np.sin(angle) + D * (1 - np.cos(angle)) - h,
        ]

    length, angle = fsolve(off, (1.05 * p, 0.3), xtol=1e-13)
    return float(length), float(angle)


@pytest.mark.parametrize(("p", "h"), [(2.0, 0.3), (1.5, 0.36), (5.0, 0.05), (1.1, 0.3)])
def test_a_thread_has_his_length_and_angle(p: float, h: float) -> None:
    D = 0.6
    length, angle = by_peirce(p, h, D)
    arcs = peirce(p, h / 2, D / 2)
    assert (arcs.length, arcs.angle) == (pytest.approx(length, rel=1e-10), pytest.approx(angle, rel=1e-10))


def test_small_waves_have_his_approximations() -> None:
    """h = 4/3 p sqrt(c), c = l/p - 1; theta lies between sqrt(2 c) of a zigzag and sqrt(6 c) of arcs alone."""
    for p in (1.0, 2.0, 4.0):
        arcs = peirce(p, 0.15, 0.3)
        crimp = arcs.length / p - 1.0
        assert 4 / 3 * p * np.sqrt(crimp) == pytest.approx(0.3, rel=0.1)
        assert np.sqrt(2 * crimp) < arcs.angle < np.sqrt(6 * crimp)


def test_the_fibrils_of_a_mesh_are_his_threads() -> None:
    """Height, spacing and length, warp and weft each with its own, and h + h' = D."""
    design = cell()
    weave = design.weave
    kinds = [tuple(replace(yarn, crimp="path") for yarn in yarns) for yarns in (weave.warp, weave.weft)]
    mesh = build_mesh(replace(design, weave=replace(weave, warp=kinds[0], weft=kinds[1])))
    heights = []
    for fibril, (p, share) in {0: (WEFT_PITCH, SHARE), 2: (PITCH, 1 - SHARE)}.items():
        own = slice(mesh.first_node[fibril], mesh.first_node[fibril + 1])
        height = float(np.ptp(mesh.position[own, 2]))
        assert height == pytest.approx(2 * share * 2 * R, rel=1e-3)  # no node need be on a crest
        length, _ = by_peirce(p, 2 * share * 2 * R, 4 * R)
        assert mesh.length[fibril] == pytest.approx(
            2 * length, rel=1e-6
        )  # two crossings; curvature jumps at arcs' ends
        heights.append(2 * share * 2 * R)
    assert sum(heights) == pytest.approx(4 * R, rel=1e-14)


def test_a_float_is_level_and_its_ends_are_arcs() -> None:
    design = plain_weave(yarns=3, rows=(1,))
    twill = ((1, 1, 0), (0, 1, 1), (1, 0, 1))
    weave = replace(design.weave, draft=twill, amplitude=0.16, path="peirce")
    mesh = build_mesh(replace(design, weave=weave))
    own = mesh.position[mesh.first_node[0] : mesh.first_node[1]]
    between = (own[:, 0] > -1.99) & (own[:, 0] < -0.01)  # from its first to its second crossing, both over
    np.testing.assert_allclose(own[between, 2], 0.16, rtol=1e-12)


def test_the_start_touches_along_the_arcs_and_does_not_overlap() -> None:
    """As near as R + R' all along them, and no nearer than elements make of arcs' ends, where the curvature jumps."""
    design = cell()
    mesh = build_mesh(design)
    space, _, contact = force_terms(mesh, design)
    found = contact.touching(space.vector(initial_configuration(mesh)))
    assert found.overlap.max() < MESHED * 2 * R
    closer = cell(amplitude=SHARE * 1.95 * R, weft_amplitude=(1 - SHARE) * 1.95 * R)
    there = build_mesh(closer)
    space, _, contact = force_terms(there, closer)
    found = contact.touching(space.vector(initial_configuration(there)))
    assert found.overlap.max() == pytest.approx(0.05 * R, abs=MESHED * 2 * R)
    touching = found.position_b[(found.fibril_b == 0) & (found.overlap > 0.0)]  # of a warp fibril with two wefts
    assert len(np.unique(touching.round(1))) > 4  # not at its two crests alone


def test_a_fabric_set_in_his_geometry_is_at_rest() -> None:
    apart = 2 * R * (1 + 2 * MESHED)
    design = cell(amplitude=SHARE * apart, weft_amplitude=(1 - SHARE) * apart)
    weave = design.weave
    kinds = [tuple(replace(yarn, crimp="path", heat_set=1.0) for yarn in yarns) for yarns in (weave.warp, weave.weft)]
    design = replace(design, weave=replace(weave, warp=kinds[0], weft=kinds[1]))
    assert relax(build_mesh(design), design).iterations == 0


def test_auto_finds_the_height_for_his_waves() -> None:
    """For single fibrils R, as the arcs touch all along, and the margin of 1e-3 that `auto` leaves."""
    text = plain_text()
    weave = parse_design(text).weave
    assert weave.path == "peirce"
    assert weave.amplitude == pytest.approx(R, rel=3e-3)


def plain_text() -> dict[str, object]:
    material = {"youngs_modulus": "10 MPa", "poisson_ratio": 0.0, "density": "1 g/mm3"}
    material |= {"electrical_conductivity": "10 S/mm", "thermal_conductivity": "1 W/(mm K)"}
    return {
        "format": 1,
        "name": "peirce",
        "materials": {"m": material},
        "yarns": {"y": {"rows": [1], "radius": f"{R} mm", "spacing": "0.3 mm", "material": "m"}},
        "weave": {
            **{"draft": [[0, 1], [1, 0]], "warp": "y", "weft": "y", "pitch": "2 mm"},
            **{"amplitude": "auto", "path": "peirce"},
        },
        "contact": {"penalty": "hertz", "conductivity": "0.01 S/mm2", "heat_transfer": "0.1 W/(mm2 K)"},
        "terminals": {"a": ["warp1-"], "b": ["warp1+"]},
        "probes": [{"name": "p", "source": "a", "sink": "b", "voltage": "1 V"}],
    }


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"pitch": 0.5, "weft_pitch": 0.5}, "jammed"),
        ({"amplitude": 0.07, "weft_amplitude": 0.07}, "cannot bend about one another"),
        ({"path": "cosine"}, "sine.*peirce"),
    ],
)
def test_what_cannot_be_woven_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(DesignError, match=f"weave.path.*{words}"):
        cell(**changes)


def test_the_papers_path_is_what_it_was() -> None:
    weave = plain_weave().weave
    assert weave.path == "sine"
    assert isinstance(weave, Weave)


class Thread(NamedTuple):
    """A thread between two crossings amid the cell, measured on its centre line."""

    spacing: float
    height: float
    length: float

    @property
    def crimp(self) -> float:
        return self.length / self.spacing - 1.0


def between_crossings(line: Floats, axis: int) -> Thread:
    """From the second of four crossings of a centre line (n, 3) to the third."""
    first, last = ((len(line) - 1) * k // 8 for k in (3, 5))
    length = float(np.linalg.norm(np.diff(line[first : last + 1], axis=0), axis=1).sum())
    across = np.abs(line[last] - line[first])
    return Thread(float(across[axis]), float(across[2]), length)


def by_his_equations(spacing: float, height: float, D: float) -> float:
    """The length of a thread of that spacing and height."""

    def higher(angle: float) -> float:
        return (spacing - D * np.sin(angle)) * np.tan(angle) + D * (1 - np.cos(angle)) - height

    angle = brentq(higher, 1e-6, 1.2)
    return float((spacing - D * np.sin(angle)) / np.cos(angle) + D * angle)


def test_stretching_the_warp_moves_crimp_into_the_weft() -> None:
    """Crimp interchange, with weft ends free, against Peirce's geometry.

    Threads that resist bending do not lie along his arcs once pulled, so that lengths differ from his: by 2 % of the
    crimp here. The heights still add up to D, less by some per cent of pressing at the contacts. His threads neither
    stretch nor resist bending, so that theirs change by more: fibrils of R / p = 0.15 that are set in their weave go a
    part of that way, warp and weft. How much narrower the fabric becomes follows from
    the weft's height and length, within a tenth of it.
    """
    design = plain_weave(yarns=4, rows=(1,))
    weave, apart, p, stretch = design.weave, 2 * R * 1.003, 1.0, 0.02
    yarn = replace(weave.warp[0], crimp="path", heat_set=1.0)
    weave = replace(weave, warp=(yarn,) * 4, weft=(yarn,) * 4, pitch=p, amplitude=apart / 2, path="peirce")
    design = replace(design, weave=weave, contact=replace(design.contact, penalty="hertz"))
    design = replace(design, numerics=replace(design.numerics, elements=32))
    mesh = build_mesh(design)
    start = relax(mesh, design).configuration
    found = advance(mesh, design, start, np.eye(2), np.diag([1 + stretch, 1.0]), free_edges="y").equilibrium
    lines = found.configuration.r.reshape(mesh.n_fibrils, -1, 3)
    warp, weft = between_crossings(lines[1], 0), between_crossings(lines[5], 1)
    woven, D = peirce(p, apart / 2, apart), 2 * apart
    crimp = woven.length / p - 1
    assert warp.spacing == pytest.approx(p * (1 + stretch), rel=1e-4)
    assert warp.crimp < 0.8 * crimp
    assert weft.crimp > 1.15 * crimp
    for thread in (warp, weft):
        theirs = by_his_equations(thread.spacing, thread.height, D)
        assert thread.crimp == pytest.approx(theirs / thread.spacing - 1, rel=0.02)
    narrower = brentq(lambda q: by_his_equations(q, weft.height, D) - weft.length, 0.9 * p, 1.1 * p)
    assert p - narrower == pytest.approx(p - weft.spacing, rel=0.1)
    assert p - weft.spacing > 0.007 * p
    assert warp.height + weft.height == pytest.approx(D, rel=0.03)
    angle = brentq(lambda t: (woven.length - D * t) * np.cos(t) + D * np.sin(t) - warp.spacing, 1e-6, woven.angle)
    flexible = (woven.length - D * angle) * np.sin(angle) + D * (1 - np.cos(angle))
    for height, end in ((warp.height, flexible), (weft.height, D - flexible)):
        assert 0.0 < (height - apart) / (end - apart) < 1.0  # none of rigid threads, all of flexible ones
