"""A made-up study as a library, and a reader of its files that knows nothing of what wrote them."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from synthetic_study import synthetic_study

from circuittex.base.arrays import Floats
from circuittex.design import Loading, strain_grid
from circuittex.electrical.spice.ngspice import run_deck
from circuittex.results.records import Study
from circuittex.study.plan import plan

CELLS = ("detailed", "ports", "cell", "unit", "ports_stretch_s", "ports_stretch_v", "unit_shear_v")
"""Ends of the names of one of each kind."""
CARD = re.compile(r"^\.subckt (\S+) (.*)$", re.MULTILINE)


def study(states: int = 4) -> Study:
    """States with contacts that have nothing to do with one another: resistances that rise and fall."""
    made = synthetic_study(states, contacts=120, rows=(1, 1), loadings=("stretch", "shear"))
    steps = plan(made.design)
    records = [replace(record, name=step.name) for step, record in zip(steps, made.records, strict=True)]
    return replace(made, records=tuple(records))


def with_both(made: Study) -> Study:
    """The study with a state of stretch and shear at once, that of the smallest grid of both."""
    stretch, record = made.design.loading[0], made.records[1]
    start = stretch.gradients[0]
    gradient = (start[0], (0.025, 1.0))
    both = Loading("both", (gradient,), (0.025,), start=start)
    design = replace(made.design, loading=(*made.design.loading, both))
    half = replace(record.contacts, conductance=record.contacts.conductance * 0.5)
    last = replace(record, name="both-0.025", loading="both", gradient=np.array(gradient), contacts=half)
    return replace(made, design=design, records=(*made.records, last))


def grid_study(contacts: int = 120) -> Study:
    """States at three stretches times three shears, with contacts that have nothing to do with one another."""
    made = synthetic_study(5, contacts=contacts, rows=(1, 1), loadings=("stretch", "shear"))
    design = replace(made.design, loading=strain_grid("pull", "x", (0.025, 0.06), "shear", (-0.01, -0.04)))
    records = [
        replace(record, name=step.name, loading=step.loading, strain=step.strain, gradient=step.after)
        for step, record in zip(plan(design), made.records, strict=True)
    ]
    return replace(made, design=design, records=tuple(records))


def pins_of(text: str) -> list[str]:
    """Nodes of a file's `.subckt` card."""
    (card,) = CARD.findall(text)
    return [word for word in card[1].split() if "=" not in word and not word.endswith(":")]


def resistor_matrix(text: str) -> tuple[list[str], Floats]:
    """Pins of a file and the nodal matrix G of its resistors reduced to them, by plain elimination."""
    pins = pins_of(text)
    cards = [line.split() for line in text.splitlines() if line.startswith("R")]
    nodes = list(dict.fromkeys([*pins, *(node for card in cards for node in card[1:3])]))
    G = np.zeros((len(nodes), len(nodes)))
    for _, a, b, ohm in cards:
        i, j, g = nodes.index(a), nodes.index(b), 1.0 / float(ohm)
        G[[i, j], [i, j]] += g
        G[[i, j], [j, i]] -= g
    n = len(pins)
    inner = G[n:, n:]
    return pins, G[:n, :n] - G[:n, n:] @ np.linalg.solve(inner, G[n:, :n]) if len(inner) else G


def ohmmeter(library: Path, name: str, pairs: list[tuple[str, str]], given: str = "", extra: str = "") -> list[str]:
    """Decks that send 1 A through a sub-circuit from one pin to the other: V1 is the resistance."""
    text = (library / f"{name}.lib").read_text("ascii")
    decks = []
    for a, b in pairs:
        nodes = " ".join({a: "in", b: "0"}.get(pin, pin) for pin in pins_of(text))
        lines = [f"* {name}", f".include {library / name}.lib", f"X1 {nodes} {name} {given}", "I1 0 in 1", extra]
        decks.append("\n".join([line for line in lines if line] + [".op", ".end"]) + "\n")
    return decks


def listed(library: Path, dialect: str) -> list[dict[str, object]]:
    """What library.json says of the cells of a dialect."""
    cells = json.loads((library / "library.json").read_text("ascii"))["cells"]
    return [cell for cell in cells if cell["dialect"] == dialect]


def loaded(library: Path, name: str, line: str) -> str:
    """1 V at the first pin, and a load of its own at each of the others: no two pins are alike."""
    names = pins_of((library / "ngspice" / f"{name}.lib").read_text("ascii"))
    loads = [f"Rload{k} net_{pin} 0 {10 * 1.37**k!r}" for k, pin in enumerate(names)]
    first = f"Vdrive net_{names[0]} 0 1"
    return "\n".join([f"* {name}", f".include {library}/ngspice/{name}.lib", line, first, *loads, ".op", ".end", ""])


def answer(library: Path, name: str, line: str) -> Floats:
    """Voltages of the pins in that deck; `line` is the instance's card, whose nodes are called 'net_' and the pin."""
    names = pins_of((library / "ngspice" / f"{name}.lib").read_text("ascii"))
    return run_deck(loaded(library, name, line)).plots[-1].voltage([f"net_{pin}" for pin in names])[-1]


def direct(library: Path, name: str) -> Floats:
    """The same of a card in the order of the file."""
    names = pins_of((library / "ngspice" / f"{name}.lib").read_text("ascii"))
    return answer(library, name, f"X1 {' '.join(f'net_{pin}' for pin in names)} {name}")
