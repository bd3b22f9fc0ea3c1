"""What dataclasses and their fields mean, and in which unit: read from the texts below them, where it is stated once.

The texts are read from the source, so that they are there under ``python -OO``, too.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Hashable
from functools import cache

UNITS = (
    *("N mm", "N/mm2", "N/mm", "N", "MPa", "1/mm", "mm2", "mm3", "mm", "g/mm3", "S/mm2", "S/mm", "S", "W/(mm2 K)"),
    "W/mm2",
    *("W/(mm K)", "W/K", "W", "V per volt", "V per V", "V", "A", "1/K2", "1/K", "K/W", "K", "ohm2", "ohm", "s"),
    "`unit`",
)
"""Units that the texts name, a longer one before those that it begins with; the last is what a field `unit` says."""
PLAIN = "1"
"""The unit of what is a pure number or a count."""
_ANY = "(?:" + "|".join(map(re.escape, UNITS)) + ")"
_UNIT = re.compile(rf"(?:,|\)|\bin|\bof) ({_ANY})(?=[\s.,;:)\[]|$)")
_ANY_OR_PLAIN = f"(?:{_ANY}|{PLAIN})"
_SEVERAL = re.compile(rf"\[({_ANY_OR_PLAIN}(?:, {_ANY_OR_PLAIN})+|{PLAIN} or {_ANY})\]")


def meanings(kind: type) -> dict[str, str]:
    """Field -> the first sentence of the text below it, of a dataclass and of those that it extends.

    Empty where the source is not at hand, in an installation of compiled files alone.

    >>> from circuittex.contact.state import ContactState
    >>> meanings(ContactState)["line_load"]
    '(C,) p = P* o [28], N/mm.'
    """
    return _read(kind)[1]


def summary(kind: type) -> str:
    """The first sentence of a dataclass's own text, its name where the source is not at hand.

    >>> from circuittex.design import Electrical
    >>> summary(Electrical)
    'Choices of the electrical model.'
    """
    return _read(kind)[0]


def unit(meaning: str) -> str:
    """The unit that a text names: several in brackets for the columns of a table, else the first; '1' without any.

    >>> unit("(C,) p = P* o [28], N/mm."), unit("(C,) fibril that carries the quadrature point.")
    ('N/mm', '1')
    >>> unit("(n, 2) node distance in mm and relative error [mm, 1].")
    'mm, 1'
    """
    found = _SEVERAL.search(meaning) or _UNIT.search(meaning)
    return found[1].strip("`") if found else PLAIN


@cache
def _read(kind: Hashable) -> tuple[str, dict[str, str]]:
    assert isinstance(kind, type)
    own, found = kind.__name__, {}
    for base in reversed(kind.__mro__[:-1]):
        try:
            (tree,) = ast.parse(inspect.cleandoc(inspect.getsource(base))).body
        except (OSError, TypeError, SyntaxError, ValueError):
            continue
        assert isinstance(tree, ast.ClassDef)
        own = _sentence(ast.get_docstring(tree) or kind.__name__)
        for field, text in zip(tree.body, tree.body[1:], strict=False):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and _is_text(text):
                found[field.target.id] = _sentence(ast.literal_eval(text.value))  # type: ignore[attr-defined]
    return own, found


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _sentence(text: str) -> str:
    words = " ".join(text.split("\n\n")[0].split())
    return re.split(r"(?<=\.) (?=[A-Z])", words)[0]
