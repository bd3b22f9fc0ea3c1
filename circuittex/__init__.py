"""circuittex: the electrical behaviour of electronic textiles, from their fibrils up to SPICE netlists.

The public names below are loaded when they are first used, so that ``import circuittex`` costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from circuittex.base.version import __version__

_HOMES = {
    "design": (
        *("Clamps", "ContactLaw", "Design", "Electrical", "Loading", "Material", "MaterialPair", "Numerics", "Packing"),
        *("Probe", "Terminal", "Weave", "Yarn", "biaxial", "design_hash", "equal_steps", "load_design", "load_unload"),
        *("fibril_conductivity", "fibril_radius", "hexagonal_rows", "parse_design", "plain_weave", "shear", "starter"),
        *("coated_radius", "shell_thickness", "strain_grid", "touching_amplitude", "uniaxial", "yarn_library"),
    ),
    "geometry.weave": ("build_mesh",),
    "mech.configuration": ("initial_configuration",),
    "contact.conductance": ("add_contact_law",),
    "contact.state": ("ContactState",),
    "contact.extract": ("contact_state", "contacts_of"),
    "contact.merge": ("simplify",),
    "contact.places": ("contact_places",),
    "electrical.fields": ("solve_fields",),
    "electrical.network.circuit": ("Circuit", "build_circuit", "reduced_circuit", "to_networkx", "yarn_end_terminals"),
    "electrical.network.nodal": ("solve_nodal",),
    "netlist": ("Header", "deck", "read_deck", "subcircuit", "to_pyspice", "to_pyspice_subcircuit"),
    "electrical.spice.ngspice": ("read_raw", "run_deck"),
    "fit": ("fit_network",),
    "relaxation.relax": ("move", "relax"),
    "relaxation.increment": ("advance",),
    "study.run": ("run_study",),
    "study.ensemble": ("run_ensemble",),
    "study.kit": ("write_kit",),
    "study.library.export": ("export_library",),
    "study.library.instance": ("instance",),
    "study.library.members": ("complete_members",),
    "study.panel.statement": ("Cut", "Electrode", "Panel", "Seam"),
    "study.panel.cells": ("CellResistances", "cells_of_study"),
    "study.panel.reader": ("load_panel",),
    "study.panel.solution": ("solve_panel",),
    "study.panel.gradient": ("panel_gradient",),
    "study.panel.circuit": ("panel_circuit", "panel_netlists"),
    "study.panel.pictures": ("gradient_figure", "panel_figure"),
    "results.plot": ("cell_figure", "probe_figure", "section_figure"),
    "results.records": ("Record", "Study"),
    "results.store": ("load_study",),
    "base.errors": ("CircuittexError", "ConvergenceError", "DesignError"),
}
_HOME = {name: f"circuittex.{module}" for module, names in _HOMES.items() for name in names}

__all__ = ["__version__", *_HOME]

if TYPE_CHECKING:
    from circuittex.base.errors import CircuittexError as CircuittexError
    from circuittex.base.errors import ConvergenceError as ConvergenceError
    from circuittex.base.errors import DesignError as DesignError
    from circuittex.contact.conductance import add_contact_law as add_contact_law
    from circuittex.contact.extract import contact_state as contact_state
    from circuittex.contact.extract import contacts_of as contacts_of
    from circuittex.contact.merge import simplify as simplify
    from circuittex.contact.places import contact_places as contact_places
    from circuittex.contact.state import ContactState as ContactState
    from circuittex.design import Clamps as Clamps
    from circuittex.design import ContactLaw as ContactLaw
    from circuittex.design import Design as Design
    from circuittex.design import Electrical as Electrical
    from circuittex.design import Loading as Loading
    from circuittex.design import Material as Material
    from circuittex.design import MaterialPair as MaterialPair
    from circuittex.design import Numerics as Numerics
    from circuittex.design import Packing as Packing
    from circuittex.design import Probe as Probe
    from circuittex.design import Terminal as Terminal
    from circuittex.design import Weave as Weave
    from circuittex.design import Yarn as Yarn
    from circuittex.design import biaxial as biaxial
    from circuittex.design import coated_radius as coated_radius
    from circuittex.design import design_hash as design_hash
    from circuittex.design import equal_steps as equal_steps
    from circuittex.design import fibril_conductivity as fibril_conductivity
    from circuittex.design import fibril_radius as fibril_radius
    from circuittex.design import hexagonal_rows as hexagonal_rows
    from circuittex.design import load_design as load_design
    from circuittex.design import load_unload as load_unload
    from circuittex.design import parse_design as parse_design
    from circuittex.design import plain_weave as plain_weave
    from circuittex.design import shear as shear
    from circuittex.design import shell_thickness as shell_thickness
    from circuittex.design import starter as starter
    from circuittex.design import strain_grid as strain_grid
    from circuittex.design import touching_amplitude as touching_amplitude
    from circuittex.design import uniaxial as uniaxial
    from circuittex.design import yarn_library as yarn_library
    from circuittex.electrical.fields import solve_fields as solve_fields
    from circuittex.electrical.network.circuit import Circuit as Circuit
    from circuittex.electrical.network.circuit import build_circuit as build_circuit
    from circuittex.electrical.network.circuit import reduced_circuit as reduced_circuit
    from circuittex.electrical.network.circuit import to_networkx as to_networkx
    from circuittex.electrical.network.circuit import yarn_end_terminals as yarn_end_terminals
    from circuittex.electrical.network.nodal import solve_nodal as solve_nodal
    from circuittex.electrical.spice.ngspice import read_raw as read_raw
    from circuittex.electrical.spice.ngspice import run_deck as run_deck
    from circuittex.fit import fit_network as fit_network
    from circuittex.geometry.weave import build_mesh as build_mesh
    from circuittex.mech.configuration import initial_configuration as initial_configuration
    from circuittex.netlist import Header as Header
    from circuittex.netlist import deck as deck
    from circuittex.netlist import read_deck as read_deck
    from circuittex.netlist import subcircuit as subcircuit
    from circuittex.netlist import to_pyspice as to_pyspice
    from circuittex.netlist import to_pyspice_subcircuit as to_pyspice_subcircuit
    from circuittex.relaxation.increment import advance as advance
    from circuittex.relaxation.relax import move as move
    from circuittex.relaxation.relax import relax as relax
    from circuittex.results.plot import cell_figure as cell_figure
    from circuittex.results.plot import probe_figure as probe_figure
    from circuittex.results.plot import section_figure as section_figure
    from circuittex.results.records import Record as Record
    from circuittex.results.records import Study as Study
    from circuittex.results.store import load_study as load_study
    from circuittex.study.ensemble import run_ensemble as run_ensemble
    from circuittex.study.kit import write_kit as write_kit
    from circuittex.study.library.export import export_library as export_library
    from circuittex.study.library.instance import instance as instance
    from circuittex.study.library.members import complete_members as complete_members
    from circuittex.study.panel.cells import CellResistances as CellResistances
    from circuittex.study.panel.cells import cells_of_study as cells_of_study
    from circuittex.study.panel.circuit import panel_circuit as panel_circuit
    from circuittex.study.panel.circuit import panel_netlists as panel_netlists
    from circuittex.study.panel.gradient import panel_gradient as panel_gradient
    from circuittex.study.panel.pictures import gradient_figure as gradient_figure
    from circuittex.study.panel.pictures import panel_figure as panel_figure
    from circuittex.study.panel.reader import load_panel as load_panel
    from circuittex.study.panel.solution import solve_panel as solve_panel
    from circuittex.study.panel.statement import Cut as Cut
    from circuittex.study.panel.statement import Electrode as Electrode
    from circuittex.study.panel.statement import Panel as Panel
    from circuittex.study.panel.statement import Seam as Seam
    from circuittex.study.run import run_study as run_study
else:

    def __getattr__(name: str) -> Any:
        if name not in _HOME:
            raise AttributeError(f"module 'circuittex' has no attribute {name!r}")
        value = getattr(import_module(_HOME[name]), name)
        globals()[name] = value  # found directly from now on
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
