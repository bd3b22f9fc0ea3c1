"""The cards of a deck of others: lines joined, comments cut, and the files it includes read, from its folder only."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from circuittex.base.errors import CircuitError
from circuittex.base.expression import DEEPEST

MOST_FILES = 1000
"""Files that a deck may include, one that is included again counted again."""
MOST_BYTES = 500_000_000
"""Bytes of all these files."""

_COMMENT = re.compile(r";.*|(?:^|(?<=[\s,]))\$(?=\s|$).*")
_DOLLAR = re.compile(r"(?:^|[\s,])\$")
_INCLUDE = re.compile(r"""\.(?:include|inc|lib)\s+(?:"([^"]*)"|'([^']*)'|(\S+))\s*""", re.IGNORECASE)
_INCLUDES = (".include", ".inc", ".lib")


@dataclass(frozen=True)
class Card:
    """One logical line."""

    file: str
    """Name of its file, as the deck calls it."""
    line: int
    """Number of its first line there, from 1."""
    text: str
    """What it says in lower case, without comments."""

    def refused(self, why: str) -> CircuitError:
        """The error that says where and why it cannot be read."""
        shown = self.text if len(self.text) <= 60 else f"{self.text[:60]}..."
        return CircuitError(f"{self.file}, line {self.line}: {shown!r} cannot be read: {why}")


def read_cards(path: Path) -> list[Card]:
    """Return the cards of the deck at `path` and of what it includes, up to `.end`; its first line is its title.

    Raises `CircuitError` for a file that cannot be read, and for an include that leads out of the deck's folder,
    to itself, or too deep.
    """
    return list(_Files(path.parent.resolve()).of(path))


class _Files:
    """Reads a deck and its includes, and remembers how much it has read."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files = 0
        self.bytes = 0

    def of(self, path: Path) -> Iterator[Card]:
        """The cards of the deck itself."""
        yield from self._cards(path, path.name, (path.resolve(),), title=True)

    def _cards(self, path: Path, name: str, open_files: tuple[Path, ...], *, title: bool) -> Iterator[Card]:
        ended = False
        for card, raw in _joined(self._text(path, name), name, title=title):
            word = card.text.split(maxsplit=1)[0]
            if ended:
                raise card.refused("it comes after .end, where some simulators read on and some do not")
            if word == ".end":
                ended = True
            elif word in _INCLUDES:
                inner, inner_name = self._included(card, raw, path.parent, open_files)
                yield from self._cards(inner, inner_name, (*open_files, inner), title=False)
            else:
                yield card

    def _text(self, path: Path, name: str) -> str:
        self.files += 1
        try:
            if not path.is_file():
                raise CircuitError(f"{name}: there is no such file")
            self.bytes += path.stat().st_size
            if self.files > MOST_FILES or self.bytes > MOST_BYTES:
                raise CircuitError(
                    f"{name}: a deck may include at most {MOST_FILES} files with {MOST_BYTES} bytes in all"
                )
            return path.read_bytes().decode("utf-8", "replace")
        except OSError as error:
            raise CircuitError(f"{name}: it cannot be read ({error.strerror})") from error

    def _included(self, card: Card, raw: str, folder: Path, open_files: tuple[Path, ...]) -> tuple[Path, str]:
        """The file that an include means, and how it is called in messages."""
        found = _INCLUDE.fullmatch(raw)
        if not found:
            raise card.refused("write .include or .lib and the name of one file; sections of libraries are not read")
        wanted = found[1] or found[2] or found[3] or ""
        if wanted.startswith(("/", "\\", "~", "$")) or ":" in wanted or "\\" in wanted:
            raise card.refused(f"{wanted!r} must be a relative path with '/', inside the deck's folder")
        try:
            path = (folder / wanted).resolve()
        except (OSError, RuntimeError, ValueError):
            raise card.refused(f"{wanted!r} is no path") from None
        if not path.is_relative_to(self.folder):
            raise card.refused(f"{wanted!r} leads out of the deck's folder")
        if path in open_files:
            raise card.refused(f"{wanted!r} includes itself")
        if len(open_files) > DEEPEST:
            raise card.refused(f"includes are nested deeper than {DEEPEST}")
        if not path.is_file():
            raise card.refused(f"there is no file {wanted!r} in the deck's folder")
        return path, path.relative_to(self.folder).as_posix()


def _joined(text: str, name: str, *, title: bool) -> Iterator[tuple[Card, str]]:
    """The cards of one text, each also as it was written, with its continuation lines."""
    first, parts, commented = 0, list[str](), False
    for number, line in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), start=1):
        whole = line.strip()
        if (title and number == 1) or whole.startswith("*"):
            continue
        bare = _COMMENT.sub("", whole).strip()
        if bare.startswith("+"):
            if not parts:
                raise Card(name, number, bare.lower()).refused("there is no card before it to go on with")
            if commented:  # ngspice takes such a line for an empty card, and its value for another
                raise Card(name, number, bare.lower()).refused(
                    "between it and its card is a comment that does not begin with '*'"
                )
            parts.append(bare[1:])
        elif bare:
            if parts:
                yield _card(name, first, " ".join(parts))
            first, parts, commented = number, [bare], False
        else:
            commented = commented or bool(whole)
    if parts:
        yield _card(name, first, " ".join(parts))


def _card(name: str, number: int, raw: str) -> tuple[Card, str]:
    card = Card(name, number, raw.lower())
    if not raw.isascii() or not raw.replace("\t", " ").isprintable():
        raise card.refused("only printable ASCII may stand outside of comments")
    if _DOLLAR.search(raw):
        raise card.refused("a word that begins with '$' is a comment for some simulators and none for others")
    return card, raw.strip()
