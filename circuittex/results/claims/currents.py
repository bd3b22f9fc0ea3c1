"""What the paper states about currents and the insulated yarn (sections 6.2 and 8.3)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.contact.state import ContactState
from circuittex.electrical.fields import Fields, solve_probes
from circuittex.geometry.mesh import FibrilMesh
from circuittex.results.claims.cell import PaperStudy
from circuittex.results.claims.claim import Claim, Finding, counted, graded
from circuittex.results.records import Record
from circuittex.results.vtk import tubes

STRONGER = (
    "The paper's code made contacts much stronger than stated: it had E*/R* upside down in [29] (133 times too wide at "
    "E* = 10 MPa) and dropped sigma from the fibrils (ten times); circuittex follows the equations."
)
NAMES = "stretch", "shear"


def balance(paper: PaperStudy) -> Finding | None:
    if not paper.probes:
        return None
    currents = np.array([[f.currents for f in record.fields] for record in paper.study.records])
    off = float((np.abs(currents.sum(axis=-1)) / np.abs(currents).max(axis=-1)).max())
    return graded(f"source and sink differ by at most {off:.1e} of either", off <= 1e-9, off <= 1e-6)


def neighbours(paper: PaperStudy) -> Finding | None:
    """The largest current of a yarn that no terminal holds, over the probe's own, at the ends of both loadings."""
    if not (paper.probes and paper.loadings):
        return None
    shares = [[neighbour_share(paper, p[-1].fields[k]) for k in paper.probes] for p in paper.loadings]
    text = "largest share of the probe's current in another yarn, probes 1, 2, 3: " + "; ".join(
        f"{name} {', '.join(f'{100 * share:.2g} %' for share in row)}" for name, row in zip(NAMES, shares, strict=True)
    )
    return counted(text, [share >= 0.05 for row in shares for share in row])


def insulated(paper: PaperStudy) -> Finding | None:
    if not paper.probes:
        return None
    current = uncoupled_currents(paper, paper.relaxed)
    whole = yarn_conductance(paper.study.mesh)
    text = f"probes 1, 2, 3 carry {current[0]:.4f}, {current[1]:.2g}, {current[2]:.2g} A; [57] gives {whole:.4f} A"
    return graded(text, bool(abs(current[0] / whole - 1.0) <= 1e-6 and np.abs(current[1:]).max() <= 1e-9 * whole))


def insulated_strained(paper: PaperStudy) -> Finding | None:
    if not (paper.probes and paper.loadings):
        return None
    rest = uncoupled_currents(paper, paper.relaxed)[0]
    change = [abs(uncoupled_currents(paper, records[-1])[0] / rest - 1.0) for records in paper.loadings]
    text = f"without contacts probe 1 changes by {change[0]:.1g} at the largest stretch and {change[1]:.1g} in shear"
    return graded(text, max(change) <= 1e-9, max(change) <= 1e-3)


def first_is_highest(paper: PaperStudy) -> Finding | None:
    if not paper.probes:
        return None
    currents = paper.currents(paper.study.records)
    highest = currents[:, 0] >= currents.max(axis=1)
    ratio = float((currents[:, 0] / currents[:, 1:].max(axis=1)).min())
    text = f"in {highest.sum()} of {len(highest)} states; at least {ratio:.3g} times the current of any other probe"
    return counted(text, highest.tolist())


def first_varies(paper: PaperStudy) -> Finding | None:
    if not (paper.probes and paper.loadings):
        return None
    ranges = []
    for records in paper.loadings:
        current = paper.currents(records)[:, 0]
        ranges.append(float(np.ptp(current) / current[0]))
    text = "the current of probe 1 varies by {:.2g} % in stretch and {:.2g} % in shear".format(
        *(100 * size for size in ranges)
    )
    return counted(text, [size >= 0.05 for size in ranges])


def others_drop(paper: PaperStudy) -> Finding | None:
    if not (paper.probes and paper.loadings):
        return None
    drops = [trend(records, 1.0 / paper.currents(records)[:, 1:]) for records in paper.loadings]
    text = "straight-line trend of the resistance of probes 2 and 3: " + "; ".join(
        f"{100 * drop[0]:+.1f} and {100 * drop[1]:+.1f} % in {name}" for name, drop in zip(NAMES, drops, strict=True)
    )
    return counted(text, [bool(value <= -0.05) for drop in drops for value in drop])


def load_grows(paper: PaperStudy) -> Finding | None:
    """The contact force of all pairs: the sum of p w; each contact stands there from both sides with half its w."""
    if not paper.loadings:
        return None
    rest = contact_force(paper.relaxed.contacts)
    ends = [contact_force(records[-1].contacts) for records in paper.loadings]
    text = f"force of all contacts together: {rest:.2f} N at rest, {ends[0]:.2f} N stretched, {ends[1]:.2f} N sheared"
    return counted(text, [end > rest for end in ends])


def reversals(paper: PaperStudy) -> Finding | None:
    if not (paper.probes and paper.loadings):
        return None
    rises, falls = [], []
    for records in paper.loadings:
        currents = paper.currents(records)[:, 1:]
        step = np.diff(currents, axis=0) / currents[:-1]
        rises.append(float(step.max()))
        falls.append(max(0.0, -float(step.min())))
    text = "largest rise and fall of the current of probes 2 and 3 in one step: " + "; ".join(
        f"{100 * rise:.2g} and {100 * fall:.2g} % in {name}"
        for name, rise, fall in zip(NAMES, rises, falls, strict=True)
    )
    return counted(text, [min(rise, fall) >= 1e-3 for rise, fall in zip(rises, falls, strict=True)])


def neighbour_share(paper: PaperStudy, fields: Fields) -> float:
    """Largest current along any yarn that holds no terminal of the probe, relative to the probe's."""
    mesh = paper.study.mesh
    ends = {terminal.name: terminal.ends for terminal in paper.study.design.terminals}
    driven = {mesh.yarn_names.index(yarn) for name in fields.terminals for yarn, _ in ends[name]}
    start = tubes.spans(mesh)[:, 0]
    fibril = mesh.node_fibril[start]
    place = start - mesh.first_node[fibril]
    total = np.zeros((len(mesh.yarn_names), int(place.max()) + 1))
    np.add.at(total, (mesh.yarn[fibril], place), tubes.span_current(mesh, fields))
    others = np.delete(total, sorted(driven), axis=0)
    return float(np.abs(others).max() / abs(fields.currents[0]))


def uncoupled_currents(paper: PaperStudy, record: Record) -> Floats:
    """(3,) currents of the paper's probes in the state without its contacts: sigma_c = 0, A."""
    none, nothing = np.zeros(0, dtype=np.int64), np.zeros(0)
    bare = replace(
        record.contacts,
        fibril_a=none,
        fibril_b=none,
        xi_a=nothing,
        xi_b=nothing,
        gap=nothing,
        line_load=nothing,
        width=nothing,
        weight=nothing,
        conductance=nothing,
        heat_conductance=nothing,
    )
    design = record.driven(paper.study.design)
    solved = solve_probes(bare, design.terminals, [design.probes[number] for number in paper.probes])
    return np.array([fields.currents[0] for fields in solved])


def yarn_conductance(mesh: FibrilMesh) -> float:
    """Conductance of the first yarn from end to end, its fibrils in parallel [57], S."""
    own = mesh.yarn == 0
    return float((mesh.electrical_conductivity * mesh.area / mesh.length)[own].sum())


def contact_force(contacts: ContactState) -> float:
    """Sum of the normal forces of all contacts, N."""
    return float((contacts.line_load * contacts.weight).sum())


def trend(records: tuple[Record, ...], values: Floats) -> Floats:
    """(k,) relative change of values (n, k) over the loading along the straight line that fits them best."""
    strain = np.array([record.strain for record in records])
    slope: Floats = np.polyfit(strain, values, 1)[0] * np.ptp(strain) / values[0]
    return slope


CLAIMS = (
    Claim(
        "6.2, [42]",
        "The current that enters at a probe leaves at the common terminal.",
        "to 1e-9 of the current in every state; in part 1e-6",
        balance,
    ),
    Claim(
        "8.3, figure 13",
        "An appreciable current passes through neighbouring yarns with every probe.",
        "another yarn carries at least 5 % of the probe's current, for all probes at the ends of both loadings; in "
        "part for some",
        neighbours,
        STRONGER,
    ),
    Claim(
        "8.3",
        "Without contact conduction probes 2 and 3 carry nothing and probe 1 what one yarn does.",
        "to 1e-6 of the yarn's current",
        insulated,
    ),
    Claim(
        "8.3, [58-60]",
        "With constant conductivity the insulated currents do not change with deformation.",
        "to 1e-9; in part 1e-3",
        insulated_strained,
    ),
    Claim("8.3, figure 11", "Probe 1, along one yarn, always carries the most.", "in every state", first_is_highest),
    Claim(
        "8.3, figure 11",
        "The additional paths through contacts let the resistance along a yarn vary significantly with deformation.",
        "by at least 5 % in both loadings; in part in one",
        first_varies,
        STRONGER + " A contact here conducts so little beside its fibrils that the yarn hardly notices it.",
    ),
    Claim(
        "8.3, figure 11",
        "Probes 2 and 3 lose much of their resistance on average, in stretch and in shear.",
        "the straight line through the resistances falls by at least 5 % for both probes in both loadings; in part "
        "for some",
        others_drop,
    ),
    Claim(
        "8.3",
        "That drop comes with growing contact pressure.",
        "the force of all contacts together grows to the end of both loadings; in part of one",
        load_grows,
    ),
    Claim(
        "8.3, figure 11",
        "The currents change non-monotonically and at some points reverse their trend.",
        "probe 2 or 3 has a step of at least 0.1 % up and another down in both loadings; in part in one",
        reversals,
        "In shear the yarns turn about their crossings with little sliding: on the branch that is followed here hardly "
        "anything rearranges.",
    ),
)
"""In the order of the paper."""
