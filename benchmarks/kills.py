"""A study killed at random moments and started again, against the same study uninterrupted: equal bit for bit?

    python benchmarks/kills.py
    python benchmarks/kills.py examples/plain_weave.toml --kills 5

Each run is ended by SIGKILL at a random moment. As long as states are missing it is one of the time that an
uninterrupted run takes to its last state; when all are there, one more kill meets the drawing. Then the study is
completed, and the next begins in a new folder. Exit code 1 where a state is lost or a number differs.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from measure import machine, markdown

from circuittex.base.frozen import same
from circuittex.design import Design, equal_steps, load_design, plain_weave, shear, uniaxial
from circuittex.results.records import Study
from circuittex.results.store import load_study, write_study_start
from circuittex.study.run import run_study

RUN = """
import sys
from circuittex.results.store import load_study
from circuittex.study.run import run_study
run_study(load_study(sys.argv[1]).design, sys.argv[2], workers=int(sys.argv[3]) or None)
"""
OUTPUTS = ("netlists/*", "vtu/*", "summary.json", "report.html", "figures/*")
HEAD = ["run", "ended after s", "states before", "states after", "what happened"]


@dataclass
class Trial:
    """The runs on one folder, from the first to the one that completes it."""

    design: Path
    """A file with the design and nothing else."""
    whole: Study
    """What comes out without kills."""
    folder: Path
    workers: int

    def start(self) -> subprocess.Popen[bytes]:
        """Begin or go on."""
        return subprocess.Popen([sys.executable, "-c", RUN, self.design, self.folder, str(self.workers)])

    def states(self) -> tuple[str, ...]:
        """Names of the states that are there, whose content is checked against their digests."""
        file = self.folder / "results.h5"
        return tuple(record.name for record in load_study(file).records) if file.exists() else ()

    def kill_after(self, seconds: float) -> tuple[bool, list[object]]:
        """Whether a run was killed before it ended, and its row of the table."""
        before, clock = set(self.states()), time.perf_counter()
        with self.start() as process:
            try:
                code: int | None = process.wait(seconds)
            except subprocess.TimeoutExpired:
                process.kill()
                code = None
        after = set(self.states())
        told = "killed" if code is None else "ended" if code == 0 else f"failed with exit code {code}"
        told += f", LOST {', '.join(sorted(before - after))}" if before - after else ""
        return code is None, [time.perf_counter() - clock, len(before), len(after), told]

    def complete(self) -> str:
        """Run to the end; what of it differs from the uninterrupted study, nothing if all is well."""
        if self.start().wait() != 0:
            return "the last run FAILED"
        if not same(untimed(load_study(self.folder / "results.h5")), untimed(self.whole)):
            return "the numbers DIFFER"
        return ""


def untimed(study: Study) -> Study:
    """The study without the seconds that its verification took."""
    none = {"fields_seconds": 0.0, "nodal_seconds": 0.0, "ngspice_seconds": 0.0}
    records = (replace(r, verification=replace(r.verification, **none)) for r in study.records)
    return replace(study, records=tuple(records))


def outputs(folder: Path) -> dict[str, bytes | None]:
    """Every file that a run leaves besides its HDF5 file; without the content of those that tell times."""
    found = sorted(path for pattern in OUTPUTS for path in folder.glob(pattern))
    timed = {"report.html", "verification.png", "verification.svg"}
    return {path.relative_to(folder).as_posix(): None if path.name in timed else path.read_bytes() for path in found}


def tiny() -> Design:
    """Two by two yarns of three fibrils, stretched and sheared in ten steps each."""
    loading = (uniaxial("stretch", equal_steps(0.1, 10)), shear("shear", equal_steps(0.2, 10)))
    design = plain_weave(yarns=2, rows=(1, 2), loading=loading)
    return replace(design, numerics=replace(design.numerics, elements=6, section_degree=6))


def report(design: Design, kills: int, workers: int, seed: int, place: Path) -> tuple[str, bool]:
    """The table of `kills` kills, and whether nothing was lost and all numbers are equal."""
    rng = np.random.default_rng(seed)
    whole = run_study(design, workers=1)  # what has to be compiled is compiled here, and not timed below
    write_study_start(place / "design.h5", replace(whole, records=()))
    clock = time.time()
    trouble = Trial(place / "design.h5", whole, place / "whole", workers).complete()
    seconds, computing = time.time() - clock, (place / "whole" / "results.h5").stat().st_mtime - clock
    rows: list[list[object]] = []
    troubles = [f"uninterrupted: {trouble}"] if trouble else []
    killed = folders = 0
    while killed < kills:
        folders += 1
        trial = Trial(place / "design.h5", whole, place / f"trial{folders}", workers)
        drawing = False
        while killed < kills and not drawing:
            drawing = len(trial.states()) == len(whole.records)
            hit, row = trial.kill_after(float(rng.uniform(0.0, seconds if drawing else computing)))
            killed += hit
            rows.append([f"{folders}.{len(rows) + 1}", *row])
            troubles += [str(row[-1])] if "LOST" in str(row[-1]) or "failed" in str(row[-1]) else []
        trouble = trial.complete()
        if not trouble and outputs(trial.folder) != outputs(place / "whole"):
            trouble = "the files DIFFER"
        rows.append([f"{folders}.{len(rows) + 1}", "-", "-", len(trial.states()), trouble or "equal bit for bit"])
        troubles += [trouble] if trouble else []
    title = f"{killed} kills in {folders} folders; uninterrupted {seconds:.0f} s, {computing:.0f} s to the last state"
    title += f"; {machine()}\n\n"
    verdict = "; ".join(troubles) or "No state was lost, and all studies are equal bit for bit."
    return f"{title}{markdown(HEAD, rows)}\n\n{verdict}", not troubles


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; 1 if something is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("design", nargs="?", type=Path, help="design file (default: a cell of 2 x 2 yarns)")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--workers", type=int, default=0, help="processes (default: as many as circuittex takes)")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    design = tiny() if options.design is None else load_design(options.design)
    with tempfile.TemporaryDirectory() as place:
        text, sound = report(design, options.kills, options.workers, options.seed, Path(place))
    print(text)
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
