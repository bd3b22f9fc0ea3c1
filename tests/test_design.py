"""Designs: what the files say, what plain_weave makes, loadings, and the hash."""

from __future__ import annotations

import dataclasses
import os
import pickle
import subprocess
import sys
import tomllib
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from circuittex.base.errors import DesignError
from circuittex.base.frozen import same
from circuittex.design import (
    HERTZ,
    Design,
    Electrical,
    Loading,
    Material,
    Numerics,
    Probe,
    Terminal,
    Yarn,
    biaxial,
    design_hash,
    equal_steps,
    load_design,
    load_unload,
    parse_design,
    plain_weave,
    shear,
    starter,
    uniaxial,
)

EXAMPLES = Path(__file__).parents[1] / "examples"


def stated(**tables: Any) -> Design:
    """The starter design with whole tables replaced."""
    return parse_design({**tomllib.loads(starter()), **tables})


@pytest.mark.parametrize(
    ("file", "modulus"),
    [("plain_weave.toml", 10.0), ("plain_weave_table.toml", 1.26)],  # MPa: the paper's code, its Table I
)
def test_examples_state_the_cell_of_the_paper(file: str, modulus: float) -> None:
    design = load_design(EXAMPLES / file)
    weave, law = design.weave, design.contact
    assert len(weave.warp) == len(weave.weft) == 4
    assert (weave.pitch, weave.amplitude) == (2.0, 0.525)
    for yarn in weave.yarns:
        assert yarn.rows == (3, 4, 3)
        assert (yarn.radius, yarn.spacing, yarn.row_spacing) == (0.15, 0.3, 0.3)
        for m in yarn.materials:
            assert (m.youngs_modulus, m.poisson_ratio, m.density) == (modulus, 0.0, 1.0)
            assert (m.electrical_conductivity, m.thermal_conductivity) == (10.0, 1.0)
    assert (law.penalty, law.conductivity, law.heat_transfer) == (5.0, 0.01, 0.1)
    assert [loading.name for loading in design.loading] == ["stretch"]
    assert design.loading[0].strains == (0.025, 0.05, 0.075, 0.1)
    ends = {terminal.name: terminal.ends for terminal in design.terminals}
    probes = {probe.name: (ends[probe.source], ends[probe.sink], probe.voltage) for probe in design.probes}
    common = (("warp2", 1),)  # the +x end of the x-yarn at y = -1
    assert probes == {
        "straight": ((("warp2", -1),), common, 1.0),
        "parallel": ((("warp3", -1),), common, 1.0),
        "perpendicular": ((("weft2", 1),), common, 1.0),
    }


@pytest.mark.parametrize(
    ("file", "parameters"), [("plain_weave.toml", "paper-code"), ("plain_weave_table.toml", "paper-table")]
)
def test_examples_and_python_agree(file: str, parameters: str) -> None:
    from_file = load_design(EXAMPLES / file)
    from_python = plain_weave(parameters, loading=(uniaxial("stretch", equal_steps(0.1, 4)),))
    assert same(from_file, from_python)
    assert design_hash(from_file) == design_hash(from_python)


@pytest.mark.parametrize(("file", "parameters"), [("paper.toml", "paper-code"), ("paper_table.toml", "paper-table")])
def test_the_papers_study_is_both_loadings_to_a_quarter(file: str, parameters: str) -> None:
    strains = tuple(Fraction(25, 1000) * step for step in range(1, 11))
    loading = (uniaxial("stretch", list(map(float, strains))), shear("shear", list(map(float, strains))))
    design = load_design(EXAMPLES / file)
    assert same(design, dataclasses.replace(plain_weave(parameters, loading=loading), name=design.name))
    assert parameters in design.name


def test_the_starter_is_the_first_example_with_what_follows_from_the_fibrils() -> None:
    """Hertz's penalty, a mesh by the fibrils, a network by all pairs, and a wave that stretches them less."""
    design = parse_design(tomllib.loads(starter()))
    example = load_design(EXAMPLES / "plain_weave.toml")
    assert same(design.numerics, Numerics(elements="auto", contact_points="auto"))
    assert same(design.electrical, Electrical(fit="all-pairs"))
    assert design.contact.penalty == HERTZ
    own = dataclasses.replace(
        design,
        name=example.name,
        electrical=example.electrical,
        numerics=example.numerics,
        contact=example.contact,
        weave=dataclasses.replace(design.weave, amplitude=example.weave.amplitude, pitch=example.weave.pitch),
    )
    assert same(own, example)


def test_the_starter_mentions_every_key() -> None:
    text = starter()
    for kind in (Material, Yarn, Numerics, Electrical, Probe):
        for field in dataclasses.fields(kind):
            assert field.name in text
    for key in ("strains", "gradients", "axis", "unload", "free"):  # of a loading
        assert f"{key} = " in text


def test_the_starter_file_survives_a_byte_order_mark_and_other_line_ends(tmp_path: Path) -> None:
    path = tmp_path / "entwurf ä.toml"
    path.write_bytes(b"\xef\xbb\xbf" + starter().replace("\n", "\r\n").encode())
    assert same(load_design(path), parse_design(tomllib.loads(starter())))


def test_parsing_leaves_its_input_alone() -> None:
    mapping = tomllib.loads(starter())
    parse_design(mapping)
    assert mapping == tomllib.loads(starter())


def test_one_material_for_each_fibril() -> None:
    tables = tomllib.loads(starter())
    tables["materials"]["core"] = {**tables["materials"]["fibril"], "electrical_conductivity": 0}
    yarn = tables["yarns"]["conductive"]
    del yarn["material"], yarn["row_spacing"]
    yarn["materials"] = ["fibril"] * 4 + ["core"] * 2 + ["fibril"] * 4
    kind = parse_design(tables).weave.warp[0]
    assert [m.electrical_conductivity for m in kind.materials] == [10.0] * 4 + [0.0] * 2 + [10.0] * 4
    assert kind.row_spacing == kind.spacing


def test_any_draft_and_mixed_yarns_parse() -> None:
    tables = tomllib.loads(starter())
    tables["yarns"]["thin"] = {**tables["yarns"]["conductive"], "rows": [2]}
    weave = {**tables["weave"], "draft": [[1, 1, 0], [0, 1, 1]], "warp": ["thin", "conductive"]}
    tables.update(weave=weave, terminals={"a": ["weft3+", "warp2-"]}, probes=[])
    design = parse_design(tables)
    assert design.weave.yarn_names == ("warp1", "warp2", "weft1", "weft2", "weft3")
    assert [yarn.name for yarn in design.weave.warp] == ["thin", "conductive"]
    assert design.terminals[0].ends == (("weft3", 1), ("warp2", -1))


def one_loading(**keys: Any) -> Loading:
    return stated(loading=[{"name": "l", **keys}]).loading[0]


def test_loadings() -> None:
    assert one_loading(kind="uniaxial", strain="5 %", steps=1).gradients == (((1.05, 0.0), (0.0, 1.0)),)
    assert one_loading(kind="uniaxial", axis="y", strains=[-0.5]).gradients == (((1.0, 0.0), (0.0, 0.5)),)
    assert one_loading(kind="biaxial", strains=[0.5]).gradients == (((1.5, 0.0), (0.0, 1.5)),)
    # y displacement proportional to X
    assert one_loading(kind="shear", strains=[0.25]).gradients == (((1.0, 0.0), (0.25, 1.0)),)
    there_and_back = one_loading(kind="uniaxial", strains=[0.05, "10 %", 0.05, 0])
    assert there_and_back.strains == (0.05, 0.1, 0.05, 0.0)


@pytest.mark.parametrize(
    "keys",
    [
        {"kind": "uniaxial", "axis": "y", "strain": -0.2, "steps": 2},
        {"kind": "biaxial", "strains": [0.1, "20 %"]},
        {"kind": "shear", "strain": 0.2, "steps": 2},
        {"kind": "path", "gradients": [[[1.1, 0.2], [0, 1]], [[1.1, 0.2], [0, 0.9]]], "strains": [1, 2]},
    ],
)
def test_unloading_goes_back_through_the_same_states_to_rest(keys: dict[str, Any]) -> None:
    there, back = one_loading(**keys), one_loading(**keys, unload=True)
    assert one_loading(**keys, unload=False).gradients == there.gradients
    (one, two), (first, second) = there.gradients, there.strains
    assert back.gradients == (one, two, one, ((1.0, 0.0), (0.0, 1.0)))
    assert back.strains == (first, second, first, 0.0)
    assert same(load_unload(there), back)


def test_free_lateral_edges() -> None:
    assert one_loading(kind="uniaxial", strains=[0.1]).free == ""
    strip = one_loading(kind="uniaxial", strains=[0.1], free="y", unload=True)
    assert (strip.free, strip.strains) == ("y", (0.1, 0.0))
    assert same(strip, load_unload(uniaxial("l", [0.1], free="y")))
    assert one_loading(kind="uniaxial", axis="y", strains=[0.1], free="x").free == "x"
    assert one_loading(kind="shear", strains=[0.1], free="y").free == "y"
    # Edges may be let go without any load; or under one that also moves the start of the free yarns.
    assert one_loading(kind="path", gradients=[[[1, 0], [0, 1]]], free="x").free == "x"
    assert one_loading(kind="path", gradients=[[[1.1, 0], [0, 1.1]]], free="x").free == "x"


@pytest.mark.parametrize(
    ("gradient", "size"),
    [
        ([[1.1, 0], [0, 1]], 0.1),
        ([[1, 0], [-0.25, 1]], 0.25),
        ([[0.8, 0], [0, 0.8]], 0.2),
        ([[1, 0.3], [0.3, 1]], 0.3),  # the eigenvalues of F - I are +-0.3
    ],
)
def test_a_path_is_labelled_by_its_distance_from_rest(gradient: list[list[float]], size: float) -> None:
    loading = one_loading(kind="path", gradients=[gradient])
    assert loading.gradients == (tuple(tuple(map(float, row)) for row in gradient),)
    assert loading.strains[0] == pytest.approx(size, rel=1e-14)
    assert one_loading(kind="path", gradients=[gradient], strains=[7]).strains == (7.0,)


@given(st.integers(1, 400), st.integers(1, 100))
def test_equal_steps_end_exactly_and_are_nearest(percent: int, steps: int) -> None:
    strains = equal_steps(percent / 100, steps)
    assert len(strains) == steps
    assert strains[-1] == percent / 100
    assert strains == pytest.approx([percent / 100 * (i + 1) / steps for i in range(steps)], rel=1e-14)


@pytest.mark.parametrize("yarns", [1, 2, 3, 8])
def test_plain_weave_of_other_sizes(yarns: int) -> None:
    design = plain_weave(yarns=yarns, rows=(2, 1))
    assert len(design.weave.warp) == len(design.weave.weft) == yarns
    assert all(kind.n_fibrils == 3 for kind in design.weave.yarns)
    for i, row in enumerate(design.weave.draft):
        assert list(row) == [(i + j) % 2 for j in range(yarns)]
    assert len(design.probes) == (2 if yarns == 1 else 3)
    assert design.numerics.elements == max(20, 5 * yarns)


def test_plain_weave_refuses_other_parameters() -> None:
    with pytest.raises(DesignError, match="'paper-code', 'paper-table'"):
        plain_weave("paper")
    with pytest.raises(DesignError, match=r"^yarns: 0 "):
        plain_weave(yarns=0)


# ---- the same checks hold for designs made in Python ----------------------------------------------------


def test_python_designs_are_checked_and_normalised() -> None:
    with pytest.raises(DesignError, match=r"^materials\.m\.poisson_ratio: 0\.49 "):
        Material("m", 1.0, 0.49, 1.0, 1.0, 1.0)
    with pytest.raises(DesignError, match=r"^loading\.l\.gradients\[0\]: .* determinant"):
        Loading("l", (((1.0, 0.0), (0.0, 0.0)),), (0.0,))
    with pytest.raises(DesignError, match=r"^loading\.l\.axis: 'z' .*'x', 'y'"):
        uniaxial("l", [0.1], axis="z")
    with pytest.raises(DesignError, match=r"^loading\.l\.free: 'x' .*nothing would be loaded"):
        uniaxial("l", [0.1], free="x")
    with pytest.raises(DesignError, match=r"^loading\.l\.free: None "):
        Loading("l", (((1.1, 0.0), (0.0, 1.0)),), (0.1,), free=None)  # type: ignore[arg-type]
    with pytest.raises(DesignError, match=r"^terminals\.t: 2 .*-1 or \+1"):
        Terminal("t", (("warp1", 2),))
    with pytest.raises(DesignError, match=r"^loading\.l\.strains: 2 "):
        Loading("l", (((1.0, 0.0), (0.0, 1.0)),), (0.0, 1.0))
    with pytest.raises(DesignError, match=r"^yarns\.y\.materials: 0 .*3 fibrils"):
        Yarn("y", (3,), 0.1, 0.2, 0.2, ())
    number = Material("m", np.float64(2), 0, 1, 1, 1).youngs_modulus  # type: ignore[arg-type]
    assert type(number) is float
    assert type(Numerics(elements=np.int64(8)).elements) is int  # type: ignore[arg-type]


def test_names_are_checked() -> None:
    for name in ("", "1a", "a b", "a;b", "a\n", "é", "x" * 41, ".include"):
        with pytest.raises(DesignError, match="a letter followed by"):
            Probe(name, "a", "b", 1.0)
    assert Probe("a-B_9", "a", "b", -1.0).name == "a-B_9"


@pytest.mark.parametrize("title", ["Leinwand 4 × 4", "* .include 'x'", "織物", "a" * 200])
def test_titles_are_free(title: str) -> None:
    assert stated(name=title).name == title


@pytest.mark.parametrize("title", ["", "  ", "a\nb", "a\rb", "\x1b[31m", "a\u2028b", "a\0b", "\u202eabc"])
def test_titles_hold_no_control_characters(title: str) -> None:
    with pytest.raises(DesignError, match=r"^name: "):
        stated(name=title)


# ---- hash -----------------------------------------------------------------------------------------------


def test_hash_ignores_how_the_file_is_written() -> None:
    text = starter()
    respelled = text.replace('"0.15 mm"', '"150 um"').replace('"10 MPa"', '"10 N/mm2"').replace('"10 %"', "0.1")
    respelled = respelled.replace('"1 W/(mm K)"', '"1000 W/(m K)"').replace("steps = 4", "steps=4# x\n")
    assert respelled != text
    reference = design_hash(parse_design(tomllib.loads(text)))
    assert design_hash(parse_design(tomllib.loads(respelled))) == reference
    backwards = dict(reversed(tomllib.loads(text).items()))
    assert design_hash(parse_design(backwards)) == reference
    assert len(reference) == 64


def test_hash_sees_every_value() -> None:
    design = plain_weave()
    changes: list[dict[str, Any]] = [
        {"name": "other"},
        {"loading": (uniaxial("l", [0.1]),)},
        {"loading": (biaxial("l", [0.1]),)},
        {"loading": (shear("l", [0.1]),)},
        {"loading": (shear("l", [0.1 + 1e-16]),)},
        {"loading": (shear("l", [0.1], free="y"),)},
        {"loading": (load_unload(shear("l", [0.1])),)},
        {"probes": ()},
        {"electrical": Electrical(conduction="current")},
        {"electrical": Electrical(contact_heat=False)},
        {"weave": dataclasses.replace(design.weave, pitch=2.1)},
        {"weave": dataclasses.replace(design.weave, draft=tuple(reversed(design.weave.draft)))},
    ]
    numerics = {f.name: getattr(design.numerics, f.name) for f in dataclasses.fields(Numerics)}
    other = {
        "order": 1,
        "overlap_warning": 0.2,
        "overlap_limit": 0.4,
        "tolerance": 1e-7,
        "merge_length": 2.0,
        "snap_length": 1e-4,
        "drop_fraction": 1e-7,
    }
    for name, value in numerics.items():
        changes.append({"numerics": Numerics(**{**numerics, name: other[name] if name in other else value + 1})})
    hashes = {design_hash(design)} | {design_hash(dataclasses.replace(design, **change)) for change in changes}
    assert len(hashes) == len(changes) + 1


def python(program: str) -> str:
    """What a bare process prints."""
    environment = {**os.environ, "PYTHONHASHSEED": "7", "PYTHONPATH": str(EXAMPLES.parent)}
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, env=environment)
    return run.stdout.strip()


def test_hash_is_the_same_in_another_process() -> None:
    program = "from circuittex.design import design_hash, plain_weave; print(design_hash(plain_weave()))"
    assert python(program) == design_hash(plain_weave())


def test_negative_zero_is_zero() -> None:
    minus, plus = (plain_weave(loading=(shear("l", [zero]),)) for zero in (-0.0, 0))
    assert design_hash(minus) == design_hash(plus)


def test_designs_survive_pickling() -> None:
    """Workers of an ensemble receive their design this way."""
    design = plain_weave()
    assert same(pickle.loads(pickle.dumps(design)), design)


def test_designs_are_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        plain_weave().name = "x"  # type: ignore[misc]


def test_reading_designs_imports_nothing_heavy() -> None:
    """`circuittex new` and a complaint about a design should come at once."""
    heavy = ("scipy", "skfem", "numba", "matplotlib", "networkx", "h5py", "PySpice")
    program = f"import sys, circuittex.design; print([m for m in {heavy} if m in sys.modules])"
    assert python(program) == "[]"
