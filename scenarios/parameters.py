"""Parameters of the contract's components from a scenario's sections: `[wind]`, `[waves]`, … by the FMUs' own names."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel

from tlpsim.fmus.component import Component as Fmi
from tlpsim.fmus.tables import record_to_json
from tlpsim.loads import issc_tlp
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.platform.tendons import Tendons, submerged_weight
from tlpsim.scenarios.schema import Scenario

if TYPE_CHECKING:
    from tlpsim.loads.bem.database import Problem

Parameters = dict[str, Any]


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
        **current_parameters(scenario),
        "doppler": scenario.current.doppler,
        "drift": waves.drift,
        "quadratic_transfer": waves.quadratic_transfer or "",
        "drift_damping": waves.drift_damping,
        "splash": waves.splash,
        "stretching": waves.stretching,
        "hydrodynamics": _hydrodynamics(scenario),
        "hull": hull_text(scenario),
        "drag_coefficient": scenario.platform.drag_coefficient,
    }


def current_parameters(scenario: Scenario) -> Parameters:
    """The current, among the parameters of the wave and the platform FMU."""
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


def scenario_hull(scenario: Scenario) -> issc_tlp.Hull:
    """The hull of `[platform]`."""
    platform = scenario.platform
    return issc_tlp.Hull(**{each.name: getattr(platform, each.name) for each in fields(issc_tlp.Hull)})


def hull_text(scenario: Scenario) -> str:
    """The parameter `hull` of the wave and the platform FMU, "" for the ISSC TLP."""
    hull = scenario_hull(scenario)
    return "" if hull == issc_tlp.ISSC else record_to_json(hull)


def hydrodynamic_problem(scenario: Scenario) -> Problem:
    """What the boundary elements solve for the hull in the water of the site."""
    from tlpsim.loads.bem.issc import issc_problem

    site = scenario.site
    return issc_problem(site.water_depth, site.water_density, site.gravity, scenario_hull(scenario))


def _platform(scenario: Scenario) -> Parameters:
    site, hull = scenario.site, scenario_hull(scenario)
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
        "hull": hull_text(scenario),
        "radiation": scenario.platform.radiation,
        **current_parameters(scenario),
        "tendons": record_to_json(scenario_tendons(scenario)),
    }


def scenario_tendons(scenario: Scenario) -> Tendons:
    """The tethers of `[platform.tendons]`, from the keel to the sea bed."""
    site, given, hull = scenario.site, scenario.platform.tendons, scenario_hull(scenario)
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


def parameter_values(component: type[Fmi], parameters: Parameters) -> Callable[[str], Any]:
    """Parameter values of a built-in component by name, with its own defaults."""
    defaults = {variable.name: variable.start for variable in component.table}
    return (defaults | parameters).__getitem__
