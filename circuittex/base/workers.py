"""Processes that compute beside one another and end with the one that started them.

Plain `subprocess` serves better here than `multiprocessing`: a process gets its environment before NumPy is loaded,
tells its progress through the pipe that brings its results, may be started by any process, one of Dask for example,
and a script that calls `run_study` needs no guard around its main part. The pipe is also the lifeline: when it
closes, whatever the reason, the worker ends.
"""

from __future__ import annotations

import _thread
import contextlib
import os
import pickle
import queue
import subprocess
import sys
import threading
import time
import traceback
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, BinaryIO, Protocol

from circuittex.base.errors import CircuittexError, CircuittexWarning, WorkerError

THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Environment variables by which the libraries below NumPy, PARDISO and numba learn how many threads to start."""
GRACE = 2.0
"""Seconds that a worker has to end what it started, ngspice for example, once nobody waits for it any more."""
POLL = 0.5
"""Seconds between looks for an interrupt, which some systems do not deliver to a waiting thread."""
SERVE = "from circuittex.base.workers import serve; serve()"

Say = Callable[[str], None]
Task = Callable[..., Any]
"""Called with its arguments and, as the last one, a `Say`; for a `Pool` a function that pickle finds by its name."""
Job = tuple[str, Task, tuple[object, ...]]
"""What a task is about, the task, and its arguments."""


class Computers(Protocol):
    """What computes tasks: this process, or several."""

    size: int

    def submit(self, key: str, task: Task, *arguments: object) -> None:
        """Take on a task; at most `size` at a time."""

    def next(self) -> tuple[str, Any]:
        """The key of a finished task with its result, or with the `CircuittexError` that it raised."""

    def close(self) -> None:
        """End at once what is still going on."""


def completed(computers: Computers, jobs: Sequence[Job]) -> Iterator[Any]:
    """The results of jobs that do not depend on one another, as they come.

    Raises the `CircuittexError` of a job that fails.
    """
    waiting, running = deque(jobs), 0
    while waiting or running:
        while waiting and running < computers.size:
            key, task, arguments = waiting.popleft()
            computers.submit(key, task, *arguments)
            running += 1
        _, result = computers.next()
        running -= 1
        if isinstance(result, CircuittexError):
            raise result
        yield result


class Here:
    """Computes in this process, one task at a time."""

    size = 1

    def __init__(self, say: Say) -> None:
        self._say = say
        self._tasks: deque[tuple[str, Task, tuple[object, ...]]] = deque()

    def submit(self, key: str, task: Task, *arguments: object) -> None:
        """Take on a task."""
        self._tasks.append((key, task, arguments))

    def next(self) -> tuple[str, Any]:
        """Compute the task and return its key and result."""
        key, task, arguments = self._tasks.popleft()
        try:
            return key, task(*arguments, self._say)
        except CircuittexError as error:
            return key, error

    def close(self) -> None:
        """Nothing to end."""


class Pool:
    """`size` worker processes of `threads` threads each."""

    def __init__(self, size: int, threads: int, say: Say) -> None:
        self.size, self._say = size, say
        self._events: queue.SimpleQueue[tuple[int, bytes]] = queue.SimpleQueue()
        self._keys: dict[int, str] = {}
        self._processes = [_start(threads) for _ in range(size)]
        self._listeners = [threading.Thread(target=self._listen, args=(number,), daemon=True) for number in range(size)]
        for listener in self._listeners:
            listener.start()

    def submit(self, key: str, task: Task, *arguments: object) -> None:
        """Have an idle worker compute a task."""
        number = next(number for number in range(self.size) if number not in self._keys)
        self._keys[number] = key
        with contextlib.suppress(OSError):  # a worker that died is reported by its listener
            _send(self._processes[number].stdin, (task, arguments))

    def next(self) -> tuple[str, Any]:
        """Wait for a task to finish; meanwhile pass on what the workers say.

        Raises `WorkerError` where a worker died, and what a task raised if it is no `CircuittexError`.
        """
        while True:
            try:
                number, message = self._events.get(timeout=POLL)
            except queue.Empty:
                continue
            if not message:
                raise WorkerError(f"a worker process died while it computed {self._keys.get(number, 'nothing')}")
            kind, value = pickle.loads(message)
            if kind == "say":
                self._say(value)
                continue
            if kind == "failed" and not isinstance(value, CircuittexError):
                raise value
            return self._keys.pop(number), value

    def close(self) -> None:
        """End all workers, whatever they are doing."""
        for process in self._processes:
            with contextlib.suppress(OSError):
                process.stdin.close()  # type: ignore[union-attr]
        deadline = time.monotonic() + GRACE + POLL
        for process in self._processes:
            try:
                process.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        for process, listener in zip(self._processes, self._listeners, strict=True):
            listener.join()
            process.stdout.close()  # type: ignore[union-attr]

    def _listen(self, number: int) -> None:
        stream = self._processes[number].stdout
        try:
            while True:
                self._events.put((number, pickle.load(stream)))  # type: ignore[arg-type]
        except (EOFError, OSError, pickle.UnpicklingError):
            self._events.put((number, b""))


def _start(threads: int) -> subprocess.Popen[bytes]:
    """A worker process; a number of threads that the user has set in the environment holds."""
    environment = dict.fromkeys(THREADS, str(threads)) | os.environ
    environment["PYTHONPATH"] = os.pathsep.join(place or os.curdir for place in sys.path)
    return subprocess.Popen(
        [sys.executable, "-P", "-c", SERVE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=environment,
        start_new_session=True,  # an interrupt from the keyboard is for the one that started it
        creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
    )


def _send(stream: BinaryIO | Any, message: object) -> None:
    # Bytes in a pickle of their own: the receiver takes a whole message without loading what it is about.
    pickle.dump(pickle.dumps(message, pickle.HIGHEST_PROTOCOL), stream, pickle.HIGHEST_PROTOCOL)
    stream.flush()


def serve() -> None:
    """The life of a worker: compute what comes through standard input, answer through standard output."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no answer
    warnings.simplefilter("ignore", CircuittexWarning)  # it has been said by the process that started this one
    tasks: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(sys.stdin.buffer, tasks), daemon=True).start()
    try:
        while message := tasks.get():
            _send(answers, _outcome(message, partial(_tell, answers)))
    except (KeyboardInterrupt, OSError):
        pass  # nobody waits for the answer any more
    except BaseException:
        traceback.print_exc()
    os._exit(0)  # at an ordinary end the interpreter would wait for the thread that reads


def _outcome(message: bytes, say: Say) -> tuple[str, object]:
    try:
        task, arguments = pickle.loads(message)
        return "done", task(*arguments, say)
    except Exception as error:
        error.add_note(f"in a worker process:\n{traceback.format_exc()}")
        return "failed", error


def _tell(answers: BinaryIO, text: str) -> None:
    with contextlib.suppress(OSError):  # when nobody listens any more, this process is about to be ended
        _send(answers, ("say", text))


def _receive(stream: BinaryIO, tasks: queue.SimpleQueue[bytes]) -> None:
    """Pass messages on until the pipe closes; then end this process, whatever it is doing."""
    try:
        while True:
            tasks.put(pickle.load(stream))
    except (EOFError, OSError, pickle.UnpicklingError):
        tasks.put(b"")
        _thread.interrupt_main()  # a task can clean up
        time.sleep(GRACE)
        os._exit(1)
