"""Holds the program against published measurements and writes docs/validation.md.

make validation        (or: python validation/write.py, minutes)
"""

# ruff: noqa: E501 (sentences of the page)
from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import carbon
import crossings
import pulls
import rods
import sensors
import weaves
import wires
from comparison import Comparison

PAGE = Path(__file__).parent.parent / "docs" / "validation.md"
HEAD = """# Validation

The program held against what others measured, `make validation` writes this page. Each comparison states its inputs and where they are from before
the result. None of them was fitted to what is compared: where a number is not stated it is assumed, with the reason, and what that leaves open is a band.
Measured and computed agree where their bands meet; where they do not, the factor says by how much, and the text why, as far as it is understood.
[Verification](verification.md) is about something else: whether the equations are solved.
"""
OPEN = """## What was looked for and not found

Papers that measure these are known, but not with all inputs where they could be read:

* the resistance, in ohm, of a crossing of two stainless-steel yarns, wires or filaments, or of two dry carbon filaments or tows, under a stated force. What stands in for it above: rods of steel,
  copper fibres on steel, carbon in resin, carbon fibres on plates. Leads: Vasile et al., AUTEX Research Journal 17 (2017) 170; Hertleer et al., AUTEX Research Journal 20 (2020) 133, whose contacts of steel yarns are
  varistors; balls of stainless steel under a low load, whose resistances are log-normal ('Electrical contact resistance of a thin oxide layer with a low mechanical load'); chains of steel beads
  (Falcon & Castaing, Am. J. Phys. 73 (2005) 302; Falcon, Castaing & Creyssels, Eur. Phys. J. B 38 (2004) 475: 'strongly non-hertzian'; Dorbolo et al., log-normal as well; Rosch at Wooster, power laws);
  Xue et al., Compos. Sci. Technol. (2024) 110587, yarns of carbon; Horie et al., Composites A (2024) 108232, layers of carbon cloth. The best of them is old: S. Bidwell, Proc. Royal Soc. 35 (1883) 1, who presses
  short rods of carbon by a small balance to find resistance against pressure, and of whom only the first page could be read. Read as abstracts, without the numbers: plates of fuel cells beside the two above, iron wires (Keller, 1969 and
  1971), a contact of carbon filaments (Xie et al., Compos. Sci. Technol. 59 (1999) 1189), carbon fabric under electrodes (a welding conductor of 5-harness satin, doi 10.1177/26349833241258783), strands of copper (Zeroukhi et al., Sensors 14 (2014)
  13925), filaments in theory only (Wu et al., Appl. Phys. Lett. (2012), doi 10.1063/1.4718019). The table of switchgear's K was looked for in Russian and in Chinese to read it again, and not found with its numbers;
* forces, point by point, against strain of a plain weave with yarn curves and geometry (Kawabata, Niwa & Kawai, J. Text. Inst. 64 (1973) 21; Buet-Gautier & Boisse, Exp. Mech. 41
  (2001) 260; King et al., Int. J. Solids Struct. 42 (2005) 3867), and the crimp interchange in biaxial tests. Peirce's geometry is what `tests/test_peirce.py` has in place of it. Makers of screens
  state threads, thicknesses and tensions but curves only as pictures; of wire cloth, strengths; a woven polyester geotextile has forces at 2, 5 and 11 % and a mass, but no weave
  (35.7, 73.9 and 160 kN/m at 326 g/m2: <https://dodom.com/en/products/woven-polyester-pet-geotextile>). Force against strain of knitted fabrics with all of their yarn's stiffnesses is in the
  repository sabetta/stitch-by-stitch: for when there are knits; so are the fabrics of Sperl et al. (2022). The repositories of TexGen and its scripts, of yarn-level cloth (realcrane) and of measured cloth (Berkeley's garment library)
  have geometry, or moduli, and as far as was seen no measured curve with its yarns; theses on aramid fabrics (Jearanaisilawong, 2004; Recchia, 2016) may have both and could be read only as abstracts;
* resistance against strain of woven sensors point by point (Knezic et al., Materials 14 (2021) 3390 has tables; Sensors 11 (2011) 1693 has webbings of Lycra and carbon-coated nylon; neither could be read beyond its abstract);
* yarns flattened by twist and force (Afrashteh et al., Indian J. Fibre Text. Res. 38 (2013) 126): twist is not in the model yet.
"""


def page(comparisons: Sequence[Comparison]) -> str:
    """All of it in Markdown."""
    points, hits = sum(len(each.points) for each in comparisons), sum(each.hits for each in comparisons)
    rows = [f"| [{each.title}](#{anchor(each.title)}) | {each.hits} of {len(each.points)} |" for each in comparisons]
    count = f"**{hits} of {points} numbers agree, {points - hits} are missed.**"
    table = "\n".join(["| | agree |", "|---|---|", *rows])
    return "\n".join([HEAD, count, "", table, "", *(each.text() for each in comparisons), OPEN])


def anchor(title: str) -> str:
    """The name of a heading in the page."""
    return "".join(c for c in title.lower().replace(" ", "-") if c.isalnum() or c == "-")


def main() -> None:
    found = [
        wires.compare(),
        weaves.heater(),
        *crossings.compare(),
        rods.steel(),
        rods.brush(),
        rods.steel_rods(),
        carbon.laminate(),
        carbon.pressed(),
        *rods.compare(),
        weaves.sheets(),
        sensors.stretched(),
        pulls.aramid(),
        pulls.airbag(),
        weaves.screen(),
    ]
    PAGE.write_text(page(found), encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
