"""How far a command is: a bar in a terminal, elsewhere a line now and then; Ctrl-C and SIGTERM meanwhile.

A line comes after `INTERVAL` at the earliest, so that short runs have none; then with each tenth of the whole, and of
very long runs every `LONGEST_SILENCE`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from tlpsim.orchestrator.clock import NANOSECONDS_PER_SECOND
from tlpsim.orchestrator.fmi import log as fmu_log
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.system import System
from tlpsim.scenarios.interruption import interrupts_told
from tlpsim.scenarios.terminal import complain, messages

if TYPE_CHECKING:
    from tlpsim.orchestrator.execution import RunSummary
    from tlpsim.orchestrator.isolation import IsolatedInstance

REFRESH = 0.1
"""Wall time between two drawings of the bar of a run, s."""
INTERVAL = 10.0
"""Least wall time between two lines, s."""
LONGEST_SILENCE = 600.0
"""Wall time after which there is a line in any case, s."""
PART = 0.1
"""Of the whole, between two lines."""
_MOST_MESSAGES = 10  # of one FMU, that differ

Show = Callable[[float, float, str], None]
"""Shows how far something is: what is done, the whole, and both in words."""


class Lines:
    """Progress where there is no terminal."""

    def __init__(self) -> None:
        self._begin: tuple[float, float] | None = None  # wall time and what was done
        self._last = (0.0, 0.0)

    def show(self, done: float, total: float, text: str) -> None:
        """Print a line where one is due, with the time left at the mean speed so far."""
        now = monotonic()
        if self._begin is None:
            self._begin = self._last = now, done
            return
        silence, further = now - self._last[0], done - self._last[1]
        first = self._last == self._begin
        due = first or further >= PART * total or silence >= LONGEST_SILENCE
        if not due or silence < INTERVAL or done >= total:
            return
        self._last = now, done
        made = done - self._begin[1]
        left = f", {spoken((total - done) * (now - self._begin[0]) / made)} left" if made > 0.0 else ""
        messages.print(f"tlpsim: {text}{left}", markup=False, soft_wrap=True)


def spoken(seconds: float) -> str:
    """Time in s for people: 3 s, 12 min, 2 h 5 min."""
    minutes = round(seconds / 60.0)
    if seconds < 99.5:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"


@contextmanager
def progress_shown(start: str, animated: bool = True) -> Iterator[Show]:
    """Show progress on the error stream while the block lasts.

    Parameters
    ----------
    start
        What is shown before the first number.
    animated
        Whether a thread draws the bar all the time; it takes time from what runs in this process.
    """
    if not messages.is_interactive or messages.quiet:
        yield Lines().show
        return
    columns = TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn()
    with Progress(*columns, console=messages, auto_refresh=animated, transient=True) as progress:
        task = progress.add_task(start, total=None)

        def show(done: float, total: float, text: str) -> None:
            progress.update(task, completed=min(done, total), total=total, description=text, refresh=not animated)

        yield show


@contextmanager
def case_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Progress of cases of a name, such as records, to be called with how many are done and how many there are."""
    with progress_shown("starting") as show:
        yield lambda done, total: show(done, total, f"{done} of {total} {what}")


@contextmanager
def frequency_bar(what: str = "radiation and diffraction") -> Iterator[Callable[[int, int], None]]:
    """Progress of a computation, to be called with the number of frequencies done and their total.

    Ctrl-C and SIGTERM end the block by KeyboardInterrupt, also where compiled code makes an error of its own of it or
    loses it.
    """
    asked: KeyboardInterrupt | None = None

    def interrupt(reason: KeyboardInterrupt) -> None:
        nonlocal asked
        asked = reason
        raise reason

    def tell(done: int, total: int) -> None:
        if asked is not None:
            raise asked
        show(done, total, f"{what}: {done} of {total} frequencies")

    try:
        with interrupts_told(interrupt), progress_shown("integrals of the mesh") as show:
            yield tell
    except BaseException:
        if asked is not None:
            raise asked from None
        raise


class RunWatcher(Observer):
    """Shows simulated time and speed, and what FMUs warn of; ends the run in good order when it was interrupted."""

    def __init__(self, show: Show, duration: float, begin: float) -> None:
        self._show = show
        self._duration = duration
        self._begin = begin
        self._interrupted: KeyboardInterrupt | None = None
        self._began = self._drawn = monotonic()
        self._shown: dict[str, set[tuple[int, str]]] = {}
        self._apart: list[IsolatedInstance] = []

    def interrupt(self, reason: KeyboardInterrupt) -> None:
        """End the run at the next sample, since an exception inside an FMU would be its failure."""
        self._interrupted = reason

    def started(self, system: System) -> None:
        """Take the time from here: loading is over."""
        from tlpsim.orchestrator.isolation import IsolatedInstance

        self._began = monotonic()
        self._show(self._begin, self._duration, "starting")
        self._apart = [each.instance for each in system.components if isinstance(each.instance, IsolatedInstance)]

    def sampled(self, index: int, times: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        """Draw when it is time to; end the run when it was interrupted."""
        if self._interrupted is not None:
            raise self._interrupted
        now = monotonic()
        time = times[-1] / NANOSECONDS_PER_SECOND
        if now - self._drawn >= REFRESH and time > self._begin:
            self._drawn = now
            self._draw(min(time, self._duration), now)

    def stopped(self, reason: BaseException | None, summary: RunSummary) -> None:
        """Show what components in processes of their own have in their logs."""
        for instance in self._apart:
            for line in instance.messages:
                message = fmu_log.parsed(instance.name, line)
                if message is not None:
                    self.tell(message)

    def tell(self, message: fmu_log.Message) -> None:
        """Show a message of an FMU that is a warning or worse, unless the same was shown before at another time."""
        shown = self._shown.setdefault(message.component, set())
        if message.status < 1 or (message.status, message.text) in shown or len(shown) > _MOST_MESSAGES:
            return
        shown.add((message.status, message.text))
        said = str(message) if len(shown) <= _MOST_MESSAGES else "further messages are not shown"
        complain(f"tlpsim: {message.component}: {said}")

    def _draw(self, time: float, now: float) -> None:
        speed = (time - self._begin) / (now - self._began)
        far = ",.0f" if self._duration >= 100.0 else ".3g"
        fast = f"{speed:,.0f}" if speed >= 10.0 else f"{speed:.2g}"
        self._show(time, self._duration, f"{time:{far}} of {self._duration:{far}} s, {fast} × real time")


@contextmanager
def run_progress(duration: float, begin: float = 0.0) -> Iterator[RunWatcher]:
    """Progress of a run up to a time (s) on the error stream; Ctrl-C and SIGTERM end the run in good order.

    Warnings and worse that FMUs log are shown meanwhile, each once.

    Parameters
    ----------
    duration
        Time at the end of the run, s.
    begin
        Time at which the run goes on, s.
    """
    # Drawn by hand: a drawing thread would take time from the FMUs, which run in this process.
    with progress_shown("starting", animated=False) as show:
        watcher = RunWatcher(show, duration, begin)
        fmu_log.follow(watcher.tell)
        try:
            with interrupts_told(watcher.interrupt):
                yield watcher
        finally:
            fmu_log.unfollow(watcher.tell)
