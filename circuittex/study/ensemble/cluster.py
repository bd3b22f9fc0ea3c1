"""Tasks on Dask: a cluster of this machine's cores, or a scheduler that is running somewhere."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import tempfile
from collections.abc import Callable, Hashable, Iterator, Mapping
from concurrent.futures import CancelledError
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from circuittex.base.errors import CircuittexError, DesignError, WorkerError

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

RETRIES = 2
"""How often a task that raised is tried again. For workers that died the scheduler's own number holds, three."""
PATIENCE = 30.0
"""Seconds to wait for a scheduler to answer, and for a first worker."""
SETTINGS = {
    # Dask gives its workers one thread for each library that it knows; numba is not among them.
    "distributed.nanny.pre-spawn-environ.NUMBA_NUM_THREADS": 1,
    # One task at a time: those that only wait behind one that kills its worker are not to blame.
    "distributed.scheduler.worker-saturation": 1.0,
}
"""Settings of Dask for the processes on this machine."""

_Key = TypeVar("_Key", bound=Hashable)
_Result = TypeVar("_Result")


@contextlib.contextmanager
def local_client(workers: int) -> Iterator[Client]:
    """A client of `workers` processes on this machine, which end with the block at once, whatever they are doing.

    Dask's ports run the code of whoever connects, and on a machine with several users anybody can. So scheduler and
    workers speak TLS alone, with a certificate that is made here, kept in memory and known to them only.
    """
    distributed = _distributed()
    import dask

    with dask.config.set(SETTINGS):
        cluster = distributed.LocalCluster(
            protocol="tls://",
            security=distributed.Security.temporary(),
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",  # none, and no quarrel about its port
            memory_limit=None,  # studies are no data of Dask's that it could write to disk
            silence_logs=logging.CRITICAL,
        )
        try:
            with distributed.Client(cluster, set_as_default=False) as client:
                client.register_plugin(_ignoring_interrupts(distributed))
                yield client
        finally:
            _end(cluster)


@contextlib.contextmanager
def remote_client(address: str, folder: Path, source: str = "") -> Iterator[Client]:
    """A client of the scheduler at `address`, all of whose workers see `folder`, and `source` where one is given.

    Raises `DesignError` where nobody answers, no worker has joined, or a worker does not see a folder.
    """
    distributed = _distributed()
    try:
        # Before there is a client: one that fails to connect is closed by the garbage collector, which blocks for ever
        # where it happens to run while another client starts its event loop.
        asyncio.run(_call(distributed, address))
    except (OSError, TimeoutError, ValueError, TypeError) as error:
        raise DesignError("--scheduler", address, f"no Dask scheduler answers there ({error})") from error
    with distributed.Client(address, timeout=PATIENCE, set_as_default=False) as client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise DesignError("--scheduler", address, "no worker has joined this scheduler") from None
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".seen-by-") as token:
            _refuse_blind(client, "results folder", str(folder), token.name)
        if source:
            _refuse_blind(client, "start", source, source)
        yield client


def _refuse_blind(client: Client, field: str, folder: str, path: str) -> None:
    """Refuse a folder if a worker does not see the `path` in it."""
    blind = [worker for worker, sees in client.run(sees, path).items() if not sees]
    if blind:
        allowed = f"it must be a folder that all workers share; the worker at {blind[0]} does not see it"
        raise DesignError(field, folder, allowed)


async def _call(distributed: Any, address: str) -> None:
    """Connect to `address` and hang up; raises where nobody answers."""
    comm = await distributed.comm.connect(address, timeout=PATIENCE)
    await comm.close()


def sees(path: str) -> bool:
    """Whether there is a file at `path`; asked on a worker."""
    return Path(path).exists()


def each_result(
    client: Client, task: Callable[..., _Result], arguments: Mapping[_Key, tuple[Any, ...]]
) -> Iterator[tuple[_Key, _Result | Exception]]:
    """Call `task` with each of `arguments` on the workers; yields results, or what was raised, as they come.

    A task that raises is tried again, and so is one whose worker dies; what it still raises after that is yielded.
    Tasks that have not begun are withdrawn where the caller stops.

    Raises `WorkerError` where all workers are gone and none comes back for `PATIENCE` seconds.
    """
    from distributed import wait

    futures = {client.submit(task, *values, pure=False, retries=RETRIES): key for key, values in arguments.items()}
    pending, looks = set(futures), 0
    try:
        while pending:
            with contextlib.suppress(TimeoutError, CancelledError), client.as_current():
                wait(pending, timeout=PATIENCE, return_when="FIRST_COMPLETED")
            done = {future for future in pending if future.done()}
            pending -= done
            for future in done:
                yield futures[future], _outcome(future)
                future.release()
            looks = 0 if done or client.nthreads() else looks + 1
            if looks > 1:
                raise WorkerError("the Dask workers are gone, and none has come back")
    finally:
        client.cancel(list(futures), force=True)


def _outcome(future: Any) -> Any:
    """What a future that is done holds: its result or its exception."""
    try:
        error = future.exception()
    except (CancelledError, TimeoutError) as lost:
        error = lost
    return future.result() if error is None else error


def _distributed() -> Any:
    try:
        import distributed
    except ModuleNotFoundError as error:
        raise CircuittexError(
            f"ensembles need Dask's package 'distributed' ({error}): pip install 'circuittex[ensemble]'"
        ) from error
    return distributed


def _ignoring_interrupts(distributed: Any) -> Any:
    """A plugin by which workers leave Ctrl-C, which a terminal sends to all processes, to the one that they serve."""

    class IgnoreInterrupts(distributed.WorkerPlugin):  # type: ignore[misc]
        def setup(self, worker: Any) -> None:
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    return IgnoreInterrupts()


def _end(cluster: LocalCluster) -> None:
    """End the cluster without waiting for what its workers compute: what they finished is in their files."""
    for nanny in cluster.workers.values():
        nanny.auto_restart = False
        with contextlib.suppress(OSError, TypeError):  # gone, or never started
            os.kill(nanny.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
    cluster.close()
