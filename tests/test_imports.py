"""The order of the rooms, read from the source: who may import whom, and what `import circuittex` costs."""

from __future__ import annotations

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import circuittex

PACKAGE = Path(circuittex.__file__).parent
ROOMS_OF = {"electrical", "results", "study"}  # folders that hold rooms of their own

# Room -> the rooms and modules it may import, besides `base` and itself (docs/architecture.md). A dotted name that
# is no room allows one module only.
STATE = {"contact.state", "geometry.mesh"}
ROUTES = {"electrical.fields", "electrical.network", "netlist", "electrical.spice"}
RESULT_TYPES = {*STATE, "design", "electrical.fields", "electrical.network.ports", "fit", "mech.configuration"}
ALLOWED: dict[str, set[str]] = {
    "base": set(),
    "design": set(),
    "geometry": {"design"},
    "solvers": set(),
    "mech": {"solvers", "geometry", "design"},
    "contact": {
        "mech.configuration",
        "mech.terms",
        "mech.space",
        "mech.pattern",
        "solvers.ranges",
        "geometry",
        "design",
    },
    "relaxation": {"design", "geometry", "solvers", "mech", "contact"},
    "electrical": set(),
    "electrical.fields": {*STATE, "design"},
    "electrical.network": {*STATE, "design"},
    "electrical.spice": {"electrical.network"},
    "netlist": {
        "electrical.network",
        "electrical.spice.foreign",
        "electrical.spice.reader",
        "electrical.spice.pyspice",
    },
    "fit": {"electrical.network", "design"},
    "results": RESULT_TYPES,
    "results.store": {*RESULT_TYPES, "results"},
    "results.vtk": {*RESULT_TYPES, "results"},
    "results.plot": {*RESULT_TYPES, "results", "results.vtk"},
    "results.claims": {*RESULT_TYPES, "geometry.levels", "results", "results.vtk"},
    "results.report": {*RESULT_TYPES, "results", "results.claims", "results.plot"},
    "study": {
        *{"design", "geometry", "mech", "solvers", "contact", "relaxation", *ROUTES, "fit"},
        *{"results", "results.store", "results.vtk", "results.plot", "results.report"},
    },
    "study.ensemble": {
        *{"design", "geometry", "fit", "study", "results", "results.store"},
        *{"results.plot.style", "results.report.number", "results.report.page", "results.report.template"},
    },
    "study.library": {
        *{"design", "study", "results", "results.store", "electrical.network", "netlist", "contact.state"},
        *{"results.plot.style", "results.report.number", "results.report.page", "results.report.template"},
    },
    "study.panel": {
        *{"design", "solvers", "electrical.network", "netlist", "results", "results.store", "results.plot.style"},
    },
}
ANYTHING = {"command", "__main__"}  # the command line, which nobody imports

# Libraries that take long to load or are not needed by everybody -> the only stages that know them.
LIBRARIES: dict[str, set[str]] = {
    "skfem": {"mech", "electrical.fields"},
    "numba": {"base"},
    "pypardiso": {"mech"},
    "threadpoolctl": {"solvers"},
    "networkx": {"electrical.network", "study.library"},
    "PySpice": {"electrical.spice"},
    "h5py": {"results.store"},
    "jinja2": {"results.report"},
    "filelock": {"base"},
    "meshio": {"results.vtk"},
    "matplotlib": {"results.plot", "study.ensemble", "study.library", "study.panel"},
    "pyamg": {"solvers"},
    "distributed": {"study.ensemble"},
    "dask": {"study.ensemble"},
}


def module_name(path: Path) -> str:
    """Dotted name below the package; empty for the package itself."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def imports(source: str) -> set[str]:
    """Absolute dotted names of everything imported anywhere in `source`, inside functions as well."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
    return found


def resolve(name: str) -> str | None:
    """The module of this package that the absolute name means, or None for another library."""
    if name.split(".")[0] != "circuittex":
        return None
    parts = name.split(".")[1:]
    while parts and ".".join(parts) not in MODULES:
        parts.pop()
    return ".".join(parts)


INTERNAL = {
    module: {target for name in imports(path.read_text(encoding="utf-8")) if (target := resolve(name)) is not None}
    for module, path in MODULES.items()
}


def room(module: str) -> str:
    """The room of a module: a folder at the top or in one of `ROOMS_OF`; 'netlist' and 'fit' are their own."""
    parts = module.split(".")
    inner = parts[0] in ROOMS_OF and len(parts) > 1 and (PACKAGE / parts[0] / parts[1]).is_dir()
    return ".".join(parts[: 2 if inner else 1])


def violations(module: str, targets: set[str]) -> list[str]:
    """The targets that `module` must not import."""
    allowed = ALLOWED[room(module)] | {"base", room(module), ""}
    return sorted(t for t in targets if t not in allowed and room(t) not in allowed)


def test_reader_sees_every_kind_of_import() -> None:
    source = "import a.b\nfrom c import d as e\ndef f():\n    if True:\n        from g.h import i\n"
    assert imports(source) == {"a.b", "c.d", "g.h.i"}


def test_rule_catches_a_forbidden_import() -> None:
    assert violations("electrical.fields.line", {"contact.state", "fit", "contact.law"}) == ["contact.law", "fit"]


def test_every_module_has_its_place_in_the_table() -> None:
    assert {room(m) for m in MODULES if m} - ANYTHING == set(ALLOWED)


@pytest.mark.parametrize("module", sorted(m for m in MODULES if m and room(m) not in ANYTHING))
def test_module_imports_only_what_its_room_may(module: str) -> None:
    assert violations(module, INTERNAL[module]) == []


def test_modules_take_nothing_from_the_package() -> None:
    """The package's lazy names are for users; inside, a module names the module it means."""
    taken = {
        (module, name)
        for module, path in MODULES.items()
        for name in imports(path.read_text(encoding="utf-8"))
        if module and resolve(name) == ""
    }
    assert {name for _, name in taken} == set()


def test_no_cycles() -> None:
    graph = {module: targets - {"", module} for module, targets in INTERNAL.items() if module}
    assert set(TopologicalSorter(graph).static_order()) == set(graph)


def test_the_three_routes_do_not_know_one_another() -> None:
    routes = {"electrical.fields.solution", "electrical.network.nodal", "electrical.spice.ngspice"}
    for route in routes:
        reached, waiting = set(), {route}
        while waiting:
            reached |= waiting
            waiting = {t for m in waiting for t in INTERNAL[m]} - reached - {""}
        assert reached & routes == {route}


def test_nobody_imports_the_command_line() -> None:
    users = {m for m, targets in INTERNAL.items() if any(room(t) == "command" for t in targets)}
    assert {m for m in users if room(m) != "command"} == {"__main__"}


@pytest.mark.parametrize("library", sorted(LIBRARIES))
def test_library_is_known_only_where_it_belongs(library: str) -> None:
    users = {
        room(module)
        for module, path in MODULES.items()
        if library in {name.split(".")[0] for name in imports(path.read_text(encoding="utf-8"))}
    }
    assert users <= LIBRARIES[library]


HEAVY = [
    "numpy",
    "scipy",
    "numba",
    "skfem",
    "matplotlib",
    "PySpice",
    "networkx",
    "h5py",
    "meshio",
    "pypardiso",
    "dask",
    "jinja2",
    "pyamg",
]


@pytest.mark.parametrize(
    ("code", "forbidden"),
    [
        ("import circuittex", HEAVY),
        ("import circuittex; circuittex.__version__, dir(circuittex)", HEAVY),
        ("import circuittex; circuittex.load_design", [m for m in HEAVY if m != "numpy"]),
        ("import circuittex.command.cli as c\ntry: c.main(['--help'])\nexcept SystemExit: pass", HEAVY),
    ],
)
def test_light_in_a_bare_process(code: str, forbidden: list[str]) -> None:
    probe = f"{code}\nimport sys\nloaded = sorted(set({forbidden!r}) & set(sys.modules))\nassert not loaded, loaded"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def test_every_public_name_resolves() -> None:
    assert set(circuittex.__all__) <= set(dir(circuittex))
    for name in circuittex.__all__:
        assert getattr(circuittex, name) is not None


def test_no_public_name_is_a_module_too() -> None:
    """Python sets a module as an attribute of its package: it would take the place of the lazy name."""
    assert not set(circuittex.__all__) & {room(module).split(".")[0] for module in MODULES}


def test_type_checkers_see_the_same_names() -> None:
    """The names under TYPE_CHECKING are exactly the lazy ones, each from the module it is loaded from."""
    (block,) = (
        node
        for node in ast.parse(MODULES[""].read_text(encoding="utf-8")).body
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
    )
    seen = {
        alias.name: statement.module
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }
    assert set(seen) == set(circuittex.__all__) - {"__version__"}
    for name, home in seen.items():
        assert getattr(circuittex, name) is getattr(sys.modules[str(home)], name)


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'wave'"):
        circuittex.wave  # noqa: B018 (the access is the test)
