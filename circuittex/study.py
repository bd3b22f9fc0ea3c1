"""Algorithm 1: relax, then move and relax along every loading path, and record each state."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np

from circuittex import __version__
from circuittex.contact.extract import contacts_of
from circuittex.design import Design, Loading, design_hash
from circuittex.export import simplified, state_word, write_netlists
from circuittex.fields import solve_probes
from circuittex.fit import fit_network
from circuittex.geometry.levels import levels
from circuittex.geometry.mesh import Floats
from circuittex.geometry.weave import build_mesh
from circuittex.increment import advance
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.linear import LinearSolver, best_solver
from circuittex.plot import FIGURES
from circuittex.relaxation import Equilibrium, clamp_force, relax
from circuittex.report import write_report
from circuittex.results import Record, Study
from circuittex.store import append_record, write_study_start
from circuittex.summary import write_summary
from circuittex.verify import field_convergence, verify
from circuittex.verify_reduced import verify_reduced
from circuittex.vtu import write_collections, write_vtu

RESULTS = "results.h5"
"""Name of the HDF5 file in the output folder."""
MARKS = {
    "netlists/*.sub": b"* circuittex ",
    "netlists/*.cir": b"* circuittex ",
    "vtu/*.vtu": b'"contact_line_load_N_per_mm"',
    "vtu/*.pvd": b"<!--circuittex-->",
}
"""What tells the files of a run, whose names depend on its design, from those that somebody else put beside them."""


def run_study(
    design: Design,
    out: str | Path | None = None,
    *,
    solver: LinearSolver | None = None,
    progress: Callable[[str], None] | None = None,
) -> Study:
    """Compute a design: the relaxed state and every state of its loading paths.

    With `out`, everything is left in that folder: the HDF5 file grows state by state, so what an interrupted
    run has completed is kept; netlists and VTU files are written with each state, summary, figures and report
    at the end. What an earlier run left in the folder is removed first, other files are left alone. `progress` is
    told in words what is being done.

    Raises `ConvergenceError` where an equilibrium is not found.
    """
    say = progress if progress is not None else _say_nothing
    mesh = build_mesh(design)
    folder = None if out is None else Path(out)
    study = Study(
        version=__version__,
        design=design,
        design_hash=design_hash(design),
        mesh=mesh,
        initial=initial_configuration(mesh),
        records=(),
    )
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        remove_results(folder)
        write_study_start(folder / RESULTS, study)
    for name, path, strain, gradient, equilibrium in _states(study, solver or best_solver(), say):
        say(f"{name}: fields, netlists and verification")
        record = record_state(study, name, path, strain, gradient, equilibrium, folder)
        study = replace(study, records=(*study.records, record))
        if folder is not None:
            append_record(folder / RESULTS, record)
            write_vtu(_made(folder / "vtu") / f"{name}.vtu", mesh, record)
            write_summary(folder / "summary.json", study)
    if folder is not None:
        say("figures and report")
        write_collections(folder / "vtu", study.records)
        write_report(folder, study)
    return study


def record_state(
    study: Study,
    name: str,
    path: str,
    strain: float,
    gradient: Floats,
    equilibrium: Equilibrium,
    folder: Path | None = None,
) -> Record:
    """Contacts, fields, circuit, netlists (with a `folder`), verification and fit of one equilibrium."""
    design, mesh = study.design, study.mesh
    contacts = contacts_of(design, mesh, equilibrium.configuration)
    fields = solve_probes(contacts, design.terminals, design.probes, contact_heat=design.electrical.contact_heat)
    simple = simplified(design, contacts)
    fit = fit_network([f.currents[0] for f in fields], design)
    verification = verify(contacts, simple.contacts, design.terminals, design.probes, fields=fields)
    convergence = np.empty((0, 2)) if path else field_convergence(contacts, design.terminals, design.probes, fields)
    netlist = ""
    if folder is not None:
        netlist = write_netlists(folder / "netlists", design, name, simple, fit).relative_to(folder).as_posix()
    return Record(
        name=name,
        path=path,
        strain=strain,
        gradient=gradient,
        configuration=equilibrium.configuration,
        residual=equilibrium.residual,
        iterations=equilibrium.iterations,
        history=equilibrium.history,
        clamp_force=clamp_force(mesh, equilibrium.reaction),
        section_force=np.linalg.norm(equilibrium.section_force, axis=1),
        contacts=contacts,
        fields=fields,
        fit=fit,
        reduced_difference=verify_reduced(design, fit),
        verification=verification,
        field_convergence=convergence,
        levels=levels(mesh, equilibrium.configuration.r, *centre_crossing(design)),
        netlist=netlist,
    )


def _states(
    study: Study, solver: LinearSolver, say: Callable[[str], None]
) -> Iterator[tuple[str, str, float, Floats, Equilibrium]]:
    """Every state to record, with its equilibrium; each loading path starts from the relaxed state."""
    design, mesh, rest = study.design, study.mesh, np.eye(2)

    def report(name: str) -> Callable[[int, float], None]:
        return lambda iteration, residual: say(f"{name}: iteration {iteration}, largest free force {residual:.1e} N")

    def tell(name: str) -> Callable[[str], None]:
        return lambda text: say(f"{name}: {text}")

    relaxed = relax(mesh, design, solver=solver, report=report("relaxed"))
    yield "relaxed", "", 0.0, rest, relaxed
    for loading, names in zip(design.loading, state_names(design.loading), strict=True):
        now, before = relaxed, rest
        for name, strain, target in zip(names, loading.strains, loading.gradients, strict=True):
            after = np.array(target)
            now = advance(
                mesh,
                design,
                now.configuration,
                before,
                after,
                free=loading.free,
                solver=solver,
                report=report(name),
                say=tell(name),
            ).equilibrium
            before = after
            yield name, loading.name, strain, after, now


def state_names(loading: Sequence[Loading]) -> tuple[tuple[str, ...], ...]:
    """A name for each state of each loading path: the path's name and the strain, numbered where one recurs.

    Names are unique over the whole study, in files and as words of a netlist, which know neither case nor signs.

    >>> from circuittex.design import shear
    >>> state_names([shear("cycle", (0.05, 0.1, 0.05)), shear("back", (-0.05,))])
    (('cycle-0.05', 'cycle-0.1', 'cycle-0.05-2'), ('back--0.05',))
    """
    taken: set[str] = set()

    def unique(name: str) -> str:
        choices = (name if number == 1 else f"{name}-{number}" for number in count(1))
        free = next(choice for choice in choices if state_word(choice) not in taken)
        taken.add(state_word(free))
        return free

    return tuple(tuple(unique(f"{path.name}-{strain:.6g}") for strain in path.strains) for path in loading)


def remove_results(folder: Path) -> None:
    """Remove what a run left in `folder`, so that no stale result can pass for one of the next run.

    Files in the same places that circuittex did not write stay. The HDF5 file goes last: until then the folder
    can be completed again from it.
    """
    made = [path for pattern, mark in MARKS.items() for path in folder.glob(pattern) if _holds(path, mark)]
    made += [folder / "figures" / f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")]
    for path in (*made, folder / "report.html", folder / "summary.json", folder / RESULTS):
        path.unlink(missing_ok=True)


def _holds(path: Path, mark: bytes) -> bool:
    return path.is_file() and mark in path.read_bytes()


def centre_crossing(design: Design) -> tuple[int, float]:
    """The warp yarn nearest the centre, and where along it (mm) it crosses the weft yarn nearest the centre."""
    weave = design.weave
    weft = (len(weave.weft) - 1) // 2
    return (len(weave.warp) - 1) // 2, (weft - (len(weave.weft) - 1) / 2) * weave.pitch


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _say_nothing(_: str) -> None:
    pass
