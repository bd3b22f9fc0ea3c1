"""Figures: what is drawn against closed forms, valid files, and no global state."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from math import nan
from pathlib import Path
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from synthetic import fibrils
from synthetic_study import INSULATED, synthetic_study

from circuittex.base.arrays import Floats
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.results.discretisation import ErrorEstimate, QuantityError
from circuittex.results.loadings import by_loading, farthest, turns
from circuittex.results.plot import (
    FIGURES,
    conductance_figure,
    force_figure,
    network_figure,
    probe_figure,
    save_figures,
    section_figure,
    strained_figure,
)
from circuittex.results.plot.cut import cut
from circuittex.results.plot.scene import camera, draw_tubes
from circuittex.results.plot.style import COLOURS, save, style
from circuittex.results.records import Study
from circuittex.results.store.archive import Digests

pytestmark = pytest.mark.xdist_group("plot")  # what its fixtures make serves one worker

STUDY = synthetic_study(2, contacts=40, rows=(3,), loadings=("stretch", "shear"))
SVG = "{http://www.w3.org/2000/svg}"
LINK = "{http://www.w3.org/1999/xlink}href"


@pytest.fixture(scope="module")
def gallery(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("figures")
    assert set(save_figures(STUDY, folder)) == set(FIGURES)
    return folder


@pytest.mark.parametrize("name", FIGURES)
def test_files_are_valid_and_self_contained(gallery: Path, name: str) -> None:
    assert (gallery / f"{name}.png").read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    root = ElementTree.parse(gallery / f"{name}.svg").getroot()
    assert root.tag == f"{SVG}svg"
    for element in root.iter():
        assert element.get(LINK, "#").startswith(("#", "data:image/png;base64,"))
    assert (gallery / f"{name}.svg").stat().st_size < 2_000_000


def test_same_study_gives_the_same_files(gallery: Path, tmp_path: Path) -> None:
    for name in ("cell", "network"):
        for file in save(FIGURES[name](STUDY), tmp_path, name):
            assert file.read_bytes() == (gallery / file.name).read_bytes()


def test_nothing_global_is_touched() -> None:
    before, digest = dict(mpl.rcParams), Digests()(STUDY)
    for name in ("cell", "section", "currents", "network"):
        FIGURES[name](STUDY)
    assert dict(mpl.rcParams) == before
    assert Digests()(STUDY) == digest
    code = "import sys, circuittex.results.plot; assert 'matplotlib.pyplot' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0


def test_camera_keeps_lengths_and_looks_along_its_axis() -> None:
    view = camera(-62.0, 38.0)
    np.testing.assert_allclose(view.frame @ view.frame.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(view.frame) == pytest.approx(1.0)
    assert view.project(np.array([0.0, 0.0, 1.0]))[1] > 0.0  # up is up


def crossing(height: float) -> tuple[FibrilMesh, Floats]:
    """Two straight fibrils that cross at right angles; the second lies `height` above the first."""
    mesh = fibrils([4.0, 4.0], elements=8)
    x = initial_configuration(mesh).x.copy()
    second = mesh.node_fibril == 1
    x[second, 0] = np.stack([2.0 + 0 * mesh.xi[second], mesh.xi[second] - 2.0, height + 0 * mesh.xi[second]], axis=1)
    x[second, 1] = [-1.0, 0.0, 0.0]
    return mesh, x


@pytest.mark.parametrize("height", [0.3, -0.3])
def test_the_upper_fibril_hides_the_lower(height: float) -> None:
    mesh, x = crossing(height)
    figure = Figure(figsize=(2.0, 2.0), dpi=100)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    colours = ScalarMappable(Normalize(0.0, 1.0), "gray")
    values = np.where(np.repeat([0, 1], 8) == 1, 1.0, 0.4)
    draw_tubes(axes, mesh, x, values, colours, camera(-90.0, 90.0), 400)
    axes.set(xlim=(0.0, 4.0), ylim=(-2.0, 2.0))
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., 0]
    middle = pixels.shape[0] // 2

    def brightest(piece: np.ndarray) -> float:
        return float(piece.max())

    at_crossing = brightest(pixels[middle - 2 : middle + 3, middle - 2 : middle + 3])
    first = brightest(pixels[middle - 2 : middle + 3, middle // 2])
    second = brightest(pixels[middle // 2, middle - 2 : middle + 3])
    assert first < 0.6 * second
    assert at_crossing == pytest.approx(second if height > 0.0 else first, abs=3)


@pytest.mark.parametrize("slope", [0.0, 0.75])
def test_cut_across_is_an_ellipse(slope: float) -> None:
    mesh = fibrils([4.0], elements=8)
    tangent = np.array([1.0, 0.0, slope]) / np.hypot(1.0, slope)
    x = initial_configuration(mesh).x.copy()
    x[:, 0] = mesh.xi[:, None] * tangent
    x[:, 2] = np.cross(tangent, [0.0, 1.0, 0.0])
    pieces = cut(mesh, x, 0, 1.3)
    (outline,) = pieces.across
    y, z = outline[:, 0], outline[:, 1] - 1.3 * slope
    # Semi-axes R and R / cos of the inclination; the surface between nodes is straight here, so this is exact.
    np.testing.assert_allclose((y / 0.15) ** 2 + (z / (0.15 * np.hypot(1.0, slope))) ** 2, 1.0, rtol=1e-12)
    assert pieces.along == ()


@pytest.mark.parametrize(("distance", "half"), [(0.0, 0.15), (0.09, 0.12)])
def test_cut_along_is_a_strip(distance: float, half: float) -> None:
    mesh = fibrils([4.0], elements=8)
    pieces = cut(mesh, initial_configuration(mesh).x, 1, distance)
    (outline,) = pieces.along
    assert len(pieces.across) == 0
    np.testing.assert_allclose(np.abs(outline[:, 1]), half, rtol=1e-12)
    assert outline[:, 0].min() == 0.0
    assert outline[:, 0].max() == 4.0
    assert cut(mesh, initial_configuration(mesh).x, 1, 0.16).along == ()


def test_section_shows_as_many_circles_as_fibrils() -> None:
    for axis, place in ((0, -1.0), (1, -1.0)):
        pieces = cut(STUDY.mesh, STUDY.initial.x, axis, place)
        assert np.array_equal(pieces.across_fibril, np.flatnonzero(STUDY.mesh.yarn_axis[STUDY.mesh.yarn] == axis))
        assert set(STUDY.mesh.yarn[pieces.along_fibril]) == {5 if axis == 0 else 1}  # weft2 or warp2
    assert [axes.get_xlabel() for axes in section_figure(STUDY, STUDY.records[0]).axes[2:]] == [
        "y (mm), across warp2",
        "x (mm), along warp2",
    ]


def test_every_loading_starts_at_the_relaxed_state() -> None:
    loadings = by_loading(STUDY)
    assert list(loadings) == ["stretch", "shear"]
    assert [record.name for record in loadings["shear"]] == ["relaxed", "shear-0.0250"]
    assert list(by_loading(replace(STUDY, records=STUDY.records[:1]))) == [""]


def with_strains(strains: tuple[float, ...]) -> Study:
    """One loading with these strains after the relaxed state, forces as large as the strain."""
    rest, some = STUDY.records[:2]
    states = [replace(some, name=f"cycle-{i}", loading="cycle", strain=e) for i, e in enumerate(strains)]
    return replace(STUDY, records=(rest, *(replace(r, clamp_force=np.full((2, 3), r.strain)) for r in states)))


def test_a_loading_has_come_farthest_before_it_turns_back() -> None:
    cycle = by_loading(with_strains((0.1, 0.2, 0.1, 0.2, 0.0)))["cycle"]
    assert farthest(cycle).name == "cycle-1"
    assert turns([record.strain for record in cycle]) == [2, 3, 4]
    compressed = by_loading(with_strains((0.1, -0.3)))["cycle"]
    assert farthest(compressed).strain == -0.3


def test_forces_of_every_loading_and_direction_have_a_panel() -> None:
    panels = force_figure(STUDY).axes
    assert [axes.get_title() for axes in panels] == [
        f"{loading}: {clamps}"
        for loading in ("stretch", "shear")
        for clamps in ("warp clamps, +x ends", "weft clamps, +y ends")
    ]
    drawn = {line.get_label(): line.get_ydata() for line in panels[3].lines}
    assert list(drawn["Fy"]) == [STUDY.records[0].clamp_force[1, 1], STUDY.records[2].clamp_force[1, 1]]
    labels = [str(line.get_label()) for line in network_figure(synthetic_study(2, contacts=4)).axes[0].lines]
    assert labels[-1] == f"insulated, {INSULATED:.4g} Ω"


def test_one_colour_for_each_probe_and_one_line_for_each_loading() -> None:
    panels = conductance_figure(STUDY).axes
    lines = [[line for line in axes.lines if not str(line.get_label()).startswith("_")] for axes in panels]
    assert [[line.get_label() for line in panel] for panel in lines] == [["stretch", "shear"]] * 3
    colours = [{line.get_color() for line in panel} for panel in lines]
    assert [len(colour) for colour in colours] == [1, 1, 1]
    assert len(set.union(*colours)) == 3
    assert list(lines[2][1].get_ydata()) == [STUDY.records[0].currents[2], STUDY.records[2].currents[2]]


def test_the_way_back_is_marked() -> None:
    figure = force_figure(with_strains((0.1, 0.2, 0.1, 0.0)))
    marks = [line for line in figure.axes[0].lines if line.get_label() not in ("Fx", "Fy", "Fz")]
    outwards, back = marks[0], marks[1]
    assert list(outwards.get_xdata()) == [0.0, 0.1, 0.2]
    assert list(back.get_xdata()) == [0.1, 0.0]
    assert back.get_markerfacecolor() == "white"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["strain growing", "on the way back"]
    assert force_figure(STUDY).legends == []


def estimate(study: Study, state: str, error: float) -> ErrorEstimate:
    """An estimate of this relative error for every quantity of a state."""
    record = next(record for record in study.records if record.name == state)
    names = ("Fx warp", "Fy weft", *(f"I {probe.name}" for probe in study.design.probes), "Ry", "Rc")
    force, fit = record.clamp_force, record.fit
    values = (force[0, 0], force[1, 1], *record.currents, fit.Ry, fit.Rc)
    quantities = []
    for name, value in zip(names, values, strict=True):
        away = (1.0 + 0.6 * error) * value  # the contact part 1.25 * 4 / 3 of that is all: the mesh changes nothing
        quantities.append(QuantityError(name, "", float(value), float(value), float(value), float(away)))
    return ErrorEstimate(state, (1, 2, 4), (4, 8), np.zeros(3), tuple(quantities), ())


def bars(axes: Axes) -> list[tuple[float, float, float]]:
    """Strain, lower and upper end of every error bar drawn, in the order of drawing, each once."""
    lines = [line for line in axes.lines if line.get_zorder() == 1.9 and len(line.get_xdata()) == 2]
    found = ((line.get_xdata()[0], *line.get_ydata()) for line in lines)
    return list(dict.fromkeys(tuple(map(float, bar)) for bar in found))


def heads(axes: Axes) -> list[bool]:
    """For each end of each error bar whether it is an arrow head, not a cap."""
    ends = [line for line in axes.lines if line.get_zorder() == 1.9 and len(line.get_xdata()) == 1]
    return [line.get_marker() != "_" for line in ends]


def test_error_bars_are_at_the_states_and_on_the_curves_that_have_an_estimate() -> None:
    errors = tuple(estimate(STUDY, name, 0.02) for name in ("relaxed", "stretch-0.0250"))
    study = replace(STUDY, errors=errors)
    rest, stretched, _ = STUDY.records

    def expected(*values: tuple[float, float]) -> list[tuple[float, float, float]]:
        return [(strain, pytest.approx(0.98 * value), pytest.approx(1.02 * value)) for strain, value in values]

    warp, shear_warp, weft, shear_weft = (force_figure(study).axes[k] for k in (0, 2, 1, 3))
    for axes, side in ((warp, 0), (weft, 1)):
        assert bars(axes) == expected((0.0, rest.clamp_force[side, side]), (0.025, stretched.clamp_force[side, side]))
        assert {line.get_color() for line in axes.lines if line.get_zorder() == 1.9} == {COLOURS[side]}
    assert bars(shear_warp) == expected((0.0, rest.clamp_force[0, 0]))
    assert bars(shear_weft) == expected((0.0, rest.clamp_force[1, 1]))
    for number, axes in enumerate(conductance_figure(study).axes):
        assert bars(axes) == expected((0.0, rest.currents[number]), (0.025, stretched.currents[number]))
    left, right = network_figure(study).axes
    assert bars(left) == expected((0.0, rest.fit.Ry), (0.025, stretched.fit.Ry))
    assert bars(right) == expected((0.0, rest.fit.Rc), (0.025, stretched.fit.Rc))
    for axes in (*force_figure(study).axes, left):
        assert not any(heads(axes))


def test_no_error_bar_where_the_error_is_not_known() -> None:
    unknown = estimate(STUDY, "relaxed", nan)
    for figure in (force_figure, conductance_figure, network_figure):
        drawn, without = figure(replace(STUDY, errors=(unknown,))), figure(STUDY)
        for axes, other in zip(drawn.axes, without.axes, strict=True):
            assert bars(axes) == []
            assert axes.get_ylim() == other.get_ylim()


@pytest.mark.parametrize(("error", "cut"), [(0.02, False), (5.0, True), (1e4, True)])
def test_long_error_bars_leave_a_third_of_the_height_to_the_curve(error: float, cut: bool) -> None:
    study = replace(STUDY, errors=(estimate(STUDY, "stretch-0.0250", error),))
    axes, without = force_figure(study).axes[0], force_figure(STUDY).axes[0]
    (low, high), (first, last) = axes.get_ylim(), without.get_ylim()
    assert low <= first
    assert high >= last
    assert high - low <= 3.0 * (last - first) * (1 + 1e-9)
    ((_, lower, upper),) = bars(axes)
    value = STUDY.records[1].clamp_force[0, 0]
    assert heads(axes) == [cut, cut]
    assert (lower, upper) == ((low, high) if cut else pytest.approx(((1 - error) * value, (1 + error) * value)))
    assert [text.get_text() for text in axes.texts] == ([f"±{float(f'{error * value:.2g}'):g}"] if cut else [])


def test_the_error_of_one_value_alone_is_shown_whole() -> None:
    lone = replace(STUDY, records=STUDY.records[:1], errors=(estimate(STUDY, "relaxed", 0.5),))
    axes = conductance_figure(lone).axes[0]
    value = STUDY.records[0].currents[0]
    assert bars(axes) == [(0.0, pytest.approx(value / 2), pytest.approx(1.5 * value))]
    assert heads(axes) == [False, False]
    assert axes.get_ylim()[0] < value / 2
    assert axes.get_ylim()[1] > 1.5 * value


def test_a_cycle_that_closes_names_its_cut_error_once() -> None:
    cycle = with_strains((0.1, 0.2, 0.1, 0.0))
    errors = (estimate(STUDY, "relaxed", 1e3), replace(estimate(STUDY, "relaxed", 1e3), state="cycle-3"))
    figure = conductance_figure(replace(cycle, errors=errors))
    assert [len(axes.texts) - len(conductance_figure(cycle).axes[0].texts) for axes in figure.axes] == [1, 1, 1]


def test_legends_name_error_bars_once_and_panels_only_their_curves() -> None:
    cycle = with_strains((0.1, 0.2, 0.1, 0.0))
    figure = force_figure(replace(cycle, errors=(estimate(cycle, "relaxed", 0.1),)))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        *("strain growing", "on the way back", "estimated discretisation error"),
    ]
    for axes in figure.axes:
        legend = axes.get_legend()
        assert legend is not None
        assert [text.get_text() for text in legend.get_texts()] == ["Fx", "Fy", "Fz"]
    (key,) = network_figure(replace(STUDY, errors=(estimate(STUDY, "relaxed", 0.1),))).legends[0].get_texts()
    assert key.get_text() == "estimated discretisation error"


def test_every_probe_of_every_loading_has_a_picture_of_one_scale() -> None:
    panels = [axes for axes in probe_figure(STUDY, STUDY.records[1:], "current").axes if axes.get_title()]
    assert [axes.get_title().split("\n")[0] for axes in panels] == [
        f"{record.name}, probe {probe.name}" for record in STUDY.records[1:] for probe in STUDY.design.probes
    ]
    sizes = {(round(np.ptp(axes.get_xlim()), 9), round(np.ptp(axes.get_ylim()), 9)) for axes in panels}
    assert len(sizes) == 1


def test_strained_cells_are_those_of_the_largest_strain() -> None:
    titles = [axes.get_title() for axes in strained_figure(STUDY).axes]
    assert [title for title in titles if title] == ["stretch-0.0250: section force", "shear-0.0250: section force"]


def test_all_axes_of_curves_have_units() -> None:
    for name in ("forces", "probes", "network"):
        for axes in FIGURES[name](STUDY).axes:
            assert axes.get_xlabel().startswith("strain")
            assert axes.get_ylabel().endswith(")")


@pytest.mark.parametrize("name", FIGURES)
def test_figures_of_a_study_without_loading(name: str) -> None:
    assert isinstance(FIGURES[name](replace(STUDY, records=STUDY.records[:1])), Figure)


def test_study_without_probes_has_no_figures_of_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("cell", "section", "strained", "verification"):  # these take long
        monkeypatch.delitem(FIGURES, name)
    bare = replace(
        STUDY,
        design=replace(STUDY.design, probes=()),
        records=tuple(replace(record, fields=()) for record in STUDY.records),
    )
    assert set(save_figures(bare, tmp_path)) == {"forces"}


def test_study_without_loading_has_no_strained_cells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in set(FIGURES) - {"forces", "strained"}:  # the others take long
        monkeypatch.delitem(FIGURES, name)
    assert set(save_figures(replace(STUDY, records=STUDY.records[:1]), tmp_path)) == {"forces"}


def test_fields_without_any_current() -> None:
    record = STUDY.records[0]
    silent = tuple(
        replace(f, segment_current=0 * f.segment_current, temperature=0 * f.temperature) for f in record.fields
    )
    for quantity in ("current", "temperature"):
        figure = probe_figure(STUDY, (replace(record, fields=silent),), quantity)
        with style():
            figure.draw_without_rendering()


def test_pictures_are_drawn_at_any_size() -> None:
    """A cell a hundred times smaller: arrows, marks and margins shrink with it, and strains stand apart."""

    def shrunk(study: Study, by: float) -> Study:
        mesh = replace(study.mesh, length=by * study.mesh.length, radius=by * study.mesh.radius)
        records = []
        for record in study.records:
            x = record.configuration.x.copy()
            x[:, 0] *= by
            records.append(replace(record, configuration=Configuration(x), strain=by * record.strain))
        return replace(study, mesh=mesh, records=tuple(records))

    small = shrunk(STUDY, 0.01)
    for name in ("cell", "currents"):
        large, little = (FIGURES[name](study).axes[0] for study in (STUDY, small))
        assert np.ptp(little.get_xlim()) == pytest.approx(0.01 * np.ptp(large.get_xlim()), rel=1e-3)
    assert "0.01 mm" in [text.get_text() for text in FIGURES["cell"](small).axes[0].texts]
    figure = conductance_figure(small)
    figure.canvas.draw()
    for axes in figure.axes:
        boxes = [label.get_window_extent() for label in axes.get_xticklabels() if label.get_text()]
        assert all(left.x1 < right.x0 for left, right in pairwise(boxes))
