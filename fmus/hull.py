"""The hull among the parameters of the wave and the platform FMU: what differs from the ISSC TLP."""

from collections.abc import Callable
from typing import Any

from tlpsim.fmus.component import Variable, text_parameter
from tlpsim.fmus.tables import record_from_json
from tlpsim.loads.issc_tlp import ISSC, Hull

HULL_PARAMETER: Variable = text_parameter(
    "hull",
    "",
    "JSON object of what differs from the ISSC TLP in draught (m), mass (kg), centre_of_gravity (m above still "
    "water), roll_inertia, yaw_inertia (kg.m2 about the centre of gravity); empty: nothing",
)


def hull_of(parameter: Callable[[str], Any]) -> Hull:
    """The hull from the FMU's parameters, of which `parameter` gives the value by name.

    Raises
    ------
    ScenarioError
        For a text that is no hull.
    """
    text = parameter("hull")
    return record_from_json(Hull, text, "hull") if text else ISSC
