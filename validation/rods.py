"""Two solids that cross under a stated force."""

# ruff: noqa: E501 (sentences of the page)
from __future__ import annotations

from math import inf, log, sqrt

import numpy as np
from comparison import Band, Comparison, Input, Point, Source

from circuittex.contact.conductance import Law, Touches, crossed, holm
from circuittex.contact.constriction import spot_of_ellipse
from circuittex.contact.ellipse import hertz_ellipse
from circuittex.contact.law import effective_modulus

TRINGE = Source(
    "Tringe",
    "J. W. Tringe, W. D. Wilson, J. E. Houston, SPIE (2001), ADA437511: 'about 100 mOhm with a 100 uN force', gold on gold",
    "https://www.scribd.com/document/682207390/ADA437511-gold-relay-contact-study-mili-aero",
)
HANDBOOK = Source(
    "switchgear handbooks",
    "R = K / (0.102 F/N)^m microohm, clean point contacts: K = 60 for silver, 80 to 140 for copper, 7600 for steel, m = 1/2 (from memory, not read again)",
)
STEEL = 7600.0
"""K of the same table, microohm, for steel on steel."""
STEEL_FORCES, STEEL_RADII = (0.1, 1.0, 10.0), (0.75, 1.5)
"""N, mm, of the rods that are compared with it."""
BRUSH = Source(
    "fibre brush",
    "'Sliding electrical contact properties of highly oriented copper fiber brush', abstract: 'the static contact resistance decreases significantly from "
    "55 to 18 mOhm with the gradual increase of contact force from 1 to 8 N'",
    "https://discovery.researcher.life/article/sliding-electrical-contact-properties-of-highly-oriented-copper-fiber-brush/dcc0846f89ec37f6b5a80f3492bf3a23",
)
CRC = Source(
    "CRC",
    "CRC Handbook of Chemistry and Physics: resistivities at 20 C",
    "https://www.coursehero.com/file/6669542/15-12-86/",
)
BEADS = Source(
    "Creyssels",
    "M. Creyssels, C. Laroche, E. Falcon, B. Castaing, Eur. Phys. J. E 40 (2017), abstract: oxidised steel beads under a pressure P, "
    "'R ~ P^-alpha with an exponent alpha much larger than the ones expected either with elastic or plastic contact'",
    "http://lmfa.ec-lyon.fr/spip.php?article973&lang=en",
)
MATERIALS = {
    "silver": (1.587e-5, 83e3, 0.37),
    "copper": (1.678e-5, 128e3, 0.34),
    "gold": (2.2e-5, 78e3, 0.44),
    "steel": (7.4e-4, 193e3, 0.29),
    "mild steel": (1.0e-4, 206e3, 0.29),
    "carbon": (1.5e-2, 15e3, 0.3),
    "graphite": (1.5e-2, 10e3, 0.2),
}
"""ohm mm, MPa, nu."""


def resistance(metal: str, force: float, radius: float, law: Law = holm) -> float:
    """ohm, of two equal rods (mm) that cross at a right angle under a force (N)."""
    rho, E, nu = MATERIALS[metal]
    one = np.ones(1)
    modulus = effective_modulus(E * one, nu * one, E * one, nu * one)
    ellipse = hertz_ellipse(force * one, one, radius * one, radius * one, modulus)
    touches = Touches(
        force=force * one,
        sine=one,
        length=2 * ellipse.long,
        area=ellipse.area,
        spot=spot_of_ellipse(ellipse),
        radius_a=radius * one,
        radius_b=radius * one,
        modulus=modulus,
        bulk_a=one / rho,
        bulk_b=one / rho,
        film=one,
        reference_conductance=one,
        reference_force=one,
        exponent=one,
    )
    return float(1 / law(touches)[0])


def steel() -> Comparison:
    found = {}
    for name, law in (("bare spots (`holm`)", holm), ("a film on the whole touch (`crossed`)", crossed)):
        light, heavy = (resistance("steel", force, 0.006, law) for force in (1e-5, 1e-3))
        found[name] = log(light / heavy) / log(100.0)
    return Comparison(
        title="Steel on steel: the exponent of the force",
        measured="The resistance of contacts of slightly oxidised steel against the force on them.",
        sources=(BEADS,),
        inputs=(
            Input("exponent", "above 1/2, 'much larger' than 1/3 and 1/2", BEADS),
            Input(
                "filaments",
                "12 um of stainless steel, crossing under 0.01 to 1 mN",
                None,
                "no measurement of such a crossing was found",
            ),
            Input(
                "modulus, Poisson ratio, resistivity",
                "193 GPa, 0.29, 0.74 uohm m",
                None,
                "316L, handbooks; none of them enters the exponent",
            ),
        ),
        computed="Two laws on Hertz's ellipse, over a hundredfold of the force.",
        unit="exponent",
        points=tuple(Point(name, Band(0.5, inf), Band(value, value)) for name, value in found.items()),
        meaning="Steel conducts through its oxide, as the second law has it, and the exponent of a film that does not break is 2/3. Where it breaks "
        "under the force no law here follows but `power`, with what was measured. Resistances of single steel touches scatter by orders: state them "
        "as a tolerance.",
    )


def brush() -> Comparison:
    heavy, rows = 8.0, []
    for name, law in (("bare spots (`holm`)", holm), ("a film on the whole touch (`crossed`)", crossed)):
        found = log(resistance("copper", 1e-3, 0.02, law) / resistance("copper", heavy * 1e-3, 0.02, law)) / log(heavy)
        rows.append(Point(name, Band(log(54.5 / 18.5) / log(heavy), log(55.5 / 17.5) / log(heavy)), Band(found, found)))
    return Comparison(
        title="Copper fibres on steel: the exponent of the force",
        measured="The resistance of a brush of many parallel copper fibres that stands on a steel disc, from 1 to 8 N.",
        sources=(BRUSH,),
        inputs=(
            Input("resistance", "55 and 18 mohm, to the last digit", BRUSH),
            Input(
                "touches",
                "as many at 8 N as at 1 N",
                None,
                "as far as all fibres stand on the disc; nothing else enters the exponent",
            ),
        ),
        computed="Two laws on Hertz's ellipse, over eightfold the force.",
        unit="exponent",
        points=rows,
        meaning="It is between the two, and where Holm has touches that yield or become more. A fabric's crossing gains touches as well, and the program counts them, "
        "fibril by fibril; here there is nothing to count them by.",
    )


def steel_films() -> tuple[float, float]:
    """Least and most ohm mm2 of a film on Hertz's area that makes up for what bare rods of steel lack of the handbooks'."""
    films = []
    for force in STEEL_FORCES:
        measured = STEEL * 1e-6 / sqrt(0.102 * force)
        for radius in STEEL_RADII:
            bare, area = (
                resistance("mild steel", force, radius),
                1 / resistance("mild steel", force, radius, crossed),  # film = 1: S of 1 S/mm2
            )
            films.append((measured - 1.5 * bare) * area)
    return min(films), max(films)


def steel_rods() -> Comparison:
    points = []
    for force in STEEL_FORCES:
        measured = STEEL * 1e-6 / sqrt(0.102 * force)
        least = [resistance("mild steel", force, radius) for radius in STEEL_RADII]
        points.append(
            Point(f"steel, {force:g} N", Band(1e3 * measured, 1e3 * measured), Band(1e3 * min(least), 2e3 * max(least)))
        )
    low, high = (1e-6 * each for each in steel_films())
    return Comparison(
        title="Crossed rods of steel",
        measured="What switchgear is designed by, for point contacts of steel on steel: a stand-in for a crossing of steel filaments, of which no measurement was found.",
        sources=(HANDBOOK,),
        inputs=(
            Input("resistivity", "0.1 to 0.2 uohm m", None, "carbon steels, handbooks"),
            Input("modulus, Poisson ratio", "206 GPa, 0.29", None, "handbooks"),
            Input("radius of the rods", "0.75 to 1.5 mm", None, "as such tests are done; it enters by its cube root"),
        ),
        computed="The law `holm` on Hertz's ellipse. The band is that of radii and resistivities.",
        unit="milliohm",
        points=points,
        meaning="Clean steel would be better by three to fifteen times. What is left over is a film, and about the same one at all forces: "
        f"{low:.1e} to {high:.1e} ohm m2 on Hertz's area would make up for it, over a hundredfold of force and both radii. So a contact of steel wants the law "
        f"`crossed` with a conductivity of {1e-6 / high:.0e} to {1e-6 / low:.0e} S/mm2 where it is as clean as switchgear is kept; passive stainless steel has more.",
    )


def compare() -> tuple[Comparison, Comparison]:
    forces, elastic = (0.1, 1.0, 10.0), []
    for metal, low, high in (("silver", 60.0, 60.0), ("copper", 80.0, 140.0)):
        for force in forces:
            over = 1e-6 / sqrt(0.102 * force)
            found = [1e6 * resistance(metal, force, radius) for radius in (0.75, 1.5)]
            point = Point(
                f"{metal}, {force:g} N", Band(1e6 * low * over, 1e6 * high * over), Band(min(found), max(found))
            )
            elastic.append(point)
    spot, metal = [1e3 * resistance("gold", 1e-4, radius) for radius in (0.004, 0.008)], "gold"
    inputs = (
        Input("resistivities", "15.87 and 16.78 nohm m", CRC),
        Input("moduli and Poisson ratios", "83 GPa, 0.37 (silver); 128 GPa, 0.34 (copper)", None, "handbooks"),
        Input("radius of the rods", "0.75 to 1.5 mm", None, "as such tests are done; it enters by its cube root"),
    )
    return (
        Comparison(
            title="Crossed rods of silver and of copper",
            measured="What switchgear is designed by, for clean point contacts of one metal.",
            sources=(HANDBOOK, CRC),
            inputs=inputs,
            computed="The law `holm` on Hertz's ellipse. The band is that of the radii.",
            unit="microohm",
            points=elastic,
            meaning="Metals yield: above some tenths of a newton the elastic pressure is beyond their hardness, the spot grows like "
            "F^(1/2) in place of F^(1/3), and the law resists too much, at 10 N by half or more. Fibrils are pressed by millinewtons, "
            "but they are as much thinner: a touch yields where F > (pi H)^3 R^2 / (6 E*^2) or so. "
            '`law = "power"` with an exponent of 1/2 is for those that do.',
        ),
        Comparison(
            title="Gold at the force of a fibril's touch",
            measured="A microrelay's gold contact at 0.1 mN, without films after cleaning.",
            sources=(TRINGE,),
            inputs=(
                Input("force", "0.1 mN", TRINGE),
                Input("resistivity", "22 nohm m", None, "bulk gold, handbooks; plated gold a little more"),
                Input("modulus, Poisson ratio", "78 GPa, 0.44", None, "handbooks"),
                Input("radius", "4 to 8 um", None, "of such relays' bumps; it enters by its cube root"),
                Input("'about'", "80 to 120 mohm", None, "one digit is stated"),
            ),
            computed="The law `holm` of two such cylinders that cross. The band is that of the radii.",
            unit="milliohm",
            points=(Point(f"{metal}, 0.1 mN", Band(80.0, 120.0), Band(min(spot), max(spot))),),
            meaning="The spot is 0.2 um wide, a few free paths of the electrons (38 nm): that adds some 15 % to Holm's resistance, "
            "which the law has not, and roughness more. A third to a half is missing, as clean and smooth spots would have it.",
        ),
    )
