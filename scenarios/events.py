"""From the events of a scenario to those of the system that runs it."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping

from tlpsim.loads.errors import ScenarioError
from tlpsim.orchestrator.clock import to_ticks
from tlpsim.orchestrator.events import Event
from tlpsim.orchestrator.instance import Instance
from tlpsim.scenarios.event_sections import Event as Entry
from tlpsim.scenarios.parameters import Parameters, current_parameters
from tlpsim.scenarios.schema import Scenario

_LOST = 0.0  # value of the platform's input tendon_intact[n]


def ordered(scenario: Scenario) -> list[tuple[Entry, Scenario]]:
    """Events in the order of time, each with the scenario whose current is that after it; late ones with a warning."""
    found = []
    for event in sorted(scenario.events, key=lambda each: each.at):
        if event.current is not None:
            scenario = scenario.model_copy(update={"current": event.current.over(scenario.current)})
        if event.at < scenario.simulation.duration:
            found.append((event, scenario))
        else:
            end = scenario.simulation.duration
            warnings.warn(f"event at {event.at:g} s: has no effect, the run ends at {end:g} s", stacklevel=2)
    return found


def system_events(scenario: Scenario, instances: Mapping[str, Instance]) -> tuple[Event, ...]:
    """Events of the system, by the FMUs' own names.

    Raises
    ------
    ScenarioError
        When a tendon is to be lost without a platform, or a current to change that no component has.
    """
    return tuple(
        Event(time=to_ticks(entry.at, "events.at"), component=name, values=values)
        for entry, after in ordered(scenario)
        for name, values in _values(entry, after, instances)
    )


def _values(entry: Entry, scenario: Scenario, instances: Mapping[str, Instance]) -> Iterator[tuple[str, Parameters]]:
    """Component and values of everything that an event sets."""
    components = scenario.components
    for target, value in entry.values.items():
        name, _, variable = target.partition(".")
        yield name, {components[name].own_name(variable): value}
    if entry.lose_tendons:
        if "platform" not in components:
            raise ScenarioError(f"event at {entry.at:g} s: lose_tendons needs the component 'platform'")
        platform = components["platform"]
        yield "platform", {platform.own_name(f"tendon_intact[{number}]"): _LOST for number in entry.lose_tendons}
    if entry.current is None:
        return
    taken = False
    for name in ("wave", "platform"):
        if name in components:
            given = {components[name].own_name(key): value for key, value in current_parameters(scenario).items()}
            known = instances[name].variables
            if all(key in known and known[key].variability == "tunable" for key in given):
                taken = True
                yield name, given
    if not taken:
        names = ", ".join(current_parameters(scenario))
        raise ScenarioError(
            f"event at {entry.at:g} s: no component 'wave' or 'platform' has the tunable parameters {names}, which a "
            "change of the current sets; map them, or set the FMU's own by `set`"
        )
