"""What the user states: a frozen, validated `Design`, from TOML, from a mapping, or from Python."""

from circuittex.design.clamps import Clamps
from circuittex.design.contact import HERTZ, ContactLaw, MaterialPair
from circuittex.design.experiment import (
    Gradient,
    Loading,
    biaxial,
    equal_steps,
    load_unload,
    shear,
    uniaxial,
)
from circuittex.design.files import load_design, parse_design, starter
from circuittex.design.grid import strain_grid
from circuittex.design.known_yarns import yarn_library
from circuittex.design.packing import Packing
from circuittex.design.paper import plain_weave
from circuittex.design.probe import Probe, Terminal
from circuittex.design.statement import Design, Electrical, Numerics, design_hash
from circuittex.design.touching import touching_amplitude
from circuittex.design.trade import (
    coated_radius,
    fibril_conductivity,
    fibril_radius,
    hexagonal_rows,
    shell_thickness,
)
from circuittex.design.weave import Weave
from circuittex.design.yarn import Material, Yarn

__all__ = [
    "HERTZ",
    "Clamps",
    "ContactLaw",
    "Design",
    "Electrical",
    "Gradient",
    "Loading",
    "Material",
    "MaterialPair",
    "Numerics",
    "Packing",
    "Probe",
    "Terminal",
    "Weave",
    "Yarn",
    "biaxial",
    "coated_radius",
    "design_hash",
    "equal_steps",
    "fibril_conductivity",
    "fibril_radius",
    "hexagonal_rows",
    "load_design",
    "load_unload",
    "parse_design",
    "plain_weave",
    "shear",
    "shell_thickness",
    "starter",
    "strain_grid",
    "touching_amplitude",
    "uniaxial",
    "yarn_library",
]
