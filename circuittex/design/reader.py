"""Reading a design from nested mappings (TOML): keys, types and units; the dataclasses check the rest."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from math import hypot, inf
from pathlib import Path
from typing import TypeVar

from circuittex.design.checks import is_name, name, one_of, real, refuse, truth, whole
from circuittex.design.clamps import Clamps
from circuittex.design.contact import ContactLaw, MaterialPair
from circuittex.design.declaration import keys, read
from circuittex.design.experiment import (
    MOST_STATES,
    MOST_STRETCH,
    Gradient,
    Loading,
    biaxial,
    check_gradient,
    equal_steps,
    load_unload,
    shear,
    uniaxial,
)
from circuittex.design.grid import AXES, strain_grid
from circuittex.design.known_yarns import with_library
from circuittex.design.packing import Packing
from circuittex.design.probe import DRIVES, ONE_DRIVE, Probe, Terminal
from circuittex.design.statement import FORMAT, Design, Electrical, Numerics
from circuittex.design.table import Table, choose, quantity
from circuittex.design.touching import AUTO, touching_amplitude
from circuittex.design.wave import SINE
from circuittex.design.weave import Weave, check_draft
from circuittex.design.yarn import Yarn
from circuittex.design.yarn_table import conductivities, read_material, read_yarn

_T = TypeVar("_T")
_END = re.compile(r"([A-Za-z0-9_-]+?)([+-])", re.ASCII)

_LOADING_KEYS = {
    "uniaxial": ("strain", "steps", "strains", "axis", "unload", "free"),
    "biaxial": ("strain", "steps", "strains", "unload"),
    "shear": ("strain", "steps", "strains", "unload", "free"),
    "path": ("gradients", "strains", "unload", "free"),
    "grid": ("first", "then"),
}


def read_design(mapping: object, folder: Path) -> Design:
    """The design stated by a mapping of the layout of the starter design; its yarn library is relative to `folder`."""
    top = Table(
        mapping,
        "",
        (
            "format",
            "name",
            "yarn_library",
            "materials",
            "yarns",
            "weave",
            "contact",
            "loading",
            "terminals",
            "probes",
            "electrical",
            "numerics",
            "packing",
            "clamps",
        ),
    )
    version = top.get("format", f"format = {FORMAT} states the layout of the file")
    if isinstance(version, bool) or version != FORMAT:
        raise refuse("format", version, f"this version reads format = {FORMAT}")
    title = top.text("name", "a title for the design")
    top = with_library(top, folder)
    from_yarns = conductivities(top)
    materials = _named(top, "materials", lambda value, field, label: read_material(value, field, label, from_yarns))
    yarns = _named(top, "yarns", lambda value, field, label: read_yarn(value, field, label, materials))
    return Design(
        name=title,
        weave=_weave(top.get("weave", "a table [weave]"), yarns),
        contact=_contact(top.get("contact", "a table [contact]")),
        loading=tuple(each for value, field in _entries(top, "loading") for each in _loading(value, field)),
        terminals=tuple(_named(top, "terminals", _terminal, optional=True).values()),
        probes=tuple(_probe(value, field) for value, field in _entries(top, "probes")),
        electrical=Electrical(**read(Electrical, Table(top.value.get("electrical", {}), "electrical"))),
        numerics=Numerics(**read(Numerics, Table(top.value.get("numerics", {}), "numerics"))),
        packing=Packing(**read(Packing, Table(top.value.get("packing", {}), "packing"))),
        clamps=Clamps(**read(Clamps, Table(top.value.get("clamps", {}), "clamps"))),
    )


def _named(top: Table, key: str, read: Callable[[object, str, str], _T], *, optional: bool = False) -> dict[str, _T]:
    """The entries of a table of named things, `[key.NAME]`."""
    if optional and not top.has(key):
        return {}
    table = Table(top.get(key, f"at least one table [{key}.NAME]"), key, None)
    if not optional and not table.value:
        raise refuse(key, {}, f"at least one table [{key}.NAME] is needed")
    return {label: read(value, table.at(label), name(label, table.at(label))) for label, value in table.value.items()}


def _entries(top: Table, key: str) -> Iterator[tuple[object, str]]:
    """The entries of an array of tables, `[[key]]`, with the best name there is for each."""
    if not top.has(key):
        return
    for i, value in enumerate(top.items(key, f"tables [[{key}]]")):
        label = value.get("name") if isinstance(value, Mapping) else None
        yield value, f"{key}.{label}" if isinstance(label, str) and is_name(label) else f"{key}[{i}]"


def _weave(value: object, yarns: Mapping[str, Yarn]) -> Weave:
    table = _with_pitches(Table(value, "weave", ("draft", "warp", "weft", "threads_per_cm", *keys(Weave))))
    draft = check_draft(table.get("draft", "a matrix of 0 and 1, one row for each warp yarn"), "weave.draft")
    warp = _weave_yarns(table, "warp", len(draft), yarns)
    weft = _weave_yarns(table, "weft", len(draft[0]), yarns)
    touching = table.value.get("amplitude") == AUTO
    if touching:
        table = Table({**table.value, "amplitude": 0.0}, table.field)
    numbers = read(Weave, table, "draft", "warp", "weft")
    path = numbers.pop("path", SINE)  # which wants the amplitude to be known
    stated = Weave(draft=draft, warp=warp, weft=weft, **numbers, path=SINE if touching else path)
    if not touching:
        return stated
    if not isinstance(stated.weft_amplitude, str):
        raise refuse(
            table.at("weft_amplitude"), stated.weft_amplitude, f"amplitude = {AUTO!r} is of warp and weft alike"
        )
    pitch, weft_pitch = (direction.pitch for direction in stated.directions)
    height = touching_amplitude(warp, weft, pitch, weft_pitch, path)
    return replace(stated, amplitude=height, path=path)


def _with_pitches(table: Table) -> Table:
    """The table of a weave with its pitches in place of threads per cm: one number, or one for warp and weft."""
    if not table.has("threads_per_cm"):
        return table
    for key in ("pitch", "weft_pitch"):
        if table.has(key):
            raise refuse(table.at(key), table.value[key], "give either pitches or threads_per_cm, not both")
    at, given = table.at("threads_per_cm"), table.value["threads_per_cm"]
    listed = given if isinstance(given, list | tuple) else [given, given]
    if len(listed) != 2:
        raise refuse(at, given, "it must be one number, or two: of the warp and of the weft")
    warp, weft = (10.0 / real(quantity(each, "1", at), at, "", above=0) for each in listed)
    both = {"pitch": warp} if warp == weft else {"pitch": warp, "weft_pitch": weft}
    return Table({key: entry for key, entry in table.value.items() if key != "threads_per_cm"} | both, table.field)


def _weave_yarns(table: Table, key: str, n: int, yarns: Mapping[str, Yarn]) -> tuple[Yarn, ...]:
    value = table.get(key, "the name of a yarn, or a list of names")
    if not isinstance(value, list | tuple):
        return (choose(value, table.at(key), yarns),) * n
    return tuple(choose(item, f"{table.at(key)}[{i}]", yarns) for i, item in enumerate(value))


def _contact(value: object) -> ContactLaw:
    table = Table(value, "contact")
    common = read(ContactLaw, table, "pairs")
    entries = table.items("pairs", "tables [[contact.pairs]]") if table.has("pairs") else []
    return ContactLaw(**common, pairs=tuple(_pair(entry, table, i) for i, entry in enumerate(entries)))


def _pair(value: object, contact: Table, i: int) -> MaterialPair:
    """The contact of two materials; what it leaves out is that of the rest."""
    field = f"{contact.at('pairs')}[{i}]"
    table = Table(value, field)
    table.only(("materials", *keys(MaterialPair)))
    wanted = "the names of two materials, such as ['silver', 'nylon']"
    names = table.items("materials", wanted)
    if len(names) != 2:
        raise refuse(table.at("materials"), names, f"it must list {wanted}")
    common = {key: entry for key, entry in contact.value.items() if key in keys(MaterialPair)}
    values = read(MaterialPair, Table({**common, **table.value}, field), "materials")
    first, second = (name(each, f"{table.at('materials')}[{j}]") for j, each in enumerate(names))
    return MaterialPair(**values, materials=(first, second))


def _loading(value: object, field: str) -> tuple[Loading, ...]:
    """One loading; several for a grid."""
    keys = dict.fromkeys(key for taken in _LOADING_KEYS.values() for key in taken)
    table = Table(value, field, ("name", "kind", *keys))
    label = name(table.get("name", "a name for the loading"), table.at("name"))
    kinds = tuple(_LOADING_KEYS)
    kind = one_of(table.get("kind", "one of " + ", ".join(map(repr, kinds))), table.at("kind"), kinds)
    for key in table.value:
        if key not in ("name", "kind", *_LOADING_KEYS[kind]):
            allowed = ", ".join(map(repr, _LOADING_KEYS[kind]))
            raise refuse(table.at(key), table.value[key], f"a loading of kind {kind!r} takes {allowed}")
    if kind == "grid":
        return _grid(table, label)
    free = one_of(table.value["free"], table.at("free"), ("x", "y")) if table.has("free") else ""
    loading = _stated(table, label, free) if kind == "path" else _stepped(table, label, kind, free)
    if not truth(table.value.get("unload", False), table.at("unload")):
        return (loading,)
    _limit(table, "unload", 2 * len(loading.strains))
    return (load_unload(loading),)


def _grid(table: Table, label: str) -> tuple[Loading, ...]:
    axes, strains = [], []
    for key in _LOADING_KEYS["grid"]:
        wanted = 'a table such as { axis = "x", strain = "10 %", steps = 4 }'
        own = Table(table.get(key, wanted), table.at(key), ("axis", "strain", "steps", "strains"))
        axes.append(one_of(own.get("axis", "one of " + ", ".join(map(repr, AXES))), own.at("axis"), AXES))
        strains.append(_strains(own, axes[-1] == "shear"))
    _limit(table, "then", (len(strains[0]) + 1) * (len(strains[1]) + 1))
    return strain_grid(label, axes[0], strains[0], axes[1], strains[1])


def _stepped(table: Table, label: str, kind: str, free: str) -> Loading:
    strains = _strains(table, kind == "shear")
    if kind == "uniaxial":
        axis = one_of(table.value.get("axis", "x"), table.at("axis"), ("x", "y"))
        return uniaxial(label, strains, axis, free)
    return shear(label, strains, free) if kind == "shear" else biaxial(label, strains)


def _stated(table: Table, label: str, free: str) -> Loading:
    listed = table.items("gradients", "one matrix [[Fxx, Fxy], [Fyx, Fyy]] for each state")
    _limit(table, "gradients", len(listed))
    gradients = tuple(check_gradient(F, f"{table.at('gradients')}[{i}]") for i, F in enumerate(listed))
    labels = _numbers(table, "strains") if table.has("strains") else tuple(_size(F) for F in gradients)
    return Loading(label, gradients, labels, free)


def _size(gradient: Gradient) -> float:
    """Spectral norm of F - I, which is |e| for a uniaxial or biaxial stretch and |g| for a shear."""
    (a, b), (c, d) = gradient
    a, d = a - 1.0, d - 1.0
    return (hypot(a + d, b - c) + hypot(a - d, b + c)) / 2.0


def _strains(table: Table, shears: bool) -> tuple[float, ...]:
    """Either `strains` as listed, or `steps` equal ones up to `strain`; of shear, or of stretch."""
    above, at_least = (-inf, 1.0 - MOST_STRETCH) if shears else (-1.0, -inf)

    def checked(strain: float, field: str) -> float:
        return real(strain, field, above=above, at_least=at_least, at_most=MOST_STRETCH - 1.0)

    if table.has("strains"):
        for key in ("strain", "steps"):
            if table.has(key):
                raise refuse(table.at(key), table.value[key], "give either strains, or strain and steps, not both")
        listed = _numbers(table, "strains")
        if not listed:
            raise refuse(table.at("strains"), [], "at least one strain is needed")
        return tuple(checked(e, f"{table.at('strains')}[{i}]") for i, e in enumerate(listed))
    strain = checked(table.number("strain", "1"), table.at("strain"))
    if strain == 0.0:
        raise refuse(table.at("strain"), strain, "it must not be 0; the relaxed state is recorded anyway")
    steps = table.get("steps", "a whole number of equal steps")
    return equal_steps(strain, whole(steps, table.at("steps"), 1, MOST_STATES))


def _numbers(table: Table, key: str) -> tuple[float, ...]:
    listed = table.items(key, "plain numbers")
    _limit(table, key, len(listed))
    return tuple(quantity(value, "1", f"{table.at(key)}[{i}]") for i, value in enumerate(listed))


def _limit(table: Table, key: str, states: int) -> None:
    if states > MOST_STATES:
        raise refuse(table.at(key), states, f"a loading has at most {MOST_STATES} states")


def _terminal(value: object, field: str, label: str) -> Terminal:
    wanted = "it must be a list of yarn ends, such as ['warp2+', 'weft1-']"
    if not isinstance(value, list | tuple):
        raise refuse(field, value, wanted)
    ends = []
    for i, item in enumerate(value):
        match = _END.fullmatch(item) if isinstance(item, str) else None
        if match is None:
            raise refuse(f"{field}[{i}]", item, "it must be a yarn name followed by + or -, such as 'warp2+'")
        ends.append((match[1], 1 if match[2] == "+" else -1))
    return Terminal(label, tuple(ends))


def _probe(value: object, field: str) -> Probe:
    table = Table(value, field, ("name", "source", "sink", *DRIVES))
    stated = [key for key in DRIVES if table.has(key)]
    for key in stated[1:]:
        raise refuse(table.at(key), table.value[key], ONE_DRIVE)
    drive = {key: table.number(key, DRIVES[key]) for key in stated} or {"voltage": 1.0}
    return Probe(
        name=name(table.get("name", "a name for the probe"), table.at("name")),
        source=table.text("source", "the name of a terminal"),
        sink=table.text("sink", "the name of a terminal"),
        **drive,
    )
