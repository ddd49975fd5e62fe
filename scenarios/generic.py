"""Systems without a platform in them: an .ssp or .ssd file, or FMUs and connections of the command line.

``a.y=b.u`` connects the output y of the component a to the input u of b; ``NAME=FILE.fmu`` names a component, which
is called after its file otherwise.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from pathlib import Path

from tlpsim.loads.errors import ScenarioError, TlpsimError
from tlpsim.orchestrator.checkpoint import Checkpoints
from tlpsim.orchestrator.clock import to_positive_ticks, to_seconds, to_ticks
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.fmi.description import read_description
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.instance import nearest_match
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.ssp.annotations import SystemDescription
from tlpsim.orchestrator.ssp.read import read_ssp
from tlpsim.orchestrator.ssp.write import write_ssp
from tlpsim.orchestrator.system import Component, Connection, System, expanded
from tlpsim.orchestrator.table import TABLE_ENDING, TableInstance
from tlpsim.scenarios.quantities import TIME
from tlpsim.scenarios.reading import parse_override
from tlpsim.scenarios.recording import Recording
from tlpsim.scenarios.results import Results, open_results
from tlpsim.scenarios.results_writer import ResultsWriter
from tlpsim.scenarios.schema import Scenario

DESCRIPTIONS = (".ssp", ".ssd")
"""Endings of system descriptions."""


def seconds(text: str, option: str) -> float:
    """Time in s of the text of an option, with or without a unit.

    Raises
    ------
    ScenarioError
        If the text is none.
    """
    try:
        return TIME.parse(text)
    except ValueError as error:
        raise ScenarioError(f"{option} is '{text}': {error}") from None


@contextmanager
def opened(
    files: Sequence[str], connect: Sequence[str] = (), steps: Sequence[str] = (), settings: Sequence[str] = ()
) -> Iterator[SystemDescription]:
    """Open a system, and free its instances at the end.

    Parameters
    ----------
    files
        One .ssp or .ssd file, or FMUs as FILE.fmu or NAME=FILE.fmu, and tables (.csv) likewise.
    connect
        Connections COMPONENT.OUTPUT=COMPONENT.INPUT, beside those of a description.
    steps
        STEP for the components that have none by a description, or COMPONENT=STEP, which goes over it.
    settings
        Parameters COMPONENT.PARAMETER=VALUE, which go over those of a description.

    Raises
    ------
    TlpsimError
        If a text is not of its form, names no component, or a file cannot be read.
    """
    given = dict(_split_step(text) for text in steps)
    default = given.pop("", None)
    if any(Path(file).suffix.lower() in DESCRIPTIONS for file in files):
        if len(files) > 1:
            raise ScenarioError(f"{', '.join(files)}: a system description stands alone; give one file")
        description = read_ssp(files[0], open_fmu, default, given)
    else:
        description = _of_fmus(files, default, given)
    components = description.system.components
    try:
        names = [component.name for component in components]
        for name in given:
            _require_component(name, names, "--step")
        parameters: dict[str, dict[str, object]] = {}
        for text in settings:
            end, value = _setting(text, names)
            parameters.setdefault(end[0], {})[end[1]] = value
        changed = [
            replace(component, parameters={**component.parameters, **parameters.get(component.name, {})})
            for component in components
        ]
        connections = (*description.system.connections, *(_connection(text, names) for text in connect))
        system = replace(description.system, components=tuple(changed), connections=connections)
        yield replace(description, system=expanded(system))
    finally:
        for component in components:
            with suppress(Exception):
                component.instance.free()


def run_system(
    description: SystemDescription,
    destination: str | Path,
    stop: float | None = None,
    start: float | None = None,
    observers: Sequence[Observer] = (),
    checkpoints: Checkpoints | None = None,
) -> Results:
    """Run a system and open its results.

    Parameters
    ----------
    description
        What to run; its instances cannot be used again.
    destination
        Results file (HDF5), as of `tlpsim.scenarios.run.run_scenario`.
    stop, start
        Stop and start time in s; those of the description where not given, and a start at 0.
    observers
        Who else gets the samples as they come.
    checkpoints
        Where the state of the run is kept, see `tlpsim.scenarios.resume.checkpointed`.

    Raises
    ------
    TlpsimError
        When a time is missing, or the system, an FMU, a step or the destination is at fault.
    """
    begin, end = experiment(description, stop, start)
    recording = Recording(
        title=description.name, end=to_ticks(end, "stop time"), attributes={"system": record(description.system)}
    )
    writer = ResultsWriter(destination, recording)
    try:
        first = to_ticks(begin, "start time")
        run(description.system, recording.end, first, observers=[writer, *observers], checkpoints=checkpoints)
    except TlpsimError as error:
        if not writer.has_started:
            raise
        raise type(error)(f"{error}; the samples so far are in {writer.part_path}") from error
    return open_results(destination)


def experiment(description: SystemDescription, stop: float | None, start: float | None) -> tuple[float, float]:
    """Start and stop time in s; what is not given is the description's.

    Raises
    ------
    ScenarioError
        If neither has a stop time.
    """
    end = description.stop if stop is None else stop
    if end is None:
        raise ScenarioError(f"{description.name}: there is no default stop time; give one with --stop")
    begin = description.start if start is None else start
    return (0.0 if begin is None else begin), end


def export(scenario: Scenario, destination: str | Path) -> Path:
    """Write the system that a scenario stands for as an .ssp or .ssd file, with its duration as stop time.

    Raises
    ------
    TlpsimError
        As `tlpsim.scenarios.assemble.assembled` and `tlpsim.orchestrator.ssp.write.write_ssp`.
    """
    from tlpsim.scenarios.assemble import assembled

    with assembled(scenario) as assembly:
        description = SystemDescription(
            name=scenario.title, system=assembly.system, start=0.0, stop=scenario.simulation.duration
        )
        return write_ssp(description, destination)


def record(system: System) -> str:
    """A system as JSON for the record of a run: components with steps (s) and parameters, and connections."""
    return json.dumps(
        {
            "components": {
                component.name: {
                    "step": to_seconds(component.step),
                    "inputs_at": component.inputs_at,
                    "parameters": dict(component.parameters),
                }
                for component in system.components
            },
            "connections": [asdict(connection) for connection in system.connections],
            "algorithm": system.algorithm,
        },
        default=lambda value: value.item(),
    )


def _of_fmus(files: Sequence[str], default: float | None, steps: Mapping[str, float]) -> SystemDescription:
    """System of FMUs without any connection."""
    components: dict[str, Component] = {}
    for text in files:
        name, equals, file = text.partition("=")
        path = Path(file if equals else text)
        name = name if equals else path.stem
        is_table = path.suffix.lower() == TABLE_ENDING
        if path.suffix.lower() != ".fmu" and not is_table:
            raise ScenarioError(
                f"'{text}' is neither a scenario (.toml), a system description (.ssp, .ssd) nor an FMU; "
                f"give FILE.fmu or NAME=FILE.fmu, or a table, FILE{TABLE_ENDING}"
            )
        if name in components:
            raise ScenarioError(f"there are two components '{name}'; name one of them: other={path}")
        table = TableInstance(name, path) if is_table else None
        step = steps.get(name, default)
        if step is None:
            step = table.table.step if table else read_description(path).default_experiment.get("stepSize")
        if step is None:
            raise ScenarioError(
                f"component '{name}': its {'table' if table else 'FMU'} has no default step; give one with --step 0.1 "
                f"or --step {name}=0.1"
            )
        ticks = to_positive_ticks(step, f"step of '{name}'")
        components[name] = Component(instance=table or open_fmu(name, path), step=ticks)
    return SystemDescription(name=", ".join(components), system=System(components=tuple(components.values())))


def _split_step(text: str) -> tuple[str, float]:
    name, _, step = text.rpartition("=")
    return name, seconds(step, "--step")


def _require_component(name: str, names: Sequence[str], option: str) -> None:
    if name not in names:
        raise ScenarioError(
            f"{option}: there is no component '{name}'{nearest_match(name, names)}; the components are "
            f"{', '.join(names)}"
        )


def _end(text: str, names: Sequence[str], option: str) -> tuple[str, str]:
    """Component and variable; the name of a component of a nested system has dots, too."""
    found = max((name for name in names if text.startswith(f"{name}.")), key=len, default="")
    if not found:
        if "." not in text:
            raise ScenarioError(f"{option}: '{text}' is not of the form COMPONENT.VARIABLE")
        _require_component(text.partition(".")[0], names, option)
    return found, text[len(found) + 1 :]


def _connection(text: str, names: Sequence[str]) -> Connection:
    source, equals, target = text.partition("=")
    if not equals:
        raise ScenarioError(f"--connect: '{text}' is not of the form a.y=b.u, output first")
    start, end = _end(source.strip(), names, "--connect"), _end(target.strip(), names, "--connect")
    return Connection(source=start[0], source_variable=start[1], target=end[0], target_variable=end[1])


def _setting(text: str, names: Sequence[str]) -> tuple[tuple[str, str], object]:
    name, _, value = text.partition("=")
    read = parse_override(f"value={value}")["value"]
    return _end(name.strip(), names, "--set"), read
