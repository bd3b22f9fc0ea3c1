"""How resistances follow temperatures: tc1 and tc2 of fibrils and contacts, and the contacts at given temperatures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState
from circuittex.design import Design, Material
from circuittex.design.coating import current_share, shell_share
from circuittex.design.contact import ContactProperties
from circuittex.electrical.fields.solution import Fields


@frozen
class Coefficients:
    """1 + tc1 T + tc2 T^2 multiplies resistances at a rise of T over 27 C, where they are as stated; of a coated fibril
    those of core and shell, each with its own, side by side."""

    fibril: Floats
    """(F, 2) tc1, 1/K, and tc2, 1/K2, of each fibril along its axis, of the core of a coated one."""
    contact: Floats
    """(C, 2) tc1, 1/K, and tc2, 1/K2, of each contact."""
    shell: Floats = field(default_factory=lambda: np.empty((0, 2)))
    """(F, 2) the same of the shells; empty where no fibril is coated."""
    in_shell: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) part of the current along a fibril that its shell carries at 27 C; empty where none is coated."""

    def resistivity(self, fibril: Ints, rise: Floats) -> tuple[Floats, Floats]:
        """What multiplies the resistivity of fibrils (n,) at rises (n, q), and how that changes with the rise, 1/K.

        f = 1 / ((1 - w) / f_core + w / f_shell), or the smaller of these two where that is not positive.
        """
        f, slope = _parabola(self.fibril[fibril], rise)
        if not len(self.in_shell):
            return f, slope
        shell, slope_of_shell = _parabola(self.shell[fibril], rise)
        w = self.in_shell[fibril][:, None]
        least = np.minimum(f, shell)
        usable = least > 0.0
        f, shell = np.where(usable, f, 1.0), np.where(usable, shell, 1.0)
        both = 1.0 / ((1.0 - w) / f + w / shell)
        change = both**2 * ((1.0 - w) * slope / f**2 + w * slope_of_shell / shell**2)
        return np.where(usable, both, least), change


def _parabola(coefficients: Floats, rise: Floats) -> tuple[Floats, Floats]:
    """1 + tc1 T + tc2 T^2 of coefficients (n, 2) at rises (n, q), and its slope."""
    tc1, tc2 = coefficients.T[:, :, None]
    return 1.0 + rise * (tc1 + tc2 * rise), tc1 + 2.0 * tc2 * rise


def coefficients_of(design: Design, contacts: ContactState) -> Coefficients:
    """The coefficients that a design states for the fibrils and contacts of a state.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> design = plain_weave(yarns=2, rows=(1,))
    >>> mesh, nobody, nothing = build_mesh(design), np.zeros(0, dtype=int), np.zeros(0)
    >>> untouched = ContactState(mesh, nobody, nobody, *[nothing] * 8, np.ones(len(mesh.elements)))
    >>> coefficients_of(design, untouched).fibril.tolist()
    [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
    """
    yarns = design.weave.yarns
    surfaces = [each.name for yarn in yarns for each in yarn.surfaces]
    pairs = zip(contacts.fibril_a.tolist(), contacts.fibril_b.tolist(), strict=True)
    between = [design.contact.between(surfaces[a], surfaces[b]) for a, b in pairs]
    fibrils = [(core, yarn) for yarn in yarns for core in yarn.materials]
    fibril, contact = _table([core for core, _ in fibrils]), _table(between)
    if not any(yarn.coated for yarn in yarns):
        return Coefficients(fibril, contact)
    # A bare fibril is its own shell, which carries nothing.
    shells = [yarn.shell if yarn.shell is not None and yarn.coated else core for core, yarn in fibrils]
    shares = [shell_share(yarn.radius, yarn.shell_thickness) if yarn.coated else 0.0 for _, yarn in fibrils]
    parts = zip(fibrils, shells, shares, strict=True)
    in_shell = [current_share(core, shell, share) if share else 0.0 for (core, _), shell, share in parts]
    return Coefficients(fibril, contact, _table(shells), np.array(in_shell))


def _table(stated: Sequence[Material | ContactProperties]) -> Floats:
    """(n, 2) tc1 and tc2 of each."""
    return np.array([(each.tc1, each.tc2) for each in stated], dtype=np.float64).reshape(-1, 2)


def at_temperatures(contacts: ContactState, field: Fields) -> ContactState:
    """The contacts and fibrils with the resistances that they have at the temperatures of `field`.

    Each element of a fibril resists as its mean resistivity says, so that fields, circuits and netlists of this state
    carry the currents of `field` at its voltage; where these follow no temperature the state is as it was.
    """
    if not len(field.resistivity):
        return contacts
    return replace(
        contacts,
        axial_factor=contacts.axial_factor / field.resistivity,
        conductance=contacts.conductance / field.contact_resistivity,
    )
