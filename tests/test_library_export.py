"""What an export refuses, warns of and says of itself; paths, interpolation, errors and ratings by themselves."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from library_cases import CARD, study

from circuittex.base.errors import CircuitError, CircuittexWarning, DesignError, StoreError
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.electrical.network.ports import PortMatrix, resistances
from circuittex.results.heating import rated_currents
from circuittex.results.store import write_study_start
from circuittex.study.library.accuracy import compared
from circuittex.study.library.cell import Cell, Pin
from circuittex.study.library.export import export_library
from circuittex.study.library.interpolation import pieces, value, without
from circuittex.study.library.members import complete_members, is_ensemble
from circuittex.study.library.network import Network, farthest, floating, ports_network
from circuittex.study.library.parts import pins
from circuittex.study.library.strain_path import branches
from circuittex.study.library.subcircuit import library_text
from circuittex.study.library.thinning import thinned


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"state": "stretched"}, "state: 'stretched'.*recorded states: relaxed, stretch-0.025"),
        ({"ends": "loose"}, "ends: 'loose'.*crimped, free"),
        ({"thin": 1.0}, "thin: 1.0.*less than 1"),
        ({"thin": float("nan")}, "thin: nan"),
        ({"rise": 0.0}, "rise: 0.0.*> 0 K"),
        ({"dialects": ("pspice",)}, "dialects: 'pspice'.*ngspice, ltspice"),
    ],
)
def test_arguments_that_cannot_be_used(given: dict[str, object], said: str, tmp_path: Path) -> None:
    with pytest.raises(DesignError, match=said):
        export_library(study(2), tmp_path, **given)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_a_study_without_states_is_refused(tmp_path: Path) -> None:
    with pytest.warns(CircuittexWarning, match="not finished"), pytest.raises(CircuitError, match="no recorded state"):
        export_library(replace(study(2), records=()), tmp_path)


def test_a_study_of_one_state_has_no_strain_and_says_so(tmp_path: Path) -> None:
    with pytest.warns(CircuittexWarning, match="one state: strain is no input"):
        cells = export_library(study(1), tmp_path, dialects=("ngspice",))
    assert {cell.name for cell in cells} <= {"fabric_detailed", "fabric_ports", "fabric_cell", "fabric_unit"}


def test_missing_states_are_named_and_the_others_used(tmp_path: Path) -> None:
    whole = study(4)
    with pytest.warns(CircuittexWarning, match=r"not finished: without shear-0.05, shear-0.075 "):
        cells = export_library(replace(whole, records=whole.records[:5]), tmp_path, dialects=("ngspice",))
    assert any("shear" in cell.name for cell in cells)


def test_yarns_that_do_not_conduct_are_no_library(tmp_path: Path) -> None:
    cut = study(1)
    none = PortMatrix(("warp1_minus", "warp1_plus"), np.zeros((2, 2)))
    cut = replace(cut, records=(replace(cut.records[0], ports=none),))
    with pytest.warns(CircuittexWarning), pytest.raises(CircuitError, match="no current passes"):
        export_library(cut, tmp_path)


def test_an_ensemble_gives_corners_of_its_complete_members(tmp_path: Path) -> None:
    whole = study(2)
    for number, made in enumerate((replace(whole, records=whole.records[:1]), whole, whole)):
        folder = tmp_path / "members" / f"{number:04d}"
        folder.mkdir(parents=True)
        write_study_start(folder / "results.h5", made)
    assert is_ensemble(tmp_path)
    assert len(list(complete_members(tmp_path))) == 2
    assert main(["export", str(tmp_path), "--out", str(tmp_path / "lib")]) == ExitCode.DONE
    written = {path.stem for path in (tmp_path / "lib" / "ngspice").iterdir()}
    assert {"fabric_ports_p05", "fabric_ports_p95_shear_v", "fabric_ports_mc_stretch_s"} <= written
    page = (tmp_path / "lib" / "datasheet.html").read_text("utf-8")
    assert "Corners and Monte Carlo" not in page
    assert "of 2 packings" in page


def test_an_ensemble_without_a_complete_member_is_refused(tmp_path: Path) -> None:
    (tmp_path / "members").mkdir()
    with pytest.raises(StoreError, match="no member of the ensemble has all its states"):
        next(complete_members(tmp_path))


def test_free_ends_have_the_terminals_as_pins(tmp_path: Path) -> None:
    with pytest.warns(CircuittexWarning, match=r"no cell of Ry and Rc: its pins are yarn ends"):
        cells = export_library(study(2), tmp_path, ends="free", dialects=("ngspice",))
    names = {cell.name: [pin.name for pin in cell.pins] for cell in cells}
    assert names["fabric_free_ports"] == [terminal.name for terminal in study(2).design.terminals]
    assert {"fabric_free_detailed", "fabric_free_ports_stretch_v"} <= set(names)


def test_no_two_nodes_or_devices_share_a_name() -> None:
    """Terminals called like what drives strain, like the inside of a cell, or so that their pairs look alike."""
    names = ["strain", "Out of range", "strain_used", "log_1", "a", "b_c", "a_b", "c", "log", "1"]
    matrix = PortMatrix(tuple(names), 10.0 * np.eye(10) - np.ones((10, 10)))
    other = replace(matrix, conductance=matrix.conductance * np.linspace(1, 2, 10) * np.linspace(1, 2, 10)[:, None])
    network = ports_network([matrix, other], np.array([0.0, 0.1]))
    made = study(1).design
    electrical = pins(made, network)
    control = (Pin("strain", "bottom", "control"), Pin("out_of_range", "bottom", "flag"))
    cell = Cell("x", "ports", "", (*electrical, *control), (), "ngspice/x.lib", "ngspice")
    text = library_text(cell, network, [])
    (card,) = CARD.findall(text)
    words = card[1].split()
    assert len(set(words)) == len(words) == 12
    cards = [line.split()[:3] for line in text.splitlines() if line[0] in "BR"]
    assert len({name for name, *_ in cards}) == len(cards) > 90
    inner = {plus for name, plus, minus in cards if minus == "0"} - {"strain", "out_of_range"}
    assert not inner & set(words)
    assert len(inner) == np.unique(network.conductance, axis=1).shape[1] + 1


def test_parts_that_float_are_found() -> None:
    ends = (("a", "x"), ("x", "b"), ("d", "c"))
    network = Network(("a", "b", "c", "d", "e"), ("1", "2", "3"), ends, np.zeros(1), np.ones((1, 3)))
    assert floating(network, "b") == ("c", "e")


def test_examples_measure_between_pins_that_are_joined_and_far_apart() -> None:
    """Of two ways of 1 and 3 ohm; 'z', the first pin, leads nowhere, and 'a' is not joined with all."""
    ends = (("a", "b"), ("b", "x"), ("x", "c"), ("d", "e"))
    network = Network(("z", "a", "b", "c", "d", "e"), ("1", "2", "3", "4"), ends, np.zeros(1), np.ones((1, 4)))
    (source, sink), ohm = farthest(network)
    assert (source, sink) == ("a", "c")
    assert ohm == pytest.approx(3.0)


def test_command_line_and_datasheet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results = tmp_path / "results"
    results.mkdir()
    write_study_start(results / "results.h5", replace(study(3), design=replace(study(3).design, name="<b> & weave")))
    assert main(["export", str(results), "--out", str(tmp_path / "lib"), "--name", "Jacket 7"]) == ExitCode.DONE
    assert "sub-circuits in" in capsys.readouterr().out
    listed = json.loads((tmp_path / "lib" / "library.json").read_text("ascii"))
    assert listed["design"] == "<b> & weave"
    assert all(cell["name"].startswith("jacket_7_") for cell in listed["cells"])
    page = (tmp_path / "lib" / "datasheet.html").read_text("utf-8")
    assert "&lt;b&gt; &amp; weave" in page
    assert page.count("data:image/png") == 3
    assert f"Recommended: {listed['recommended']}" in page
    assert main(["export", str(tmp_path / "none"), "--out", str(tmp_path / "lib")]) == ExitCode.FILES


@pytest.mark.parametrize(
    ("strain", "found"),
    [
        ([0.0, 0.1, 0.2], [[0, 1, 2]]),
        ([0.0, -0.1], [[0, 1]]),
        ([0.0, 0.1, 0.2, 0.1, 0.0], [[0, 1, 2], [2, 3, 4]]),
        ([0.0, 0.1, 0.0, 0.1], [[0, 1], [1, 2], [2, 3]]),
    ],
)
def test_a_history_falls_into_ways_there_and_back(strain: list[float], found: list[list[int]]) -> None:
    assert [way.tolist() for way in branches(strain)] == found


def test_an_exponential_is_interpolated_exactly_and_held_beyond() -> None:
    """log g is linear in strain: PCHIP follows straight lines."""
    strain = np.array([-0.1, 0.0, 0.07, 0.25])
    g = np.exp(np.outer(strain, [3.0, -40.0]) - [1.0, 7.0])
    found = pieces(strain, g)
    for x in (-0.1, -0.03, 0.01, 0.2, 0.25):
        np.testing.assert_allclose(value(found, x), np.exp(x * np.array([3.0, -40.0]) - [1.0, 7.0]), rtol=1e-12)
    np.testing.assert_allclose(value(found, 9.0), g[-1], rtol=1e-12)
    np.testing.assert_allclose(value(found, -9.0), g[0], rtol=1e-12)
    np.testing.assert_allclose(without(strain, g, 2), g[2], rtol=1e-12)


@given(st.lists(st.floats(-15.0, 5.0), min_size=3, max_size=6), st.floats(0.0, 1.0))
def test_between_two_samples_a_conductance_is_between_theirs(logs: list[float], place: float) -> None:
    strain = np.linspace(0.0, 0.2, len(logs))
    g = np.exp(np.array(logs))[:, None]
    x = place * 0.2
    k = min(int(place * (len(logs) - 1)), len(logs) - 2)
    (found,) = value(pieces(strain, g), x)
    low, high = sorted(g[k : k + 2, 0])
    assert low * (1 - 1e-9) <= found <= high * (1 + 1e-9)


def random_matrix(seed: int, size: int) -> PortMatrix:
    """A port matrix with conductances over six decades, some missing."""
    rng = np.random.default_rng(seed)
    g = np.triu(10.0 ** rng.uniform(-6, 0, (size, size)) * (rng.random((size, size)) < 0.7), 1)
    g[np.arange(size - 1), np.arange(1, size)] += 1e-5  # joined all
    g = g + g.T
    return PortMatrix(tuple(f"p{k}" for k in range(size)), np.diag(g.sum(axis=1)) - g)


@given(st.integers(0, 10_000), st.integers(3, 8), st.sampled_from([1e-4, 1e-2, 0.3]))
def test_thinning_keeps_its_bound_and_passivity(seed: int, size: int, error: float) -> None:
    given = [random_matrix(seed, size), random_matrix(seed + 1, size)]
    for before, after in zip(given, thinned(given, error), strict=True):
        G = after.conductance
        assert (G - np.diag(np.diag(G)) <= 0.0).all()
        np.testing.assert_allclose(G.sum(axis=1), 0.0, atol=1e-14)
        there = ~np.eye(size, dtype=bool)
        rise = resistances(after)[there] / resistances(before)[there] - 1.0
        assert rise.min() > -1e-12
        assert rise.max() <= error


@given(st.integers(0, 10_000), st.integers(3, 8), st.floats(1e-6, 10.0))
def test_a_conductor_more_never_raises_a_resistance(seed: int, size: int, siemens: float) -> None:
    before = random_matrix(seed, size)
    G = before.conductance.copy()
    G[:2, :2] += siemens * np.array([[1.0, -1.0], [-1.0, 1.0]])
    assert (resistances(replace(before, conductance=G)) <= resistances(before) * (1 + 1e-12)).all()


def test_errors_are_those_of_two_resistors() -> None:
    """R = 2, 3 against 2.2, 3.6 ohm: errors 10 % and 20 %; change 50 % against 7/11, an error of 3/11."""

    def pair(ohm: float) -> PortMatrix:
        return PortMatrix(("a", "b"), np.array([[1.0, -1.0], [-1.0, 1.0]]) / ohm)

    found = compared([pair(2.0), pair(3.0)], [pair(2.2), pair(3.6)])
    assert found.worst == pytest.approx((0.2, 3.0 / 11.0))
    assert found.median == pytest.approx((0.15, 3.0 / 11.0))
    still = compared([pair(2.0), pair(2.01)], [pair(2.0), pair(2.5)])
    assert np.isnan(still.worst[1]), "a change of 0.5 % does not count"


def test_the_rated_current_makes_the_stated_rise() -> None:
    """At a rise like the probe's own the rated current is the probe's; four times the rise wants twice the current."""
    made = study(1)
    fields = made.records[0].fields[0]
    assert rated_currents(made, fields.peak_temperature)[0, 0] == pytest.approx(abs(fields.currents[0]))
    np.testing.assert_allclose(rated_currents(made, 40.0), 2.0 * rated_currents(made, 10.0))
