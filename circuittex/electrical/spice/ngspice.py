"""Runs decks in ngspice and reads its binary raw files, judging by what happened and not by the exit status."""

from __future__ import annotations

import contextlib
import errno
import math
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import NgspiceError, NgspiceUnavailableError
from circuittex.base.frozen import frozen

VARIABLE = "CIRCUITTEX_NGSPICE"
"""Environment variable that names the ngspice to use, before PATH; set but empty it means none."""

TROUBLE = re.compile(
    r"singular matrix|gmin step|source stepping|\berror\b|fatal|abort|interrupted|doanalyses|failed|not parsed|"
    r"no circuit loaded|not available",
    re.IGNORECASE,
)
"""What ngspice says only where its answer must not be used; a sound circuit of resistors makes it say none."""

LOG_CHARACTERS = 100_000

ROOM = 1_000_000
"""Bytes: where less is free for ngspice's files, its failure is the disk's."""


@frozen
class Plot:
    """One plot of a raw file: the result of one analysis."""

    name: str
    """For example 'Operating Point'."""
    variables: tuple[str, ...]
    """(n,) in lower case: 'v(node)' for voltages, 'i(source)' for source currents."""
    values: Floats
    """(points, n) in V, A, or the unit of the sweep."""

    @property
    def sweep(self) -> Floats:
        """(points,) of what goes from point to point: time, s, or the value of a swept source, V or A."""
        return np.asarray(self.values[:, 0])

    def voltage(self, nodes: Sequence[str]) -> Floats:
        """(points, len(nodes)) voltage of the named nodes, V; node '0' is ground.

        Raises NgspiceError where a node is not in the plot.
        """
        return self._columns(["0" if node == "0" else f"v({node.lower()})" for node in nodes])

    def current(self, source: str) -> Floats:
        """(points,) current of a voltage source from its plus pin through it, A: what it feeds in is negative.

        Raises NgspiceError where the source is not in the plot.
        """
        return self._columns([f"i({source.lower()})"])[:, 0]

    def _columns(self, names: Sequence[str]) -> Floats:
        column = {name: i for i, name in enumerate(self.variables)}
        column["0"] = len(column)
        missing = [name for name in names if name not in column]
        if missing:
            raise NgspiceError(f"ngspice's answer lacks {len(missing)} of {len(names)} values, first {missing[0]}")
        grounded = np.column_stack([self.values, np.zeros(len(self.values))])
        return grounded[:, [column[name] for name in names]]


@frozen
class RawData:
    """What one deck gave."""

    plots: tuple[Plot, ...]
    """One for each analysis, in ngspice's order."""
    log: str
    """The end of what ngspice said, standard error included."""
    seconds: float
    """Duration of the process, which may have run further decks."""


def find_ngspice() -> Path | None:
    """The ngspice to run: what the environment variable CIRCUITTEX_NGSPICE names, else the first on PATH."""
    named = os.environ.get(VARIABLE)
    found = shutil.which("ngspice") if named is None else shutil.which(named)
    return Path(found).absolute() if found else None


def estimated_seconds(resistors: int) -> float:
    """How long ngspice takes for one deck of a woven circuit, s, within a factor of three.

    It spends its time ordering the matrix, anew for each deck: t = 0.02 + 5 (n / 10,000)^2.8. Measured with
    ngspice 39: 0.02 s for 350, 0.1 for 2,000, 0.6 for 4,500, 1.2 for 7,500 and 2.8 for 11,000 resistors of the
    paper's cell, and 30 to 40 s for 20,000 of a denser weave.

    >>> estimated_seconds(1000) < 0.1 < 10.0 < estimated_seconds(20_000)
    True
    """
    return 0.02 + 5.0 * math.pow(resistors / 10_000, 2.8)


def feasible(resistors: int, seconds: float = 60.0) -> bool:
    """Whether ngspice can be expected to answer a deck of that many resistors within `seconds`.

    >>> feasible(4000), feasible(100_000)
    (True, False)
    """
    return estimated_seconds(resistors) <= seconds


def run_deck(deck: str, timeout: float = 60.0) -> RawData:
    """Run one deck and return its plots; see `run_decks`."""
    return run_decks([deck], timeout)[0]


def run_decks(decks: Sequence[str], timeout: float = 60.0) -> tuple[RawData, ...]:
    """Run the analyses of each deck, all in one process, and return the plots of each.

    The run has a temporary folder of its own as working folder and home, ignores the user's .spiceinit, and is
    killed with everything it started after `timeout` seconds. ngspice ends with status 0 even where it found
    no answer; so the log must be free of complaints and every raw file complete and finite.

    Raises NgspiceUnavailableError where ngspice is missing or is not feasible for decks of this size in that time;
    NgspiceError where it complains, crashes, hangs, or answers rubbish; OSError where the disk with the temporary
    folder is full, which says nothing about ngspice and passes.
    """
    executable = find_ngspice()
    if executable is None:
        raise NgspiceUnavailableError(
            f"ngspice was not found: neither {VARIABLE} nor PATH leads to one that can be run"
        )
    _check_size(decks, timeout)
    try:
        with tempfile.TemporaryDirectory(prefix="circuittex-", ignore_cleanup_errors=True) as folder:
            try:
                return _run(executable, decks, Path(folder), timeout)
            except NgspiceError as error:
                if shutil.disk_usage(folder).free < ROOM:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), folder) from error
                raise
    except OSError as error:
        if error.errno == errno.ENOSPC:
            raise
        raise NgspiceError(f"ngspice could not be run: {error}") from error


def _run(executable: Path, decks: Sequence[str], folder: Path, timeout: float) -> tuple[RawData, ...]:
    """`run_decks` in a folder of its own."""
    script = ["* several decks, one process", ".control", "set filetype=binary", "set appendwrite"]
    for i, deck in enumerate(decks):
        (folder / f"deck{i}.cir").write_text(deck, encoding="utf-8")
        # All plots, not only the last; then away with them: a failing deck must not answer with its predecessor's.
        script += [f"source deck{i}.cir", "run", "foreach plot $plots", "setplot $plot", f"write deck{i}.raw", "end"]
        script += ["setplot const", "destroy all", "remcirc"]
    (folder / "all.cir").write_text("\n".join([*script, "quit", ".endc", ".end", ""]), encoding="ascii")
    start = time.perf_counter()
    status = _execute([str(executable), "-n", "-b", "all.cir"], folder, timeout)
    seconds = time.perf_counter() - start
    log = _log(folder)
    _judge(status, log)
    return tuple(RawData(_answer(folder / f"deck{i}.raw", log), log, seconds) for i in range(len(decks)))


def read_raw(path: Path) -> tuple[Plot, ...]:
    """Read all plots of a binary raw file of real values.

    Raises NgspiceError where the file is missing, cut short, not a raw file, or holds values that are not finite.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise NgspiceError(f"ngspice wrote no result ({error.strerror})") from error
    plots: list[Plot] = []
    position = 0
    while position < len(data):
        position = _read_plot(data, position, plots)
    return tuple(plots)


def _read_plot(data: bytes, position: int, plots: list[Plot]) -> int:
    """Append the plot that begins at `position` unless it is ngspice's table of constants; returns where it ends."""
    mark = data.find(b"Binary:\n", position)
    if mark < 0:
        raise NgspiceError("ngspice's result is not a binary raw file")
    head, _, table = data[position:mark].decode("ascii", "replace").partition("Variables:\n")
    fields = dict(line.split(": ", 1) for line in head.splitlines() if ": " in line)
    names = tuple(row.split()[1].lower() for row in table.splitlines() if len(row.split()) >= 3)
    try:
        kind, count, points = fields["Flags"], int(fields["No. Variables"]), int(fields["No. Points"])
    except (KeyError, ValueError) as error:
        raise NgspiceError(f"ngspice's result has a damaged header ({error})") from error
    name = fields.get("Plotname", "").strip()
    constants = name.lower() == "constants"  # the only complex plot that a run of resistors makes
    if kind.split() != (["complex"] if constants else ["real"]) or count != len(names) or count < 1 or points < 0:
        raise NgspiceError(f"ngspice's result has a strange header: {kind}, {count} variables, {points} points")
    start, size = mark + len(b"Binary:\n"), (16 if constants else 8) * count * points
    if len(data) - start < size:
        raise NgspiceError(f"ngspice's result is cut short: {len(data) - start} of {size} bytes of values")
    if not constants:
        values = np.frombuffer(data, dtype="<f8", count=count * points, offset=start).reshape(points, count)
        plots.append(Plot(name, names, values.astype(np.float64)))
    return start + size


def _answer(path: Path, log: str) -> tuple[Plot, ...]:
    """The plots of one deck, or NgspiceError where they are no answer."""
    try:
        plots = read_raw(path)
        if not plots:
            raise NgspiceError("ngspice ran no analysis")
        if any(not plot.values.size or not np.all(np.isfinite(plot.values)) for plot in plots):
            raise NgspiceError("ngspice's result has no values or some that are not finite")
    except NgspiceError as error:
        raise NgspiceError(f"{error}{_end(log)}") from error
    return plots


def _check_size(decks: Sequence[str], timeout: float) -> None:
    """Refuse what cannot be ready in time, before the wait."""
    sizes = [len(re.findall(r"^r", deck, re.MULTILINE | re.IGNORECASE)) for deck in decks]
    seconds = sum(map(estimated_seconds, sizes))
    if seconds > timeout:
        raise NgspiceUnavailableError(
            f"ngspice would need about {seconds:.0f} s for {sum(sizes)} resistors in {len(decks)} deck(s), more than "
            f"the {timeout:g} s allowed; circuittex.solve_nodal solves such circuits in seconds"
        )


def _execute(command: Sequence[str], folder: Path, timeout: float) -> int:
    """Run a command in `folder` with its output in files there; returns its status (negative: a signal)."""
    environment = {k: v for k, v in os.environ.items() if not k.upper().startswith(("SPICE", "NGSPICE", "LC_"))}
    environment |= {"HOME": str(folder), "LC_ALL": "C", "LANG": "C"}
    with (folder / "stdout").open("wb") as out, (folder / "stderr").open("wb") as err:
        try:
            process = subprocess.Popen(
                command,
                cwd=folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=err,
                start_new_session=True,
            )
        except OSError as error:
            raise NgspiceError(f"ngspice could not be started: {command[0]} ({error.strerror})") from error
        try:
            return process.wait(timeout)
        except subprocess.TimeoutExpired as error:
            raise NgspiceError(
                f"ngspice gave no answer within {timeout:g} s and was ended{_end(_log(folder))}"
            ) from error
        finally:
            _end_group(process)


def _end_group(process: subprocess.Popen[bytes]) -> None:
    """End a process and whatever it started, however it was left."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _log(folder: Path) -> str:
    """The end of what was said on both streams."""
    texts = []
    for name in ("stdout", "stderr"):
        with (folder / name).open("rb") as stream:
            stream.seek(max(0, stream.seek(0, os.SEEK_END) - LOG_CHARACTERS))
            texts.append(stream.read().decode("utf-8", "replace"))
    return "".join(texts)


def _judge(status: int, log: str) -> None:
    """Raise NgspiceError where the process died or complained."""
    if status < 0:
        raise NgspiceError(f"ngspice crashed ({signal.Signals(-status).name}){_end(log)}")
    # Titles are the user's text and may say anything.
    complaints = [line for line in log.splitlines() if TROUBLE.search(line) and not line.startswith("Circuit:")]
    if complaints:
        raise NgspiceError(f"ngspice complained: {complaints[0].strip()}{_end(log)}")


def _end(log: str) -> str:
    """The end of a log as part of a one-line message."""
    words = " | ".join(line.strip() for line in log.splitlines() if line.strip())
    return f"; its log ends: {words[-300:]}" if words else "; it said nothing"
