"""The wave FMU: first-order diffraction force, and drag of waves and current on the hull's members.

The sea comes from digital filters (`generator` "arma") or is a sum of harmonic components ("harmonic"). The
first-order force is that of a hydrodynamic database, or Morison's inertia force on the members.
"""

import ctypes

# pythonfmu 0.7 gives back, at every instantiation, a reference to this module's globals that it never took.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))

from pathlib import Path  # noqa: E402

from tlpsim.fmus.version import built_version  # noqa: E402

built_version(Path(__file__).parent)  # before the imports that another version may not have

from collections.abc import Callable, Mapping  # noqa: E402
from dataclasses import replace  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from tlpsim.fmus.component import (  # noqa: E402
    Component,
    Variable,
    boolean_parameter,
    integer_parameter,
    real_parameter,
    six,
    text_parameter,
)
from tlpsim.fmus.current import CURRENT_PARAMETERS, current_of  # noqa: E402
from tlpsim.fmus.force_rate import RATE_STEP, Motion, force_rates  # noqa: E402
from tlpsim.fmus.hull import HULL_PARAMETER, hull_of  # noqa: E402
from tlpsim.fmus.tables import record_from_json  # noqa: E402
from tlpsim.loads.bem.database import HydrodynamicDatabase  # noqa: E402
from tlpsim.loads.bem.issc import database_by_name  # noqa: E402
from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer, quadratic_transfer_by_name  # noqa: E402
from tlpsim.loads.constants import MORISON, SEA_WATER_DENSITY, STANDARD_GRAVITY  # noqa: E402
from tlpsim.loads.errors import ScenarioError  # noqa: E402
from tlpsim.loads.filters.arma import Orders  # noqa: E402
from tlpsim.loads.filters.process import ProcessState  # noqa: E402
from tlpsim.loads.hydro.diffraction import band_of_energy, excitation, require_coverage, require_site  # noqa: E402
from tlpsim.loads.hydro.displaced_drift import quadratic_kernel_without, without_displaced_position  # noqa: E402
from tlpsim.loads.hydro.drift import (  # noqa: E402
    Kernel,
    mean_drift_force,
    mean_quadratic_force,
    quadratic_kernel,
    wave_drift_damping,
)
from tlpsim.loads.hydro.excitation import WaveLoads, mean_current_force  # noqa: E402
from tlpsim.loads.hydro.issc_members import issc_members  # noqa: E402
from tlpsim.loads.hydro.morison import Members  # noqa: E402
from tlpsim.loads.hydro.quadratic_filters import DriftFilters, newman_filters, quadratic_filters  # noqa: E402
from tlpsim.loads.hydro.splash import largest_elevation  # noqa: E402
from tlpsim.loads.issc_tlp import DRAG_COEFFICIENT  # noqa: E402
from tlpsim.loads.waves.current import current_velocity  # noqa: E402
from tlpsim.loads.waves.doppler import delay_ratio, sea_in_current  # noqa: E402
from tlpsim.loads.waves.elevation import (  # noqa: E402
    DEFAULT_ORDERS,
    DEFAULT_SAMPLING_STEP,
    OFFSET_ALLOWANCE,
    ArmaSea,
)
from tlpsim.loads.waves.field import calm_water, wave_components  # noqa: E402
from tlpsim.loads.waves.sea import Sea, SeaState  # noqa: E402
from tlpsim.loads.waves.spectra import SpectrumTable  # noqa: E402

QTF = "qtf"
"""Value of the parameter `drift` for a quadratic transfer function from a file."""
DRIFTS: Mapping[str, str | None] = {"newman": "arithmetic", "newman_geometric": "geometric", QTF: None, "none": None}
"""Values of the parameter `drift`, and the mean of Newman's approximation that each takes."""
DRIFT_REACH = 150.0
"""m, least reach of the kernels: quadratic filters of drift swing faster over frequency than forces do."""
_FORCE = ("N", "N.m")
_MOTION = ("position.*", "velocity.*")


def wave_model(parameter: Callable[[str], Any]) -> WaveLoads:
    """Wave loads from the FMU's parameters, of which `parameter` gives the value by name."""
    members, database, current = hull_members(parameter), wave_database(parameter), current_of(parameter)
    sea = _sea(parameter, members)
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


def _sea(parameter: Callable[[str], Any], members: Members) -> Sea:
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


class TlpsimWave(Component):
    """Adapter over `tlpsim.loads.waves` and `tlpsim.loads.hydro`."""

    description = "Wave and current forces on a moving platform: diffraction and relative-velocity drag"
    table = (
        *six("position", "input", "position of the platform", ("m", "rad")),
        *six("velocity", "input", "velocity of the platform", ("m/s", "rad/s")),
        *six("force", "output", "sum of the parts", _FORCE, depends_on=_MOTION),
        *force_rates(_MOTION),
        *six("diffraction", "output", "first-order wave force", _FORCE, depends_on=("position.*",)),
        *six("viscous", "output", "drag of waves and current", _FORCE, depends_on=_MOTION),
        *six("drift", "output", "slow drift of second order", _FORCE, depends_on=("position.*",)),
        *six("drift_damping", "output", "wave drift damping", _FORCE, depends_on=("velocity.*",)),
        Variable(
            name="elevation",
            causality="output",
            unit="m",
            description="undisturbed wave elevation at the platform's reference point",
            depends_on=("position.*",),
        ),
        real_parameter("significant_height", "m", 7.0, "Hs; zero is calm water, whatever the spectrum"),
        real_parameter("peak_period", "s", 14.0, "Tp"),
        real_parameter("peak_enhancement", "1", 3.3, "gamma of the JONSWAP spectrum"),
        real_parameter("heading", "rad", 0.0, "mean direction toward which the waves travel"),
        real_parameter("spreading_exponent", "1", 10.0, "s of the cos-2s spreading; no effect with one direction"),
        real_parameter("frequency_min", "Hz", 0.02, "lowest wave frequency of the generator harmonic"),
        real_parameter("frequency_max", "Hz", 0.35, "highest wave frequency"),
        real_parameter(
            "sampling_step",
            "s",
            DEFAULT_SAMPLING_STEP,
            "time between samples of the elevation of the generator arma; the realization does not depend on the "
            "macro step",
        ),
        real_parameter("water_depth", "m", 450.0, "depth of the water"),
        real_parameter("water_density", "kg/m3", SEA_WATER_DENSITY, "density of the water"),
        real_parameter("gravity", "m/s2", STANDARD_GRAVITY, "acceleration of gravity"),
        *CURRENT_PARAMETERS,
        real_parameter("drag_coefficient", "1", DRAG_COEFFICIENT, "of the ISSC TLP's columns and pontoons"),
        integer_parameter("directions", 1, "number of long-crested seas that make up the sea; 1 is long-crested"),
        integer_parameter("components", 400, "number of components a direction, of the generator harmonic"),
        integer_parameter("orders.long", DEFAULT_ORDERS.long, "order of the long autoregression"),
        integer_parameter("orders.autoregressive", DEFAULT_ORDERS.autoregressive, "p of the ARMA(p, q) elevation"),
        integer_parameter("orders.moving_average", DEFAULT_ORDERS.moving_average, "q of the ARMA(p, q) elevation"),
        integer_parameter("seed", 1, "realization"),
        boolean_parameter("displaced_position", True, "take the waves at the platform's displaced position"),
        text_parameter(
            "spectrum", "jonswap", "wave spectrum: jonswap, pierson_moskowitz or torsethaugen (wind sea and swell)"
        ),
        text_parameter(
            "spectrum_table",
            "",
            "JSON object of columns frequency (Hz) and density (m2/Hz) instead of the spectrum, its height "
            "and its period; empty: none",
        ),
        text_parameter(
            "generator", "arma", "how the sea is made: arma (digital filters) or harmonic (sum of components)"
        ),
        text_parameter(
            "hydrodynamics",
            "",
            "first-order force: path of a hydrodynamic database (.h5); morison: inertia of the members; empty: the "
            "database of the ISSC TLP, or of `hull`, for this water, computed on first use",
        ),
        HULL_PARAMETER,
        boolean_parameter("splash", True, "drag up to the surface of the waves, not to mean water level"),
        text_parameter("stretching", "vertical", "of velocities to that surface: vertical, wheeler, linear or none"),
        text_parameter(
            "drift",
            "newman",
            "slow drift: newman (Newman's approximation, arithmetic), newman_geometric, qtf (from a file) or none",
        ),
        text_parameter(
            "quadratic_transfer",
            "",
            "path of a quadratic transfer function (.h5), or of WAMIT's .10d, .11d or .12d with ULEN 1 m about the "
            "origin, for drift qtf; empty: none",
        ),
        boolean_parameter("drift_damping", True, "wave drift damping by Aranha's formula, beside slow drift"),
        boolean_parameter("doppler", False, "the waves ride on the current"),
        text_parameter(
            "members",
            "",
            "JSON object of the columns of the members' table (start, end, across, width, area, "
            "drag_coefficient, added_mass_coefficient, end_pressure, end_added_mass_coefficient); empty: those of the "
            "ISSC TLP, with the parameters drag_coefficient and hull",
        ),
    )

    def prepare(self) -> None:
        """Draw the sea and take views of the variables."""
        self.model = wave_model(self.parameter)
        self.position = self.view("position.")
        self.velocity = self.view("velocity.")
        self.force = self.view("force.")
        self.force_rate = self.view("force_rate.")
        self.motion = Motion()
        self.diffraction = self.view("diffraction.")
        self.viscous = self.view("viscous.")
        self.drift = self.view("drift.")
        self.drift_damping = self.view("drift_damping.")
        self.elevation = self.view("elevation")

    def start(self, time: float) -> None:
        """Forces and elevation at `time`."""
        self.motion.begin(self.velocity)
        self._update(time)

    def _update(self, time: float) -> None:
        forces = self.model.evaluate(time, self.position, self.velocity)
        self.diffraction[:] = forces.diffraction
        self.viscous[:] = forces.viscous
        self.drift[:] = forces.drift
        self.drift_damping[:] = forces.drift_damping
        self.force[:] = forces.total
        self.elevation[0] = forces.elevation
        h = RATE_STEP
        after = self.position + h * self.velocity, self.velocity + h * self.motion.acceleration
        self.force_rate[:] = (self.model.evaluate(time + h, *after).total - self.force) / h

    def advance(self, time: float, step: float) -> None:
        """Forces and elevation at the end of the step."""
        self.motion.advance(self.velocity, step)
        self._update(time + step)

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Windows of samples and noises of the filters, one process a direction, and the motion."""
        arrays: dict[str, NDArray[Any]] = dict(self.motion.snapshot())
        if not isinstance(self.model.sea, ArmaSea):
            return arrays
        for j, state in enumerate(self.model.sea.get_state()):
            arrays[f"index.{j}"] = np.array(state.index)
            arrays[f"samples.{j}"] = np.array(state.samples)
            arrays[f"noises.{j}"] = np.array(state.noises)
        return arrays

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Windows of samples and noises of the filters, and the motion."""
        self.motion.restore(arrays)
        if isinstance(self.model.sea, ArmaSea):
            count = sum(name.startswith("index.") for name in arrays)
            self.model.sea.set_state(
                [
                    ProcessState(
                        index=int(arrays[f"index.{j}"]), samples=arrays[f"samples.{j}"], noises=arrays[f"noises.{j}"]
                    )
                    for j in range(count)
                ]
            )
