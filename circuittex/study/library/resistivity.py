"""The same contacts with other resistivities: those of a temperature, or of the ends of a tolerance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from circuittex.contact.state import ContactState
from circuittex.design import ContactLaw, Design, Material, Yarn
from circuittex.design.coating import current_share, shell_share
from circuittex.design.contact import ContactProperties

Factor = Callable[[Material | ContactProperties], float]
"""What the resistivity of a material, or 1/sigma_c of a contact, is multiplied by."""


def as_stated(each: Material | ContactProperties) -> float:
    """The resistivity of the design."""
    return 1.0


def warmer(kelvin: float) -> Factor:
    """1 + tc1 dT + tc2 dT^2, dT from 27 C.

    >>> warmer(50.0)(Material("silver", 10.0, 0.0, 1.0, 10.0, 1.0, tc1=0.004, tc2=1e-6))
    1.2025
    """
    return lambda each: 1.0 + each.tc1 * kelvin + each.tc2 * kelvin**2


def at_end(sign: float) -> Factor:
    """1 + tolerance or 1 - tolerance."""
    return lambda each: 1.0 + sign * each.tolerance


def differs(design: Design, *names: str) -> bool:
    """Whether any material or contact of a design states one of these fields.

    >>> from circuittex.design import plain_weave
    >>> differs(plain_weave(), "tc1", "tc2")
    False
    """
    stated = [*_materials(design), design.contact, *design.contact.pairs]
    return any(getattr(each, name) != 0.0 for each in stated for name in names)


def scaled(design: Design, contacts: ContactState, factor: Factor) -> ContactState:
    """The contacts with the resistivity of each fibril and each contact times its factor."""
    if factor is as_stated:
        return contacts
    surfaces = [each for yarn in design.weave.yarns for each in yarn.surfaces]
    mesh = contacts.mesh
    along = np.array([each for yarn in design.weave.yarns for each in _of_fibrils(yarn, factor)])
    across = np.array(
        [
            factor(_between(design.contact, surfaces[a], surfaces[b]))
            for a, b in zip(contacts.fibril_a.tolist(), contacts.fibril_b.tolist(), strict=True)
        ]
    )
    return replace(
        contacts,
        mesh=replace(mesh, electrical_conductivity=mesh.electrical_conductivity / along),
        conductance=contacts.conductance / across,
    )


def _of_fibrils(yarn: Yarn, factor: Factor) -> list[float]:
    """The factor of each fibril of a yarn; of a coated one that of core and shell side by side, each with its own."""
    if yarn.shell is None or not yarn.coated:
        return [factor(each) for each in yarn.materials]
    share, shell = shell_share(yarn.radius, yarn.shell_thickness), yarn.shell
    in_shell = {core: current_share(core, shell, share) for core in dict.fromkeys(yarn.materials)}
    return [1.0 / ((1.0 - in_shell[core]) / factor(core) + in_shell[core] / factor(shell)) for core in yarn.materials]


def _between(law: ContactLaw, one: Material, other: Material) -> ContactProperties:
    return law.between(one.name, other.name)


def _materials(design: Design) -> list[Material]:
    """(F,) what the fibrils are along their axes, in the order of the mesh."""
    return [each for yarn in design.weave.yarns for each in yarn.fibrils]
