"""What the paper states about the reduced network (section 8.3, figure 15)."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.results.claims.cell import PaperStudy
from circuittex.results.claims.claim import Claim, Finding, graded
from circuittex.results.claims.currents import NAMES, STRONGER
from circuittex.results.records import Record
from circuittex.results.summary import insulated_resistance

PRINTED = 0.282
"""Ry of an insulated segment as the paper prints it, ohm [57]."""
PLACES = 40
"""Pieces of a yarn that are looked at for contact with crossing yarns."""


def insulated_segment(paper: PaperStudy) -> Finding:
    Ry = insulated_resistance(paper.study.mesh)
    return graded(f"{Ry:.4f} Ω; the paper prints {PRINTED} Ω", abs(Ry - PRINTED) <= 1e-3, abs(Ry - PRINTED) <= 1e-2)


def steady_segment(paper: PaperStudy) -> Finding | None:
    if not (paper.probes and paper.loadings):
        return None
    expected = insulated_resistance(paper.study.mesh)
    Ry = np.array([record.fit.Ry for records in paper.loadings for record in records])
    off = float(np.abs(Ry / expected - 1.0).max())
    text = f"Ry from {Ry.min():.5f} to {Ry.max():.5f} Ω, at most {100 * off:.2g} % from the insulated {expected:.5f} Ω"
    return graded(text, off <= 0.05, off <= 0.2)


def sliding_crossing(paper: PaperStudy) -> Finding | None:
    if not (paper.probes and paper.loadings):
        return None
    Rc = [_crossing(records) for records in paper.loadings]
    steps = [float(np.abs(np.diff(values) / values[:-1]).max()) for values in Rc]
    total = [float(np.ptp(values) / values[0]) for values in Rc]
    text = "; ".join(
        f"{name}: Rc from {values[0]:.0f} to {values[-1]:.0f} Ω, by up to {100 * step:.1f} % in one step"
        for name, values, step in zip(NAMES, Rc, steps, strict=True)
    )
    return graded(text, max(steps) >= 0.1, max(total) >= 0.1)


def follows_currents(paper: PaperStudy) -> Finding | None:
    if not (paper.probes and paper.loadings):
        return None
    found = []
    for records in paper.loadings:
        currents, Rc = paper.currents(records), _crossing(records)
        found += [float(np.corrcoef(Rc, currents[:, number])[0, 1]) for number in (1, 2)]
    text = "correlation of Rc with the currents of probes 2 and 3: "
    text += "{:.2f} and {:.2f} in stretch, {:.2f} and {:.2f} in shear"
    return graded(text.format(*found), max(found) <= -0.8, max(found) <= 0.0)


def misfit(paper: PaperStudy) -> Finding | None:
    """The largest relative misfit of a probe current, whatever the weighting of the fit."""
    if not paper.probes:
        return None
    states = paper.study.records
    network = np.array([[record.fit.currents[number] for number in paper.probes] for record in states])
    off = np.abs(network / paper.currents(states) - 1.0).max(axis=1)
    text = f"the network misses a probe current by {100 * off.min():.2g} to {100 * off.max():.2g} %"
    return graded(text, bool((off >= 0.01).all()), bool((off >= 1e-3).any()))


def long_crossings(paper: PaperStudy) -> Finding:
    share = crossing_share(paper.relaxed, paper.study.mesh.yarn_axis)
    text = f"a yarn touches crossing yarns over {100 * share:.0f} % of its length at rest"
    return graded(text, share > 0.5, share > 0.25)


def crossing_share(record: Record, yarn_axis: Ints) -> float:
    """Share of the yarns' length, in `PLACES` pieces each, in which a fibril touches one of the other direction."""
    contacts = record.contacts
    yarn = contacts.mesh.yarn
    crossing = yarn_axis[yarn[contacts.fibril_a]] != yarn_axis[yarn[contacts.fibril_b]]
    touched = np.zeros((len(yarn_axis), PLACES), dtype=bool)
    for fibril, xi in ((contacts.fibril_a, contacts.xi_a), (contacts.fibril_b, contacts.xi_b)):
        piece = (xi / contacts.mesh.length[fibril] * PLACES).astype(int).clip(0, PLACES - 1)
        touched[yarn[fibril[crossing]], piece[crossing]] = True
    return float(touched.mean())


def _crossing(records: tuple[Record, ...]) -> Floats:
    return np.array([record.fit.Rc for record in records])


CLAIMS = (
    Claim(
        "8.3, [57]",
        "An insulated yarn segment has 0.282 Ω.",
        "within 0.001 Ω; in part 0.01 Ω",
        insulated_segment,
    ),
    Claim(
        "8.3, figure 15",
        "Ry is not a strong function of the deformation and stays near the insulated value.",
        "within 5 % in every state; in part 20 %",
        steady_segment,
    ),
    Claim(
        "8.3, figure 15",
        "The contact resistance can change drastically as fibrils slide past one another.",
        "by at least 10 % in one step; in part: by 10 % over a loading",
        sliding_crossing,
        STRONGER,
    ),
    Claim(
        "8.3, figures 11 and 15",
        "Rc follows the trend of the currents.",
        "correlation with the currents of probes 2 and 3 below -0.8 in both loadings; in part below 0",
        follows_currents,
    ),
    Claim(
        "8.3",
        "One Ry and one Rc follow the three currents only approximately.",
        "every state misses a current by at least 1 %; in part: one misses by 0.1 %",
        misfit,
    ),
    Claim(
        "8.3",
        "The weave is so dense that crossing yarns touch over most of their length.",
        "over more than half of it at rest; in part a quarter",
        long_crossings,
    ),
)
"""In the order of the paper."""
