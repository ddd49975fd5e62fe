"""The platform FMU: six degrees of freedom on tethers, driven by wind, wave and external forces."""

import ctypes

# pythonfmu 0.7 gives back, at every instantiation, a reference to this module's globals that it never took.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))

from pathlib import Path  # noqa: E402

from tlpsim.fmus.version import built_version  # noqa: E402

built_version(Path(__file__).parent)  # before the imports that another version may not have

import dataclasses  # noqa: E402
from collections.abc import Callable, Iterable  # noqa: E402
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
from tlpsim.fmus.tables import matrix_from_json, record_from_json  # noqa: E402
from tlpsim.loads import issc_tlp  # noqa: E402
from tlpsim.loads.constants import DEGREES_OF_FREEDOM  # noqa: E402
from tlpsim.loads.errors import ScenarioError  # noqa: E402
from tlpsim.loads.platform.body import Body  # noqa: E402
from tlpsim.loads.platform.equilibrium import damping_from_ratios  # noqa: E402
from tlpsim.loads.platform.motion import PlatformModel, PlatformState, advance, initial_state  # noqa: E402
from tlpsim.loads.platform.tendons import Tendons  # noqa: E402

TENSIONS = 12
_BODY = issc_tlp.body()
_LOADS = ("wind_force.*", "wave_force.*", "external_force.*")
_FORCE, _MOTION = ("N", "N.m"), ("m", "rad")
_STATE = ("position", "velocity", "acceleration", "force", "tensions")


def _vector(name: str, unit: str, values: Any, description: str) -> tuple[Variable, ...]:
    return tuple(
        Variable(
            name=f"{name}.{axis}",
            causality="parameter",
            unit=unit,
            start=float(value),
            description=description,
        )
        for axis, value in zip("xyz", values, strict=False)
    )


def platform_model(parameter: Callable[[str], Any]) -> PlatformModel:
    """Platform from the FMU's parameters, of which `parameter` gives the value by name."""

    def vector(name: str, parts: Iterable[str]) -> NDArray[Any]:
        return np.array([parameter(f"{name}.{part}") for part in parts])

    added_mass, tendons = parameter("added_mass"), parameter("tendons")
    body = Body(
        mass=parameter("mass"),
        centre_of_gravity=vector("centre_of_gravity", "xyz"),
        inertia=np.diag(vector("inertia", "xyz")),
        added_mass=matrix_from_json(added_mass, "added_mass") if added_mass else issc_tlp.ADDED_MASS,
        displaced_volume=parameter("displaced_volume"),
        centre_of_buoyancy=vector("centre_of_buoyancy", "xyz"),
        waterplane_area=parameter("waterplane_area"),
        waterplane_moments=vector("waterplane_moment", "xy"),
        water_density=parameter("water_density"),
        gravity=parameter("gravity"),
    )
    undamped = PlatformModel(
        body=body,
        tendons=record_from_json(Tendons, tendons, "tendons") if tendons else issc_tlp.tendons(),
        free=vector("free", DEGREES_OF_FREEDOM),
        method=parameter("integrator"),
    )
    damping = damping_from_ratios(undamped, vector("damping_ratio", DEGREES_OF_FREEDOM))
    return dataclasses.replace(undamped, linear_damping=damping)


class TlpsimPlatform(Component):
    """Adapter over `tlpsim.loads.platform`."""

    description = "Tension leg platform in six degrees of freedom: added mass, hydrostatics, exact tethers"
    table = (
        *six("wind_force", "input", "wind force", _FORCE),
        *six("wave_force", "input", "wave force", _FORCE),
        *six("external_force", "input", "any other force", _FORCE),
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
        *(
            Variable(
                name=f"tendon_tension[{i + 1}]",
                causality="output",
                unit="N",
                description="tension at the top of a tether; zero where there is none",
            )
            for i in range(TENSIONS)
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
        real_parameter("water_density", "kg/m3", _BODY.water_density, "density of the water"),
        real_parameter("gravity", "m/s2", _BODY.gravity, "acceleration of gravity"),
        *(
            real_parameter(f"damping_ratio.{degree}", "1", ratio, "linear damping, fraction of critical")
            for degree, ratio in zip(DEGREES_OF_FREEDOM, issc_tlp.DAMPING_RATIOS, strict=True)
        ),
        *six("initial_position", "parameter", "position at the start", _MOTION),
        *six("initial_velocity", "parameter", "velocity at the start", ("m/s", "rad/s")),
        *(
            boolean_parameter(f"free.{degree}", True, "false holds this degree of freedom at its initial position")
            for degree in DEGREES_OF_FREEDOM
        ),
        text_parameter("integrator", "fox_goodwin", "fox_goodwin, central_difference or average_acceleration"),
        text_parameter(
            "added_mass", "", "JSON list of 6 lists of 6 (kg, kg.m, kg.m2), about the reference point; empty: ISSC TLP"
        ),
        text_parameter(
            "tendons",
            "",
            "JSON object of columns fairleads, anchors (m), axial_stiffness, pretension (N); empty: ISSC TLP",
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
        self.outputs["tensions"] = self.view("tendon_tension[")[:count]

    def _parameters(self, prefix: str) -> NDArray[np.float64]:
        return self.view(f"{prefix}.").copy()

    def start(self, time: float) -> None:
        """Put the platform at its initial position under the loads of the start."""
        self.state = initial_state(
            self.model,
            self._parameters("initial_position"),
            self._parameters("initial_velocity"),
            self.loads.sum(axis=0),
        )
        self._publish()

    def advance(self, time: float, step: float) -> None:
        """Integrate over one communication step."""
        advance(self.model, self.state, self.loads.sum(axis=0), step)
        self._publish()

    def _publish(self) -> None:
        for name, output in self.outputs.items():
            output[:] = getattr(self.state, name)

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Arrays of the motion."""
        return {name: getattr(self.state, name).copy() for name in _STATE}

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Arrays of the motion."""
        self.state = PlatformState(**{name: arrays[name].copy() for name in _STATE})
