"""The order of the stages, read from the source: who may import whom, and what `import circuittex` costs."""

from __future__ import annotations

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import circuittex

PACKAGE = Path(circuittex.__file__).parent
SHARED = {"frozen", "errors", "compiled", "atomic"}

# Stage -> the stages and modules it may import, besides SHARED and itself (docs/architecture.md). A dotted name
# allows one module of a stage only; without a dot the whole stage is allowed.
STATE = {"contact.state", "geometry.mesh"}
RESULT_TYPES = {
    *{*STATE, "design", "fields", "fit", "verify", "mech.configuration"},
    *{"outcome", "discretisation", "bifurcation"},
}
ROUTES = {"fields", "circuit", "nodal", "netlist", "ngspice"}
OUTPUTS = {"store", "summary", "plot", "report", "vtu"}
ALLOWED: dict[str, set[str]] = {
    "atomic": set(),
    "frozen": set(),
    "compiled": set(),
    "errors": set(),
    "options": set(),
    "units": set(),
    "design": {"units"},
    "geometry": {"design"},
    "mech": {"geometry", "design"},
    "contact": {"mech.configuration", "mech.terms", "mech.pattern", "mech.space", "geometry", "design"},
    "relaxation": {"design", "geometry", "mech", "contact"},
    "increment": {"design", "geometry", "mech", "relaxation"},
    "fields": {*STATE, "design"},
    "spice_names": set(),
    "feet": {*STATE, "spice_names"},
    "circuit": {*STATE, "design", "feet", "spice_names"},
    "nodal": {"circuit", "geometry.mesh"},
    "netlist_reader": {"circuit"},
    "pyspice_export": {"circuit", "spice_names"},
    "netlist": {"circuit", "spice_names", "netlist_reader", "pyspice_export"},
    "ngspice": {"netlist", "geometry.mesh"},
    "fit": {"circuit", "nodal", "design", "geometry.mesh"},
    "verify": {*ROUTES, *STATE, "geometry.refine", "design", "spice_names"},
    "verify_reduced": {"circuit", "design", "fit", "netlist", "ngspice"},
    "export": {*STATE, "circuit", "contact.merge", "design", "fit", "netlist"},
    "discretisation": {"geometry.mesh"},
    "outcome": {"geometry.mesh"},
    "bifurcation": {"outcome"},
    "transfer": {"geometry.mesh", "mech.configuration"},
    "error_estimate": {
        *{"design", "geometry", "mech", "relaxation", "results", "discretisation", "outcome", "record", "transfer"},
        "workers",
    },
    "branch_check": {
        *{"design", "geometry", "mech", "relaxation", "results", "bifurcation", "outcome", "plan", "record"},
        "workers",
    },
    "results": RESULT_TYPES,
    "store": {*RESULT_TYPES, "results"},
    "tubes": {*RESULT_TYPES, "results"},
    "vtu": {*RESULT_TYPES, "results", "tubes"},
    "paths": {*RESULT_TYPES, "results"},
    "work": {*RESULT_TYPES, "results", "paths"},
    "summary": {*RESULT_TYPES, "results", "work"},
    "plot": {*RESULT_TYPES, "results", "tubes", "summary", "paths"},
    "claims": {*RESULT_TYPES, "geometry.levels", "results", "tubes", "summary", "paths"},
    "report": {*RESULT_TYPES, "results", "summary", "paths", "work", "claims", "plot"},
    "lock": set(),
    "workers": set(),
    "plan": {"design", "export", "geometry.mesh"},
    "record": {
        *{"design", "geometry", "mech", "contact", "relaxation", "increment", "fields", "fit", "verify"},
        *{"verify_reduced", "export", "results", "outcome", "plan"},
    },
    "folder": {"export", "results", *OUTPUTS},
    "schedule": {"mech.configuration", "mech.linear", "increment", "plan", "record", "results", "workers"},
    "ensemble": {
        *{"design", "geometry", "folder", "lock", "plan", "plot.style", "report.frame", "report.table", "results"},
        *{"store", "study", "summary"},
    },
    "study": {
        *{"design", "geometry.weave", "mech.configuration", "mech.linear", "mech.multifrontal"},
        *{"branch_check", "error_estimate", "folder", "lock", "plan", "record", "results", "schedule", "workers"},
    },
}
ANYTHING = {"cli", "__main__"}  # the command line, which nobody imports

# Libraries that take long to load or are not needed by everybody -> the only stages that know them.
LIBRARIES: dict[str, set[str]] = {
    "skfem": {"mech", "fields"},
    "numba": {"compiled"},
    "pypardiso": {"mech"},
    "threadpoolctl": {"mech"},
    "networkx": {"circuit"},
    "PySpice": {"pyspice_export"},
    "h5py": {"store"},
    "filelock": {"lock"},
    "meshio": {"vtu"},
    "matplotlib": {"plot", "ensemble"},
    "distributed": {"ensemble"},
    "dask": {"ensemble"},
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


def stage(module: str) -> str:
    return module.split(".")[0]


def violations(module: str, targets: set[str]) -> list[str]:
    """The targets that `module` must not import."""
    allowed = ALLOWED[stage(module)] | SHARED | {stage(module), ""}
    return sorted(t for t in targets if t not in allowed and stage(t) not in allowed)


def test_reader_sees_every_kind_of_import() -> None:
    source = "import a.b\nfrom c import d as e\ndef f():\n    if True:\n        from g.h import i\n"
    assert imports(source) == {"a.b", "c.d", "g.h.i"}


def test_rule_catches_a_forbidden_import() -> None:
    assert violations("fields", {"contact.state", "circuit", "contact.force"}) == ["circuit", "contact.force"]


def test_every_module_has_its_place_in_the_table() -> None:
    assert {stage(m) for m in MODULES if m} - ANYTHING <= set(ALLOWED)


@pytest.mark.parametrize("module", sorted(m for m in MODULES if m and stage(m) not in ANYTHING))
def test_module_imports_only_what_its_stage_may(module: str) -> None:
    assert violations(module, INTERNAL[module]) == []


def test_modules_take_only_the_version_from_the_package() -> None:
    """The package's lazy names are for users; inside, a module names the module it means."""
    taken = {
        (module, name)
        for module, path in MODULES.items()
        for name in imports(path.read_text(encoding="utf-8"))
        if module and resolve(name) == ""
    }
    assert {name for _, name in taken} <= {"circuittex.__version__"}


def test_no_cycles() -> None:
    graph = {module: targets - {"", module} for module, targets in INTERNAL.items() if module}
    assert set(TopologicalSorter(graph).static_order()) == set(graph)


def test_the_three_routes_do_not_know_one_another() -> None:
    for route in ("fields", "nodal", "ngspice"):
        reached, waiting = set(), {route}
        while waiting:
            reached |= waiting
            waiting = {t for m in waiting for t in INTERNAL[m]} - reached - {""}
        assert reached & {"fields", "nodal", "ngspice"} == {route}


def test_nobody_imports_the_command_line() -> None:
    assert [m for m, targets in INTERNAL.items() if "cli" in targets] == ["__main__"]
    assert [m for m, targets in INTERNAL.items() if "options" in targets] == ["cli"]


@pytest.mark.parametrize("library", sorted(LIBRARIES))
def test_library_is_known_only_where_it_belongs(library: str) -> None:
    users = {
        stage(module)
        for module, path in MODULES.items()
        if library in {name.split(".")[0] for name in imports(path.read_text(encoding="utf-8"))}
    }
    assert users <= LIBRARIES[library]


HEAVY = ["numpy", "scipy", "numba", "skfem", "matplotlib", "PySpice", "networkx", "h5py", "meshio", "pypardiso", "dask"]


@pytest.mark.parametrize(
    ("code", "forbidden"),
    [
        ("import circuittex", HEAVY),
        ("import circuittex; circuittex.__version__, dir(circuittex)", HEAVY),
        ("import circuittex; circuittex.load_design", [m for m in HEAVY if m != "numpy"]),
        ("import circuittex.cli as c\ntry: c.main(['--help'])\nexcept SystemExit: pass", HEAVY),
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
    assert not set(circuittex.__all__) & {stage(module) for module in MODULES}


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
