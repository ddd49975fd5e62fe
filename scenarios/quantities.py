"""Quantities in a scenario: a number in the base unit, or text with a unit such as ``"52 kn"`` or ``"3 h"``.

A `Dimension` is a table of accepted units, each with its factor to the base unit. The annotated types below
(`Length`, `Duration`, `Speed`, ...) are what the schema uses for its fields; inside the program every
value is then a plain float in the base unit. Base units are SI, except that `Heading` is in degrees,
because the keys that use it end in ``_deg``.
"""

import difflib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import BeforeValidator, Field

_TEXT = re.compile(r"\s*(?P<number>[-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?P<unit>.*?)\s*")


@dataclass(frozen=True, slots=True, kw_only=True)
class Dimension:
    """A physical dimension and the units accepted for it.

    Attributes
    ----------
    name : str
        The word used in messages, such as "speed".
    units : Mapping[str, float]
        Factor from each accepted unit to the base unit; the first one is the base unit, with factor 1.
    """

    name: str
    units: Mapping[str, float]

    @property
    def base_unit(self) -> str:
        """Unit of a bare number, and of every value after parsing."""
        return next(iter(self.units))

    def parse(self, value: object) -> float:
        """Value in the base unit.

        Parameters
        ----------
        value : object
            A number in the base unit, or text: a number, with or without one of the accepted units.

        Raises
        ------
        ValueError
            When the value is neither, its unit is not accepted, or it is not finite.
        """
        if isinstance(value, str):
            number = self._parse_text(value)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            try:
                number = float(value)
            except OverflowError:  # a whole number in TOML may have any number of digits
                number = math.inf
        else:
            raise ValueError(f"a {self.name} is wanted: {self._remedy()}")
        if not math.isfinite(number):
            raise ValueError(f"a {self.name} must be a finite number: {self._remedy()}")
        return number

    def _parse_text(self, text: str) -> float:
        match = _TEXT.fullmatch(text)
        if match is None:
            raise ValueError(f"this text holds no number with a unit: {self._remedy()}")
        unit = match["unit"] or self.base_unit
        if unit not in self.units:
            close = difflib.get_close_matches(unit.lower(), self.units, n=1)
            hint = f" (did you mean '{close[0]}'?)" if close else ""
            raise ValueError(f"'{unit}' is not a unit of {self.name}{hint}: {self._remedy()}")
        return float(match["number"]) * self.units[unit]

    def _remedy(self) -> str:
        others = [f"'{unit}'" for unit in self.units if unit != self.base_unit]
        text = f"give a number in {self.base_unit}"
        return f"{text}, or text with one of the units '{self.base_unit}', {', '.join(others)}" if others else text


LENGTH = Dimension(name="length", units={"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0})
AREA = Dimension(name="area", units={"m2": 1.0, "m²": 1.0})
TIME = Dimension(name="time", units={"s": 1.0, "ms": 0.001, "min": 60.0, "h": 3600.0})
# 1 kn is 1852 m/h by definition.
SPEED = Dimension(name="speed", units={"m/s": 1.0, "km/h": 1.0 / 3.6, "kn": 1852.0 / 3600.0})
ACCELERATION = Dimension(name="acceleration", units={"m/s2": 1.0, "m/s²": 1.0})
FREQUENCY = Dimension(name="frequency", units={"Hz": 1.0, "mHz": 0.001})
HEADING = Dimension(name="heading", units={"deg": 1.0, "°": 1.0, "rad": 180.0 / math.pi})
ANGLE = Dimension(name="angle", units={"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0})
MASS = Dimension(name="mass", units={"kg": 1.0, "t": 1000.0})
INERTIA = Dimension(name="moment of inertia", units={"kg.m2": 1.0, "kg·m²": 1.0, "t.m2": 1000.0, "t·m²": 1000.0})
LINEAR_DENSITY = Dimension(name="mass per length", units={"kg/m": 1.0, "t/m": 1000.0})
DENSITY = Dimension(name="density", units={"kg/m3": 1.0, "kg/m³": 1.0, "t/m3": 1000.0})
FORCE = Dimension(name="force", units={"N": 1.0, "kN": 1e3, "MN": 1e6})
RATIO = Dimension(name="ratio", units={"1": 1.0, "%": 0.01})

Length = Annotated[float, BeforeValidator(LENGTH.parse)]
Area = Annotated[float, BeforeValidator(AREA.parse)]
Duration = Annotated[float, BeforeValidator(TIME.parse)]
Speed = Annotated[float, BeforeValidator(SPEED.parse)]
Acceleration = Annotated[float, BeforeValidator(ACCELERATION.parse)]
Frequency = Annotated[float, BeforeValidator(FREQUENCY.parse)]
Heading = Annotated[float, BeforeValidator(HEADING.parse)]
Mass = Annotated[float, BeforeValidator(MASS.parse)]
Inertia = Annotated[float, BeforeValidator(INERTIA.parse)]
LinearDensity = Annotated[float, BeforeValidator(LINEAR_DENSITY.parse)]
Force = Annotated[float, BeforeValidator(FORCE.parse)]
Density = Annotated[float, BeforeValidator(DENSITY.parse)]
Ratio = Annotated[float, BeforeValidator(RATIO.parse)]

PositiveLength = Annotated[Length, Field(gt=0)]
PositiveDuration = Annotated[Duration, Field(gt=0)]
PositiveFrequency = Annotated[Frequency, Field(gt=0)]
