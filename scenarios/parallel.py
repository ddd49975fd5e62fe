"""The same function of many cases, in processes of their own: records of a comparison, cases of a sensitivity study.

Processes are started afresh, with one thread each for linear algebra: there are as many of them as cores. Ctrl-C goes
to this process only, which ends the others.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import TypeVar

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from tlpsim.loads.errors import ScenarioError, SolverError

Case = TypeVar("Case")
Result = TypeVar("Result")


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_parallel(
    function: Callable[[Case], Result],
    cases: Sequence[Case],
    workers: int | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Result]:
    """Results of a function for each case, in the order of the cases.

    Parameters
    ----------
    function
        Of a module, so that another process finds it.
    cases
        Arguments, which must pickle, and so must the results.
    workers
        Processes; as many as there are cores without it. One is this process itself.
    progress
        Called with the number of cases done and their total.

    Raises
    ------
    ScenarioError
        When workers is less than 1.
    SolverError
        When a process ends without a result.
    Exception
        What the function raises first; the other cases are given up.
    """
    if workers is not None and workers < 1:
        raise ScenarioError(f"workers is {workers}; it must be 1 or more")
    count = min(workers or cores(), len(cases))
    progress(0, len(cases))
    if count <= 1:
        results = []
        for case in cases:
            with threadpool_limits(1):
                results.append(function(case))
            progress(len(results), len(cases))
        return results
    with _processes(count) as pool:
        try:
            with deaf():
                futures: list[Future[Result]] = [pool.submit(function, case) for case in cases]
            for done, future in enumerate(as_completed(futures), 1):
                future.result()
                progress(done, len(cases))
        except BrokenProcessPool:
            raise SolverError(
                f"a process of {count} ended without a result, for want of memory perhaps; give fewer --workers"
            ) from None
        return [future.result() for future in futures]


@contextmanager
def _processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """A pool whose processes are gone at the end, also where cases are left undone."""
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), initializer=_begin)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in set(multiprocessing.active_children()) - others:
            process.terminate()
        raise
    finally:
        pool.shutdown()


@contextmanager
def deaf() -> Iterator[None]:
    """Processes that are started in the block never hear Ctrl-C; this one hears it at the end of the block."""
    resource_tracker.ensure_running()  # it lets the thread that starts it hear again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """Settle a new process: one thread, and no warnings, which the first process gives already."""
    import scipy.linalg  # noqa: F401 - it loads the libraries whose threads are limited

    warnings.simplefilter("ignore")
    threadpool_limits(1)
