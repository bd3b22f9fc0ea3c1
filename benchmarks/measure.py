"""Timing that stands other work on the machine, and what the results are kept in.

Pieces run in turn, and only ratios of neighbours are compared. Every script makes `Table`s, prints them, and with
`--json FILE` keeps them together with its command, the date and the machine for `table.py`.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

Seconds = NDArray[np.float64]


@dataclass(frozen=True)
class Table:
    """A table of results and the line above it."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[object]] = field(default_factory=list)

    def text(self) -> str:
        """As Markdown."""
        return f"{self.title}\n\n{markdown(self.head, self.rows)}"


def arguments(doc: str | None) -> argparse.ArgumentParser:
    """A parser of a script's options with the one that all have."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, metavar="FILE", help="keep the tables in this file for table.py")
    return parser


def publish(options: argparse.Namespace, tables: Iterable[Table]) -> None:
    """Print tables as they come, and keep them where `--json` asks for it."""
    print(machine(), flush=True)
    kept = []
    for table in tables:
        print(f"\n{table.text()}", flush=True)
        kept.append({"title": table.title, "head": list(table.head), "rows": [list(row) for row in table.rows]})
    if options.json is not None:
        said = sys.argv[1:]
        without = [word for k, word in enumerate(said) if "--json" not in (word, *said[max(0, k - 1) : k])]
        command = " ".join(["python", f"benchmarks/{Path(sys.argv[0]).name}", *without])
        result = {"command": command, "date": date.today().isoformat(), "machine": machine(), "tables": kept}
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(result, indent=1, default=float) + "\n")


def fail(message: str) -> NoReturn:
    """End a script with one line."""
    sys.exit(f"error: {message}")


def seconds_of(piece: Callable[[], object]) -> float:
    """Seconds that one call takes."""
    clock = time.perf_counter()
    piece()
    return time.perf_counter() - clock


def paired(pieces: Mapping[str, Callable[[], object]], repeats: int, *, warm_up: bool = True) -> dict[str, Seconds]:
    """Seconds (repeats,) that each piece takes, by default after one call that is not counted.

    The pieces run in turn, so that what else the machine does meets all alike.
    """
    if warm_up:
        for piece in pieces.values():
            piece()
    seconds = {name: np.empty(repeats) for name in pieces}
    for k in range(repeats):
        for name, piece in pieces.items():
            seconds[name][k] = seconds_of(piece)
    return seconds


def ratio(of: Seconds, to: Seconds) -> float:
    """Median of the quotients of neighbouring measurements."""
    return float(np.median(of / to))


def markdown(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; floats with three digits."""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for row in rows:
        cells = (digits(cell) if isinstance(cell, float) else str(cell) for cell in row)
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def digits(value: float) -> str:
    """Three digits, without an exponent where a person would not use one.

    >>> digits(1234.5), digits(1.23456), digits(0.012345), digits(1.2345e-12)
    ('1234', '1.23', '0.0123', '1.23e-12')
    """
    return f"{value:.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.3g}"


def machine() -> str:
    """What the numbers were measured on."""
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{os.cpu_count()} cores ({processor()}){load}, Python {platform.python_version()}"


def processor() -> str:
    """The processor's name, or at least its architecture."""
    table = Path("/proc/cpuinfo")
    lines = table.read_text().splitlines() if table.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0]}, {platform.machine()}" if names else platform.machine()
