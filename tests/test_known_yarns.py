"""Yarns by name: what their sources say, what a design makes of them, and where more of them may come from."""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from math import pi, sqrt
from pathlib import Path
from typing import Any

import pytest
from small_design import SMALL

from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.design import Design, Yarn, design_hash, load_design, parse_design, starter
from circuittex.design.files import fabrics
from circuittex.design.known_yarns import ENTRY_POINTS, FOLDERS, LONGEST, yarn_library
from circuittex.electrical.fields import cooling_of, solve_probes
from circuittex.results.heating import fabric_area, heating
from circuittex.results.records import Study
from circuittex.results.soundness import doubts
from circuittex.results.summary import agrees
from circuittex.study.drive import at_voltages
from circuittex.study.run import run_study

LIBRARY = yarn_library()
PAGE = (Path(__file__).parents[1] / "docs" / "data_sheet.md").read_text(encoding="utf-8")
BY_HAND, HEATER, FILE, PACKAGE = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
ROUNDING = 1e-12
"""Relative, of a few products and roots."""
OWN = """title = "Mine"
source = "My own balance and ohmmeter, 2026"
url = "none"
accessed = 2026-01-02
[yarn]
filaments = 3
linear_density = "100 dtex"
resistance = "1 ohm/mm"
material = "metal"
[materials.metal]
youngs_modulus = "10 GPa"
poisson_ratio = 0.3
density = "8 g/cm3"
thermal_conductivity = "10 W/(m K)"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with one yarn, 'mine'."""
    (tmp_path / "yarns").mkdir()
    (tmp_path / "yarns" / "mine.toml").write_text(OWN, encoding="utf-8")
    return tmp_path / "yarns"


def ohm_per_metre(yarn: Yarn) -> float:
    return float(1e3 / (pi * yarn.radius**2 * sum(each.electrical_conductivity for each in yarn.fibrils)))


def gram_per_metre(yarn: Yarn) -> float:
    return float(1e3 * pi * yarn.radius**2 * sum(each.density for each in yarn.fibrils))


def with_yarn(yarn: Mapping[str, Any], **top: Any) -> dict[str, Any]:
    """The small cell with this yarn, wide enough for any of the library."""
    mapping = tomllib.loads(SMALL)
    mapping["yarns"]["conductive"] = dict(yarn)
    mapping["weave"] |= {"amplitude": "auto"}
    return mapping | top


def first(mapping: dict[str, Any]) -> Yarn:
    return parse_design(mapping).weave.warp[0]


# What the sources say, as far as the files do not state it


def test_silver_threads_have_the_resistance_of_their_pages() -> None:
    """DFRobot: about 82 and 14 ohm per foot, of 34 and 136 filaments of some 13 dtex/2 each."""
    for name, per_foot, n in (("silver_nylon_117_17x2", 82, 34), ("silver_nylon_234_34x4", 14, 136)):
        yarn = LIBRARY[name].as_sold()
        assert yarn.n_fibrils == n
        assert ohm_per_metre(yarn) * 0.3048 == pytest.approx(per_foot, rel=1e-3)  # whole ohms, written as three digits
        assert yarn.shell is not None
        assert 1e3 < yarn.shell.electrical_conductivity < 6.3e4, "no plating beats silver"
        bulk = yarn.shell
        assert bulk.thermal_conductivity == pytest.approx(2.44e-8 * 300 * bulk.electrical_conductivity, rel=0.01)
        assert yarn.shell_thickness / yarn.radius == pytest.approx(0.01, rel=0.01)


def test_the_carbon_fibre_is_seven_micrometres_thick_as_its_sheet_says() -> None:
    yarn = LIBRARY["carbon_t300_1k"].as_sold()
    assert 2e3 * yarn.radius == pytest.approx(7, abs=0.5)  # of 66 tex, 1000 filaments and 1.76 g/cm3
    section = 1000 * pi * yarn.radius**2
    assert ohm_per_metre(yarn) == pytest.approx(1.7e-3 * 10 / section * 1e3, rel=2e-3)  # 58.8 is 1 / 1.7e-2


def test_the_litz_weighs_what_its_table_says() -> None:
    yarn = LIBRARY["copper_litz_20um_10"].as_sold()
    assert 1e3 / gram_per_metre(yarn) == pytest.approx(33344.48, rel=2e-3)  # m/kg; the radius has three digits
    assert ohm_per_metre(yarn) == pytest.approx(5.55, rel=ROUNDING)
    assert yarn.materials[0].electrical_conductivity == pytest.approx(58e3, rel=0.02), "copper, with the strands' lay"
    assert yarn.surfaces[0].electrical_conductivity == 0.0


def test_copper_clad_aluminium_scales_from_another_gauge_of_its_table() -> None:
    """AWG 14, 4109 circular mils: 3.79 ohm per 1000 ft, 0.131 lb/in3; AWG 40 has 9.610 circular mils."""
    yarn = LIBRARY["cca_15_awg40"].as_sold()
    assert ohm_per_metre(yarn) == pytest.approx(3.79 / 304.8 * 4109 / 9.610, rel=0.01)  # of 13 to 17 % of copper
    assert yarn.fibrils[0].density == pytest.approx(0.131 * 453.59237 / 16387.064, rel=0.01)


def test_steel_is_like_a_thread_that_was_measured() -> None:
    """Kobakant, 2017: a Bekinox thread has about 2 ohm per 10 cm."""
    assert ohm_per_metre(LIBRARY["steel_316l_12um_275"].as_sold()) == pytest.approx(20, rel=0.25)  # "about"


def test_every_yarn_says_where_it_is_from() -> None:
    assert len(LIBRARY) >= 6
    for name, yarn in LIBRARY.items():
        assert yarn.url.startswith("http"), name
        assert re.fullmatch(r"20\d\d-\d\d-\d\d", yarn.accessed), name
        assert len(yarn.source) > 40, name
        assert yarn.assumptions, "none of these has a source for all of its numbers"


# What a design makes of them


def test_a_name_is_its_keys_written_out() -> None:
    """Nothing of a design refers to the library: its hash is that of one which states the same by hand."""
    entry = LIBRARY["silver_nylon_117_17x2"]
    file = tomllib.loads(Path(entry.place).read_text(encoding="utf-8"))
    by_hand = with_yarn(file["yarn"] | {"material": f"{entry.name}-nylon", "shell": f"{entry.name}-silver"})
    by_hand["materials"] |= {f"{entry.name}-{label}": table for label, table in file["materials"].items()}
    named = parse_design(with_yarn({"yarn": entry.name}))
    assert design_hash(named) == design_hash(parse_design(by_hand))
    assert same(named, parse_design(by_hand))


def test_own_keys_count_before_those_of_the_library() -> None:
    name = "silver_nylon_117_17x2"
    sold = first(with_yarn({"yarn": name}))
    fewer = first(with_yarn({"yarn": name, "filaments": 3}))
    assert fewer.n_fibrils == 3
    assert ohm_per_metre(fewer) == pytest.approx(269, rel=ROUNDING), "of the yarn, whatever it is divided into"
    rows = first(with_yarn({"yarn": name, "rows": [2, 3], "spacing": "0.03 mm"}))
    assert rows.rows == (2, 3)
    other = first(with_yarn({"yarn": name, "resistance": "100 ohm/m"}))
    assert ohm_per_metre(other) == pytest.approx(100, rel=ROUNDING)
    thick = first(with_yarn({"yarn": name, "radius": "20 um"}))
    assert (thick.radius, thick.shell_thickness) == pytest.approx((0.02, sold.shell_thickness))
    soft = with_yarn({"yarn": name})
    soft["materials"][f"{name}-nylon"] = {"youngs_modulus": "1 GPa"}
    assert [first(soft).materials[0].youngs_modulus, first(soft).materials[0].density] == [
        1e3,
        sold.materials[0].density,
    ]


@pytest.mark.parametrize("name", ["carbon_t300_1k", "cca_15_awg40", "copper_litz_20um_10"])
def test_a_resistance_of_one_s_own_replaces_a_conductivity(name: str) -> None:
    size = {} if name != "carbon_t300_1k" else {"filaments": 10}
    yarn = first(with_yarn({"yarn": name, "resistance": "500 ohm/m" if size else "5.4 ohm/m"} | size))
    assert ohm_per_metre(yarn) == pytest.approx(500 if size else 5.4, rel=ROUNDING)


@pytest.mark.parametrize("order", [("sold", "other"), ("other", "sold")])
def test_a_resistance_of_one_s_own_does_not_reach_another_yarn(order: tuple[str, str]) -> None:
    """Both would be of one material: whichever came last decided the conductivity of both."""
    name = "steel_316l_12um_275"
    few = {"yarn": name, "filaments": 3}
    tables = {"sold": few, "other": {**few, "resistance": "100 ohm/m"}}
    design = with_yarn(tables[order[0]])
    design["yarns"]["second"] = tables[order[1]]
    with pytest.raises(DesignError, match=r"yarns\.second\.yarn: .* two conductivities"):
        parse_design(design)
    design["yarns"]["second"] = {**tables["other"], "material": "mine"}
    design["yarns"]["conductive"] = tables["sold"]
    steel = dict(yarn_library()[name].materials["steel"])
    del steel["electrical_conductivity"]
    design["materials"]["mine"] = steel
    design["weave"]["weft"] = "second"
    found = parse_design(design).weave
    assert [ohm_per_metre(each[0]) for each in (found.warp, found.weft)] == pytest.approx(
        [1e3 / (3 * pi * 0.006**2 * 1351), 100], rel=ROUNDING
    )


def test_a_material_of_one_s_own_needs_none_of_the_library() -> None:
    yarn = first(with_yarn({"yarn": "copper_litz_20um_10", "materials": ["fibril"] * 10}))
    assert {each.name for each in yarn.materials} == {"fibril"}


def test_an_unknown_name_is_told_what_there_is() -> None:
    with pytest.raises(DesignError) as refused:
        parse_design(with_yarn({"yarn": "silver_nylon"}))
    assert str(refused.value).startswith("yarns.conductive.yarn: 'silver_nylon' is not usable; it must be one of ")
    assert all(repr(name) in str(refused.value) for name in LIBRARY)


# Where they come from


def test_a_folder_beside_the_design(folder: Path) -> None:
    text = SMALL.replace('name = "Small study"', 'name = "Small study"\nyarn_library = "yarns"')
    text = text.replace('rows = [1]\nradius = "0.15 mm"\nspacing = "0.3 mm"\nmaterial = "fibril"', 'yarn = "mine"')
    (folder.parent / "design.toml").write_text(text, encoding="utf-8")
    yarn = load_design(folder.parent / "design.toml").weave.warp[0]
    assert (yarn.n_fibrils, yarn.materials[0].name) == (3, "mine-metal")
    assert ohm_per_metre(yarn) == pytest.approx(1e3, rel=ROUNDING)


def test_folders_of_the_environment(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDERS, str(folder))
    assert first(with_yarn({"yarn": "mine"})).n_fibrils == 3
    monkeypatch.setenv(FOLDERS, str(folder / "nowhere"))
    with pytest.raises(DesignError, match=r"'nowhere' is not usable; there is no such folder: .*nowhere$"):
        parse_design(with_yarn({"yarn": "mine"}))


def test_an_installed_package(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As pip leaves it: a package with the files, and the entry points of its distribution."""
    site = folder.parent
    folder.rename(site / "trade_yarns")
    (site / "trade_yarns" / "__init__.py").touch()
    about = site / "trade_yarns-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: trade-yarns\nVersion: 1.0\n", encoding="utf-8")
    (about / "entry_points.txt").write_text("[circuittex.yarns]\ntrade = trade_yarns\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(site))
    assert first(with_yarn({"yarn": "mine"})).n_fibrils == 3
    (about / "entry_points.txt").write_text("[circuittex.yarns]\ntrade = trade_yarn\n", encoding="utf-8")
    with pytest.raises(DesignError, match=r"the entry point 'trade' of circuittex\.yarns must name a package"):
        yarn_library()
    sys.modules.pop("trade_yarns", None)


def test_two_of_one_name_are_refused(folder: Path) -> None:
    (folder / "mine.toml").rename(folder / "carbon_t300_1k.toml")
    with pytest.raises(DesignError, match="two files have a yarn of this name"):
        yarn_library(folder)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (("accessed = 2026-01-02", 'accessed = "lately"'), "accessed: 'lately' is not usable; it must be a date"),
        (('source = "My own', 'sauce = "My own'), "did you mean 'source'"),
        (('title = "Mine"\n', ""), "title: nothing is not usable; the key is missing"),
        (("[yarn]\n", "[yarn\n"), "TOML, line 5"),
        (('density = "8 g/cm3"\n', ""), "materials.mine-metal.density: nothing is not usable"),
        (('material = "metal"', 'material = "gold"'), "yarns.mine.material: 'mine-gold' is not usable"),
    ],
)
def test_a_file_that_says_no_yarn_is_named(change: tuple[str, str], complaint: str, folder: Path) -> None:
    text = OWN.replace(*change)
    assert text != OWN
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    with pytest.raises(DesignError) as refused:
        yarn_library(folder)["mine"].as_sold()
    assert "mine.toml: " in str(refused.value)
    assert complaint in str(refused.value)


def test_what_is_no_folder_is_refused() -> None:
    with pytest.raises(DesignError, match="yarn_library: 3 is not usable; it must be the name of a folder"):
        parse_design(with_yarn({"yarn": "mine"}, yarn_library=3))


def test_the_command_lists_them_with_their_sources(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["yarns", "--folder", str(folder)]) == ExitCode.DONE
    said = " ".join(capsys.readouterr().out.split())
    for name, yarn in yarn_library(folder).items():
        assert f"{name} {yarn.title}" in said
        assert " ".join(yarn.source.split()) in said
    assert "3 filaments of" in said
    assert "1e+03 ohm/m" in said


# The page "From a data sheet to a design"


def test_the_yarn_of_the_page_is_that_of_the_library() -> None:
    by_hand = tomllib.loads(BY_HAND)
    mapping = with_yarn(by_hand["yarns"]["thread"])
    mapping["materials"] |= by_hand["materials"]
    yarn, sold = first(mapping), LIBRARY["silver_nylon_117_17x2"].as_sold()
    for key in ("rows", "radius", "shell_thickness", "spacing", "row_spacing"):
        assert getattr(yarn, key) == getattr(sold, key), key
    for one, other in zip((*yarn.fibrils, *yarn.surfaces), (*sold.fibrils, *sold.surfaces), strict=True):
        assert same(replace(one, name="any"), replace(other, name="any"))
    assert yarn.shell is not None
    assert f"{yarn.shell.electrical_conductivity / 1e3:.1f}e3 S/mm" in PAGE
    assert f"{34 / 3:.0f} times stiffer" in PAGE, "n filaments of radius R/sqrt(n) bend as R^4/n"


def test_the_numbers_of_the_page_s_script() -> None:
    """T = n pi R^2 rho by hand, and the silver as a ring of that thickness."""
    thick = 2e3 * sqrt(234e-7 / (34 * pi * 1.14e-3))
    ring = 1e3 * (277e-7 - 234e-7) / (34 * 10.49e-3 * 2 * pi * (thick / 2e3))
    assert f"That prints {thick:.1f} um and {ring:.2f} um." in PAGE


def test_the_file_of_the_page_is_a_yarn(folder: Path) -> None:
    (folder / "steel_90.toml").write_text(FILE, encoding="utf-8")
    yarn = yarn_library(folder)["steel_90"].as_sold()
    assert ohm_per_metre(yarn) == pytest.approx(60, rel=ROUNDING)
    assert 2e3 * yarn.radius == pytest.approx(14, abs=0.5), "its title"
    assert 1e6 / yarn.fibrils[0].electrical_conductivity == pytest.approx(800, rel=0.1), "steel, 740 to 800 nohm m"
    assert f"up to {LONGEST - 1} letters" in PAGE
    assert list(tomllib.loads(PACKAGE)["project"]["entry-points"]) == [ENTRY_POINTS]


# Fabrics of them


def test_new_prints_a_fabric_and_knows_which_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "--fabric", "steel_heater"]) == ExitCode.DONE
    assert capsys.readouterr().out == starter("steel_heater")
    assert main(["new", "--fabric", "silk"]) == ExitCode.DESIGN
    complaint = capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["new", "--help"])
    explained = capsys.readouterr().out
    assert len(fabrics()) == 3
    assert all(name in complaint and name in explained for name in fabrics())


def ran(fabric: str, **coarser: int) -> tuple[Design, Study]:
    """The study of a fabric as it is printed, but for a coarser mesh, which its currents along yarns do not know."""
    tables = tomllib.loads(starter(fabric))
    design = parse_design(tables | {"numerics": tables["numerics"] | coarser})
    study = run_study(design, workers=1)
    for record in study.records:
        assert record.verification.ngspice_checked
        assert agrees(record)
        assert {doubt.kind for doubt in doubts(study, record)} <= {"mesh"}
    return design, study


def test_silver_sensor_has_the_resistance_of_its_thread() -> None:
    """269 ohm/m from crossing to crossing, 1 mm, and Rc as the page says, which goes with 1/sigma_c."""
    design, study = ran("silver_sensor", elements=16, contact_points=10)
    assert len(study.records) == 2
    for record in study.records:
        assert record.fit.kind_resistance == pytest.approx([0.269], rel=2e-3)  # contacts shunt a little of it
    assert f"**{study.records[0].fit.Ry:.3f} ohm**" in PAGE
    Rc = study.records[0].fit.Rc
    assert f"says **{Rc:.2f} ohm** at rest" in PAGE
    assert study.records[1].fit.Rc < Rc
    other = replace(design, loading=(), contact=replace(design.contact, conductivity=2.5e3))
    assert f"the run says **{run_study(other).records[0].fit.Rc:.2f} ohm**" in PAGE


def test_steel_heater_conducts_along_its_warp_alone() -> None:
    design, study = ran("steel_heater", elements=40, contact_points=8)
    (record,) = study.records
    length = 2 * design.weave.directions[0].step
    assert record.currents[0] == pytest.approx(0.01 / (23.8e-3 * length), rel=1e-2)  # radius of three digits
    assert record.fit.kinds == ("heater warp",)
    heater = parse_design(tomllib.loads(starter("steel_heater")) | tomllib.loads(HEATER))
    driven = at_voltages(heater, record.contacts, fabric_area(record.contacts.mesh, record.configuration))
    cooling = cooling_of(heater, study.mesh)
    fields = solve_probes(record.contacts, driven.terminals, driven.probes, cooling=cooling)
    (heat,) = heating(replace(study, design=heater), replace(record, fields=fields))
    assert heat.power_density == pytest.approx(0.05, rel=1e-9)
    assert f"**{heat.rise:.0f} K**" in PAGE
    assert f"**{heat.rated_power_density:.3f} W/cm2**" in PAGE


def test_copper_bus_feeds_what_touches_bare_copper_alone() -> None:
    _, study = ran("copper_bus", elements=32, contact_points=10)
    (record,) = study.records
    fed, along = record.currents
    assert 0.0 < fed < 0.01 / 0.269, "through a crossing and a millimetre of thread"
    assert along == pytest.approx(0.01 / (2 * 5.55e-3), rel=1e-6), "the litz loses nothing to what it crosses"
