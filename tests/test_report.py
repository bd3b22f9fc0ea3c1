"""The report: self-contained, well-formed, escaped, and plain about what was not checked."""

from __future__ import annotations

import base64
import re
import tomllib
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from jinja2 import UndefinedError
from markupsafe import escape
from synthetic_study import synthetic_study
from test_stored_errors import made_up
from test_summary import disagreeing, unchecked

import circuittex
from circuittex.design import Packing, Terminal, strain_grid, uniaxial
from circuittex.results.claims import CLAIMS
from circuittex.results.plot import FIGURES
from circuittex.results.records import Study
from circuittex.results.report import page, write_report
from circuittex.results.report.template import render

PNG = b"\x89PNG\r\n\x1a\nno real picture"
STUDY = synthetic_study(3, contacts=40, name="<b>A & \"B\"</b> $HOME 'x'")
NAMES = [record.name for record in STUDY.records]
EMPTY_ELEMENTS = {"meta", "img", "br"}


class Checker(HTMLParser):
    """Collects the text and checks that every element is closed where it must be."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text: list[str] = []
        self.sources: list[str] = []
        self.seen: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.add(tag)
        self.sources += [str(value) for name, value in attrs if name in ("src", "href", "srcset", "data")]
        if tag not in EMPTY_ELEMENTS:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def parsed(study: Study) -> Checker:
    checker = Checker()
    checker.feed(page(study, dict.fromkeys(FIGURES, PNG) if study.records else {}))
    checker.close()
    assert checker.open == []
    return checker


def test_page_is_well_formed_and_self_contained() -> None:
    checker = parsed(STUDY)
    assert len(checker.sources) == len(FIGURES)
    for source in checker.sources:
        head, data = source.split(",")
        assert head == "data:image/png;base64"
        assert base64.b64decode(data, validate=True) == PNG
    assert not checker.seen & {"script", "link", "iframe", "b"}
    assert not re.search(r"https?:|url\(|@import", page(STUDY, {}))


def test_names_are_shown_as_they_are() -> None:
    assert STUDY.design.name in parsed(STUDY).text


TABLES = ("Recorded states", "Clamp forces", "Equilibrium", "Energy", "Reduced network", "Verification")
"""Headings below which every state has a row."""


def test_numbers_are_in_the_tables() -> None:
    text = parsed(STUDY).text
    headings = [text.index(heading) for heading in (*TABLES, "Parameters")]
    assert headings == sorted(headings)
    for heading, start, stop in zip(TABLES, headings, headings[1:], strict=False):
        assert [name for name in text[start:stop] if name in NAMES] == NAMES, heading
    for record in STUDY.records:
        assert record.netlist in text
        assert f"{record.currents[2]:.4g}" in text
        assert f"{record.fit.Ry:.4g}" in text
        assert f"{record.clamp_force[0, 0]:.5g}" in text
    assert STUDY.design_hash in text


def test_agreement_and_its_lack_are_said_plainly() -> None:
    good = page(STUDY, {})
    assert "ngspice confirmed every recorded state." in good
    assert 'class="bad"' not in good
    missing = page(unchecked(STUDY, "relaxed"), {})
    assert 'class="bad"' in missing
    assert "ngspice did NOT check relaxed" in missing
    assert "NOT CHECKED ngspice was not found" in missing


def test_the_verdict_names_the_states_that_disagree() -> None:
    text = page(disagreeing(STUDY, "stretch-0.0250", max_voltage_difference=3e-8), {})
    assert "The routes DISAGREE in stretch-0.0250, by up to 3.0e-08" in text
    assert "ngspice confirmed" not in text
    assert text.count("NOT CONFIRMED") == 1
    assert 'class="bad"' in text


@pytest.mark.parametrize("difference", [2e-9, float("nan")])
def test_disagreement_is_said_plainly(difference: float) -> None:
    first = STUDY.records[0]
    wrong = replace(first, verification=replace(first.verification, max_current_difference=difference))
    text = page(replace(STUDY, records=(*STUDY.records, wrong)), {})
    assert "DISAGREE" in text
    assert 'class="bad"' in text


def test_the_paper_is_judged_where_the_study_is_of_its_cell() -> None:
    shown = parsed(STUDY)
    assert all(claim.states in shown.text for claim in CLAIMS)
    assert "Figure 15 of the paper." in page(STUDY, {"network": PNG})
    weave = replace(STUDY.design.weave, amplitude=0.5)
    other = page(replace(STUDY, design=replace(STUDY.design, weave=weave)), {"network": PNG})
    assert "of the paper" not in other
    assert "claim by claim" not in other


def test_findings_that_differ_are_followed_by_the_reason() -> None:
    slack = tuple(replace(record, clamp_force=0.1 * record.clamp_force) for record in STUDY.records)
    text = page(replace(STUDY, records=slack), {})
    assert '<em class="no">does not agree</em> 0.149 N on the warp' in text
    assert "Why not: With Table I" in text
    fit = tuple(replace(record, clamp_force=record.clamp_force * 2.0 / 1.49) for record in STUDY.records)
    assert "Why not: With Table I" not in page(replace(STUDY, records=fit), {})


def test_loading_paths_are_stated() -> None:
    loading = (uniaxial("strip", (0.1, 0.2, 0.1), free="y"), *strain_grid("pull", "x", (0.05,), "y", (0.2,)))
    text = parsed(replace(STUDY, design=replace(STUDY.design, loading=loading))).text
    row = text.index("strip")
    last = "Fxx 1.1, Fxy 0, Fyx 0, Fyy 1"
    assert text[row : row + 6] == ["strip", "3", "0.1 to 0.2", "relaxed", last, "yarns along y"]
    row = text.index("pull-x0p05-y")
    start, last = "Fxx 1.05, Fxy 0, Fyx 0, Fyy 1", "Fxx 1.05, Fxy 0, Fyx 0, Fyy 1.2"
    assert text[row : row + 6] == ["pull-x0p05-y", "1", "0.2 to 0.2", start, last, "none"]


def rows_below(study: Study, heading: str) -> list[str]:
    """The texts of the page below a heading."""
    text = parsed(study).text
    return text[text.index(heading) + 1 :]


def test_the_packing_is_stated_where_it_is_random() -> None:
    packing = Packing(seed=7, lateral=0.01, twist=0.002)
    rows = rows_below(replace(STUDY, design=replace(STUDY.design, packing=packing)), "Random packing")
    packing_rows = ["seed", "7", "lateral", "0.01", "vertical", "0.0", "twist", "0.002", "phase", "0.0"]
    assert rows[2:12] == packing_rows
    assert "Random packing" not in parsed(STUDY).text


def test_terminals_are_stated_also_those_without_a_probe() -> None:
    terminals = (*STUDY.design.terminals, Terminal("all", (("weft1", -1), ("weft2", +1))))
    study = replace(STUDY, design=replace(STUDY.design, terminals=terminals))
    rows = rows_below(study, "Terminals")
    assert rows[rows.index("all") + 1] == "weft1-, weft2+"
    assert rows[rows.index("common") + 1] == "warp2+"
    bare = replace(study, design=replace(study.design, terminals=(), probes=()))
    assert not {"Terminals", "Probes"} & set(parsed(bare).text)


def test_who_is_made_of_what_is_stated() -> None:
    weave = STUDY.design.weave
    kind = weave.warp[0]
    insulator = replace(kind.materials[0], name="nylon", electrical_conductivity=0.0)
    plied = replace(kind, name="plied", materials=(*kind.materials[:4], insulator, *kind.materials[5:]))
    mixed = replace(weave, warp=(plied, *weave.warp[1:]))
    study = replace(STUDY, design=replace(STUDY.design, weave=mixed))
    rows = rows_below(study, "Weave")
    assert rows[rows.index("warp") + 1] == f"plied, 3 × {kind.name}"
    assert rows[rows.index("weft") + 1] == f"4 × {kind.name}"
    rows, name = rows_below(study, "Yarn plied"), kind.materials[0].name
    assert rows[rows.index("materials") + 1] == f"4 × {name}, nylon, 5 × {name}"
    assert "Material nylon" in rows


def test_captions_say_what_bars_are_where_there_are_bars() -> None:
    pictures = dict.fromkeys(FIGURES, PNG)
    assert "estimated discretisation error" not in page(STUDY, pictures)
    text = page(replace(STUDY, errors=(made_up("relaxed"),)), pictures)
    for what in ("of the force along the yarns", "of the currents", "of Ry and Rc"):
        # once as the caption and once for those who see no picture
        assert text.count(f"the estimated discretisation error {what}") == 2


def test_study_without_states(tmp_path: Path) -> None:
    path = write_report(tmp_path / "new folder", replace(STUDY, records=()))
    assert "No state has been recorded" in path.read_text("utf-8")
    assert parsed(replace(STUDY, records=())).sources == []


def test_report_shows_the_figures_it_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in set(FIGURES) - {"forces", "network"}:  # two are enough to see, and the others take long
        monkeypatch.delitem(FIGURES, name)
    content = write_report(tmp_path, STUDY).read_text("utf-8")
    for name in ("forces", "network"):
        png = (tmp_path / "figures" / f"{name}.png").read_bytes()
        assert base64.b64encode(png).decode() in content
    assert content.count("<figure>") == 2


TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs", "Zl", "Zp"]), min_size=1, max_size=60)
NASTY = [
    "<script>alert(1)</script>",
    "&amp;",
    "\"'><img src=x onerror=y>",
    "{{ 7 * 7 }}",
    "{% raw %}",
    "</title>",
    "Köper ü",
]


@pytest.mark.parametrize("text", NASTY)
def test_no_text_becomes_markup(text: str) -> None:
    assert_text(text)


@settings(max_examples=25, deadline=None)
@given(TEXTS)
def test_no_title_becomes_markup(text: str) -> None:
    assume(text.strip() and text.isprintable())
    assert_text(text)


def assert_text(text: str) -> None:
    """The page with this text in the title, the notes and the warnings has the tags of the usual page, and the text."""
    record = STUDY.records[0]
    noted = replace(
        record,
        verification=replace(record.verification, note=text, ngspice_checked=False),
        fit=replace(record.fit, warnings=(text,)),
    )
    plain = replace(noted, verification=replace(noted.verification, note="x"), fit=replace(noted.fit, warnings=("x",)))
    changed = replace(STUDY, design=replace(STUDY.design, name=text), version=text, records=(noted,))
    usual = replace(STUDY, design=replace(STUDY.design, name="x"), version="x", records=(plain,))
    tags = re.compile(r"<[a-z/][^>]*>")
    assert tags.findall(page(changed, {})) == tags.findall(page(usual, {}))
    assert escape(text) in page(changed, {})


def test_a_name_that_a_template_misspells_is_an_error() -> None:
    with pytest.raises(UndefinedError):
        render("network.html", head=[], rows=[])


def test_the_wheel_holds_the_templates(tmp_path: Path) -> None:
    """An installed package has them too."""
    source = Path(circuittex.__file__).parent.parent
    project = tomllib.loads((source / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = project["tool"]["setuptools"]["package-data"]["circuittex"]
    held = {path for pattern in patterns for path in (source / "circuittex").glob(pattern)}
    assert {*(source / "circuittex").rglob("templates/*")} <= held
