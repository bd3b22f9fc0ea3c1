"""Force against strain of plain weaves whose yarns are told."""

# ruff: noqa: E501 (sentences of the page)
from __future__ import annotations

from itertools import product
from math import pi, sqrt

import numpy as np
from bundle import bundle, plain
from comparison import Band, Comparison, Input, Point, Source

import circuittex as ct
from circuittex.base.arrays import Floats

ARAMID = Source(
    "ICF13",
    "13th International Conference on Fracture (2013), fabric of Kevlar 49 under uniaxial tension: 'the maximum strain in crimp region in warp and fill "
    "directions is only 0.0065 mm/mm and 0.0025 mm/mm', 'fully straightened (0.01 to 0.02)', Young's modulus 120 GPa with a standard deviation of 14",
    "http://icfweb.org/Proceedings/ICF13B/386",
)
ZHU = Source(
    "Zhu",
    "D. Zhu, B. Mobasher, A. Vaidya, S. D. Rajan, Compos. Sci. Technol. 74 (2013) 121, the same fabric: plain, 17 x 17 yarns an inch, 0.28 mm thick, "
    "0.115 mm2 of fibres in a yarn (from memory, not read again)",
    "https://bvbvf1.bib-bvb.de/vufind/PrimoRecord/cdi_proquest_miscellaneous_1349472827",
)
AIRBAG = Source(
    "US 8962499",
    "'Base fabric for airbag' (2015), claim 1: nylon 6.6 of '200 to 550 dtex and a single filament fineness of 2.0 to 7.0 dtex', 'the elongation is, on average "
    "of warp and weft, from 5 to 15% and from 15 to 30% under loads of 50 N/cm and 300 N/cm'; claim 3: a cover factor 'from 2,'... (cut off where it was read)",
    "http://patentcut.com/8962499",
)
TORAY = Source(
    "US 10543803",
    "'Airbag base fabric': sections of the yarns 4.0 to 6.0 (warp) and 2.4 to 4.0 (weft) times as wide as thick",
    "https://patents.justia.com/patent/10543803",
)
NYLON = 1.14e-3
"""g/mm3."""


def pulled(design: ct.Design, along: int) -> tuple[Floats, Floats]:
    """Strains, and the force on a yarn, N, of a cell of two by two that is pulled along x (0) or y (1)."""
    records = ct.run_study(design).records
    return np.array([r.strain for r in records]), np.array([r.clamp_force[along, along] / 2 for r in records])


def strain_at(force: float, strains: Floats, forces: Floats) -> float:
    """The strain of a curve at a force."""
    if force > forces[-1]:
        raise ValueError(f"pulled to {forces[-1]:.3g} N only, and {force:.3g} N is wanted")
    return float(np.interp(force, forces, strains))


def aramid() -> Comparison:
    pitch, thickness = 25.4 / 17, 0.28 / 2
    yarn = bundle("yarn", thickness, 0.115, 120e3, 0.006, 1e3)
    pull = ct.uniaxial("pull", ct.equal_steps(0.015, 15), "x", "y")
    strain, force = pulled(plain("aramid", yarn, yarn, (pitch, pitch), pull), 0)
    slope = (force[-1] - force[-3]) / (strain[-1] - strain[-3])
    offset = 100 * (strain[-1] - force[-1] / slope)
    part = np.gradient(force, strain) / slope
    half, straight = (
        100 * float(np.interp(share, part[part.argmin() :], strain[part.argmin() :])) for share in (0.5, 0.9)
    )
    return Comparison(
        title="Force against strain of a plain weave",
        measured="Aramid fabric under uniaxial tension, wefts free: where the crimp is pulled out and where the yarns are straight.",
        sources=(ARAMID, ZHU),
        inputs=(
            Input("yarns an inch, thickness, section of a yarn", "17, 0.28 mm, 0.115 mm2", ZHU),
            Input("modulus", "120 GPa", ARAMID),
            Input(
                "yarns",
                "a core in a skin, 0.14 mm thick, that stretches and bends as free filaments of 12 um",
                None,
                "handbooks; the skin, 1 GPa, adds 15 % to the bending stiffness",
            ),
            Input("natural shape", "as woven", None, "filaments so thin are bent by hardly any force"),
        ),
        computed="A cell of 2 x 2 yarns with free weft ends, pulled to 1.5 %. The crimp ends between the strain where the tangent is half "
        "of the last one and the one from which the last tangent starts; 'straight' is where the tangent is 0.9 of the last.",
        unit="per cent",
        points=(
            Point(
                "strain where the crimp ends, weft and warp",
                Band(0.25, 0.65),
                Band(min(offset, half), max(offset, half)),
            ),
            Point("strain where the yarns are straight", Band(1.0, 2.0), Band(straight, straight)),
        ),
        meaning="Peirce's crimp for waves of half the thickness is (3/4 x 0.14 mm / pitch)^2, 0.5 %, and filaments as thin as these resist hardly before. Then all "
        "yarns of the cell are straight at once. In a strip they are not as long as one another, and the clamps' slack adds: "
        "its knee is round, as far as twice that strain. Fibrils as thick as the yarn, which bend a hundred times stiffer, have a round knee too, for no good reason.",
    )


def airbag() -> Comparison:
    spun, E = 470.0, 4e3  # the cell that is computed; strains of others are those at the same force / (E A)
    section = spun * 1e-7 / NYLON
    filament = sqrt(6.5e-7 / NYLON / pi)
    found: dict[float, list[float]] = {50.0: [], 300.0: []}
    for cover, ratios in product((2000.0, 2250.0), ((4.0, 2.4), (6.0, 4.0))):
        pitch, curves = 25.4 * 2 * sqrt(0.9 * spun) / cover, []
        thick = [2 * sqrt(section / (ratio * pi)) for ratio in ratios]
        warp, weft = (
            bundle(name, each, section, E, filament, 1e3) for name, each in zip(("warp", "weft"), thick, strict=True)
        )
        for along, axis in enumerate("xy"):
            pull = ct.uniaxial("pull", ct.equal_steps(0.32, 16), axis, "yx"[along])
            curves.append(pulled(plain("airbag", warp, weft, (pitch, pitch), pull), along))
        for (load, strains), fineness, modulus in product(found.items(), (200.0, 550.0), (3e3, 5.5e3)):
            # at one cover factor all lengths go with sqrt(dtex)
            scaled = load / 10 * pitch * sqrt(spun / fineness) * E / modulus
            both = [strain_at(scaled, *curve) for curve in curves]
            strains.append(100 * sum(both) / 2)
    return Comparison(
        title="Force against strain of airbag fabrics",
        measured="Elongation of a strip of plain nylon fabric at two forces, the mean of warp and weft; the range that a maker claims.",
        sources=(AIRBAG, TORAY),
        inputs=(
            Input("fineness of yarns and filaments", "200 to 550 dtex; 6.5 dtex", AIRBAG),
            Input(
                "cover factor, sqrt(0.9 dtex) x (warps + wefts an inch)",
                "2,000 to 2,250",
                None,
                "claimed from 2,000 on; 49 to 55 yarns of 470 dtex an inch, as are sold",
            ),
            Input(
                "sections", "4 to 6 (warp) and 2.4 to 4 times (weft) as wide as thick, of filaments without gaps", TORAY
            ),
            Input("modulus", "3 to 5.5 GPa", None, "nylon 6.6 of high tenacity, handbooks"),
            Input("natural shape", "as woven", None, "such fabrics are scoured and set"),
        ),
        computed="Yarns as cores in skins that stretch and bend as free filaments (the skin, 1 GPa, adds as much again or twice as much), 2 x 2 of them, pulled along "
        "warp and along weft with the others free. The band is that of cover, sections, fineness and modulus.",
        unit="per cent",
        points=(
            Point("strain at 50 N/cm", Band(5.0, 15.0), Band(min(found[50.0]), max(found[50.0]))),
            Point("strain at 300 N/cm", Band(15.0, 30.0), Band(min(found[300.0]), max(found[300.0]))),
        ),
        meaning="At the first force most of it is crimp, at the second the nylon's stretch. Claims are wide, and so is the band: what is tested is that "
        "crimp from the geometry and stretch from the modulus add up.",
    )
