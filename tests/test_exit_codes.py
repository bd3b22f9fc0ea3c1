"""Exit codes: one for every error, one meaning for every code, and the same words wherever they are told."""

from __future__ import annotations

from pathlib import Path

from circuittex.base import errors
from circuittex.base.errors import CircuittexError
from circuittex.command.exit_codes import MEANINGS, OF_ERRORS, ExitCode, table

DOCS = Path(__file__).parent.parent / "docs"


def test_every_error_has_a_code_of_its_own_meaning() -> None:
    """None falls to a code by accident: a new class of error must be given one, or derive from one that has."""
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, CircuittexError)]
    assert len(kinds) > 5
    named = tuple(kind for kind, _ in OF_ERRORS)
    assert [kind for kind in kinds if kind is not CircuittexError and not issubclass(kind, named)] == []
    for place, (kind, _) in enumerate(OF_ERRORS):
        assert not issubclass(kind, named[:place]), f"{kind.__name__} never gets its code"


def test_every_exit_code_has_one_meaning_in_help_and_documentation() -> None:
    assert set(MEANINGS) == set(ExitCode)
    assert len({*MEANINGS.values()}) == len(MEANINGS)
    page = (DOCS / "command_line.md").read_text(encoding="utf-8")
    for code, meaning in MEANINGS.items():
        assert f"| {code:d} | {meaning} |" in page
        assert f"{code:>3}  {meaning}" in table()
