"""What the fields of a dataclass mean, and in which unit: read from the text below each field."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Hashable
from functools import cache

UNITS = (
    *("N mm", "N/mm2", "N/mm", "N", "MPa", "mm2", "mm3", "mm", "g/mm3", "S/mm2", "S/mm", "S", "W/(mm2 K)"),
    *("W/(mm K)", "W/K", "W", "V per volt", "V per V", "V", "A", "K", "ohm", "s"),
)
"""Units that the texts name, a longer one before those that it begins with."""
_UNIT = re.compile(r"(?:,|\)|\bin|\bof) (" + "|".join(map(re.escape, UNITS)) + r")(?=[\s.,;:)\[]|$)")
PLAIN = "1"
"""The unit of what is a pure number or a count."""


def meanings(kind: type) -> dict[str, str]:
    """Field -> the first sentence of the text below it, of a dataclass and of those that it extends.

    Empty where the source is not at hand, in an installation of compiled files alone.

    >>> from circuittex.contact.state import ContactState
    >>> meanings(ContactState)["line_load"]
    '(C,) p = P* o [28], N/mm.'
    """
    return _meanings(kind)


@cache
def _meanings(kind: Hashable) -> dict[str, str]:
    found: dict[str, str] = {}
    assert isinstance(kind, type)
    for base in reversed(kind.__mro__[:-1]):
        try:
            (tree,) = ast.parse(inspect.cleandoc(inspect.getsource(base))).body
        except (OSError, TypeError, SyntaxError, ValueError):
            continue
        assert isinstance(tree, ast.ClassDef)
        for field, text in zip(tree.body, tree.body[1:], strict=False):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and _is_text(text):
                found[field.target.id] = _sentence(ast.literal_eval(text.value))  # type: ignore[attr-defined]
    return found


def unit(meaning: str) -> str:
    """The unit that a text names first, '1' where it names none.

    >>> unit("(C,) p = P* o [28], N/mm."), unit("(C,) fibril that carries the quadrature point.")
    ('N/mm', '1')
    """
    found = _UNIT.search(meaning)
    return found[1] if found else PLAIN


def summary(kind: type) -> str:
    """The first sentence of a dataclass's own text."""
    return _sentence(inspect.getdoc(kind) or kind.__name__)


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _sentence(text: str) -> str:
    words = " ".join(text.split())
    return re.split(r"(?<=[.:;]) (?=[A-Z])", words)[0]
