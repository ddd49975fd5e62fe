"""The wind FMU: turbulent wind on the platform's segments, eq. (1) and (2) of Li & Kareem (1990)."""

import ctypes

# pythonfmu 0.7 gives back, at every instantiation, a reference to this module's globals that it never took.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))

from pathlib import Path  # noqa: E402

from tlpsim.fmus.version import built_version  # noqa: E402

built_version(Path(__file__).parent)  # before the imports that another version may not have

from collections.abc import Callable  # noqa: E402
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
from tlpsim.fmus.force_rate import RATE_STEP, Motion, force_rates  # noqa: E402
from tlpsim.fmus.tables import record_from_json  # noqa: E402
from tlpsim.loads.errors import ScenarioError  # noqa: E402
from tlpsim.loads.filters.arma import Orders  # noqa: E402
from tlpsim.loads.filters.process import ProcessState  # noqa: E402
from tlpsim.loads.wind.admittance import ADMITTANCES  # noqa: E402
from tlpsim.loads.wind.coherence import COHERENCES, Decay  # noqa: E402
from tlpsim.loads.wind.field import DEFAULT_ORDERS, Gusts  # noqa: E402
from tlpsim.loads.wind.force import DECOMPOSITIONS, DEFAULT_AIR_DENSITY, WindLoads, wind_loads  # noqa: E402
from tlpsim.loads.wind.profile import PROFILES, Profile  # noqa: E402
from tlpsim.loads.wind.segments import (  # noqa: E402
    Boxes,
    Segments,
    projected_segments,
    with_constant_areas,
)
from tlpsim.loads.wind.spectra import SPECTRA  # noqa: E402


def wind_model(parameter: Callable[[str], Any]) -> WindLoads:
    """Wind loads from the FMU's parameters, of which `parameter` gives the value by name."""
    return wind_loads(
        heading=parameter("heading"),
        profile=wind_profile(parameter),
        gusts=wind_gusts(parameter),
        air_density=parameter("air_density"),
        segments=wind_segments(parameter),
        decomposition=parameter("decomposition"),
    )


def wind_profile(parameter: Callable[[str], Any]) -> Profile:
    """Mean wind from the FMU's parameters."""
    return Profile(
        name=parameter("profile"),
        speed_10=parameter("mean_speed"),
        roughness_length=parameter("roughness"),
        exponent=parameter("profile_exponent"),
    )


def wind_gusts(parameter: Callable[[str], Any]) -> Gusts:
    """Turbulence from the FMU's parameters."""
    return Gusts(
        spectrum=parameter("spectrum"),
        coherence=parameter("coherence.model"),
        decay=Decay(
            lateral=parameter("coherence.lateral"),
            vertical=parameter("coherence.vertical"),
            longitudinal=parameter("coherence.longitudinal"),
        ),
        admittance=parameter("admittance"),
        sampling_step=parameter("sampling_step"),
        orders=Orders(
            long=parameter("orders.long"),
            autoregressive=parameter("orders.autoregressive"),
            moving_average=parameter("orders.moving_average"),
        ),
        seed=parameter("seed"),
    )


def wind_segments(parameter: Callable[[str], Any]) -> Segments | None:
    """The areas from the FMU's parameters; None for the default ones."""
    segments, boxes = parameter("segments"), parameter("boxes")
    if segments and boxes:
        raise ScenarioError("parameters segments and boxes are both given; give one of them")
    if not (segments or boxes):
        return None
    if boxes:
        areas = projected_segments(record_from_json(Boxes, boxes, "boxes"), parameter("heading"))
    else:
        areas = record_from_json(Segments, segments, "segments")
    return areas if parameter("yaw_dependent_area") else with_constant_areas(areas)


class TlpsimWind(Component):
    """Adapter over `tlpsim.loads.wind`."""

    description = "Wind force on a moving platform from correlated gusts on the segments of its projected area"
    table = (
        *six("velocity", "input", "velocity of the platform", ("m/s", "rad/s")),
        Variable(name="position.yaw", causality="input", unit="rad", description="yaw of the platform"),
        *six("force", "output", "wind force", ("N", "N.m"), depends_on=("velocity.*", "position.yaw")),
        *force_rates(("velocity.*", "position.yaw")),
        Variable(
            name="wind_speed",
            causality="output",
            unit="m/s",
            description="wind speed, area-weighted mean over the segments",
        ),
        real_parameter("mean_speed", "m/s", 20.0, "mean at 10 m height; zero is still air"),
        real_parameter("heading", "rad", 0.0, "direction toward which the wind blows"),
        real_parameter("profile_exponent", "1", 0.12, "exponent of the power profile"),
        real_parameter("roughness", "m", 0.001, "roughness length z0 of the profile, and of the friction velocity"),
        real_parameter("air_density", "kg/m3", DEFAULT_AIR_DENSITY, "density of the air"),
        real_parameter("coherence.lateral", "1", 16.0, "Davenport's decay coefficient across the wind"),
        real_parameter("coherence.vertical", "1", 10.0, "Davenport's decay coefficient in height"),
        real_parameter("coherence.longitudinal", "1", 0.0, "Davenport's decay coefficient along the wind"),
        real_parameter(
            "sampling_step",
            "s",
            1.0,
            "time between samples of the gusts; the realization does not depend on the macro step",
        ),
        integer_parameter("orders.long", DEFAULT_ORDERS.long, "order of the long autoregression"),
        integer_parameter("orders.autoregressive", DEFAULT_ORDERS.autoregressive, "p of the ARMA(p, q) gusts"),
        integer_parameter("orders.moving_average", DEFAULT_ORDERS.moving_average, "q of the ARMA(p, q) gusts"),
        integer_parameter("seed", 1, "realization"),
        text_parameter("profile", "logarithmic", "mean speed over height: " + ", ".join(PROFILES)),
        text_parameter("spectrum", "kaimal", "spectrum of the gusts: " + ", ".join(SPECTRA)),
        text_parameter("coherence.model", "davenport", "coherence of the gusts: " + ", ".join(COHERENCES)),
        text_parameter("admittance", "none", "aerodynamic admittance of the segments: " + ", ".join(ADMITTANCES)),
        text_parameter("decomposition", "full", "of the force: " + ", ".join(DECOMPOSITIONS)),
        boolean_parameter(
            "yaw_dependent_area", True, "areas of boxes are those shown at the platform's yaw; false: at zero yaw"
        ),
        text_parameter(
            "segments",
            "",
            "JSON object of columns position (m), area (m2), shape_coefficient and, where yaw changes the areas, plan "
            "(length and width of the box that a segment is a part of, m); empty: six segments, 3000 m2",
        ),
        text_parameter(
            "boxes",
            "",
            "JSON object of columns position, size (m), shape_coefficient: boxes whose projections are the segments",
        ),
    )

    def prepare(self) -> None:
        """Fit the gusts and take views of the variables."""
        self.model = wind_model(self.parameter)
        self.velocity = self.view("velocity.")
        self.yaw = self.view("position.yaw")
        self.force = self.view("force.")
        self.force_rate = self.view("force_rate.")
        self.motion = Motion()
        self.wind_speed = self.view("wind_speed")

    def start(self, time: float) -> None:
        """Force and speed at `time`."""
        self.motion.begin(self.velocity)
        self._update(time)

    def _update(self, time: float) -> None:
        self.force[:] = self.model.evaluate(time, self.velocity, self.yaw[0])
        self.wind_speed[0] = self.model.wind_speed(time)
        h = RATE_STEP
        after = self.velocity + h * self.motion.acceleration, self.yaw[0] + h * self.velocity[5]
        self.force_rate[:] = (self.model.evaluate(time + h, *after) - self.force) / h

    def advance(self, time: float, step: float) -> None:
        """Force and speed at the end of the step."""
        self.motion.advance(self.velocity, step)
        self._update(time + step)

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Recent samples and noises, and the index after them, and the motion."""
        state = self.model.get_state()
        gusts = {"index": np.array(state.index), "samples": state.samples.copy(), "noises": state.noises.copy()}
        return {**gusts, **self.motion.snapshot()}

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Recent samples and noises, and the index after them, and the motion."""
        self.motion.restore(arrays)
        index = int(arrays["index"])
        self.model.set_state(ProcessState(index=index, samples=arrays["samples"], noises=arrays["noises"]))
