"""The exported library in Python's own schematics: PySpice finds and simulates it, SKiDL reads and netlists it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from library_cases import CELLS, answer, direct, listed, pins_of, study

from circuittex.base.errors import CircuitError
from circuittex.study.library.cell import Cell, Pin
from circuittex.study.library.export import export_library
from circuittex.study.library.instance import instance

SECONDS = 100
NAMES = [f"fabric_{end}" for end in CELLS]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("library")
    with pytest.MonkeyPatch.context() as patch:
        undrawn(patch)
        export_library(study(3), folder, dialects=("ngspice",))
    return folder


def run(script: str, folder: Path, *words: str) -> dict[str, object]:
    """The last line that a script prints, which runs in a process and a folder of its own."""
    command = [sys.executable, "-c", script, *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


PYSPICE = """
import json, os, sys
from ctypes.util import find_library
os.environ.setdefault("NGSPICE_LIBRARY_PATH", find_library("ngspice"))
from PySpice.Spice.Library import SpiceLibrary
from PySpice.Spice.Netlist import Circuit
folder, name, *pins = sys.argv[1:]
found = SpiceLibrary(folder)
circuit = Circuit("piece")
circuit.include(found[name])
circuit.X("1", name, *(f"net_{pin}" for pin in pins))
circuit.V("drive", f"net_{pins[0]}", circuit.gnd, 1)
for k, pin in enumerate(pins):
    circuit.R(f"load{k}", f"net_{pin}", circuit.gnd, 10 * 1.37**k)
nodes = circuit.simulator().operating_point().nodes
print(json.dumps({"found": sorted(found.subcircuits), "volts": [float(nodes[f"net_{pin}"][0]) for pin in pins]}))
"""


@pytest.mark.parametrize("name", NAMES)
def test_pyspice_finds_and_simulates_a_sub_circuit(library: Path, tmp_path: Path, name: str) -> None:
    names = pins_of((library / "ngspice" / f"{name}.lib").read_text("ascii"))
    told = run(PYSPICE, tmp_path, str(library / "ngspice"), name, *names)
    assert told["found"] == sorted(cell["name"] for cell in listed(library, "ngspice"))
    np.testing.assert_allclose(told["volts"], direct(library, name), rtol=1e-6, atol=1e-9)


def cell(library: Path, name: str) -> Cell:
    (found,) = [dict(each) for each in listed(library, "ngspice") if each["name"] == name]
    pins = tuple(Pin(**pin) for pin in found.pop("pins"))
    return Cell(**{**found, "pins": pins, "parameters": tuple(map(tuple, found["parameters"]))})


@pytest.mark.parametrize("name", NAMES)
def test_an_instance_by_names_of_pins_is_the_sub_circuit(library: Path, name: str) -> None:
    """Nodes are given backwards: names decide, not the order."""
    names = pins_of((library / "ngspice" / f"{name}.lib").read_text("ascii"))
    line = instance(cell(library, name), "X1", {pin: f"net_{pin}" for pin in reversed(names)})
    np.testing.assert_allclose(answer(library, name, line), direct(library, name), rtol=1e-9, atol=1e-12)


def test_an_instance_with_a_strange_pin_or_parameter_is_refused(library: Path) -> None:
    with pytest.raises(CircuitError, match="fabric_ports has no pin 'warp9_plus': it has warp1_minus, "):
        instance(cell(library, "fabric_ports"), "X1", {"warp9_plus": "0"})
    with pytest.raises(CircuitError, match="fabric_ports has no parameter 'strain': it has none"):
        instance(cell(library, "fabric_ports"), "X1", {}, strain=0.1)


SKIDL = """
import json, sys
from skidl.pyspice import *
folder, *names = sys.argv[1:]
answers = {}
for name in names:
    reset()
    piece = Part(f"{folder}/{name}.lib", name)
    for pin in piece.pins:
        pin += Net(f"net_{pin.name}")
    answers[name] = str(generate_netlist())
print(json.dumps(answers))
"""


def test_skidl_reads_and_netlists_sub_circuits(library: Path, tmp_path: Path) -> None:
    told = run(SKIDL, tmp_path, str(library / "ngspice"), *NAMES)
    for name in NAMES:
        lines = told[name].splitlines()
        assert f".include {library}/ngspice/{name}.lib" in lines
        (line,) = [line for line in lines if line.startswith("X")]
        np.testing.assert_allclose(answer(library, name, line), direct(library, name), rtol=1e-9, atol=1e-12)
