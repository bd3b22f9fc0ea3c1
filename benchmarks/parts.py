"""What each part beyond the paper costs on the paper's study: switched on, and, against an older version, off.

    python benchmarks/parts.py [--rounds 1] [--repeats 3]
    python benchmarks/parts.py --before FOLDER [--rounds 3] [--repeats 7]

The first compares the paper's cell with the same cell with one part switched on. Parts of the mechanics have a first
relaxation and a step of 2.5 % of their own; what they change is first of all the equilibrium, so their iterations
stand beside the seconds, and the last column has one assembly of energy, gradient and tangent at that state. Parts
of contacts, fields and probes leave the mechanics alone: what is recorded of the cell's stretched state is timed,
contacts, fields, circuits, fit and the comparison of the routes, and the contacts by themselves.

No switch takes code away, so the second compares the stages of the paper's cell as it is with those of an older
version in FOLDER (`git worktree add FOLDER COMMIT`).

Seconds are the processor's, of processes with one thread each that work in turn, without ngspice, a process of its
own; ratios are medians of the quotients within a round. Takes six and three minutes.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from measure import Table, arguments, digits, fail, publish, ratio
from stages_worker import ASSEMBLY, CONTACTS, OFF, RECORDING, RELAXATION, STAGES, STEP

from circuittex.base.arrays import Floats
from circuittex.design import Clamps, Design, Yarn, hexagonal_rows, touching_amplitude

Asked = Callable[[str, str], tuple[float, int]]
"""Processor seconds and iterations of a stage of a part."""
THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
STATES = 21
"""Of the paper's study: one relaxed, twenty by steps."""
VOLTS = 10.0
"""Of the probes where heat is concerned: the paper's 1 V warms its cell by a kelvin."""
LONG = (RELAXATION, STEP)
"""Stages that take many seconds."""
SHORT = 15
"""Rounds of stages that take less than one."""


def yarn(design: Design, **changes: Any) -> Design:
    """The design with all yarns changed alike."""
    weave = design.weave
    kind = replace(weave.warp[0], **changes)
    return weaving(design, warp=(kind,) * len(weave.warp), weft=(kind,) * len(weave.weft))


def weaving(design: Design, **changes: Any) -> Design:
    """The design with another weave."""
    return replace(design, weave=replace(design.weave, **changes))


def hexagonal(design: Design) -> Design:
    """Ten filaments packed as `filaments = 10` does."""
    R = design.weave.warp[0].radius
    return yarn(design, rows=hexagonal_rows(10), spacing=2 * R, row_spacing=sqrt(3) * R)


def apart(design: Design) -> Design:
    """The amplitude with which no fibril starts inside another."""
    weave = design.weave
    return weaving(design, amplitude=touching_amplitude(weave.warp, weave.weft, weave.pitch, weave.pitch))


def law(name: str, **more: float) -> Callable[[Design], Design]:
    """Another law of contact conductance."""
    return lambda design: replace(design, contact=replace(design.contact, law=name, **more))


def coated(design: Design) -> Design:
    """A conducting shell of 1 % of the radius on cores that insulate, as stiff and as heavy."""
    kind: Yarn = design.weave.warp[0]
    shell = replace(kind.materials[0], name="shell", electrical_conductivity=500.0)
    core = replace(kind.materials[0], name="core", electrical_conductivity=0.0)
    return yarn(design, materials=(core,) * kind.n_fibrils, shell=shell, shell_thickness=0.01 * kind.radius)


def heated(**keys: Any) -> Callable[[Design], Design]:
    """Heat that leaves, or feeds back on resistances that rise by 0.4 % a kelvin."""

    def changed(design: Design) -> Design:
        material = replace(design.weave.warp[0].materials[0], tc1=0.004 if "heating" in keys else 0.0)
        electrical = replace(design.electrical, **keys)
        probes = tuple(probe.at(VOLTS) for probe in design.probes)
        return replace(yarn(design, materials=(material,) * 10), electrical=electrical, probes=probes)

    return changed


def driven(**by: float) -> Callable[[Design], Design]:
    """Probes that are driven otherwise than by a voltage."""
    return lambda design: replace(design, probes=tuple(replace(probe, voltage=0.0, **by) for probe in design.probes))


MECHANICAL: Mapping[str, Callable[[Design], Design]] = {
    "natural length, crimp 2 %": lambda design: yarn(design, crimp=0.02),
    "natural shape, heat_set 0.5": lambda design: yarn(design, heat_set=0.5),
    "two pitches and amplitudes": lambda design: weaving(design, weft_pitch=2.2, weft_amplitude=0.5),
    'amplitude "auto"': apart,
    "hexagonal packing": hexagonal,
    'path "peirce"': lambda design: weaving(design, path="peirce"),
    "clamp forces": lambda design: replace(design, clamps=Clamps(warp_force=0.38, weft_force=0.38)),
}
"""Parts with equilibria of their own. The clamp forces are near those of held clamps, 1.53 N on four yarns."""
PARTS: Mapping[str, Callable[[Design], Design]] = {
    **MECHANICAL,
    'law "strip"': law("strip"),
    'law "crossed"': law("crossed"),
    'law "holm"': law("holm"),
    'law "film"': law("film"),
    'law "power"': law("power", reference_conductance=1e-3, reference_force=0.01, exponent=0.5),
    "coated fibrils": coated,
    'coated fibrils, law "holm"': lambda design: law("holm")(coated(design)),
    "heat loss, linear": heated(heat_loss=1e-5),
    "radiation, linear": heated(heat_loss=1e-5, emissivity=0.9),
    'heating "nonlinear"': heated(heat_loss=1e-5, emissivity=0.9, heating="nonlinear"),
    "probes by current": driven(current=1e-3),
    "probes by power for each area": driven(power_density=1e-5),
}
"""Every part, as a change of the paper's cell."""


class Worker:
    """A process that runs stages of a version of circuittex, by default of this one."""

    def __init__(self, root: Path = Path(__file__).parents[1]) -> None:
        worker = Path(__file__).with_name("stages_worker.py")
        one = dict.fromkeys(THREADS, "1")
        self.process = subprocess.Popen(
            [sys.executable, worker],
            env={**os.environ, **one, "PYTHONPATH": str(root)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> Worker:
        assert self._answer() == "ready"
        return self

    def __exit__(self, *_: object) -> None:
        self.process.communicate()

    def __call__(self, part: str, stage: str) -> tuple[float, int]:
        """Processor seconds and iterations of a stage."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps([part, stage]) + "\n")
        self.process.stdin.flush()
        seconds, iterations = self._answer()
        return seconds, iterations

    def _answer(self) -> Any:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            fail("the process that measures has ended")
        return json.loads(line)


def in_turn(pieces: Iterable[Callable[[], tuple[float, int]]], rounds: int) -> list[tuple[Floats, int]]:
    """Seconds (rounds,) and iterations of each piece."""
    pieces = list(pieces)
    found = [[piece() for piece in pieces] for _ in range(rounds)]
    return [(np.array([seconds for seconds, _ in each]), each[0][1]) for each in zip(*found, strict=True)]


def parts(ask: Asked, names: Sequence[str], stage: str, rounds: int) -> dict[str, tuple[Floats, int]]:
    """The stage of the cell as it is and with each part, measured in turn."""
    each = [OFF, *names]
    return dict(zip(each, in_turn([lambda part=part: ask(part, stage) for part in each], rounds), strict=True))


def mechanics(ask: Asked, names: Sequence[str], rounds: int, short: int = SHORT) -> Table:
    """First relaxation, step and assembly with each part."""
    first, step = (parts(ask, names, stage, rounds) for stage in LONG)
    assembly = parts(ask, names, ASSEMBLY, short)
    rows: list[list[object]] = []
    for part in (OFF, *names):
        row: list[object] = [part]
        for found in (first, step):
            seconds, iterations = found[part]
            row += [iterations, float(np.median(seconds)), ratio(seconds, found[OFF][0])]
        rows.append([*row, ratio(assembly[part][0], assembly[OFF][0])])
    head = ["part", "iterations", "processor s", "of off", "iterations of a step", "processor s", "of off"]
    return Table(
        "Parts of the mechanics: a first relaxation, a step of 2.5 % and an assembly:",
        [*head, "assembly, of off"],
        rows,
    )


def recording(ask: Asked, names: Sequence[str], repeats: int, short: int = SHORT) -> Table:
    """Contacts and all that is recorded of a state with each part."""
    contacts, whole = parts(ask, names, CONTACTS, short), parts(ask, names, RECORDING, repeats)
    rows = [
        [part, *(value for found in (contacts, whole) for value in (_median(found, part), _of_off(found, part)))]
        for part in (OFF, *names)
    ]
    head = ["part", "contacts s", "of off", "recording s", "of off"]
    return Table("Parts of contacts, fields and probes: what is recorded of one state:", head, rows)


def _median(found: Mapping[str, tuple[Floats, int]], part: str) -> float:
    return float(np.median(found[part][0]))


def _of_off(found: Mapping[str, tuple[Floats, int]], part: str) -> float:
    return ratio(found[part][0], found[OFF][0])


def off(before: Asked, now: Asked, rounds: int, repeats: int, version: str = "", short: int = SHORT) -> Table:
    """The stages of the paper's cell in two versions, and what they come to for the paper's study."""
    rows: list[list[object]] = []
    total = np.zeros(2)
    for stage in STAGES:
        times = rounds if stage in LONG else repeats if stage == RECORDING else short
        (old, i), (new, j) = in_turn([lambda ask=ask, stage=stage: ask(OFF, stage) for ask in (before, now)], times)
        medians, quotients = np.array([np.median(old), np.median(new)]), new / old
        total += {RELAXATION: 1, STEP: STATES - 1, RECORDING: STATES}.get(stage, 0) * medians
        spread = f"{digits(float(quotients.min()))} to {digits(float(quotients.max()))}"
        iterations = f"{i}, {j}" if stage in LONG else ""
        rows.append([stage, iterations, *map(float, medians), ratio(new, old), spread])
    rows.append([f"{STATES} states", "", *map(float, total), float(total[1] / total[0]), ""])
    head = ["stage", "iterations", "before s", "now s", "now / before", "of single rounds"]
    return Table(f"The paper's cell with everything off, before ({version}) and now:", head, rows)


def version_of(folder: Path) -> str:
    """The commit that is checked out in a folder."""
    words = ["git", "-C", str(folder), "rev-parse", "--short", "HEAD"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "of unknown version"


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--before", type=Path, metavar="FOLDER", help="a checkout of an older version to compare with")
    parser.add_argument(
        "--parts", nargs="+", metavar="WORD", default=[""], help="parts with one of these in their names"
    )
    parser.add_argument("--rounds", type=int, help="of first relaxations and steps (default: 1, with --before 3)")
    parser.add_argument("--repeats", type=int, help="of recordings (default: 3, with --before 7)")
    options = parser.parse_args()
    rounds, repeats = options.rounds or (3 if options.before else 1), options.repeats or (7 if options.before else 3)
    if options.before is not None:
        if not (options.before / "circuittex").is_dir():
            fail(f"{options.before} is no checkout of circuittex")
        with Worker(options.before.resolve()) as before, Worker() as now:
            publish(options, [off(before, now, rounds, repeats, version_of(options.before))])
        return
    chosen = [name for name in PARTS if any(word in name for word in options.parts)]
    ours, others = [n for n in chosen if n in MECHANICAL], [n for n in chosen if n not in MECHANICAL]
    with Worker() as ask:
        tables = [mechanics(ask, ours, rounds)] if ours else []
        publish(options, [*tables, *([recording(ask, others, repeats)] if others else [])])


if __name__ == "__main__":
    main()
