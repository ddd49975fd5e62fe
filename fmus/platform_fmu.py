"""The platform FMU: six degrees of freedom on tethers, driven by wind, wave and external forces.

Added mass and the memory of radiated waves come from a hydrodynamic database, or added mass is constant. A tether is
lost, or taken back, at the end of the communication step whose input says so: the outputs of that time are those
without it.
"""

import ctypes

# pythonfmu 0.7 gives back, at every instantiation, a reference to this module's globals that it never took.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))

from pathlib import Path  # noqa: E402

from tlpsim.fmus.version import built_version  # noqa: E402

built_version(Path(__file__).parent)  # before the imports that another version may not have

import dataclasses  # noqa: E402
from collections.abc import Callable, Iterable, Mapping  # noqa: E402
from functools import lru_cache  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from tlpsim.fmus.component import (  # noqa: E402
    Component,
    Variable,
    boolean_parameter,
    real_parameter,
    six,
    text_parameter,
)
from tlpsim.fmus.current import CURRENT_PARAMETERS, current_of  # noqa: E402
from tlpsim.fmus.hull import HULL_PARAMETER, hull_of  # noqa: E402
from tlpsim.fmus.tables import matrix_from_json, record_from_json  # noqa: E402
from tlpsim.loads import issc_tlp  # noqa: E402
from tlpsim.loads.bem.database import HydrodynamicDatabase  # noqa: E402
from tlpsim.loads.bem.issc import database_by_name  # noqa: E402
from tlpsim.loads.checks import entry  # noqa: E402
from tlpsim.loads.constants import DEGREES_OF_FREEDOM, MORISON  # noqa: E402
from tlpsim.loads.errors import ScenarioError  # noqa: E402
from tlpsim.loads.hydro.diffraction import require_site  # noqa: E402
from tlpsim.loads.hydro.issc_members import issc_added_mass  # noqa: E402
from tlpsim.loads.hydro.radiation import ConvolutionMemory, Radiation, convolution_memory, radiation  # noqa: E402
from tlpsim.loads.hydro.state_space import StateSpaceMemory, state_space_memory  # noqa: E402
from tlpsim.loads.platform.body import Body  # noqa: E402
from tlpsim.loads.platform.equilibrium import damping_from_ratios, require_upright  # noqa: E402
from tlpsim.loads.platform.memory import Memory, NoMemory  # noqa: E402
from tlpsim.loads.platform.motion import PlatformModel, advance, initial_state, set_intact  # noqa: E402
from tlpsim.loads.platform.points import move_points  # noqa: E402
from tlpsim.loads.platform.state import PlatformState  # noqa: E402
from tlpsim.loads.platform.tendons import Tendons  # noqa: E402
from tlpsim.loads.waves.current import Current  # noqa: E402

TENSIONS = 12
POINTS = 2
_POINTS = ((0.0, 0.0, issc_tlp.DECK_HEIGHT), tuple(issc_tlp.tendons().fairleads[0]))
_PRESENT = 0.5  # a tether is lost below this, halfway between the two values of its input
_BODY = issc_tlp.body()
_LOADS = ("wind_force.*", "wave_force.*", "external_force.*", "tendon_intact[[]*")
_FORCE, _MOTION = ("N", "N.m"), ("m", "rad")
_STATE = tuple(each.name for each in dataclasses.fields(PlatformState))
NO_RADIATION = "none"
MEMORY: Mapping[str, Callable[[Radiation], ConvolutionMemory | StateSpaceMemory] | None] = {
    "convolution": convolution_memory,
    "state_space": state_space_memory,
    NO_RADIATION: None,
}
_SEA_BED = 1.0 + 1e-6  # an anchor may lie below it by the rounding of decimal numbers
_LONG_WAVE = 0.3  # rad/s, below which nothing of note is radiated


def _vector(
    name: str, unit: str, values: Any, description: str, causality: str = "parameter", depends_on: tuple[str, ...] = ()
) -> tuple[Variable, ...]:
    return tuple(
        Variable(
            name=f"{name}.{axis}",
            causality=causality,
            unit=unit,
            depends_on=depends_on,
            start=float(value),
            description=description,
        )
        for axis, value in zip("xyz", values, strict=False)
    )


def _tendon_variables(name: str, causality: str, description: str, **others: Any) -> tuple[Variable, ...]:
    return tuple(
        Variable(name=f"{name}[{i + 1}]", causality=causality, description=description, **others)
        for i in range(TENSIONS)
    )


def platform_model(parameter: Callable[[str], Any]) -> PlatformModel:
    """Platform from the FMU's parameters, of which `parameter` gives the value by name."""

    def vector(name: str, parts: Iterable[str]) -> NDArray[Any]:
        return np.array([parameter(f"{name}.{part}") for part in parts])

    added_mass, memory = _fluid(parameter)
    body = Body(
        mass=parameter("mass"),
        centre_of_gravity=vector("centre_of_gravity", "xyz"),
        inertia=np.diag(vector("inertia", "xyz")),
        added_mass=added_mass,
        displaced_volume=parameter("displaced_volume"),
        centre_of_buoyancy=vector("centre_of_buoyancy", "xyz"),
        waterplane_area=parameter("waterplane_area"),
        waterplane_moments=vector("waterplane_moment", "xy"),
        water_density=parameter("water_density"),
        gravity=parameter("gravity"),
    )
    tendons = _tendons(parameter)
    undamped = PlatformModel(
        body=body,
        tendons=tendons,
        free=vector("free", DEGREES_OF_FREEDOM),
        method=parameter("integrator"),
        memory=memory,
        current=tendon_current(parameter, tendons),
    )
    require_upright(undamped)
    damping = damping_from_ratios(undamped, vector("damping_ratio", DEGREES_OF_FREEDOM))
    return dataclasses.replace(undamped, linear_damping=damping)


def tendon_current(parameter: Callable[[str], Any], tendons: Tendons) -> Current | None:
    """The current, where tethers have drag."""
    return current_of(parameter) if np.any(tendons.drag_coefficient * tendons.diameter > 0.0) else None


def _tendons(parameter: Callable[[str], Any]) -> Tendons:
    """Tethers from the table, none of them longer than the water is deep; without one those of the ISSC TLP."""
    table, depth = parameter("tendons"), parameter("water_depth")
    if not table:
        return issc_tlp.tendons(depth, draught=hull_of(parameter).draught)
    tendons = record_from_json(Tendons, table, "tendons")
    heights = tendons.anchors[:, 2]
    if np.any(heights < -depth * _SEA_BED):
        index = int(np.argmin(heights))
        raise ScenarioError(
            f"parameter tendons: tendon {index + 1} has its anchor at z = {heights[index]:g} m, below the sea bed at "
            f"{-depth:g} m: check anchors and the parameter water_depth"
        )
    return tendons


def _fluid(parameter: Callable[[str], Any]) -> tuple[NDArray[np.float64], Memory]:
    """Added mass, and the memory of radiated waves that goes with it."""
    name, given = parameter("hydrodynamics"), parameter("added_mass")
    make = entry(MEMORY, parameter("radiation"), "parameter radiation")
    if given:
        return matrix_from_json(given, "added_mass"), NoMemory()
    density, hull = parameter("water_density"), hull_of(parameter)
    if name == MORISON or (make is None and not name):
        return issc_added_mass(hull.draught, density), NoMemory()
    site = (parameter("water_depth"), density, parameter("gravity"), hull)
    if make is None:
        longest_waves = _database(name, *site).added_mass[0]
        return 0.5 * (longest_waves + longest_waves.T), NoMemory()
    memory = make(radiation(_database(name, *site))) if name else _issc_memory(parameter("radiation"), *site)
    return memory.added_mass, memory


def _database(name: str, depth: float, density: float, gravity: float, hull: issc_tlp.Hull) -> HydrodynamicDatabase:
    database = database_by_name(name, depth, density, gravity, hull)
    label = f"hydrodynamic database {name}"
    require_site(database, depth=depth, density=density, gravity=gravity, frequency=_LONG_WAVE, name=label)
    return database


@lru_cache(maxsize=4)
def _issc_memory(
    kind: str, depth: float, density: float, gravity: float, hull: issc_tlp.Hull
) -> ConvolutionMemory | StateSpaceMemory:
    make = MEMORY[kind]
    assert make is not None
    return make(radiation(_database("", depth, density, gravity, hull)))


class TlpsimPlatform(Component):
    """Adapter over `tlpsim.loads.platform`."""

    description = "Tension leg platform in six degrees of freedom: added mass, hydrostatics, exact tethers"
    table = (
        *six("wind_force", "input", "wind force", _FORCE),
        *six("wave_force", "input", "wave force", _FORCE),
        *six("external_force", "input", "any other force", _FORCE),
        *_tendon_variables(
            "tendon_intact", "input", "0 loses the tether, 1 (the start value) keeps it", unit="1", start=1.0
        ),
        Variable(
            name="elevation",
            causality="input",
            unit="m",
            description="elevation of the undisturbed sea, for the air gap",
        ),
        *six("position", "output", "displacement of the reference point and rotation", _MOTION),
        *six("velocity", "output", "velocity", ("m/s", "rad/s"), derivative_of="position"),
        *six(
            "acceleration",
            "output",
            "acceleration",
            ("m/s2", "rad/s2"),
            derivative_of="velocity",
            depends_on=_LOADS,
        ),
        *_tendon_variables(
            "tendon_tension",
            "output",
            "tension at the top of a tether; zero where it is lost or there is none",
            unit="N",
            depends_on=("tendon_intact[[]*",),
        ),
        *_tendon_variables(
            "tendon_bottom_tension",
            "output",
            "tension at the anchor; less than at the top by the submerged weight",
            unit="N",
            depends_on=("tendon_intact[[]*",),
        ),
        *(
            variable
            for k in range(POINTS)
            for variable in _vector(
                f"point_position[{k + 1}]", "m", (0.0,) * 3, "position of a point of the platform", "output"
            )
        ),
        *(
            variable
            for k in range(POINTS)
            for variable in _vector(
                f"point_acceleration[{k + 1}]",
                "m/s2",
                (0.0,) * 3,
                "acceleration of that point in earth axes, without gravity",
                "output",
                _LOADS,
            )
        ),
        Variable(
            name="airgap",
            causality="output",
            unit="m",
            description="height of point 1 above the input elevation",
            depends_on=("elevation",),
        ),
        real_parameter("mass", "kg", _BODY.mass, "mass of the platform without added mass"),
        *_vector("centre_of_gravity", "m", _BODY.centre_of_gravity, "from the reference point"),
        *_vector("inertia", "kg.m2", np.diag(_BODY.inertia), "moment of inertia about the centre of gravity"),
        real_parameter("displaced_volume", "m3", _BODY.displaced_volume, "displaced volume at zero position"),
        *_vector("centre_of_buoyancy", "m", _BODY.centre_of_buoyancy, "from the reference point"),
        real_parameter("waterplane_area", "m2", _BODY.waterplane_area, "waterplane area"),
        *_vector(
            "waterplane_moment",
            "m4",
            _BODY.waterplane_moments,
            "second moment of the waterplane about the axis",
        ),
        real_parameter(
            "water_depth",
            "m",
            issc_tlp.WATER_DEPTH,
            "depth of the water, also for the tethers and the database of the ISSC TLP",
        ),
        *CURRENT_PARAMETERS,
        real_parameter("water_density", "kg/m3", _BODY.water_density, "density of the water"),
        real_parameter("gravity", "m/s2", _BODY.gravity, "acceleration of gravity"),
        *(
            real_parameter(f"damping_ratio.{degree}", "1", ratio, "linear damping, fraction of critical")
            for degree, ratio in zip(DEGREES_OF_FREEDOM, issc_tlp.DAMPING_RATIOS, strict=True)
        ),
        *(
            variable
            for k, what in enumerate(("such as the underside of the deck", "such as a fairlead"))
            for variable in _vector(f"point[{k + 1}]", "m", _POINTS[k], f"from the reference point, {what}")
        ),
        *six("initial_position", "parameter", "position at the start", _MOTION),
        *six("initial_velocity", "parameter", "velocity at the start", ("m/s", "rad/s")),
        *(
            boolean_parameter(f"free.{degree}", True, "false holds this degree of freedom at its initial position")
            for degree in DEGREES_OF_FREEDOM
        ),
        text_parameter("integrator", "fox_goodwin", "fox_goodwin, central_difference or average_acceleration"),
        text_parameter(
            "hydrodynamics",
            "",
            "added mass and radiation: path of a hydrodynamic database (.h5); morison: constant added mass of the ISSC "
            "TLP; empty: the database of the ISSC TLP, or of `hull`, for this water, computed on first use",
        ),
        HULL_PARAMETER,
        text_parameter(
            "radiation",
            "convolution",
            "memory of radiated waves: convolution, state_space, or none (added mass is that of long waves)",
        ),
        text_parameter(
            "added_mass",
            "",
            "constant added mass instead of the database's, without memory: JSON list of 6 lists of 6 (kg, kg.m, "
            "kg.m2), about the reference point; empty: of the database",
        ),
        text_parameter(
            "tendons",
            "",
            "JSON object of columns fairleads, anchors (m), axial_stiffness, pretension at the top (N) and, where "
            "wanted, mass_per_length (kg/m), submerged_weight (N/m), diameter (m), drag_coefficient, "
            "added_mass_coefficient; empty: ISSC TLP",
        ),
    )

    def prepare(self) -> None:
        """Build the platform and take views of the variables."""
        self.model = platform_model(self.parameter)
        self.loads = self.values[: 3 * len(DEGREES_OF_FREEDOM)].reshape(3, -1)
        self.outputs = {name: self.view(f"{name}.") for name in ("position", "velocity", "acceleration")}
        count = len(self.model.tendons.pretension)
        if count > TENSIONS:
            raise ScenarioError(f"parameter tendons has {count} rows; this FMU has outputs for {TENSIONS}")
        self.intact = self.view("tendon_intact[")[:count]
        self.outputs["tensions"] = self.view("tendon_tension[")[:count]
        self.outputs["bottom_tensions"] = self.view("tendon_bottom_tension[")[:count]
        self.points = self.view("point[").reshape(POINTS, 3).copy()
        self.point_outputs = [self.view(f"point_{name}[").reshape(POINTS, 3) for name in ("position", "acceleration")]
        self.elevation, self.airgap = self.view("elevation"), self.view("airgap")

    def _parameters(self, prefix: str) -> NDArray[np.float64]:
        return self.view(f"{prefix}.").copy()

    def retune(self) -> None:
        """Take another current past the tethers."""
        current = tendon_current(self.parameter, self.model.tendons)
        self.model = dataclasses.replace(self.model, current=current)

    def start(self, time: float) -> None:
        """Put the platform at its initial position under the loads of the start."""
        self.state = initial_state(
            self.model,
            self._parameters("initial_position"),
            self._parameters("initial_velocity"),
            self.loads.sum(axis=0),
            self.intact > _PRESENT,
        )
        self._publish()

    def advance(self, time: float, step: float) -> None:
        """Integrate over one communication step."""
        advance(self.model, self.state, self.loads.sum(axis=0), step)
        intact = self.intact > _PRESENT
        if (intact != self.state.intact).any():
            set_intact(self.model, self.state, intact)
        self._publish()

    def _publish(self) -> None:
        for name, output in self.outputs.items():
            output[:] = getattr(self.state, name)
        state = self.state
        move_points(self.points, state.position, state.velocity, state.acceleration, *self.point_outputs)
        self.airgap[0] = self.point_outputs[0][0, 2] - self.elevation[0]

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Arrays of the motion."""
        return {name: getattr(self.state, name).copy() for name in _STATE}

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Arrays of the motion."""
        self.state = PlatformState(**{name: arrays[name].copy() for name in _STATE})
