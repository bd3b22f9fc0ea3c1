"""What a comparison with measurements is made of, and how it is written down.

Inputs come with where they are from, before any result; no input may be one that was fitted to what is compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

CLOSE = 1e-9
"""Bands that meet within this agree."""


@dataclass(frozen=True)
class Source:
    """Where a number is from."""

    name: str
    text: str
    url: str = ""

    def line(self) -> str:
        return f"{self.text} <{self.url}>" if self.url else self.text


@dataclass(frozen=True)
class Input:
    """A number that a comparison starts from: from a source, or assumed, with the reason."""

    what: str
    value: str
    source: Source | None
    assumed: str = ""

    def row(self) -> str:
        return f"| {self.what} | {self.value} | {self.source.name if self.source else 'assumed: ' + self.assumed} |"


@dataclass(frozen=True)
class Band:
    """From the least to the most that a number may be."""

    low: float
    high: float

    def text(self) -> str:
        low, high = (f"{value:.3g}" for value in (self.low, self.high))
        if self.high == inf:
            return f"{low} or more"
        return low if low == high else f"{low} to {high}"


@dataclass(frozen=True)
class Point:
    """One number, measured and computed."""

    what: str
    measured: Band
    computed: Band

    @property
    def factor(self) -> float:
        """Computed over measured, by which the bands miss one another: 1 where they meet; above 1 too large."""
        if self.computed.low > self.measured.high * (1 + CLOSE):
            return self.computed.low / self.measured.high
        if self.computed.high < self.measured.low * (1 - CLOSE):
            return self.computed.high / self.measured.low
        return 1.0

    def row(self) -> str:
        verdict = "agrees" if self.factor == 1.0 else f"**missed** by {self.factor:.3g}"
        return f"| {self.what} | {self.measured.text()} | {self.computed.text()} | {verdict} |"


@dataclass(frozen=True)
class Comparison:
    """One quantity of one measurement."""

    title: str
    measured: str
    """What was measured, how, by whom."""
    sources: Sequence[Source]
    inputs: Sequence[Input]
    computed: str
    """What is computed from the inputs, how, and what makes its band."""
    unit: str
    points: Sequence[Point]
    meaning: str
    """What the outcome says."""

    def __post_init__(self) -> None:
        known = {source.name for source in self.sources}
        for each in self.inputs:
            if each.source is None and not each.assumed:
                raise ValueError(f"{self.title}: {each.what} has neither a source nor a reason to be assumed")
            if each.source is not None and each.source.name not in known:
                raise ValueError(f"{self.title}: the source of {each.what} is not among those of the comparison")

    @property
    def hits(self) -> int:
        return sum(point.factor == 1.0 for point in self.points)

    def text(self) -> str:
        """As a section in Markdown."""
        lines = [f"## {self.title}", "", f"**Measured.** {self.measured}", "", "**Inputs.**", ""]
        lines += ["| | | from |", "|---|---|---|", *(each.row() for each in self.inputs), ""]
        lines += [f"* {source.name}: {source.line()}" for source in self.sources]
        lines += [
            "",
            f"**Computed.** {self.computed}",
            "",
            f"| {self.unit} | measured | computed | |",
            "|---|---|---|---|",
        ]
        lines += [point.row() for point in self.points]
        lines += ["", f"{self.hits} of {len(self.points)} agree. {self.meaning}", ""]
        return "\n".join(lines)
