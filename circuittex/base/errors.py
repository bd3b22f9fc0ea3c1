"""The errors circuittex raises on purpose, each with a message meant for its user."""

from __future__ import annotations

from typing import Any


class CircuittexError(Exception):
    """Base of every error that circuittex raises on purpose."""


class CircuittexWarning(UserWarning):
    """What a user should know although the work goes on, such as a protection that the file system does not give."""


class DesignError(CircuittexError, ValueError):
    """A design (or an argument) that cannot be used: names the field, the value and what is allowed."""

    def __init__(self, field: str, value: object, allowed: str) -> None:
        self.field, self.value, self.allowed = field, value, allowed
        super().__init__(f"{field}: {value!r} is not usable; {allowed}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.field, self.value, self.allowed)


class ConvergenceError(CircuittexError, RuntimeError):
    """An equilibrium that was not reached; `history` holds one row per iteration."""

    def __init__(self, message: str, history: Any = ()) -> None:
        self.history = history
        super().__init__(message)


class CreepingError(ConvergenceError):
    """A descent whose steps are so short that it would hardly arrive; `q` is where it has come to."""

    def __init__(self, message: str, history: Any, q: Any) -> None:
        super().__init__(message, history)
        self.q = q

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.history, self.q)


class PenetrationError(ConvergenceError):
    """Fibrils that contact does not keep apart: through one another, or too deep for its law to mean anything."""


class SizeError(CircuittexError, RuntimeError):
    """A design that is too large for this machine; on another one it need not be."""


class CircuitError(CircuittexError, ValueError):
    """A circuit that has no unique solution or cannot be written."""


class NgspiceError(CircuittexError, RuntimeError):
    """ngspice is missing, failed, hung, or answered something that cannot be trusted."""


class NgspiceUnavailableError(NgspiceError):
    """There is no ngspice, or none that could answer a circuit of this size in the time allowed: it was not asked."""


class StoreError(CircuittexError, ValueError):
    """A results file that cannot be read: missing, damaged, or of another version."""


class FolderError(CircuittexError, RuntimeError):
    """A results folder that cannot be used as it is: in use by another run, or with results of something else."""


class WorkerError(CircuittexError, RuntimeError):
    """A worker process that died."""
