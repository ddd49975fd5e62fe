"""Events: values that change at given times of a run.

An event sets an input that nothing feeds, or a tunable parameter. All components are stepped up to its time, the values
are set, and the run goes on: they count from the first step that begins at that time or later. A component whose
steps do not fall on the time takes them with its next step, and so does one that is stepped ahead of the others; the
run's notes say so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tlpsim.loads.errors import WiringError
from tlpsim.orchestrator.clock import to_seconds
from tlpsim.orchestrator.instance import Instance, Variable, checked_parameters, nearest_match


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Values of a component that change at a time.

    Parameters
    ----------
    time
        In ns.
    component
        Name of the component.
    values
        Of inputs that nothing feeds and of tunable parameters, by variable name.
    """

    time: int
    component: str
    values: Mapping[str, float | int | bool | str]

    def __str__(self) -> str:
        return f"event at t = {to_seconds(self.time):.9g} s"


def check_event(event: Event, instances: Mapping[str, Instance], fed: Mapping[tuple[str, str], object]) -> None:
    """Check an event against the components of a system and the inputs that connections feed.

    Raises
    ------
    WiringError
        When there is no such component or variable, the variable cannot change in a run, a connection feeds it, or the
        value is not of its type.
    """
    if event.time < 0:
        raise WiringError(f"{event}: the time is negative; give one of the run")
    instance = instances.get(event.component)
    if instance is None:
        raise WiringError(f"{event}: no component '{event.component}'{nearest_match(event.component, instances)}")
    for name in event.values:
        variable = instance.variables.get(name)
        if variable is None:
            near = nearest_match(name, [key for key, each in instance.variables.items() if _can_change(each)])
            raise WiringError(f"{event}: component '{event.component}' has no variable '{name}'{near}")
        if not _can_change(variable):
            raise WiringError(
                f"{event}: '{event.component}.{name}' is {variable.causality}, {variable.variability}, and cannot "
                "change in a run; only inputs and tunable parameters can"
            )
        connection = fed.get((event.component, name))
        if connection is not None:
            raise WiringError(
                f"{event}: '{event.component}.{name}' is fed by {connection}; take that connection out, or set another "
                "input"
            )
    try:
        checked_parameters(event.component, instance.variables, event.values)
    except WiringError as error:
        raise WiringError(f"{event}: {error}") from None


def _can_change(variable: Variable) -> bool:
    return variable.causality == "input" or (variable.causality, variable.variability) == ("parameter", "tunable")


def due_times(events: Sequence[Event], begin: int, stop: int) -> list[int]:
    """Times of the events after `begin` and before `stop`, ns, each once."""
    return sorted({event.time for event in events if begin < event.time < stop})
