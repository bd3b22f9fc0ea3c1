"""Temperature coefficients and tolerances of a design come through to the exported parts."""

from __future__ import annotations

import json
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from gnucap import needs_gnucap
from library_cases import listed, ohmmeter, pins_of, resistor_matrix, study

from circuittex.base.arrays import Floats
from circuittex.design import Design, Yarn
from circuittex.electrical.network.circuit import build_circuit, yarn_end_terminals
from circuittex.electrical.network.ports import PortMatrix, port_matrix, resistances
from circuittex.electrical.spice.ngspice import run_deck
from circuittex.results.records import Study
from circuittex.study.export import simplified
from circuittex.study.library.export import export_library
from circuittex.study.library.network import Network
from circuittex.study.library.temperature import coefficients

pytestmark = pytest.mark.xdist_group("library_temperature")  # what its fixtures make serves one worker

FIBRIL, CONTACT = (0.0039, 6e-7), (-0.0012, 2e-6)
"""tc1 and tc2 of the fibrils, about those of copper, and of the contacts, whose resistance falls."""
FITS = [1.0, 1e-3], [0.8, 3.0], [1.2, 2.0]
"""ohm, at 27 C, 50 K below and 50 K above."""
PAIRS = [("warp1_minus", "warp1_plus"), ("warp1_minus", "weft2_plus"), ("weft1_minus", "warp2_plus")]
EXACT = 1e-8
"""ngspice at 50 K: coefficients are written with 10 digits; what else it loses is its own pivoting."""


def warm_study(fibril: tuple[float, float], contact: tuple[float, float], **more: float) -> Study:
    """The made-up study with coefficients in its design; its ports are those of its circuits."""
    made = study(2)
    weave = made.design.weave

    def yarns(those: tuple) -> tuple:  # type: ignore[type-arg]
        return tuple(
            replace(y, materials=tuple(replace(m, tc1=fibril[0], tc2=fibril[1], **more) for m in y.materials))
            for y in those
        )

    design = replace(
        made.design,
        weave=replace(weave, warp=yarns(weave.warp), weft=yarns(weave.weft)),
        contact=replace(made.design.contact, tc1=contact[0], tc2=contact[1], **more),
    )
    return replace(made, design=design)


def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """The page is not what is looked at, and takes most of the time."""
    monkeypatch.setattr("circuittex.study.library.export.write_datasheet", lambda *_: None)


def truth(design: Design, made: Study, state: int, fibril: float | Floats, contact: float) -> Floats:
    """Resistances with conductivities divided by these factors, by a circuit made of them."""
    simple = simplified(design, made.records[state].contacts).contacts
    mesh = replace(simple.mesh, electrical_conductivity=simple.mesh.electrical_conductivity / fibril)
    warm = replace(simple, mesh=mesh, conductance=simple.conductance / contact)
    return resistances(port_matrix(build_circuit(warm, yarn_end_terminals(mesh))))


def law(tc: tuple[float, float], dT: float) -> float:
    return 1.0 + tc[0] * dT + tc[1] * dT**2


@pytest.fixture(autouse=True)
def _nothing_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for what the module's fixtures export."""
    undrawn(monkeypatch)


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Study]:
    folder = tmp_path_factory.mktemp("warm")
    made = warm_study(FIBRIL, CONTACT)
    with pytest.MonkeyPatch.context() as monkeypatch:
        undrawn(monkeypatch)
        export_library(made, folder, dialects=("ngspice", "gnucap"))
    assert "Resistance against temperature" in (folder / "datasheet.html").read_text("utf-8")
    return folder, made


def measured(folder: Path, name: str, dT: float, given: str = "") -> Floats:
    extra = f".temp {27.0 + dT}"
    decks = ohmmeter(folder / "ngspice", name, PAIRS, given, extra)
    return np.array([float(run_deck(deck).plots[-1].voltage(["in"])[-1, 0]) for deck in decks])


@pytest.mark.parametrize("dT", [-50.0, 25.0, 50.0])
def test_ngspice_at_a_temperature_answers_as_the_circuit_of_its_conductivities(
    warm: tuple[Path, Study], dT: float
) -> None:
    folder, made = warm
    whole = truth(made.design, made, 0, law(FIBRIL, dT), law(CONTACT, dT))
    pins = pins_of((folder / "ngspice" / "fabric_ports.lib").read_text("ascii"))
    wanted = np.array([whole[pins.index(a), pins.index(b)] for a, b in PAIRS])
    cold = np.array([truth(made.design, made, 0, 1.0, 1.0)[pins.index(a), pins.index(b)] for a, b in PAIRS])
    assert np.abs(wanted / cold - 1.0).max() > 0.01
    np.testing.assert_allclose(measured(folder, "fabric_detailed", dT), wanted, rtol=EXACT)
    # Between 27 C and 50 K from it the parabolas of the reduced resistors err: the file says by how much.
    head = (folder / "ngspice" / "fabric_ports.lib").read_text("ascii")
    (said,) = re.findall(r"errs by (\S+) at worst within 50 K", head)
    assert float(said) < 1e-3
    bound = EXACT if abs(dT) == 50.0 else 1.05 * float(said) + EXACT  # printed with two digits
    np.testing.assert_allclose(measured(folder, "fabric_ports", dT), wanted, rtol=bound)


@pytest.mark.parametrize("name", ["fabric_ports_stretch", "fabric_cell_stretch", "fabric_unit_stretch"])
def test_strain_as_parameter_and_as_pin_have_the_same_temperature(warm: tuple[Path, Study], name: str) -> None:
    folder, _ = warm
    for lib in (f"{name}_s", f"{name}_v"):
        assert (folder / "ngspice" / f"{lib}.lib").exists()
    pair = [("w", "n")] if "unit" in name else PAIRS[:1]
    by_dT = {}
    for dT in (0.0, 50.0):
        (by_parameter,) = ohmmeter(folder / "ngspice", f"{name}_s", pair, "strain=0.025", f".temp {27.0 + dT}")
        (by_pin,) = ohmmeter(folder / "ngspice", f"{name}_v", pair, "", f"Vs strain 0 0.025\n.temp {27.0 + dT}")
        ohm = [float(run_deck(deck).plots[-1].voltage(["in"])[-1, 0]) for deck in (by_parameter, by_pin)]
        assert ohm[1] == pytest.approx(ohm[0], rel=1e-6)  # the resistor of 1e9 and ngspice's reltol
        by_dT[dT] = ohm[0]
    assert abs(by_dT[50.0] / by_dT[0.0] - 1.0) > 0.01


@needs_gnucap
def test_gnucap_follows_the_temperature(warm: tuple[Path, Study]) -> None:
    folder, made = warm
    (deck,) = ohmmeter(folder / "gnucap", "fabric_ports", PAIRS[:1])
    path = folder / "gnucap.cir"
    path.write_text(deck.replace(".op\n", ".print op v(in)\n.op 27 77 50\n"), encoding="ascii")
    out = subprocess.run(["gnucap", "-b", str(path)], capture_output=True, text=True, timeout=60, check=False).stdout
    rows = [line.split() for line in out.splitlines() if re.match(r"\s*(27|77)\.", line)]
    whole = truth(made.design, made, 0, law(FIBRIL, 50.0), law(CONTACT, 50.0))
    assert len(rows) == 2
    assert float(rows[1][1]) == pytest.approx(whole[0, 1], rel=1e-3)  # it prints five digits, milli and micro aside


def test_one_coefficient_for_all_is_that_of_every_resistor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where all resistivities go alike, so does every reduced or fitted resistance."""
    without_pictures(monkeypatch)
    export_library(warm_study(FIBRIL, FIBRIL), tmp_path, dialects=("ngspice",))
    for name in ("fabric_detailed", "fabric_ports", "fabric_cell", "fabric_unit"):
        text = (tmp_path / "ngspice" / f"{name}.lib").read_text("ascii")
        found = re.findall(r"^R.* tc1=(\S+) tc2=(\S+)$", text, re.MULTILINE)
        assert found
        # A fit ends with some 1e-8: over 50 K, or its square.
        np.testing.assert_allclose(np.array(found, dtype=float), [FIBRIL] * len(found), rtol=0, atol=1e-9)


def test_yarns_that_nothing_joins_have_the_coefficients_of_their_fibrils(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Crossings that do not conduct had a resistance, another one at each temperature, and no library came of it."""
    without_pictures(monkeypatch)
    made = warm_study(FIBRIL, CONTACT)
    apart = [
        replace(record, contacts=replace(record.contacts, conductance=0.0 * record.contacts.conductance))
        for record in made.records
    ]
    export_library(replace(made, records=tuple(apart)), tmp_path, dialects=("ngspice",))
    text = (tmp_path / "ngspice" / "fabric_cell.lib").read_text("ascii")
    found = re.findall(r"^R(\S+) .* tc1=(\S+) tc2=(\S+)$", text, re.MULTILINE)
    assert {name[:2] for name, *_ in found} == {"ry"}
    np.testing.assert_allclose(np.array([tc for _, *tc in found], dtype=float), [FIBRIL] * len(found), atol=1e-9)


def test_a_resistance_that_no_fit_determines_has_the_coefficients_of_the_others() -> None:
    """One that is 3 ohm, 1e-3 ohm and 2 ohm in turn would be negative at some temperature between."""
    ends = (("a", "b"), ("b", "c"))
    fits = [Network(("a", "c"), ("r", "lost"), ends, np.zeros(1), 1.0 / np.array([ohm])) for ohm in FITS]
    np.testing.assert_allclose(coefficients(*fits), [[0.004, 0.0]] * 2, atol=1e-12)
    tame = [1.0, 1.0], [0.9, 0.9], [1.1, 1.1]
    two = [
        Network(("a", "c"), ("r", "lost"), ends, np.arange(2.0), 1.0 / np.array(ohm))
        for ohm in zip(FITS, tame, strict=True)
    ]
    np.testing.assert_allclose(coefficients(*two), [[0.003, 0.0], [0.002, 0.0]], atol=1e-12)


def test_a_design_without_coefficients_writes_no_word_of_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without_pictures(monkeypatch)
    export_library(study(2), tmp_path, dialects=("ngspice",))
    assert listed(tmp_path, "ngspice")
    for path in (tmp_path / "ngspice").glob("*.lib"):
        assert not re.search("tc1|temper", path.read_text("ascii"))


def test_tolerances_bound_every_resistance(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fibrils and contacts alike by 10 %: every resistance between two pins is, too, and in the file."""
    without_pictures(monkeypatch)
    made = warm_study((0.0, 0.0), (0.0, 0.0), tolerance=0.1)
    export_library(made, tmp_path, dialects=("ngspice",))
    said = json.loads((tmp_path / "library.json").read_text("ascii"))["tolerance"]
    assert said == {"fall": pytest.approx(-0.1, rel=1e-9), "rise": pytest.approx(0.1, rel=1e-9)}
    for end, factor in (("_tmin", 0.9), ("_tmax", 1.1)):
        _, G = resistor_matrix((tmp_path / "ngspice" / f"fabric_ports{end}.lib").read_text("ascii"))
        whole = truth(made.design, made, 0, factor, factor)
        pins = tuple(str(k) for k in range(len(G)))
        np.testing.assert_allclose(resistances(PortMatrix(pins, G)), whole, rtol=1e-9)  # rounding of two eliminations


@pytest.mark.parametrize("tol", [-1.0, -0.5, 0.0, 0.3, 1.0, 4.0])
def test_one_tolerance_for_all_is_a_parameter(tol: float, tolerated: tuple[Path, Study]) -> None:
    """All resistivities within 10 % alike: every resistance is times 1 + 0.1 tol, tol held to -1 and 1."""
    folder, made = tolerated
    whole = truth(made.design, made, 0, 1.0, 1.0)
    pins = pins_of((folder / "ngspice" / "fabric_ports.lib").read_text("ascii"))
    wanted = np.array([whole[pins.index(a), pins.index(b)] for a, b in PAIRS]) * (1 + 0.1 * min(tol, 1.0))
    decks = ohmmeter(folder / "ngspice", "fabric_ports_tol", PAIRS, f"tol={tol}")
    found = [float(run_deck(deck).plots[-1].voltage(["in"])[-1, 0]) for deck in decks]
    np.testing.assert_allclose(found, wanted, rtol=EXACT)


def test_tolerance_and_strain_are_parameters_together(tolerated: tuple[Path, Study]) -> None:
    folder, made = tolerated
    whole = truth(made.design, made, 1, 1.0, 1.0)
    pins = pins_of((folder / "ngspice" / "fabric_ports.lib").read_text("ascii"))
    wanted = np.array([whole[pins.index(a), pins.index(b)] for a, b in PAIRS]) * 0.95
    decks = ohmmeter(folder / "ngspice", "fabric_ports_tol_stretch_s", PAIRS, "strain=0.025 tol=-0.5")
    found = [float(run_deck(deck).plots[-1].voltage(["in"])[-1, 0]) for deck in decks]
    np.testing.assert_allclose(found, wanted, rtol=1e-6)  # what is asked of strain as an input


@pytest.fixture(scope="module")
def tolerated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Study]:
    folder, made = tmp_path_factory.mktemp("tolerated"), warm_study((0.0, 0.0), (0.0, 0.0), tolerance=0.1)
    with pytest.MonkeyPatch.context() as monkeypatch:
        without_pictures(monkeypatch)
        export_library(made, folder, dialects=("ngspice",))
    return folder, made


def test_tolerances_that_differ_err_between_their_ends_by_what_the_file_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fibrils by 20 %, contacts by 50 %: half way, against the circuit of those resistivities."""
    without_pictures(monkeypatch)
    made = warm_study((0.0, 0.0), (0.0, 0.0), tolerance=0.2)
    made = replace(made, design=replace(made.design, contact=replace(made.design.contact, tolerance=0.5)))
    export_library(made, tmp_path, dialects=("ngspice",))
    text = (tmp_path / "ngspice" / "fabric_ports_tol.lib").read_text("ascii")
    (said,) = re.findall(r"err by (\S+) at worst half way", text)
    assert 0.0 < float(said) < 0.02
    pins = pins_of(text)
    for tol in (-0.5, 0.5):
        whole = truth(made.design, made, 0, 1 + 0.2 * tol, 1 + 0.5 * tol)
        wanted = np.array([whole[pins.index(a), pins.index(b)] for a, b in PAIRS])
        decks = ohmmeter(tmp_path / "ngspice", "fabric_ports_tol", PAIRS, f"tol={tol}")
        found = [float(run_deck(deck).plots[-1].voltage(["in"])[-1, 0]) for deck in decks]
        np.testing.assert_allclose(found, wanted, rtol=1.05 * float(said) + EXACT)  # printed with two digits


WARP = (0.0004, 0.0)
"""tc1 and tc2 of the warp's fibrils in the mixed study: a tenth of those of the weft."""


def mixed_study() -> Study:
    """The warp of another material than the weft, and contacts of a third kind."""
    made = warm_study(FIBRIL, CONTACT)

    def renamed(yarn: Yarn) -> Yarn:
        own = tuple(replace(m, name=f"{m.name}_warp", tc1=WARP[0], tc2=WARP[1]) for m in yarn.materials)
        return replace(yarn, name=f"{yarn.name}_warp", materials=own)

    weave = made.design.weave
    return replace(made, design=replace(made.design, weave=replace(weave, warp=tuple(map(renamed, weave.warp)))))


def test_a_sweep_of_temperature_with_two_materials(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`.dc temp` in ngspice, warp and weft and contacts each with a law of its own, against circuits of theirs."""
    without_pictures(monkeypatch)
    made = mixed_study()
    export_library(made, tmp_path, dialects=("ngspice",))
    n_warp, mesh = len(made.design.weave.warp), made.records[0].contacts.mesh
    of_warp = mesh.yarn < n_warp
    sweep = np.arange(-50.0, 75.0, 25.0)
    for name in ("fabric_detailed", "fabric_ports"):
        text = (tmp_path / "ngspice" / f"{name}.lib").read_text("ascii")
        said = re.findall(r"errs by (\S+) at worst within 50 K", text)
        pins = pins_of(text)
        i, j = (pins.index(pin) for pin in PAIRS[1])
        (deck,) = ohmmeter(tmp_path / "ngspice", name, PAIRS[1:2])
        found = run_deck(deck.replace(".op\n", ".dc temp -23 77 25\n")).plots[-1].voltage(["in"])[:, 0]
        wanted = [
            truth(made.design, made, 0, np.where(of_warp, law(WARP, dT), law(FIBRIL, dT)), law(CONTACT, dT))[i, j]
            for dT in sweep
        ]
        np.testing.assert_allclose(found, wanted, rtol=(1.05 * float(said[0]) if said else 0.0) + EXACT)
        assert max(wanted) / min(wanted) > 1.05
