"""Every law of contact conductance in fields, circuits and ngspice, and the Rc of a crossing, by Kelvin's way."""

from __future__ import annotations

import pytest
from fabrics import tangle
from pressed import SIGMA, SPOT, STAR, per_touch, pressed

from circuittex.contact.extract import contact_state
from circuittex.contact.state import ContactState
from circuittex.design import ContactLaw, Probe, Terminal
from circuittex.design.contact_laws import PROVIDED
from circuittex.electrical.fields.solution import solve_potentials
from circuittex.electrical.network.circuit import build_circuit, yarn_end_terminals
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.network.ports import port_matrix, resistances
from circuittex.electrical.spice.ngspice import run_decks
from circuittex.mech.configuration import initial_configuration
from circuittex.netlist import deck

ROUTES = 1e-9
"""Between a field on a mesh refined at the feet and the circuit, which are the same thing: what solving them costs."""
SPICE = 1e-7
"""Of ngspice: contacts and segments differ by orders of magnitude, and it knows no more than double precision."""
ENDS = (Terminal("in", (("warp1", -1),)), Terminal("out", (("warp2", 1), ("warp3", 1))))
PROBE = Probe("probe", "in", "out", 1.0)


def entangled(law: str) -> ContactState:
    """Four fibrils that cross and touch one another at all angles."""
    mesh = tangle(3, fibrils=4, elements=12, radius=0.25)
    constants = {"reference_conductance": 0.2, "reference_force": 1e-3, "exponent": 0.5}
    contact = ContactLaw(5.0, 0.3, 0.1, law=law, **constants)  # type: ignore[arg-type]
    return contact_state(mesh, initial_configuration(mesh), contact, per_element=4)


def test_fields_circuit_and_ngspice_agree_by_every_law() -> None:
    circuits = [build_circuit(entangled(law), ENDS) for law in PROVIDED]
    answers = run_decks([deck(circuit, {"in": 1.0, "out": 0.0}) for circuit in circuits])
    currents = []
    for law, circuit, answer in zip(PROVIDED, circuits, answers, strict=True):
        native = solve_nodal(circuit, {"in": 1.0, "out": 0.0}).port_current
        (fields,) = solve_potentials(entangled(law), ENDS, [PROBE])
        assert fields.currents == pytest.approx(native, rel=ROUTES)
        assert abs(answer.plots[0].current("vin")[0]) == pytest.approx(native[0], rel=SPICE)
        currents.append(native[0])
    assert len({round(current, 9) for current in currents}) == len(PROVIDED)  # six laws, six answers


def kelvin(state: ContactState) -> float:
    """Voltage between the free ends of two crossing fibrils for a current of 1 A between their other ends, ohm."""
    circuit = build_circuit(state, yarn_end_terminals(state.mesh))
    between = resistances(port_matrix(circuit, ("warp1_minus", "warp2_plus", "warp1_plus", "warp2_minus")))
    return float(between[0, 3] + between[1, 2] - between[0, 2] - between[1, 3]) / 2


@pytest.mark.parametrize("law", ["crossed", "holm"])
def test_the_resistance_of_a_crossing_does_not_depend_on_the_penalty(law: str) -> None:
    """P* from 1/4 to 16 times Hertz's: below 2 %. What is left: points of a touch lie apart on the fibrils."""
    ohm = [kelvin(pressed(law, penalty=factor * STAR / 2, points=400)) for factor in (0.25, 1.0, 16.0)]
    assert ohm == pytest.approx([ohm[1]] * 3, rel=0.02)
    if law == "holm":
        assert ohm == pytest.approx([1 / (2 * SIGMA * SPOT)] * 3, rel=0.02)


@pytest.mark.parametrize("law", ["crossed", "holm"])
def test_nor_on_the_number_of_contact_points(law: str) -> None:
    """From 4 to 64 across the touch: below 0.5 %."""
    ohm = [kelvin(pressed(law, **per_touch(n, STAR / 2))) for n in (4, 8, 64)]
    assert ohm == pytest.approx([ohm[-1]] * 3, rel=0.005)
