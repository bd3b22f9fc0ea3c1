"""What the command line understands: its commands, their options, and their help."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from circuittex.base.version import __version__
from circuittex.command.exit_codes import table

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands."""
    parser = argparse.ArgumentParser(
        prog="circuittex",
        description=(
            "From the fibrils of an electronic textile to SPICE netlists: relaxes and stretches a woven cell,\n"
            "turns every recorded state into a resistor network, checks it, and fits the resistance of a\n"
            "yarn segment (Ry) and of a crossing (Rc)."
        ),
        epilog=(
            "a first study:\n"
            "  circuittex new > weave.toml\n"
            "  circuittex run weave.toml --out results/weave\n"
            "then open results/weave/report.html. 'circuittex COMMAND --help' explains a command.\n\n"
            f"exit codes:\n{table()}"
        ),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"circuittex {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_new(commands)
    _add_yarns(commands)
    _add_run(commands)
    _add_netlist(commands)
    _add_verify(commands)
    _add_report(commands)
    _add_ensemble(commands)
    _add_export(commands)
    _add_panel(commands)
    return parser


def _command(
    commands: Commands,
    name: str,
    summary: str,
    text: str,
    example: str,
) -> argparse.ArgumentParser:
    parser = commands.add_parser(
        name,
        help=summary,
        description=text,
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command=name)
    return parser


def _add_new(commands: Commands) -> None:
    parser = _command(
        commands,
        "new",
        "print a commented starter design",
        "Prints a design file with every setting explained: a plain weave ready to run. With --fabric it is a small\n"
        "fabric of yarns that people buy, computed in seconds: silver_sensor, steel_heater or copper_bus.",
        "circuittex new > weave.toml",
    )
    parser.add_argument("--fabric", default="", metavar="NAME", help="a fabric of yarns of the library")


def _add_yarns(commands: Commands) -> None:
    parser = _command(
        commands,
        "yarns",
        "list the yarns that a design can name, with their sources",
        "Lists the yarns of the library, which designs take by 'yarn = \"NAME\"' in a table [yarns.ANY]: what they\n"
        "are, where their numbers are from, and what is assumed. Those of installed packages and of the folders in\n"
        "the environment variable CIRCUITTEX_YARNS are among them.",
        "circuittex yarns",
    )
    parser.add_argument(
        "--folder", type=Path, action="append", default=[], help="a further folder with yarns, as a design names it"
    )


def _add_run(commands: Commands) -> None:
    parser = _command(
        commands,
        "run",
        "compute a design: relax, stretch, solve, write netlists, check, fit, report",
        "Relaxes the woven cell of DESIGN, follows its loading paths, and for every recorded state solves\n"
        "voltage and temperature for each probe, writes the netlists, has ngspice confirm them and fits Ry and\n"
        "Rc. Leaves in DIR: summary.json, report.html, the netlists, all results in HDF5, figures, and files\n"
        "for ParaView. States are written one by one: however a run ends, the same command goes on from the\n"
        "states that are finished, with the same numbers. Loading paths are computed beside one another, as far\n"
        "as there are cores. Results of another design in DIR are refused, and so is a DIR that another run is\n"
        "writing to. Exit code 5 where routes differ by more than 1e-9 and their rounding; without ngspice the\n"
        "run completes and says that it did not check.",
        "circuittex run examples/plain_weave.toml --out results/plain_weave",
    )
    _add_design(parser)
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder of the results; made if missing")
    parser.add_argument(
        "--fresh",
        action="store_true",
        help="start again: remove what earlier runs left in DIR, of this design or another; your own files stay",
    )
    parser.add_argument(
        "--start",
        metavar="START",
        default="initial",
        help="where the first relaxation starts: 'initial', the initial weave (default); 'tiled', copies of the "
        "smallest cell that the draft repeats, relaxed before; or FILE[:STATE], a stored state (default: relaxed) of a "
        "design with as many fibrils in each yarn",
    )
    parser.add_argument(
        "--error-estimate",
        action="store_true",
        help="estimate the discretisation error of clamp forces, currents, Ry and Rc in the relaxed state and the last "
        "state of each loading path, from three more relaxations each: on half and on twice as many elements, and with "
        "twice as many contact points. A run made without gets them when it is repeated with this option",
    )
    parser.add_argument(
        "--branches",
        action="store_true",
        help="reach every recorded state once more, with the fibrils in another order, and say whether clamp forces "
        "and currents stay the same or that order chooses among branches; this takes as long as the relaxations did. A "
        "run made without gets the checks when it is repeated with this option",
    )
    parser.add_argument(
        "--workers",
        metavar="N",
        type=int,
        help="processes that compute loading paths beside one another, at most one for each path (default: the cores "
        "there are); the numbers do not depend on it",
    )


def _add_netlist(commands: Commands) -> None:
    parser = _command(
        commands,
        "netlist",
        "write a netlist of a computed state",
        "Writes a SPICE netlist of one state of a results folder: the detailed network of fibrils and contacts\n"
        "as a sub-circuit with one pin per yarn end or as a deck that runs as it stands, or the reduced network\n"
        "of Ry and Rc. Every netlist begins with a comment header: what it is, design, state, units, pins.",
        "circuittex netlist results/plain_weave --state relaxed --resolution full --out relaxed.cir",
    )
    _add_results(parser)
    parser.add_argument("--state", metavar="NAME", default="relaxed", help="recorded state (default: relaxed)")
    parser.add_argument(
        "--kind",
        choices=("subckt", "deck", "reduced"),
        default="subckt",
        help="sub-circuit (default), runnable deck of one probe, or the reduced network as a sub-circuit",
    )
    parser.add_argument("--probe", metavar="NAME", help="probe of '--kind deck' (default: the first of the design)")
    parser.add_argument(
        "--resolution",
        choices=("merged", "full"),
        default="merged",
        help="merged: contact points within the design's merge length are one, as ngspice checks it (default); "
        "full: every contact point, which may be more than ngspice can order in reasonable time",
    )
    parser.add_argument("--out", metavar="FILE", type=Path, help="file to write (default: standard output)")


def _add_verify(commands: Commands) -> None:
    parser = _command(
        commands,
        "verify",
        "check computed states again: finite elements, nodal solution, ngspice",
        "Solves every recorded state again by all three routes and prints the largest differences of node\n"
        "voltages and terminal currents. Exit code 5 where routes differ by more than 1e-9 and their rounding,\n"
        "8 without ngspice, 9 where ngspice failed. Changes nothing in the folder.",
        "circuittex verify results/plain_weave --state relaxed",
    )
    _add_results(parser)
    parser.add_argument("--state", metavar="NAME", help="only this state (default: all)")


def _add_report(commands: Commands) -> None:
    parser = _command(
        commands,
        "report",
        "draw figures and report again from the stored results",
        "Rebuilds figures, report.html and summary.json from the HDF5 file of a results folder. Solves nothing.\n"
        "A folder that a run is writing to is refused: the run draws the report itself when it is done.",
        "circuittex report results/plain_weave",
    )
    _add_results(parser)
    parser.add_argument(
        "--beside",
        metavar="OTHER",
        type=Path,
        help="results of the paper's cell with the other parameter set: they get a column of their own in the table "
        "that compares the paper's claims with what is found",
    )


def _add_ensemble(commands: Commands) -> None:
    parser = _command(
        commands,
        "ensemble",
        "compute many random packings of a design, and the spread of its results",
        "Computes members that differ from DESIGN by small random offsets of the fibrils, twists of the yarns and\n"
        "shifts of their waves: as the [packing] table of DESIGN says, or moving fibrils by 5 % of their radius.\n"
        "Leaves in DIR: the median and percentile bands of forces, currents, Ry and Rc against strain as\n"
        "ensemble.html, ensemble.csv and ensemble.json, and each member's study in members/NUMBER. Needs the\n"
        "extra 'circuittex[ensemble]'. However it ends, the same command goes on; it may ask for more members.",
        "circuittex ensemble examples/plain_weave.toml --members 32",
    )
    _add_design(parser)
    parser.add_argument("--members", metavar="N", type=int, required=True, help="how many packings")
    parser.add_argument(
        "--out", metavar="DIR", type=Path, help="folder of the results (default: results/NAME-ensemble)"
    )
    parser.add_argument("--seed", metavar="S", type=int, help="of the ensemble (default: the one in [packing], or 0)")
    parser.add_argument(
        "--start",
        metavar="START",
        default="initial",
        help="where members start: 'initial', their initial weaves (default), or FOLDER[:STATE] of another ensemble "
        "with the same packings, each from the state (default: relaxed) that the member of its number has there",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", metavar="W", type=int, help="processes on this machine (default: its cores)")
    where.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="a running Dask scheduler, such as tcp://node1:8786; its workers need circuittex and must share DIR",
    )


def _add_export(commands: Commands) -> None:
    parser = _command(
        commands,
        "export",
        "write a folder of SPICE libraries in which strain is an input, with a datasheet",
        "Writes the sub-circuits of a computed study for ngspice, LTspice, Xyce and gnucap: the detailed network,\n"
        "its exact reduction to the pins, a cell of Ry and Rc, and one crossing; and for each loading the same with\n"
        "strain as a parameter (..._s) or as the voltage of a pin (..._v, 1 V for 100 %). Beside them examples that\n"
        "run as they stand, library.json, and datasheet.html with the error of each level. RESULTS may be the folder\n"
        "of an ensemble: then there are also corners (_p05 _p50 _p95) and a parameter for Monte Carlo (mc).",
        "circuittex export results/plain_weave --out fabric_lib",
    )
    _add_results(parser)
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder of the library; made if missing")
    parser.add_argument("--name", default="fabric", help="first word of all sub-circuits' names (default: fabric)")
    parser.add_argument("--state", metavar="NAME", default="", help="state of what has no strain (default: relaxed)")
    parser.add_argument(
        "--ends",
        choices=("crimped", "free"),
        default="crimped",
        help="crimped: a pin for each yarn end that joins its fibrils (default); free: a pin for each terminal of the "
        "design, and the fibril ends of no terminal are insulated one by one",
    )
    parser.add_argument(
        "--thin",
        metavar="ERROR",
        type=float,
        default=0.0,
        help="write also ports with fewer resistors, of which no resistance is off by more than this part: 0.001",
    )
    parser.add_argument(
        "--rise",
        metavar="K",
        type=float,
        help="temperature rise of the rated currents (default: electrical.rated_rise of the design, 10 K)",
    )
    parser.add_argument(
        "--combine",
        metavar="A,B",
        default="",
        help="two strains of stretch_x, stretch_y and shear that must be inputs of one part: an error that names the "
        "missing states where the study has no complete grid of both (where it has, the part is there anyway)",
    )
    parser.add_argument(
        "--reactive",
        action="store_true",
        help="give every part the capacitances between its yarns and their inductances, to first order",
    )
    parser.add_argument(
        "--kit",
        action="store_true",
        help="write also DIR/kit: circuits of three sizes with their answers, to check any other simulator by",
    )


def _add_panel(commands: Commands) -> None:
    parser = _command(
        commands,
        "panel",
        "solve a panel of many cells with electrodes, cuts, seams and strain",
        "Solves the panel that PANEL describes: voltages, currents and heat, the resistance between each two\n"
        "electrodes, and its gradient with respect to the strain and the Rc of every cell for the pairs that PANEL\n"
        "names. Leaves in DIR: panel.json, panel.npz with the maps, pictures, the whole network as panel.lib with\n"
        "the electrodes as pins and as the deck panel.cir, and its exact reduction to the electrodes as\n"
        "panel_ports.lib. Large panels need the extra 'circuittex[panel]'.",
        "circuittex panel examples/heater_panel.toml --out results/heater_panel",
    )
    parser.add_argument("panel", metavar="PANEL", type=Path, help="panel file (TOML); see docs/panel.md")
    parser.add_argument(
        "--out", metavar="DIR", type=Path, help="folder of the results (default: results/NAME of PANEL)"
    )
    parser.add_argument("--quiet", action="store_true", help="print no table")


def _add_design(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("design", metavar="DESIGN", type=Path, help="design file (TOML); see 'circuittex new'")
    parser.add_argument("--quiet", action="store_true", help="show no progress and no closing table")


def _add_results(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("results", metavar="RESULTS", type=Path, help="folder that 'circuittex run' has written")
