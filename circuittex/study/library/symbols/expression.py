"""S-expressions, in which KiCad keeps its files: no text can change their structure."""

from __future__ import annotations

from collections.abc import Sequence


class Text(str):
    """A quoted string; a plain `str` is a bare word of the format."""

    __slots__ = ()


def one_line(text: str) -> str:
    r"""Return `text` on one line, without characters that cannot be printed.

    >>> one_line(" a\n(b)\t\0 ")
    'a (b) ?'
    """
    return "".join(letter if letter.isprintable() else "?" for letter in " ".join(text.split()))


def quoted(text: str) -> str:
    r"""Return `text` on one line in quotes, in the way of KiCad.

    >>> print(quoted('a "b" \\'))
    "a \"b\" \\"
    """
    escaped = one_line(text).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def write(expression: object, indent: int = 0) -> str:
    """The text of nested lists: one line where nothing but words is inside, else a line for each inner list.

    >>> print(write(["a", ["at", 0, 2.54], [Text("b"), 1]]))
    (a
      (at 0 2.54)
      ("b" 1))
    """
    if isinstance(expression, Text):
        return quoted(expression)
    if isinstance(expression, str):
        return expression
    if isinstance(expression, int | float):
        return f"{expression:.10g}"
    assert isinstance(expression, Sequence)
    parts = [write(part, indent + 2) for part in expression]
    inner = [isinstance(part, Sequence) and not isinstance(part, str) for part in expression]
    space = "\n" + " " * (indent + 2)
    text = "".join(
        (space if is_inner else " " if k else "") + part
        for k, (part, is_inner) in enumerate(zip(parts, inner, strict=True))
    )
    return f"({text})"
