"""Compares what a simulator answered with the expected values of a kit, and says where it departs first.

    python compare.py small/expected.csv ANSWER [--tolerance 1e-9] [--partial]

ANSWER is a raw file (ASCII or binary) as SPICE writes it, a table of name and value, one a line, with a comma or
blanks between them, or a table with a line of names (which begins with '#' or 'Index') above a line of values. Names
are nodes, v(node), i(source) or source#branch. It ends with 0 where all values agree, 1 where one departs or is
missing, and 2 where the answer cannot be read. This file needs Python alone and runs as it stands.
"""

from __future__ import annotations

import argparse
import csv
import re
import struct
from collections.abc import Sequence
from pathlib import Path

ROUNDING = 1e-3
"""Of the tolerance, times the largest voltage or current: what rounding may add to a value that is almost zero."""
SUFFIX = {"meg": 1e6, "t": 1e12, "g": 1e9, "k": 1e3, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15, "": 1.0}


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare as the command line says; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("expected", type=Path, help="the file expected.csv of a circuit of the kit")
    parser.add_argument("answer", type=Path, help="raw file or table of another simulator")
    parser.add_argument("--tolerance", type=float, default=1e-9, help="relative difference allowed (default 1e-9)")
    parser.add_argument("--partial", action="store_true", help="values that the answer lacks are no departure")
    options = parser.parse_args(arguments)
    try:
        expected = read_table(options.expected.read_text(encoding="ascii"))
        found = read_answer(options.answer.read_bytes())
    except (OSError, ValueError) as error:
        print(f"cannot be read: {error}")
        return 2
    departures, compared = compare(expected, found, options.tolerance, partial=options.partial)
    if departures:
        print(f"departs first at {departures[0]}")
        print(f"{len(departures)} of {len(expected)} values depart")
        return 1
    if not compared:
        print("cannot be read: the answer has none of the expected names")
        return 2
    print(f"all {compared} values agree within {options.tolerance:g}")
    return 0


def compare(
    expected: dict[str, float], found: dict[str, float], tolerance: float, *, partial: bool = False
) -> tuple[list[str], int]:
    """Return what departs, in the order of what is expected, and how many values were compared.

    >>> compare({"v(a)": 1.0, "v(b)": 0.5}, {"v(a)": 1.0, "v(b)": 0.50000001}, 1e-9)
    (['v(b): expected 0.5, found 0.50000001'], 2)
    """
    size = {kind: max((abs(v) for n, v in expected.items() if n[0] == kind), default=0.0) for kind in "vi"}
    departures, compared = [], 0
    for name, value in expected.items():
        if name not in found:
            if not partial:
                departures.append(f"{name}: expected {value!r}, found nothing")
            continue
        compared += 1
        if not abs(found[name] - value) <= tolerance * (abs(value) + ROUNDING * size[name[0]]):
            departures.append(f"{name}: expected {value!r}, found {found[name]!r}")
    return departures, compared


def read_answer(data: bytes) -> dict[str, float]:
    """Return the values of a raw file or a table by their names.

    >>> read_answer(b"Title: t" + bytes([10]) + b"a 1.0")
    {'v(a)': 1.0}
    """
    for mark in (b"Binary:\n", b"Values:\n", b"Binary:\r\n", b"Values:\r\n"):
        head, found, rest = data.partition(mark)
        if found and b"\nVariables:" in head:
            return _read_raw(head.decode("utf-8", "replace"), rest, binary=mark.startswith(b"Binary"))
    return read_table(data.decode("utf-8", "replace"))


def _read_raw(head: str, rest: bytes, *, binary: bool) -> dict[str, float]:
    fields, _, table = head.partition("\nVariables:")
    if "flags: real" not in fields.lower():
        raise ValueError("the raw file does not hold real values")
    names = [row.split()[1] for row in table.splitlines() if len(row.split()) >= 3]
    if binary:
        if len(rest) < 8 * len(names):
            raise ValueError("the raw file is cut short")
        values = list(struct.unpack(f"<{len(names)}d", rest[: 8 * len(names)]))
    else:
        values = [float(word) for word in rest.split()[1 : 1 + len(names)]]
        if len(values) < len(names):
            raise ValueError("the raw file is cut short")
    return {_name(name): value for name, value in zip(names, values, strict=True)}


def read_table(text: str) -> dict[str, float]:
    """Return the values of a table by their names; lines that are no name and value are passed over.

    >>> read_table("name,value"), read_table("A 1e-3"), read_table("V1#branch, -2")
    ({}, {'v(a)': 0.001}, {'i(v1)': -2.0})
    """
    values: dict[str, float] = {}
    names: list[str] = []
    for line in text.splitlines():
        words = next(csv.reader([line])) if "," in line else line.split()
        words = [word.strip() for word in words]
        numbers = [_number(word) for word in words]
        if words[:1] and words[0].lower() in ("#", "index"):
            names = words
        elif names and len(words) == len(names) and None not in numbers:
            values |= {_name(n): v for n, v in zip(names[1:], numbers[1:], strict=True) if v is not None}
        elif len(words) == 2 and numbers[1] is not None:
            values[_name(words[0])] = numbers[1]
    return values


def _number(word: str) -> float | None:
    """The value of a number, which may have a suffix of SPICE."""
    found = re.fullmatch(r"([-+]?[0-9.]+(?:e[-+]?[0-9]+)?|[-+]?nan|[-+]?inf)(meg|[tgkmunpf]?)", word.lower())
    try:
        return float(found[1]) * SUFFIX[found[2]] if found else None
    except ValueError:
        return None


def _name(word: str) -> str:
    """The name of a value, 'v(node)' or 'i(source)' in lower case."""
    word = word.lower()
    if word.endswith("#branch"):
        return f"i({word.removesuffix('#branch')})"
    return word if word.startswith(("v(", "i(")) and word.endswith(")") else f"v({word})"


if __name__ == "__main__":
    raise SystemExit(main())
