"""Exit codes of the command line, each with one meaning."""

from __future__ import annotations

from enum import IntEnum

from circuittex.base.errors import (
    CircuitError,
    CircuittexError,
    ConvergenceError,
    DesignError,
    FolderError,
    NgspiceError,
    NgspiceUnavailableError,
    SizeError,
    StoreError,
    WorkerError,
)


class ExitCode(IntEnum):
    """What the exit code of `circuittex` says."""

    DONE = 0
    INTERNAL = 1
    USAGE = 2
    DESIGN = 3
    NO_EQUILIBRIUM = 4
    DISAGREE = 5
    PARTLY = 6
    FILES = 7
    NOT_CHECKED = 8
    SIMULATOR = 9
    INTERRUPTED = 130
    BROKEN_PIPE = 141


MEANINGS: dict[ExitCode, str] = {
    ExitCode.DONE: "done; what was checked agrees",
    ExitCode.INTERNAL: "an error in circuittex itself: please report it",
    ExitCode.USAGE: "the command line was not understood",
    ExitCode.DESIGN: "the design or an argument cannot be used",
    ExitCode.NO_EQUILIBRIUM: "no equilibrium was found, or none that can be right; nothing was recorded",
    ExitCode.DISAGREE: "the routes to the currents disagree: do not trust the results",
    ExitCode.PARTLY: "some states or members failed; the others are kept",
    ExitCode.FILES: "a folder, a file or a worker process cannot be used",
    ExitCode.NOT_CHECKED: "'verify': ngspice was not asked: none is there, the circuit is too large, or no probe",
    ExitCode.SIMULATOR: "ngspice is there but failed on a state",
    ExitCode.INTERRUPTED: "interrupted (Ctrl-C)",
    ExitCode.BROKEN_PIPE: "the reader of the output has gone",
}
"""Every code in words, for the help and the documentation."""


OF_ERRORS: tuple[tuple[type[CircuittexError | OSError], ExitCode], ...] = (
    (DesignError, ExitCode.DESIGN),
    (SizeError, ExitCode.DESIGN),
    (CircuitError, ExitCode.DESIGN),
    (ConvergenceError, ExitCode.NO_EQUILIBRIUM),
    (NgspiceUnavailableError, ExitCode.NOT_CHECKED),
    (NgspiceError, ExitCode.SIMULATOR),
    (StoreError, ExitCode.FILES),
    (FolderError, ExitCode.FILES),
    (WorkerError, ExitCode.FILES),
    (OSError, ExitCode.FILES),
)
"""The code of every error that ends a command, and of those derived from it; the first that fits."""


def code_of(error: CircuittexError | OSError) -> ExitCode:
    """The exit code of an error that ended a command.

    >>> code_of(DesignError("weave.pitch", -1.0, "it must be > 0 mm")).name
    'DESIGN'
    """
    return next((code for kind, code in OF_ERRORS if isinstance(error, kind)), ExitCode.INTERNAL)


def table() -> str:
    """The codes, a line each.

    >>> table().splitlines()[0]
    '  0  done; what was checked agrees'
    """
    return "\n".join(f"{code:>3}  {meaning}" for code, meaning in MEANINGS.items())
