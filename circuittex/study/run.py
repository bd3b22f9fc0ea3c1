"""Algorithm 1: relax, then move and relax along every loading path, and record each state."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

from circuittex.base.compiled import available_cores
from circuittex.base.errors import DesignError, StoreError
from circuittex.base.lock import locked
from circuittex.base.version import __version__
from circuittex.base.workers import Here, Job, Pool, completed
from circuittex.contact.conductance import check_laws
from circuittex.design import Design, design_hash
from circuittex.design.contact_laws import PROVIDED
from circuittex.geometry.weave import build_mesh
from circuittex.mech.checkpoint import NONE, Checkpoints
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.linear import LinearSolver
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.results.records import INITIAL, Examination, Study, with_examination
from circuittex.results.store import RESULTS
from circuittex.study.branch_check import branch_checks
from circuittex.study.error_estimate import estimates, variants
from circuittex.study.folder import (
    complete,
    keep_examination,
    keep_record,
    needs_report,
    open_study,
    write_numbers,
    write_state,
)
from circuittex.study.forecast import Forecast, foresee
from circuittex.study.plan import RELAXED, plan
from circuittex.study.record import Recorded, reach
from circuittex.study.rest import Rest
from circuittex.study.schedule import compute
from circuittex.study.start import chosen
from circuittex.study.unfinished import remove_unfinished, unfinished

Say = Callable[[str], None]
Keep = Callable[[Study, Recorded], Study]


def run_study(
    design: Design,
    out: str | Path | None = None,
    *,
    start: str = INITIAL,
    fresh: bool = False,
    error_estimate: bool = False,
    branches: bool = False,
    workers: int | None = None,
    solver: Callable[[], LinearSolver] = MultifrontalSolver,
    progress: Say | None = None,
) -> Study:
    """Compute a design: the relaxed state and every state of its loading paths.

    With `out`, everything is left in that folder, which no other run can use meanwhile. The HDF5 file there grows state
    by state, netlists and VTU files are written with each, figures and report at the end. However a run ends, the same
    call goes on from the states that are there, with the same numbers bit for bit, and where the first relaxation is
    long from within that (`unfinished`); files that are missing are written again. Results of another design or version
    are refused unless `fresh` has them removed; files that are not of circuittex are left alone.

    The first relaxation starts from the initial weave, or as `start` says: 'tiled', from copies of the smallest cell
    that the draft repeats, relaxed before; FILE or FILE:STATE, from a stored state of a similar design, by default its
    relaxed one. A folder goes on with the start that it was begun with.

    Loading paths are computed beside one another by `workers` processes, by default one for each path as far as there
    are cores; with one, or with a contact law of one's own, in this process. The results do not depend on it. `solver`
    makes the linear solver of each relaxation. `progress` is told in words what is being done; a line break ends what
    is worth keeping on the screen.

    With `error_estimate` the relaxed state and the last of each loading path get estimates of their discretisation
    errors, as far as they have none, each from three more relaxations (`estimate_error`). With `branches` every state
    is reached once more, with the fibrils in another order, to see whether round-off chooses its branch
    (`check_branch`), as far as it has not been checked. Both are kept one by one as the states are.

    What all will take is said before the first state (`foresee`). Raises `SizeError` where there is not the memory for
    it, `ConvergenceError` where equilibria are not found, once the other paths are done; `FolderError` where the
    folder cannot be used; `StoreError` where it cannot be written, on a full disk for example.
    """
    say = progress if progress is not None else _say_nothing
    check_laws(design.contact)  # before an earlier run's results are removed
    count = _workers(workers)
    if not set(design.contact.laws) <= set(PROVIDED):
        count = 1  # other processes know nothing of what this one has added
    if error_estimate:
        variants(design)  # refuses what it must before any long work
    mesh = build_mesh(design)
    study = Study(
        version=__version__,
        design=design,
        design_hash=design_hash(design),
        mesh=mesh,
        initial=initial_configuration(mesh),
        records=(),
    )
    started = chosen(study, start, solver, say)
    study = replace(study, start=started.words)

    def begin(study: Study) -> Study:
        return replace(study, initial=started.configuration())

    def jobs(found: Study) -> Sequence[Job]:
        estimated = estimates(found, solver) if error_estimate else []
        return [*estimated, *(branch_checks(found, solver) if branches else [])]

    if out is None:
        foreseen = foresee(study, count)
        _rest(study, count, say, foreseen, NONE)
        study = _compute(begin(study), foreseen.workers if foreseen else count, solver, say, _with, NONE)
        return _examine(study, jobs(study), count, say, with_examination)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        # What is too large removes nothing, and no start is computed for it.
        foreseen = foresee(study, count) if fresh or not (folder / RESULTS).exists() else None
        study = open_study(folder, study, begin, fresh=fresh)
        return _in_folder(folder, study, count, solver, say, jobs, foreseen)


def _in_folder(
    folder: Path,
    study: Study,
    workers: int,
    solver: Callable[[], LinearSolver],
    say: Say,
    jobs: Callable[[Study], Sequence[Job]],
    foreseen: Forecast | None,
) -> Study:
    """Complete the study and everything in its folder."""
    loading = {step.name: step.loading for step in plan(study.design)}
    if study.records:
        say(f"{len(study.records)} of {len(loading)} states are there already\n")
        remove_unfinished(folder)
    foreseen = foreseen or foresee(study, workers)
    checkpoints = NONE if study.records else unfinished(folder, study, solver().name, say)
    rest = _rest(study, workers, say, foreseen, checkpoints)

    def keep(so_far: Study, recorded: Recorded) -> Study:
        record = recorded.record
        so_far = keep_record(folder, so_far, record)
        remove_unfinished(folder)
        rest.done(loading[record.name])
        write_state(folder, so_far, record, recorded.circuits)
        write_numbers(folder, so_far)
        return so_far

    try:
        study = _compute(study, foreseen.workers if foreseen else workers, solver, rest, keep, checkpoints)
        study = _examine(study, jobs(study), workers, say, partial(keep_examination, folder))
        if needs_report(folder):
            say("figures and report")
        complete(folder, study)
    except (OSError, StoreError) as error:
        raise StoreError(
            f"{error}; {rest.kept} of {rest.total} states are kept in {folder}, and the same call goes on from there"
        ) from error
    return study


def _rest(study: Study, workers: int, say: Say, foreseen: Forecast | None, checkpoints: Checkpoints) -> Rest:
    """What there is to do, once it has been said."""
    known, steps = {record.name for record in study.records}, plan(study.design)
    left = Counter(step.loading for step in steps if step.name not in known)
    rest = Rest(left, len(steps), workers, say, foreseen=foreseen, partly=checkpoints.reached is not None)
    if left:
        say(f"{rest.opening()}\n")
    return rest


def _compute(
    study: Study,
    workers: int,
    solver: Callable[[], LinearSolver],
    say: Say,
    keep: Keep,
    checkpoints: Checkpoints,
) -> Study:
    """The study with all its states; the relaxed one, before which nothing else can be done, goes on from what
    `checkpoints` tell of."""
    known = {record.name for record in study.records}
    loadings = {step.loading for step in plan(study.design) if step.loading and step.name not in known}
    workers = min(workers, len(loadings))  # more would wait for one another
    several = workers > 1
    pool = Pool(workers, threads=max(1, available_cores() // workers), say=say) if several else Here(say)
    with closing(pool) as computers:
        first = {}
        if not study.records:  # this process has all cores for it
            first = {RELAXED: reach(study, plan(study.design)[0], study.initial, solver, say, checkpoints)}
        return compute(study, computers, solver, keep, first)


def _examine(
    study: Study, jobs: Sequence[Job], workers: int, say: Say, keep: Callable[[Study, Examination], Study]
) -> Study:
    """The study with what the jobs find about its states."""
    workers = min(workers, len(jobs))
    pool = Pool(workers, threads=max(1, available_cores() // workers), say=say) if workers > 1 else Here(say)
    with closing(pool) as computers:
        for examination in completed(computers, jobs):
            study = keep(study, examination)
    return study


def _workers(asked: int | None) -> int:
    """The number of processes to use at most."""
    if asked is not None and (not isinstance(asked, int) or asked < 1):
        raise DesignError("workers", asked, "it must be a whole number of at least 1")
    return available_cores() if asked is None else asked


def _with(study: Study, recorded: Recorded) -> Study:
    """The study with one more record."""
    return replace(study, records=(*study.records, recorded.record))


def _say_nothing(_: str) -> None:
    pass
