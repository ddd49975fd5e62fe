"""Do the jobs of a sweep that are not done, on a cluster, and make the summary of all.

A few jobs for each thread are with the scheduler at a time, so that it holds no more of a sweep of a million cases than
of one of a hundred. What jobs share is made by tasks of their own (`tlpsim.scenarios.sweep.prepared`).

When a worker dies, Dask suspects all jobs that it had been given, and gives up those that it suspects too often. As one
of them may have killed it and the others did not, these are done once more, each alone.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np
from distributed import CancelledError, Future, KilledWorker, as_completed
from distributed.comm import CommClosedError

from tlpsim.loads.errors import ScenarioError, SolverError, TlpsimError
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.case import matching_names
from tlpsim.scenarios.sweep import prepared
from tlpsim.scenarios.sweep.cluster import DEATHS, connected
from tlpsim.scenarios.sweep.identity import program_version
from tlpsim.scenarios.sweep.job import Order, Outcome, Place, VersionError, error_text, perform, stored
from tlpsim.scenarios.sweep.ledger import Ledger, ledger
from tlpsim.scenarios.sweep.plan import Job, Plan, Sweep
from tlpsim.scenarios.sweep.prepared import Prepared
from tlpsim.scenarios.sweep.table import NAME, SweepTable, summary_table, write_table

if TYPE_CHECKING:
    from distributed import Client

WINDOW, LEAST_WINDOW = 8, 64
"""Jobs that are with the scheduler at a time: for each thread of the cluster, and at least."""
RECOUNT = 10.0
"""s after which the threads of the cluster are counted again."""
PREPARED = 1000
"""Tasks of what jobs share, those that were used last, whose results are kept for further jobs."""

Progress = Callable[[int, int, int], None]
"""Called with the number of jobs that are done, of all jobs, and of those that failed."""


def run_sweep(
    sweep: Sweep,
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    retry_failed: bool = False,
    progress: Progress = lambda done, total, failed: None,
) -> SweepTable:
    """Do what is not done of a sweep, and leave its summary in the folder.

    Parameters
    ----------
    sweep
        What to do.
    folder
        Of the sweep: its ledger, results files and summary. One that a sweep has left goes on; jobs that it holds are
        not done again, also where the sweep has changed since.
    workers
        Processes of a local cluster; as many as cores without it.
    scheduler
        Address of a running Dask cluster instead.
    retry_failed
        Whether jobs that failed are done again.
    progress
        See `Progress`.

    Returns
    -------
    SweepTable
        The summary of all jobs; failed ones have their errors in it.

    Raises
    ------
    ScenarioError, ResultsError
        When no case is allowed, the folder cannot be used, or the cluster cannot be reached.
    SolverError
        When the cluster is lost; what is done is kept, and the same call goes on.
    """
    folder = Path(folder)
    plan = sweep.plan()
    with ledger(folder) as book, ExitStack() as closing:
        clients: list[Client] = []

        def client() -> Client:
            if not clients:
                clients.append(closing.enter_context(connected(workers, scheduler)))
            return clients[0]

        work = _Work(
            sweep=sweep,
            plan=plan,
            folder=folder,
            place=Place(folder=str(folder.resolve()), token=book.token),
            ledger=book,
            scheduler=scheduler,
            retry_failed=retry_failed,
        )
        limited = sweep.file.time.worst is not None
        first = [job for job in plan.jobs if job.domain == "frequency" or not limited]
        more = min(sweep.file.time.worst or 0, len({job.case for job in first})) * sweep.file.replicates.records
        jobs = first
        try:
            _do(work, first, client, progress, more if limited else 0, 0)
            if limited:
                chosen = _worst_cases(work, first)
                jobs = [job for job in plan.jobs if job.domain == "frequency" or job.case in chosen]
                _do(work, [job for job in jobs if job.domain == "time"], client, progress, 0, len(first))
        except (Exception, CancelledError) as error:
            if isinstance(error, TlpsimError) or not _tells_of_loss(error, clients):
                raise
            done = len(book.errors([job.key for job in plan.jobs]))
            where = f"the scheduler {scheduler}" if scheduler else "the local cluster"
            raise SolverError(
                f"{where} is gone ({type(error).__name__}); {done} jobs are done and kept in {folder}: start it again, "
                "and the same command goes on"
            ) from None
        finally:
            # Of an interrupted sweep, too: what is done can be looked at.
            table = summary_table(sweep, plan, jobs, book)
            if table.rows:
                write_table(table, folder / NAME)
    return table


def _tells_of_loss(error: BaseException, clients: Sequence[Client]) -> bool:
    """Whether an error is of a cluster that is lost, to whose client nothing can be said any more."""
    lost = isinstance(error, CancelledError | CommClosedError | TimeoutError)
    return lost or any(client.status != "running" for client in clients)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Work:
    """What the execution of a sweep needs at hand."""

    sweep: Sweep
    plan: Plan
    folder: Path
    place: Place
    ledger: Ledger
    scheduler: str | None
    retry_failed: bool


def _worst_cases(work: _Work, jobs: Sequence[Job]) -> set[int]:
    """Numbers of the cases that the sweep's `[time] by` says are the worst, of jobs of the frequency domain.

    Raises
    ------
    ScenarioError
        When no statistic matches.
    """
    by, count = work.sweep.file.time.by, work.sweep.file.time.worst or 0
    layouts = work.ledger.layouts()
    names = {name for layout in layouts.values() for name in layout.names}
    chosen = set(matching_names(sorted(names), [by]))
    if not chosen and names:
        raise ScenarioError(
            f"{work.sweep.path}: time.by = '{by}' matches no statistic of the frequency domain; write it as "
            "platform.position.surge.expected_maximum"
        )
    lowest = by.endswith("minimum")
    ranking = {number: np.array([name in chosen for name in layout.names]) for number, layout in layouts.items()}
    numbers = {job.key: job.case for job in jobs}
    ranked = []
    for done in work.ledger.finished([job.key for job in jobs if job.domain == "frequency"]):
        values = done.values[ranking[done.layout]] if not done.error else np.zeros(0)
        values = values[np.isfinite(values)]
        if len(values):
            ranked.append((float(values.min()) if lowest else -float(values.max()), numbers[done.key]))
    return {case for _, case in sorted(ranked)[:count]}


def _do(
    work: _Work, jobs: Sequence[Job], client: Callable[[], Client], progress: Progress, more: int, before: int
) -> None:
    """Do those of the jobs that are not done; for the progress, `before` jobs were before and `more` come after."""
    known = work.ledger.errors([job.key for job in jobs])
    failed = sum(1 for error in known.values() if error)
    if work.retry_failed:
        known = {key: error for key, error in known.items() if not error}
        failed = 0
    pending = [job for job in jobs if job.key not in known]
    done, total = before + len(jobs) - len(pending), before + len(jobs) + more
    progress(done, total, failed)
    if not pending:
        return
    tasks = _Tasks(work, client(), pending)
    for outcomes in tasks.outcomes():
        for each in outcomes:
            stored(work.folder, each)
        work.ledger.record(outcomes)
        done += len(outcomes)
        failed += sum(1 for each in outcomes if each.error)
        progress(done, total, failed)
    work.ledger.commit()


class _Tasks:
    """The jobs of a sweep as tasks of a cluster."""

    def __init__(self, work: _Work, client: Client, jobs: Sequence[Job]) -> None:
        self._work = work
        self._client = client
        self._jobs = jobs
        self._prepared: OrderedDict[str, Future] = OrderedDict()
        self._threads, self._counted = 0, -math.inf

    def outcomes(self) -> Iterator[list[Outcome]]:
        """Outcomes as they come, some at a time.

        Raises
        ------
        TlpsimError
            When a worker refuses the sweep.
        CancelledError
            When the cluster is lost.
        """
        suspects: list[Job] = []
        yield from self._flow(self._jobs, suspects)
        for job in suspects:
            yield from self._flow([job], None)

    def _flow(self, jobs: Sequence[Job], suspects: list[Job] | None) -> Iterator[list[Outcome]]:
        """Outcomes of jobs; of those under which workers died, where there is no list of suspects to add them to."""
        waiting = iter(jobs)
        under_way: dict[str, Job] = {}
        running = as_completed(loop=self._client.loop, with_results=True, raise_errors=False)

        def submit(count: int) -> None:
            for future, job in self._submitted(list(islice(waiting, count)), alone=suspects is None):
                under_way[str(future.key)] = job
                running.add(future)

        window = self._window()
        submit(window)
        for batch in running.batches():
            found = []
            for future, result in batch:
                job = under_way.pop(str(future.key))
                outcome = self._outcome(job, future, result)
                if outcome is not None:
                    found.append(outcome)
                elif suspects is None:
                    told = f"{DEATHS} workers died at this job, while nothing else ran; for want of memory perhaps"
                    found.append(Outcome(key=job.key, error=told, values=np.zeros(0), seconds=0.0))
                else:
                    suspects.append(job)
            yield found
            if len(under_way) <= window * 3 // 4:
                window = self._window()
                submit(window - len(under_way))

    def _window(self) -> int:
        """Jobs that are with the scheduler at a time, by the threads of the cluster as they were lately."""
        if monotonic() - self._counted > RECOUNT:
            self._counted = monotonic()
            self._threads = sum(self._client.nthreads().values())
        return max(LEAST_WINDOW, WINDOW * self._threads)

    def _submitted(self, jobs: Sequence[Job], alone: bool) -> Iterator[tuple[Future, Job]]:
        """Futures of jobs, of which those that need as many preparations go to the scheduler together."""
        alike: dict[int, list[tuple[Job, Order, list[Future]]]] = {}
        for job in jobs:
            scenario = self._work.sweep.scenario(self._work.plan.cases[job.case], job)
            needs = self._preparations(job, scenario)
            alike.setdefault(len(needs), []).append((job, self._order(job, scenario), needs))
        for group in alike.values():
            own, orders, needs_of = zip(*group, strict=True)
            keys = [f"{'alone' if alone else 'job'}-{job.key}" for job in own]
            yield from zip(self._client.map(perform, orders, *zip(*needs_of, strict=True), key=keys), own, strict=True)

    def _order(self, job: Job, scenario: Scenario) -> Order:
        work = self._work
        keeps = job.domain in work.sweep.file.files
        return Order(
            key=job.key,
            domain=job.domain,
            scenario=scenario.to_json(),
            statistics=work.sweep.file.statistics,
            engine=work.sweep.file.time.engine,
            file=f"cases/{job.key[:2]}/{job.key}.h5" if keeps else "",
            place=work.place,
            version=program_version(),
        )

    def _preparations(self, job: Job, scenario: Scenario) -> list[Future]:
        """Tasks that make what a job shares with others."""
        found = []
        hydrodynamics = prepared.hydrodynamics_key(scenario)
        if hydrodynamics:
            found.append(self._task(hydrodynamics, prepared.prepare_hydrodynamics, scenario.to_json))
        for path, key in prepared.file_keys(scenario).items():
            found.append(self._task(key, prepared.prepare_file, partial(str, path), path.read_bytes))
        if job.domain == "time":
            before = list(found)
            for which, key in prepared.fit_keys(scenario).items():
                found.append(self._task(key, prepared.prepare_fits, partial(str, which), scenario.to_json, *before))
        return found

    def _task(self, key: str, make: Callable[..., Prepared], *given: Callable[[], str | bytes] | Future) -> Future:
        """The task of a key, of arguments that are made if it is not known."""
        if key not in self._prepared:
            arguments = [each if isinstance(each, Future) else each() for each in given]
            self._prepared[key] = self._client.submit(make, *arguments, key=key)
        self._prepared.move_to_end(key)
        while len(self._prepared) > PREPARED:
            self._prepared.popitem(last=False)
        return self._prepared[key]

    def _outcome(self, job: Job, future: Future, result: Any) -> Outcome | None:
        """Outcome of a finished task, with its error where the task itself failed; None where workers died at it."""
        if future.status == "finished":
            return result
        if future.status != "error":
            raise CancelledError(future.key)
        error = future.exception()
        if isinstance(error, CancelledError | CommClosedError | VersionError):
            raise error
        if isinstance(error, KilledWorker):
            return None
        return Outcome(key=job.key, error=error_text(error), values=np.zeros(0), seconds=0.0)
