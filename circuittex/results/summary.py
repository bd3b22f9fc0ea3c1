"""summary.json: the numbers of a study for programs, and the table at the end of a run.

The file is strict JSON; a number that is undefined (nan) or infinite is null. Keys of version 2:

``format``
    2. A change that would break readers of the file gives a new number; new keys do not.
``version``, ``design``, ``design_hash``
    version of circuittex, name of the design, and the hash that also stands in the netlists
``parameters``
    the design in full, as nested objects with its field names, in mm, N, MPa, g, S, W, K and V
``start``
    where the first relaxation started: "initial", the initial weave, or another start in words
``probes``
    names of the probes, in the order of every list of currents
``insulated_Ry_ohm``
    resistance of a yarn segment without contacts [57]; the mean over the conducting yarns
``states``
    one object for each recorded state, in the order of computation:

    ``name``, ``loading``, ``strain``
        name of the state, its loading path (empty for the relaxed state), and the strain that labels it
    ``gradient``
        2 x 2 average in-plane deformation gradient from the relaxed state
    ``residual_N``, ``newton_iterations``, ``parts``
        largest free-dof force at the end, the iterations this took, and into how many parts the increment was halved
    ``clamp_force_N``
        ``x``: total force of the clamps on the +x ends of the warp; ``y``: on the +y ends of the weft; three
        components each [40, 41]
    ``tension_N``, ``extension``
        of each yarn, warp first: the mean of its two clamps' forces along it, and the strain of their distance
    ``stored_energy_N_mm``
        elastic and contact energy
    ``clamp_work_N_mm``, ``stored_energy_change_N_mm``, ``energy_loss_N_mm``
        work of the clamps in the step from the recorded state before on the path (for its first state: from the relaxed
        one) by the trapezoidal rule, how much of it was stored, and the rest; null for the relaxed state
    ``currents_A``, ``peak_temperature_K``
        current of each probe, and the largest temperature rise over all probes
    ``heating``
        of each probe: ``voltage_V``, ``power_W``, ``power_density_W_cm2`` of the fabric, ``peak_temperature_K``,
        ``along_yarns``, the part of the heat that leaves along the yarns rather than at their ends, and
        ``rated_current_A``, ``rated_power_W``, ``rated_power_density_W_cm2``: what the source may feed in for the
        hottest point to rise by ``rated_rise`` of the parameters (``electrical``), null where nothing is warmed by it
    ``Ry_ohm``, ``Rc_ohm``, ``fit_residual``, ``fit_warnings``, ``network``, ``ports``
        the reduced network, its misfit, and what the fit warns of; ``Ry_ohm`` is null where there are several kinds of
        yarn, ``network`` has ``fitted_to``, ``Ry_ohm`` of each kind, ``Rc_ohm`` of each pair of kinds that cross,
        ``insulated_Ry_ohm`` of each kind without contacts, ``Rc_of_crossings_ohm``, and ``worst_pair_error`` and
        ``median_pair_error`` of the resistances between all yarn ends; ``ports`` is the exact port matrix
    ``contact_points``, ``levels``
        contact points at full resolution; levels in which the fibrils of the centre warp yarn lie at its centre
        crossing
    ``deepest_overlap``, ``largest_stress_MPa``
        the deepest overlap of two fibrils over R + R', and the largest axial stress, bending included, of core or shell
    ``doubts``
        why the state cannot be right or trusted, in sentences: overlaps, stresses, temperatures, heat, the mesh, probes
        that cannot be driven as stated; empty if all is well
    ``netlist``
        path of the detailed netlist, relative to the folder of the file
    ``error_estimate``
        null, or the estimated discretisation error: ``elements`` of a fibril on the coarse, the own and the fine mesh,
        ``contact_points`` of an element, own and more, ``moved_mm``, the largest distance of a node from its place in
        the state on the coarse and the fine mesh and with more points, ``warnings``, and ``quantities``: ``name``,
        ``unit``, ``value``, ``error`` and its parts ``mesh_error`` and ``contact_error``, ``relative_error``, observed
        ``order``, and the values ``coarse``, ``fine`` and ``more_points``
    ``branch_check``
        null, or what came out when the state was reached once more with the fibrils in another order: ``verdict``,
        ``bifurcation``: whether it is one, ``clamp_force_difference`` and ``current_difference``: to the state,
        relative, ``energy_difference_N_mm``, ``moved_mm``: the largest distance of a node from its place in the state,
        ``settled_difference``: the larger relative difference when both were relaxed further (null where they were
        not), ``trouble``: why something did not converge, and the other branch: ``clamp_force_N``, ``currents_A``,
        ``Ry_ohm``, ``Rc_ohm``, ``network_ohm``: by kind, ``stored_energy_N_mm``
    ``verification``
        ``routes``: the routes that answered; ``max_voltage_difference_V``: the largest difference of two routes in a
        node voltage, V per volt of the probe; ``max_current_difference``: in a terminal current, relative;
        ``reduced_difference``: of the reduced network's currents between the fit and ngspice, relative;
        ``merge_error``: largest relative change of a probe current by merging contacts; ``field_difference``: largest
        relative difference of a probe current between the mechanical mesh and the circuit; ``native_limit``: what
        rounding explains of the next where that exceeds 1e-9; ``native_difference``: the
        largest difference without ngspice; ``ngspice_limit``: the difference that ngspice's rounding explains;
        ``ngspice_checked``: whether ngspice answered; ``confirmed``: whether it did and all routes agree; ``note``: why
        not
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.atomic import write_text
from circuittex.design import Design
from circuittex.fit import Fit
from circuittex.geometry.mesh import FibrilMesh
from circuittex.results.bifurcation import BranchCheck, branch_statement, current_difference, force_difference
from circuittex.results.clamps import clamp_statement, extensions, tensions
from circuittex.results.discretisation import ErrorEstimate
from circuittex.results.effort import effort
from circuittex.results.heating import driven_otherwise, heating
from circuittex.results.records import Record, Study
from circuittex.results.soundness import deepest_overlap, doubt_statement, doubts, surface_stress
from circuittex.results.verification import AGREEMENT
from circuittex.results.work import EnergyBalance, step_balances

FORMAT = 2
REDUCED = 1e-6
"""Relative difference of ngspice's currents through the reduced network from those of the fit that is rounding."""


def summary(study: Study) -> dict[str, Any]:
    """The content of summary.json, as plain lists, dictionaries, numbers and texts."""
    steps = step_balances(study)
    content: dict[str, Any] = _plain(
        {
            "format": FORMAT,
            "version": study.version,
            "design": study.design.name,
            "design_hash": study.design_hash,
            "parameters": study.design,
            "start": study.start,
            "probes": [probe.name for probe in study.design.probes],
            "insulated_Ry_ohm": insulated_resistance(study.mesh),
            "states": [_state(study, record, steps.get(record.name)) for record in study.records],
        }
    )
    return content


def write_summary(path: str | Path, study: Study) -> None:
    """Write summary.json."""
    text = json.dumps(summary(study), indent=2, allow_nan=False, ensure_ascii=False)
    write_text(path, text + "\n")


def table(study: Study) -> str:
    """The closing table of a run: one line for each state, with its estimated error where there is one.

    After it what the study took, what the branch checks found, which states to doubt, and whether ngspice confirmed it.
    A blank line parts the loading paths."""
    driven = driven_otherwise(study.design)
    head = ["state", "Fx warp N", "Fy weft N", *(f"{probe.name} A" for probe in study.design.probes)]
    head += [f"{study.design.probes[k].name} V" for k in driven]
    rows = [[*head, *(f"{name} ohm" for name in network_names(study)), "overlap", "iterations", "routes differ"]]
    loading = ""
    for record in study.records:
        if record.loading != loading:
            rows.append([""] * len(rows[0]))
            loading = record.loading
        force = record.clamp_force
        volts = [record.fields[k].voltage for k in driven]
        numbers = [force[0, 0], force[1, 1], *record.currents, *volts, *record.outcome.network]
        rows.append([record.name, *(f"{number:#.4g}" if number == number else "-" for number in numbers)])
        rows[-1] += [f"{deepest_overlap(record.contacts)[0]:.2f}", str(record.iterations), f"{difference(record):.1e}"]
        if (error := study.error_of(record.name)) is not None:
            cells = [_percent(quantity.relative) for quantity in error.quantities]
            cells[2 + len(study.design.probes) : 2 + len(study.design.probes)] = [""] * len(driven)
            rows.append(["  estimated error", *cells, "", "", ""])
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(
            [row[0].ljust(widths[0]), *(text.rjust(w) for text, w in zip(row[1:], widths[1:], strict=True))]
        ).rstrip()
        for row in rows
    ]
    warnings = [f"Error estimate of {error.state}: {text}." for error in study.errors for text in error.warnings]
    return "\n".join(
        [
            *lines,
            "",
            *effort(study),
            *clamp_statement(study),
            *branch_statement(study.branches),
            *warnings,
            *network_statement(study),
            *doubt_statement(study),
            *ngspice_statement(study),
        ]
    )


def network_names(study: Study) -> tuple[str, ...]:
    """Names of the resistances of the reduced networks, in the order of `Outcome.network`: by kind where there are
    several."""
    if not study.records:
        return "Ry", "Rc"
    fit = study.records[0].fit
    return *fit.segments_by_name, *fit.crossings_by_name


def network_statement(study: Study) -> tuple[str, ...]:
    """Sentences that say what the reduced networks are worth, and what is not determined and why."""
    sentences = []
    errors = np.array([record.fit.pair_errors for record in study.records]).reshape(-1, 2)
    if np.isfinite(errors).any():
        worst, median = np.nanmax(errors[:, 0]), np.nanmax(errors[:, 1])
        sentences.append(
            f"Between any two yarn ends the reduced network is off by up to {100 * worst:.2g} % "
            f"({100 * median:.2g} % in the median) in resistance."
        )
    told: dict[str, list[str]] = {}
    for record in study.records:
        for warning in record.fit.warnings:
            told.setdefault(warning, []).append(record.name)
    sentences += [f"{text[:1].upper()}{text[1:]} ({', '.join(names)})." for text, names in told.items()]
    return tuple(sentences)


def _percent(share: float) -> str:
    return f"±{100 * share:.2g} %" if math.isfinite(share) else "not known"


def ngspice_statement(study: Study) -> tuple[str, ...]:
    """Sentences that say which states ngspice confirmed, where routes disagree, and what ngspice did not check."""
    if study.records and not study.design.probes:
        return ("The design has no probes: there are no currents to confirm.",)
    wrong = [record for record in study.records if not agrees(record)]
    unchecked = [record for record in study.records if not record.verification.ngspice_checked]
    sentences = []
    if wrong:
        worst = max(wrong, key=lambda record: np.nan_to_num(difference(record), nan=np.inf))
        sentences.append(
            f"The routes DISAGREE in {', '.join(record.name for record in wrong)}, by up to {difference(worst):.1e}: "
            "do not trust the results."
        )
    if unchecked:
        sentences.append(
            f"ngspice did NOT check {_which(study, unchecked)}: the results rest on circuittex's own solvers."
        )
    sound = [record for record in study.records if record.verification.ngspice_checked and agrees(record)]
    reduced = [record for record in sound if not confirmed(record)]
    if silent := [record for record in reduced if math.isnan(record.reduced_difference)]:
        sentences.append(f"ngspice did NOT check the reduced network of {_which(study, silent)}.")
    if off := [record for record in reduced if not math.isnan(record.reduced_difference)]:
        largest = max(record.reduced_difference for record in off)
        sentences.append(
            f"ngspice finds currents of the reduced network of {_which(study, off)} that differ by up to {largest:.1e} "
            "from those of the fit: rounding does that where its resistances lie many powers of ten apart."
        )
    if not sentences:
        sentences.append("ngspice confirmed every recorded state.")
    limit = max((record.verification.ngspice_limit for record in study.records), default=0.0)
    if limit > AGREEMENT:
        sentences.append(f"ngspice's own rounding limits this check to {limit:.1e}.")
    sentences += [record.verification.note for record in unchecked if record.verification.note]
    return tuple(dict.fromkeys(sentences))


def agrees(record: Record) -> bool:
    """Whether the routes that answered say the same of the circuit. The reduced network is no route of its own: how
    well it is conditioned says nothing about them."""
    return record.verification.agrees


def confirmed(record: Record) -> bool:
    """Whether ngspice answered and all routes agree, and the reduced network in ngspice has the currents of the fit."""
    reduced = record.reduced_difference <= REDUCED or not record.fit.known or not record.fields
    return record.verification.ngspice_checked and agrees(record) and bool(reduced)


def _which(study: Study, records: list[Record]) -> str:
    """Names of the states that something was not done for."""
    return "any state" if len(records) == len(study.records) else ", ".join(record.name for record in records)


def difference(record: Record) -> float:
    """The largest difference between two routes, in node voltage per volt or relative current; nan if one is nan."""
    verification = record.verification
    return float(np.max([verification.max_voltage_difference, verification.max_current_difference]))


def insulated_resistance(mesh: FibrilMesh) -> float:
    """Ry of a yarn segment between two crossings without contacts [57], ohm; the mean over the conducting yarns, inf
    where none conducts.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> round(insulated_resistance(build_mesh(plain_weave())), 4)
    0.2829
    """
    ohms = insulated_segments(mesh)
    return float(np.mean(ohms[np.isfinite(ohms)])) if np.isfinite(ohms).any() else math.inf


def insulated_segments(mesh: FibrilMesh) -> Floats:
    """(warp + weft,) the same for each yarn, inf where it does not conduct.

    A yarn is its fibrils in parallel, Ry = 1 / (n sum sigma A / L), with n crossings along it.
    """
    conductance = np.bincount(mesh.yarn, mesh.electrical_conductivity * mesh.area / mesh.length, len(mesh.yarn_names))
    crossings = np.array([np.count_nonzero(mesh.yarn_axis != axis) for axis in mesh.yarn_axis])
    whole = np.full(len(conductance), np.inf)
    np.divide(1.0, conductance * np.maximum(crossings, 1), out=whole, where=conductance > 0.0)
    return whole


def insulated_resistances(design: Design, mesh: FibrilMesh, names: Sequence[str]) -> dict[str, float]:
    """The same for each Ry among the `names` of a reduced network's resistances."""
    segments = [name for name in names if name.startswith("Ry")]
    if len(segments) == 1:
        return {segments[0]: insulated_resistance(mesh)}
    ohms: dict[str, list[float]] = {name: [] for name in segments}
    directions = ["warp"] * len(design.weave.warp) + ["weft"] * len(design.weave.weft)
    for yarn, direction, ohm in zip(design.weave.yarns, directions, insulated_segments(mesh), strict=True):
        for name in (f"Ry {yarn.name}", f"Ry {yarn.name} {direction}"):
            if name in ohms:
                ohms[name].append(float(ohm))
    return {name: float(np.mean(values)) for name, values in ohms.items()}


def _state(study: Study, record: Record, step: EnergyBalance | None) -> dict[str, Any]:
    verification = record.verification
    error, check = study.error_of(record.name), study.check_of(record.name)
    return {
        "name": record.name,
        "loading": record.loading,
        "strain": record.strain,
        "gradient": record.gradient,
        "residual_N": record.residual,
        "newton_iterations": record.iterations,
        "parts": record.parts,
        "clamp_force_N": _by_axis(record.clamp_force),
        "tension_N": tensions(study.mesh, record.reaction, record.gradient),
        "extension": extensions(study.mesh, record.configuration),
        "stored_energy_N_mm": record.energy,
        "clamp_work_N_mm": None if step is None else step.work.item(),
        "stored_energy_change_N_mm": None if step is None else step.stored.item(),
        "energy_loss_N_mm": None if step is None else step.loss.item(),
        "currents_A": record.currents,
        "peak_temperature_K": record.peak_temperature,
        "heating": [each.as_numbers() for each in heating(study, record)],
        "Ry_ohm": record.fit.Ry,
        "Rc_ohm": record.fit.Rc,
        "fit_residual": record.fit.residual,
        "fit_warnings": record.fit.warnings,
        "network": _network(study, record.fit),
        "ports": {"names": record.ports.ports, "conductance_S": record.ports.conductance},
        "contact_points": record.contacts.n_contacts,
        "levels": record.levels,
        "deepest_overlap": deepest_overlap(record.contacts)[0],
        "largest_stress_MPa": surface_stress(record).max(),
        "doubts": [doubt.text for doubt in doubts(study, record)],
        "netlist": record.netlist,
        "error_estimate": None if error is None else _error_estimate(error),
        "branch_check": None if check is None else _branch_check(check, network_names(study)),
        "verification": {
            "routes": verification.routes,
            "max_voltage_difference_V": verification.max_voltage_difference,
            "max_current_difference": verification.max_current_difference,
            "reduced_difference": record.reduced_difference,
            "merge_error": verification.merge_error,
            "field_difference": verification.field_difference,
            "native_difference": verification.native_difference,
            "native_limit": verification.native_limit,
            "ngspice_limit": verification.ngspice_limit,
            "ngspice_checked": verification.ngspice_checked,
            "confirmed": confirmed(record),
            "note": verification.note,
        },
    }


def _network(study: Study, fit: Fit) -> dict[str, Any]:
    worst, median = fit.pair_errors
    insulated = insulated_resistances(study.design, study.mesh, network_names(study)).values()
    return {
        "fitted_to": fit.method,
        "Ry_ohm": dict(zip(fit.kinds, fit.kind_resistance.tolist(), strict=True)),
        "Rc_ohm": dict(zip(fit.pairs, fit.pair_resistance.tolist(), strict=True)),
        "insulated_Ry_ohm": dict(zip(fit.kinds, insulated, strict=bool(fit.kinds))),
        "Rc_of_crossings_ohm": fit.crossings,
        "worst_pair_error": worst,
        "median_pair_error": median,
    }


def _error_estimate(error: ErrorEstimate) -> dict[str, Any]:
    return {
        "elements": error.elements,
        "contact_points": error.contact_points,
        "moved_mm": error.moved,
        "warnings": error.warnings,
        "quantities": [
            {
                "name": quantity.name,
                "unit": quantity.unit,
                "value": quantity.value,
                "error": quantity.absolute,
                "relative_error": quantity.relative,
                "mesh_error": quantity.mesh,
                "contact_error": quantity.contact,
                "order": quantity.observed_order,
                "coarse": quantity.coarse,
                "fine": quantity.fine,
                "more_points": quantity.more_points,
            }
            for quantity in error.quantities
        ],
    }


def _branch_check(check: BranchCheck, names: Sequence[str]) -> dict[str, Any]:
    again = check.again
    return {
        "verdict": str(check.verdict),
        "bifurcation": check.bifurcation,
        "clamp_force_difference": force_difference(check.recorded, again),
        "current_difference": current_difference(check.recorded, again),
        "energy_difference_N_mm": again.energy - check.recorded.energy,
        "moved_mm": check.moved,
        "settled_difference": check.settled_difference,
        "trouble": check.trouble,
        "clamp_force_N": _by_axis(again.clamp_force),
        "currents_A": again.currents,
        "Ry_ohm": again.Ry,
        "Rc_ohm": again.Rc,
        "network_ohm": dict(zip(names, again.network, strict=False)),  # one of each where there is no equilibrium
        "stored_energy_N_mm": again.energy,
    }


def _by_axis(clamp_force: Floats) -> dict[str, Floats]:
    """(2, 3) forces of the clamps on the warp and on the weft."""
    return {"x": clamp_force[0], "y": clamp_force[1]}


def _plain(value: Any) -> Any:
    """`value` in the types that JSON knows; undefined and infinite numbers become None."""
    if is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return _plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value
