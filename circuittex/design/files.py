"""Designs in TOML files and nested mappings."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from os import PathLike
from pathlib import Path

from circuittex.design.checks import refuse
from circuittex.design.clamps import Clamps
from circuittex.design.contact import ContactLaw
from circuittex.design.declaration import starter_lines
from circuittex.design.packing import Packing
from circuittex.design.reader import read_design
from circuittex.design.statement import Design, Electrical, Numerics
from circuittex.design.toml_file import read_toml
from circuittex.design.weave import Weave
from circuittex.design.yarn import Material, Yarn

DECLARED: tuple[type, ...] = (Material, Yarn, Weave, ContactLaw, Electrical, Numerics, Packing, Clamps)
"""The parts of a design whose keys are declared beside their fields, in the order of the starter design."""


def load_design(path: str | PathLike[str]) -> Design:
    """The design in the TOML file at `path`.

    Raises `DesignError` for a file that cannot be read, is not TOML, or states something impossible.
    """
    return parse_design(read_toml(path, "design file"), Path(path).parent)


def parse_design(mapping: Mapping[str, object], folder: str | PathLike[str] = ".") -> Design:
    """The design that a mapping of the layout of `starter` states; its `yarn_library` is relative to `folder`.

    >>> parse_design({"format": 1, "nam": "x"})
    Traceback (most recent call last):
    circuittex.base.errors.DesignError: nam: 'x' is not usable; it is an unknown key, did you mean 'name'?
    """
    return read_design(mapping, Path(folder))


def fabrics() -> tuple[str, ...]:
    """Names of the fabrics to start from (`starter`).

    >>> "silver_sensor" in fabrics()
    True
    """
    folder = files("circuittex.design").joinpath("data/fabrics")
    return tuple(sorted(file.name.removesuffix(".toml") for file in folder.iterdir() if file.name.endswith(".toml")))


def starter(fabric: str = "") -> str:
    """A commented design to start from: the paper's cell with a 10 % stretch, every key explained, or a small fabric of
    yarns that people buy, by its name.

    >>> import tomllib
    >>> parse_design(tomllib.loads(starter())).weave.yarn_names[0]
    'warp1'
    """
    if fabric:
        known = fabrics()
        if fabric not in known:
            raise refuse("fabric", fabric, "it must be one of " + ", ".join(map(repr, known)))
        return files("circuittex.design").joinpath(f"data/fabrics/{fabric}.toml").read_text(encoding="utf-8")
    text = files("circuittex.design").joinpath("data/starter.toml").read_text(encoding="utf-8")
    for kind in DECLARED:
        text = text.replace(f"#@ {kind.__name__}\n", starter_lines(kind) + "\n")
    return text
