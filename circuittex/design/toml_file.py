"""Tables from a TOML file, with complaints that name the file and the line."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib.resources.abc import Traversable
from os import PathLike
from pathlib import Path

from circuittex.base.errors import DesignError
from circuittex.design.checks import refuse

_LARGEST_FILE = 10_000_000  # bytes; a draft of a thousand by a thousand yarns takes a third of it


def read_toml(path: str | PathLike[str] | Traversable, what: str) -> Mapping[str, object]:
    """The tables of a TOML file; errors call it `what`.

    Raises `DesignError` for a file that cannot be read or is not TOML.
    """
    where = str(path)
    try:
        with (path if isinstance(path, Traversable) else Path(path)).open("rb") as file:
            data = file.read(_LARGEST_FILE + 1)
        text = data.decode("utf-8-sig")
    except FileNotFoundError:
        raise refuse(what, where, "there is no such file") from None
    except IsADirectoryError:
        raise refuse(what, where, "it must be a TOML file, this is a directory") from None
    except UnicodeDecodeError as error:
        raise refuse(what, where, f"it must be text in UTF-8; byte {error.start} is not") from None
    except (OSError, ValueError) as error:
        raise refuse(what, where, f"it cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(data) > _LARGEST_FILE:
        raise refuse(what, where, f"a {what} has at most {_LARGEST_FILE} bytes")
    return _toml(text, what)


def _toml(text: str, what: str) -> Mapping[str, object]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(text, str(error)) from None
    except RecursionError:
        raise refuse(what, "TOML", "it is nested too deeply") from None
    except ValueError as error:  # a whole number of thousands of digits, for example
        raise refuse(what, "TOML", f"it cannot be read: {error}") from None


def _syntax_error(text: str, message: str) -> DesignError:
    """The parser's complaint with the line it is about: "... (at line 3, column 7)"."""
    number = message.partition("(at line ")[2].partition(",")[0]
    lines = text.splitlines()
    line = lines[int(number) - 1] if number.isdigit() and int(number) <= len(lines) else (lines or [""])[-1]
    return refuse(f"TOML, line {number or len(lines)}", line.strip(), f"it is not valid TOML: {message}")
