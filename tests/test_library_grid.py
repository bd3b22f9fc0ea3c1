"""Parts in which two strains are inputs: interpolation on a grid, what ngspice answers, and where it is refused."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from gnucap import GNUCAP, needs_gnucap
from hypothesis import given
from hypothesis import strategies as st
from library_cases import grid_study, pins_of, study, with_both

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.design import Yarn
from circuittex.electrical.network.circuit import build_circuit, yarn_end_terminals
from circuittex.electrical.network.ports import port_matrix, resistances
from circuittex.electrical.spice.ngspice import run_deck
from circuittex.results.records import Study
from circuittex.results.store import write_study_start
from circuittex.study.export import simplified
from circuittex.study.library.bicubic import left_out, patches, value_at
from circuittex.study.library.export import export_library
from circuittex.study.library.fit_corners import FitCorner
from circuittex.study.library.interpolation import pieces, value
from circuittex.study.library.levels import Levels
from circuittex.study.library.strain_grid import grids

pytestmark = pytest.mark.xdist_group("library_grid")  # what its fixtures make serves one worker

STUDY = grid_study()
X, SHEAR = (0.0, 0.025, 0.06), (-0.04, -0.01, 0.0)
SAMPLED = 1e-6
"""Relative, asked for; what is found is rounding."""
BETWEEN = 1e-9
"""Relative: the same polynomials by ngspice."""
PAIRS = [("warp1_minus", "warp1_plus"), ("warp1_minus", "weft2_plus"), ("warp4_plus", "warp2_minus")]
NAME = "fabric_ports_stretch_x_shear"
GNUCAP_SUFFIX = {"K": 1e3, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12}
GNUCAP_SOURCE = 1e-4
"""V: gnucap's sources have a small resistance of their own."""


@pytest.fixture(autouse=True)
def _nothing_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for what the module's fixtures export."""
    undrawn(monkeypatch)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("library")
    export_library(STUDY, folder, dialects=("ngspice", "gnucap"), combine=("shear", "stretch_x"))
    return folder / "ngspice"


@cache
def state_at(x: float, shear: float) -> tuple[float, ...]:
    """Resistances of the pairs in the state with that gradient, from its contacts alone."""
    (record,) = [r for r in STUDY.records if np.allclose(r.gradient, [[1 + x, 0], [shear, 1]], rtol=0, atol=1e-12)]
    simple = simplified(STUDY.design, record.contacts)
    terminals = yarn_end_terminals(record.contacts.mesh)
    names = [terminal.name for terminal in terminals]
    R = resistances(port_matrix(build_circuit(simple.contacts, terminals)))
    return tuple(float(R[names.index(a), names.index(b)]) for a, b in PAIRS)


def measured(library: Path, name: str, strains: Iterable[tuple[float, float]], more: str = "") -> tuple[Floats, Floats]:
    """(S, pairs) resistances that a part answers at pairs of strains, and its flags: all in one deck."""
    pins = pins_of((library / f"{name}.lib").read_text("ascii"))
    lines = [f"* {name}", f".include {library / name}.lib"]
    strains = list(strains)
    for s, (x, shear) in enumerate(strains):
        for p, (a, b) in enumerate(PAIRS):
            end = f"_{s}_{p}"
            nodes = " ".join({a: f"in{end}", b: "0"}.get(pin, f"{pin}{end}") for pin in pins)
            given = f"stretch_x={x!r} shear={shear!r} {more}" if name.endswith("_s") else ""
            lines += [f"X{end} {nodes} {name} {given}", f"I{end} 0 in{end} 1"]
            if name.endswith("_v"):
                lines += [f"Vx{end} stretch_x{end} 0 {x!r}", f"Vs{end} shear{end} 0 {shear!r}"]
    plot = run_deck("\n".join([*lines, ".op", ".end"]) + "\n").plots[-1]
    ends = [f"_{s}_{p}" for s in range(len(strains)) for p in range(len(PAIRS))]
    shape = (len(strains), len(PAIRS))
    found = [plot.voltage([f"{node}{end}" for end in ends])[-1].reshape(shape) for node in ("in", "out_of_range")]
    return found[0], found[1]


@pytest.mark.parametrize("kind", ["_s", "_v"])
def test_each_state_of_the_grid_has_its_own_resistances(library: Path, kind: str) -> None:
    states = [(x, shear) for x in X for shear in SHEAR]
    found, flags = measured(library, NAME + kind, states)
    np.testing.assert_allclose(found, [state_at(*state) for state in states], rtol=SAMPLED)
    np.testing.assert_allclose(flags, 0.0, atol=1e-12)


@pytest.mark.parametrize("kind", ["_s", "_v"])
def test_beyond_the_grid_its_border_holds_and_the_flag_is_up(library: Path, kind: str) -> None:
    beyond = {(0.07, -0.01): (0.06, -0.01), (-1.0, 0.0): (0.0, 0.0), (0.025, 3.0): (0.025, 0.0)}
    beyond |= {(0.0, -0.05): (0.0, -0.04), (9.0, -9.0): (0.06, -0.04)}
    found, flags = measured(library, NAME + kind, beyond)
    np.testing.assert_allclose(found, [state_at(*state) for state in beyond.values()], rtol=SAMPLED)
    np.testing.assert_allclose(flags, 1.0, atol=1e-12)


def test_pin_and_parameter_agree_between_the_states_at_all_levels(library: Path) -> None:
    between = [(0.01, -0.02), (0.05, -0.005), (0.03, -0.035)]
    for level in ("ports", "cell"):
        name = f"fabric_{level}_stretch_x_shear"
        parameter, pin = (measured(library, name + kind, between)[0] for kind in ("_s", "_v"))
        np.testing.assert_allclose(pin, parameter, rtol=BETWEEN)


def test_on_a_line_of_the_grid_it_is_the_part_of_one_loading(library: Path) -> None:
    """At no shear the part of both strains answers as that of the loading along x."""
    both, _ = measured(library, f"{NAME}_s", [(0.013, 0.0), (0.05, 0.0)])
    text = (library / "fabric_ports_pull_x_s.lib").read_text("ascii")
    pins = pins_of(text)
    lines = ["* along x", f".include {library}/fabric_ports_pull_x_s.lib"]
    for s, x in enumerate((0.013, 0.05)):
        nodes = " ".join({PAIRS[0][0]: f"in{s}", PAIRS[0][1]: "0"}.get(pin, f"{pin}_{s}") for pin in pins)
        lines += [f"X{s} {nodes} fabric_ports_pull_x_s strain={x}", f"I{s} 0 in{s} 1"]
    alone = run_deck("\n".join([*lines, ".op", ".end"]) + "\n").plots[-1].voltage(["in0", "in1"])[-1]
    np.testing.assert_allclose(both[:, 0], alone, rtol=BETWEEN)


def test_a_transient_that_throws_both_strains_about_is_solved(library: Path) -> None:
    pins = pins_of((library / f"{NAME}_v.lib").read_text("ascii"))
    nodes = " ".join({"warp1_minus": "in", "warp1_plus": "0"}.get(pin, pin) for pin in pins)
    deck = ["* thrown about", f".include {library}/{NAME}_v.lib", f"X1 {nodes} {NAME}_v", "I1 0 in 1"]
    deck += ["Vx stretch_x 0 PULSE(-1e3 1e6 1m 1n 1n 1m 2m)", "Vs shear 0 PULSE(1e6 -1e3 1.5m 1n 1n 1m 2m)"]
    found = run_deck("\n".join([*deck, ".tran 50u 5m", ".end"]) + "\n").plots[-1].voltage(["in"])[:, 0]
    assert found.min() > 0.0
    assert found[0] == pytest.approx(state_at(0.0, 0.0)[0], rel=SAMPLED)


def _number(word: str) -> float:
    """A number as gnucap prints it: 4.7K."""
    return float(word[:-1]) * GNUCAP_SUFFIX[word[-1]] if word[-1] in GNUCAP_SUFFIX else float(word)


@needs_gnucap
def test_gnucap_answers_as_each_state_and_beyond(library: Path, tmp_path: Path) -> None:
    """Strain as a parameter, one and two; gnucap prints twelve digits where it is told to."""
    cases = [(f"{NAME}_s", f"stretch_x={x} shear={shear}", (x, shear)) for x in X for shear in SHEAR]
    cases += [("fabric_ports_pull_x_s", f"strain={x}", (x, 0.0)) for x in X]
    cases += [
        (f"{NAME}_s", "stretch_x=0.07 shear=-1", (0.06, -0.04)),
        ("fabric_ports_pull_x_s", "strain=-9", (0.0, 0.0)),
    ]
    folder = library.parent / "gnucap"
    lines = ["* states", ".options numdgt=12 gmin=0"]
    lines += [f".include {folder}/{name}.lib" for name in dict.fromkeys(name for name, *_ in cases)]
    for k, (name, words, _) in enumerate(cases):
        nodes = {PAIRS[1][0]: f"in{k}", PAIRS[1][1]: "0", "out_of_range": f"flag{k}"}
        pins = pins_of((folder / f"{name}.lib").read_text("ascii"))
        lines += [f"X{k} {' '.join(nodes.get(pin, f'{pin}_{k}') for pin in pins)} {name} {words}", f"I{k} 0 in{k} 1"]
    shown = " ".join(f"v({node}{k})" for node in ("in", "flag") for k in range(len(cases)))
    (tmp_path / "states.cir").write_text("\n".join([*lines, f".print dc {shown}", ".dc I0 1 1 1", ".end", ""]), "ascii")
    done = subprocess.run(
        [str(GNUCAP), "-b", "states.cir"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    _, *values = (_number(word) for word in done.stdout.strip().splitlines()[-1].split())
    np.testing.assert_allclose(values[: len(cases)], [state_at(*state)[1] for *_, state in cases], rtol=SAMPLED)
    beyond = [float(k >= len(cases) - 2) for k in range(len(cases))]
    np.testing.assert_allclose(values[len(cases) :], beyond, atol=GNUCAP_SOURCE)


def test_a_library_says_what_two_strains_err(library: Path) -> None:
    listed = json.loads((library.parent / "library.json").read_text("ascii"))
    named = {cell["name"]: cell for cell in listed["cells"]}
    assert named[f"{NAME}_s"]["parameters"] == [["stretch_x", "0"], ["shear", "0"]]
    assert [pin["name"] for pin in named[f"{NAME}_v"]["pins"][-3:]] == ["stretch_x", "shear", "out_of_range"]
    assert not any("x0p025" in name for name in named), "no part of a loading that starts from a strained state"
    assert listed["interpolation_errors"]["stretch_x_shear"]["worst"][0] > 0.0
    text = (library / f"{NAME}_v.lib").read_text("ascii")
    assert "* errors of ports at states by the grid without their lines" in text
    page = (library.parent / "datasheet.html").read_text("utf-8")
    assert "stretch_x: 0 % to 6 %, with shear: -4 % to 0 %, 3 x 3 states" in page
    assert "Two strains at once" not in page


def test_names_that_terminals_have_already_are_left_to_them(tmp_path: Path) -> None:
    """With free ends a terminal may be called like a strain."""
    made = with_both(study(3))
    terminals = tuple(
        replace(each, name={"common": "shear"}.get(each.name, each.name)) for each in made.design.terminals
    )
    probes = tuple(replace(each, sink="shear") for each in made.design.probes)
    made = replace(made, design=replace(made.design, terminals=terminals, probes=probes))
    with pytest.warns(UserWarning, match="no cell"):
        cells = export_library(made, tmp_path, ends="free", dialects=("ngspice",))
    (cell,) = [cell for cell in cells if cell.name == "fabric_free_ports_stretch_x_shear_v"]
    words = [pin.name for pin in cell.pins]
    assert len(set(words)) == len(words)
    assert words[-3:] == ["stretch_x", "shear_2", "out_of_range"]


@pytest.mark.parametrize(
    ("combine", "said"),
    [
        (("stretch_x", "stretch_x"), "combine: 'stretch_x,stretch_x'.*two of stretch_x, stretch_y, shear"),
        (("stretch_x", "bend"), "two of stretch_x"),
        (("stretch_x", "stretch_y"), "no state has stretch_y"),
        (
            ("stretch_x", "shear"),
            "no state is recorded at stretch_x 0.025 with shear 0.025; stretch_x 0.025 with shear 0.05; .*'grid'",
        ),
    ],
)
def test_strains_that_are_not_sampled_together_are_refused(
    combine: tuple[str, str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = study(3)
    with pytest.raises(DesignError, match=said):
        export_library(made, tmp_path / "lib", combine=combine)
    assert not (tmp_path / "lib").exists()
    write_study_start(tmp_path / "results.h5", made)
    command = ["export", str(tmp_path), "--out", str(tmp_path / "lib"), "--combine", ",".join(combine)]
    assert main(command) == ExitCode.DESIGN
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_states_that_are_missing_are_named_and_the_part_left_out() -> None:
    whole = grids(STUDY)
    assert [grid.word for grid in whole] == ["stretch_x_shear"]
    assert [STUDY.records[k].name for k in whole[0].records[1]] == [
        "pull-x0p025-shear--0.04",
        "pull-x0p025-shear--0.01",
        "pull-x-0.025",
    ]
    rest = replace(STUDY, records=tuple(r for r in STUDY.records if r.name != "pull-x0p025-shear--0.04"))
    assert grids(rest) == ()
    with pytest.raises(DesignError, match=r"recorded at stretch_x 0.025 with shear -0.04: a loading"):
        grids(rest, ("stretch_x", "shear"))


def test_states_with_free_edges_are_no_part_of_a_grid() -> None:
    made = with_both(study(3))
    assert [grid.word for grid in grids(made)] == ["stretch_x_shear"]
    stretch, sheared, both = made.design.loading
    free = replace(both, free="y", start=((1.0, 0.0), (0.0, 1.0)))
    assert grids(replace(made, design=replace(made.design, loading=(stretch, sheared, free)))) == ()


# Interpolation by itself


def strains(count: int) -> st.SearchStrategy[list[float]]:
    steps = st.lists(st.floats(0.005, 0.2), min_size=count - 1, max_size=count - 1)
    return steps.map(lambda widths: [-0.1, *(-0.1 + np.cumsum(widths)).tolist()])


CASES = st.tuples(st.integers(2, 4), st.integers(2, 4)).flatmap(
    lambda size: st.tuples(
        strains(size[0]),
        strains(size[1]),
        st.lists(st.floats(-15.0, 5.0), min_size=size[0] * size[1], max_size=size[0] * size[1]),
    )
)
PLACE = st.floats(0.0, 1.0)


@given(CASES, PLACE, PLACE)
def test_a_conductance_stays_between_the_four_states_around_it(
    case: tuple[list[float], list[float], list[float]], at_a: float, at_b: float
) -> None:
    """On a line of the grid also between the two beside it, as the cubics of that line."""
    first, second = np.array(case[0]), np.array(case[1])
    g = np.exp(np.array(case[2])).reshape(len(first), len(second), 1)
    found = patches(first, second, g)
    a, b = (float(axis[0] + at * (axis[-1] - axis[0])) for axis, at in ((first, at_a), (second, at_b)))
    i, j = (min(int(np.searchsorted(axis, x, "right")) - 1, len(axis) - 2) for axis, x in ((first, a), (second, b)))
    around = g[i : i + 2, j : j + 2]
    (inside,) = value_at(found, a, b)
    assert around.min() * (1 - 1e-9) <= inside <= around.max() * (1 + 1e-9)
    for k, line in enumerate(second):
        np.testing.assert_allclose(value_at(found, a, float(line)), value(pieces(first, g[:, k]), a), rtol=1e-9)
    for k, line in enumerate(first):
        np.testing.assert_allclose(value_at(found, float(line), b), value(pieces(second, g[k]), b), rtol=1e-9)


def test_a_patch_that_would_go_beyond_its_corners_is_held() -> None:
    """Uneven strains and logarithms in natural units for which the bicubic of slopes and twists leaves by 0.7."""
    first, second = np.array([0.1, 0.2, 1.2, 2.2]), np.array([5.0, 5.1, 10.1, 10.2])
    logs = [[1.1, 2.0, -10.0, 0.0], [10.0, 10.0, 0.0, -10.0], [1.0, 10.0, 10.0, 10.0], [0.0, 2.0, 1.0, 1.1]]
    found = patches(first, second, np.exp(logs)[..., None])
    inside = [
        float(np.log(value_at(found, a, b)[0])) for a in np.linspace(0.2, 1.2, 21) for b in np.linspace(5.1, 10.1, 21)
    ]
    assert min(inside) >= 0.0 - 1e-9
    assert max(inside) <= 10.0 + 1e-9


def test_a_bilinear_logarithm_is_interpolated_exactly_and_held_beyond() -> None:
    """log g = 1 + 2 a - 3 b + 40 a b on uneven strains: slopes and twists are those of the function."""
    first, second = np.array([-0.1, 0.0, 0.07, 0.25]), np.array([0.0, 0.1, 0.15])

    def exact(a: float, b: float) -> float:
        return float(np.exp(1.0 + 2.0 * a - 3.0 * b + 40.0 * a * b))

    g = np.array([[[exact(a, b)] for b in second] for a in first])
    found = patches(first, second, g)
    for a, b in ((-0.03, 0.02), (0.03, 0.12), (0.2, 0.149), (0.25, 0.15)):
        np.testing.assert_allclose(value_at(found, a, b), exact(a, b), rtol=1e-12)
    np.testing.assert_allclose(value_at(found, 9.0, 0.12), exact(0.25, 0.12), rtol=1e-12)
    np.testing.assert_allclose(value_at(found, -9.0, -9.0), exact(-0.1, 0.0), rtol=1e-12)
    assert left_out(first, second, g, 0, 2) is None
    for i, j in ((1, 1), (2, 0), (0, 1)):
        np.testing.assert_allclose(left_out(first, second, g, i, j), g[i, j], rtol=1e-12)


def test_the_interpolation_converges_on_finer_grids() -> None:
    """A smooth function that rises along both axes: halving the steps divides the error by four or more."""

    def off(steps: int) -> float:
        axis = np.linspace(0.0, 0.2, steps + 1)
        f = np.exp(np.sin(6 * axis)[:, None] * np.cosh(4 * axis) + 5 * axis)[..., None]
        fine = np.linspace(0.0, 0.2, 41)
        exact = np.exp(np.sin(6 * fine)[:, None] * np.cosh(4 * fine) + 5 * fine)
        found = patches(axis, axis, f)
        return max(
            abs(value_at(found, a, b)[0] / exact[i, j] - 1) for i, a in enumerate(fine) for j, b in enumerate(fine)
        )

    errors = [off(steps) for steps in (4, 8, 16)]
    assert errors[0] / errors[1] > 4.0
    assert errors[1] / errors[2] > 4.0


def scaled_fits(known: Levels, _: object) -> tuple[FitCorner, ...]:
    """The cell with all resistances divided by a factor, in place of fits that take half a minute."""
    corners = {"_p05": 1.18, "_p50": 1.0, "_p95": 0.82}
    return tuple(
        FitCorner(end, 3, replace(known, along=known.along / factor, across=known.across / factor))
        for end, factor in corners.items()
    )


@pytest.fixture(scope="module")
def packings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three packings whose resistances are all those of the study over 0.8 to 1.2, within tolerances of 10 %."""
    folder = tmp_path_factory.mktemp("packings")
    weave = STUDY.design.weave

    def tolerated(yarns: tuple[Yarn, ...]) -> tuple[Yarn, ...]:
        return tuple(replace(y, materials=tuple(replace(m, tolerance=0.1) for m in y.materials)) for y in yarns)

    design = replace(
        STUDY.design,
        weave=replace(weave, warp=tolerated(weave.warp), weft=tolerated(weave.weft)),
        contact=replace(STUDY.design.contact, tolerance=0.1),
    )
    made = replace(STUDY, design=design)
    terminals = yarn_end_terminals(STUDY.mesh)

    def member(factor: float) -> Study:
        records = []
        for record in made.records:
            found = port_matrix(build_circuit(simplified(design, record.contacts).contacts, terminals))
            records.append(replace(record, ports=replace(found, conductance=factor * found.conductance)))
        return replace(made, records=tuple(records))

    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr("circuittex.study.library.export.write_datasheet", lambda *_: None)
        monkeypatch.setattr("circuittex.study.library.facts.fit_corners", scaled_fits)
        export_library(made, folder, dialects=("ngspice",), members=map(member, (0.8, 1.0, 1.2)))
    return folder / "ngspice"


@pytest.mark.parametrize(
    ("name", "given", "factor"),
    [
        ("mc", "mc=0", 1.0),
        ("mc", "mc=-1.6448536269514722", 1.18),
        ("mc", "mc=1.6448536269514722", 0.82),
        ("tol", "tol=1", 1 / 1.1),
        ("tol", "tol=-0.5", 1 / 0.95),
    ],
)
def test_a_place_among_packings_and_tolerances_beside_both_strains(
    packings: Path, name: str, given: str, factor: float
) -> None:
    """The 5th and 95th percentile of three equidistant factors lie at 0.05 and 0.95 of their range."""
    states = [(0.025, -0.04), (0.06, -0.01)]
    found, flags = measured(packings, f"fabric_ports_{name}_stretch_x_shear_s", states, given)
    np.testing.assert_allclose(found, np.array([state_at(*state) for state in states]) / factor, rtol=SAMPLED)
    np.testing.assert_allclose(flags, 0.0, atol=1e-12)


def test_the_cell_has_corners_beside_both_strains(packings: Path) -> None:
    states = [(0.025, -0.04), (0.06, -0.01)]
    plain, _ = measured(packings, "fabric_cell_stretch_x_shear_s", states)
    found, _ = measured(packings, "fabric_cell_mc_stretch_x_shear_s", states, "mc=1.6448536269514722")
    np.testing.assert_allclose(found, plain / 0.82, rtol=SAMPLED)
    found, _ = measured(packings, "fabric_cell_p05_stretch_x_shear_s", states)
    np.testing.assert_allclose(found, plain / 1.18, rtol=SAMPLED)


def test_the_datasheet_draws_the_grid(library: Path) -> None:
    assert "under two strains at once" in (library.parent / "datasheet.html").read_text("utf-8")
    assert (library.parent / "figures" / "grid.png").stat().st_size > 10_000


def test_a_loading_called_as_a_grid_is_refused(tmp_path: Path) -> None:
    """Of two files of one name there was the last."""
    made = with_both(study(3))
    first, *others = made.design.loading
    other = "stretch_x_shear"
    design = replace(made.design, loading=(replace(first, name=other), *others))
    records = tuple(
        replace(r, loading=other, name=r.name.replace(first.name, other)) if r.loading == first.name else r
        for r in made.records
    )
    with pytest.raises(DesignError, match=f"loading: 'fabric_ports_{other}_s' is not usable; two sub-circuits"):
        export_library(replace(made, design=design, records=records), tmp_path)
    assert not list(tmp_path.iterdir())
