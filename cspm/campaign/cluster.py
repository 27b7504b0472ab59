"""The engine of a campaign: a local cluster of processes, or a scheduler that is there."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Any

import dask
from distributed import Client, LocalCluster

from cspm.campaign.code_version import code_version
from cspm_msgs_py.errors import InputError

# How long a scheduler, and its first worker, may take to answer [s].
_PATIENCE_S = 30
_LOOPBACK = "127.0.0.1"
# Run by each worker before its first task.
_PRELOAD = "from cspm.campaign.cluster import leave_interrupts; leave_interrupts()"
_SETTINGS = {
    # The campaign itself counts the tries of a run; see `work`.
    "distributed.scheduler.allowed-failures": 0,
    # A worker holds only the run that it makes, so that no other is suspected when it dies.
    "distributed.scheduler.worker-saturation": 1.0,
    # A run is one call: its frames say nothing, and looking at them takes its processor.
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.admin.large-graph-warning-threshold": "1GB",
}


@contextmanager
def local_client(workers: int | None = None) -> Iterator[Client]:
    """Give a client of a new cluster on this computer: a scheduler and processes, on loopback.

    Their connections are encrypted, and nobody without the certificate of this run can use them.

    Args:
        workers: how many processes, a run at a time each; None: one per processor.
    """
    with (
        dask.config.set(_SETTINGS),
        LocalCluster(
            n_workers=workers or _processors(),
            threads_per_worker=1,
            processes=True,
            host=_LOOPBACK,
            dashboard_address=f"{_LOOPBACK}:0",
            security=True,
            silence_logs=logging.CRITICAL,
            preload=[_PRELOAD],
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def leave_interrupts() -> None:
    """Leave Ctrl-C to the campaign: a terminal sends it to every process that it has started."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def worker_pool(workers: int | None = None) -> Iterator[Executor]:
    """Give an executor whose tasks run in processes of a cluster on this computer.

    Args:
        workers: how many processes; None: one per processor.
    """
    # Equal arguments do not mean equal results: some tasks write files.
    with local_client(workers) as client:
        yield client.get_executor(pure=False)


@contextmanager
def remote_client(address: str) -> Iterator[Client]:
    """Give a client of a scheduler that is running; its workers must have this code.

    Raises:
        InputError: nobody answers, there is no worker, or one is unfit.
    """
    # What goes wrong is said in the campaign's own words.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=_PATIENCE_S)
    except (OSError, TypeError, ValueError, RuntimeError) as err:
        reason = " ".join(str(err).split()) or type(err).__name__
        raise InputError(
            f"--scheduler {address}: {reason}, allowed: the address of a dask scheduler, such as"
            " tcp://127.0.0.1:8786"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE_S)
        except TimeoutError:
            raise InputError(
                f"--scheduler {address}: no worker within {_PATIENCE_S} s, allowed: at least one,"
                f" `dask worker {address} --nthreads 1`"
            ) from None
        check_workers(client)
        yield client


def check_workers(client: Client) -> None:
    """Refuse workers with other code, or with several threads.

    Raises:
        InputError: naming the first.
    """
    threads = {address: each["nthreads"] for address, each in workers_of(client).items()}
    for address, count in threads.items():
        if count != 1:
            raise InputError(
                f"worker {address}: {count} threads, allowed: 1 (`dask worker --nthreads 1"
                f" --nworkers {count}`)"
            )
    own = code_version()
    for address, found in client.run(code_version, on_error="return").items():
        if found != own:
            raise InputError(f"worker {address}: {_in_words(found)}, allowed: {own}")


def workers_of(client: Client) -> dict[str, Any]:
    """Return what the scheduler says of its workers, by address."""
    found: dict[str, Any] = client.scheduler_info(n_workers=-1)["workers"]
    return found


def _processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _in_words(found: object) -> str:
    if isinstance(found, ModuleNotFoundError):
        return f"cspm is not installed there ({found})"
    return str(found) if isinstance(found, str) else f"{type(found).__name__}: {found}"
