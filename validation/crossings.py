"""One crossing of two silver-plated yarns, and how its resistance depends on the tension."""

# ruff: noqa: E501 (sentences of the page)
from __future__ import annotations

from math import log

from comparison import Band, Comparison, Input, Point, Source

import circuittex as ct

POSTER = Source(
    "Gunnarsson, poster",
    "E. Gunnarsson, L. Berglin, L. Guo, M. Karlsteen, 'Contact resistance measurements on multifilament silver yarn': 25 samples of "
    "Statex 235/34 dtex, 2-ply; 'the highest intensity was found to be at Rc = 0.14 ohm'",
    "https://5dok.org/document/zkw791o4-contact-resistance-measurements-on-multifilament-silver-yarn.html",
)
PAPER = Source(
    "Gunnarsson, paper",
    "The same, Textile Research Journal (2014), abstract: two by two silver-coated yarns, 'of the order of Rc = 0.3 ohm'",
    "https://doi.org/10.1177/0040517514532158",
)
DFROBOT = Source(
    "DFRobot",
    "wiki: 117/17 2-ply about 82 ohm per foot, 234/34 4-ply about 14 ohm per foot",
    "https://github.com/jimaobian/DFRobotWiki/wiki",
)
HOLM = Source(
    "Holm", "R. Holm, Electric Contacts (1967): clean spots 1/3 where elastic, 1/2 where plastic; many spots to 1"
)
CRIMPS = (0.01, 0.02, 0.025)
"""Natural length over the span, less 1: these yarns carry about 1, 0.2 and 0.02 N."""
PER_METRE = (92.0, 134.0)
"""ohm/m, half of the 4-ply's and half of the 117/17's."""

MEANING = (
    "What was measured most often is a little more than the most of this, and the paper's mean twice that. Nothing was fitted, and what is left out "
    "adds to it: tarnish, and plating that is thin or cracked where filaments rub. Current has to spread in the shells: by a half space of silver "
    "a touch of 1 um would resist by a tenth of that."
)
EXPONENT = (
    "The spot of each touch grows like F^(1/3), but its current spreads in a sheet, with the logarithm of it; what makes the crossing fall faster "
    "is that more filaments touch. Yarns that measure more than 1/2 have films, which no clean touch knows; `film` and `power` do."
)


def crossing(crimp: float, per_metre: float, filaments: int = 68) -> tuple[float, float]:
    """Tension of a yarn, N, and Rc, ohm, of one crossing."""
    yarn = {"yarn": "silver_nylon_234_34x4", "filaments": filaments, "core_linear_density": "470 dtex"}
    yarn |= {"resistance": f"{per_metre} ohm/m", "crimp": crimp}
    design = ct.parse_design(
        {
            "format": 1,
            "name": "crossing",
            "yarns": {"silver": yarn},
            "weave": {"draft": [[0]], "warp": "silver", "weft": "silver", "pitch": 1.0, "amplitude": "auto"},
            "contact": {"law": "holm", "penalty": "hertz", "conductivity": 1.0, "heat_transfer": 1e-3},
            "terminals": {"a": ["warp1-"], "b": ["weft1-"]},
            "probes": [{"name": "across", "source": "a", "sink": "b", "voltage": "10 mV"}],
            "electrical": {"fit": "all-pairs"},
        }
    )
    record = ct.run_study(design).records[0]
    return float(record.clamp_force[0, 0]), record.fit.Rc


def compare() -> tuple[Comparison, Comparison]:
    tension, found = zip(*(crossing(crimp, PER_METRE[0]) for crimp in CRIMPS), strict=True)
    scaled = [each * PER_METRE[1] / PER_METRE[0] for each in found]  # all of it is in the shells
    band = Band(min(found), max(scaled))
    exponent = log(max(found) / min(found)) / log(max(tension) / min(tension))
    inputs = (
        Input("filaments, nylon", "2 x 34 of 235 dtex, 13.9 um in radius", POSTER),
        Input("resistance", "92 to 134 ohm/m, between two other threads of the same maker", DFROBOT),
        Input(
            "thickness of the silver",
            "0.14 um",
            None,
            "1 % of the radius; only its sheet resistance counts, which the ohm per metre "
            "states. The poster's 7 um would be half the filament",
        ),
        Input("moduli", "3 GPa, 0.4", None, "nylon, handbooks"),
        Input(
            "tension of a yarn",
            f"{min(tension):.2f} to {max(tension):.2f} N",
            None,
            "not stated; from hand-laid to taut, by `crimp`",
        ),
        Input(
            "place of the clamps", "0.5 mm from the crossing", None, "about the spacing of such yarns in a plain weave"
        ),
    )
    return (
        Comparison(
            title="One crossing of two silver-plated yarns",
            measured="The resistance of a crossing, by four wires on cells of two by two yarns.",
            sources=(POSTER, PAPER, DFROBOT),
            inputs=inputs,
            computed="All 68 filaments, parallel, relaxed with Hertz's contacts; `holm`: clean touches whose current spreads in the shells. "
            "There is no sigma_c in it. The band is that of tensions and ohms per metre.",
            unit="ohm",
            points=(Point("Rc", Band(0.14, 0.30), band),),
            meaning=MEANING,
        ),
        Comparison(
            title="How a crossing depends on the force",
            measured="n in R ~ 1/F^n of contacts in general, and of textile yarns.",
            sources=(HOLM, POSTER),
            inputs=inputs[:1] + inputs[4:5],
            computed=f"The same crossing, from {min(tension):.2f} to {max(tension):.2f} N.",
            unit="exponent",
            points=(Point("n", Band(1 / 3, 1.0), Band(exponent, exponent)),),
            meaning=EXPONENT,
        ),
    )
