"""From a scenario to a system: FMUs, their parameters, their wiring, and where the platform starts.

The sections `[wind]`, `[waves]`, … become parameters of the component of that name (`tlpsim.scenarios.parameters`). A
built-in FMU has them all; of another FMU those are set that it has, and a warning names the others. What
`components.NAME.parameters` gives goes over them and must exist.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import platformdirs
from numpy.typing import NDArray

from tlpsim.fmus.build import built_in
from tlpsim.loads.constants import DEGREES_OF_FREEDOM, MORISON
from tlpsim.loads.errors import SolverError, TlpsimError
from tlpsim.orchestrator.clock import to_ticks
from tlpsim.orchestrator.fmi.description import read_description
from tlpsim.orchestrator.fmi.ode import SolverOptions
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.instance import Instance
from tlpsim.orchestrator.isolation import IsolatedInstance
from tlpsim.orchestrator.system import Adaptation, Component, Connection, Iteration, System, check, loops
from tlpsim.orchestrator.table import TableInstance
from tlpsim.scenarios.events import system_events
from tlpsim.scenarios.parameters import (
    STANDARD,
    Parameters,
    hull_text,
    hydrodynamic_problem,
    parameter_values,
    standard_parameters,
)
from tlpsim.scenarios.reading import expand
from tlpsim.scenarios.schema import STANDARD_CONNECTIONS, Scenario, Wire
from tlpsim.scenarios.sections import BUILTIN
from tlpsim.scenarios.sections import Component as Entry

if TYPE_CHECKING:
    from tlpsim.loads.hydro.excitation import WaveLoads
    from tlpsim.loads.waves.sea import Sea
    from tlpsim.loads.wind.force import WindLoads

OPTIONAL = {("platform", "elevation")}
"""Inputs that stay open where an FMU in the place of one of ours has no such variable."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Assembly:
    """A system that is ready to run, and what a user may want to know about it."""

    system: System
    notes: tuple[str, ...]
    loops: tuple[frozenset[str], ...]


@contextmanager
def assembled(scenario: Scenario) -> Iterator[Assembly]:
    """Load the FMUs of a scenario, wire and check them; free them at the end.

    Raises
    ------
    FmuError
        When an FMU is missing, cannot be read or does not run here.
    WiringError
        When a parameter or a connection does not fit its FMU.
    """
    instances: dict[str, Instance] = {}
    try:
        _prepare_database(scenario)
        for name, entry in scenario.components.items():
            instances[name] = _opened(name, entry)
        parameters = {name: _parameters(scenario, name, instances[name]) for name in instances}
        # Wherever the platform starts: a poor fit of the gusts or of the elevation warns before the run.
        wind, _ = wind_loads(scenario), wave_loads(scenario)
        if scenario.simulation.start == "equilibrium":
            start_in_equilibrium(scenario, parameters, wind)
        system = System(
            components=tuple(
                Component(
                    instance=instances[name],
                    step=to_ticks(entry.step, f"components.{name}.step"),
                    parameters=parameters[name],
                    inputs_at=entry.inputs_at,
                )
                for name, entry in scenario.components.items()
            ),
            connections=_connections(scenario, instances),
            algorithm=scenario.coupling.algorithm,
            iteration=Iteration(**dict(scenario.coupling.iteration)),
            adaptation=Adaptation(**dict(scenario.coupling.adaptation)),
            threads=scenario.coupling.threads,
            events=system_events(scenario, instances),
        )
        for name in instances:
            _warn_of_left_out(scenario, name, instances[name])
        yield Assembly(
            system=system,
            notes=(_database_note(scenario), *check(system)),
            loops=tuple(frozenset(loop) for loop in loops(system)),
        )
    finally:
        for instance in instances.values():
            with suppress(Exception):
                instance.free()


def _prepare_database(scenario: Scenario) -> None:
    """Compute the platform's hydrodynamics if that was not done before, and say so: it takes a while."""
    if scenario.platform.hydrodynamics != scenario.platform.model:
        return
    if not (_is_own(scenario, "wave") or _is_own(scenario, "platform")):
        return
    from tlpsim.loads.bem.database import cache_path, cached
    from tlpsim.scenarios.progress import frequency_bar
    from tlpsim.scenarios.terminal import messages

    problem = hydrodynamic_problem(scenario)
    if not cache_path(problem).exists():
        messages.print("hydrodynamics of the ISSC TLP: computed once for this hull and water, then kept in the cache")
        with frequency_bar() as tell:
            cached(problem, progress=tell)


def _opened(name: str, entry: Entry) -> Instance:
    solver = SolverOptions(inputs="linear" if entry.inputs_at == "end" else "hold")
    open_here: Callable[[], Instance] = functools.partial(open_fmu, name, _path(entry), solver=solver)
    if entry.is_table:
        open_here = functools.partial(TableInstance, name, entry.fmu)
    return IsolatedInstance(name, open_here, entry.timeout) if entry.isolation == "process" else open_here()


def _path(entry: Entry) -> Path:
    if entry.fmu.startswith(BUILTIN):
        cache = Path(platformdirs.user_cache_dir("tlpsim", appauthor=False)) / "fmus"
        return built_in(entry.fmu.removeprefix(BUILTIN), cache)
    return Path(entry.fmu)


def _connections(scenario: Scenario, instances: Mapping[str, Instance]) -> tuple[Connection, ...]:
    components = scenario.components

    standard = expand(STANDARD_CONNECTIONS)

    def wanted(wire: Wire) -> bool:
        ends = ((wire.source, wire.source_variable), (wire.target, wire.target_variable))
        if components[wire.target].is_table and f"{wire.target}.{wire.target_variable}" in standard:
            return False  # a table has no inputs
        return (wire.target, wire.target_variable) not in OPTIONAL or all(
            components[name].own_name(variable) in instances[name].variables for name, variable in ends
        )

    return tuple(
        Connection(
            source=wire.source,
            source_variable=components[wire.source].own_name(wire.source_variable),
            target=wire.target,
            target_variable=components[wire.target].own_name(wire.target_variable),
            filter=wire.filter,
            extrapolation=wire.extrapolation,
            factor=wire.factor,
            offset=wire.offset,
            suppress_unit_conversion=wire.suppress_unit_conversion,
        )
        for wire in scenario.wiring()
        if wanted(wire)
    )


def _parameters(scenario: Scenario, name: str, instance: Instance) -> Parameters:
    entry = scenario.components[name]
    standard = standard_parameters(scenario, name)
    if not entry.fmu.startswith(BUILTIN):
        standard = {key: value for key, value in standard.items() if key in instance.variables}
    return standard | {entry.own_name(key): value for key, value in entry.parameters.items()}


def wind_loads(scenario: Scenario) -> WindLoads | None:
    """The loads that this project's wind FMU will make; None where the wind is another FMU or none.

    Raises
    ------
    ScenarioError, SolverError
        When a parameter is out of range, or the digital filter of the gusts cannot be fitted.

    Warns
    -----
    FilterFitWarning
        When that filter fits poorly.
    """
    if not _is_own(scenario, "wind"):
        return None
    from tlpsim.fmus.wind_fmu import TlpsimWind, wind_model

    entry = scenario.components["wind"]
    with blamed_on("wind"):
        return wind_model(parameter_values(TlpsimWind, standard_parameters(scenario, "wind") | entry.parameters))


def wave_loads(scenario: Scenario, sea: Sea | None = None) -> WaveLoads | None:
    """The loads that this project's wave FMU will make, of a sea that goes on if one is given.

    None where the waves are another FMU or none.

    Raises
    ------
    ScenarioError, SolverError
        When a parameter is out of range, or the digital filter of the elevation cannot be fitted.

    Warns
    -----
    FilterFitWarning
        When that filter fits poorly.
    """
    if not _is_own(scenario, "wave"):
        return None
    from tlpsim.fmus.wave_fmu import TlpsimWave
    from tlpsim.fmus.wave_parameters import wave_model

    entry = scenario.components["wave"]
    with blamed_on("wave"):
        value = parameter_values(TlpsimWave, standard_parameters(scenario, "wave") | entry.parameters)
        return wave_model(value, sea)


def _warn_of_left_out(scenario: Scenario, name: str, instance: Instance) -> None:
    missing = [key for key in standard_parameters(scenario, name) if key not in instance.variables]
    if missing and not scenario.components[name].is_table:
        warnings.warn(f"{name}: the FMU has no parameters {', '.join(missing)}; its own values hold", stacklevel=3)


# Start in equilibrium


def start_in_equilibrium(scenario: Scenario, parameters: Mapping[str, Parameters], wind: WindLoads | None) -> None:
    """Give the platform the position in which mean wind, current, drift and tethers balance.

    Only this project's own FMUs are looked into; where the platform is another one, it starts as it will.
    """
    if not _is_own(scenario, "platform") or any(
        key.startswith("initial_position.") for key in scenario.components["platform"].parameters
    ):
        return
    from tlpsim.fmus.platform_fmu import TlpsimPlatform, platform_model
    from tlpsim.fmus.wave_fmu import TlpsimWave
    from tlpsim.fmus.wave_parameters import mean_force
    from tlpsim.loads.platform.equilibrium import static_equilibrium

    force: NDArray[np.float64] = np.zeros(6)
    if _is_own(scenario, "wave"):
        with blamed_on("wave"):
            force += mean_force(parameter_values(TlpsimWave, parameters["wave"]))
    with blamed_on("platform"):
        model = platform_model(parameter_values(TlpsimPlatform, parameters["platform"]))
    try:
        position = static_equilibrium(model, force if wind is None else lambda yaw: force + wind.mean_force(yaw))
    except SolverError as error:
        raise SolverError(f'{error}; simulation.start = "rest" starts without it') from error
    parameters["platform"].update(
        {f"initial_position.{degree}": float(x) for degree, x in zip(DEGREES_OF_FREEDOM, position, strict=True)}
    )


@contextmanager
def blamed_on(name: str) -> Iterator[None]:
    """Name the component whose parameters an error is about."""
    try:
        yield
    except TlpsimError as error:
        raise type(error)(f"components.{name}: {error}") from error


def _is_own(scenario: Scenario, name: str) -> bool:
    """Whether a component of the contract is this project's own FMU, built in or from a file."""
    entry = scenario.components.get(name)
    if entry is None or name not in STANDARD or entry.is_table:
        return False
    if entry.fmu.startswith(BUILTIN):
        return entry.fmu == f"{BUILTIN}{name}"
    description = read_description(_path(entry))
    return description.generation_tool.startswith("tlpsim ") and description.model_name == f"Tlpsim{name.title()}"


def _database_note(scenario: Scenario) -> str:
    """What the first-order forces and the radiation of a run are made from."""
    platform, site = scenario.platform, scenario.site
    if platform.hydrodynamics == MORISON:
        return "hydrodynamics: Morison's inertia force and constant added mass"
    name = platform.hydrodynamics
    if name == platform.model:
        hull = f"draught {platform.draught:g} m, {platform.mass:g} kg, in " if hull_text(scenario) else ""
        water = f"{site.water_depth:g} m, {site.water_density:g} kg/m3"
        name = f"database of {name} for {hull}{water}, made on first use and kept in the user's cache"
    drift = "" if scenario.waves.quadratic_transfer is None else f"; slow drift: {scenario.waves.quadratic_transfer}"
    return f"hydrodynamics: {name}; radiation: {platform.radiation}{drift}"
