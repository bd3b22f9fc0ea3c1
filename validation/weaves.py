"""Woven fabrics at rest: sheets, a heater, a screen's thickness."""

# ruff: noqa: E501 (sentences of the page)
from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
from comparison import Band, Comparison, Input, Point, Source

import circuittex as ct
from circuittex.base.arrays import Floats
from circuittex.electrical.fields import Fields
from circuittex.electrical.fields.cooling import outline
from circuittex.results.heating import heating

TOKARSKA = Source(
    "Gebremariam",
    "A. Gebremariam, M. Tokarska, N. Kadi, Materials 18 (2025) 2456, abstract: 'a 35 % increase in weft density (W19-W27) "
    "resulted in a 13-15 % reduction in resistance', by van der Pauw",
    "https://doi.org/10.3390/ma18112456",
)
SCREEN = Source(
    "Screen Web",
    "'Mesh matters' (2009): 'a 305-thread/in. fabric with 40-micron thread diameter might have a total thickness of 63 microns'",
    "http://screenweb.com/content/mesh-matters?page=0%2C3",
)
PAD = Source(
    "Arduino forum",
    "'I measured 8.8 ohm', 'operating current of the heating pad is 600 mA', at 5 V",
    "https://forum.arduino.cc/t/5v-heating-pad-8-8-connected-directly-to-5v-write-pin-only-getting-0-63v/572424",
)
FIFTY = Source(
    "Pimoroni forum",
    "'The Spec Sheet implies the pad heats to50degrees'",
    "https://forums.pimoroni.com/t/usb-heating-pad-control/9147",
)
THREAD = Source(
    "library",
    "the yarn silver_nylon_117_17x2 of this program, after DFRobot's wiki",
    "https://github.com/jimaobian/DFRobotWiki/wiki",
)


def silver(threads_per_cm: list[float], **changes: object) -> ct.Design:
    """Two by two silver-plated threads of three filaments as long as their path."""
    mapping = {
        "format": 1,
        "name": "silver",
        "yarns": {"thread": {"yarn": "silver_nylon_117_17x2", "filaments": 3, "crimp": "path"}},
        "weave": {
            "draft": [[0, 1], [1, 0]],
            "warp": "thread",
            "weft": "thread",
            "threads_per_cm": threads_per_cm,
            "amplitude": "auto",
        },
        "contact": {"law": "holm", "penalty": "hertz", "conductivity": 1.0, "heat_transfer": 1e-3},
        "terminals": {"a": ["warp1-"], "b": ["warp1+"]},
        "probes": [{"name": "along", "source": "a", "sink": "b", "voltage": "10 mV"}],
        "electrical": {"fit": "all-pairs"},
        **changes,
    }
    return ct.parse_design(mapping)


def segments(threads_per_cm: list[float]) -> tuple[float, float]:
    """Ry of warp and of weft, ohm, of the relaxed cell."""
    yarns = ct.run_study(silver(threads_per_cm)).records[0].fit.yarns
    return float(yarns[0]), float(yarns[-1])


def sheets() -> Comparison:
    before = sqrt(float.__mul__(*segments([20.0, 19.0])))
    after = [sqrt(float.__mul__(*segments([20.0, wefts]))) for wefts in (1.35 * 19.0, 27.0)]
    less = sorted(100 * (1 - each / before) for each in after)
    return Comparison(
        title="The sheet resistance of a fabric with more wefts",
        measured="Van der Pauw's resistance of plain fabrics that conduct both ways, before and after adding wefts.",
        sources=(TOKARSKA, THREAD),
        inputs=(
            Input("wefts per cm", "19, and 35 % more or 27", TOKARSKA),
            Input("warps per cm", "20", None, "the ratio does not depend on it"),
            Input("yarns", "three filaments of silver-plated nylon", THREAD),
        ),
        computed="Ry of warp and weft of relaxed cells with natural lengths as woven. With G = (yarns per mm) / (ohm per mm) both ways "
        "van der Pauw's resistance goes with 1 / sqrt(G_warp G_weft), whatever the contacts. The band is what '35 %' and 'W27' say.",
        unit="per cent less",
        points=(Point("resistance, %", Band(13.0, 15.0), Band(less[0], less[1])),),
        meaning="The crimp that more wefts give the warp is in it. No current crosses contacts in a weave of equal yarns.",
    )


def screen() -> Comparison:
    pitch, d = 25.4 / 305, 0.040
    polyester = ct.Material("polyester", 10e3, 0.4, 1.38e-3, 0.0, 2e-4)
    thread = ct.Yarn("thread", (1,), d / 2, d, d, (polyester,), crimp="path", heat_set=1.0)
    weave = ct.Weave(((0, 1), (1, 0)), (thread,) * 2, (thread,) * 2, pitch=pitch, amplitude=d / 2, path="peirce")
    design = ct.Design("screen", weave, ct.ContactLaw("hertz", 0.0, 0.0), numerics=ct.Numerics(elements=24))
    mesh = ct.build_mesh(design)
    z = ct.relax(mesh, design).configuration.r[:, 2]
    free = 1e3 * (float(z.max() - z.min()) + d)
    pulled = replace(
        design, weave=replace(weave, warp=(replace(thread, crimp=0.05),) * 2, weft=(replace(thread, crimp=0.05),) * 2)
    )
    z = ct.relax(ct.build_mesh(pulled), pulled).configuration.r[:, 2]
    tight = 1e3 * (float(z.max() - z.min()) + d)
    return Comparison(
        title="The thickness of a screen of monofilaments",
        measured="A printer's plain screen of polyester monofilaments, as it is sold.",
        sources=(SCREEN,),
        inputs=(
            Input("threads per inch, thickness of a thread", "305, 40 um", SCREEN),
            Input("modulus, Poisson ratio", "10 GPa, 0.4", None, "drawn polyester, handbooks"),
            Input(
                "natural shape",
                "set as woven; or 5 % longer than the span, pulled",
                None,
                "screens are set by heat; the tension is not stated",
            ),
        ),
        computed="Peirce's path, relaxed with Hertz's contacts: the highest point above the lowest and a diameter.",
        unit="micrometre",
        points=(Point("thickness", Band(63.0, 63.0), Band(min(free, tight), max(free, tight))),),
        meaning="Elastic threads keep their round sections. Those of screens are flattened where they cross, by a fifth of their thickness, "
        "in setting: it is plastic, which the model is not.",
    )


def along(fields: Fields) -> list[tuple[Floats, Floats]]:
    """Rise, K, and place, mm, of each fibril."""
    cuts = np.flatnonzero(np.diff(fields.fibril)) + 1
    return list(zip(np.split(fields.temperature, cuts), np.split(fields.xi, cuts), strict=True))


def heater() -> Comparison:
    """The rise of a fabric that hands over h for each face and kelvin: its yarns' outlines take as much in all."""
    face, pad = (8e-6, 12e-6), (0.057, 0.060)
    found = []
    for h in face:
        plain = silver([10.0, 10.0])
        outlines = (outline(plain.weave.warp[0]) + outline(plain.weave.weft[0])) / 1.0  # mm2 for each mm2 of fabric
        electrical = {"heat_loss": 2 * h / outlines, "thermal_ends": "insulated", "fit": "all-pairs"}
        ends = {"a": ["warp1-", "warp2-"], "b": ["warp1+", "warp2+"]}
        study = ct.run_study(silver([10.0, 10.0], electrical=electrical, terminals=ends))
        (heat,), fields = heating(study, study.records[0]), study.records[0].fields[0]
        mean = float(np.mean([np.trapezoid(rise, xi) / np.ptp(xi) for rise, xi in along(fields)]))
        found += [mean * density / heat.power_density for density in pad]
    return Comparison(
        title="A heater's temperature: a pad",
        measured="What users say of a pad of polyester and steel fibres, 5 x 10 cm, at 5 V. Two posts, perhaps of two pads: an order of size.",
        sources=(PAD, FIFTY, THREAD),
        inputs=(
            Input("power", "2.84 to 3.0 W", PAD),
            Input(
                "area", "50 cm2, so 0.057 to 0.060 W/cm2", None, "the product's name (SparkFun COM-11288), from memory"
            ),
            Input("temperature", "50 C in a room of 20 to 25 C", FIFTY),
            Input(
                "heat to the air", "8 to 12 W/(m2 K) from each face", None, "textbooks: half convection, half radiation"
            ),
            Input("yarns", "silver-plated nylon, 10 a cm both ways, the warp fed", THREAD),
        ),
        computed="The fields of a relaxed cell with insulated ends, whose yarns hand over along their outlines what two faces do; the mean "
        "rise of all yarns at the W/cm2 that the report has. The band is that of power and air.",
        unit="kelvin",
        points=(Point("rise", Band(25.0, 30.0), Band(min(found), max(found))),),
        meaning="The balance of heat is what is tested, and that one decides by h what comes of it.",
    )
