"""What in a recorded state strains belief: overlaps, stresses and temperatures, and the sentences that say so."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState
from circuittex.design import Design
from circuittex.design.statement import NONLINEAR
from circuittex.geometry.mesh import FibrilMesh
from circuittex.results.heating import driven_otherwise, fabric_area
from circuittex.results.records import Record, Study

HOT = 300.0
"""Rise of temperature, K, beyond which no textile stays what it is: polymers have melted or charred."""
SEEN = 1.4
"""Contact points across a contact: with fewer they see its middle or miss it by chance. Rc was 8 % off with 1.7 of
them, 55 % with 0.3 (copper of 25 um)."""
BALANCED = 1e-6
"""Relative: heat that leaves and heat that is released. Direct solutions keep some ten digits, refined."""
REACHED = 0.01
"""Relative difference of a probe's current or power from what is stated: currents near nothing have few digits."""
SPREADING = ("holm", "film")
"""Laws of conductance in which current spreads into a half space."""
STRONGEST = 1e4
"""MPa: no fibre, of carbon or any other matter, carries more."""
SOLID, ELASTOMER = 0.2, 100.0
"""Drawn nylon carries a sixth of its modulus, perfect crystals a tenth, no solid a fifth. Matter with a modulus of up
to `ELASTOMER` MPa is rubber, which is stretched until the stress is the modulus."""


def deepest_overlap(contacts: ContactState) -> tuple[float, int, int]:
    """Largest overlap over R + R' and its two fibrils, the lower number first; 0 where nothing touches.

    The law of contact is that of Hertz, for overlaps that are small beside the radii.
    """
    if contacts.n_contacts == 0:
        return 0.0, 0, 0
    a, b, radius = contacts.fibril_a, contacts.fibril_b, contacts.mesh.radius
    overlap = -contacts.gap / (radius[a] + radius[b])
    deepest = int(np.argmax(overlap))
    first, second = sorted((int(a[deepest]), int(b[deepest])))
    return float(overlap[deepest]), first, second


def strength(modulus: Floats) -> Floats:
    """The stress, MPa, that no material of that Young's modulus (MPa) carries: min(E, max(100, E / 5), 1e4).

    >>> strength(np.array([10.0, 3e3, 200e3])).tolist()
    [10.0, 600.0, 10000.0]
    """
    return np.minimum(np.minimum(modulus, np.maximum(ELASTOMER, SOLID * modulus)), STRONGEST)


def section_stress(record: Record) -> Floats:
    """(M,) mean stress of each element's section, MPa: its force over the reference area."""
    mesh = record.contacts.mesh
    return np.asarray(record.section_force / mesh.area[mesh.element_fibril])


def surface_stress(record: Record) -> Floats:
    """(M,) largest axial stress of each element, MPa: at its surface sigma = |N| / A + E R kappa; of a coated fibril
    the larger of that of its shell and that of its core (`layer_stress`)."""
    return np.asarray(layer_stress(record)[0].max(axis=0))


def layer_stress(record: Record) -> tuple[Floats, Floats]:
    """(n, M) each: largest axial stress of every layer of each element, MPa, and the modulus there, MPa.

    A layer of modulus E_i and outer radius R_i has sigma = E_i (|N| / (E A) + R_i kappa), since it is stretched as the
    section is; n is 1, and 2 where fibrils are coated: shell or bare fibril, and core. The curvature is that of the
    directors along the element, kappa_a = g_a' . t with the unit tangent t of the centre line [9], less that of the
    natural shape, kappa = sqrt(kappa_1^2 + kappa_2^2), per natural length; the element's mean.
    """
    mesh = record.contacts.mesh
    bends = _bends(mesh, record.configuration.x)
    if len(mesh.natural):
        bends = bends - _bends(mesh, mesh.natural)
    fibril, curvature = mesh.element_fibril, np.linalg.norm(bends, axis=1)
    mean, E, R = section_stress(record), *(each[:, fibril] for each in _layers(mesh))
    return E / mesh.youngs_modulus[fibril] * mean + E * R * curvature, E


def _layers(mesh: FibrilMesh) -> tuple[Floats, Floats]:
    """(n, F) each: Young's modulus, MPa, and outer radius, mm, of the layers of fibrils, the outermost first.

    The two moduli follow from what the mesh has of a coated section, with c the core's part of it: E = c E_c + (1 - c)
    E_s, and E (R_b / R)^2 = c^2 E_c + (1 - c^2) E_s of its bending radius R_b. A bare fibril is its own core.
    """
    E, R = mesh.youngs_modulus, mesh.radius
    if not len(mesh.bending_radius):
        return E[None], R[None]
    inside = R - mesh.shell_thickness
    c = (inside / R) ** 2
    coated = c < 1.0
    shell = np.where(coated, E * ((mesh.bending_radius / R) ** 2 - c) / np.where(coated, 1.0 - c, 1.0), E)
    core = np.where(coated, (E - (1.0 - c) * shell) / c, E)
    return np.stack([shell, core]), np.stack([R, inside])


def _bends(mesh: FibrilMesh, x: Floats) -> Floats:
    """(M, 2) mean curvatures kappa_1 and kappa_2 of each element, 1/mm, of nodal values x (N, 3, 3)."""
    first, last = mesh.elements[:, 0], mesh.elements[:, -1]
    slope = (x[last] - x[first]) / (mesh.xi[last] - mesh.xi[first])[:, None, None]
    tangent = slope[:, 0] / np.linalg.norm(slope[:, 0], axis=1)[:, None]
    return np.asarray(np.einsum("mac,mc->ma", slope[:, 1:], tangent))


def points_across(contacts: ContactState) -> float:
    """Contact points across the contacts of different yarns, where they touch over more of them than most; inf where
    none touch.

    Crossing cylinders of the mean radius R that overlap by o touch over 4 sqrt(R o) (docs/model.md).
    """
    mesh, a, b = contacts.mesh, contacts.fibril_a, contacts.fibril_b
    between = mesh.yarn[a] != mesh.yarn[b]
    if not between.any():
        return np.inf
    radius, overlap = (mesh.radius[a] + mesh.radius[b])[between] / 2, np.maximum(-contacts.gap[between], 0.0)
    return float(np.quantile(4 * np.sqrt(radius * overlap) / (2 * contacts.weight[between]), 0.9))


def widest_on_shell(study: Study, contacts: ContactState) -> float:
    """Largest half-width of a touch over the thickness of the shell that it meets; 0 where there is none.

    Of touches whose law knows shells on cores that insulate, on cores that conduct, though less than their shells: on
    them its conductance is a bound.
    """
    design, mesh = study.design, contacts.mesh
    if not len(mesh.core_conductivity):
        return 0.0
    core = mesh.core_conductivity
    thickness = np.where((core > 0.0) & (core < mesh.surface), mesh.shell_thickness, np.inf)
    names, a, b = mesh.material_names, contacts.fibril_a, contacts.fibril_b
    spreads = np.array([[design.contact.between(one, other).law in SPREADING for other in names] for one in names])
    rows = (contacts.conductance > 0.0) & spreads[mesh.material[a], mesh.material[b]]
    return float((contacts.width / np.minimum(thickness[a], thickness[b]))[rows].max(initial=0.0))


def _unreal(design: Design) -> str:
    """What else is not as in a room where fibrils get hot."""
    if design.electrical.heat_loss or design.electrical.emissivity:
        reason = "polymers have melted or charred"
    else:
        reason = "no heat is lost to the air (electrical.heat_loss)"
    return reason if design.electrical.heating == NONLINEAR else f"{reason}, and conductivities are constant"


def unbalanced(record: Record) -> float:
    """Largest part of the heat of a probe that does not leave, or leaves without having been released: rounding, unless
    next to nothing leaves the fibrils."""
    parts = [
        abs(field.heat_out + field.heat_lost - field.heat) / field.heat for field in record.fields if field.heat != 0.0
    ]
    return float(np.nan_to_num(np.max(parts, initial=0.0), nan=np.inf))


def _not_driven(study: Study, record: Record) -> list[str]:
    """The probes that do not carry the current, or take the power, that the design states."""
    idle = []
    for number in driven_otherwise(study.design):
        probe, field = study.design.probes[number], record.fields[number]
        current = float(field.currents[0])
        wanted = probe.current or 0.0
        if probe.power_density is not None:
            wanted = probe.power_density * fabric_area(study.mesh, record.configuration) / field.voltage
        if field.voltage == 1.0 and not abs(current - wanted) < REACHED * abs(wanted):
            idle.append(f"{probe.name} ({probe.drive})")
    return idle


@frozen
class Doubt:
    """One reason to doubt a state."""

    kind: str
    """'overlap', 'stress', 'temperature', 'balance', 'drive', 'mesh' or 'shell'."""
    excess: float
    """How far it is beyond what gives no reason, as a ratio of at least 1."""
    text: str
    """The reason, without the name of the state."""


def doubts(study: Study, record: Record) -> tuple[Doubt, ...]:
    """What cannot be right in a state, or not be trusted; empty if all is well."""
    mesh = record.contacts.mesh
    overlap, limit = deepest_overlap(record.contacts)[0], study.design.numerics.overlap_warning
    (stress, modulus), fibril = layer_stress(record), mesh.element_fibril
    carried = strength(modulus)
    worst = np.unravel_index(np.argmax(stress / carried), stress.shape)
    rise = record.peak_temperature
    found = [
        Doubt(
            "overlap",
            overlap / limit,
            f"fibrils overlap by {overlap:.2f} of R + R' (warned of from {limit:g} on, numerics.overlap_warning): "
            "the law of contact is for small overlaps",
        ),
        Doubt(
            "stress",
            float(stress[worst] / carried[worst]),
            f"the stress reaches {stress[worst]:.3g} MPa, bending included, in "
            f"{mesh.yarn_names[mesh.yarn[fibril[worst[1]]]]}: no material of that modulus carries more than "
            f"{carried[worst]:.3g} MPa",
        ),
        Doubt(
            "temperature",
            rise / HOT,
            f"the temperature rises by up to {rise:.3g} K (warned of from {HOT:g} K on): {_unreal(study.design)}, "
            "so that this is no prediction",
        ),
        Doubt(
            "balance",
            unbalanced(record) / BALANCED,
            f"{unbalanced(record):.1g} of a probe's heat does not leave: surfaces and ends take too little for the "
            "digits of temperatures; state a larger electrical.heat_loss",
        ),
        Doubt(
            "drive",
            float(len(idle := _not_driven(study, record))),
            f"no voltage that there can be drives as stated, so that 1 V is applied to: {', '.join(idle)}",
        ),
        Doubt(
            "mesh",
            SEEN / points_across(record.contacts),
            f"the mesh is too coarse for its fibrils: contacts of yarns are {points_across(record.contacts):.2g} "
            'contact points wide, so that Rc may be far off; elements and contact_points = "auto" follow the fibrils',
        ),
        Doubt(
            "shell",
            widest_on_shell(study, record.contacts),
            f"half-widths of touches are up to {widest_on_shell(study, record.contacts):.2g} times as large as their "
            'shell is thick, and its core conducts, too: the laws "holm" and "film" conduct less than the truth then',
        ),
    ]
    return tuple(doubt for doubt in found if doubt.excess >= 1.0)


def doubt_statement(study: Study) -> tuple[str, ...]:
    """A sentence for each kind of doubt that any state gives reason for, about the worst of them."""
    found = [(doubt, record.name) for record in study.records for doubt in doubts(study, record)]
    sentences = []
    for kind in dict.fromkeys(doubt.kind for doubt, _ in found):
        states = [name for doubt, name in found if doubt.kind == kind]
        worst, name = max((one for one in found if one[0].kind == kind), key=lambda one: one[0].excess)
        others = f" and, less, in {len(states) - 1} other state{'s' * (len(states) > 2)}" if len(states) > 1 else ""
        sentences.append(f"Do not trust {name}{others}: {worst.text}.")
    return tuple(sentences)
