"""`[[events]]` of a scenario: what changes at a time of the run."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import BeforeValidator, Field, StrictInt, model_validator

from tlpsim.scenarios.problems import problem
from tlpsim.scenarios.quantities import Duration, Heading, Ratio, Speed
from tlpsim.scenarios.sections import Current, CurrentTable, ParameterValue, Section

MOST_TENDONS = 12
"""Tendons that the contract of the platform has inputs for."""


def _as_list(value: object) -> object:
    return (value,) if isinstance(value, int) else value


TendonNumber = Annotated[StrictInt, Field(ge=1, le=MOST_TENDONS)]


class CurrentChange(Section):
    """Keys of `[current]` that change; the others stay. A speed takes the place of a table."""

    speed: Annotated[Speed, Field(ge=0)] | None = Field(default=None, description="at mean water level, m/s")
    heading_deg: Heading | None = Field(default=None, description="the direction toward which it flows")
    exponent: Annotated[Ratio, Field(ge=0)] | None = Field(default=None, description="of a power law over the depth")
    table: CurrentTable | None = Field(default=None, description="a current by depths, instead")

    def over(self, current: Current) -> Current:
        """The current with what changes."""
        changes = {name: getattr(self, name) for name in self.model_fields_set}
        if changes.get("speed") is not None:
            changes.setdefault("table", None)
        return current.model_copy(update=changes)


class Event(Section):
    """What changes at a time: values of components, tendons that are lost, the current."""

    at: Annotated[Duration, Field(ge=0, description="from the start of the simulation")]
    values: dict[str, ParameterValue] = Field(
        default={},
        alias="set",
        description='open inputs and tunable parameters, as "platform.external_force.surge" = 1e6',
    )
    lose_tendons: Annotated[tuple[TendonNumber, ...], BeforeValidator(_as_list)] = Field(
        default=(), description="number of the tendon that is lost, or a list of them"
    )
    current: CurrentChange | None = Field(default=None, description="keys of [current] that change")

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if not (self.values or self.lose_tendons or self.current):
            raise problem((), self.at, "does nothing: give it set, lose_tendons or current")
        for name in self.values:
            if not all(name.partition(".")):
                raise problem(("set", name), self.values[name], "must be written COMPONENT.VARIABLE")
        return self
