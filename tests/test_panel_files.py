"""Panel files: what they state, what is refused in which words, strain maps, results of studies, and the command."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
from PIL import Image
from synthetic_study import synthetic_study

from circuittex.base.errors import CircuitError, CircuittexError, DesignError
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.electrical.network.circuit import reduced_circuit
from circuittex.electrical.network.ports import PortMatrix, port_matrix
from circuittex.electrical.spice.ngspice import run_deck
from circuittex.results.store import write_study_start
from circuittex.study.panel.cells import CellResistances, cells_of_study, local_resistances
from circuittex.study.panel.formula import evaluate
from circuittex.study.panel.maps import read_image
from circuittex.study.panel.output import write_panel
from circuittex.study.panel.reader import load_panel, parse_panel
from circuittex.study.panel.solution import solve_panel
from circuittex.study.panel.statement import MOST_CELLS, Electrode, Panel

SMALL = """
format = 1
name = "small panel"
gradients = [["left", "pad"]]

[panel]
warp = 6
weft = 8
pitch = "2 mm"
insulating = ["weft8"]

[resistance]
strain = [0, "10 %"]
warp = ["0.28 ohm", "0.3 ohm"]
weft = ["280 mohm", 0.3]
crossing = [3, 2]

[strain]
formula = "0.05 * (1 + x / 16)"

[[cuts]]
line = [[4, 0], [4, 5]]

[[seams]]
crossings = [[1, 1], [2, 2]]
resistance = "0.5 ohm"

[electrodes.left]
edge = "left"
voltage = "5 V"

[electrodes.pad]
rectangle = [9, 5, 13, 9]
voltage = 0

[electrodes.tap]
ends = ["weft2..3+"]
current = "-10 mA"

[electrodes.sense]
ends = ["warp6+"]
"""
ROUNDING = 1e-12


def stated(text: str = SMALL, folder: Path = Path()) -> Panel:
    return parse_panel(tomllib.loads(text), folder)[0]


def changed(old: str, new: str) -> str:
    assert old in SMALL
    return SMALL.replace(old, new)


def test_a_panel_file_says_what_python_says() -> None:
    panel, pairs = parse_panel(tomllib.loads(SMALL), Path())
    assert pairs == (("left", "pad"),)
    assert (panel.shape, panel.pitch, panel.insulating) == ((6, 8), 2.0, ("weft8",))
    assert panel.cells.weft.ravel().tolist() == [0.28, 0.3]
    assert [(each.voltage, each.current) for each in panel.electrodes] == [
        *[(5.0, None), (0.0, None)],
        *[(None, -0.01), (None, None)],
    ]
    np.testing.assert_allclose(panel.strain[3], 0.05 * (1.0 + (2.0 * np.arange(8) + 1.0) / 16.0), rtol=ROUNDING)


# What is refused: (old text, new text, what the message must say)

REFUSED = [
    ("warp = 6", "warp = 0", ["panel.warp: 0", "from 1"]),
    ("warp = 6\nweft = 8", "warp = 30000\nweft = 40000", ["panel", "30000 x 40000 cells", str(MOST_CELLS)]),
    ("warp = 6", "warp = 6.5", ["panel.warp: 6.5", "whole number"]),
    ("warp = 6", "warp = 1000000000", ["panel.warp: 1000000000", f"from 1 to {MOST_CELLS}"]),
    ('pitch = "2 mm"', 'pitch = "-2 mm"', ["panel.pitch: -2.0", "> 0 mm"]),
    ('pitch = "2 mm"', "", ["panel.pitch", "the key is missing"]),
    ('"weft8"', '"weft9"', ["panel.insulating[0]: 'weft9'", "weft1 to weft8"]),
    ('"weft8"', '"weave8"', ["panel.insulating[0]: 'weave8'", "written like 'warp3'"]),
    ("crossing = [3, 2]", "crossing = [3, 2, 1]", ["resistance.crossing", "one for each strain"]),
    ("crossing = [3, 2]", "crossing = [3, -2]", ["resistance.crossing: -2.0", "inf where nothing conducts"]),
    ("crossing = [3, 2]", 'crossing = [3, "inf"]', ["resistance.crossing: inf", "at every strain"]),
    ("crossing = [3, 2]", "crossing = [3, 2]\ncrossin = 1", ["resistance.crossin", "did you mean 'crossing'"]),
    ('strain = [0, "10 %"]', "strain = [0.1, 0]", ["resistance.strain", "rising strains"]),
    ("0.05 * (1", "0.5 * (1", ["strain: ", "known from 0 to 0.1", "outside = 'clamp'"]),
    ("0.05 * (1 + x / 16)", "0.05 * z", ["strain.formula", "x, y"]),
    ("0.05 * (1 + x / 16)", "1 / (y - y)", ["strain.formula", "finite everywhere; 48 values"]),
    ("0.05 * (1 + x / 16)", "open('f')", ["strain.formula", "may consist of x, y"]),
    ('formula = "0.05 * (1 + x / 16)"', 'file = "none.npy"', ["strain.file", "there is no such file"]),
    ('formula = "0.05 * (1 + x / 16)"', "uniform = 0.1\nformula = '0'", ["strain", "one of uniform, formula"]),
    ("line = [[4, 0], [4, 5]]", "line = [[4, 0], [4, 0]]", ["cuts", "its ends must differ"]),
    ("line = [[4, 0], [4, 5]]", "line = [[4, 0], [4]]", ["cuts", "[[x0, y0], [x1, y1]]"]),
    ("line = [[4, 0], [4, 5]]", "", ["cuts", "either a line or a rectangle"]),
    ("line = [[4, 0], [4, 5]]", "line = [[40, 0], [41, 5]]", ["cuts[0]", "beside the panel", "(0, 0) to (16, 12) mm"]),
    ("line = [[4, 0], [4, 5]]", "rectangle = [-5, 0, -1, 5]", ["cuts[0]", "beside the panel"]),
    ("crossings = [[1, 1], [2, 2]]", "rectangle = [50, 50, 60, 60]", ["seams[0].rectangle", "beside the panel"]),
    ("0.05 * (1 + x / 16)", "9^9^9^9 * x", ["strain.formula", "needs parentheses", "programs disagree"]),
    ("crossings = [[1, 1], [2, 2]]", "crossings = [[1, 9]]", ["seams.crossings: [1, 9]", "weft1 to weft8"]),
    ('resistance = "0.5 ohm"', "resistance = 0", ["seams.resistance: 0.0", "> 0 ohm"]),
    ('edge = "left"', 'edge = "west"', ["electrodes.left.edge: 'west'", "'left', 'right', 'bottom', 'top'"]),
    ('voltage = "5 V"', 'voltage = "5 A"', ["electrodes.left.voltage", "5 A"]),
    ('voltage = "5 V"', 'voltage = "5 V"\ncurrent = 1', ["electrodes.left.current", "not both"]),
    ("rectangle = [9, 5, 13, 9]", "rectangle = [9, 5, 9, 9]", ["electrodes.pad.rectangle", "must differ"]),
    ("rectangle = [9, 5, 13, 9]", "rectangle = [90, 5, 93, 9]", ["electrodes.pad.rectangle", "(0, 0) to (16, 12) mm"]),
    ("rectangle = [9, 5, 13, 9]", 'ends = ["warp2-"]', ["electrodes.pad", "'left' touches the same place"]),
    ('ends = ["weft2..3+"]', 'ends = ["weft2..3"]', ["electrodes.tap.ends: 'weft2..3'", "an end is written like"]),
    ('ends = ["weft2..3+"]', 'ends = ["weft8+"]', ["electrodes.tap.ends: 'weft8+'", "weft8 is insulating"]),
    ('ends = ["weft2..3+"]', 'ends = ["weft3..2+"]', ["electrodes.tap.ends: 'weft3..2+'", "weft1 to weft8"]),
    ("line = [[4, 0], [4, 5]]", "line = [[15.5, 0], [15.5, 12]]", ["electrodes.sense.ends: 'warp6+'", "cut off"]),
    ('[["left", "pad"]]', '[["left", "right"]]', ["gradients[0]: 'right'", "left, pad, tap, sense"]),
    ("format = 1", "format = 2", ["format: 2", "format = 1"]),
    ("[panel]", "[pannel]", ["pannel", "did you mean 'panel'"]),
    ("[electrodes.sense]", "[electrodes.Left]", ["electrodes: 'Left'", "taken by 'left'"]),
    ("[electrodes.sense]", '[electrodes."a b"]', ["electrodes", "a name is a letter"]),
]


@pytest.mark.parametrize(("old", "new", "words"), REFUSED, ids=lambda each: str(each)[:40])
def test_refusal_names_the_field_the_value_and_what_is_allowed(old: str, new: str, words: list[str]) -> None:
    with pytest.raises(DesignError) as refusal:
        solve_panel(stated(changed(old, new)))
    message = str(refusal.value)
    assert "\n" not in message
    assert [word for word in words if word not in message] == [], message


def test_more_voltages_than_memory_are_refused() -> None:
    ends = tuple(Electrode(f"e{k}", ends=(f"warp{k + 1}-",)) for k in range(100))
    with pytest.raises(DesignError, match=r"electrodes: 100 .* 2000 x 2000 cells has at most 62"):
        Panel((2000, 2000), CellResistances(1.0, 1.0, 1.0), ends)


def test_current_with_no_way_back_is_refused() -> None:
    """Insulated from each other, the fed yarn leads to no electrode at a voltage."""
    ends = (
        Electrode("fed", ends=("weft1-",), current=0.5),
        Electrode("open", ends=("weft1+",)),
        Electrode("ground", ends=("warp1-",), voltage=0.0),
    )
    with pytest.raises(DesignError, match=r"electrodes\.fed\.current: 0\.5 .* at a voltage"):
        solve_panel(Panel((2, 2), CellResistances(1.0, 1.0, np.inf), ends))


def test_resistances_too_far_apart_are_refused_or_right() -> None:
    """A crossing of 1e-11 ohm beside one of 1e11: what is answered balances."""
    ends = (Electrode("a", edge="left", voltage=1.0), Electrode("b", edge="top", voltage=0.0))
    refusals = []
    for ohm in 10.0 ** np.arange(-11.0, 12.0):
        rows = np.array([[ohm, 1.0], [1.0, 1.0 / ohm]])
        try:
            found = solve_panel(Panel((2, 2), CellResistances(1.0, 1.0, rows), ends))
        except CircuitError as error:
            refusals.append(str(error))
            continue
        assert found.heat.sum() == pytest.approx(found.power, rel=1e-5)
    assert all("too far apart" in text for text in refusals)


@pytest.mark.parametrize(
    "text",
    [
        *["().__class__", "x.y", "lambda: 1", "[1]", "x if y else 1", "9**9**9**9 * x", "'a' * 9", "x and y"],
        *["exp(x, y)", "(" * 300 + "x", "-" * 300 + "x", "\0", "", "x := 1", "1e999", "True", "f(x)", "exp(x=1)"],
        "x" * 501,
    ],
)
def test_formulas_are_arithmetic_and_nothing_else(text: str) -> None:
    """Refused in words; never run as code and never without end."""
    x = np.linspace(0.0, 1.0, 3)
    with pytest.raises(DesignError, match=r"^strain: "):
        evaluate(text, {"x": x, "y": x}, "strain")


def test_formulas_know_their_functions() -> None:
    x, y = np.array([[1.0, 4.0]]), np.array([[2.0], [3.0]])
    found = evaluate("where(x > 2, max(x, y)^2, -hypot(x, y)) + 0 * sqrt(x)", {"x": x, "y": y}, "f")
    np.testing.assert_allclose(found, [[-np.hypot(1, 2), 16.0], [-np.hypot(1, 3), 16.0]])


# Maps


def of_strain(text: str, folder: Path) -> np.ndarray[Any, Any]:
    return stated(changed('formula = "0.05 * (1 + x / 16)"', text), folder).strain


def test_strain_from_files(tmp_path: Path) -> None:
    """Row 1 of the file is warp1, at the bottom of the panel."""
    values = np.random.default_rng(0).uniform(0.0, 0.1, (6, 8))
    np.save(tmp_path / "map.npy", values)
    np.savetxt(tmp_path / "map.csv", values, delimiter=",", fmt="%.17g")
    np.testing.assert_array_equal(of_strain('file = "map.npy"', tmp_path), values)
    np.testing.assert_array_equal(of_strain('file = "map.csv"', tmp_path), values)
    assert (of_strain('uniform = "4 %"', tmp_path) == 0.04).all()


def test_strain_from_an_image(tmp_path: Path) -> None:
    """Brightness that rises with the row from the top falls with y: linear between `low` and `high`."""
    rows = np.linspace(0.0, 1.0, 12)[:, None] * np.ones((1, 5))
    matplotlib.image.imsave(tmp_path / "map.png", rows, cmap="gray", vmin=0.0, vmax=1.0)
    found = of_strain('image = "map.png"\nlow = 0\nhigh = "10 %"', tmp_path)
    y = (np.arange(6) + 0.5) / 6
    np.testing.assert_allclose(found, np.tile(0.1 * (1.0 - y)[:, None] * 12 / 11 - 0.1 / 22, (1, 8)), atol=0.1 / 255)
    one = read_image(tmp_path / "map.png", (1, 1), 0.0, 1.0, "strain")
    assert one[0, 0] == pytest.approx(0.5, abs=1 / 255)


def test_an_image_of_16_bits_is_as_bright(tmp_path: Path) -> None:
    """The white of a TIFF of 16 bits is 65535, not 255."""
    Image.fromarray(np.array([[65535, 32768], [0, 16384]], dtype=np.uint16)).save(tmp_path / "map.tiff")
    found = read_image(tmp_path / "map.tiff", (2, 2), 0.0, 1.0, "strain")
    np.testing.assert_allclose(found, [[0.0, 0.25], [1.0, 0.5]], atol=1 / 65535)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.npy", b"rubbish", "cannot be read"),
        ("a.csv", b"1,2\n3,four\n", "cannot be read"),
        ("a.csv", b"1,2\n3,4\n", "6 x 8 numbers, a row for each warp yarn; it holds 2 x 2"),
        ("a.txt", b"", "must be a .npy or .csv file"),
    ],
)
def test_files_that_are_no_map(name: str, content: bytes, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(DesignError, match=words):
        of_strain(f'file = "{name}"', tmp_path)


def test_a_pickle_is_not_opened(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(DesignError, match="cannot be read"):
        of_strain('file = "a.npy"', tmp_path)
    np.save(tmp_path / "b.npy", np.full((6, 8), np.nan))
    with pytest.raises(DesignError, match="finite; nan stands for warp1, weft1"):
        of_strain('file = "b.npy"', tmp_path)


# Results of a study

FROM_RESULTS = SMALL[: SMALL.index("[resistance]")] + '[results]\nfolder = "out"\n' + SMALL[SMALL.index("[strain]") :]


def test_resistances_and_pitch_of_a_study(tmp_path: Path) -> None:
    study = synthetic_study(5)
    (tmp_path / "out").mkdir()
    write_study_start(tmp_path / "out" / "results.h5", study)
    text = FROM_RESULTS.replace('pitch = "2 mm"\n', "")
    panel = stated(text, tmp_path)
    assert panel.pitch == study.design.weave.pitch
    assert panel.cells.strain == tuple(record.strain for record in study.records)
    local = local_resistances(panel.cells, np.array([[0.05]]))
    assert local.crossing[0, 0] == pytest.approx(study.records[2].fit.Rc)
    with pytest.raises(DesignError, match=r"results\.loading: 'pull' .* stretch"):
        stated(text.replace('folder = "out"', 'folder = "out"\nloading = "pull"'), tmp_path)


def test_resistances_are_matched_to_the_ports_of_a_state() -> None:
    """A state whose port matrix is that of a known network gives that network's Ry and each Rc back."""
    rng = np.random.default_rng(2)
    crossings = rng.uniform(2.0, 9.0, (4, 4))
    study = synthetic_study(1)
    ports = port_matrix(reduced_circuit((4, 4), np.repeat([0.3, 0.4], 4), crossings))
    known = replace(study, records=(replace(study.records[0], ports=ports),))
    cells = cells_of_study(known)
    np.testing.assert_allclose(cells.crossing[0], crossings, rtol=1e-6)
    assert (cells.warp[0, 0, 0], cells.weft[0, 0, 3]) == pytest.approx((0.3, 0.4), rel=1e-6)


def test_a_state_without_a_network_is_refused() -> None:
    study = synthetic_study(2)
    fit = replace(study.records[1].fit, yarns=np.full(8, np.nan), warnings=("the probes do not tell",))
    lost = replace(study, records=(study.records[0], replace(study.records[1], fit=fit, ports=PortMatrix())))
    with pytest.raises(DesignError, match=r"stretch-0\.0250.* not determined: the probes do not tell"):
        cells_of_study(lost)


def test_interpolation_is_monotone_and_exact_at_what_is_known() -> None:
    law = CellResistances(1.0 * np.ones(4), np.ones(4), [300.0, 310.0, 200.0, 190.0], (0.0, 0.1, 0.2, 0.3))
    at = np.linspace(0.0, 0.3, 301)[None]
    found = local_resistances(law, at)
    assert found.crossing[0, ::100].tolist() == pytest.approx([300.0, 310.0, 200.0, 190.0], rel=1e-13)
    assert np.all(np.diff(found.crossing[0, :101]) >= 0.0)
    assert np.all(np.diff(found.crossing[0, 100:]) <= 0.0)
    slope = np.gradient(np.log(found.crossing[0]), at[0])
    # Its second derivative jumps where values are known, by up to 240: times h / 4 that is what differences err by.
    np.testing.assert_allclose(found.crossing_slope[0, 1:-1], slope[1:-1], atol=0.07)


# The command


@pytest.fixture
def panel_file(tmp_path: Path) -> Path:
    (tmp_path / "small.toml").write_text(SMALL, encoding="utf-8")
    return tmp_path / "small.toml"


def test_the_command_leaves_what_it_says(panel_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = panel_file.parent / "out"
    assert main(["panel", str(panel_file), "--out", str(out)]) == ExitCode.DONE
    text = capsys.readouterr()
    assert "left" in text.out
    assert "relative residual" in text.out
    pictures = {"voltage.png", "current.png", "heat.png", "strain.png", "gradient_left_pad.png"}
    files = {"panel.json", "panel.npz", "panel.lib", "panel.cir", "panel_ports.lib"}
    assert {path.name for path in out.iterdir()} == pictures | files
    numbers = json.loads((out / "panel.json").read_text())
    solution = solve_panel(load_panel(panel_file)[0])
    assert numbers["electrodes"]["tap"] == {
        "voltage_V": solution.voltage[2],
        "current_A": pytest.approx(-0.01, rel=1e-9),
    }
    assert numbers["resistance_ohm"] == solution.resistance.tolist()
    with np.load(out / "panel.npz") as arrays:
        assert arrays["heat_W"].sum() == pytest.approx(numbers["power_W"])
        assert arrays["gradient_crossing_left_pad"].shape == (6, 8)
    (plot,) = run_deck((out / "panel.cir").read_text()).plots
    assert float(plot.voltage(["sense"])[0, 0]) == pytest.approx(solution.voltage[3], rel=1e-9)


def test_the_reduction_in_ngspice_is_the_panel(panel_file: Path) -> None:
    out = panel_file.parent / "out"
    assert main(["panel", str(panel_file), "--out", str(out), "--quiet"]) == ExitCode.DONE
    deck = (out / "panel.cir").read_text()
    head, sources = deck[: deck.index("\n") + 1], deck[deck.index("Xpanel") :]
    (whole,) = run_deck(deck).plots
    (ports,) = run_deck(head + (out / "panel_ports.lib").read_text() + sources).plots
    names = ["left", "pad", "tap", "sense"]
    np.testing.assert_allclose(ports.voltage(names), whole.voltage(names), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("spoil", "code"), [("[panel", 3), ("[results]\nfolder = 'nowhere'", 7)])
def test_a_file_that_cannot_be_used_is_one_line(
    spoil: str, code: int, panel_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = FROM_RESULTS.replace('[results]\nfolder = "out"', spoil) if code == 7 else SMALL.replace("[panel]", spoil)
    panel_file.write_text(text, encoding="utf-8")
    assert main(["panel", str(panel_file), "--out", str(panel_file.parent / "out")]) == code
    assert capsys.readouterr().err.count("\n") == 1


def test_a_large_panel_gets_the_reduction_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("circuittex.study.panel.output.MOST_CARDS", 10)
    notes = write_panel(tmp_path, solve_panel(stated()))
    assert any("only the reduction is written" in note for note in notes)
    assert not (tmp_path / "panel.lib").exists()
    assert (tmp_path / "panel_ports.lib").exists()


def test_without_multigrid_a_large_panel_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("circuittex.solvers.laplacian.LARGEST_DIRECT", 10)
    monkeypatch.setattr("circuittex.solvers.laplacian._has_multigrid", lambda: False)
    with pytest.raises(CircuitError, match=r"needs the extra: pip install 'circuittex\[panel\]'"):
        solve_panel(stated())


def test_python_is_refused_in_the_same_words() -> None:
    with pytest.raises(CircuittexError, match=r"electrodes: 'nothing' .* at least one electrode"):
        Panel((2, 2), CellResistances(1.0, 1.0, 1.0), ())


# Anything anywhere

NONSENSE = [True, False, [], {}, "", "x", "5 V", "nan ohm", float("nan"), float("inf"), -1, 0, 1e300, 10**30, [1]]
NONSENSE += [[[1, 2]], [[1, 2], [3, 4]], {"x": 1}, ["a"], [None], "warp1-", "../x.npy", "\n.include x", [1, 2, 3, 4]]


def leaves(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where values, tables and lists of a panel file are."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(leaf for key, each in inner for leaf in leaves(each, (*path, key)))]


@pytest.mark.parametrize("path", leaves(tomllib.loads(SMALL))[1:], ids=lambda path: ".".join(map(str, path)))
def test_nonsense_in_any_place_is_refused_in_one_sentence(path: tuple[Any, ...]) -> None:
    """Or used, where it happens to mean something."""
    for value in NONSENSE:
        mapping = tomllib.loads(SMALL)
        table = mapping
        for key in path[:-1]:
            table = table[key]
        table[path[-1]] = value
        said = ""
        try:
            solve_panel(parse_panel(mapping, Path("nowhere"))[0])
        except CircuittexError as error:
            said = str(error)
        assert "\n" not in said
