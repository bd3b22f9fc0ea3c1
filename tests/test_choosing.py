"""The designs of docs/choosing.md, run as they stand there, beside closed forms."""

from __future__ import annotations

import re
import tomllib
from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn

from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.contact.extract import contacts_of
from circuittex.design import parse_design, starter
from circuittex.geometry.weave import build_mesh
from circuittex.relaxation.relax import relax
from circuittex.results.records import Study
from circuittex.results.soundness import deepest_overlap, doubts
from circuittex.results.store import load_study

PAGE = (Path(__file__).parents[1] / "docs" / "choosing.md").read_text(encoding="utf-8")
NYLON, STEEL, MIXED = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
AUTO = 'elements = "auto"\ncontact_points = "auto"'
COARSE = "elements = 16\ncontact_points = 4"
"""For the nylon at rest: Ry does not depend on the contacts, and the whole of it takes minutes, as the page says."""
SMALL_OVERLAP = 0.03
"""Force and conductance are of leading order in o / R, which is 0.013 here, and contact points miss the middle."""
ALONG = 1e-5
"""Contacts of a crossing carry less than this part of what flows along a yarn."""


def run(text: str, folder: Path, *doubted: str) -> Study:
    """The study of a design; `doubted` are the kinds of doubts that are right."""
    (folder / "weave.toml").write_text(text, encoding="utf-8")
    assert main(["run", str(folder / "weave.toml"), "--out", str(folder / "out"), "--quiet"]) == ExitCode.DONE
    study = load_study(folder / "out")
    assert {doubt.kind for record in study.records for doubt in doubts(study, record)} == {*doubted}
    return study


def test_nylon(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    undrawn(monkeypatch)
    assert NYLON.count(AUTO) == 1
    loading = NYLON[NYLON.index("[[loading]]") : NYLON.index("[terminals]")]
    study = run(NYLON.replace(AUTO, COARSE).replace(loading, ""), tmp_path, "mesh")
    Ry = 0.5 / (17 * 180.0 * pi * 0.014**2)
    assert f"{Ry:.4f} ohm" in PAGE
    (rest,) = study.records
    assert rest.fit.kind_resistance == pytest.approx([Ry, Ry], rel=1e-3)
    assert (np.isfinite(rest.fit.crossings) & (rest.fit.crossings > 100 * Ry)).all()


def test_steel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    undrawn(monkeypatch)
    study = run(STEEL, tmp_path)
    R, E, nu, sigma, k = 0.025, 200e3, 0.3, 1.4e3, 16e-3
    modulus = E / (2.0 * (1.0 - nu**2))
    Ry = 1.0 / (sigma * pi * R**2)
    assert f"{Ry:.4f} ohm" in PAGE
    for record in study.records:
        assert record.fit.kind_resistance == pytest.approx([Ry, Ry], rel=ALONG)
        contacts = record.contacts
        one = np.isin(contacts.fibril_a, (0, 2)) & np.isin(contacts.fibril_b, (0, 2))  # warp1 and weft1
        overlap = -contacts.gap[one].min()
        force = float(contacts.line_load[one] @ contacts.weight[one])
        assert force == pytest.approx(4 / 3 * modulus * sqrt(R) * overlap**1.5, rel=SMALL_OVERLAP)
        assert 1.0 / record.fit.crossings[0, 0] == pytest.approx(sqrt(pi) * 1.0 * R * overlap, rel=SMALL_OVERLAP)
        alone = 0.01**2 * sigma / (8 * k)  # a wire between cold ends is warmest in the middle
        assert 0.95 * alone < record.peak_temperature < alone, "the contacts take a little of the heat"


def test_mixed(tmp_path: Path) -> None:
    study = run(MIXED, tmp_path)
    copper, silver = (1.0 / (sigma * pi * 0.025**2) for sigma in (5.8e4, 180.0))
    assert f"{copper:.5f} ohm along copper and {silver:.3f} ohm" in PAGE
    for record in study.records:
        assert record.fit.kinds == ("copper weft", "silver weft")
        assert record.fit.kind_resistance == pytest.approx([copper, silver], rel=1e-9)
        assert np.isinf(record.fit.crossings).all()
        assert len(record.outcome.network) == 2, "no Rc where no two conductors cross"
        assert record.currents == pytest.approx([0.01 / (2 * copper), 0.01 / (2 * silver)], rel=1e-9)


def test_the_starter_relaxes_without_a_doubt() -> None:
    """Two by two of its yarns, without probes."""
    small = {"draft": [[0, 1], [1, 0]]}
    tables = tomllib.loads(starter())
    design = parse_design(
        {**tables, "weave": {**tables["weave"], **small}, "loading": [], "terminals": {}, "probes": []}
    )
    mesh = build_mesh(design)
    state = relax(mesh, design)
    overlap, *_ = deepest_overlap(contacts_of(design, mesh, state.configuration))
    assert overlap < 0.2, "0.16 in the whole cell, 0.22 at the end of its path; a warning comes from 0.3 on"
