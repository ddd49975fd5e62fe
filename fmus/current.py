"""The current among the parameters of the wave and the platform FMU."""

from collections.abc import Callable
from typing import Any

from tlpsim.fmus.component import Variable, real_parameter, text_parameter
from tlpsim.fmus.tables import record_from_json
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.current import Current, uniform_current

CURRENT_PARAMETERS: tuple[Variable, ...] = (
    real_parameter("current_speed", "m/s", 0.0, "speed of a current that is uniform over the depth", tunable=True),
    real_parameter("current_heading", "rad", 0.0, "direction toward which the current flows", tunable=True),
    text_parameter(
        "current_profile",
        "",
        "JSON object of depth (m), speed (m/s), heading (rad) as lists, and exponent, water_depth (m), stretched, "
        "instead of current_speed; empty: none",
        tunable=True,
    ),
)


def current_of(parameter: Callable[[str], Any]) -> Current | None:
    """The current from the FMU's parameters, of which `parameter` gives the value by name; None where there is none.

    Raises
    ------
    ScenarioError
        For a profile beside a speed, or a profile that is none.
    """
    profile, speed = parameter("current_profile"), parameter("current_speed")
    if profile and speed != 0.0:
        raise ScenarioError(f"parameter current_speed is {speed} m/s beside a current_profile; give one of them")
    if profile:
        return record_from_json(Current, profile, "current_profile")
    return uniform_current(speed, parameter("current_heading")) if speed != 0.0 else None
