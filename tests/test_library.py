"""The exported library in ngspice: what its sub-circuits answer, against the detailed network and exact reductions."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from library_cases import ohmmeter, pins_of, resistor_matrix, study

from circuittex.base.arrays import Floats
from circuittex.electrical.network.circuit import build_circuit, yarn_end_terminals
from circuittex.electrical.network.ports import PortMatrix, port_matrix, resistances
from circuittex.electrical.spice.ngspice import run_decks
from circuittex.results.records import Study
from circuittex.study.export import simplified
from circuittex.study.library.export import export_library
from circuittex.study.plan import plan

pytestmark = pytest.mark.xdist_group("library")  # what its fixtures make serves one worker

STUDY = study()
EXACT = 1e-9
"""Relative: ngspice's elimination of some hundred resistors beside a reduction by other means."""
SAMPLED = 1e-6
"""Relative, asked for; what is found is rounding."""
THIN = 0.2
PAIRS = [
    ("warp1_minus", "warp1_plus"),
    ("warp1_minus", "weft2_plus"),
    ("weft1_minus", "weft3_plus"),
    ("warp4_plus", "warp2_minus"),
]


@pytest.fixture(autouse=True)
def _nothing_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for what the module's fixtures export."""
    undrawn(monkeypatch)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("library")
    export_library(STUDY, folder, thin=THIN)
    return folder


def wanted(state: int) -> Floats:
    """(P, P) resistances between yarn ends of a state, from its contacts alone."""
    record = STUDY.records[state]
    simple = simplified(STUDY.design, record.contacts)
    return resistances(port_matrix(build_circuit(simple.contacts, yarn_end_terminals(record.contacts.mesh))))


def place(pair: tuple[str, str]) -> tuple[int, int]:
    """Row and column of a pair in the order of the yarns."""
    names = [terminal.name for terminal in yarn_end_terminals(STUDY.mesh)]
    return names.index(pair[0]), names.index(pair[1])


def answers(decks: list[str], node: str = "in") -> Floats:
    return np.array([raw.plots[-1].voltage([node])[-1, 0] for raw in run_decks(decks)])


@pytest.mark.parametrize("state", ["relaxed", "stretch-0.05", "shear-0.075"])
def test_ports_equal_the_detailed_network_in_ngspice(state: str, tmp_path: Path) -> None:
    export_library(STUDY, tmp_path, state=state, dialects=("ngspice",))
    folder = tmp_path / "ngspice"
    ports = answers(ohmmeter(folder, "fabric_ports", PAIRS))
    detailed = answers(ohmmeter(folder, "fabric_detailed", PAIRS))
    np.testing.assert_allclose(ports, detailed, rtol=EXACT)


@pytest.mark.parametrize("loading", ["stretch", "shear"])
def test_strain_as_a_parameter_gives_the_ports_of_each_state(library: Path, loading: str) -> None:
    for number, record in enumerate(STUDY.records):
        if record.loading in ("", loading):
            name, strain = f"fabric_ports_{loading}_s", record.strain
            found = answers(ohmmeter(library / "ngspice", name, PAIRS, f"strain={strain!r}"))
            exact = wanted(number)
            np.testing.assert_allclose(found, [exact[place(pair)] for pair in PAIRS], rtol=SAMPLED)


@pytest.mark.parametrize("loading", ["stretch", "shear"])
def test_strain_as_a_pin_gives_the_ports_of_each_state(library: Path, loading: str) -> None:
    for number, record in enumerate(STUDY.records):
        if record.loading in ("", loading):
            name, source = f"fabric_ports_{loading}_v", f"V1 strain 0 {record.strain!r}"
            found = answers(ohmmeter(library / "ngspice", name, PAIRS, extra=source))
            exact = wanted(number)
            np.testing.assert_allclose(found, [exact[place(pair)] for pair in PAIRS], rtol=SAMPLED)


@pytest.mark.parametrize(
    ("strain", "end", "flag"), [(-0.3, 0, 1), (0.0, 0, 0), (0.075, 3, 0), (0.08, 3, 1), (5.0, 3, 1)]
)
def test_beyond_the_range_the_last_values_hold_and_the_flag_is_up(
    library: Path, strain: float, end: int, flag: int
) -> None:
    parameter = ohmmeter(library / "ngspice", "fabric_ports_stretch_s", PAIRS[:2], f"strain={strain!r}")
    pin = ohmmeter(library / "ngspice", "fabric_ports_stretch_v", PAIRS[:2], extra=f"V1 strain 0 {strain!r}")
    exact = [wanted(end)[place(pair)] for pair in PAIRS[:2]]
    for decks in (parameter, pin):
        np.testing.assert_allclose(answers(decks), exact, rtol=SAMPLED)
        np.testing.assert_allclose(answers(decks, "out_of_range"), flag, atol=1e-12)


def test_an_open_strain_pin_is_no_strain(library: Path) -> None:
    found = answers(ohmmeter(library / "ngspice", "fabric_ports_stretch_v", PAIRS))
    exact = wanted(0)
    np.testing.assert_allclose(found, [exact[place(pair)] for pair in PAIRS], rtol=SAMPLED)


def test_pin_and_parameter_agree_between_the_states(library: Path) -> None:
    for strain in (0.01, 0.03, 0.07):
        for level in ("ports", "ports_thin", "cell", "unit"):
            pairs = [("w", "n"), ("e", "s")] if level == "unit" else PAIRS
            name = f"fabric_{level}_shear"
            parameter = answers(ohmmeter(library / "ngspice", f"{name}_s", pairs, f"strain={strain}"))
            pin = answers(ohmmeter(library / "ngspice", f"{name}_v", pairs, extra=f"V1 strain 0 {strain}"))
            np.testing.assert_allclose(pin, parameter, rtol=SAMPLED)


def test_a_transient_that_throws_the_strain_about_is_solved(library: Path) -> None:
    """Jumps far beyond the range within a step, and back: nothing may reach zero or overflow on the way."""
    (deck,) = ohmmeter(
        library / "ngspice",
        "fabric_ports_stretch_v",
        PAIRS[:1],
        extra="V1 strain 0 PULSE(-1e3 1e6 1m 1n 1n 1m 2m)\n.tran 50u 5m",
    )
    (raw,) = run_decks([deck.replace(".op\n", "")])
    found = raw.plots[-1].voltage(["in"])[:, 0]
    low, high = sorted(wanted(k)[place(PAIRS[0])] for k in (0, 3))
    assert found.min() > 0.0
    assert np.isclose(found[0], wanted(0)[place(PAIRS[0])], rtol=1e-3)
    assert np.isfinite([low, high, found.max()]).all()


def test_a_strained_network_is_reciprocal(library: Path) -> None:
    """1 V at one pin moves as much current at another as the other way round."""
    folder, name = library / "ngspice", "fabric_ports_stretch_v"
    pins = pins_of((folder / f"{name}.lib").read_text("ascii"))[:-2]
    deck = ["* reciprocity", f".include {folder / name}.lib"]
    for number, driven in enumerate((pins[0], pins[9])):
        nodes = " ".join(f"{pin}_{number}" for pin in pins)
        deck += [f"X{number} {nodes} s o{number} {name}"]
        deck += [f"V{pin}_{number} {pin}_{number} 0 {1 if pin == driven else 0}" for pin in pins]
    (raw,) = run_decks(["\n".join([*deck, "Vs s 0 0.033", ".op", ".end"]) + "\n"])
    forth = raw.plots[-1].current(f"v{pins[9]}_0")[0]
    back = raw.plots[-1].current(f"v{pins[0]}_1")[0]
    assert forth > 0.0
    assert back == pytest.approx(forth, rel=EXACT)


@pytest.mark.parametrize("name", ["fabric_detailed", "fabric_ports", "fabric_ports_thin", "fabric_cell", "fabric_unit"])
def test_networks_are_passive(library: Path, name: str) -> None:
    """Every resistor is positive, the port matrix symmetric, without negative eigenvalues, and with rows of no sum."""
    text = (library / "ngspice" / f"{name}.lib").read_text("ascii")
    assert all(float(line.split()[3]) > 0.0 for line in text.splitlines() if line.startswith("R"))
    pins, G = resistor_matrix(text)
    size = np.abs(G).max()
    assert len(pins) == (4 if name == "fabric_unit" else 16)
    np.testing.assert_allclose(G, G.T, atol=1e-12 * size)
    np.testing.assert_allclose(G.sum(axis=1), 0.0, atol=1e-11 * size)
    assert np.linalg.eigvalsh((G + G.T) / 2).min() > -1e-11 * size


def test_thinned_ports_keep_their_bound(library: Path) -> None:
    """Resistances from the written files, by plain matrices: fewer conductors, none lower, none higher than allowed."""

    def measured(name: str) -> tuple[Floats, int]:
        text = (library / "ngspice" / f"{name}.lib").read_text("ascii")
        inverse = np.linalg.inv(resistor_matrix(text)[1][1:, 1:])
        between = np.diag(inverse)[:, None] + np.diag(inverse) - 2 * inverse
        return between[np.triu_indices(15, 1)], text.count("\nR")

    (exact, many), (thin, few) = measured("fabric_ports"), measured("fabric_ports_thin")
    assert few < many
    assert (thin / exact - 1.0).max() <= THIN * (1 + 1e-9)
    assert (thin / exact - 1.0).min() > -1e-9, "taking conductors away lowers no resistance (Rayleigh)"


def test_the_way_back_is_a_part_of_its_own(tmp_path: Path) -> None:
    """At the strain that is passed twice each part has the resistances of its own state."""
    design = STUDY.design
    there = design.loading[0]
    strains = (*there.strains[:2], there.strains[0])
    loading = replace(there, strains=strains, gradients=(*there.gradients[:2], there.gradients[0]))
    design = replace(design, loading=(loading,))
    records = [
        replace(record, name=step.name, strain=step.strain, loading=step.loading)
        for step, record in zip(plan(design), STUDY.records, strict=False)
    ]
    export_library(replace(STUDY, design=design, records=tuple(records)), tmp_path, dialects=("ngspice",))
    assert not (tmp_path / "ngspice" / "fabric_ports_stretch_s.lib").exists()
    for way, state in (("load", 1), ("unload", 3)):
        decks = ohmmeter(tmp_path / "ngspice", f"fabric_ports_stretch_{way}_s", PAIRS, f"strain={strains[0]}")
        exact = wanted(state)
        np.testing.assert_allclose(answers(decks), [exact[place(pair)] for pair in PAIRS], rtol=SAMPLED)
    below = ohmmeter(tmp_path / "ngspice", "fabric_ports_stretch_unload_s", PAIRS[:1], "strain=0")
    assert answers(below, "out_of_range")[0] == 1.0, "the way back ends at a strain of 2.5 %"


# Corners of an ensemble


@pytest.fixture(scope="module")
def corners(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five packings that are the same but for all contacts and fibrils, which conduct 0.8 to 1.2 times as well."""
    folder = tmp_path_factory.mktemp("corners")
    with pytest.MonkeyPatch.context() as patch:
        undrawn(patch)
        export_library(STUDY, folder, members=[scaled(factor) for factor in FACTORS], dialects=("ngspice",))
    return folder / "ngspice"


FACTORS = (0.8, 0.9, 1.0, 1.1, 1.2)


def scaled(factor: float) -> Study:
    """The study with all resistances divided by a factor."""
    records = []
    for number, record in enumerate(STUDY.records):
        names = [terminal.name for terminal in yarn_end_terminals(STUDY.mesh)]
        matrix = PortMatrix(tuple(names), factor * matrices()[number])
        records.append(replace(record, ports=matrix))
    return replace(STUDY, records=tuple(records))


@cache
def matrices() -> list[Floats]:
    """(P, P) port matrix of each state."""
    found = []
    for record in STUDY.records:
        simple = simplified(STUDY.design, record.contacts)
        found.append(port_matrix(build_circuit(simple.contacts, yarn_end_terminals(record.contacts.mesh))).conductance)
    return found


@pytest.mark.parametrize(("end", "factor"), [("p05", 1.18), ("p50", 1.0), ("p95", 0.82)])
def test_corners_of_packings_that_differ_in_one_factor(corners: Path, end: str, factor: float) -> None:
    """The percentiles of five equidistant factors lie at 0.05 and 0.95 of their range: 0.82 and 1.18."""
    exact = [wanted(0)[place(pair)] / factor for pair in PAIRS]
    np.testing.assert_allclose(answers(ohmmeter(corners, f"fabric_ports_{end}", PAIRS)), exact, rtol=EXACT)
    strained = [wanted(2)[place(pair)] / factor for pair in PAIRS]
    found = answers(ohmmeter(corners, f"fabric_ports_{end}_stretch_s", PAIRS, "strain=0.05"))
    np.testing.assert_allclose(found, strained, rtol=SAMPLED)


@pytest.mark.parametrize(("end", "factor"), [("p05", 1.18), ("p50", 1.0), ("p95", 0.82)])
def test_corners_of_the_cell_go_with_that_factor_too(corners: Path, end: str, factor: float) -> None:
    """A network whose resistances are all f times larger is fitted by Ry and Rc f times larger."""
    plain = answers(ohmmeter(corners, "fabric_cell", PAIRS))
    np.testing.assert_allclose(answers(ohmmeter(corners, f"fabric_cell_{end}", PAIRS)), plain / factor, rtol=SAMPLED)
    plain = answers(ohmmeter(corners, "fabric_cell_stretch_s", PAIRS, "strain=0.05"))
    found = answers(ohmmeter(corners, f"fabric_cell_{end}_stretch_s", PAIRS, "strain=0.05"))
    np.testing.assert_allclose(found, plain / factor, rtol=SAMPLED)
    place = {"p05": "-1.6448536269514722", "p50": "0", "p95": "1.6448536269514722"}[end]
    found = answers(ohmmeter(corners, "fabric_cell_mc_stretch_s", PAIRS, f"strain=0.05 mc={place}"))
    np.testing.assert_allclose(found, plain / factor, rtol=SAMPLED)


@pytest.mark.parametrize(
    ("mc", "factor"),
    [
        (0.0, 1.0),
        (-1.6448536269514722, 1.18),
        (1.6448536269514722, 0.82),
        (0.8224268134757361, 0.82**0.5),
        (99.0, 0.82 ** (3 / 1.6448536269514722)),
    ],
)
def test_the_parameter_of_monte_carlo_goes_from_corner_to_corner(corners: Path, mc: float, factor: float) -> None:
    found = answers(ohmmeter(corners, "fabric_ports_mc_stretch_s", PAIRS, f"strain=0.05 mc={mc!r}"))
    np.testing.assert_allclose(found, [wanted(2)[place(pair)] / factor for pair in PAIRS], rtol=SAMPLED)
