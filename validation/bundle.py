"""A yarn of many filaments as one fibril: what it takes to bend it is not what its thickness says."""

from __future__ import annotations

from math import pi

import circuittex as ct

ELEMENTS = 32
"""Of each fibril, from one end of the cell to the other."""


def bundle(
    name: str,
    thickness: float,
    section: float,
    modulus: float,
    filament: float,
    skin: float,
    conductance: float = 0.0,
) -> ct.Yarn:
    """One fibril as thick (mm) as a yarn, a core in a skin, that stretches and bends as the yarn's filaments.

    The filaments have a section (mm2), a modulus E (MPa) and a radius r (mm), and are free of one another: E A and
    E A r^2 / 4. The core is as thick as one of them, has what the skin lacks of E A, and all of the conductance (S mm).
    The skin (MPa) is what other yarns press on. It adds pi/4 E_skin (R^4 - r^4) to the bending stiffness, as friction
    among filaments does.
    """
    R, r = thickness / 2, filament
    axial = modulus * section - skin * pi * (R**2 - r**2)
    area = pi * r**2
    core = ct.Material(f"{name}-core", axial / area, 0.4, 1e-3, conductance / area, 1e-4)
    return ct.Yarn(
        name,
        (1,),
        R,
        thickness,
        thickness,
        (core,),
        ct.Material(f"{name}-skin", skin, 0.4, 1e-3, 0.0, 1e-4),
        R - r,
        crimp="path",
        heat_set=1.0,
    )


def plain(name: str, warp: ct.Yarn, weft: ct.Yarn, pitches: tuple[float, float], pull: ct.Loading) -> ct.Design:
    """Two by two yarns in plain weave at pitches (mm) of warp and weft, which wave by half of both radii; pulled."""
    height = (warp.radius + weft.radius) / 2
    weave = ct.Weave(((0, 1), (1, 0)), (warp,) * 2, (weft,) * 2, pitches[0], height, pitches[1])
    return ct.Design(name, weave, ct.ContactLaw("hertz", 0.0, 0.0), (pull,), numerics=ct.Numerics(elements=ELEMENTS))
