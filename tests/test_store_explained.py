"""results.h5 explains itself to someone who has only h5py: names, descriptions, units, and the documentation's page."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import get_args, get_type_hints

import check_crossings
import check_weave
import h5py
import numpy as np
import pytest
from contents import BEGIN, END, PAGE, full_study, table
from synthetic_study import synthetic_study

from circuittex.design.declaration import keys
from circuittex.results.records import Study
from circuittex.results.store import write_study_start
from circuittex.results.store.archive import registry
from circuittex.results.store.meaning import PLAIN, meanings, unit

PURE = {
    *("Record.strain", "Record.gradient", "Record.reduced_difference", "Loading.gradients", "Loading.start"),
    "Loading.strains",
    *("ContactState.axial_factor", "FibrilMesh.directors", "FibrilMesh.poisson_ratio", "Material.poisson_ratio"),
    *("Verification.max_current_difference", "Verification.merge_error", "Verification.field_difference"),
    *("Verification.native_difference", "Verification.ngspice_limit"),  # V per V, or relative
    *("Verification.native_limit", "Fit.pair_errors", "Numerics.drop_fraction", "Numerics.tolerance"),
    *("Numerics.overlap_warning", "Numerics.overlap_limit", "ContactLaw.exponent", "MaterialPair.exponent"),
    *("Material.tolerance", "ContactLaw.tolerance", "MaterialPair.tolerance", "Yarn.crimp", "Yarn.heat_set"),
    "Electrical.permittivity",
    "Electrical.emissivity",
    *("Fields.resistivity", "Fields.contact_resistivity"),
}
"""Every field with pure numbers that are no counts. A field that is not here names its unit in the text below it."""


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    folder = tmp_path / "results" / "plain_weave"
    folder.mkdir(parents=True)
    write_study_start(folder / "results.h5", full_study())
    return folder / "results.h5"


def holds_floats(kind: object) -> bool:
    """Whether an annotation admits numbers that are no counts."""
    return kind is float or "float64" in str(kind) or any(map(holds_floats, get_args(kind)))


def test_every_field_that_is_stored_says_what_it_is_and_in_which_unit() -> None:
    silent, pure = [], set()
    for name, kind in registry(Study).items():
        told, hints = meanings(kind), get_type_hints(kind)
        for field in fields(kind):
            if field.name not in told:
                silent.append(f"{name}.{field.name}")
            elif holds_floats(hints[field.name]) and unit(told[field.name]) == PLAIN:
                pure.add(f"{name}.{field.name}")
    assert silent == []
    assert pure == PURE


def test_units_of_a_design_are_those_of_its_keys() -> None:
    """The text below a field and the declaration that the reader checks by, which know nothing of one another."""
    compared = 0
    for kind in registry(Study).values():
        for name, key in keys(kind).items():
            found = unit(meanings(kind)[name])
            if found != PLAIN:
                assert key.allowed.endswith(f" {found}"), name
                compared += 1
            else:
                assert key.allowed.rsplit(" ", 1)[-1] not in ("mm", "MPa", "1/mm", "V"), name
    assert compared > 15


def test_everything_in_the_file_has_a_description_and_every_number_a_unit(stored: Path) -> None:
    """Wherever it stands; h5py's own visitors see what is linked in several places once."""
    silent, units = [], {}

    def look(group: h5py.Group) -> None:
        for item in group.values():
            if "description" not in item.attrs:
                silent.append(item.name)
            if isinstance(item, h5py.Group):
                look(item)
            elif item.dtype.kind in "iufc":
                units[item.name] = item.attrs["unit"]

    with h5py.File(stored) as file:
        assert file.attrs["description"]
        look(file)
        relaxed = file["states/relaxed"]
        assert "residual [N]: Largest free-dof force, N." in relaxed.attrs["about"]
        assert relaxed["fit"].attrs["description"].startswith("The reduced network")
    assert silent == []
    expected = {"contacts/line_load": "N/mm", "contacts/gap": "mm", "contacts/conductance": "S", "end_force": "N"}
    expected |= {"fields/0000/temperature": "K", "fields/0000/currents": "A", "history": "N, N mm, 1, 1"}
    assert {name: units[f"/states/relaxed/{name}"] for name in expected} == expected


def test_the_texts_are_there_without_docstrings(tmp_path: Path) -> None:
    """python -OO strips them from memory, not from the source."""
    code = """
import sys
from circuittex.mech.configuration import Configuration
from circuittex.results.store.meaning import meanings, summary
assert Configuration.__doc__ is None or "Nodal" not in Configuration.__doc__
print(summary(Configuration), meanings(Configuration))
"""
    out = subprocess.run([sys.executable, "-OO", "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.startswith("Nodal values of r, g1 and g2 [9] for every node of a `FibrilMesh`. {'x': '(N, 3, 3)")


def test_the_table_of_contents_is_what_a_file_holds() -> None:
    """`python tests/contents.py` writes it anew."""
    documented = PAGE.read_text(encoding="utf-8").split(BEGIN)[1].split(END)[0]
    assert documented == table()


def test_the_reading_example_runs(stored: Path) -> None:
    """As it stands, by a Python that has no circuittex, in the folder above `results`."""
    text = PAGE.read_text(encoding="utf-8")
    example = text[text.index("```python\nimport h5py") :].split("```")[1].removeprefix("python\n")
    code = f"import sys\nsys.modules['circuittex'] = None\nimport matplotlib\nmatplotlib.use('agg')\n{example}"
    folder = stored.parents[2]
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "(C,) p = P* o [28], N/mm. N/mm\n"
    assert (folder / "pressed.png").stat().st_size > 1000
    assert sum(bool(line.strip()) for line in example.splitlines()) <= 11


def test_the_example_adds_up_what_presses_on_a_fibril(stored: Path) -> None:
    """Every contact presses on two fibrils."""
    with h5py.File(stored) as file:
        contacts, fibrils = file["states/relaxed/contacts"], len(file["mesh/radius"])
        force = contacts["line_load"][()] * contacts["weight"][()]
        sums = [np.bincount(contacts[f"fibril_{side}"], force, fibrils) for side in "ab"]
    assert sum(map(np.sum, sums)) == pytest.approx(2.0 * force.sum(), rel=1e-14)


@pytest.mark.parametrize("check", [check_weave, check_crossings])
def test_checks_without_circuittex_see_on_which_side_fibrils_cross(
    check: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Four by four yarns of one fibril each: sixteen crossings, all on the wrong side where the weave is mirrored."""
    study = synthetic_study(1, contacts=5, rows=(1,))
    record = study.records[0]
    mirrored = record.configuration.x * np.array([1.0, 1.0, -1.0])
    upside_down = replace(record, configuration=replace(record.configuration, x=mirrored))
    for one, wrong in ((record, 0), (upside_down, 16)):
        path = tmp_path / f"{wrong}.h5"
        write_study_start(path, replace(study, records=(one,)))
        assert check.main(path) == (wrong > 0)  # type: ignore[attr-defined]
        said = capsys.readouterr().out
        assert f"{wrong} of 16 fibril crossings" in said or f"16 crossings, {wrong} on the wrong side" in said
