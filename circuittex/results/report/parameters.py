"""The report's part on the design: everything that was stated, in base units."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields
from html import escape
from itertools import groupby

from circuittex.design import Design, Weave
from circuittex.results.report.table import number, table


def parameters(design: Design) -> str:
    """The tables of all settings as HTML; the packing where it is not the regular one."""
    yarns = dict.fromkeys(design.weave.warp + design.weave.weft)
    materials = dict.fromkeys(material for yarn in yarns for material in yarn.materials)
    parts = [
        _weave(design.weave),
        *(
            _settings(f"Yarn {yarn.name}", yarn, {"materials": runs(m.name for m in yarn.materials)}, skip=("name",))
            for yarn in yarns
        ),
        *(_settings(f"Material {material.name}", material, skip=("name",)) for material in materials),
        "" if design.packing.regular else _settings("Random packing", design.packing),
        _settings("Contact", design.contact),
        _settings("Electrical", design.electrical),
        _settings("Numerics", design.numerics),
        _loading(design),
        _terminals(design),
        _probes(design),
    ]
    return "".join(parts)


def _weave(weave: Weave) -> str:
    kinds = {side: runs(yarn.name for yarn in getattr(weave, side)) for side in ("warp", "weft")}
    draft = "\n".join(" ".join("■" if over else "□" for over in row) for row in weave.draft[::-1])
    legend = "A row is a warp yarn (the last at the top), a column a weft yarn; ■: the warp passes over."
    return f"{_settings('Weave', weave, kinds, skip=('draft',))}<h3>Draft</h3><pre>{draft}</pre><p>{legend}</p>"


def _loading(design: Design) -> str:
    if not design.loading:
        return ""
    head = ["path", "states", "strain", "last average deformation gradient", "ends let go"]
    rows = [
        [
            path.name,
            str(len(path.strains)),
            f"{min(path.strains):g} to {max(path.strains):g}",
            ", ".join(f"F{i}{j} {path.gradients[-1][a][b]:g}" for a, i in enumerate("xy") for b, j in enumerate("xy")),
            f"yarns along {path.free}" if path.free else "none",
        ]
        for path in design.loading
    ]
    return f"<h3>Loading</h3>{table(head, rows)}"


def _terminals(design: Design) -> str:
    rows = [
        [terminal.name, ", ".join(yarn + ("+" if side > 0 else "-") for yarn, side in terminal.ends)]
        for terminal in design.terminals
    ]
    return f"<h3>Terminals</h3>{table(['terminal', 'yarn ends'], rows)}" if rows else ""


def _probes(design: Design) -> str:
    rows = [[probe.name, probe.source, probe.sink, number(probe.voltage)] for probe in design.probes]
    return f"<h3>Probes</h3>{table(['probe', 'source', 'sink', 'voltage (V)'], rows)}" if rows else ""


def _settings(title: str, part: object, said: dict[str, str] | None = None, skip: Sequence[str] = ()) -> str:
    """The fields of a part of the design, those of `said` in these words."""
    words = said or {}
    rows = [
        [field.name.replace("_", " "), words.get(field.name) or str(getattr(part, field.name))]
        for field in fields(part)  # type: ignore[arg-type]
        if field.name not in skip
    ]
    return f"<h3>{escape(title)}</h3>{table(['setting', 'value in base units'], rows)}"


def runs(names: Iterable[str]) -> str:
    """Names in a row, with a number where one is repeated.

    >>> runs(["silver", "silver", "nylon", "silver"])
    '2 × silver, nylon, silver'
    """
    counted = [(name, len(list(group))) for name, group in groupby(names)]
    return ", ".join(name if count == 1 else f"{count} × {name}" for name, count in counted)
