"""Events of a monolithic run: stretches of it, each with a model of its own.

As in the co-simulation, a force or a current that is set at t acts at the end of the first step that begins at t or
later, and a tether is lost or taken back at the end of that step; its tension is recorded so from the next sample on.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tlpsim.fmus.platform_fmu import TlpsimPlatform, tendon_current
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.simulation import CoupledModel
from tlpsim.orchestrator.clock import to_ticks
from tlpsim.scenarios.assemble import wave_loads
from tlpsim.scenarios.events import ordered
from tlpsim.scenarios.parameters import parameter_values, standard_parameters
from tlpsim.scenarios.schema import Scenario

_KEPT = 0.5  # a tendon is lost below this, halfway between the two values of its input
_FORCE = re.compile(rf"platform\.external_force\.({'|'.join(DEGREES_OF_FREEDOM)})")
_TENDON = re.compile(r"platform\.tendon_intact\[(\d+)\]")


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """Steps `first` to `last` of a run with one model; `intact` are tendons that change at its start, by number."""

    first: int
    last: int
    model: CoupledModel
    intact: dict[int, bool]


def stretches(scenario: Scenario, model: CoupledModel, step: int, steps: int) -> Iterator[Stretch]:
    """Stretches of a run between its events.

    Parameters
    ----------
    scenario
        With the events.
    model
        At the start.
    step, steps
        In ns, and their number.

    Raises
    ------
    ScenarioError
        When an event sets what a monolithic run has not.
    """
    models = {0: model}
    intact: dict[int, dict[int, bool]] = {}
    given = scenario.components["platform"].parameters
    force = np.array([float(given.get(f"external_force.{degree}", 0.0)) for degree in DEGREES_OF_FREEDOM])
    for event, after in ordered(scenario):
        number = -(-to_ticks(event.at, "events.at") // step)
        tendons = dict.fromkeys(event.lose_tendons, False)
        for target, value in event.values.items():
            if tendon := _TENDON.fullmatch(target):
                tendons[int(tendon[1])] = float(value) > _KEPT
            elif degree := _FORCE.fullmatch(target):
                before = force.copy()
                force[DEGREES_OF_FREEDOM.index(degree[1])] = float(value)
                model = replace(model, external=model.external + force - before)
            else:
                raise ScenarioError(
                    f"event at {event.at:g} s: a monolithic run cannot set {target}, only platform.external_force.* "
                    "and platform.tendon_intact[n]; run the scenario as a co-simulation"
                )
        if event.current is not None:
            model = _in_current(model, after)
        models[number] = model
        if tendons:
            intact.setdefault(number + 1, {}).update(tendons)
    bounds = [*sorted({number for number in (*models, *intact) if number < steps}), steps]
    for first, last in pairwise(bounds):
        model = models[max(number for number in models if number <= first)]
        yield Stretch(first=first, last=last, model=model, intact=intact.get(first, {}))


def _in_current(model: CoupledModel, scenario: Scenario) -> CoupledModel:
    """The model with the current of a scenario around the hull and past the tethers; the waves go on."""
    value = parameter_values(TlpsimPlatform, standard_parameters(scenario, "platform"))
    platform = replace(model.platform, current=tendon_current(value, model.platform.tendons))
    waves = None if model.waves is None else wave_loads(scenario, model.waves.sea)
    return replace(model, platform=platform, waves=waves)
