"""The wave FMU: first-order inertia, drag and current forces on the hull's members."""

import ctypes

# pythonfmu 0.7 gives back, at every instantiation, a reference to this module's globals that it never took.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))

from collections.abc import Callable  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from tlpsim.fmus.component import Component, Variable, six  # noqa: E402
from tlpsim.fmus.tables import record_from_json  # noqa: E402
from tlpsim.loads.hydro.excitation import WaveLoads, mean_current_force  # noqa: E402
from tlpsim.loads.hydro.issc_members import issc_members  # noqa: E402
from tlpsim.loads.hydro.morison import DEFAULT_WATER_DENSITY, Members  # noqa: E402
from tlpsim.loads.waves.airy import STANDARD_GRAVITY  # noqa: E402
from tlpsim.loads.waves.field import WaveComponents, calm_water, wave_components  # noqa: E402

_FORCE = ("N", "N.m")
_MOTION = ("position.*", "velocity.*")


def _scalar(name: str, unit: str, value: float, description: str) -> Variable:
    return Variable(name=name, causality="parameter", unit=unit, start=value, description=description)


def wave_model(parameter: Callable[[str], Any]) -> WaveLoads:
    """Wave loads from the FMU's parameters, of which `parameter` gives the value by name."""
    return WaveLoads(
        components=_components(parameter),
        members=_members(parameter),
        water_density=parameter("water_density"),
        current_speed=parameter("current_speed"),
        current_heading=parameter("current_heading"),
        displaced_position=parameter("displaced_position"),
    )


def current_force(parameter: Callable[[str], Any]) -> NDArray[np.float64]:
    """Drag of the current alone on a platform at rest, (6,) N, N·m, from the FMU's parameters."""
    return mean_current_force(
        _members(parameter),
        current_speed=parameter("current_speed"),
        current_heading=parameter("current_heading"),
        water_density=parameter("water_density"),
    )


def _members(parameter: Callable[[str], Any]) -> Members:
    members = parameter("members")
    return record_from_json(Members, members, "members") if members else issc_members()


def _components(parameter: Callable[[str], Any]) -> WaveComponents:
    water_depth, gravity = parameter("water_depth"), parameter("gravity")
    if parameter("significant_height") == 0.0:
        return calm_water(water_depth=water_depth, gravity=gravity)
    return wave_components(
        spectrum=parameter("spectrum"),
        significant_height=parameter("significant_height"),
        peak_period=parameter("peak_period"),
        peak_enhancement=parameter("peak_enhancement"),
        heading=parameter("heading"),
        water_depth=water_depth,
        lowest_frequency=parameter("frequency_min"),
        highest_frequency=parameter("frequency_max"),
        count=parameter("components"),
        seed=parameter("seed"),
        gravity=gravity,
    )


class TlpsimWave(Component):
    """Adapter over `tlpsim.loads.waves` and `tlpsim.loads.hydro`."""

    description = "Wave and current forces on a moving platform: Morison inertia and relative-velocity drag"
    table = (
        *six("position", "input", "position of the platform", ("m", "rad")),
        *six("velocity", "input", "velocity of the platform", ("m/s", "rad/s")),
        *six("force", "output", "sum of diffraction, viscous and drift", _FORCE, depends_on=_MOTION),
        *six("diffraction", "output", "first-order wave force", _FORCE, depends_on=("position.*",)),
        *six("viscous", "output", "drag of waves and current", _FORCE, depends_on=_MOTION),
        *six("drift", "output", "second-order potential drift; zero in this version", _FORCE),
        Variable(
            name="elevation",
            causality="output",
            unit="m",
            description="undisturbed wave elevation at the platform's reference point",
            depends_on=("position.*",),
        ),
        _scalar("significant_height", "m", 7.0, "Hs; zero is calm water"),
        _scalar("peak_period", "s", 14.0, "Tp"),
        _scalar("peak_enhancement", "1", 3.3, "gamma of the JONSWAP spectrum"),
        _scalar("heading", "rad", 0.0, "direction toward which the waves travel"),
        _scalar("frequency_min", "Hz", 0.02, "lowest wave frequency"),
        _scalar("frequency_max", "Hz", 0.35, "highest wave frequency"),
        _scalar("water_depth", "m", 450.0, "depth of the water"),
        _scalar("water_density", "kg/m3", DEFAULT_WATER_DENSITY, "density of the water"),
        _scalar("gravity", "m/s2", STANDARD_GRAVITY, "acceleration of gravity"),
        _scalar("current_speed", "m/s", 0.0, "speed of the current, uniform over the depth"),
        _scalar("current_heading", "rad", 0.0, "direction toward which the current flows"),
        Variable(
            name="components",
            causality="parameter",
            kind="Integer",
            start=400,
            description="number of wave components",
        ),
        Variable(name="seed", causality="parameter", kind="Integer", start=1, description="realization"),
        Variable(
            name="displaced_position",
            causality="parameter",
            kind="Boolean",
            start=True,
            description="take the waves at the platform's displaced position",
        ),
        Variable(
            name="spectrum",
            causality="parameter",
            kind="String",
            start="jonswap",
            description="wave spectrum: jonswap or pierson_moskowitz",
        ),
        Variable(
            name="members",
            causality="parameter",
            kind="String",
            start="",
            description="JSON object of the columns of the members' table (start, end, across, width, area, "
            "drag_coefficient, added_mass_coefficient, end_pressure, end_added_mass_coefficient); empty: ISSC TLP",
        ),
    )

    def prepare(self) -> None:
        """Draw the sea and take views of the variables."""
        self.model = wave_model(self.parameter)
        self.position = self.view("position.")
        self.velocity = self.view("velocity.")
        self.force = self.view("force.")
        self.diffraction = self.view("diffraction.")
        self.viscous = self.view("viscous.")
        self.elevation = self.view("elevation")

    def start(self, time: float) -> None:
        """Forces and elevation at `time`; the model keeps no state."""
        forces = self.model.evaluate(time, self.position, self.velocity)
        self.diffraction[:] = forces.diffraction
        self.viscous[:] = forces.viscous
        self.force[:] = self.diffraction + self.viscous
        self.elevation[0] = forces.elevation

    def advance(self, time: float, step: float) -> None:
        """Forces and elevation at the end of the step."""
        self.start(time + step)
