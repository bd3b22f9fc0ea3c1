"""What the paper states about shape and forces (sections 8.1, 8.2 and 9)."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.geometry.levels import levels
from circuittex.results.claims.cell import PaperStudy
from circuittex.results.claims.claim import Claim, Finding, counted, graded
from circuittex.results.records import Record

TENSION = 2.0
"""N, the clamp force the paper gives for the relaxed cell."""
CENTRE = 1, -1.0
"""A centre warp yarn, and where along it, mm, it meets a centre weft yarn."""
CORNER = 2.0
"""Crossings farther than this from both centre lines are those of outermost yarns, mm."""


def flattening(paper: PaperStudy) -> Finding:
    before = levels(paper.study.mesh, paper.study.mesh.position, *CENTRE)
    after = paper.relaxed.levels
    return graded(f"{before} levels before, {after} after relaxation", (before, after) == (3, 2))


def tension(paper: PaperStudy) -> Finding:
    warp, weft = _normal_forces(paper.relaxed)
    off = max(abs(warp / TENSION - 1.0), abs(weft / TENSION - 1.0))
    text = f"{warp:.3f} N on the warp's clamps, {weft:.3f} N on the weft's"
    return graded(text, off <= 0.15, off <= 0.5)


def equal_tension(paper: PaperStudy) -> Finding:
    warp, weft = _normal_forces(paper.relaxed)
    off = abs(warp - weft) / max(abs(warp), abs(weft))
    return graded(f"the two differ by {off:.1e} of either", off <= 0.01, off <= 0.1)


def every_fibril_in_tension(paper: PaperStudy) -> Finding:
    """Longer than its natural length means in tension on average; chords between nodes underestimate the length."""
    mesh, r = paper.study.mesh, paper.relaxed.configuration.r
    chords = np.linalg.norm(np.diff(r, axis=0), axis=1)
    chords[mesh.end_nodes(+1)[:-1]] = 0.0  # from one fibril to the next
    stretch = np.add.reduceat(np.append(chords, 0.0), mesh.first_node[:-1]) / mesh.length - 1.0
    force = paper.relaxed.section_force
    text = (
        f"{np.count_nonzero(stretch > 0.0)} of {mesh.n_fibrils} fibrils are longer than their natural length, by "
        f"{100 * stretch.min():.1f} to {100 * stretch.max():.1f} %; section forces from {1e3 * force.min():.1f} to "
        f"{1e3 * force.max():.1f} mN"
    )
    uneven = force.max() > 1.1 * force.min()
    return graded(text, bool((stretch > 0.0).all() and uneven), bool((stretch > 0.0).any()))


def corners(paper: PaperStudy) -> Finding:
    mesh, force = paper.study.mesh, paper.relaxed.section_force
    middle = paper.relaxed.configuration.r[mesh.elements].mean(axis=1)
    corner = (np.abs(middle[:, :2]) > CORNER).all(axis=1)
    inside, outside = force[corner].max(), force[~corner].max()
    text = (
        f"largest section force {1e3 * inside:.1f} mN at the four corner crossings, {1e3 * outside:.1f} mN elsewhere; "
        f"the mean is {1e3 * force.mean():.1f} mN"
    )
    return graded(text, inside >= outside, inside >= np.quantile(force, 0.95))


def out_of_plane(paper: PaperStudy) -> Finding | None:
    shares = [_out_of_plane_share(records) for records in paper.loadings]
    if not shares:
        return None
    text = "largest |Fz| is {:.1f} % of the force on the same clamps in stretch, {:.1f} % in shear".format(
        *(100 * share for share in shares)
    )
    return graded(text, max(shares) <= 0.05, max(shares) <= 0.15)


def both_loadings(paper: PaperStudy) -> Finding | None:
    if not paper.loadings:
        return None
    steps = [len(records) - 1 for records in paper.loadings]
    ends = [records[-1].strain for records in paper.loadings]
    iterations = [sum(record.iterations for record in records[1:]) for records in paper.loadings]
    text = (
        f"stretch to {100 * ends[0]:g} % in {steps[0]} steps ({iterations[0]} iterations), "
        f"shear to {100 * ends[1]:g} % in {steps[1]} ({iterations[1]} iterations)"
    )
    return counted(text, [n == 10 and abs(end - 0.25) < 1e-9 for n, end in zip(steps, ends, strict=True)])


def poisson(paper: PaperStudy) -> Finding | None:
    if not paper.stretch:
        return None
    last = paper.stretch[-1]
    before, after = (float(record.clamp_force[1, 1]) for record in (paper.relaxed, last))
    change = after / before - 1.0
    text = f"weft tension from {before:.3f} to {after:.3f} N ({100 * change:+.1f} %) at {100 * last.strain:g} % stretch"
    return graded(text, abs(change) >= 0.05, abs(change) >= 0.01)


def _normal_forces(record: Record) -> tuple[float, float]:
    """Force on the warp's clamps along x and on the weft's along y, N."""
    return float(record.clamp_force[0, 0]), float(record.clamp_force[1, 1])


def _out_of_plane_share(records: tuple[Record, ...]) -> float:
    force: Floats = np.array([record.clamp_force for record in records])
    return float((np.abs(force[..., 2]) / np.linalg.norm(force, axis=-1)).max())


CLAIMS = (
    Claim(
        "8.1, figure 10",
        "Yarns laid out in three levels flatten into two as they relax, seen in a cut through a centre yarn.",
        "three levels before and two after, at the crossing of two centre yarns",
        flattening,
    ),
    Claim(
        "8.2",
        "The relaxed cell is in tension: about 2 N on the clamps of either direction.",
        "agrees within 15 %, in part within 50 %",
        tension,
        "With Table I's modulus the fibrils cannot carry 2 N: even their initial wave carries 0.39 N, and 3.1 N with "
        "the modulus of the paper's code. Yarns compacted by about 0.1 mm at the crossings would carry 2 N with the "
        "latter; here they settle further. Elements that lock in bending and contact on straight segments, as in that "
        "code, may have held them apart, which has not been shown.",
    ),
    Claim("8.2", "That tension is alike in both directions.", "within 1 %; in part within 10 %", equal_tension),
    Claim(
        "8.2, figures 9 and 10",
        "Interweaving puts every fibril in tension; the forces are not uniform.",
        "every centre line is longer than its natural length, and the section forces differ by more than 10 %",
        every_fibril_in_tension,
    ),
    Claim(
        "8.2, figure 9",
        "Some fibrils at the corners of the cell, held by the clamps, carry particularly high forces.",
        "a corner crossing has the largest section force; in part: one of the highest twentieth of all",
        corners,
    ),
    Claim(
        "8.2, figure 11",
        "Uniaxial extension and simple shear to 25 % strain, in ten steps each.",
        "every step has its equilibrium, to the largest free force that the design allows",
        both_loadings,
    ),
    Claim(
        "8.2, figure 11",
        "Reactions out of the plane stay near zero.",
        "at most 5 % of the force on the same clamps; in part 15 %",
        out_of_plane,
    ),
    Claim(
        "9, figure 11",
        "The weave's structure gives a Poisson effect: the weft's tension changes as the warp is stretched.",
        "by at least 5 % at the largest stretch; in part 1 %",
        poisson,
    ),
)
"""In the order of the paper."""
