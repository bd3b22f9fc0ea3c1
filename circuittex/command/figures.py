"""Figures without what the environment has for matplotlib: no display, no backend, no home."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from circuittex.base.private import private_folder, writable


def plain_figures() -> None:
    """Have matplotlib, which nobody has loaded yet, draw into files and keep its list of fonts where it can.

    The backend of a notebook may not be installed where its environment is inherited, and without a folder of its own
    matplotlib looks for all fonts anew in every process, and says so.
    """
    os.environ["MPLBACKEND"] = "agg"
    if "MPLCONFIGDIR" in os.environ or all(map(writable, _usual_folders())):
        return
    folder = private_folder()
    if folder is not None:
        os.environ["MPLCONFIGDIR"] = str(folder / "matplotlib")


def _usual_folders() -> list[Path]:
    """Where matplotlib keeps its settings and its list of fonts."""
    home = Path(os.path.expanduser("~"))  # noqa: PTH111 - Path.home() raises where a user has none
    if not sys.platform.startswith(("linux", "freebsd")):
        return [home / ".matplotlib"]
    places = (("XDG_CONFIG_HOME", ".config"), ("XDG_CACHE_HOME", ".cache"))
    return [Path(os.environ.get(variable) or home / usual, "matplotlib") for variable, usual in places]
