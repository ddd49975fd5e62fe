"""From a scenario to a system: FMUs, their parameters, their wiring, and where the platform starts.

The sections `[wind]`, `[waves]`, … become parameters of the component of that name. A built-in FMU has them all; of
another FMU those are set that it has, and a warning names the others. What `components.NAME.parameters` gives goes over
them and must exist.
"""

from __future__ import annotations

import functools
import json
import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import platformdirs
from numpy.typing import NDArray
from pydantic import BaseModel

from tlpsim.fmus.build import built_in
from tlpsim.fmus.component import Component as Fmi
from tlpsim.fmus.tables import record_to_json
from tlpsim.loads import issc_tlp
from tlpsim.loads.constants import DEGREES_OF_FREEDOM, MORISON
from tlpsim.loads.errors import SolverError, TlpsimError
from tlpsim.loads.platform.tendons import Tendons, submerged_weight
from tlpsim.orchestrator.clock import to_ticks
from tlpsim.orchestrator.fmi.description import read_description
from tlpsim.orchestrator.fmi.ode import SolverOptions
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.instance import Instance
from tlpsim.orchestrator.isolation import IsolatedInstance
from tlpsim.orchestrator.system import Adaptation, Component, Connection, Iteration, System, check, loops
from tlpsim.orchestrator.table import TableInstance
from tlpsim.scenarios.reading import expand
from tlpsim.scenarios.schema import STANDARD_CONNECTIONS, Scenario, Wire
from tlpsim.scenarios.sections import BUILTIN
from tlpsim.scenarios.sections import Component as Entry

if TYPE_CHECKING:
    from tlpsim.loads.hydro.excitation import WaveLoads
    from tlpsim.loads.wind.force import WindLoads

Parameters = dict[str, Any]

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
    from tlpsim.loads.bem.issc import issc_problem
    from tlpsim.scenarios.console import messages
    from tlpsim.scenarios.hydro import frequency_bar

    site = scenario.site
    problem = issc_problem(site.water_depth, site.water_density, site.gravity, _hull(scenario))
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


# Parameters of the contract's components, from the scenario's sections


def _wind(scenario: Scenario) -> Parameters:
    wind = scenario.wind
    return {
        "mean_speed": wind.speed,
        "heading": math.radians(wind.heading_deg),
        "profile": wind.profile,
        "profile_exponent": wind.profile_exponent,
        "roughness": wind.roughness,
        "air_density": scenario.site.air_density,
        "spectrum": wind.spectrum,
        **{f"coherence.{name}": value for name, value in wind.coherence},
        "admittance": wind.admittance,
        "decomposition": wind.decomposition,
        "yaw_dependent_area": wind.yaw_dependent_area,
        "sampling_step": wind.sampling_step,
        **{f"orders.{name}": value for name, value in wind.orders},
        "seed": scenario.seeds()["wind"],
        "segments": _columns(wind.segments),
        "boxes": _columns(wind.boxes),
    }


def _columns(rows: Sequence[BaseModel] | None) -> str:
    """Rows of a table as an FMU takes them: a JSON object of columns; "" for no table."""
    if not rows:
        return ""
    return json.dumps({name: [getattr(row, name) for row in rows] for name in type(rows[0]).model_fields})


def _wave(scenario: Scenario) -> Parameters:
    waves, site = scenario.waves, scenario.site
    return {
        "spectrum": waves.spectrum,
        "significant_height": waves.significant_height,
        "peak_period": waves.peak_period,
        "peak_enhancement": waves.peak_enhancement,
        "spectrum_table": waves.table.model_dump_json() if waves.table is not None else "",
        "heading": math.radians(waves.heading_deg),
        "directions": waves.directions,
        "spreading_exponent": waves.spreading_exponent,
        "generator": waves.generator,
        "sampling_step": waves.sampling_step,
        **{f"orders.{name}": order for name, order in waves.orders},
        "frequency_min": waves.frequency_min,
        "frequency_max": waves.frequency_max,
        "components": waves.components,
        "displaced_position": waves.displaced_position,
        "seed": scenario.seeds()["wave"],
        "water_depth": site.water_depth,
        "water_density": site.water_density,
        "gravity": site.gravity,
        **_current(scenario),
        "doppler": scenario.current.doppler,
        "drift": waves.drift,
        "quadratic_transfer": waves.quadratic_transfer or "",
        "drift_damping": waves.drift_damping,
        "splash": waves.splash,
        "stretching": waves.stretching,
        "hydrodynamics": _hydrodynamics(scenario),
        "hull": _hull_text(scenario),
        "drag_coefficient": scenario.platform.drag_coefficient,
    }


def _current(scenario: Scenario) -> Parameters:
    """The current, for the wave and the platform FMU."""
    profile = _current_profile(scenario)
    return {
        "current_speed": 0.0 if profile else scenario.current.speed,
        "current_heading": math.radians(scenario.current.heading_deg),
        "current_profile": profile,
    }


def _current_profile(scenario: Scenario) -> str:
    """The parameter `current_profile`, "" for a uniform current."""
    current, table = scenario.current, scenario.current.table
    if table is None and current.exponent == 0.0:
        return ""
    shape: dict[str, Any] = {"stretched": current.stretched}
    if table is None:
        shape |= {"exponent": current.exponent, "water_depth": scenario.site.water_depth}
        rows = {"depth": [0.0], "speed": [current.speed], "heading": [math.radians(current.heading_deg)]}
    else:
        headings = [math.radians(heading) for heading in table.heading_deg]
        rows = {"depth": list(table.depth), "speed": list(table.speed), "heading": headings}
    return json.dumps(rows | shape)


def _hydrodynamics(scenario: Scenario) -> str:
    """The parameter `hydrodynamics` of the wave and the platform FMU, for which the ISSC TLP's database is ""."""
    name = scenario.platform.hydrodynamics
    return "" if name == scenario.platform.model else name


def _hull(scenario: Scenario) -> issc_tlp.Hull:
    platform = scenario.platform
    return issc_tlp.Hull(**{each.name: getattr(platform, each.name) for each in fields(issc_tlp.Hull)})


def _hull_text(scenario: Scenario) -> str:
    """The parameter `hull` of the wave and the platform FMU, "" for the ISSC TLP."""
    hull = _hull(scenario)
    return "" if hull == issc_tlp.ISSC else record_to_json(hull)


def _database_note(scenario: Scenario) -> str:
    """What the first-order forces and the radiation of a run are made from."""
    platform, site = scenario.platform, scenario.site
    if platform.hydrodynamics == MORISON:
        return "hydrodynamics: Morison's inertia force and constant added mass"
    name = platform.hydrodynamics
    if name == platform.model:
        hull = f"draught {platform.draught:g} m, {platform.mass:g} kg, in " if _hull_text(scenario) else ""
        water = f"{site.water_depth:g} m, {site.water_density:g} kg/m3"
        name = f"database of {name} for {hull}{water}, made on first use and kept in the user's cache"
    drift = "" if scenario.waves.quadratic_transfer is None else f"; slow drift: {scenario.waves.quadratic_transfer}"
    return f"hydrodynamics: {name}; radiation: {platform.radiation}{drift}"


def _platform(scenario: Scenario) -> Parameters:
    site, hull = scenario.site, _hull(scenario)
    ratios = zip(DEGREES_OF_FREEDOM, scenario.platform.damping_ratios, strict=True)
    return {
        **{f"damping_ratio.{degree}": ratio for degree, ratio in ratios},
        "mass": hull.mass,
        "centre_of_gravity.z": hull.centre_of_gravity,
        **{f"inertia.{axis}": hull.roll_inertia for axis in "xy"},
        "inertia.z": hull.yaw_inertia,
        "displaced_volume": issc_tlp.displaced_volume(hull.draught),
        "centre_of_buoyancy.z": issc_tlp.centre_of_buoyancy_height(hull.draught),
        "point[2].z": -hull.draught,
        "water_density": site.water_density,
        "gravity": site.gravity,
        "water_depth": site.water_depth,
        "hydrodynamics": _hydrodynamics(scenario),
        "hull": _hull_text(scenario),
        "radiation": scenario.platform.radiation,
        **_current(scenario),
        "tendons": record_to_json(_tendons(scenario, hull)),
    }


def _tendons(scenario: Scenario, hull: issc_tlp.Hull) -> Tendons:
    site, given = scenario.site, scenario.platform.tendons
    pretension = given.pretension or issc_tlp.balancing_pretension(site.water_density, site.gravity, hull)
    weight = submerged_weight(given.mass_per_length, given.diameter, site.water_density, site.gravity)
    tubes = {
        "mass_per_length": given.mass_per_length,
        "submerged_weight": float(weight),
        "diameter": given.diameter,
        "drag_coefficient": given.drag_coefficient,
        "added_mass_coefficient": issc_tlp.TENDON_ADDED_MASS_COEFFICIENT,
    }
    columns = {name: np.atleast_1d(value) for name, value in tubes.items()}
    return issc_tlp.tendons(site.water_depth, pretension, columns, given.axial_stiffness, hull.draught)


STANDARD: Mapping[str, Callable[[Scenario], Parameters]] = {"wind": _wind, "wave": _wave, "platform": _platform}


def standard_parameters(scenario: Scenario, name: str) -> Parameters:
    """Parameters that the scenario's sections give a component, by the FMU's own names."""
    if name not in STANDARD:
        return {}
    entry = scenario.components[name]
    return {entry.own_name(key): value for key, value in STANDARD[name](scenario).items()}


def _parameters(scenario: Scenario, name: str, instance: Instance) -> Parameters:
    entry = scenario.components[name]
    standard = standard_parameters(scenario, name)
    if not entry.fmu.startswith(BUILTIN):
        standard = {key: value for key, value in standard.items() if key in instance.variables}
    return standard | {entry.own_name(key): value for key, value in entry.parameters.items()}


def parameter_values(component: type[Fmi], parameters: Parameters) -> Callable[[str], Any]:
    """Parameter values of a built-in component by name, with its own defaults."""
    defaults = {variable.name: variable.start for variable in component.table}
    return (defaults | parameters).__getitem__


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


def wave_loads(scenario: Scenario) -> WaveLoads | None:
    """The loads that this project's wave FMU will make; None where the waves are another FMU or none.

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
        return wave_model(parameter_values(TlpsimWave, standard_parameters(scenario, "wave") | entry.parameters))


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
