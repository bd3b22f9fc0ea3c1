"""A whole ensemble: its members computed side by side, whatever happens to some of them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.compiled import available_cores
from circuittex.base.lock import locked
from circuittex.base.version import __version__
from circuittex.design import Design, design_hash
from circuittex.design.checks import whole
from circuittex.geometry.overlap import check_overlaps
from circuittex.results.records import INITIAL
from circuittex.study.ensemble.cluster import each_result, local_client, remote_client
from circuittex.study.ensemble.files import member_folder, open_folder, write_results
from circuittex.study.ensemble.member import Outcome, compute_member, read_outcome
from circuittex.study.ensemble.perturbation import member_design, perturbed
from circuittex.study.ensemble.quantities import quantities
from circuittex.study.ensemble.result import Ensemble
from circuittex.study.ensemble.start import MemberStarts, member_starts
from circuittex.study.plan import plan

if TYPE_CHECKING:
    from distributed import Client

MOST_MEMBERS, MOST_WORKERS = 100_000, 10_000


def run_ensemble(
    design: Design,
    out: str | Path,
    *,
    members: int,
    seed: int | None = None,
    start: str = INITIAL,
    address: str | None = None,
    workers: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Ensemble:
    """Compute `members` random packings of a design, each a full study in a folder of its own below `out`.

    The amplitudes are those of the design's packing, and where it has none the small ones of `default_packing`; its
    `seed`, or the one given here, decides every member's. Members run on Dask: on the scheduler at `address`, whose
    workers must all see `out`, or on `workers` processes of this machine, by default as many as it has cores. A
    script calls this below ``if __name__ == "__main__":``, since Dask's processes import it.

    Members start from their initial weaves, or with `start` = FOLDER[:STATE] each from the state, by default the
    relaxed one, that the member of its number has in another ensemble of a similar design with the same packings. Those
    that have none there start from their initial weaves.

    A member whose worker dies is tried again; one that cannot be packed or does not converge is reported in the
    result, with its seed, and the others go on. The same call goes on where an earlier one ended, and may ask for
    more members. Bands, tables, figures and a page are left in `out`, see `docs/ensemble.md`.

    `progress` is told in words what is done; what ends with a line break is worth keeping in sight.

    Raises `DesignError` for unusable arguments and starts, before any work, and `FolderError` where `out` holds another
    ensemble or is in use.
    """
    whole(members, "members", 1, MOST_MEMBERS)
    if workers is not None:
        whole(workers, "workers", 1, MOST_WORKERS)
    base = perturbed(design, seed)
    check_overlaps(base.weave)
    starts = member_starts(base, start, range(members))
    folder = Path(out).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    say = progress if progress is not None else _say_nothing
    with locked(folder):
        open_folder(folder, base, starts.words)
        designs = {number: member_design(base, number) for number in range(members)}
        read = {number: read_outcome(member_folder(folder, number), design) for number, design in designs.items()}
        known = {number: outcome for number, outcome in read.items() if outcome is not None}
        waiting = {number: design for number, design in designs.items() if number not in known}
        if waiting:
            say(f"starting workers; {len(known)} of {members} members are done")
            with _client((folder, starts.source), address, workers, len(waiting)) as client:
                known |= _computed(client, folder, waiting, starts, known, say)
        ensemble = replace(assembled(base, [known[number] for number in range(members)]), start=starts.words)
        say("tables, figures and page")
        write_results(folder, ensemble)
    return ensemble


def _client(
    folders: tuple[Path, str], address: str | None, workers: int | None, tasks: int
) -> AbstractContextManager[Client]:
    if address is not None:
        return remote_client(address, *folders)
    return local_client(min(workers or available_cores(), tasks))


def _computed(
    client: Client,
    folder: Path,
    waiting: dict[int, Design],
    starts: MemberStarts,
    known: dict[int, Outcome],
    say: Callable[[str], None],
) -> dict[int, Outcome]:
    """The outcomes of the members that wait; an error that no design is to blame for becomes one as well."""
    arguments = {
        number: (design, str(member_folder(folder, number)), starts.of(number)) for number, design in waiting.items()
    }
    total, found = len(known) + len(waiting), dict[int, Outcome]()
    for number, result in each_result(client, compute_member, arguments):
        design = waiting[number]
        if isinstance(result, Exception):
            text = " ".join(f"{type(result).__name__}: {result}".split())
            result = Outcome(_nothing(design), text, ())
        found[number] = result
        failed = sum(bool(outcome.failure) for outcome in (*known.values(), *found.values()))
        done = f"{len(known) + len(found)} of {total} members, {failed} failed"
        member = f"member {number:04d} (seed {design.packing.seed})"
        say(f"{done}; {member} failed: {result.failure}\n" if result.failure else f"{done}; {member} done")
    return found


def _nothing(design: Design) -> Floats:
    return np.full((len(plan(design)), len(quantities(design))), np.nan)


def assembled(design: Design, outcomes: list[Outcome]) -> Ensemble:
    """The ensemble of a perturbed design from the outcomes of its members, in their order."""
    steps = plan(design)
    return Ensemble(
        version=__version__,
        design=design,
        design_hash=design_hash(design),
        seeds=tuple(member_design(design, number).packing.seed for number in range(len(outcomes))),
        failures=tuple(outcome.failure for outcome in outcomes),
        disagreeing=tuple(outcome.disagreeing for outcome in outcomes),
        states=tuple(step.name for step in steps),
        loadings=tuple(step.loading for step in steps),
        strains=np.array([step.strain for step in steps]),
        quantities=quantities(design),
        values=np.stack([outcome.values for outcome in outcomes]),
    )


def _say_nothing(_: str) -> None:
    pass
