"""The scripts of examples/: each runs in seconds, prints a few numbers and draws a picture."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parent.parent / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
SECONDS = 120
"""On a loaded machine, compilation included; alone they take two to five seconds."""
DRAWS = """
import runpy, sys
import matplotlib
matplotlib.use("agg")
names = runpy.run_path(sys.argv[1], run_name="__main__")  # figures that functions return are held by these names
import matplotlib.pyplot as plt
from matplotlib.figure import Figure
import gc
figures = {id(each): each for each in gc.get_objects() if isinstance(each, Figure) and each.axes}
drawn = [*map(plt.figure, plt.get_fignums()), *figures.values()]
assert drawn, "no picture"
drawn[0].savefig("picture.png", dpi=60)
"""


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_script_prints_numbers_and_draws_a_picture(script: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", DRAWS, str(script)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONWARNINGS": "error"},
        capture_output=True,
        text=True,
        timeout=SECONDS,
    )
    assert done.returncode == 0, done.stderr
    assert any(character.isdigit() for character in done.stdout), "it prints a few numbers"
    assert (tmp_path / "picture.png").stat().st_size > 1000


def test_scripts_use_the_public_interface_alone() -> None:
    """They read like prose through `ct.`: an import from inside the package is a gap in the interface."""
    for script in SCRIPTS:
        text = script.read_text(encoding="utf-8")
        assert "from circuittex" not in text, script.name
        assert text.startswith('"""\n'), f"{script.name}: the gallery takes its title from the docstring"
