"""The circuits of a state are built once, and are those that their users would have built for themselves."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from small_design import SMALL
from synthetic import woven

from circuittex.base.frozen import same
from circuittex.contact.merge import Simplified
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal, parse_design
from circuittex.electrical.network import circuit
from circuittex.electrical.network.circuit import build_circuit, with_ports
from circuittex.study.circuits import conducting_ends, state_circuits
from circuittex.study.run import run_study

TERMINALS = tuple(
    Terminal(name, ends)
    for name, ends in (("c", (("warp1", 1), ("weft2", -1))), ("a", (("warp2", -1),)), ("b", (("weft1", 1),)))
)
PROBES = (Probe("first", "a", "c", 1.0), Probe("second", "c", "b", 2.0))


def insulating(state: ContactState, yarns: tuple[int, ...]) -> ContactState:
    """The same with yarns that carry nothing, and no current through their contacts."""
    mesh = state.mesh
    dead = np.isin(mesh.yarn, yarns)
    conductivity = np.where(dead, 0.0, mesh.electrical_conductivity)
    touched = dead[state.fibril_a] | dead[state.fibril_b]
    return replace(
        state,
        mesh=replace(mesh, electrical_conductivity=conductivity),
        conductance=np.where(touched, 0.0, state.conductance),
    )


@pytest.mark.parametrize("yarns", [(), (1,), (0, 2), (0, 1, 2, 3)])
def test_the_circuits_are_those_of_a_construction_each(yarns: tuple[int, ...]) -> None:
    """Bit for bit, names and order included; whatever insulates."""
    contacts = insulating(woven(yarns=2, per_yarn=2, points=4), yarns)
    built = state_circuits(Simplified(contacts, 0, 3, 0), TERMINALS, PROBES)
    assert same(built.conducting, build_circuit(contacts, conducting_ends(contacts.mesh), dropped_contacts=3))
    for probe in PROBES:
        pair = [t for name in (probe.source, probe.sink) for t in TERMINALS if t.name == name]
        assert same(built.of(probe), build_circuit(contacts, pair, dropped_contacts=3))
        turned = with_ports(built.of(probe), (probe.sink, probe.source))
        assert same(turned, build_circuit(contacts, pair[::-1], dropped_contacts=3))


def test_a_study_builds_each_circuit_of_a_state_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """All contacts and the simplified ones, each laid out once: on either the probes, on the latter the yarn ends."""
    undrawn(monkeypatch)
    built = {"_resistors_apart": 0, "_joined": 0}

    def counted(name: str) -> None:
        build = getattr(circuit, name)

        def count(*arguments: object) -> object:
            built[name] += 1
            return build(*arguments)

        monkeypatch.setattr(circuit, name, count)

    for name in built:
        counted(name)
    design = parse_design(tomllib.loads(SMALL))
    study = run_study(design, tmp_path, workers=1)
    states = len(study.records)
    assert built == {"_resistors_apart": 2 * states, "_joined": (2 * len(design.probes) + 1) * states}
    written = {path: path.read_bytes() for path in (tmp_path / "netlists").iterdir()}
    assert len(written) == states * (2 + len(design.probes))
    for path in written:
        path.unlink()
    run_study(design, tmp_path, workers=1)  # what is missing is built from what is stored, and no more than that
    assert built == {"_resistors_apart": 3 * states, "_joined": (3 * len(design.probes) + 2) * states}
    assert {path: path.read_bytes() for path in written} == written
