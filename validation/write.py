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
  copper fibres on steel, carbon in resin. Leads: Vasile et al., AUTEX Research Journal 17 (2017) 170; Hertleer et al., AUTEX Research Journal 20 (2020) 133, whose contacts of steel yarns are
  varistors; balls of stainless steel under a low load, whose resistances are log-normal ('Electrical contact resistance of a thin oxide layer with a low mechanical load'); chains of steel beads
  (Falcon & Castaing, Am. J. Phys. 73 (2005) 302; Dorbolo et al., log-normal as well); Xue et al., Compos. Sci. Technol. (2024) 110587, yarns of carbon; Horie et al., Composites A (2024) 108232, layers of
  carbon cloth;
* forces, point by point, against strain of a plain weave with yarn curves and geometry (Kawabata, Niwa & Kawai, J. Text. Inst. 64 (1973) 21; Buet-Gautier & Boisse, Exp. Mech. 41
  (2001) 260; King et al., Int. J. Solids Struct. 42 (2005) 3867), and the crimp interchange in biaxial tests. Peirce's geometry is what `tests/test_peirce.py` has in place of it. Makers of screens
  state threads, thicknesses and tensions but curves only as pictures; of wire cloth, strengths; a woven polyester geotextile has forces at 2, 5 and 11 % and a mass, but no weave
  (35.7, 73.9 and 160 kN/m at 326 g/m2: <https://dodom.com/en/products/woven-polyester-pet-geotextile>). Force against strain of knitted fabrics with all of their yarn's stiffnesses is in the
  repository sabetta/stitch-by-stitch: for when there are knits;
* resistance against strain of woven sensors point by point (Knezic et al., Materials 14 (2021) 3390 has tables);
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
