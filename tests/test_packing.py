"""Random packings: their statistics, their shapes in closed form, and what stays as it is."""

from __future__ import annotations

import tomllib
from dataclasses import astuple, replace

import numpy as np
import pytest

from circuittex.base.errors import DesignError
from circuittex.design import Design, Weave, design_hash, parse_design, plain_weave, starter
from circuittex.design.packing import Packing
from circuittex.geometry import build_mesh
from circuittex.geometry.centre_lines import CentreLines, centre_lines, yarn_height
from circuittex.geometry.packing import draw, places_in_yarn, section_offsets

H, PITCH = 0.525, 2.0
CROWD = 4000
"""Fibrils of the yarns whose statistics are taken: a standard deviation is then known to 1 % (1 / sqrt(2 * 4000))."""


def crowd(warp: int, weft: int) -> Weave:
    """A weave whose only use is its many fibrils."""
    one = plain_weave(yarns=1, rows=(1,)).weave
    few = PITCH / CROWD  # so close that they have room
    yarn = replace(one.warp[0], rows=(CROWD // warp,), spacing=few, materials=one.warp[0].materials * (CROWD // warp))
    return Weave(((1,) * weft,) * warp, (yarn,) * warp, (yarn,) * weft, PITCH, H)


def packed(packing: Packing, **cell: object) -> Design:
    return replace(plain_weave(**cell), packing=packing)  # type: ignore[arg-type]


def lines_of(packing: Packing, places: int = 401, yarns: int = 2, rows: tuple[int, ...] = (1, 2)) -> CentreLines:
    return centre_lines(plain_weave(yarns=yarns, rows=rows).weave, places, packing)


# ---- what stays -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("yarns", [1, 2, 5])
def test_without_amplitudes_the_geometry_is_the_regular_one_to_the_last_bit(yarns: int) -> None:
    """Against the closed form of the regular packing, computed here in the order of operations it always had."""
    weave = plain_weave(yarns=yarns).weave
    lines = centre_lines(weave, 41, Packing(seed=99))
    length = yarns * PITCH
    s = length * np.linspace(0, 1, 41) - length / 2
    sides = 2 * np.array(weave.draft) - 1
    at = np.tile(s / PITCH + (yarns - 1) / 2, (yarns, 1))
    for direction, side in ((0, sides), (1, -sides.T)):
        height, slope = yarn_height(at, side)
        z, dz = H * height, slope / PITCH * H
        up = 1 / np.sqrt(1 + dz**2)
        for y in range(yarns):
            for f, (lateral, vertical) in enumerate(section_offsets(weave.warp[0])):
                n = 10 * (yarns * direction + y) + f
                assert np.array_equal(lines.position[n, :, direction], s)
                across = PITCH * (y - (yarns - 1) / 2) + lateral
                assert np.array_equal(lines.position[n, :, 1 - direction], np.full(41, across))
                assert np.array_equal(lines.position[n, :, 2], z[y] + vertical)
                sign = (1, -1)[direction]
                assert np.array_equal(lines.directors[n, :, 0], np.tile(sign * np.eye(3)[1 - direction], (41, 1)))
                assert np.array_equal(lines.directors[n, :, 1, direction], -dz[y] * up[y])
                assert np.array_equal(lines.directors[n, :, 1, 2], up[y])


def test_the_packing_is_part_of_the_design() -> None:
    changes = [{}, {"seed": 1}, {"lateral": 0.01}, {"vertical": 0.01}, {"twist": 0.01}, {"phase": 0.01}]
    assert len({design_hash(packed(Packing(**change))) for change in changes}) == len(changes)  # type: ignore[arg-type]


def test_it_is_read_with_units() -> None:
    tables = tomllib.loads(starter())
    assert astuple(parse_design(tables).packing) == (0, 0.0, 0.0, 0.0, 0.0)
    tables["packing"] = {"seed": 5, "lateral": "7.5 um", "twist": "5 1/m", "phase": 0.01}
    assert astuple(parse_design(tables).packing) == (5, 0.0075, 0.0, 0.005, 0.01)


@pytest.mark.parametrize(
    ("table", "field", "phrase"),
    [
        ({"seed": -1}, "packing.seed", "whole number from 0"),
        ({"seed": 1.5}, "packing.seed", "whole number"),
        ({"lateral": -0.1}, "packing.lateral", ">= 0 mm"),
        ({"vertical": "1 S"}, "packing.vertical", "in mm"),
        ({"lateral": 0.16}, "packing.lateral", "at most 0.15 mm, the smallest radius"),
        ({"phase": 0.63}, "packing.phase", "at most 0.625 mm, a quarter of the pitch"),
        ({"twist": 0.126}, "packing.twist", "a quarter of a turn a pitch"),
        ({"twsit": 0.1}, "packing.twsit", "did you mean 'twist'"),
        (3, "packing", "must be a table"),
    ],
)
def test_what_cannot_be_meant_is_refused(table: object, field: str, phrase: str) -> None:
    with pytest.raises(DesignError, match=phrase) as caught:
        parse_design({**tomllib.loads(starter()), "packing": table})
    assert caught.value.field == field


# ---- what is random ---------------------------------------------------------------------------------------


def test_the_same_seed_is_the_same_packing_and_another_is_not() -> None:
    packing = Packing(seed=3, lateral=0.01, vertical=0.01, twist=0.002, phase=0.02)
    first, again, other = (lines_of(p).position for p in (packing, packing, replace(packing, seed=4)))
    assert np.array_equal(first, again)
    assert np.abs(first - other).max() > 0.01


def test_a_seed_keeps_its_meaning_whatever_the_mesh_and_the_amplitudes() -> None:
    packing = Packing(seed=3, lateral=0.01, vertical=0.02, twist=0.002, phase=0.02)
    coarse, fine = lines_of(packing, 11).position, lines_of(packing, 101).position
    np.testing.assert_allclose(fine[:, ::10], coarse, atol=1e-14)
    regular = lines_of(Packing()).position
    only = [lines_of(replace(Packing(seed=3), lateral=size)).position - regular for size in (0.01, 0.03)]
    np.testing.assert_allclose(3 * only[0], only[1], atol=1e-14)


def test_every_yarn_draws_for_itself() -> None:
    """A yarn more at the end of the weft changes nothing about the other yarns' twist and phase."""
    few, more = draw(crowd(2, 2), 1), draw(crowd(2, 3), 1)
    assert np.array_equal(few.twist, more.twist[:4])
    assert np.array_equal(few.phase, more.phase[:4])
    assert len(set(few.twist) | set(few.phase)) == 8


@pytest.mark.parametrize(("warp", "weft"), [(1, 1), (2, 4)])
def test_offsets_have_their_standard_deviation_everywhere_and_the_correlation_of_their_waves(
    warp: int, weft: int
) -> None:
    """sigma^2 / (n + 1) (1 + sum cos(pi k (t - t'))) between two places, and none between fibrils or directions."""
    weave, t = crowd(warp, weft), np.linspace(0.0, 1.0, 9)
    packing = Packing(lateral=0.01, vertical=0.02)
    regular, _ = places_in_yarn(weave, Packing(), draw(weave, 8), t)
    places, _ = places_in_yarn(weave, packing, draw(weave, 8), t)
    offsets = (places - regular) / [0.01, 0.02]
    assert abs(offsets.mean(axis=0)).max() < 5 / np.sqrt(CROWD)
    for fibrils, n in ((slice(None, CROWD), weft), (slice(CROWD, None), warp)):
        for component in (0, 1):
            found = np.cov(offsets[fibrils, :, component].T)
            k = np.arange(1, n + 1)
            expected = (1 + np.cos(np.pi * np.subtract.outer(t, t)[..., None] * k).sum(axis=-1)) / (n + 1)
            # the standard error of a covariance of unit variances is at most sqrt(2 / count); five of them
            np.testing.assert_allclose(found, expected, atol=5 * np.sqrt(2 / CROWD))
    cross = (offsets[..., 0] * offsets[..., 1]).mean(axis=0)
    assert abs(cross).max() < 5 / np.sqrt(CROWD)


def test_yarns_have_independent_twists_and_phases_of_unit_variance() -> None:
    weave = plain_weave(yarns=3, rows=(1,)).weave
    twist, phase = (
        np.concatenate([getattr(draw(weave, seed), name) for seed in range(500)]) for name in ("twist", "phase")
    )
    count = len(twist)
    assert count == 3000
    for values in (twist, phase):
        assert abs(values.mean()) < 5 / np.sqrt(count)
        assert abs(values.var() - 1) < 5 * np.sqrt(2 / count)
    assert abs((twist * phase).mean()) < 5 / np.sqrt(count)


# ---- shapes -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", [0, 1])
def test_a_twisted_straight_yarn_consists_of_right_handed_helices(direction: int) -> None:
    """(rho cos, rho sin)(2 pi s / pitch of the screw) seen along the yarn; its curvature is that of a helix."""
    weave = replace(plain_weave(yarns=2, rows=(1, 2)).weave, amplitude=0.0)
    seed, tau = 5, 0.05
    lines = centre_lines(weave, 2001, Packing(seed=seed, twist=tau))
    left, ahead = ((1, 0), (0, 1))[direction]
    sign = (1.0, -1.0)[direction]
    turns = tau * draw(weave, seed).twist
    for f in np.flatnonzero(lines.yarn // 2 == direction):
        yarn = lines.yarn[f]
        s = lines.position[f, :, ahead]
        place = PITCH * (yarn % 2 - 0.5)
        along = sign * (lines.position[f, :, left] - place) + 1j * lines.position[f, :, 2]
        lateral, vertical = section_offsets(weave.warp[0])[f % 3]
        helix = (sign * lateral + 1j * vertical) * np.exp(2j * np.pi * turns[yarn] * s)
        np.testing.assert_allclose(along, helix, atol=1e-14)
        first = np.gradient(lines.position[f], s, axis=0, edge_order=2)
        second = np.gradient(first, s, axis=0, edge_order=2)
        curvature = np.linalg.norm(np.cross(first, second), axis=1) / np.linalg.norm(first, axis=1) ** 3
        rho, rate = np.hypot(lateral, vertical), 2 * np.pi * turns[yarn]
        np.testing.assert_allclose(curvature[5:-5], rho * rate**2 / (1 + (rho * rate) ** 2), rtol=1e-3)


def test_a_phase_moves_the_wave_along_the_yarn_and_nothing_else() -> None:
    seed, size = 2, 0.03
    lines, regular = lines_of(Packing(seed=seed, phase=size)), lines_of(Packing())
    shift = size * draw(plain_weave(yarns=2).weave, seed).phase
    assert np.array_equal(lines.position[..., :2], regular.position[..., :2])
    s = regular.xi - 2.0
    crest = np.sign(regular.position[:, 100, 2:] - regular.position[:, 200, 2:])  # at the first crossing
    moved = -crest * H * np.sin(np.pi * (s - shift[lines.yarn][:, None]) / PITCH)
    np.testing.assert_allclose(lines.position[..., 2], moved + regular.position[:, 200:201, 2], atol=1e-14)


def test_directors_are_frames_of_the_tangent() -> None:
    """Orthonormal, right-handed, across the tangent that differences of the positions give."""
    lines = lines_of(Packing(seed=1, lateral=0.1, vertical=0.1, twist=0.1, phase=0.2), places=2001)
    tangent = np.gradient(lines.position, lines.xi[0], axis=1, edge_order=2)
    tangent /= np.linalg.norm(tangent, axis=2)[..., None]
    g1, g2 = lines.directors[:, :, 0], lines.directors[:, :, 1]
    frame = np.stack([g1, g2, tangent], axis=-1)
    gram = np.einsum("fkij,fkil->fkjl", frame, frame)
    # second differences of waves of 4 mm at 2 um: (pi / 2)^3 amplitude step^2 / 6 = 1e-6
    np.testing.assert_allclose(gram, np.broadcast_to(np.eye(3), gram.shape), atol=5e-6)
    assert (np.linalg.det(frame) > 0.99).all()
    np.testing.assert_allclose(np.linalg.norm(lines.directors, axis=-1), 1.0, atol=1e-14)
    np.testing.assert_allclose((g1 * g2).sum(axis=-1), 0.0, atol=1e-14)


def test_the_derivatives_are_those_of_the_places() -> None:
    weave, t = plain_weave(yarns=3).weave, np.linspace(0, 1, 3001)
    packing = Packing(lateral=0.05, vertical=0.1, twist=0.05)
    places, slopes = places_in_yarn(weave, packing, draw(weave, 0), t)
    numerical = np.gradient(places, t * 6.0, axis=1, edge_order=2)
    np.testing.assert_allclose(slopes, numerical, atol=1e-5)
    assert np.abs(slopes).max() > 0.1


def test_the_mesh_has_the_packing_of_its_design() -> None:
    packing = Packing(seed=6, lateral=0.01, phase=0.01)
    design = packed(packing, yarns=2, rows=(1, 2))
    mesh = build_mesh(design)
    lines = centre_lines(design.weave, 41, packing)
    assert np.array_equal(mesh.position, lines.position.reshape(-1, 3))
    assert np.array_equal(mesh.directors, lines.directors.reshape(-1, 2, 3))
    assert np.array_equal(mesh.length, np.full(12, 4.0))


def test_fibrils_too_far_inside_one_another_name_the_seed() -> None:
    design = packed(Packing(seed=4, lateral=0.15), yarns=2)
    with pytest.raises(DesignError, match="inside one another") as caught:
        build_mesh(design)
    assert (caught.value.field, caught.value.value) == ("packing.seed", 4)


def test_a_weave_that_is_too_narrow_anyway_names_its_own_key() -> None:
    design = packed(Packing(seed=4, lateral=0.001), yarns=2)
    yarn = replace(design.weave.warp[0], spacing=0.1)
    weave = replace(design.weave, warp=(yarn,) * 2, weft=(yarn,) * 2)
    with pytest.raises(DesignError) as caught:
        build_mesh(replace(design, weave=weave))
    assert caught.value.field == "yarns.conductive.spacing"
