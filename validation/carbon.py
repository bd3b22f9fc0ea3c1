"""Carbon: tows that cross, and fibres that lie on a plate."""

# ruff: noqa: E501 (sentences of the page)
from __future__ import annotations

from itertools import product

import numpy as np
from comparison import Band, Comparison, Input, Point, Source
from rods import HANDBOOK, MATERIALS, resistance, steel_films

from circuittex.contact.conductance import Law, Touches, crossed, film, holm
from circuittex.contact.constriction import spot_of_strip
from circuittex.contact.law import effective_modulus, hertz_width

LAMINATE = Source(
    "laminate",
    "'Electrical conduction investigation of pre-stressed carbon/epoxy fabric laminates heated by ampere-level currents', Functional Composite Materials (2023), table 1: "
    "plain weave, through the thickness of 2 mm 10.5 to 14.8 S/m, and 18.5 to 23.0 S/m where the faces were painted with silver",
    "https://functionalcompositematerials.springeropen.com/articles/10.1186/s42252-023-00041-3/tables/1",
)
CHUNG = Source(
    "Wang & Chung",
    "S. Wang, D. D. L. Chung, Composite Interfaces 6 (1999) 497, abstract: between plies that cross 'the contact resistivity was found to decrease with increasing curing pressure', "
    "'the lower the contact resistivity, the greater was the extent of direct contact between fibers'",
)
STEEL_PLATE = Source(
    "steel plate",
    "'In Situ and Ex Situ Contact Resistance Measurements of Stainless Steel Bipolar Plates for PEM Fuel Cells', abstract: stainless steel on a gas diffusion layer at 205.79 N/cm2, "
    "about 40 mohm cm2 outside the cell and close to 50 in it",
    "https://discovery.researcher.life/article/in-situ-and-ex-situ-contact-resistance-measurements-of-stainless-steel-bipolar-plates-for-pem-fuel-cells/f3a0269c06e7306d9246fa738da228a5",
)
GRAPHITE_PLATE = Source(
    "graphite plate",
    "'Contact Resistance between Bipolar Plate and Gas Diffusion Layer in High Temperature Polymer Electrolyte Fuel Cells', abstract: graphite at 3 to 4 MPa and 120 to 180 C on carbon paper "
    "about 9 to 4 mohm cm2, on carbon cloth about 13 to 7, by a model that its authors found in good agreement with their experiments",
    "https://discovery.researcher.life/article/contact-resistance-between-bipolar-plate-and-gas-diffusion-layer-in-high-temperature-polymer-electrolyte-fuel-cells/3ec0d37a7e723c0b84de2abc55af8db5",
)
FILAMENT = 0.0035
"""Radius, mm."""
SPACING = (2.0, 2.0)
"""mm, of warp and weft tows."""
COVERED, ACROSS = (0.1, 1.0), (1.0, 3.5)
"""Part of the plate that fibres lie on, side by side; resistivity of a fibre across over along."""
ON_STEEL, ON_GRAPHITE = 2.0579, (3.0, 4.0)
"""MPa."""
MOHM_CM2 = 10.0
"""In an ohm mm2."""


def laminate() -> Comparison:
    crossing = SPACING[0] * SPACING[1]  # mm2
    measured = [thickness / (1e-3 * sigma * crossing) for thickness, sigma in ((0.20, 23.0), (0.25, 18.5))]
    touches = crossing / (2 * FILAMENT) ** 2
    found = [
        anisotropy * resistance("carbon", pressure * crossing / touches, FILAMENT) / touches
        for pressure, anisotropy in ((0.1, 3.5), (0.7, 1.0))
    ]
    return Comparison(
        title="Crossed tows of carbon in a laminate",
        measured="The conductivity of a laminate of plain carbon fabric and epoxy through its thickness, as the resistance of one crossing.",
        sources=(LAMINATE, CHUNG),
        inputs=(
            Input("conductivity with painted faces", "18.5 to 23.0 S/m", LAMINATE),
            Input(
                "thickness of a ply, spacing of the tows", "0.20 to 0.25 mm, 2 mm", None, "fabrics of 3,000 filaments"
            ),
            Input(
                "filaments",
                "7 um, side by side over all of the tow's width",
                None,
                "standard modulus; 3,000 in a flat tow",
            ),
            Input(
                "resistivity",
                "15 uohm m along them, to 3.5 times of it across",
                None,
                "handbooks; from memory of measurements of single fibres",
            ),
            Input("modulus across, Poisson ratio", "15 GPa, 0.3", None, "handbooks"),
            Input("pressure while the resin sets", "0.1 to 0.7 MPa", None, "vacuum bag to autoclave"),
        ),
        computed="The law `holm` where each filament of one layer touches each of the other, the pressure shared among the touches. The band is that of pressures and resistivities. "
        "The measured band is that of thicknesses and conductivities.",
        unit="ohm",
        points=(Point("one crossing", Band(min(measured), max(measured)), Band(min(found), max(found))),),
        meaning="Too little by more than a thousand: it is the least that dry, clean filaments could have, and resin is not in the law. Most filaments of neighbouring tows are kept apart by it: "
        "one touch in a thousand or in ten thousand may remain, which is why the pressure of the cure decides (Wang & Chung), and within a tow current has to get from filament to filament as well. Two tows of dry carbon under a stated force were not found; "
        "for a laminate state `power` with what was measured through the thickness.",
    )


def on_plate(plate: str, pressure: float, law: Law, covered: float, across: float = 1.0, coat: float = 1.0) -> float:
    """mohm cm2 of fibres that lie on a plate along all of their length under a pressure (MPa); coat is sigma_c, S/mm2."""
    one = np.ones(1)
    (rho, E, nu), (other_rho, other_E, other_nu) = MATERIALS["carbon"], MATERIALS[plate]
    modulus = effective_modulus(E * one, nu * one, other_E * one, other_nu * one)
    length = covered / (2 * FILAMENT) * one  # mm of fibre on a mm2
    half_width = hertz_width(pressure / length, FILAMENT * one, modulus)  # R* is R: the plate is flat
    touches = Touches(
        force=pressure * one,
        sine=0 * one,
        length=length,
        area=2 * half_width * length,
        spot=spot_of_strip(length, half_width, FILAMENT * one),
        radius_a=FILAMENT * one,
        radius_b=FILAMENT * one,
        modulus=modulus,
        bulk_a=one / (across * rho),
        bulk_b=one / other_rho,
        film=coat * one,
        reference_conductance=one,
        reference_force=one,
        exponent=one,
    )
    return MOHM_CM2 / float(law(touches)[0])


def pressed() -> Comparison:
    coats = [1 / each for each in steel_films()]
    steel, bare = [], []
    for covered, across in product(COVERED, ACROSS):
        steel += [on_plate("steel", ON_STEEL, film, covered, across, coat) for coat in coats]
        bare += [on_plate("graphite", pressure, holm, covered, across) for pressure in ON_GRAPHITE]
    points = (
        Point("carbon paper on graphite, 3 to 4 MPa", Band(4.0, 9.0), Band(min(bare), max(bare))),
        Point("carbon cloth on graphite, 3 to 4 MPa", Band(7.0, 13.0), Band(min(bare), max(bare))),
        Point("carbon on stainless steel, 2.06 MPa", Band(40.0, 50.0), Band(min(steel), max(steel))),
    )
    short = [1 / point.factor for point in points]
    fitted = [
        on_plate("steel", ON_STEEL, crossed, covered) / value for covered, value in product(COVERED, (40.0, 50.0))
    ]
    return Comparison(
        title="Carbon fibres pressed on graphite and on stainless steel",
        measured="The resistance of a plate's contact with paper or cloth of carbon fibres under a stated pressure, as in fuel cells: dry fibres that touch a plate, in place of two that cross.",
        sources=(STEEL_PLATE, GRAPHITE_PLATE, HANDBOOK),
        inputs=(
            Input("pressure on steel", "205.79 N/cm2", STEEL_PLATE),
            Input("pressure on graphite", "3 to 4 MPa", GRAPHITE_PLATE),
            Input(
                "film on steel",
                f"{min(coats):.0e} to {max(coats):.0e} S/mm2, what the crossed rods of steel above want",
                HANDBOOK,
            ),
            Input("steel plate", "without gold", None, "the abstract has both kinds and one pair of numbers"),
            Input(
                "fibres",
                "7 um, on a tenth to all of the plate, along all of their length",
                None,
                "the most they can touch",
            ),
            Input(
                "resistivity of fibres",
                "15 uohm m along them, to 3.5 times of it across",
                None,
                "handbooks; from memory of measurements of single fibres",
            ),
            Input("modulus of fibres across, Poisson ratio", "15 GPa, 0.3", None, "handbooks"),
            Input("graphite plate", "15 uohm m, 10 GPa, 0.2", None, "handbooks; half of the constriction or less"),
            Input("stainless steel plate", "0.74 uohm m, 193 GPa, 0.29", None, "316L, handbooks; it hardly resists"),
        ),
        computed="Hertz's strips of fibres that lie on the plate, the pressure shared among them: `holm` on graphite, `film` on steel. The band is that of the part covered, resistivities and films.",
        unit="milliohm cm2",
        points=points,
        meaning=f"Fibres that touched wherever they lie, as Hertz has it, would do {min(short):.0f} to {max(short):.0f} times better or more: as in the laminate above, but without its resin and at a stated pressure. "
        "Paper and cloth are wavy and rough, and touch at few places. "
        f"Who fits `crossed` to the plate alone finds {min(fitted):.0f} to {max(fitted):.0f} S/mm2, some thousandth of the film of the rods: that has in it how little touches. So neither Hertz's area nor a film "
        "from elsewhere gives the contact of a textile of carbon or steel in ohms: measure one, and state `power`.",
    )
