"""What the command line shows: progress, the summary by degree of freedom, a system, an FMU, a results file."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from tlpsim.orchestrator.clock import NANOSECONDS_PER_SECOND, to_seconds
from tlpsim.orchestrator.fmi import log as fmu_log
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.system import System, loops

if TYPE_CHECKING:
    from tlpsim.orchestrator.execution import RunSummary
    from tlpsim.orchestrator.fmi.description import FmuDescription
    from tlpsim.orchestrator.isolation import IsolatedInstance
    from tlpsim.scenarios.results import Results

REFRESH = 0.1  # s of wall time between two drawings of the progress bar
_MOST_MESSAGES = 10  # of one FMU, that differ

output = Console(highlight=False)
messages = Console(stderr=True, highlight=False)


class ProgressBar(Observer):
    """Draws simulated time, speed and time left, now and then; shows what FMUs warn of."""

    def __init__(self, progress: Progress, duration: float, begin: float) -> None:
        self._progress = progress
        self._begin = begin
        self._task = progress.add_task("starting", total=duration, speed="")
        progress.update(self._task, completed=begin)
        self._interrupted = False
        self._began = self._drawn = monotonic()
        self._shown: dict[str, set[tuple[int, str]]] = {}
        self._apart: list[IsolatedInstance] = []

    def interrupt(self, *_: object) -> None:
        """Handler of Ctrl-C: the run ends at the next sample, since an exception inside an FMU would be its failure."""
        self._interrupted = True

    def started(self, system: System) -> None:
        """Take the time from here: loading is over."""
        from tlpsim.orchestrator.isolation import IsolatedInstance

        self._began = monotonic()
        self._apart = [each.instance for each in system.components if isinstance(each.instance, IsolatedInstance)]

    def sampled(self, index: int, times: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        """Draw when it is time to; end the run when it was interrupted."""
        if self._interrupted:
            raise KeyboardInterrupt
        now = monotonic()
        time = times[-1] / NANOSECONDS_PER_SECOND
        if now - self._drawn >= REFRESH and time > self._begin:
            self._drawn = now
            self._draw(time, now)

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
        messages.print(f"tlpsim: {message.component}: {said}", markup=False, soft_wrap=True)

    def _draw(self, time: float, now: float) -> None:
        total = self._progress.tasks[0].total or time
        speed = f"{(time - self._begin) / (now - self._began):,.0f} × real time"
        self._progress.update(
            self._task, completed=min(time, total), description=f"{time:,.0f} of {total:,.0f} s", speed=speed
        )
        self._progress.refresh()


@contextmanager
def progress_bar(duration: float, begin: float = 0.0) -> Iterator[ProgressBar]:
    """Progress bar on the error stream, for a run up to a time (s); Ctrl-C ends the run in good order.

    Warnings and worse that FMUs log are shown meanwhile, each once.

    Parameters
    ----------
    duration
        Time at the end of the run, s.
    begin
        Time at which the run goes on, s.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[speed]}"), TimeRemainingColumn())
    # Drawn by hand: a drawing thread would take time from the FMUs, which run in this process.
    quiet = not messages.is_terminal
    with Progress(*columns, console=messages, auto_refresh=False, transient=True, disable=quiet) as progress:
        bar = ProgressBar(progress, duration, begin)
        before = signal.signal(signal.SIGINT, bar.interrupt)
        fmu_log.follow(bar.tell)
        try:
            yield bar
        finally:
            fmu_log.unfollow(bar.tell)
            signal.signal(signal.SIGINT, before)


def print_summary(results: Results) -> None:
    """Response by degree of freedom, as in the paper's Table I, and extreme tensions; all outputs of other systems."""
    if not results.has_scenario:
        _print_statistics(results)
        return
    from tlpsim.scenarios.statistics.summary import summary

    found = summary(results)
    table = Table(title=f"{results.title}: {found.description}; frequencies in Hz")
    table.add_column("", no_wrap=True)
    for heading in ("mean", "std\n<0.022", "std\n0.022–0.2", "std", "min", "max"):
        table.add_column(heading, justify="right")
    for row in found.motions:
        numbers = (row.mean, row.low_frequency, row.wave_frequency, row.std, row.minimum, row.maximum)
        table.add_row(f"{row.name}, {row.unit}", *(_number(value) for value in numbers))
    output.print(table)
    for line in found.lines:
        output.print(line)


def _print_statistics(results: Results) -> None:
    """Mean, extremes and standard deviation of each output over the whole run."""
    table = Table(title=results.title)
    table.add_column("output", no_wrap=True)
    for heading in ("mean", "min", "max", "std", "unit"):
        table.add_column(heading, justify="left" if heading == "unit" else "right")
    for component in results.components:
        for variable in results.signals(component):
            values = results.signal(f"{component}.{variable}")
            found = (values.mean(), values.min(), values.max(), values.std()) if len(values) else ()
            cells = [f"{value:.6g}" for value in found] or ["–"] * 4
            table.add_row(f"{component}.{variable}", *cells, results.unit(f"{component}.{variable}"))
    output.print(table)


def print_system(title: str, system: System, notes: Sequence[str], origins: Mapping[str, str]) -> None:
    """Components with their origins by name and steps, connections with their filters, loops and notes."""
    cycles = loops(system)
    components = Table(title=f"{title}: components")
    for heading in ("component", "FMU", "step (s)", "inputs", "outputs", "in a loop with"):
        components.add_column(heading)
    for component in system.components:
        variables = component.instance.variables.values()
        partners = {name for loop in cycles if component.name in loop for name in loop} - {component.name}
        components.add_row(
            component.name,
            origins[component.name],
            f"{to_seconds(component.step):g}",
            str(sum(variable.causality == "input" for variable in variables)),
            str(sum(variable.causality == "output" for variable in variables)),
            ", ".join(sorted(partners)),
        )
    output.print(components)
    connections = Table(title="connections")
    for heading in ("from", "to", "filter", "extrapolation"):
        connections.add_column(heading)
    for connection in system.connections:
        connections.add_row(
            f"{connection.source}.{connection.source_variable}",
            f"{connection.target}.{connection.target_variable}",
            connection.filter,
            connection.extrapolation,
        )
    output.print(connections)
    for note in notes:
        output.print(f"note: {note}")


def print_fmu(description: FmuDescription) -> None:
    """Identity and variables of an FMU."""
    output.print(f"{description.path}: {description.model_name}, FMI {description.fmi_version} co-simulation")
    output.print(f"made by {description.generation_tool or 'an unnamed tool'}; SHA-256 {description.sha256}")
    table = Table()
    table.add_column("variable", no_wrap=True)
    for heading in ("causality", "type", "unit", "start", "description"):
        table.add_column(heading, overflow="fold")
    for variable in description.variables.values():
        start = "" if variable.start is None or variable.causality == "output" else str(variable.start)
        table.add_row(
            variable.name, variable.causality, variable.type, variable.unit or "", start, variable.description
        )
    output.print(table)


def print_results(results: Results) -> None:
    """Origin of a results file, its signals, and the summary of a complete one."""
    output.print(f"{results.path}: {results.title}; {results.status}")
    if results.has_scenario:
        output.print("seeds: " + ", ".join(f"{name} {seed}" for name, seed in results.seeds.items()))
    output.print("versions: " + ", ".join(f"{name} {version}" for name, version in results.versions.items()))
    table = Table()
    table.add_column("signal", no_wrap=True)
    for heading in ("unit", "samples", "description"):
        table.add_column(heading, overflow="fold")
    for component in results.components:
        count = str(len(results.time(component)))
        for variable in results.signals(component):
            name = f"{component}.{variable}"
            table.add_row(name, results.unit(name), count, results.description(name))
    output.print(table)
    if results.complete:
        print_summary(results)


def _number(value: float) -> str:
    return "–" if np.isnan(value) else f"{value:.3f}"
