"""The Dask cluster of a sweep: one of this host's cores by default, or a running one by its scheduler's address.

A worker is a process with one thread. That of the local cluster may have child processes (isolated FMUs), ends with
this process, whatever ends that, and is started again when it dies.
"""

from __future__ import annotations

import logging
import multiprocessing
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from tempfile import TemporaryDirectory

import dask
from distributed import Client, LocalCluster

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.scenarios.parallel import cores, deaf
from tlpsim.scenarios.sweep.identity import program_version
from tlpsim.scenarios.terminal import messages

DEATHS = 3
"""Of workers under one job, after which it has failed."""
_CONNECT = "10s"
_CLOSE = 3.0  # s
_STARTS = 3  # of a local cluster, before it is given up
_MEMORY = {
    # Freed memory is kept for the next array: to give it back and get it again takes a job as long as to use it.
    "MALLOC_ARENA_MAX": 1,
    "MALLOC_MMAP_THRESHOLD_": 2**25,
    "MALLOC_TRIM_THRESHOLD_": 2**29,
}
_SETTINGS = {
    "distributed.nanny.pre-spawn-environ": _MEMORY | {f"{name}_NUM_THREADS": 1 for name in ("OMP", "MKL", "OPENBLAS")},
    "distributed.admin.tick.interval": "1s",
    "distributed.worker.daemon": False,
    "distributed.worker.profile.enabled": False,
    "distributed.scheduler.allowed-failures": DEATHS - 1,
    # A compiled loop may keep a worker from telling that it lives; where it died its connection says so.
    "distributed.scheduler.worker-ttl": None,
    "distributed.admin.large-graph-warning-threshold": "1GB",
    "distributed.comm.timeouts.connect": _CONNECT,
}


@contextmanager
def connected(workers: int | None = None, scheduler: str | None = None) -> Iterator[Client]:
    """A client of a cluster, which is closed with it if it is a local one.

    Parameters
    ----------
    workers
        Processes of a local cluster; as many as cores without it.
    scheduler
        Address of a running cluster, such as "tcp://10.0.0.1:8786".

    Raises
    ------
    ScenarioError
        When both are given, `workers` is less than 1, nothing answers at the address, or its workers have no tlpsim or
        another version.
    SolverError
        When the workers of a local cluster do not start.
    """
    if workers is not None and scheduler is not None:
        raise ScenarioError("--workers is for a local cluster: that of --scheduler has the workers that it has")
    if workers is not None and workers < 1:
        raise ScenarioError(f"workers is {workers}; it must be 1 or more")
    choice = _remote(scheduler) if scheduler is not None else _local(workers or cores())
    with dask.config.set(_SETTINGS), _silence(), choice as client:
        yield client


@contextmanager
def _local(workers: int) -> Iterator[Client]:
    others = set(multiprocessing.active_children())
    with TemporaryDirectory(prefix="tlpsim-workers-", ignore_cleanup_errors=True) as scratch:
        with deaf():  # Ctrl-C goes to this process only
            cluster = _started(workers, scratch)
            client = Client(cluster)
        try:
            yield client
        finally:
            with deaf(), suppress(Exception):
                # A worker that is busy would be waited for, and what it does is wanted no more.
                for nanny in cluster.workers.values():
                    nanny.auto_restart = False
                for process in set(multiprocessing.active_children()) - others:
                    process.kill()
                client.close(timeout=_CLOSE)
                cluster.close(timeout=_CLOSE)


def _started(workers: int, scratch: str) -> LocalCluster:
    """A local cluster; a worker that dies before it works is no reason to give up at once."""

    def start() -> LocalCluster:
        return LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",
            local_directory=scratch,
            silence_logs=logging.CRITICAL,
        )

    for _ in range(_STARTS - 1):
        with suppress(RuntimeError):
            return start()
    try:
        return start()
    except RuntimeError as error:
        raise SolverError(
            f"the {workers} workers of the local cluster do not start ({' '.join(str(error).split())}): there may be "
            "too little memory for as many; give fewer --workers"
        ) from error


@contextmanager
def _remote(scheduler: str) -> Iterator[Client]:
    try:
        with deaf():
            client = Client(scheduler, timeout=_CONNECT)
    except (OSError, ValueError) as error:
        raise ScenarioError(
            f"--scheduler {scheduler}: nothing answers there ({' '.join(str(error).split())[:200]}); "
            "start one by `dask scheduler`, and give the address that it shows"
        ) from None
    try:
        _require_program(client, scheduler)
        yield client
    finally:
        with deaf(), suppress(Exception):
            client.close(timeout=_CLOSE)


def _require_program(client: Client, scheduler: str) -> None:
    """Refuse workers without tlpsim, or with another version of it."""
    own = program_version()
    if not client.scheduler_info()["workers"]:
        messages.print(
            f"tlpsim: {scheduler} has no workers: the sweep waits until there are some, started by "
            f"`dask worker {scheduler} --nthreads 1`",
            markup=False,
            soft_wrap=True,
        )
    found = client.run(program_version, on_error="return")
    for worker, version in found.items():
        if version != own:
            told = f"tlpsim {version}" if isinstance(version, str) else f"no tlpsim ({version})"
            raise ScenarioError(
                f"--scheduler {scheduler}: the worker {worker} has {told} and this program is {own}: install tlpsim "
                f"{own} there, and start the worker again"
            )


@contextmanager
def _silence() -> Iterator[None]:
    """Log nothing of Dask's inner life, such as a worker that was lost, which the sweep sees to."""
    inner = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in ("distributed", "tornado")]
    before = {name: logging.getLogger(name).level for name in (*inner, "asyncio")}
    for name in before:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)
