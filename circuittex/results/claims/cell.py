"""Which studies are of the paper's cell, and where in them its loadings and probes are."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen, same
from circuittex.design import Design, Probe, Weave, Yarn, plain_weave
from circuittex.results.loadings import by_loading
from circuittex.results.records import Record, Study

SETS = ("paper-code", "paper-table")
"""The parameter sets of the paper's cell."""


@frozen
class PaperStudy:
    """A study of the paper's cell."""

    study: Study
    probes: tuple[int, ...]
    """Numbers of the paper's probes 1, 2 and 3 among those of the design; none where one is missing."""
    stretch: tuple[Record, ...]
    """Uniaxial extension of the warp with the weft held, the relaxed state first; empty where it was not computed."""
    shear: tuple[Record, ...]
    """Simple shear, likewise."""

    @property
    def relaxed(self) -> Record:
        """The state without load."""
        return self.study.records[0]

    @property
    def loadings(self) -> tuple[tuple[Record, ...], ...]:
        """Both loadings, or none where one of them is missing."""
        return (self.stretch, self.shear) if self.stretch and self.shear else ()

    def currents(self, records: tuple[Record, ...]) -> Floats:
        """(n, 3) currents of the paper's three probes, A."""
        return np.array([[record.currents[number] for number in self.probes] for record in records])


def parameter_set(design: Design) -> str | None:
    """The parameter set whose cell the design states, or None where it is not the paper's cell.

    Names, loadings, probes and numerics are free, and whether the contacts' Joule heat counts; weave, yarns,
    packing, clamps, materials, contact law and law of conduction are not.

    >>> parameter_set(plain_weave("paper-table")), parameter_set(plain_weave(yarns=2))
    ('paper-table', None)
    """
    for name in SETS:
        paper = plain_weave(name)
        pairs = (
            (design.contact, paper.contact),
            (design.packing, paper.packing),
            (design.clamps, paper.clamps),
            (design.electrical.conduction, paper.electrical.conduction),
            (_nameless(design.weave), _nameless(paper.weave)),
        )
        if all(same(own, theirs) for own, theirs in pairs):
            return name
    return None


def paper_study(study: Study) -> PaperStudy | None:
    """The study as one of the paper's cell; None where it is of another one or has no states."""
    if not study.records or parameter_set(study.design) is None:
        return None
    wanted = [_ends(plain_weave(), probe) for probe in plain_weave().probes]
    have = [_ends(study.design, probe) for probe in study.design.probes]
    probes = tuple(have.index(ends) for ends in wanted if ends in have)
    return PaperStudy(
        study=study,
        probes=probes if len(probes) == len(wanted) else (),
        stretch=_along(study, np.array([[1.0, 0.0], [0.0, 0.0]])),
        shear=_along(study, np.array([[0.0, 0.0], [1.0, 0.0]])),
    )


def _along(study: Study, direction: Floats) -> tuple[Record, ...]:
    """The records of the loading F = I + e `direction` with growing e that goes farthest; clamps on all sides."""
    found: tuple[Record, ...] = ()
    strips = {loading.name for loading in study.design.loading if loading.free}
    for name, records in by_loading(study).items():
        offsets = np.array([record.gradient - np.eye(2) for record in records])
        size = (offsets * direction).sum(axis=(1, 2))
        along = np.allclose(offsets, size[:, None, None] * direction, rtol=0.0, atol=1e-12)
        if along and name not in strips and len(records) > 1 and (np.diff(size) > 0.0).all() and size[0] == 0.0:
            found = max(found, records, key=lambda states: states[-1].strain if states else 0.0)
    return found


def _ends(design: Design, probe: Probe) -> tuple[object, ...]:
    ends = {terminal.name: frozenset(terminal.ends) for terminal in design.terminals}
    return ends[probe.source], ends[probe.sink]


def _nameless(weave: Weave) -> tuple[object, ...]:
    """What the weave is, without the names of its yarns and materials."""

    def plain(yarn: Yarn) -> Yarn:
        materials = tuple(replace(material, name="material") for material in yarn.materials)
        return replace(yarn, name="yarn", materials=materials)

    rest = [getattr(weave, each.name) for each in fields(weave) if each.name not in ("warp", "weft")]
    return tuple(map(plain, weave.warp)), tuple(map(plain, weave.weft)), *rest
