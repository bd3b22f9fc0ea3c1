"""Bare heating wires in air: the current that holds them at a temperature."""

# ruff: noqa: E501 (sentences of the page)
from __future__ import annotations

from math import sqrt

import numpy as np
from air import churchill_chu, morgan, radiation
from comparison import Band, Comparison, Input, Point, Source

import circuittex as ct
from circuittex.electrical.fields.cooling import cooling_of

PELICAN = Source(
    "Pelican",
    "Pelican Wire, data sheet of Alloy 650 (Nichrome 80), resistivity and 'Amperage vs. Temperature' of straight wires",
    "https://pelicanwire.com//alloy/alloy-650-2/",
)
CORRELATIONS = Source(
    "textbooks",
    "S. W. Churchill & H. H. S. Chu, Int. J. Heat Mass Transfer 18 (1975) 1049; V. T. Morgan, Advances in Heat Transfer 11 "
    "(1975) 199; properties of air: Incropera & DeWitt, table A.4 (from memory of these books, not read again)",
)
ROOM = 293.15
TABLE = {0.8128: (3.85, 5.80), 0.5105: (2.16, 3.40), 0.2540: (0.90, 1.40), 0.1270: (0.37, 0.59)}
"""Diameter, mm -> A at 200 and 400 C, AWG 20, 24, 30 and 36."""
CELSIUS = (200.0, 400.0)
TRUE = 0.03
"""Relative: the sheet has the same currents for Nichrome 60, whose resistivity is 3.7 % higher."""
EMISSIVITY = (0.65, 0.80)


def wire(diameter: float, celsius: float, loss: float) -> float:
    """Rise, K, of a wire (mm) of Nichrome 80 at 1 A that gives loss, W/(m2 K), to the air: fields of one fibril."""
    sigma = 1 / (1.08e-3 * (1 + 9e-5 * (celsius - 20)))  # S/mm
    nichrome = ct.Material("nichrome", 200e3, 0.3, 8.41e-3, sigma, 0.0113)
    thread = ct.Material("thread", 1e3, 0.3, 1e-3, 0.0, 1e-6)
    kinds = [
        ct.Yarn(name, (1,), r, 2 * r, 2 * r, (kind,))
        for name, r, kind in (("wire", diameter / 2, nichrome), ("thread", 0.01, thread))
    ]
    weave = ct.Weave(((1,),), (kinds[0],), (kinds[1],), pitch=50.0, amplitude=0.0, weft_pitch=10.0, weft_amplitude=1.0)
    design = ct.Design(
        "wire",
        weave,
        ct.ContactLaw("hertz", 0.0, 0.0),
        terminals=(ct.Terminal("a", (("warp1", -1),)), ct.Terminal("b", (("warp1", 1),))),
        probes=(ct.Probe("along", "a", "b", 1.0),),
        electrical=ct.Electrical(heat_loss=1e-6 * loss, thermal_ends="insulated"),
    )
    mesh = ct.build_mesh(design)
    contacts = ct.contacts_of(design, mesh, ct.initial_configuration(mesh))
    fields = ct.solve_fields(contacts, design.terminals, design.probes[0], cooling=cooling_of(design, mesh))
    return fields.peak_temperature / float(fields.currents[0]) ** 2


def current(diameter: float, celsius: float) -> Band:
    """A, with either correlation and emissivity."""
    hot, found = celsius + 273.15, []
    for convection in (churchill_chu, morgan):
        for emissivity in EMISSIVITY:
            loss = convection(1e-3 * diameter, hot, ROOM) + radiation(emissivity, hot, ROOM)
            found.append(sqrt((hot - ROOM) / wire(diameter, celsius, loss)))
    return Band(min(found), max(found))


def compare() -> Comparison:
    points = []
    for diameter, amperes in TABLE.items():
        for celsius, ampere in zip(CELSIUS, amperes, strict=True):
            measured = Band(ampere * (1 - TRUE), ampere * (1 + TRUE))
            points.append(Point(f"{diameter:.3f} mm at {celsius:.0f} C, A", measured, current(diameter, celsius)))
    worst = max(abs(np.log(point.computed.high / point.measured.low)) for point in points)
    return Comparison(
        title="A heater's temperature: bare wires in air",
        measured="The current that holds a straight bare wire of Nichrome 80 at 200 and at 400 C, by its maker.",
        sources=(PELICAN, CORRELATIONS),
        inputs=(
            Input("resistivity at 20 C", "1.08 uohm m, 9e-5 a kelvin", PELICAN),
            Input("diameters", "0.813, 0.511, 0.254, 0.127 mm", PELICAN),
            Input("heat to the air", "two correlations for horizontal cylinders", CORRELATIONS),
            Input("emissivity", "0.65 to 0.80", None, "oxidised nickel-chromium, handbooks"),
            Input("surroundings", "20 C", None, "the makers' custom"),
            Input("truth of the table", "3 %", None, "it has the same currents for an alloy that resists 3.7 % more"),
        ),
        computed="The fields of one fibril with `heat_loss` from the correlation at the wire's temperature and insulated ends. "
        "The band is that of the correlations and emissivities.",
        unit="ampere",
        points=points,
        meaning="What decides is h, 60 to 200 W/(m2 K) for a wire alone, not the 5 to 25 of a fabric's face, and it is the air's, not "
        f"the program's: all are within {100 * (np.exp(worst) - 1):.0f} %, and what misses loses more heat than in the quiet air of "
        "the correlations. A single thread in a design wants an h like these.",
    )
