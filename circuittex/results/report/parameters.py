"""The report's part on the design: everything that was stated, in base units."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields
from itertools import groupby
from typing import Any

from markupsafe import Markup

from circuittex.design import Design, Gradient, Weave
from circuittex.design.experiment import REST
from circuittex.results.report.template import render


def parameters(design: Design) -> Markup:
    """The tables of all settings as HTML; the packing where it is not the regular one."""
    yarns = dict.fromkeys(design.weave.warp + design.weave.weft)
    materials = dict.fromkeys(material for yarn in yarns for material in (*yarn.materials, *yarn.surfaces))
    tables = [
        _weave(design.weave),
        *(
            _settings(
                f"Yarn {yarn.name}",
                yarn,
                {
                    "materials": runs(m.name for m in yarn.materials),
                    "rows": ", ".join(map(str, yarn.rows)),
                    "shell": yarn.shell.name if yarn.shell else "",
                },
                skip=("name",) if yarn.coated else ("name", "shell", "shell_thickness"),
            )
            for yarn in yarns
        ),
        *(_settings(f"Material {material.name}", material, skip=("name",)) for material in materials),
        *([] if design.packing.regular else [_settings("Random packing", design.packing)]),
        *([] if design.clamps.held else [_settings("Clamps", design.clamps)]),
        _settings("Contact", design.contact, skip=("pairs",)),
        *(_settings(f"Contact {' - '.join(p.materials)}", p, skip=("materials",)) for p in design.contact.pairs),
        _settings("Electrical", design.electrical),
        _settings("Numerics", design.numerics),
        _loading(design),
        _terminals(design),
        _probes(design),
    ]
    return render("parameters.html", tables=[each for each in tables if each["rows"]])


def _weave(weave: Weave) -> dict[str, Any]:
    kinds = {side: runs(yarn.name for yarn in getattr(weave, side)) for side in ("warp", "weft")}
    draft = "\n".join(" ".join("■" if over else "□" for over in row) for row in weave.draft[::-1])
    return _settings("Weave", weave, kinds, skip=("draft",)) | {"draft": draft}


def _loading(design: Design) -> dict[str, Any]:
    head = ["loading", "states", "strain", "starts from", "last average deformation gradient", "ends let go"]
    rows = [
        [
            loading.name,
            str(len(loading.strains)),
            f"{min(loading.strains):g} to {max(loading.strains):g}",
            "relaxed" if loading.start == REST else _in_words(loading.start),
            _in_words(loading.gradients[-1]),
            f"yarns along {loading.free}" if loading.free else "none",
        ]
        for loading in design.loading
    ]
    return _part("Loading", head, rows)


def _in_words(gradient: Gradient) -> str:
    return ", ".join(f"F{i}{j} {gradient[a][b]:g}" for a, i in enumerate("xy") for b, j in enumerate("xy"))


def _terminals(design: Design) -> dict[str, Any]:
    rows = [
        [terminal.name, ", ".join(yarn + ("+" if side > 0 else "-") for yarn, side in terminal.ends)]
        for terminal in design.terminals
    ]
    return _part("Terminals", ["terminal", "yarn ends"], rows)


def _probes(design: Design) -> dict[str, Any]:
    rows = [[probe.name, probe.source, probe.sink, probe.drive] for probe in design.probes]
    return _part("Probes", ["probe", "source", "sink", "driven by"], rows)


def _settings(title: str, part: object, said: dict[str, str] | None = None, skip: Sequence[str] = ()) -> dict[str, Any]:
    """The fields of a part of the design, those of `said` in these words."""
    words = said or {}
    rows = [
        [field.name.replace("_", " "), words.get(field.name) or str(getattr(part, field.name))]
        for field in fields(part)  # type: ignore[arg-type]
        if field.name not in skip
    ]
    return _part(title, ["setting", "value in base units"], rows)


def _part(title: str, head: list[str], rows: list[list[str]]) -> dict[str, Any]:
    return {"title": title, "head": head, "rows": rows, "draft": ""}


def runs(names: Iterable[str]) -> str:
    """Names in a row, with a number where one is repeated.

    >>> runs(["silver", "silver", "nylon", "silver"])
    '2 × silver, nylon, silver'
    """
    counted = [(name, len(list(group))) for name, group in groupby(names)]
    return ", ".join(name if count == 1 else f"{count} × {name}" for name, count in counted)
