"""The models behind the wave FMU from its parameters, of which `parameter` gives the value by name.

The frequency domain takes the same pieces (`tlpsim.fmus.spectral`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.fmus.current import current_of
from tlpsim.fmus.hull import hull_of
from tlpsim.fmus.tables import record_from_json
from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.issc import database_by_name
from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer, quadratic_transfer_by_name
from tlpsim.loads.constants import MORISON
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.arma import Orders
from tlpsim.loads.hydro.diffraction import band_of_energy, excitation, require_coverage, require_site
from tlpsim.loads.hydro.displaced_drift import quadratic_kernel_without, without_displaced_position
from tlpsim.loads.hydro.drift import (
    Kernel,
    mean_drift_force,
    mean_quadratic_force,
    quadratic_kernel,
    wave_drift_damping,
)
from tlpsim.loads.hydro.excitation import WaveLoads, mean_current_force
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import Members
from tlpsim.loads.hydro.quadratic_filters import DriftFilters, newman_filters, quadratic_filters
from tlpsim.loads.hydro.splash import largest_elevation
from tlpsim.loads.waves.current import current_velocity
from tlpsim.loads.waves.doppler import delay_ratio, sea_in_current
from tlpsim.loads.waves.elevation import OFFSET_ALLOWANCE, ArmaSea
from tlpsim.loads.waves.field import calm_water, wave_components
from tlpsim.loads.waves.sea import Sea, SeaState
from tlpsim.loads.waves.spectra import SpectrumTable

QTF = "qtf"
"""Value of the parameter `drift` for a quadratic transfer function from a file."""
DRIFTS: Mapping[str, str | None] = {"newman": "arithmetic", "newman_geometric": "geometric", QTF: None, "none": None}
"""Values of the parameter `drift`, and the mean of Newman's approximation that each takes."""
DRIFT_REACH = 150.0
"""m, least reach of the kernels: quadratic filters of drift swing faster over frequency than forces do."""


def wave_model(parameter: Callable[[str], Any], sea: Sea | None = None) -> WaveLoads:
    """Wave loads from the FMU's parameters, of which `parameter` gives the value by name.

    Parameters
    ----------
    parameter
        Value by name.
    sea
        A realization that goes on, at the place in its record where it is; made from the parameters without it.

    Raises
    ------
    ScenarioError
        For a parameter that is out of range, and for a sea that goes on while it rides on the current that changed.
    """
    members, database, current = hull_members(parameter), wave_database(parameter), current_of(parameter)
    if sea is not None and parameter("doppler"):
        raise ScenarioError(
            "parameter doppler: waves that ride on a current cannot have it changed while they run; switch it off"
        )
    sea = realized_sea(parameter, members) if sea is None else sea
    splash = parameter("splash") and parameter("significant_height") > 0.0
    doppler = parameter("doppler") and current is not None
    drift = _drift(parameter, database, sea_in_current(sea, current) if doppler and current else sea)
    return WaveLoads(
        sea=sea,
        members=members,
        water_density=parameter("water_density"),
        current=current,
        displaced_position=parameter("displaced_position"),
        excitation=None if database is None else excitation(database),
        splash=splash,
        stretching=parameter("stretching"),
        largest_elevation=largest_elevation(sea_state(parameter)) if splash else 0.0,
        doppler=doppler,
        drift=drift,
        drift_damping=None if drift is None or database is None else drift_damping(parameter, database),
    )


def _drift(parameter: Callable[[str], Any], database: HydrodynamicDatabase | None, sea: Sea) -> DriftFilters | None:
    """Filters of the slow drift; None for no slow drift."""
    source = drift_source(parameter, database)
    if isinstance(source, tuple):
        return newman_filters(source[0], sea, source[1])
    return None if source is None else quadratic_filters(source, sea, sea_state(parameter))


def drift_source(
    parameter: Callable[[str], Any], database: HydrodynamicDatabase | None
) -> Kernel | tuple[HydrodynamicDatabase, str] | None:
    """What slow drift is made of: T of a table, or a database and Newman's mean; None for no slow drift.

    Where first-order forces are taken at the displaced position, it is without what these make.
    """
    table, mean, moving = quadratic_table(parameter), newman_mean(parameter), None
    if parameter("displaced_position") and database is not None:
        moving = replace(database, depth=parameter("water_depth"), gravity=parameter("gravity"))
    if table is not None:
        return quadratic_kernel(table) if moving is None else quadratic_kernel_without(table, moving)
    if database is None or mean is None:
        return None
    return database if moving is None else without_displaced_position(moving), mean


def drift_damping(parameter: Callable[[str], Any], database: HydrodynamicDatabase) -> NDArray[np.float64] | None:
    """Wave drift damping, (6, 6); None where it is switched off."""
    if not parameter("drift_damping"):
        return None
    try:
        return wave_drift_damping(database, sea_state(parameter))
    except ScenarioError as error:
        raise ScenarioError(f"{error}; or switch it off, drift_damping = false") from error


def newman_mean(parameter: Callable[[str], Any]) -> str | None:
    """Which of Newman's means the parameter `drift` names; None for no slow drift."""
    name = parameter("drift")
    if name not in DRIFTS:
        raise ScenarioError(f"parameter drift is {name!r}; it must be one of {', '.join(DRIFTS)}")
    return DRIFTS[name]


def wave_database(parameter: Callable[[str], Any]) -> HydrodynamicDatabase | None:
    """Hydrodynamic database for this sea; None for Morison's inertia force, and in calm water."""
    name = parameter("hydrodynamics")
    if name == MORISON or parameter("significant_height") == 0.0:
        return None
    if parameter("members") and not name:
        raise ScenarioError(
            "parameter members gives a hull of its own, but parameter hydrodynamics is empty, which is the database "
            f"of the ISSC TLP; name that hull's database file, or take {MORISON!r}"
        )
    depth, density, gravity = (parameter(key) for key in ("water_depth", "water_density", "gravity"))
    database = database_by_name(name, depth, density, gravity, hull_of(parameter))
    _require_fit(database, parameter, f"hydrodynamic database {name or 'of the ISSC TLP'}")
    return database


def _require_fit(data: HydrodynamicDatabase | QuadraticTransfer, parameter: Callable[[str], Any], label: str) -> None:
    """Check that data are for the water of the site and cover the waves."""
    depth, density, gravity = (parameter(key) for key in ("water_depth", "water_density", "gravity"))
    state = sea_state(parameter)
    lowest = 2.0 * np.pi * band_of_energy(state)[0]
    require_site(data, depth=depth, density=density, gravity=gravity, frequency=lowest, name=label)
    require_coverage(data, state, label)


def quadratic_table(parameter: Callable[[str], Any]) -> QuadraticTransfer | None:
    """Quadratic transfer function of the slow drift; None where it is not from one, and in calm water."""
    name, drift = parameter("quadratic_transfer"), parameter("drift")
    if drift != QTF and name:
        raise ScenarioError(
            f"parameter quadratic_transfer is {name!r} beside drift {drift!r}; take {QTF!r}, or leave out the file"
        )
    if drift != QTF:
        return None
    if not name:
        raise ScenarioError(
            f"parameter drift is {QTF!r}, and quadratic_transfer is empty; give the path of a quadratic transfer "
            "function, as `tlpsim bem HULL -o DATABASE.h5 --qtf FILE.h5` makes it, or of WAMIT's .12d"
        )
    if parameter("significant_height") == 0.0:
        return None
    table = quadratic_transfer_by_name(name, parameter("water_density"), parameter("gravity"))
    _require_fit(table, parameter, f"quadratic transfer function {name}")
    return table


def mean_force(parameter: Callable[[str], Any]) -> NDArray[np.float64]:
    """Drag of the current in calm water and mean drift, (6,) N, N·m, from the FMU's parameters."""
    current, database = current_of(parameter), wave_database(parameter)
    force = mean_current_force(hull_members(parameter), current=current, water_density=parameter("water_density"))
    table, mean = quadratic_table(parameter), newman_mean(parameter)
    if table is not None:
        force = force + mean_quadratic_force(quadratic_kernel(table), sea_state(parameter))
    elif database is not None and mean is not None:
        force = force + mean_drift_force(database, sea_state(parameter))
    if database is not None and (table is not None or mean is not None):
        damping = drift_damping(parameter, database)
        if damping is not None and current is not None and parameter("doppler"):
            force = force + damping[:, :3] @ current_velocity(current, np.zeros(1))[0]
    return force


def hull_members(parameter: Callable[[str], Any]) -> Members:
    """The hull's members from the FMU's parameters."""
    members = parameter("members")
    if members:
        return record_from_json(Members, members, "members")
    return issc_members(parameter("drag_coefficient"), hull_of(parameter).draught)


def realized_sea(parameter: Callable[[str], Any], members: Members) -> Sea:
    """The realization of the sea about a hull, from the FMU's parameters."""
    generator = parameter("generator")
    if generator not in GENERATORS:
        raise ScenarioError(f"parameter generator is {generator!r}; it must be one of {', '.join(GENERATORS)}")
    if parameter("significant_height") == 0.0:
        return calm_water(water_depth=parameter("water_depth"), gravity=parameter("gravity"))
    return GENERATORS[generator](parameter, sea_state(parameter), members)


def sea_state(parameter: Callable[[str], Any]) -> SeaState:
    """Statistics of the sea from the FMU's parameters."""
    table = parameter("spectrum_table")
    return SeaState(
        spectrum=parameter("spectrum"),
        significant_height=parameter("significant_height"),
        peak_period=parameter("peak_period"),
        peak_enhancement=parameter("peak_enhancement"),
        table=record_from_json(SpectrumTable, table, "spectrum_table") if table else None,
        heading=parameter("heading"),
        directions=parameter("directions"),
        spreading_exponent=parameter("spreading_exponent"),
        water_depth=parameter("water_depth"),
        lowest_frequency=parameter("frequency_min"),
        highest_frequency=parameter("frequency_max"),
        gravity=parameter("gravity"),
    )


def _arma(parameter: Callable[[str], Any], state: SeaState, members: Members) -> Sea:
    ends = np.vstack([members.start, members.end])
    # With or without drift, so that one seed is one sea.
    reach = max(float(np.hypot(ends[:, 0], ends[:, 1]).max()) + OFFSET_ALLOWANCE, DRIFT_REACH)
    current = current_of(parameter)
    if parameter("doppler") and current is not None:
        heading, depth, gravity = (parameter(key) for key in ("heading", "water_depth", "gravity"))
        reach *= max(1.0, delay_ratio(current, parameter("frequency_max"), heading, depth, gravity))
    return ArmaSea(
        state,
        sampling_step=parameter("sampling_step"),
        orders=Orders(
            long=parameter("orders.long"),
            autoregressive=parameter("orders.autoregressive"),
            moving_average=parameter("orders.moving_average"),
        ),
        reach=reach,
        seed=parameter("seed"),
    )


def _harmonic(parameter: Callable[[str], Any], state: SeaState, members: Members) -> Sea:
    return wave_components(state, count=parameter("components"), seed=parameter("seed"))


GENERATORS = {"arma": _arma, "harmonic": _harmonic}
