"""A scenario without FMUs: the models of the built-in components in one loop, `tlpsim run --monolithic`.

The loop is that of `tlpsim.loads.simulation`: it takes the smallest of the components' steps, and the forces of wind
and waves at the platform's own position and velocity. `[coupling]`, `inputs_at` and the filters of connections have
no effect in it. Seeds, models, and the names, units and times of the outputs are those of the co-simulation of the same
scenario, so that the difference of two results files is the error of the coupling.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tlpsim.fmus.component import Component as Fmi
from tlpsim.fmus.platform_fmu import TlpsimPlatform, platform_model
from tlpsim.fmus.wave_fmu import TlpsimWave
from tlpsim.fmus.wind_fmu import TlpsimWind
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.motion import PlatformModel, set_intact
from tlpsim.loads.platform.points import move_points
from tlpsim.loads.simulation import CoupledModel, Record, simulate, start
from tlpsim.orchestrator.clock import to_seconds, to_ticks
from tlpsim.orchestrator.execution import ComponentSummary, RunSummary
from tlpsim.orchestrator.instance import PythonInstance, Variable, checked_parameters
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.system import Component, System
from tlpsim.scenarios.assemble import blamed_on, start_in_equilibrium, wave_loads, wind_loads
from tlpsim.scenarios.monolithic_events import stretches
from tlpsim.scenarios.parameters import parameter_values, standard_parameters
from tlpsim.scenarios.reading import expand
from tlpsim.scenarios.results_writer import ResultsWriter
from tlpsim.scenarios.schema import STANDARD_CONNECTIONS, Scenario
from tlpsim.scenarios.sections import BUILTIN

FloatArray = NDArray[np.float64]

MONOLITHIC = "monolithic"
"""Attribute `run` of the results file and of its groups."""
COMPONENTS: Mapping[str, type[Fmi]] = {"wind": TlpsimWind, "wave": TlpsimWave, "platform": TlpsimPlatform}
_OPTIONAL = {"platform.elevation": "wave.elevation"}  # a connection that the loop can have and a scenario need not
_KEPT = 0.5  # a tendon is lost below this, halfway between the two values of its input
_LOADS = ("wind_force", "wave_force", "external_force")
_SOURCES = {"wind_force": "wind", "wave_force": "wave", "external_force": ""}


class MonolithicWriter(ResultsWriter):
    """Writer of a results file that says that it comes from a monolithic run."""

    def started(self, system: System) -> None:
        """Create the file and mark it; see `ResultsWriter`."""
        super().started(system)
        assert self._file is not None
        self._file.attrs["run"] = MONOLITHIC


class _Declared(PythonInstance):
    """The variables of a component, for observers; it is never stepped."""

    def __init__(self, name: str) -> None:
        super().__init__(name, _never)
        self.variables = _variables(name)

    def describe(self) -> dict[str, str]:
        return {"run": MONOLITHIC, "fmu": "", "model_name": COMPONENTS[self.name].__name__}


def _never(values: object, time: float, size: float) -> None:
    raise NotImplementedError("the components of a monolithic run are not stepped")


def _variables(name: str) -> dict[str, Variable]:
    return {
        each.name: Variable(
            name=each.name,
            causality=each.causality,
            variability=each.variability,
            type=each.kind,
            unit=each.unit,
            description=each.description,
            start=each.start,
            derivative_of=each.derivative_of,
        )
        for each in COMPONENTS[name].table
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Twin:
    """A scenario as one model.

    Attributes
    ----------
    model
        Platform, wind, waves and constant loads.
    position, velocity
        Of the platform at the start, (6,) m, rad and per second.
    intact
        False for a tendon that is lost, (tendons,).
    points
        Of the platform, from the reference point, (n, 3) m.
    elevation
        Of the sea below point 1, m, for the air gap; None takes that of the waves.
    step
        In ns.
    """

    model: CoupledModel
    position: FloatArray
    velocity: FloatArray
    intact: NDArray[np.bool_]
    points: FloatArray
    elevation: float | None
    step: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """What a scenario's built-in components come to, whatever is made of them.

    Attributes
    ----------
    parameters
        Of each component, by the names of its FMU.
    platform
        The platform with all of its tendons.
    intact
        False for a tendon that is lost, (tendons,).
    external
        Constant loads, (6,) N, N·m.
    points
        Of the platform, from the reference point, (n, 3) m.
    """

    parameters: dict[str, dict[str, Any]]
    platform: PlatformModel
    intact: NDArray[np.bool_]
    external: FloatArray
    points: FloatArray


def parts(scenario: Scenario, what: str = "a monolithic run") -> Parts:
    """Parameters and platform of a scenario of built-in components in their standard wiring.

    Parameters
    ----------
    scenario
        What to look at.
    what
        Is to be made of it, for the messages.

    Raises
    ------
    ScenarioError
        When the scenario has a component, a name or a connection that only a co-simulation can have, or a parameter is
        out of range.
    WiringError
        When a parameter does not exist or is of the wrong type.
    """
    _require_standard(scenario, what)
    parameters = {
        name: standard_parameters(scenario, name) | checked_parameters(name, _variables(name), entry.parameters)
        for name, entry in scenario.components.items()
    }
    value = parameter_values(TlpsimPlatform, parameters["platform"])
    with blamed_on("platform"):
        platform = platform_model(value)
    count = len(platform.tendons.pretension)
    given = [prefix for prefix in _LOADS if _SOURCES[prefix] not in scenario.components]
    return Parts(
        parameters=parameters,
        platform=platform,
        intact=np.array([value(f"tendon_intact[{k + 1}]") > _KEPT for k in range(count)], dtype=np.bool_),
        external=np.sum([_six(value, prefix) for prefix in given], axis=0),
        points=_points(value),
    )


def twin(scenario: Scenario) -> Twin:
    """The models of a scenario's built-in components as one.

    Raises
    ------
    ScenarioError, WiringError
        As `parts`.
    """
    found = parts(scenario)
    wind, waves = wind_loads(scenario), wave_loads(scenario)
    if scenario.simulation.start == "equilibrium":
        start_in_equilibrium(scenario, found.parameters, wind)
    value = parameter_values(TlpsimPlatform, found.parameters["platform"])
    connected = {f"{wire.target}.{wire.target_variable}" for wire in scenario.wiring()}
    return Twin(
        model=CoupledModel(platform=found.platform, wind=wind, waves=waves, external=found.external),
        position=_six(value, "initial_position"),
        velocity=_six(value, "initial_velocity"),
        intact=found.intact,
        points=found.points,
        elevation=None if "platform.elevation" in connected else float(value("elevation")),
        step=min(to_ticks(entry.step, f"components.{name}.step") for name, entry in scenario.components.items()),
    )


def _six(value: Callable[[str], Any], prefix: str) -> FloatArray:
    return np.array([value(f"{prefix}.{degree}") for degree in DEGREES_OF_FREEDOM], dtype=np.float64)


def _points(value: Callable[[str], Any]) -> FloatArray:
    names = [each.name for each in TlpsimPlatform.table if each.name.startswith("point[")]
    return np.array([value(name) for name in names], dtype=np.float64).reshape(-1, 3)


def _require_standard(scenario: Scenario, what: str) -> None:
    """Refuse what is not made of the built-in components in their standard wiring."""
    for name, entry in scenario.components.items():
        if entry.fmu != f"{BUILTIN}{name}":
            raise ScenarioError(
                f"components.{name}: {entry.fmu} cannot be part of {what}, which has the built-in "
                f"{', '.join(COMPONENTS)} under these names only; run the scenario as a co-simulation"
            )
        if entry.map:
            raise ScenarioError(
                f"components.{name}.map: other names of variables mean nothing in {what}; leave them out or "
                "run the scenario as a co-simulation"
            )
    if "platform" not in scenario.components:
        raise ScenarioError(f"components.platform: {what} needs the platform, and the scenario has none")
    wanted = {
        target: entry["from"]
        for target, entry in expand(STANDARD_CONNECTIONS).items()
        if {target.partition(".")[0], entry["from"].partition(".")[0]} <= set(scenario.components)
    }
    found = {f"{w.target}.{w.target_variable}": f"{w.source}.{w.source_variable}" for w in scenario.wiring()}
    odd = sorted((wanted.items() ^ found.items()) - _OPTIONAL.items())
    if odd:
        target = odd[0][0]
        raise ScenarioError(
            f"connections: {target} comes from {found.get(target, 'nowhere')}, and in {what} from "
            f"{wanted.get(target, 'nowhere')}; leave this connection out or run the scenario as a co-simulation"
        )
    for wire in scenario.wiring():
        if (wire.factor, wire.offset) != (1.0, 0.0):
            raise ScenarioError(
                f"connections: {wire.target}.{wire.target_variable} has a factor or an offset, which mean nothing in "
                f"{what}; leave them out or run the scenario as a co-simulation"
            )


def run_monolithic(scenario: Scenario, observers: Sequence[Observer]) -> RunSummary:
    """Run a scenario in one loop; observers get the samples that those of its co-simulation get.

    Raises
    ------
    TlpsimError
        As `twin`, and `StepError` when the motion does not converge.
    """
    began = perf_counter()
    whole = twin(scenario)
    system = System(
        components=tuple(
            Component(instance=_Declared(name), step=to_ticks(entry.step, f"components.{name}.step"))
            for name, entry in scenario.components.items()
        )
    )
    stop = to_ticks(scenario.simulation.duration, "simulation.duration")
    reason: BaseException | None = None
    now = 0
    try:
        state = start(whole.model, whole.position, whole.velocity, whole.intact)
        step, steps = to_seconds(whole.step), stop // whole.step
        plan = list(stretches(scenario, whole.model, whole.step, steps))
        for observer in observers:
            observer.started(system)
        for stretch in plan:
            whole = replace(whole, model=stretch.model)
            intact = state.intact.copy()
            for number, kept in stretch.intact.items():
                intact[number - 1] = kept
            set_intact(stretch.model.platform, state, intact)
            count = stretch.last - stretch.first
            with closing(simulate(stretch.model, state, step=step, steps=count, first=stretch.first)) as records:
                for record in records:
                    _tell(whole, record, system, observers)
                    now = (record.first + len(record.position) - 1) * whole.step
    except BaseException as error:
        reason = error
        raise
    finally:
        summary = _summary(system, now, perf_counter() - began)
        for observer in observers:
            observer.stopped(reason, summary)
    return summary


def _summary(system: System, now: int, wall_time: float) -> RunSummary:
    """What happened; the time that a single component took is not known, NaN."""
    components = tuple(
        ComponentSummary(
            name=component.name,
            steps=now // component.step,
            time=now // component.step * component.step,
            wall_time=float("nan"),
        )
        for component in system.components
    )
    return RunSummary(start=0, stop=now, components=components, wall_time=wall_time, initialization_sweeps=0, notes=())


# Samples of the components


def _tell(whole: Twin, record: Record, system: System, observers: Sequence[Observer]) -> None:
    """Give observers the samples of a record, each component's at its own step."""
    for index, component in enumerate(system.components):
        stride = component.step // whole.step
        skipped = -record.first % stride
        if skipped >= len(record.position):
            continue
        table = _OUTPUTS[component.name](whole, record, slice(skipped, None, stride))
        names = [name for name, each in component.instance.variables.items() if each.causality == "output"]
        missing = [name for name in names if name not in table]
        if missing:
            raise ScenarioError(f"components.{component.name}: a monolithic run does not know the output {missing[0]}")
        values = np.column_stack([table[name] for name in names])
        times = (record.first + skipped) * whole.step + component.step * np.arange(len(values))
        for observer in observers:
            observer.sampled(index, times, values)


def _named(prefix: str, values: FloatArray) -> dict[str, FloatArray]:
    return {f"{prefix}.{degree}": values[:, i] for i, degree in enumerate(DEGREES_OF_FREEDOM)}


def _wind(whole: Twin, record: Record, rows: slice) -> dict[str, FloatArray]:
    return {**_named("force", record.wind_force[rows]), "wind_speed": record.wind_speed[rows]}


def _wave(whole: Twin, record: Record, rows: slice) -> dict[str, FloatArray]:
    found = _named("force", record.wave_force[rows])
    for name, part in record.wave_parts.items():
        found |= _named(name, part[rows])
    return {**found, "elevation": record.elevation[rows]}


def _platform(whole: Twin, record: Record, rows: slice) -> dict[str, FloatArray]:
    position, velocity, acceleration = (
        getattr(record, name)[rows] for name in ("position", "velocity", "acceleration")
    )
    found = _named("position", position) | _named("velocity", velocity) | _named("acceleration", acceleration)
    none = np.zeros(len(position))
    for name, tensions in (("tendon_tension", record.tensions), ("tendon_bottom_tension", record.bottom_tensions)):
        for k in range(sum(each.name.startswith(f"{name}[") for each in TlpsimPlatform.table)):
            found[f"{name}[{k + 1}]"] = tensions[rows, k] if k < tensions.shape[1] else none
    places, changes = (np.empty((len(position), *whole.points.shape)) for _ in range(2))
    _move(whole.points, position, velocity, acceleration, places, changes)
    for k in range(len(whole.points)):
        for i, axis in enumerate("xyz"):
            found[f"point_position[{k + 1}].{axis}"] = places[:, k, i]
            found[f"point_acceleration[{k + 1}].{axis}"] = changes[:, k, i]
    elevation = record.elevation[rows] if whole.elevation is None else whole.elevation
    return {**found, "airgap": places[:, 0, 2] - elevation}


_OUTPUTS = {"wind": _wind, "wave": _wave, "platform": _platform}


@njit(cache=True)
def _move(points, position, velocity, acceleration, places, changes):  # type: ignore[no-untyped-def]
    """Positions and accelerations of points, (m, n, 3), at m times."""
    for k in range(position.shape[0]):
        move_points(points, position[k], velocity[k], acceleration[k], places[k], changes[k])
