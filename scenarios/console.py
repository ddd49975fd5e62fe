"""What the command line shows in tables: the summary by degree of freedom, a system, an FMU, a results file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.markup import escape
from rich.table import Table

from tlpsim.orchestrator.clock import to_seconds
from tlpsim.orchestrator.system import System, loops
from tlpsim.scenarios.terminal import output, say

if TYPE_CHECKING:
    from tlpsim.orchestrator.fmi.description import FmuDescription
    from tlpsim.scenarios.results import Results

_FEWEST = 2  # samples of a record that has statistics


def print_summary(results: Results) -> None:
    """Response by degree of freedom, as in the paper's Table I, and extreme tensions; all outputs of other systems."""
    if not results.has_scenario:
        _print_statistics(results)
        return
    from tlpsim.scenarios.statistics.summary import summary

    found = summary(results)
    table = Table(title=escape(f"{results.title}: {found.description}; frequencies in Hz"))
    table.add_column("", no_wrap=True)
    for heading in ("mean", "std\n<0.022", "std\n0.022–0.2", "std", "min", "max"):
        table.add_column(heading, justify="right")
    for row in found.motions:
        numbers = (row.mean, row.low_frequency, row.wave_frequency, row.std, row.minimum, row.maximum)
        table.add_row(f"{row.name}, {row.unit}", *(_number(value) for value in numbers))
    if found.motions:
        output.print(table)
    for line in found.lines:
        say(line)


def _print_statistics(results: Results) -> None:
    """Mean, extremes and standard deviation of each output over the whole run."""
    table = Table(title=escape(results.title))
    table.add_column("output", no_wrap=True)
    for heading in ("mean", "min", "max", "std", "unit"):
        table.add_column(heading, justify="left" if heading == "unit" else "right")
    for component in results.components:
        for variable in results.signals(component):
            values = results.signal(f"{component}.{variable}")
            found = (values.mean(), values.min(), values.max(), values.std()) if len(values) else ()
            cells = [f"{value:.6g}" for value in found] or ["–"] * 4
            name = f"{component}.{variable}"
            table.add_row(*(escape(cell) for cell in (name, *cells, results.unit(name))))
    output.print(table)


def print_system(title: str, system: System, notes: Sequence[str], origins: Mapping[str, str]) -> None:
    """Components with their origins by name and steps, connections with their filters, loops and notes."""
    cycles = loops(system)
    components = Table(title=escape(f"{title}: components"))
    for heading in ("component", "FMU", "step (s)", "inputs", "outputs", "in a loop with"):
        components.add_column(heading)
    for component in system.components:
        variables = component.instance.variables.values()
        partners = {name for loop in cycles if component.name in loop for name in loop} - {component.name}
        components.add_row(
            component.name,
            escape(origins[component.name]),
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
            escape(f"{connection.source}.{connection.source_variable}"),
            escape(f"{connection.target}.{connection.target_variable}"),
            connection.filter,
            connection.extrapolation,
        )
    output.print(connections)
    for note in notes:
        say(f"note: {note}")


def print_fmu(description: FmuDescription) -> None:
    """Identity and variables of an FMU."""
    say(f"{description.path}: {description.model_name}, FMI {description.fmi_version} {', '.join(description.kinds)}")
    say(f"made by {description.generation_tool or 'an unnamed tool'}; SHA-256 {description.sha256}")
    table = Table()
    table.add_column("variable", no_wrap=True)
    for heading in ("causality", "type", "unit", "start", "description"):
        table.add_column(heading, overflow="fold")
    for variable in description.variables.values():
        start = "" if variable.start is None or variable.causality == "output" else str(variable.start)
        cells = variable.name, variable.causality, variable.type, variable.unit or "", start, variable.description
        table.add_row(*(escape(cell) for cell in cells))
    output.print(table)


def print_results(results: Results) -> None:
    """Origin of a results file, its signals, and the summary of what is in it, be it complete or not."""
    say(f"{results.path}: {results.title}; {results.status}")
    if results.has_scenario:
        say("seeds: " + ", ".join(f"{name} {seed}" for name, seed in results.seeds.items()))
    say("versions: " + ", ".join(f"{name} {version}" for name, version in results.versions.items()))
    table = Table()
    table.add_column("signal", no_wrap=True)
    for heading in ("unit", "samples"):
        table.add_column(heading, no_wrap=True)
    table.add_column("description", overflow="fold")
    for component in results.components:
        count = str(len(results.time(component)))
        for variable in results.signals(component):
            name = f"{component}.{variable}"
            table.add_row(*(escape(cell) for cell in (name, results.unit(name), count, results.description(name))))
    output.print(table)
    if results.complete or all(len(results.time(component)) >= _FEWEST for component in results.components):
        print_summary(results)


def _number(value: float) -> str:
    return "–" if np.isnan(value) else f"{value:.3f}"
