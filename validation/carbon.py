"""Tows of carbon that cross."""

# ruff: noqa: E501 (sentences of the page)
from __future__ import annotations

from comparison import Band, Comparison, Input, Point, Source
from rods import resistance

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
FILAMENT = 0.0035
"""Radius, mm."""
SPACING = (2.0, 2.0)
"""mm, of warp and weft tows."""


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
        "one touch in a thousand or in ten thousand may remain, which is why the pressure of the cure decides (Wang & Chung), and within a tow current has to get from filament to filament as well. Dry carbon under a stated force was not found; "
        "for a laminate state `power` with what was measured through the thickness.",
    )
