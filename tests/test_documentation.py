"""Every command, script and netlist that the documentation shows, run as it stands there.

What they work on has the names that the documentation uses and is small: the delivered design with one fibril a yarn,
whose yarns, pins, probes and title are those of the original.
"""

from __future__ import annotations

import re
import runpy
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from canned import undrawn
from test_paper_tables import STUDY, TABLE

from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.command.options import build_parser
from circuittex.design import load_design, starter
from circuittex.electrical.spice.ngspice import run_deck
from circuittex.results.store import load_study, write_study_start
from circuittex.study.panel.circuit import ports_netlist
from circuittex.study.panel.reader import load_panel
from circuittex.study.panel.solution import solve_panel

pytestmark = pytest.mark.xdist_group("documentation")  # what its fixtures make serves one worker

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SECONDS = 120
"""For a script of its own on a loaded machine; alone it takes some seconds."""
SMALLER = {
    "rows = [3, 4, 3]": "rows = [1]",
    'amplitude = "0.525 mm"': 'amplitude = "0.2 mm"',  # at which single fibrils touch
    'strain = "10 %"': 'strain = "1 %"',
    "steps = 4": "steps = 1",
}
"""What makes the delivered design a small one."""
FEWER = {"--members 32": "--members 2", "members=32": "members=2"}
"""What a page asks for, and what is enough to see that it works."""
PROSE = {"text", "{eval-rst}", "{toctree}", "{include}"}
"""Blocks in which there is nothing to run."""


def blocks(page: Path) -> Iterator[tuple[str, str]]:
    """Language and text of each block of code: fenced ones say what they are, indented ones begin like it."""
    text = page.read_text(encoding="utf-8")
    for language, inner in re.findall(r"^```(\S+).*\n((?:.*\n)*?)```$", text, re.MULTILINE):
        yield language, inner
    unfenced = re.sub(r"^```(?:.*\n)*?```$", "", text, flags=re.MULTILINE)
    for block in re.findall(r"(?:(?<=\n\n)|\A)(?:    .*\n(?:\n(?=    ))?)+", unfenced):
        inner = re.sub("^    ", "", block, flags=re.MULTILINE)
        first = inner.split()[0]
        kinds = {"circuittex": "console", "make": "console", "python": "console", "from": "python", "import": "python"}
        yield ("spice" if inner.startswith("* ") else kinds.get(first, "text")), inner


def shown(language: str) -> list[tuple[str, str]]:
    """Name of the page and text of each block in a language."""
    return [(page.name, inner) for page in PAGES for kind, inner in blocks(page) if kind == language]


def alike(command: str) -> str:
    """The command without the names of designs and results, which are all small here."""
    return re.sub(r"results/\w+", "RESULTS", re.sub(r"(examples/)?\w+\.toml", "DESIGN", command))


COMMANDS = sorted(
    {line.partition(" # ")[0].strip() for _, inner in shown("console") for line in inner.splitlines() if line.strip()}
)
DIFFERENT = sorted({alike(command): command for command in COMMANDS if command.startswith("circuittex ")}.values())
(RUN,) = (command for command in DIFFERENT if re.fullmatch(r"circuittex run \S+ --out \S+", command))
PYTHON = [(name, inner) for name, inner in shown("python") if name != "README.md"]  # test_readme.py has that one


@pytest.fixture(scope="module")
def small() -> str:
    """The delivered design, made small."""
    text = (ROOT / "examples" / "plain_weave.toml").read_text(encoding="utf-8")
    for original, replacement in SMALLER.items():
        assert text.count(original) == 1
        text = text.replace(original, replacement)
    return f"{text}\n[numerics]\nelements = 8\n"


@pytest.fixture(scope="module")
def computed(small: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the small design, by the command that the pages show."""
    folder = tmp_path_factory.mktemp("computed")
    _, *words = shlex.split(RUN)
    (folder / words[1]).write_text(small, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(words) == ExitCode.DONE
    return folder / words[3]


@pytest.fixture(scope="module")
def original(small: str, computed: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Designs and results under the names of the documentation."""
    folder = tmp_path_factory.mktemp("original")
    (folder / "examples").mkdir()
    for name in ("weave", "examples/plain_weave", "examples/paper", "examples/paper_table"):
        (folder / f"{name}.toml").write_text(small, encoding="utf-8")
    shutil.copy(ROOT / "examples" / "heater_panel.toml", folder / "examples")
    for name in ("weave", "plain_weave"):
        shutil.copytree(computed, folder / "results" / name)
    shutil.copytree(computed, folder / "results" / "packings-ensemble" / "members" / "0000")
    for name, study in (("paper", STUDY), ("paper_table", TABLE)):  # their cell is no small one
        (folder / "results" / name).mkdir()
        write_study_start(folder / "results" / name / "results.h5", study)
    return folder


@pytest.fixture
def folder(original: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where a reader is: a copy of all that, in which a test may do what it likes."""
    shutil.copytree(original, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def fewer(text: str) -> str:
    for many, few in FEWER.items():
        text = text.replace(many, few)
    return text


def test_every_block_is_of_a_kind_that_is_run() -> None:
    """A block in another language, or one that is not recognised, needs a test of its own."""
    kinds = {kind for page in PAGES for kind, _ in blocks(page)}
    assert kinds - PROSE == {"console", "python", "toml", "spice"}
    words = [inner for page in PAGES for kind, inner in blocks(page) if kind == "text"]
    assert not any(
        re.search(r"^(circuittex|make|python|ngspice|pip|import|from) ", text, re.MULTILINE) for text in words
    )
    assert len(DIFFERENT) > 8, "the pages are found"


def test_files_that_commands_name_are_delivered() -> None:
    named = {name for command in COMMANDS for name in re.findall(r"(?:examples|benchmarks)/[\w./]+", command)}
    assert named
    assert [name for name in sorted(named) if not (ROOT / name).is_file()] == []


def test_run(computed: Path) -> None:
    """What the fixture ran."""
    for name in ("report.html", "summary.json", "results.h5", "figures", "netlists", "vtu"):
        assert (computed / name).exists()
    assert len(load_study(computed / "results.h5").records) == 2


@pytest.mark.parametrize("command", [command for command in DIFFERENT if command != RUN])
def test_command(
    command: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Pictures are those of `test_run` and of `circuittex report`."""
    before, _, file = fewer(command).partition(" > ")
    words = shlex.split(before)[1:]
    if words[0] != "report" or "--beside" in words:
        undrawn(monkeypatch)
    if words[-1] == "--help":
        with pytest.raises(SystemExit, match="0"):
            main(words)
        return
    assert main(words) == ExitCode.DONE
    out = capsys.readouterr().out
    if file:
        (folder / file).write_text(out, encoding="utf-8")
        assert load_design(folder / file).name
        assert out == starter(words[2] if words[1:2] == ["--fabric"] else "")
    if words[0] == "run":
        assert all((Path(words[3]) / name).exists() for name in ("report.html", "summary.json", "results.h5"))
        assert len(load_study(Path(words[3]) / "results.h5").records) == 2


@pytest.mark.parametrize("command", [line for line in COMMANDS if line.startswith("python ")])
def test_script(command: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A script that writes a page of the documentation writes a copy of it here."""
    _, script, *arguments = shlex.split(command)
    page = folder / "page.md"
    shutil.copy(ROOT / "docs" / "paper.md", page)
    before = page.read_text(encoding="utf-8")
    monkeypatch.setattr(sys, "argv", [script, *arguments, "--page", str(page)])
    runpy.run_path(str(ROOT / script), run_name="__main__")
    assert page.read_text(encoding="utf-8") != before


@pytest.mark.parametrize("command", [line for line in COMMANDS if line.startswith("make ")])
@pytest.mark.skipif(shutil.which("make") is None, reason="the commands are make's; pytest alone runs without it")
def test_make_knows_the_target(command: str) -> None:
    words = [*shlex.split(command), "--dry-run"]
    planned = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=SECONDS)
    assert planned.returncode == 0, planned.stderr
    assert {
        "run": "circuittex run examples/plain_weave.toml --out results/plain_weave",
        "test": "pytest",
    }[words[1]] in planned.stdout


@pytest.mark.parametrize(("page", "text"), PYTHON, ids=[name for name, _ in PYTHON])
def test_python(page: str, text: str, folder: Path) -> None:
    """As a script with a main part: Dask's processes import the file that starts them."""
    body = "".join(f"    {line}\n" if line else "\n" for line in fewer(text).splitlines())
    (folder / "script.py").write_text(f'if __name__ == "__main__":\n{body}', encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error", "script.py"], cwd=folder, capture_output=True, text=True, timeout=SECONDS
    )
    assert done.returncode == 0, f"{page}: {done.stderr}"


PANELS = [inner for name, inner in shown("toml") if name == "panel.md"]
# Whole designs are run by test_choosing.py, whole panels below; test_known_yarns.py has the page on data sheets.
ELSEWHERE = ("choosing.md", "panel.md", "data_sheet.md")
PARTS = [(page, text) for page, text in shown("toml") if page not in ELSEWHERE]


@pytest.mark.parametrize(("page", "text"), PARTS)
def test_part_of_a_design(page: str, text: str, small: str, tmp_path: Path) -> None:
    (tmp_path / "part.toml").write_text(f"{small}\n{text}", encoding="utf-8")
    design = load_design(tmp_path / "part.toml")
    if page == "library.md":
        assert [loading.name for loading in design.loading][-4:] == [
            "pull-x",
            "pull-x0-y",
            "pull-x0p05-y",
            "pull-x0p1-y",
        ]
        return
    if page == "design.md":  # a yarn that this weave does not use: that it is read is all
        return
    assert page == "ensemble.md"
    assert design.packing.lateral == pytest.approx(0.0075), "7.5 um in mm"


@pytest.mark.parametrize("text", PANELS)
def test_panel_file(text: str, computed: Path, tmp_path: Path) -> None:
    """As it stands; and with the table [results] that the page shows in place of [resistance], on a real study."""
    file = tmp_path / "panel.toml"
    file.write_text(text, encoding="utf-8")
    assert main(["panel", str(file), "--out", str(tmp_path / "out"), "--quiet"]) == ExitCode.DONE
    panel = (ROOT / "docs" / "panel.md").read_text(encoding="utf-8")
    for row in re.findall(r"^\| (`\w+\.\w+`.*?) \|", panel, re.MULTILINE):
        for name in re.findall(r"`([^`]+)`", row):
            assert (tmp_path / "out" / name.replace("A_B", "left_pad")).is_file(), name
    (results,) = re.findall(r"^\[results\]\n(?:\w.*\n)+", panel, re.MULTILINE)
    results = results.replace("results/plain_weave", computed.name)
    shutil.copytree(computed, tmp_path / computed.name, dirs_exist_ok=True)
    file.write_text(re.sub(r"\[resistance\](?:.*\n)+?\n", f"{results}\n", text), encoding="utf-8")
    assert "[results]" in file.read_text("utf-8")
    assert main(["panel", str(file), "--out", str(tmp_path / "out"), "--quiet"]) == ExitCode.DONE


def test_options_that_are_mentioned_exist() -> None:
    """`circuittex COMMAND --option` in the text, complete or not."""
    (commands,) = [action for action in build_parser()._actions if hasattr(action, "choices") and action.choices]
    options = {name: set(parser._option_string_actions) for name, parser in commands.choices.items()}  # type: ignore
    mentioned = [
        words.split() for page in PAGES for words in re.findall(r"`circuittex ([a-z][^`]*)`", page.read_text("utf-8"))
    ]
    assert len(mentioned) > 5
    for name, *words in mentioned:
        assert {word.partition("=")[0] for word in words if word.startswith("-")} <= options[name], (name, words)


# The sub-circuit of docs/netlist.md


(DECK,) = (inner for name, inner in shown("spice") if name == "netlist.md")
REDUCED = DECK.replace("relaxed.sub", "relaxed_reduced.sub").replace(" relaxed_plain", " relaxed_reduced_plain")


def current(deck: str, netlists: Path) -> float:
    """What ngspice says that the deck's source feeds in, A."""
    included = re.sub(r"(?<=^\.include )\S+", lambda name: str(netlists / name[0]), deck, flags=re.MULTILINE)
    return -float(run_deck(included).plots[0].current("v1")[0])


def test_the_sub_circuit_runs_beside_the_delivered_netlists(computed: Path) -> None:
    """1 V across one yarn of which each end is a pin, the others open.

    Alone the yarn carries sigma A V / L; what touches it only adds ways for the current (Rayleigh), here through
    contacts of 0.01 S/mm2 that are all but nothing beside a fibril.
    """
    design = load_design(ROOT / "examples" / "plain_weave.toml")  # not the small one: yarns and title must be its
    yarns = [f"{way}{n}" for way in ("warp", "weft") for n in range(1, 5)]
    assert np.shape(design.weave.draft) == (4, 4)
    card = (computed / "netlists" / "relaxed.sub").read_text("ascii").replace("\n+", "")
    _, name, *pins = re.search(r"^\.subckt .*", card, re.MULTILINE)[0].split()  # type: ignore[index]
    assert pins == [f"{yarn}_{end}" for yarn in yarns for end in ("minus", "plus")]
    call = re.search(r"^X1 .*", DECK, re.MULTILINE)[0].split()  # type: ignore[index]
    assert (call[-1], len(call) - 2) == (name, len(pins))
    assert (call[1:-1][pins.index("warp2_minus")], call[1:-1][pins.index("warp2_plus")]) == ("in", "0")

    alone = 10.0 * np.pi * 0.15**2 / (4 * 2.0)
    found = current(DECK, computed / "netlists")
    assert alone * (1 - 1e-9) <= found < 1.01 * alone
    assert current(REDUCED, computed / "netlists") == pytest.approx(found, rel=0.01)


def test_the_sensor_of_the_library_page_runs(folder: Path) -> None:
    """Beside the library that the page exports: strained by at most 1 %, which was computed, no flag is up."""
    (text,) = [inner for name, inner in shown("spice") if name == "library.md"]
    assert main(["export", "results/plain_weave", "--out", "fabric_lib"]) == ExitCode.DONE
    plot = run_deck(text.replace("fabric_lib/", f"{folder}/fabric_lib/")).plots[-1]
    strain, sense, flag = plot.voltage(["strain", "sense", "flag"]).T
    assert strain.max() == pytest.approx(0.01, rel=1e-3)
    assert (np.abs(flag) < 1e-9).all()
    assert ((sense > 0.0) & (sense < 3.3)).all()


def test_the_heating_panel_runs_behind_its_fuse(tmp_path: Path) -> None:
    """What the battery feeds in is 12 V over the fuse and the resistance that the native solution has."""
    (text,) = [inner for name, inner in shown("spice") if name == "panel.md"]
    panel, _ = load_panel(ROOT / "examples" / "heater_panel.toml")
    solution = solve_panel(panel)
    (tmp_path / "panel_ports.lib").write_text(ports_netlist(solution), encoding="ascii")
    plot = run_deck(text.replace("results/heater_panel/", f"{tmp_path}/")).plots[-1]
    ohm = 0.02 + solution.resistance[0, 1]
    assert -float(plot.current("v1")[0]) == pytest.approx(12.0 / ohm, rel=1e-6)  # ngspice's own tolerances
    assert 0.0 < float(plot.voltage(["sense"])[0, 0]) < float(plot.voltage(["left"])[0, 0]) < 12.0


def test_a_deck_runs_as_it_stands(computed: Path, tmp_path: Path) -> None:
    shutil.copy(computed / "netlists" / "relaxed_straight.cir", tmp_path / "deck.cir")
    (command,) = re.findall(r"`(ngspice [^`]*)`", (ROOT / "docs" / "netlist.md").read_text("utf-8"))
    done = subprocess.run(shlex.split(command), cwd=tmp_path, capture_output=True, text=True, timeout=SECONDS)
    assert done.returncode == 0
    assert (tmp_path / "out.raw").exists()
    assert "error" not in (done.stdout + done.stderr).lower()
