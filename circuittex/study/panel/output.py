"""What `circuittex panel` leaves in a folder: numbers, arrays, netlists and pictures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.atomic import replacing, write_text
from circuittex.base.version import __version__
from circuittex.study.panel.circuit import panel_netlists, ports_netlist
from circuittex.study.panel.gradient import PanelGradient
from circuittex.study.panel.pictures import gradient_figure, panel_figure, save_figure
from circuittex.study.panel.solution import PanelSolution

FORMAT = 1
MOST_CARDS = 2_000_000
"""Resistors of a netlist at most: 200 MB of text; no simulator here reads as many. The reduction is always written."""


def write_panel(folder: Path, solution: PanelSolution, gradients: tuple[PanelGradient, ...] = ()) -> tuple[str, ...]:
    """Write panel.json, panel.npz, the netlists and the pictures of a solved panel; returns further notes."""
    folder.mkdir(parents=True, exist_ok=True)
    notes = list(solution.notes)
    if solution.n_resistors <= MOST_CARDS:
        netlists = panel_netlists(solution)
        write_text(folder / "panel.lib", netlists.whole, encoding="ascii")
        write_text(folder / "panel.cir", netlists.deck, encoding="ascii")
    else:
        notes.append(f"{solution.n_resistors} resistors are too many for a netlist: only the reduction is written")
    write_text(folder / "panel_ports.lib", ports_netlist(solution), encoding="ascii")
    write_text(folder / "panel.json", json.dumps(summary(solution, gradients, tuple(notes)), indent=1) + "\n")
    with replacing(folder / "panel.npz") as partial, partial.open("wb") as file:
        np.savez(file, allow_pickle=False, **_arrays(solution, gradients))
    for quantity in ("voltage", "current", "heat", *(["strain"] if np.ptp(solution.wiring.panel.strain) else [])):
        save_figure(folder / f"{quantity}.png", panel_figure(solution, quantity))
    for gradient in gradients:
        figure = gradient_figure(solution.wiring.panel, gradient)
        save_figure(folder / f"gradient_{gradient.source}_{gradient.sink}.png", figure)
    return tuple(notes)


def summary(solution: PanelSolution, gradients: tuple[PanelGradient, ...], notes: tuple[str, ...]) -> dict[str, object]:
    """The numbers of panel.json; null stands for what is infinite or undefined.

    `format`, `version`, `name`, `shape` (warp, weft), `pitch_mm`, `resistors`, `nodes`, `method`, `residual`,
    `electrodes` (voltage V, current A), `power_W`, `largest_heat_W` of a cell, `resistance_ohm` and `conductance_S`
    (electrodes in their order), `gradients` (the largest derivatives and their cells), `notes`.
    """
    panel = solution.wiring.panel
    return {
        "format": FORMAT,
        "version": __version__,
        "name": panel.name,
        "shape": list(panel.shape),
        "pitch_mm": panel.pitch,
        "resistors": solution.n_resistors,
        "nodes": solution.wiring.n_nodes,
        "method": solution.method,
        "residual": solution.residual,
        "electrodes": {
            name: {"voltage_V": _number(volts), "current_A": amperes}
            for name, volts, amperes in zip(
                solution.electrodes, solution.voltage.tolist(), solution.current.tolist(), strict=True
            )
        },
        "power_W": solution.power,
        "largest_heat_W": float(solution.heat.max()),
        "resistance_ohm": [[_number(each) for each in row] for row in solution.resistance.tolist()],
        "conductance_S": solution.ports.conductance.tolist(),
        "gradients": [_of_gradient(each) for each in gradients],
        "notes": list(notes),
    }


def table(solution: PanelSolution) -> str:
    """Electrodes with voltage and current, as text."""
    lines = [f"{'electrode':<20} {'V':>12} {'A':>12}"]
    lines += [
        f"{name:<20} {volts:12.6g} {amperes:12.6g}"
        for name, volts, amperes in zip(solution.electrodes, solution.voltage, solution.current, strict=True)
    ]
    i, j = np.nonzero(np.triu(np.isfinite(solution.resistance), 1))
    if len(i):
        lines.append(f"\n{'between':<41} {'ohm':>12}")
        lines += [
            f"{solution.electrodes[a]:<20} {solution.electrodes[b]:<20} {solution.resistance[a, b]:12.6g}"
            for a, b in list(zip(i.tolist(), j.tolist(), strict=True))[:10]
        ]
    if len(i) > 10:
        lines.append(f"and {len(i) - 10} more pairs in panel.json")
    lines.append(
        f"\n{solution.n_resistors} resistors, {solution.method}, relative residual {solution.residual:.1e}, "
        f"power {solution.power:.6g} W"
    )
    return "\n".join(lines)


def _arrays(solution: PanelSolution, gradients: tuple[PanelGradient, ...]) -> dict[str, Floats]:
    """Maps (n, m) of panel.npz; gradients end in the names of their electrodes."""
    found = {
        "warp_voltage_V": solution.warp_voltage,
        "weft_voltage_V": solution.weft_voltage,
        "heat_W": solution.heat,
        "current_x_A_per_mm": solution.current_x,
        "current_y_A_per_mm": solution.current_y,
        "strain": np.array(solution.wiring.panel.strain),
    }
    for each in gradients:
        for kind in ("strain", "crossing", "warp", "weft"):
            found[f"gradient_{kind}_{each.source}_{each.sink}"] = getattr(each, kind)
    return found


def _of_gradient(gradient: PanelGradient) -> dict[str, object]:
    found: dict[str, object] = {
        "source": gradient.source,
        "sink": gradient.sink,
        "resistance_ohm": gradient.resistance,
    }
    for kind in ("strain", "crossing"):
        values = getattr(gradient, kind)
        i, j = np.unravel_index(int(np.argmax(np.abs(values))), values.shape)
        found[kind] = {
            "sum": float(values.sum()),
            "largest": float(values[i, j]),
            "warp": int(i) + 1,
            "weft": int(j) + 1,
        }
    return found


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None
