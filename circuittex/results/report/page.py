"""report.html: one self-contained page with the figures and numbers of a study."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from circuittex.base.arrays import Floats
from circuittex.base.atomic import write_text
from circuittex.design import Design
from circuittex.design.statement import LINEAR
from circuittex.results.claims.table import Table, claims_table
from circuittex.results.clamps import clamp_statement
from circuittex.results.effort import effort
from circuittex.results.heating import driven_otherwise, heating
from circuittex.results.plot import save_figures
from circuittex.results.records import Record, Study
from circuittex.results.report.branches import branch_alarm, branch_section
from circuittex.results.report.captions import captions
from circuittex.results.report.claims import claims_section
from circuittex.results.report.energy import energy_section
from circuittex.results.report.errors import error_section
from circuittex.results.report.number import number as _number
from circuittex.results.report.parameters import parameters
from circuittex.results.report.template import render, table
from circuittex.results.soundness import deepest_overlap, doubt_statement, surface_stress
from circuittex.results.summary import (
    agrees,
    confirmed,
    difference,
    insulated_resistances,
    network_names,
    network_statement,
    ngspice_statement,
)
from circuittex.results.verification import AGREEMENT


def write_report(folder: str | Path, study: Study, beside: Sequence[Study] = ()) -> Path:
    """Draw the figures into ``folder/figures`` and write ``folder/report.html``; returns its path.

    The page holds its pictures itself and loads nothing; a study without records gives a page that says so. Other
    studies `beside` it have columns of their own in the table of the paper's claims.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    pictures = save_figures(study, folder / "figures") if study.records else {}
    path = folder / "report.html"
    write_text(path, page(study, {name: file.read_bytes() for name, file in pictures.items()}, beside))
    return path


def page(study: Study, pictures: Mapping[str, bytes], beside: Sequence[Study] = ()) -> str:
    """The whole page as text; `pictures` are PNG files by the names of `circuittex.results.plot.FIGURES`."""
    claims = claims_table([study, *beside])
    kind, sentences = _verdict(study)
    return str(
        render(
            "report.html",
            figures={name: picture(text, pictures.get(name)) for name, text in captions(study).items()},
            title=study.design.name,
            known=_facts(study, claims),
            kind=kind,
            sentences=sentences,
            alarm=branch_alarm(study.branches),
            states=_states(study),
            network=_network(study),
            claims=claims_section(claims),
            branches=branch_section(study.branches, _probes(study), network_names(study)),
            errors=error_section(study.errors),
            verification=_verification(study),
            parameters=parameters(study.design),
            version=study.version,
        )
    )


def picture(caption: str, png: bytes | None) -> dict[str, str | None]:
    """What a template needs of a figure: its caption, and the picture as text; none where it was not drawn."""
    return {"caption": caption, "data": None if png is None else base64.b64encode(png).decode("ascii")}


def _probes(study: Study) -> list[str]:
    return [probe.name for probe in study.design.probes]


def _facts(study: Study, claims: Table | None) -> dict[str, str]:
    mesh = study.mesh
    facts = {
        "Design": study.design.name,
        "Design hash": study.design_hash,
        "circuittex": study.version,
        "Fibrils": f"{mesh.n_fibrils} in {len(mesh.yarn_names)} yarns",
        "Mesh": f"{mesh.n_nodes} nodes, {len(mesh.elements)} elements of order {mesh.order}",
        "Recorded states": str(len(study.records)),
    }
    if study.records:
        facts["Contact points"] = f"{study.records[0].contacts.n_contacts} in state {study.records[0].name}"
    if claims is not None:
        facts |= {f"Claims of the paper, {name}": text for name, text in zip(claims.columns, claims.tally, strict=True)}
    return facts


def _verdict(study: Study) -> tuple[str, list[str]]:
    """Whether the routes agree, ngspice took part and nothing is to be doubted, for a box that cannot be overlooked."""
    if not study.records:
        return "bad", ["No state has been recorded: there are no results yet."]
    sentences = list(ngspice_statement(study))
    if study.design.probes:
        worst = float(np.max([difference(record) for record in study.records]))  # nan if any is
        agree = all(agrees(record) for record in study.records)
        sentences.insert(
            0,
            f"The routes to every node voltage and probe current {'agree' if agree else 'DISAGREE'}: the largest "
            f"difference in any state is {worst:.1e} (at most {AGREEMENT:.0e} is required).",
        )
    doubtful = doubt_statement(study)
    good = all(confirmed(record) for record in study.records) and not doubtful
    return "good" if good else "bad", [*sentences, *doubtful]


def _states(study: Study) -> Markup:
    probes = [f"I {name} (A)" for name in _probes(study)]
    driven = driven_otherwise(study.design)
    volts = [f"U {study.design.probes[k].name} (V)" for k in driven]
    head = ["state", "strain", *probes, *volts, "peak temperature rise (K)"]
    rows = [
        [
            record.name,
            _number(record.strain),
            *map(_number, record.currents),
            *(_number(record.fields[k].voltage) for k in driven),
            _number(record.peak_temperature),
        ]
        for record in study.records
    ]
    return render(
        "states.html",
        states={"head": head, "rows": rows},
        forces=_forces(study),
        equilibrium=_equilibrium(study),
        heat=_heat(study),
        ratings=_ratings(study),
        rise=_number(study.design.electrical.rated_rise),
        linear=study.design.electrical.heating == LINEAR,
        effort=(*effort(study), *clamp_statement(study)),
        energy=energy_section(study),
    )


def _heat(study: Study) -> dict[str, Any]:
    """Of the first and the last state of each loading; nothing where heat is not asked about (`_is_heater`)."""
    head = ["state", "probe", "power (W)", "W/cm²", "peak temperature rise (K)", "along the yarns (%)"]
    last = {record.loading: record for record in study.records}
    rows = [
        [record.name, each.probe, *map(_number, (each.power, each.power_density, each.rise, 100.0 * each.along))]
        for record in last.values()
        for each in heating(study, record)
    ]
    return {"head": head, "rows": rows if _is_heater(study.design) else []}


def _ratings(study: Study) -> dict[str, Any]:
    """Current, power and power for each area of the fabric, of each probe in each state."""
    head = ["state", *(f"{name} ({unit})" for name in _probes(study) for unit in ("A", "W", "W/cm²"))]
    rows = []
    for record in study.records:
        rated = [(h.rated_current, h.rated_power, h.rated_power_density) for h in heating(study, record)]
        rows.append([record.name, *(_number(value) for each in rated for value in each)])
    return {"head": head, "rows": rows if _is_heater(study.design) else []}


def _is_heater(design: Design) -> bool:
    """Whether heat leaves otherwise than at the ends alone, as in the paper, or is fed in as a current or a power."""
    return bool(design.electrical.heat_loss or design.electrical.emissivity or driven_otherwise(design))


def _forces(study: Study) -> dict[str, Any]:
    head = ["state", *(f"{side} F{axis} (N)" for side in ("warp +x", "weft +y") for axis in "xyz")]
    rows = [[r.name, *_rounded(r.clamp_force.ravel())] for r in study.records]
    return {"head": head, "rows": rows}


def _rounded(values: Floats) -> list[str]:
    """Numbers to five digits of the largest, whose size may be any."""
    last = 10.0 ** (math.floor(math.log10(np.abs(values).max(initial=0.0) or 1.0)) - 4)
    return [_number(round(value / last) * last + 0.0, 5) for value in values.tolist()]


def _equilibrium(study: Study) -> dict[str, Any]:
    head = ["state", "largest free force (N)", "iterations", "parts", "levels", "contact points"]
    head += ["deepest overlap / (R + R')", "largest stress (MPa)", "netlist"]
    rows = [
        [
            r.name,
            f"{r.residual:.1e}",
            *map(str, (r.iterations, r.parts, r.levels, r.contacts.n_contacts)),
            f"{deepest_overlap(r.contacts)[0]:.2f}",
            _number(float(surface_stress(r).max())),
            r.netlist,
        ]
        for r in study.records
    ]
    return {"head": head, "rows": rows}


def _network(study: Study) -> Markup:
    if not study.records:
        return Markup()
    rows = [
        [
            r.name,
            *map(_number, r.outcome.network),
            f"{r.fit.residual:.2e}",
            _number(100.0 * r.fit.pair_errors[0], 2),
            "; ".join(r.fit.warnings) or "none",
        ]
        for r in study.records
    ]
    insulated = insulated_resistances(study.design, study.mesh, network_names(study))
    one = len(insulated) == 1
    return render(
        "network.html",
        head=["state", *(f"{name} (Ω)" for name in network_names(study)), "misfit", "between pins (%)", "warnings"],
        rows=rows,
        weighting=study.records[0].fit.weighting,
        sentences=network_statement(study),
        method=study.records[0].fit.method,
        insulated=", ".join(f"{_number(ohm)} Ω" + ("" if one else f" ({name[3:]})") for name, ohm in insulated.items()),
    )


def _verification(study: Study) -> Markup:
    if not study.records:
        return Markup()
    head = ["state", "routes", "voltages (V per V)", "currents (relative)"]
    head += ["reduced network", "merging", "mechanical mesh", "ngspice", "time (s)"]
    return table(head, [_verification_row(record) for record in study.records])


def _verification_row(record: Record) -> list[str]:
    check = record.verification
    return [
        record.name,
        ",\u00a0".join(check.routes),  # in one line
        _number(check.max_voltage_difference, 2),
        _number(check.max_current_difference, 2),
        _number(record.reduced_difference, 2),
        _number(check.merge_error, 2),
        _number(check.field_difference, 2),
        _ngspice_word(record),
        f"{np.nansum([check.fields_seconds, check.nodal_seconds, check.ngspice_seconds]):.2g}",
    ]


def _ngspice_word(record: Record) -> str:
    check = record.verification
    if confirmed(record):
        return f"confirmed {check.note}".strip()
    return f"{'NOT CONFIRMED' if check.ngspice_checked else 'NOT CHECKED'} {check.note}".strip()
