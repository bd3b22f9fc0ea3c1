"""The scripts of examples/: each runs in seconds, prints a few numbers and draws a picture."""

from __future__ import annotations

import gc
import os
import runpy
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from canned import undrawn
from matplotlib.figure import Figure

EXAMPLES = Path(__file__).parent.parent / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
SECONDS = 120
"""For a process of its own on a loaded machine, compilation included; alone it takes some seconds."""
SMALLER = {
    "circuit_as_graph": {"yarns=2)": "yarns=2, rows=(2,))"},
    "ensemble_in_pandas": {"members=4": "members=2"},
    "own_loading_path": {"rows=(1, 2)": "rows=(1,)"},
}
"""What takes long in a script, and what is enough to see that it works."""


def copied(script: Path, folder: Path) -> Path:
    """The script in `folder`, made smaller."""
    text = script.read_text(encoding="utf-8")
    for original, replacement in SMALLER.get(script.stem, {}).items():
        assert text.count(original) == 1
        text = text.replace(original, replacement)
    (folder / script.name).write_text(text, encoding="utf-8")
    return folder / script.name


def run_here(script: Path) -> None:
    """Run the script in this process, as the gallery does, and save its first picture."""
    before = [each for each in gc.get_objects() if isinstance(each, Figure)]
    known = {id(each) for each in before}
    with mpl.rc_context():
        names = runpy.run_path(str(script), run_name="__main__")  # figures that functions return are held by these
        new = {id(each): each for each in gc.get_objects() if isinstance(each, Figure) and each.axes}
        drawn = [*map(plt.figure, plt.get_fignums()), *(new[number] for number in new.keys() - known)]
        assert drawn, f"no picture among {sorted(names)}"
        drawn[0].savefig("picture.png", dpi=60)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_script_prints_numbers_and_draws_a_picture(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A process of its own only where Dask's import the script that started them."""
    monkeypatch.chdir(tmp_path)
    undrawn(monkeypatch)
    copy = copied(script, tmp_path)
    if "run_ensemble" in copy.read_text(encoding="utf-8"):
        command = [sys.executable, "-c", f"from {__name__} import run_here; run_here({str(copy)!r})"]
        path = os.pathsep.join(sys.path)
        environment = {**os.environ, "PYTHONWARNINGS": "error", "PYTHONPATH": path}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=SECONDS)
        assert done.returncode == 0, done.stderr
        printed = done.stdout
    else:
        plt.close("all")
        run_here(copy)
        plt.close("all")
        printed = capsys.readouterr().out
    assert any(character.isdigit() for character in printed), "it prints a few numbers"
    assert (tmp_path / "picture.png").stat().st_size > 1000


def test_scripts_use_the_public_interface_alone() -> None:
    """They read like prose through `ct.`: an import from inside the package is a gap in the interface."""
    for script in SCRIPTS:
        text = script.read_text(encoding="utf-8")
        assert "from circuittex" not in text, script.name
        assert text.startswith('"""\n'), f"{script.name}: the gallery takes its title from the docstring"
