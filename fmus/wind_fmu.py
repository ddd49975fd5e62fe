"""The wind FMU: turbulent wind on the platform's segments, eq. (1) and (2) of Li & Kareem (1990)."""

import ctypes

# pythonfmu 0.7 gives back, at every instantiation, a reference to this module's globals that it never took.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))

from collections.abc import Callable  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from tlpsim.fmus.component import Component, Variable, six  # noqa: E402
from tlpsim.fmus.tables import record_from_json  # noqa: E402
from tlpsim.loads.filters.arma import ProcessState  # noqa: E402
from tlpsim.loads.wind.force import DEFAULT_AIR_DENSITY, Segments, WindLoads, wind_loads  # noqa: E402


def wind_model(parameter: Callable[[str], Any]) -> WindLoads:
    """Wind loads from the FMU's parameters, of which `parameter` gives the value by name."""
    segments = parameter("segments")
    return wind_loads(
        speed_10=parameter("mean_speed"),
        heading=parameter("heading"),
        spectrum=parameter("spectrum"),
        roughness_length=parameter("roughness"),
        lateral_coherence=parameter("coherence.lateral"),
        vertical_coherence=parameter("coherence.vertical"),
        air_density=parameter("air_density"),
        segments=record_from_json(Segments, segments, "segments") if segments else None,
        sampling_step=parameter("sampling_step"),
        seed=parameter("seed"),
    )


class TlpsimWind(Component):
    """Adapter over `tlpsim.loads.wind`."""

    description = "Wind force on a moving platform from correlated gusts on the segments of its projected area"
    table = (
        *six("velocity", "input", "velocity of the platform", ("m/s", "rad/s")),
        Variable(name="position.yaw", causality="input", unit="rad", description="yaw of the platform"),
        *six("force", "output", "wind force", ("N", "N.m"), depends_on=("velocity.*", "position.yaw")),
        Variable(
            name="wind_speed",
            causality="output",
            unit="m/s",
            description="wind speed, area-weighted mean over the segments",
        ),
        Variable(
            name="mean_speed",
            causality="parameter",
            unit="m/s",
            start=20.0,
            description="mean at 10 m height",
        ),
        Variable(
            name="heading",
            causality="parameter",
            unit="rad",
            description="direction toward which the wind blows",
        ),
        Variable(name="roughness", causality="parameter", unit="m", start=0.001, description="roughness length z0"),
        Variable(
            name="air_density",
            causality="parameter",
            unit="kg/m3",
            start=DEFAULT_AIR_DENSITY,
            description="density of the air",
        ),
        Variable(
            name="coherence.lateral",
            causality="parameter",
            unit="1",
            start=16.0,
            description="Davenport's decay coefficient across the wind",
        ),
        Variable(
            name="coherence.vertical",
            causality="parameter",
            unit="1",
            start=10.0,
            description="Davenport's decay coefficient in height",
        ),
        Variable(
            name="sampling_step",
            causality="parameter",
            unit="s",
            start=1.0,
            description="time between samples of the gusts; the realization does not depend on the macro step",
        ),
        Variable(name="seed", causality="parameter", kind="Integer", start=1, description="realization"),
        Variable(
            name="spectrum",
            causality="parameter",
            kind="String",
            start="kaimal",
            description="spectrum of the gusts: kaimal, harris or api",
        ),
        Variable(
            name="segments",
            causality="parameter",
            kind="String",
            start="",
            description="JSON object of columns position (m), area (m2), shape_coefficient; empty: six segments, "
            "3000 m2",
        ),
    )

    def prepare(self) -> None:
        """Fit the gusts and take views of the variables."""
        self.model = wind_model(self.parameter)
        self.velocity = self.view("velocity.")
        self.yaw = self.view("position.yaw")
        self.force = self.view("force.")
        self.wind_speed = self.view("wind_speed")

    def start(self, time: float) -> None:
        """Force and speed at `time`."""
        self.force[:] = self.model.evaluate(time, self.velocity, self.yaw[0])
        self.wind_speed[0] = self.model.wind_speed(time)

    def advance(self, time: float, step: float) -> None:
        """Force and speed at the end of the step."""
        self.start(time + step)

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Window of samples and the index of its newest."""
        state = self.model.get_state()
        return {"index": np.array(state.index), "samples": np.array(state.samples)}

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Window of samples and the index of its newest."""
        self.model.set_state(ProcessState(index=int(arrays["index"]), samples=arrays["samples"]))
