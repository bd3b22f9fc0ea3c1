"""Names that every SPICE dialect reads as one word, whatever text they came from."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Iterable

_SAFE = re.compile(r"[a-z][a-z0-9_]*")
_UNSAFE_RUN = re.compile(r"[^a-z0-9]+")
# Ground has several names, and a node called like one of these would silently be grounded; the others are quantities in
# the expressions of sources.
_RESERVED = frozenset({"gnd", "ground", "temp", "temper", "time", "hertz"})
# PySpice and some simulators have line buffers: nobody needs longer words.
_LONGEST = 80
# What stands for the text that a long word leaves out: enough digits that no two texts of a design share them.
_DIGITS = 12


def safe_name(text: str) -> str:
    """Return `text` as a word of lower-case ASCII letters, digits and underscores that starts with a letter.

    A last '-' or '+' names a yarn end and is spelt out; every other run of odd characters becomes one underscore.
    A word of more than 80 characters is cut, and ends in a hash of all of them: long names that differ stay different.

    >>> safe_name("warp2-"), safe_name("Weft 1\\n.end;$*"), safe_name("2"), safe_name("gnd")
    ('warp2_minus', 'weft_1_end', 'n_2', 'n_gnd')
    """
    if _SAFE.fullmatch(text) and text not in _RESERVED and len(text) <= _LONGEST:
        return text
    word = text.lower()
    if word.endswith(("-", "+")):
        word = f"{word[:-1]}_{'minus' if word[-1] == '-' else 'plus'}"
    word = _UNSAFE_RUN.sub("_", word).strip("_")
    if not word or not word[0].isalpha() or word in _RESERVED:
        word = f"n_{word}".rstrip("_")
    if len(word) <= _LONGEST:
        return word
    digest = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:_DIGITS]
    return f"{word[: _LONGEST - _DIGITS - 1].rstrip('_')}_{digest}"


def unique_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return the safe form of each name, a repeated one with the first free number behind it.

    The result depends on the names and their order alone, and safe names that do not repeat come back unchanged.

    >>> unique_names(["a", "A", "a_2", "b"])
    ('a', 'a_3', 'a_2', 'b')
    """
    words = list(names)
    short = max(map(len, words), default=0) <= _LONGEST
    if not (short and _RESERVED.isdisjoint(words) and all(map(_SAFE.fullmatch, words))):
        words = [safe_name(word) for word in words]
    count = Counter(words)
    if len(count) == len(words):
        return tuple(words)
    taken = set(count)
    next_number: dict[str, int] = {}
    for i, word in enumerate(words):
        if count[word] == 1:
            continue
        if word not in next_number:
            next_number[word] = 2
            continue
        number = next_number[word]
        while f"{word}_{number}" in taken:
            number += 1
        next_number[word] = number + 1
        words[i] = f"{word}_{number}"
        taken.add(words[i])
    return tuple(words)
