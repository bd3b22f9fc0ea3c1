"""report.html: one self-contained page with the figures and numbers of a study."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template

import numpy as np

from circuittex.base.atomic import write_text
from circuittex.results.claims.table import Table, claims_table
from circuittex.results.plot import save_figures
from circuittex.results.records import Record, Study
from circuittex.results.report.branches import branch_alarm, branch_section
from circuittex.results.report.captions import captions
from circuittex.results.report.claims import claims_section
from circuittex.results.report.energy import energy_section
from circuittex.results.report.errors import error_section
from circuittex.results.report.frame import PAGE
from circuittex.results.report.parameters import parameters
from circuittex.results.report.table import number as _number
from circuittex.results.report.table import table as _table
from circuittex.results.soundness import deepest_overlap, doubt_statement, section_stress
from circuittex.results.summary import agrees, confirmed, difference, effort, insulated_resistance, ngspice_statement
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
    shown = {f"figure_{name}": _figure(text, pictures.get(name)) for name, text in captions(study).items()}
    claims = claims_table([study, *beside])
    return Template(PAGE).substitute(
        shown,
        title=escape(study.design.name),
        facts=_facts(study, claims),
        verdict=_verdict(study),
        alarm=branch_alarm(study.branches),
        states=_states(study),
        network=_network(study),
        claims=claims_section(claims),
        branches=branch_section(study.branches, [probe.name for probe in study.design.probes]),
        errors=error_section(study.errors),
        verification=_verification(study),
        parameters=parameters(study.design),
        version=escape(study.version),
    )


def _figure(caption: str, png: bytes | None) -> str:
    if png is None:
        return ""
    data = base64.b64encode(png).decode("ascii")
    caption = escape(caption)
    image = f'<img alt="{caption}" src="data:image/png;base64,{data}">'
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"


def _facts(study: Study, claims: Table | None) -> str:
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
    return "<dl>" + "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in facts.items()) + "</dl>"


def _verdict(study: Study) -> str:
    """Whether the routes agree and ngspice took part, and what to doubt, as a box that cannot be overlooked."""
    if not study.records:
        return '<p class="bad">No state has been recorded: there are no results yet.</p>'
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
    sentences += doubtful
    kind = "good" if all(confirmed(record) for record in study.records) and not doubtful else "bad"
    return f'<div class="{kind}">' + "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences) + "</div>"


def _states(study: Study) -> str:
    probes = [f"I {probe.name} (A)" for probe in study.design.probes]
    head = ["state", "strain", *probes, "peak temperature rise (K)"]
    rows = [
        [
            record.name,
            _number(record.strain),
            *map(_number, record.currents),
            _number(record.peak_temperature),
        ]
        for record in study.records
    ]
    return (
        f"{_table(head, rows)}<h3>Clamp forces</h3>{_forces(study)}<h3>Equilibrium</h3>{_equilibrium(study)}"
        f"{energy_section(study)}"
        if rows
        else "<p>No state has been recorded.</p>"
    )


def _forces(study: Study) -> str:
    head = ["state", *(f"{side} F{axis} (N)" for side in ("warp +x", "weft +y") for axis in "xyz")]
    return _table(head, [[r.name, *(f"{force:.4f}" for force in r.clamp_force.ravel())] for r in study.records])


def _equilibrium(study: Study) -> str:
    head = ["state", "largest free force (N)", "Newton iterations", "parts", "levels", "contact points"]
    head += ["deepest overlap / (R + R')", "largest stress (MPa)", "netlist"]
    rows = [
        [
            r.name,
            f"{r.residual:.1e}",
            *map(str, (r.iterations, r.parts, r.levels, r.contacts.n_contacts)),
            f"{deepest_overlap(r.contacts)[0]:.2f}",
            _number(float(section_stress(r).max())),
            r.netlist,
        ]
        for r in study.records
    ]
    return _table(head, rows) + "".join(f"<p>{escape(sentence)}</p>" for sentence in effort(study))


def _network(study: Study) -> str:
    if not study.records:
        return ""
    rows = [
        [r.name, _number(r.fit.Ry), _number(r.fit.Rc), f"{r.fit.residual:.2e}", "; ".join(r.fit.warnings) or "none"]
        for r in study.records
    ]
    table = _table(["state", "Ry (Ω)", "Rc (Ω)", "misfit", "warnings"], rows)
    weighting = escape(study.records[0].fit.weighting)
    insulated = _number(insulated_resistance(study.mesh))
    return f"{table}<p>Weighting of the fit: {weighting}. Ry of the same yarns without contacts: {insulated} Ω.</p>"


def _verification(study: Study) -> str:
    if not study.records:
        return ""
    head = ["state", "routes", "voltages (V per V)", "currents (relative)"]
    head += ["reduced network", "merging", "mechanical mesh", "ngspice", "time (s)"]
    return _table(head, [_verification_row(record) for record in study.records])


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
