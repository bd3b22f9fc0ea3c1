"""Malformed designs: each gives one error, on one line, that names the field and says what is allowed."""

from __future__ import annotations

import copy
import datetime
import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from fabrics import fibrils_through, straight

from circuittex.base.errors import DesignError
from circuittex.contact.curve import curve_table
from circuittex.design import design_hash, load_design, parse_design, plain_weave, starter
from circuittex.geometry import build_mesh

MISSING = object()
Keys = tuple[str | int, ...]


def changed(*changes: tuple[Keys, Any]) -> dict[str, Any]:
    """The starter design with values replaced, added, or removed (MISSING)."""
    design = copy.deepcopy(tomllib.loads(starter()))
    design["weave"]["pitch"] = "2 mm"  # that of the lengths in the messages
    for keys, value in changes:
        place: Any = design
        for key in keys[:-1]:
            place = place[key]
        if value is MISSING:
            del place[keys[-1]]
        else:
            place[keys[-1]] = copy.deepcopy(value)
    return design


LOADING: Keys = ("loading", 0)
YARN: Keys = ("yarns", "conductive")
MATERIAL: Keys = ("materials", "fibril")
ONE_CROSSING: list[tuple[Keys, Any]] = [(("weave", "draft"), [[1]]), (("terminals",), {}), (("probes",), [])]
PATH = (LOADING, {"name": "p", "kind": "path"})

# keys and values that are changed, field of the error, a phrase of what is allowed
BAD: list[tuple[list[tuple[Keys, Any]], str, str]] = [
    # layout: missing, unknown and repeated things
    ([(("format",), MISSING)], "format", "missing"),
    ([(("format",), 2)], "format", "format = 1"),
    ([(("format",), True)], "format", "format = 1"),
    ([(("name",), MISSING)], "name", "missing"),
    ([(("name",), 3)], "name", "must be text"),
    ([(("name",), "two\nlines")], "name", "control characters"),
    ([(("name",), " ")], "name", "one line of text"),
    ([(("name",), "x" * 201)], "name", "200 characters"),
    ([(("wave",), {})], "wave", "did you mean 'weave'?"),
    ([(("qqq",), 1)], "qqq", "the keys known here are format, name"),
    ([(("a\nb",), 1)], '"a\\nb"', "unknown key"),
    ([(("k" * 1000,), 1)], "k" * 60 + "...", "unknown key"),
    ([(("terminals", "k" * 41), ["warp1+"])], "terminals." + "k" * 41, "at most 39"),
    ([(("weave",), MISSING)], "weave", "missing"),
    ([(("weave",), 3)], "weave", "must be a table"),
    ([(("contact",), MISSING)], "contact", "missing"),
    ([(("materials",), MISSING)], "materials", "missing"),
    ([(("yarns",), {})], "yarns", "at least one"),
    ([(("loading",), {"name": "x"})], "loading", "must be a list"),
    ([(("probes",), [3])], "probes[0]", "must be a table"),
    # materials
    ([((*MATERIAL, "youngs_modulus"), MISSING)], "materials.fibril.youngs_modulus", "missing"),
    ([((*MATERIAL, "youngs_moduls"), 1)], "materials.fibril.youngs_moduls", "did you mean 'youngs_modulus'?"),
    ([((*MATERIAL, "youngs_modulus"), "10 mm")], "materials.fibril.youngs_modulus", "in MPa or a unit of the same"),
    ([((*MATERIAL, "youngs_modulus"), "10 bananas")], "materials.fibril.youngs_modulus", "'bananas' is not a unit"),
    ([((*MATERIAL, "youngs_modulus"), "10")], "materials.fibril.youngs_modulus", "in MPa"),
    ([((*MATERIAL, "youngs_modulus"), 0)], "materials.fibril.youngs_modulus", "> 0 and <= 1e+09 MPa"),
    ([((*MATERIAL, "youngs_modulus"), float("nan"))], "materials.fibril.youngs_modulus", "finite"),
    ([((*MATERIAL, "youngs_modulus"), float("inf"))], "materials.fibril.youngs_modulus", "finite"),
    ([((*MATERIAL, "youngs_modulus"), 1e300)], "materials.fibril.youngs_modulus", "> 0 and <= 1e+09 MPa"),
    ([((*MATERIAL, "youngs_modulus"), True)], "materials.fibril.youngs_modulus", "a number in MPa"),
    ([((*MATERIAL, "youngs_modulus"), [10])], "materials.fibril.youngs_modulus", "a number in MPa"),
    ([((*MATERIAL, "poisson_ratio"), 0.5)], "materials.fibril.poisson_ratio", ">= 0 and <= 0.45"),
    ([((*MATERIAL, "poisson_ratio"), -0.1)], "materials.fibril.poisson_ratio", ">= 0 and <= 0.45"),
    ([((*MATERIAL, "poisson_ratio"), "0.3 mm")], "materials.fibril.poisson_ratio", "plain number"),
    ([((*MATERIAL, "density"), 0.0)], "materials.fibril.density", "> 0 and <= 1e+06 g/mm3"),
    ([((*MATERIAL, "electrical_conductivity"), -1)], "materials.fibril.electrical_conductivity", ">= 0 and <= 1e+09"),
    ([((*MATERIAL, "thermal_conductivity"), 0)], "materials.fibril.thermal_conductivity", "> 0 and <= 1e+09 W/(mm K)"),
    ([(("materials", "a b"), {})], 'materials."a b"', "a letter followed by"),
    # yarns
    ([((*YARN, "radius"), -0.15)], "yarns.conductive.radius", "> 0 and <= 10000 mm"),
    ([((*YARN, "radius"), MISSING)], "yarns.conductive.radius", "missing"),
    ([((*YARN, "spacing"), "0.3 ohm")], "yarns.conductive.spacing", "in mm"),
    ([((*YARN, "row_spacing"), 0)], "yarns.conductive.row_spacing", "> 0 mm"),
    ([((*YARN, "rows"), [])], "yarns.conductive.rows", "such as [3, 4, 3]"),
    ([((*YARN, "rows"), 10)], "yarns.conductive.rows", "must be a list"),
    ([((*YARN, "rows"), [3, 0])], "yarns.conductive.rows[1]", "from 1 to 10000"),
    ([((*YARN, "rows"), [3.0])], "yarns.conductive.rows[0]", "whole number"),
    ([((*YARN, "rows"), [10**12])], "yarns.conductive.rows[0]", "from 1 to 10000"),
    ([((*YARN, "rows"), [10**4] * 3)], "yarns.conductive.rows", "at most 10000 fibrils"),
    ([((*YARN, "material"), "gold")], "yarns.conductive.material", "one of 'fibril'"),
    ([((*YARN, "material"), MISSING)], "yarns.conductive.material", "missing"),
    ([((*YARN, "materials"), ["fibril"] * 10)], "yarns.conductive.materials", "not both"),
    (
        [((*YARN, "material"), MISSING), ((*YARN, "materials"), ["fibril"] * 9)],
        "yarns.conductive.materials",
        "10 material names",
    ),
    (
        [((*YARN, "material"), MISSING), ((*YARN, "materials"), ["fibril"] * 9 + ["gold"])],
        "yarns.conductive.materials[9]",
        "one of 'fibril'",
    ),
    ([(("yarns", "1st"), {})], "yarns.1st", "a letter followed by"),
    # weave
    ([(("weave", "draft"), [])], "weave.draft", "rows of 0 and 1"),
    ([(("weave", "draft"), [[]])], "weave.draft[0]", "rows of 0 and 1"),
    ([(("weave", "draft"), "0101")], "weave.draft", "rows of 0 and 1"),
    ([(("weave", "draft"), [[0, 1], [1]])], "weave.draft[1]", "as many entries as the first, 2"),
    ([(("weave", "draft"), [[0, 2], [1, 0]])], "weave.draft[0][1]", "from 0 to 1"),
    ([(("weave", "draft"), [[0, True], [1, 0]])], "weave.draft[0][1]", "from 0 to 1"),
    ([(("weave", "warp"), "cotton")], "weave.warp", "one of 'conductive'"),
    ([(("weave", "warp"), ["conductive"] * 3)], "weave.warp", "needs 4 yarns, one for each row"),
    ([(("weave", "weft"), ["conductive"] * 5)], "weave.weft", "needs 4 yarns, one for each column"),
    ([(("weave", "weft"), ["conductive"] * 3 + ["silk"])], "weave.weft[3]", "one of 'conductive'"),
    ([(("weave", "pitch"), "0 mm")], "weave.pitch", "> 0 mm"),
    ([(("weave", "amplitude"), -0.5)], "weave.amplitude", ">= 0 mm"),
    # contact
    ([(("contact", "penalty"), 0)], "contact.penalty", "> 0 N/mm2"),
    ([(("contact", "conductivity"), "0.01 S/mm")], "contact.conductivity", "in S/mm2"),
    ([(("contact", "heat_transfer"), -0.1)], "contact.heat_transfer", ">= 0 W/(mm2 K)"),
    ([(("contact", "law"), "hollow")], "contact.law", "one of 'paper', 'strip', 'crossed', 'holm', 'film', 'power'"),
    ([(("contact", "law"), "power")], "contact.reference_conductance", "> 0 where contact.law is 'power'"),
    ([(("contact", "exponent"), 3)], "contact.exponent", "<= 2"),
    # loading
    ([((*LOADING, "kind"), "twist")], "loading.stretch.kind", "'uniaxial', 'biaxial', 'shear', 'path'"),
    ([((*LOADING, "kind"), MISSING)], "loading.stretch.kind", "missing"),
    ([((*LOADING, "name"), MISSING)], "loading[0].name", "missing"),
    ([((*LOADING, "name"), "../x")], "loading[0].name", "a letter followed by"),
    ([((*LOADING, "axis"), "z")], "loading.stretch.axis", "'x', 'y'"),
    ([((*LOADING, "kind"), "biaxial")], "loading.stretch.axis", "of kind 'biaxial' takes 'strain', 'steps', 'strains'"),
    ([((*LOADING, "strain"), -1)], "loading.stretch.strain", "> -1"),
    ([((*LOADING, "strain"), 0)], "loading.stretch.strain", "must not be 0"),
    ([((*LOADING, "strain"), "1 mm")], "loading.stretch.strain", "plain number"),
    ([((*LOADING, "steps"), 0)], "loading.stretch.steps", "from 1 to 10000"),
    ([((*LOADING, "steps"), 2.5)], "loading.stretch.steps", "whole number"),
    ([((*LOADING, "steps"), MISSING)], "loading.stretch.steps", "missing"),
    ([((*LOADING, "strains"), [0.1])], "loading.stretch.strain", "not both"),
    ([(LOADING, {"name": "s", "kind": "shear", "strains": []})], "loading.s.strains", "at least one"),
    ([(LOADING, {"name": "s", "kind": "biaxial", "strains": [0.1, -2]})], "loading.s.strains[1]", "> -1"),
    ([PATH], "loading.p.gradients", "missing"),
    ([PATH, ((*LOADING, "gradients"), [])], "loading.p.gradients", "at least one"),
    ([PATH, ((*LOADING, "gradients"), [[1, 0, 0, 1]])], "loading.p.gradients[0]", "matrix [[Fxx, Fxy]"),
    ([PATH, ((*LOADING, "gradients"), [[[1, 0], [0, -1]]])], "loading.p.gradients[0]", "determinant must be > 0"),
    ([PATH, ((*LOADING, "gradients"), [[[1, 0], [0, "a"]]])], "loading.p.gradients[0][1]", "a number"),
    (
        [PATH, ((*LOADING, "gradients"), [[[1, 0], [0, 1]]]), ((*LOADING, "strains"), [0, 1])],
        "loading.p.strains",
        "1 gra",
    ),
    ([(("loading",), [tomllib.loads(starter())["loading"][0]] * 2)], "loading.name", "taken by 'stretch'"),
    ([((*LOADING, "unload"), 1)], "loading.stretch.unload", "true or false"),
    ([((*LOADING, "unload"), True), ((*LOADING, "steps"), 5001)], "loading.stretch.unload", "at most 10000 states"),
    ([((*LOADING, "free"), "z")], "loading.stretch.free", "one of 'x', 'y'"),
    ([((*LOADING, "free"), True)], "loading.stretch.free", "one of 'x', 'y'"),
    ([((*LOADING, "free"), "x")], "loading.stretch.free", "no state moves the ends of the yarns along 'y'"),
    (
        [(LOADING, {"name": "s", "kind": "shear", "strains": [0, 0.1], "free": "x"})],
        "loading.s.free",
        "nothing would be loaded",
    ),
    (
        [(LOADING, {"name": "b", "kind": "biaxial", "strains": [0.1], "free": "y"})],
        "loading.b.free",
        "of kind 'biaxial' takes 'strain', 'steps', 'strains', 'unload'",
    ),
    # terminals and probes
    ([(("terminals", "common"), "warp2+")], "terminals.common", "list of yarn ends"),
    ([(("terminals", "common"), [])], "terminals.common", "at least one yarn end"),
    ([(("terminals", "common"), ["warp2"])], "terminals.common[0]", "followed by + or -"),
    ([(("terminals", "common"), ["warp9+"])], "terminals.common", "warp1 to warp4 and weft1 to weft4"),
    ([(("terminals", "common"), ["warp2+", "warp2+"])], "terminals.common", "listed twice"),
    ([(("terminals", "COMMON"), ["warp1+"])], "terminals", "differ in more than case"),
    ([(("terminals", "x;y"), ["warp1+"])], 'terminals."x;y"', "a letter followed by"),
    ([(("terminals", "common"), ["warp2-"])], "probes.straight.sink", "shares the yarn end warp2-"),
    ([(("terminals",), MISSING)], "probes.straight.source", "there are none"),
    ([(("probes", 0, "source"), "left")], "probes.straight.source", "name of a terminal"),
    ([(("probes", 0, "sink"), "straight")], "probes.straight.sink", "another terminal than the source"),
    ([(("probes", 0, "voltage"), 0)], "probes.straight.voltage", "must not be 0 V"),
    ([(("probes", 0, "voltage"), "1 A")], "probes.straight.voltage", "in V"),
    ([(("probes", 0, "volts"), 1)], "probes.straight.volts", "did you mean 'voltage'?"),
    ([(("probes", 1, "name"), "Straight")], "probes.name", "taken by 'straight'"),
    ([(("probes", 1, "name"), "a" * 41)], "probes[1].name", "at most 39"),
    # electrical and numerics
    ([(("electrical", "conduction"), "ohmic")], "electrical.conduction", "'reference', 'current'"),
    ([(("electrical", "contact_heat"), 1)], "electrical.contact_heat", "true or false"),
    ([(("numerics", "elements"), 1)], "numerics.elements", "from 2 to 10000"),
    ([(("numerics", "elements"), 3)], "numerics.elements", "at least 4: two nodes for each of 4 crossings"),
    ([(("numerics", "elements"), 8000)], "numerics.elements", "80 fibrils of that many elements exceed 500000"),
    ([(("numerics", "order"), 3)], "numerics.order", "from 1 to 2"),
    ([(("numerics", "order"), "2")], "numerics.order", "whole number"),
    ([(("numerics", "contact_points"), 0)], "numerics.contact_points", "from 1 to 40"),
    ([(("numerics", "section_degree"), 3)], "numerics.section_degree", "from 6"),
    ([(("numerics", "tolerance"), 0)], "numerics.tolerance", "> 0 and <= 0.1 or a text in N"),
    ([(("numerics", "tolerance"), 0.2)], "numerics.tolerance", "> 0 and <= 0.1 or a text in N"),
    ([(("numerics", "tolerance"), "0 N")], "numerics.tolerance", "> 0 N"),
    ([(("numerics", "tolerance"), "1 mm")], "numerics.tolerance", "in N or a unit of the same dimension"),
    ([(("numerics", "merge_length"), "half")], "numerics.merge_length", "mm"),
    ([(("numerics", "max_iterations"), 0)], "numerics.max_iterations", "from 1"),
    ([(("numerics", "merge_length"), -1)], "numerics.merge_length", ">= 0 mm"),
    ([(("numerics", "merge_length"), 8.1)], "numerics.merge_length", "at most 8 mm, the length of the longest fibril"),
    ([(("numerics", "merge_length"), "1 m")], "numerics.merge_length", "at most 8 mm"),
    ([(("numerics", "snap_length"), -1)], "numerics.snap_length", ">= 0 mm"),
    ([(("numerics", "snap_length"), 9)], "numerics.snap_length", "at most 0.02857 mm, a tenth of the shortest element"),
    ([(("numerics", "snap_length"), "0.029 mm")], "numerics.snap_length", "at most 0.02857 mm"),
    (
        [*ONE_CROSSING, (("numerics", "elements"), 2), (("numerics", "order"), 1)],
        "numerics.elements",
        "2 is not usable; it must be at least 3: contact needs four nodes on every fibril, at order 1",
    ),
    ([(("numerics", "drop_fraction"), 1.0)], "numerics.drop_fraction", "<= 0.5"),
    ([(("numerics", "element"), 20)], "numerics.element", "did you mean 'elements'?"),
    ([(("numerics",), [20])], "numerics", "must be a table"),
    # impossible geometry
    ([(("weave", "amplitude"), "3 mm")], "weave.amplitude", "at most the pitch, 2 mm"),
    (
        [(("weave", "amplitude"), "1.5 mm"), ((*YARN, "radius"), "0.3 mm")],
        "weave.amplitude",
        "cannot bend that far; it must be < 1.351 mm",
    ),
    # absurd sizes, judged against one another where that can be
    ([((*YARN, "spacing"), "1e9 mm")], "yarns.conductive.spacing", "at most the pitch of the weave, 2 mm"),
    ([((*YARN, "row_spacing"), "2.1 mm")], "yarns.conductive.row_spacing", "at most the pitch of the weave, 2 mm"),
    ([((*YARN, "spacing"), "0.7 mm")], "yarns.conductive.spacing", "a row of 4 fibrils must not be wider"),
    ([(("weave", "pitch"), "1e9 mm")], "weave.pitch", "at most 15000 mm, 100000 of the smallest radii"),
    ([((*LOADING, "strain"), "1000 %")], "loading.stretch.strain", "> -1 and <= 4"),
    ([((*LOADING, "strain"), "-95 %")], "loading.stretch.gradients[3]", "by factors of 0.05 and 1; from 0.1 to 5"),
    ([(LOADING, {"name": "s", "kind": "shear", "strains": [0, -20]})], "loading.s.strains[1]", ">= -4 and <= 4"),
    (
        [PATH, ((*LOADING, "gradients"), [[[-7, 0], [0, -7]]])],
        "loading.p.gradients[0]",
        "it stretches the cell by factors of 7 and 7; from 0.1 to 5 are allowed",
    ),
    ([(("probes", 0, "voltage"), "1e9 V")], "probes.straight.voltage", ">= -100000 and <= 100000 V"),
    ([((*MATERIAL, "electrical_conductivity"), 1e10)], "materials.fibril.electrical_conductivity", "<= 1e+09 S/mm"),
    # order at the start
    (
        [((*YARN, "rows"), [1, 1]), ((*YARN, "row_spacing"), "0.4 mm"), (("weave", "amplitude"), "0.1 mm")],
        "weave.amplitude",
        "start on the wrong side of one another; above 0.2 mm their rows are apart",
    ),
    ([(("weave", "amplitude"), "0 mm")], "weave.amplitude", "inside one another, at most 0.15 mm"),
    ([(("weave", "pitch"), "1.3 mm")], "weave.amplitude", "inside one another"),
    ([((*YARN, "spacing"), "0.14 mm")], "yarns.conductive.spacing", "start 0.16 mm inside one another"),
    ([((*YARN, "row_spacing"), "0.05 mm")], "yarns.conductive.row_spacing", "of w"),
    (
        [
            (("yarns", "single"), {"rows": [1], "radius": 0.15, "spacing": 0.3, "material": "fibril"}),
            (("weave", "draft"), [[1], [1]]),
            (("weave", "weft"), "single"),
            (("weave", "pitch"), "0.9 mm"),
            (("terminals",), {}),
            (("probes",), []),
        ],
        "weave.pitch",
        "fibril 7 of warp1 and fibril 4 of warp2 (counted from 1, the lowest row first) start 0.3 mm inside",
    ),
]


@pytest.mark.parametrize(("changes", "field", "phrase"), BAD, ids=[f"{i}-{bad[1]}" for i, bad in enumerate(BAD)])
def test_bad_design(changes: list[tuple[Keys, Any]], field: str, phrase: str) -> None:
    with pytest.raises(DesignError) as caught:
        build_mesh(parse_design(changed(*changes)))
    message = str(caught.value)
    assert caught.value.field == field
    assert message.startswith(f"{field}: ")
    assert phrase in message
    assert "\n" not in message
    assert len(message) < 300


def test_the_unchanged_design_is_accepted() -> None:
    """The table shows nothing unless its starting point is good."""
    assert build_mesh(parse_design(changed())).n_fibrils == 80


def test_bounds_that_depend_on_the_mesh_can_be_reached() -> None:
    """Fibrils of 8 mm in 20 elements; one crossing of fibrils of 2 mm in 3 elements of order 1."""
    lengths = {"merge_length": 8.0, "snap_length": 0.028}
    parse_design(changed(*((("numerics", key), value) for key, value in lengths.items())))
    parse_design(changed(*ONE_CROSSING, (("numerics", "elements"), 3), (("numerics", "order"), 1)))


def test_a_mesh_made_by_hand_with_too_few_nodes_is_told_their_number() -> None:
    mesh = fibrils_through([straight([0, 0, 0], [1, 0, 0], 9), straight([0, 1, 0], [1, 1, 0], 2)])
    with pytest.raises(DesignError, match=r"^nodes of a fibril: 3 is not usable; contact needs four nodes"):
        curve_table(mesh)


def places(value: Any, here: Keys = ()) -> list[Keys]:
    """Keys of everything in a nested design."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [here, *(place for key, item in inside for place in places(item, (*here, key)))][0 if here else 1 :]


JUNK = [
    *(None, True, -1, 0, 7, 10**400, -0.0, 1e-300, 1e300, math.nan, -math.inf, "", "x", "1 mm", "fibril", b"x"),
    *([], [[]], [None], [[1, "0"], [0]], [[[1, 0], [0, 1]]], {}, {"a": 1}, {"name": {}}, datetime.date(2016, 1, 1)),
    *("warp1+", ["warp1+"], ("warp1+",), [{}], "1 " + "(" * 150, "\n", "x" * 10_000, MISSING),
]


@pytest.mark.parametrize("keys", places(tomllib.loads(starter())), ids=lambda keys: ".".join(map(str, keys)))
def test_anything_anywhere_is_a_design_or_one_line(keys: Keys) -> None:
    for junk in JUNK:
        try:
            design_hash(parse_design(changed((keys, junk))))
        except DesignError as error:
            message = str(error)
            assert message.isprintable()
            assert len(message) < 300


FILES: list[tuple[bytes, str, str]] = [
    (b'format = 1\nname = "open\n', "TOML, line 2", "'name = \"open' is not usable; it is not valid TOML"),
    (b"format = 1\nname = \n", "TOML, line 2", "'name =' is not usable"),
    (b"format = 1\nformat = 1\n", "TOML, line 2", "Cannot overwrite a value"),
    (b"[weave]\n[weave]\n", "TOML, line 2", "Cannot declare"),
    (b"draft = [[1, 0],\n", "TOML, line 1", "not valid TOML"),
    (b"format = 1\nname = '\xff'\n", "design file", "UTF-8; byte 19 is not"),
    (b"x = " + b"[" * 50_000, "design file", "nested too deeply"),
    (b"x = " + b"1" * 10_000, "design file", "cannot be read"),
    (b"# " + b"x" * 10_000_000, "design file", "at most 10000000 bytes"),
    (b"", "format", "missing"),
]


@pytest.mark.parametrize(("content", "field", "phrase"), FILES, ids=[f[2] for f in FILES])
def test_bad_file(tmp_path: Path, content: bytes, field: str, phrase: str) -> None:
    path = tmp_path / "design.toml"
    path.write_bytes(content)
    with pytest.raises(DesignError) as caught:
        load_design(path)
    assert caught.value.field == field
    assert phrase in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_file_and_directory(tmp_path: Path) -> None:
    with pytest.raises(DesignError, match="there is no such file"):
        load_design(tmp_path / "none.toml")
    with pytest.raises(DesignError, match="this is a directory"):
        load_design(tmp_path)
    with pytest.raises(DesignError, match="cannot be read"):
        load_design("a\0b")


@pytest.mark.parametrize("value", [None, 3, [], "format = 1", {1: 2}])
def test_not_even_a_mapping_of_names(value: Any) -> None:
    with pytest.raises(DesignError, match=r"^design: "):
        parse_design(value)


def test_two_kinds_of_one_name_are_refused() -> None:
    """Found in review: they shared one resistance that neither had."""
    weave = plain_weave(yarns=2, rows=(1,)).weave
    thin = replace(weave.warp[0], radius=0.1)
    with pytest.raises(DesignError, match=r"two different yarns have this name"):
        replace(weave, warp=(thin, weave.warp[1]))
    other = replace(weave.warp[0].materials[0], youngs_modulus=1.0)
    mixed = replace(weave.warp[0], name="another", materials=(other,))
    with pytest.raises(DesignError, match=r"two different materials have this name"):
        replace(weave, warp=(mixed, weave.warp[1]))
