"""Keys of a design are declared once: reader, checks, starter design and documentation follow."""

from __future__ import annotations

import re
import tomllib
from dataclasses import field, fields
from pathlib import Path

import pytest

from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.design import ContactLaw, Material, MaterialPair, design_hash, parse_design, starter
from circuittex.design.declaration import check, keys, number, read, reference_table, starter_lines
from circuittex.design.files import DECLARED
from circuittex.design.table import Table

PAGE = Path(__file__).parent.parent / "docs" / "design.md"


@frozen
class Shell:
    """A coating, declared as a newcomer would: one field."""

    thickness: float = field(metadata=number("mm", "of the coating", shown="1 um", above=0))

    def __post_init__(self) -> None:
        check(self, "shell")


def test_a_new_field_is_stated_once() -> None:
    assert read(Shell, Table({"thickness": "2 um"}, "shell")) == {"thickness": pytest.approx(2e-3)}
    with pytest.raises(DesignError, match=r"shell\.thickness: -1\.0 is not usable; it must be > 0 mm"):
        Shell(-1.0)
    with pytest.raises(DesignError, match=r"shell\.thickness: nothing is not usable; the key is missing"):
        read(Shell, Table({}, "shell"))
    assert tomllib.loads(starter_lines(Shell)) == {"thickness": "1 um"}
    assert "| `thickness` | > 0 mm |  | of the coating |" in reference_table(Shell)


@pytest.mark.parametrize("kind", DECLARED, ids=lambda kind: kind.__name__)
def test_the_documentation_has_the_table_of_the_declarations(kind: type) -> None:
    assert reference_table(kind) in PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("kind", DECLARED, ids=lambda kind: kind.__name__)
def test_every_key_of_the_starter_design_says_what_it_is(kind: type) -> None:
    assert all(key.note and key.shown in starter() for key in keys(kind).values())


def test_numbers_of_a_declared_part_are_declared() -> None:
    """A field that forgot its declaration would be read by nobody."""
    for kind in DECLARED:
        for each in fields(kind):
            assert each.type not in ("int", "float", "bool", "float | str") or each.name in keys(kind), each.name


def with_pairs(*pairs: dict[str, object]) -> dict[str, object]:
    design = tomllib.loads(starter())
    design["contact"]["pairs"] = list(pairs)
    return design


def test_a_pair_takes_from_the_rest_what_it_does_not_say() -> None:
    design = parse_design(with_pairs({"materials": ["fibril", "fibril"], "conductivity": "1 S/cm2"}))
    assert design.contact.pairs[0].penalty == "hertz"
    assert design.contact.between("fibril", "fibril").conductivity == pytest.approx(0.01)
    assert design_hash(design) != design_hash(parse_design(with_pairs()))


def test_a_pair_has_a_law_of_its_own_or_that_of_the_rest() -> None:
    given = with_pairs({"materials": ["fibril", "fibril"], "law": "holm"})
    assert parse_design(given).contact.laws == ("paper", "holm")
    given["contact"] |= {"law": "film", "pairs": [{"materials": ["fibril", "fibril"], "penalty": 5.0}]}
    assert parse_design(given).contact.laws == ("film", "film")


@pytest.mark.parametrize(
    ("pair", "field", "allowed"),
    [
        ({"materials": ["fibril", "nylon"]}, "contact.pairs.materials", "'fibril'"),
        ({"materials": ["fibril"]}, "contact.pairs[0].materials", "two materials"),
        ({"materials": ["fibril", "fibril"], "penalty": "soft"}, "contact.pairs[0].penalty", "N/mm2"),
        ({"materials": ["fibril", "fibril"], "hardness": 1}, "contact.pairs[0].hardness", "unknown key"),
        ({}, "contact.pairs[0].materials", "missing"),
    ],
)
def test_pairs_that_cannot_be(pair: dict[str, object], field: str, allowed: str) -> None:
    with pytest.raises(DesignError, match=re.escape(field)) as caught:
        parse_design(with_pairs(pair))
    assert allowed in str(caught.value)


def test_a_pair_listed_twice_is_refused() -> None:
    pair = MaterialPair(5.0, 0.01, 0.1, ("a", "b"))
    with pytest.raises(DesignError, match="listed twice"):
        ContactLaw(5.0, 0.01, 0.1, (pair, MaterialPair(4.0, 0.01, 0.1, ("b", "a"))))


def test_what_is_as_the_default_has_it_is_not_hashed() -> None:
    """A key that older designs lack must leave their hash alone."""
    given, left_out = tomllib.loads(starter()), tomllib.loads(starter())
    for part in ("packing", "clamps"):
        del left_out[part]
    assert design_hash(parse_design(given)) == design_hash(parse_design(left_out))


def test_materials_have_their_numbers_in_the_mesh() -> None:
    """The mesh carries every declared number of a material, fibril by fibril; exported parts alone use some."""
    from circuittex.geometry.mesh import FibrilMesh

    assert set(keys(Material)) - {"tc1", "tc2", "tolerance"} <= {each.name for each in fields(FibrilMesh)}


if __name__ == "__main__":
    text = PAGE.read_text(encoding="utf-8")
    for each in DECLARED:
        mark = f"<!-- {each.__name__} -->\n"
        before, after = text.split(mark)
        text = before + mark + "\n" + reference_table(each) + "\n" + re.sub(r"\A\n(\|.*\n)*", "", after)
    PAGE.write_text(text, encoding="utf-8")
