"""Designs drawn at random, and checks of what becomes of them that share no code with what they check.

    python tests/random_designs.py [--designs 300] [--seed 0]

Each design is computed to its end, or refused in one sentence: anything else is a fault, and its seed is printed.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from itertools import combinations
from math import exp, log

import numpy as np
from plan_view import side
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from circuittex.base.errors import CircuittexError
from circuittex.design import (
    HERTZ,
    ContactLaw,
    Design,
    Material,
    MaterialPair,
    Numerics,
    Packing,
    Probe,
    Terminal,
    Weave,
    Yarn,
    uniaxial,
)
from circuittex.results.records import Record, Study
from circuittex.results.soundness import deepest_overlap
from circuittex.study.run import run_study

BALANCE = 1e-3
"""Part of the forces on a fibril that may be left over: the tolerance, times the number of its nodes, at most."""
LIMIT = 0.5
"""Overlap over R + R' beyond which nothing may be recorded."""
DENSE = 40
"""Places from node to node at which centre lines are looked at."""
OFF = 0.02
"""Of R + R': contact points lie up to a tenth of a contact beside the deepest place, and splines between nodes leave
quadratic elements by as much."""
WITHIN = 1e-6
"""Relative: what an insulated yarn's resistance may be off its closed form, contacts in parallel aside."""


def drawn(seed: int) -> Design:
    """A small weave of random materials, scale, draft, packing, mixture and probes."""
    rng = np.random.default_rng(seed)

    def spread(low: float, high: float) -> float:
        return exp(rng.uniform(log(low), log(high)))

    materials = [
        Material(
            f"m{k}",
            spread(0.1, 400e3),
            float(rng.choice([0.0, 0.3, 0.45])),
            spread(0.9e-3, 20e-3),
            float(rng.choice([0.0, spread(1e-4, 6e4), spread(1.0, 1e3)])),
            spread(1e-4, 1.0),
        )
        for k in range(rng.integers(1, 3))
    ]
    radius = spread(2.5e-3, 1.0)
    rows = [(1,), (2,), (1, 2), (2, 1)][rng.integers(4)]
    pick = rng.integers(len(materials), size=(2, sum(rows)))
    yarns = [
        Yarn(f"y{k}", rows, radius, 2.1 * radius, 2.1 * radius, tuple(materials[i] for i in pick[k])) for k in range(2)
    ]
    n, m = (int(rng.integers(1, 4)) for _ in range(2))
    draft = tuple(tuple(int(v) for v in row) for row in rng.integers(0, 2, (n, m)))
    pitch = radius * spread(8.0, 25.0)
    height = radius * (1.0 + 1.05 * (len(rows) - 1)) * float(rng.uniform(0.9, 1.2))
    weave = Weave(
        draft,
        tuple(yarns[i] for i in rng.integers(2, size=n)),
        tuple(yarns[i] for i in rng.integers(2, size=m)),
        pitch,
        min(height, 0.9 * pitch**2 / (np.pi**2 * radius)),
    )
    penalty: float | str = HERTZ if rng.random() < 0.8 else spread(1.0, 1e5)
    pairs = ()
    used = sorted({material.name for yarn in weave.yarns for material in yarn.materials})
    if len(used) == 2 and rng.random() < 0.3:
        pairs = (MaterialPair(HERTZ, spread(1e-4, 1e3), 0.1, (used[0], used[1])),)
    law = ContactLaw(penalty, spread(1e-5, 1e4), 0.1, pairs)
    ends = [(name, side) for name in weave.yarn_names for side in (-1, 1)]
    chosen = rng.permutation(len(ends))[: rng.integers(2, min(5, len(ends) + 1))]
    terminals = tuple(Terminal(f"t{k}", (ends[e],)) for k, e in enumerate(chosen))
    probes = tuple(Probe(f"p{k}", f"t{k}", "t0", spread(1e-3, 10.0)) for k in range(1, len(terminals)))
    loading = (uniaxial("pull", (float(rng.uniform(-0.03, 0.08)),)),) if rng.random() < 0.4 else ()
    packing = Packing(seed=seed, lateral=0.02 * radius) if rng.random() < 0.3 else Packing()
    numerics = Numerics(elements=int(rng.choice([8, 12, 16])) * max(n, m) // 2 + 6, contact_points="auto")
    return Design(f"drawn {seed}", weave, law, loading, terminals, probes, numerics=numerics, packing=packing)


def faults(study: Study) -> list[str]:
    """What is wrong in the records of a study."""
    return [f"{record.name}: {text}" for record in study.records for text in _faults(study, record)]


def _faults(study: Study, record: Record) -> list[str]:
    found = []
    if wrong := _wrong_crossings(study, record):
        found.append(f"{wrong} crossings on the wrong side")
    overlap, stated = _deepest(record), deepest_overlap(record.contacts)[0]
    if overlap > LIMIT + OFF:
        found.append(f"overlap of {overlap:.2f} of R + R' recorded")
    if abs(overlap - stated) > OFF:
        found.append(f"overlap of {overlap:.3f} of R + R' said to be {stated:.3f}")
    left = record.reaction.sum(axis=0)
    if np.abs(left).max() > BALANCE * np.abs(record.end_force).max():
        found.append("the clamps do not balance")
    G = record.ports.conductance
    if len(G) and not (np.array_equal(G, G.T) and np.all(np.linalg.eigvalsh(G) > -1e-9 * np.abs(G).max())):
        found.append("the port matrix is not symmetric and passive")
    found += _resistances(study, record)
    if not np.isfinite(record.energy) or record.energy < 0.0:
        found.append(f"energy {record.energy}")
    return found


def _resistances(study: Study, record: Record) -> list[str]:
    """Along a yarn no network resists more than the yarn alone, L / (n sigma A): contacts are in parallel."""
    weave, names = study.design.weave, list(record.ports.ports)
    found = []
    for number, (name, yarn) in enumerate(zip(weave.yarn_names, weave.yarns, strict=True)):
        if f"{name}_minus" not in names:
            continue
        i, j = names.index(f"{name}_minus"), names.index(f"{name}_plus")
        crossings = len(weave.weft) if number < len(weave.warp) else len(weave.warp)
        siemens = sum(m.electrical_conductivity for m in yarn.materials) * np.pi * yarn.radius**2
        alone = crossings * weave.pitch / siemens
        rest = [k for k in range(len(names)) if k != j]
        volts = np.linalg.lstsq(record.ports.conductance[np.ix_(rest, rest)], np.eye(len(names))[i][rest], rcond=None)[
            0
        ]
        along = float(volts[rest.index(i)])
        if along > alone * (1 + WITHIN):
            found.append(f"{name} resists {along:.6g} ohm, more than alone, {alone:.6g}")
    return found


def _wrong_crossings(study: Study, record: Record) -> int:
    """Sum of the signs of the plan crossings where the warp is above, against the draft; lines of chords."""
    mesh, r = study.mesh, record.configuration.r
    lines = [r[mesh.first_node[f] : mesh.first_node[f + 1]] for f in range(mesh.n_fibrils)]
    n = len(study.design.weave.warp)
    wrong = 0
    for f in np.flatnonzero(mesh.yarn < n):
        for g in np.flatnonzero(mesh.yarn >= n):
            wrong += side(lines[f], lines[g]) != study.design.weave.draft[mesh.yarn[f]][mesh.yarn[g] - n]
    return wrong


def _deepest(record: Record) -> float:
    """Largest overlap of two fibrils over R + R', of nothing but nodes and radii: the curves through them, densely."""
    mesh, r = record.contacts.mesh, record.configuration.r
    lines = [r[mesh.first_node[f] : mesh.first_node[f + 1]] for f in range(mesh.n_fibrils)]
    dense = [
        CubicSpline(np.arange(len(line)), line)(np.linspace(0, len(line) - 1, DENSE * len(line))) for line in lines
    ]
    trees, deepest = [cKDTree(line) for line in dense], 0.0
    for f, g in combinations(range(mesh.n_fibrils), 2):
        reach = float(mesh.radius[f] + mesh.radius[g])
        nearest, _ = trees[f].query(dense[g], distance_upper_bound=reach)
        deepest = max(deepest, 1.0 - float(nearest.min()) / reach)
    return deepest


def outcome(seed: int) -> tuple[str, str]:
    """('verified' | 'doubted' | 'refused' | 'FAULT', why)."""
    try:
        design = drawn(seed)
        study = run_study(design, workers=1)
    except CircuittexError as error:
        text = str(error)
        return ("refused" if text and "\n" not in text else "FAULT"), f"{type(error).__name__}: {text}"
    except Exception as error:
        return "FAULT", f"{type(error).__name__}: {error}"
    wrong = faults(study)
    if wrong:
        return "FAULT", "; ".join(wrong)
    disagree = [
        record.name for record in study.records if record.verification.routes and not record.verification.agrees
    ]
    return ("doubted", f"routes disagree in {', '.join(disagree)}") if disagree else ("verified", "")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--designs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    counted: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    for seed in range(options.seed, options.seed + options.designs):
        clock = time.perf_counter()
        verdict, why = outcome(seed)
        counted[verdict] += 1
        reasons[why.split(":")[0] if verdict == "refused" else verdict] += 1
        if verdict in ("FAULT", "doubted") or time.perf_counter() - clock > 60:
            print(f"{seed}: {verdict} ({time.perf_counter() - clock:.0f} s) {why}"[:400], flush=True)
    print(dict(counted), dict(reasons))
    return int(counted["FAULT"] > 0)


if __name__ == "__main__":
    sys.exit(main())
