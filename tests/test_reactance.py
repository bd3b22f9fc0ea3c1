"""Capacitances and inductances of yarns: against closed forms, a surface charge method, and ngspice."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from gnucap import needs_gnucap
from library_cases import pins_of, study
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.linalg import eigvalsh

from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.design import plain_weave
from circuittex.electrical.network.reactance import (
    EPSILON0,
    MU0,
    YarnLines,
    end_capacitances,
    inductance,
    yarn_lines,
)
from circuittex.geometry.weave import build_mesh
from circuittex.study.library.export import export_library

pytestmark = pytest.mark.xdist_group("reactance")  # what its fixtures make serves one worker

Lines = NDArray[np.float64]
LENGTH, RADIUS = 16.0, 1.0
"""mm, of both wires."""
THIN = {3.0: 0.14, 4.0: 0.06, 6.0: 0.03}
"""Distance of the axes in radii: what the potential of a thin wire at its axis errs by, (a / d)^2, and the patches of
the comparison by 1 %."""


def parallel(distance: float) -> list[Lines]:
    return [np.linspace((0, y, 0), (LENGTH, y, 0), 201) for y in (0.0, distance)]


def crossed(distance: float) -> list[Lines]:
    half = LENGTH / 2
    return [np.linspace((-half, 0, distance), (half, 0, distance), 201), np.linspace((0, -half, 0), (0, half, 0), 201)]


def yarns(lines: list[Lines], radius: float = RADIUS) -> YarnLines:
    each = np.full(len(lines), radius)
    return YarnLines(np.array(lines), each, np.exp(-0.25) * each)


def between(known: YarnLines, permittivity: float = 1.0) -> float:
    """Capacitance of the first two yarns, all ends of each at one potential."""
    return float(end_capacitances(known, permittivity)[:2, 2:4].sum())


def by_surface_charges(lines: list[Lines], around: int = 14) -> float:
    """The capacitance of two round wires with opposite charges from even patches of charge on their surfaces."""
    patches = []
    height = 2 * np.pi * RADIUS / around
    count = int(LENGTH / height)
    width = LENGTH / count
    for line in lines:
        way = (line[-1] - line[0]) / LENGTH
        side = np.cross(way, [0.0, 0.0, 1.0])
        z, phi = np.meshgrid((np.arange(count) + 0.5) * width, 2 * np.pi * np.arange(around) / around, indexing="ij")
        ring = np.cos(phi)[..., None] * side + np.sin(phi)[..., None] * np.array([0.0, 0.0, 1.0])
        patches.append((line[0] + z[..., None] * way + RADIUS * ring).reshape(-1, 3))
    points = np.concatenate(patches)
    distance = np.linalg.norm(points[:, None] - points[None], axis=-1)
    np.fill_diagonal(distance, 1.0)
    potential = 1.0 / distance
    own = 2 * (np.arcsinh(height / width) / height + np.arcsinh(width / height) / width)
    np.fill_diagonal(potential, own)
    first = np.arange(len(points)) < len(patches[0])
    q = 4 * np.pi * EPSILON0 * np.linalg.solve(potential, np.stack([first, ~first], axis=1).astype(float))
    C = np.array([q[first].sum(axis=0), q[~first].sum(axis=0)])
    return float(np.linalg.det(C) / C.sum())


@pytest.mark.parametrize("laid", [parallel, crossed])
@pytest.mark.parametrize("distance", THIN)
def test_two_wires_as_by_charges_on_their_surfaces(laid: Callable[[float], list[Lines]], distance: float) -> None:
    lines = laid(distance)
    assert between(yarns(lines)) == pytest.approx(by_surface_charges(lines), rel=THIN[distance])


def test_long_parallel_wires_have_the_closed_form() -> None:
    """pi epsilon / arccosh(d / 2 a) a length; what their ends add goes with the difference of two lengths."""
    lengths = (300.0, 600.0)
    found = [between(yarns([np.linspace((0, y, 0), (long, y, 0), 801) for y in (0.0, 10.0)])) for long in lengths]
    exact = np.pi * EPSILON0 / np.arccosh(10.0 / 2)
    assert (found[1] - found[0]) / (lengths[1] - lengths[0]) == pytest.approx(exact, rel=0.01)


def test_capacitances_are_symmetric_not_negative_and_go_with_permittivity_and_size() -> None:
    mesh = build_mesh(plain_weave(yarns=3))
    known = yarn_lines(mesh, mesh.position)
    found = end_capacitances(known, 1.0)
    np.testing.assert_allclose(found, found.T, rtol=1e-12)
    assert found.min() == 0.0  # of an end with itself
    assert (found + np.eye(len(found)) > 0.0).all()
    matrix = np.diag(found.sum(axis=1)) - found
    assert eigvalsh(matrix)[0] > -1e-12 * matrix.max()
    np.testing.assert_allclose(end_capacitances(known, 3.0), 3.0 * found, rtol=1e-12)
    large = YarnLines(2.0 * known.place, 2.0 * known.radius, 2.0 * known.mean_distance)
    np.testing.assert_allclose(end_capacitances(large, 1.0), 2.0 * found, rtol=1e-12)
    np.testing.assert_allclose(inductance(large), 2.0 * inductance(known), rtol=1e-12)


def test_neighbours_have_more_between_them_than_those_behind_them() -> None:
    mesh = build_mesh(plain_weave(yarns=4))
    ends = end_capacitances(yarn_lines(mesh, mesh.position), 1.0)
    found = ends.reshape(8, 2, 8, 2).sum(axis=(1, 3))
    assert found[0, 1] > 3.0 * found[0, 2:4].max()


def test_a_bundle_of_two_wires_has_the_radius_of_their_mean_distance() -> None:
    """Two round wires d apart are one of radius sqrt(0.7788 R d): Grover, Inductance Calculations, 1946."""
    R, d, long = 0.15, 0.3, 8.0
    mesh = build_mesh(plain_weave(yarns=4, rows=(2,)))
    flat = replace(mesh, position=mesh.position * [1.0, 1.0, 0.0])
    g = np.sqrt(0.7788007830714049 * R * d)
    expected = MU0 * long / (2 * np.pi) * (np.log(2 * long / g) - 1)
    np.testing.assert_allclose(inductance(yarn_lines(flat, flat.position)), expected, rtol=g / long)  # a long wire's


@pytest.mark.parametrize("g", [0.01, 0.5, 3.0])
def test_an_inductance_is_that_of_two_filaments_and_never_negative(g: float) -> None:
    """Neumann's integral over both, of 1 mm a distance g apart; a wide yarn of a narrow cell had less than none."""
    along = quad(lambda u: 2 * (1 - u) / np.hypot(u, g), 0, 1, epsabs=1e-13)[0]
    known = YarnLines(np.array([[[0.0, 0, 0], [1.0, 0, 0]]]), np.array([g]), np.array([g]))
    assert inductance(known)[0] == pytest.approx(MU0 / (4 * np.pi) * along, rel=1e-9)
    assert inductance(known)[0] > 0.0


def test_the_outline_is_that_of_the_fibrils() -> None:
    """Rows of 3, 4, 3 at 0.3 mm, R = 0.15, made level: 1.2 mm wide and 0.9 mm high."""
    mesh = build_mesh(plain_weave(yarns=2))
    r = mesh.position.reshape(4, 10, -1, 3)
    level = np.concatenate([r[..., :2], (r - r.mean(axis=1, keepdims=True))[..., 2:]], axis=-1)
    np.testing.assert_allclose(yarn_lines(mesh, level.reshape(-1, 3)).radius, (1.2 + 0.9) / 4, rtol=1e-12)


def test_fibrils_that_insulate_are_no_part_of_the_conductor() -> None:
    """One copper wire beside nine of nylon is that wire, wherever it lies in its yarn."""
    mesh = build_mesh(plain_weave(yarns=2, rows=(3, 4, 3)))
    wire = 4
    alone = replace(mesh, electrical_conductivity=np.where(np.arange(mesh.n_fibrils) % 10 == wire, 10.0, 0.0))
    known = yarn_lines(alone, mesh.position)
    np.testing.assert_array_equal(known.place, mesh.position.reshape(mesh.n_fibrils, -1, 3)[wire::10])
    np.testing.assert_allclose(known.radius, 0.15, rtol=1e-12)
    np.testing.assert_allclose(known.mean_distance, np.exp(-0.25) * 0.15, rtol=1e-12)  # of a round wire
    nothing = replace(mesh, electrical_conductivity=np.zeros(mesh.n_fibrils))
    assert same(yarn_lines(nothing, mesh.position), yarn_lines(mesh, mesh.position))


@pytest.fixture(scope="module")
def libraries(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same library without and with the elements."""
    plain, reactive = (tmp_path_factory.mktemp(name) for name in ("plain", "reactive"))
    made = study(4)
    dialects = ("ngspice", "gnucap")
    with pytest.MonkeyPatch.context() as patch:
        undrawn(patch)
        export_library(made, plain, dialects=dialects)
    export_library(made, reactive, dialects=dialects, reactive=True)
    return plain, reactive


def deck(folder: Path, cell: str, analysis: str) -> tuple[str, int]:
    """1 V from the first pin to the second, all others all but open; and how many others there are."""
    text = (folder / "ngspice" / f"{cell}.lib").read_text("ascii")
    others = len(pins_of(text)) - 2
    nodes = ["a", "0", *(f"n{k}" for k in range(others))]
    loose = [f"Rn{k} n{k} 0 1e9" for k in range(others)]
    cards = ["V1 a 0 DC 1 AC 1", f"X1 {' '.join(nodes)} {cell}", *loose, analysis, ".end", ""]
    return "\n".join([f"* {cell}", text, *cards]), others


def answer(folder: Path, cell: str, analysis: str) -> NDArray[np.complex128]:
    """Current of the source and voltages of the other pins, at one point."""
    text, others = deck(folder, cell, analysis)
    with tempfile.TemporaryDirectory() as scratch:
        Path(scratch, "deck.cir").write_text(text, "ascii")
        subprocess.run(["ngspice", "-b", "-r", "out.raw", "deck.cir"], cwd=scratch, capture_output=True, check=True)
        head, _, body = Path(scratch, "out.raw").read_bytes().partition(b"Binary:\n")
    kind = np.complex128 if b"Flags: complex" in head else np.float64
    names = [line.split()[1].decode() for line in head.partition(b"Variables:\n")[2].splitlines() if line.strip()]
    values = dict(zip(names, np.frombuffer(body, kind)[: len(names)].astype(complex), strict=True))
    return np.array([values["i(v1)"], *(values[f"v(n{k})"] for k in range(others))])


@pytest.mark.parametrize("cell", ["detailed", "ports", "cell", "unit", "ports_stretch_s", "ports_stretch_v"])
def test_nothing_changes_at_rest(cell: str, libraries: tuple[Path, Path]) -> None:
    """Coils are short and capacitors open: ngspice's own steps of the operating point allow 1e-6."""
    one, other = (answer(folder, f"fabric_{cell}", ".op") for folder in libraries)
    np.testing.assert_allclose(other, one, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("hertz", [1e6, 3e8, 1e11])
def test_ngspice_answers_as_a_dense_complex_matrix(hertz: float, libraries: tuple[Path, Path]) -> None:
    """From where resistance is all to where coils and capacitors are: every card by itself, 1e-6 of ngspice's."""
    folder = libraries[1]
    text = (folder / "ngspice" / "fabric_ports.lib").read_text("ascii")
    cards = [line.split() for line in text.splitlines() if line[:1] in "RLC"]
    pins = pins_of(text)
    nodes = list(dict.fromkeys([*pins, *(node for card in cards for node in card[1:3])]))
    omega = 2j * np.pi * hertz
    Y = np.zeros((len(nodes), len(nodes)), dtype=complex)
    for name, a, b, value in cards:
        y = {"R": 1 / float(value), "L": 1 / (omega * float(value)), "C": omega * float(value)}[name[0]]
        i, j = nodes.index(a), nodes.index(b)
        Y[[i, j], [i, j]] += y
        Y[[i, j], [j, i]] -= y
    loose = [nodes.index(pin) for pin in pins[2:]]
    Y[loose, loose] += 1e-9
    first, ground = nodes.index(pins[0]), nodes.index(pins[1])
    rest = [k for k in range(len(nodes)) if k not in (first, ground)]
    volts = np.zeros(len(nodes), dtype=complex)
    volts[first] = 1.0
    volts[rest] = np.linalg.solve(Y[np.ix_(rest, rest)], -Y[rest, first])
    expected = np.concatenate([[-(Y[first] @ volts)], volts[loose]])
    found = answer(folder, "fabric_ports", f".ac lin 1 {hertz!r} {hertz!r}")
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9 * abs(expected).max())


@needs_gnucap
def test_gnucap_reads_the_elements(libraries: tuple[Path, Path]) -> None:
    """Its example, printed with five digits."""
    found = []
    for folder in libraries:
        name = "gnucap_fabric_ports.cir"
        done = subprocess.run(
            ["gnucap", "-b", name], cwd=folder / "examples", capture_output=True, text=True, check=True
        )
        found.append(done.stdout.split()[-1])
    assert found[1] == found[0]
    assert found[0].endswith("u")  # some microamperes, and no error's word


def test_free_ends_have_no_capacitances(tmp_path: Path) -> None:
    with pytest.raises(DesignError, match=r"reactive: True.*crimped yarn ends"):
        export_library(study(2), tmp_path, ends="free", reactive=True)
    assert not list(tmp_path.iterdir())


def test_the_datasheet_shows_them(libraries: tuple[Path, Path]) -> None:
    plain, reactive = ((folder / "datasheet.html").read_text("utf-8") for folder in libraries)
    assert "inductance (nH)" in reactive
    assert "circuittex export --reactive" in plain
