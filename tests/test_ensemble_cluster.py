"""Ensembles on Dask: workers that die, tasks that fail, schedulers that are running already.

Starting worker processes takes seconds: one test has them, for all that may happen to them. The other tests have their
worker in this process.
"""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import distributed
import numpy as np
import pytest

import circuittex.study.ensemble.cluster as cluster_module
from circuittex.base.arrays import Floats
from circuittex.base.errors import CircuittexError, DesignError, WorkerError
from circuittex.base.lock import HOLDER
from circuittex.design import plain_weave
from circuittex.study.ensemble import run_ensemble
from circuittex.study.ensemble.cluster import each_result, local_client, remote_client, sees
from circuittex.study.ensemble.perturbation import member_design, perturbed
from circuittex.study.run import run_study

# what Dask says on a machine without a network
pytestmark = pytest.mark.filterwarnings("ignore:Couldn't detect a suitable IP address")

DEADLINE = 120.0
"""Seconds within which a worker must have started on a machine that is busy."""
TINY = plain_weave(yarns=2, rows=(1,))
TINY = replace(TINY, numerics=replace(TINY.numerics, elements=3), probes=(), terminals=())


def task(kind: str, log: str) -> str:
    """What a worker may do to its scheduler; every attempt leaves a line in `log`."""
    with Path(log).open("a") as file:
        file.write(f"{kind} {os.getpid()}\n")
    attempts = Path(log).read_text().count(kind)
    if kind == "dies once" and attempts == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    if kind == "raises":
        raise OSError("no space left")
    if kind == "threads":
        return os.environ["NUMBA_NUM_THREADS"] + os.environ["OMP_NUM_THREADS"]
    return f"{kind} {attempts}"


def alive(pid: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def never_ends(log: str) -> None:
    Path(log).write_text(str(os.getpid()))
    while True:
        time.sleep(0.1)


def test_whatever_happens_to_workers_and_tasks_the_others_go_on(tmp_path: Path) -> None:
    """Tasks that kill their process, raise, or never end; and a member whose process is killed from outside."""
    kinds = ["returns", "dies once", "raises", "threads"]
    arguments = {kind: (kind, str(tmp_path / kind)) for kind in kinds}
    endless = tmp_path / "endless"
    with local_client(1) as client:
        found = dict(each_result(client, task, arguments))
        assert set(found) == set(kinds)
        assert found["dies once"] == "dies once 2"
        assert found["returns"] in ("returns 1", "returns 2")  # lost with its worker, it is computed again
        assert found["threads"] == "11"
        assert isinstance(found["raises"], OSError)
        assert (tmp_path / "raises").read_text().count("raises") == 3

        values, killed = killed_member(tmp_path / "e")
        assert killed != os.getpid()

        # what is still going on when the block is left ends with it
        client.submit(never_ends, str(endless), pure=False)
        deadline = time.monotonic() + DEADLINE
        while not (endless.exists() and endless.read_text()):
            assert time.monotonic() < deadline
            time.sleep(0.05)
        pid = int(endless.read_text())
        assert alive(pid)
    assert not alive(pid)
    assert not alive(killed)
    record = run_study(member_design(perturbed(TINY), 0), workers=1).records[0]
    # relaxed to 1e-6 N; the number of threads, and hence the rounding, may differ between the processes
    np.testing.assert_allclose(values, record.clamp_force.ravel(), rtol=0, atol=1e-6)


def killed_member(out: Path) -> tuple[Floats, int]:
    """The values of a member whose process is killed once while it computes, and the number of that process."""
    killed: list[int] = []

    def kill() -> None:
        holder = out / "members" / "0000" / HOLDER
        while not killed and not stop.is_set():
            with suppress(OSError, IndexError, ValueError):
                pid = int(holder.read_text().split()[1])
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
            stop.wait(0.01)

    stop = threading.Event()
    killer = threading.Thread(target=kill)
    killer.start()
    try:
        ensemble = run_ensemble(TINY, out, members=1, workers=1)
    finally:
        stop.set()
        killer.join()
    assert ensemble.failures == ("",)
    (pid,) = killed
    return ensemble.values[0, 0], pid


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """The address of a scheduler with a worker in this process."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0", memory_limit=None
    ) as cluster:
        yield cluster.scheduler_address


def test_members_run_on_a_scheduler_that_is_there(
    scheduler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(design: object, folder: Path, **_: object) -> None:
        raise DesignError("packing.seed", threading.current_thread().name, "nothing")

    monkeypatch.setattr("circuittex.study.ensemble.member.run_study", refuse)
    ensemble = run_ensemble(TINY, tmp_path, members=2, address=scheduler)
    assert all("Dask" in failure for failure in ensemble.failures)
    assert not list(tmp_path.glob(".seen-by-*"))


def test_workers_that_do_not_see_the_folder_are_named(
    scheduler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module, "sees", lambda path: False)
    with (
        pytest.raises(
            DesignError, match=r"results folder: .* must be a folder that all workers share; the worker at inproc"
        ),
        remote_client(scheduler, tmp_path),
    ):
        pass


def test_workers_that_do_not_see_where_members_start_are_named(
    scheduler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module, "sees", lambda path: path != "/somewhere/else")
    with (
        pytest.raises(DesignError, match=r"start: '/somewhere/else' is not usable; .* the worker at inproc"),
        remote_client(scheduler, tmp_path, "/somewhere/else"),
    ):
        pass
    with remote_client(scheduler, tmp_path):
        pass


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense://a", "127.0.0.1:x"])
def test_an_address_where_nobody_answers_is_named_and_nothing_is_left_open(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The garbage collector would close a client that was left, perhaps while another one starts its event loop: it
    would wait for ever for a lock that its own thread holds."""
    monkeypatch.setattr(cluster_module, "PATIENCE", 0.5)
    gc.collect()
    gc.disable()
    try:
        with pytest.raises(DesignError, match=r"--scheduler.*no Dask scheduler answers"):
            run_ensemble(TINY, tmp_path, members=1, address=address)
        clients = [thing for thing in gc.get_objects() if type(thing) is distributed.Client]
    finally:
        gc.enable()
    assert not [client for client in clients if client.status != "closed"]


def test_workers_that_are_gone_are_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "PATIENCE", 0.2)
    with (
        distributed.LocalCluster(n_workers=0, processes=False, dashboard_address="127.0.0.1:0") as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
        pytest.raises(WorkerError, match="none has come back"),
    ):
        list(each_result(client, sees, {0: ("nowhere",)}))


def test_a_scheduler_without_workers_is_told_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "PATIENCE", 0.5)
    with (
        distributed.LocalCluster(n_workers=0, processes=False, dashboard_address="127.0.0.1:0") as cluster,
        pytest.raises(DesignError, match="no worker has joined"),
        remote_client(cluster.scheduler_address, tmp_path),
    ):
        pass


def test_without_dask_the_message_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(CircuittexError, match=r"pip install 'circuittex\[ensemble\]'"), local_client(1):
        pass


STRANGER = """
import asyncio, pickle, sys
import distributed

class Touch:
    def __reduce__(self):
        return open, (sys.argv[2], "w")

async def touch(address, security):
    arguments = security.get_connection_args("client") if security is not None else {}
    comm = await distributed.comm.connect(address, timeout=3, **arguments)
    message = {"op": "run", "function": pickle.dumps(Touch()), "args": b"", "kwargs": b""}
    await comm.write(message, serializers=["pickle"])
    print("answered", await asyncio.wait_for(comm.read(), timeout=3))

for protocol in ("tcp://", "tls://"):
    for security in (None, distributed.Security.temporary()):
        try:
            asyncio.run(touch(sys.argv[1].replace("tls://", protocol), security))
        except Exception as error:
            print("refused", type(error).__name__)
"""
"""Somebody else on the machine: plainly and with a certificate of their own, has a server make a file."""


def stranger(address: str, path: Path) -> str:
    command = [sys.executable, "-c", STRANGER, address, str(path)]
    return subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE).stdout


def test_nobody_else_reaches_the_workers_of_this_machine(tmp_path: Path) -> None:
    ran = tmp_path / "ran"
    with local_client(1) as client:
        (worker,) = client.scheduler_info()["workers"]
        for address in (client.scheduler.address, worker):
            assert address.startswith("tls://127.0.0.1:")
            assert stranger(address, ran).count("refused") == 4
        assert client.submit(os.getpid).result(timeout=60) > 0, "the cluster works on"
    assert not ran.exists()


def test_a_stranger_reaches_an_unprotected_worker(tmp_path: Path) -> None:
    """What the test above would see without TLS."""
    with distributed.LocalCluster(n_workers=1, processes=False, protocol="tcp://", dashboard_address=None) as cluster:
        (worker,) = cluster.scheduler_info["workers"]
        said = stranger(worker, tmp_path / "ran")
    assert "answered" in said or (tmp_path / "ran").exists()
