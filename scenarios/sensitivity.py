"""How the response goes with the environment and the platform: `tlpsim sensitivity`.

One key of the scenario at a time is changed up and down by a part of its value, a heading by degrees, and the frequency
domain says what becomes of the paper's Table I and of the largest tension.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError, SolverError, TlpsimError
from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios.parallel import in_parallel
from tlpsim.scenarios.problems import nearest
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.spectral_tables import ENDS, quantity_statistics
from tlpsim.scenarios.statistics.summary import TABLE_UNITS

ENVIRONMENT = (
    "wind.speed",
    "wind.heading_deg",
    "waves.significant_height",
    "waves.peak_period",
    "waves.heading_deg",
    "current.speed",
    "current.heading_deg",
)
PLATFORM = (
    "platform.drag_coefficient",
    "platform.tendons.axial_stiffness",
    "platform.damping_ratios",
)
PRETENSION = "platform.tendons.pretension"
NEW_DATABASE = ("platform.mass", "platform.draught", PRETENSION)
"""Keys with which the hydrodynamics are computed anew, some 25 s a case: only if asked for. Weight, buoyancy and
pretension stay in balance: the pretension takes up a change of mass or draught, and the mass one of the pretension."""
STATISTICS: dict[str, tuple[str, float]] = {
    f"{degree} {what}": TABLE_UNITS[degree] for degree in DEGREES_OF_FREEDOM for what in ("mean", "LF", "WF")
} | {"tension std": ("MN", 1e-6), "tension max": ("MN", 1e-6)}
"""Unit and factor of the SI unit for each statistic; those of the tension are the largest of all tendons at the top."""

_FIELDS = {"mean": "mean", "LF": "low_frequency", "WF": "wave_frequency"}
_NEGLIGIBLE = 1e-9  # in the table's unit: a base that is zero but for rounding has no relative change


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One changed key.

    Attributes
    ----------
    parameter, label
        The key, and the change as it is written: "-10 %" or "+10°".
    value
        Of the key then, None of a key that is left as it is.
    statistics
        In the order and the units of `STATISTICS`; none of a case that failed.
    problem
        Why it failed, "" if it did not.
    """

    parameter: str
    label: str
    value: float | tuple[float, ...] | None
    statistics: tuple[float, ...]
    problem: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """Changes of one scenario.

    Attributes
    ----------
    scenario
        That was changed.
    base
        Its own statistics, in the order and the units of `STATISTICS`.
    changes
        Down and up of each parameter, in their order.
    notes
        Parameters that were left out, and why.
    """

    scenario: Scenario
    base: tuple[float, ...]
    changes: tuple[Change, ...]
    notes: tuple[str, ...]

    def relative(self, change: Change) -> tuple[float, ...]:
        """Relative change of each statistic, by the modulus of the base; NaN of a failed case and of a base of zero."""
        if change.problem:
            return (math.nan,) * len(self.base)
        return tuple(
            (new - old) / abs(old) if abs(old) > _NEGLIGIBLE else math.nan
            for new, old in zip(change.statistics, self.base, strict=True)
        )

    @property
    def parameters(self) -> tuple[str, ...]:
        """Parameters that were changed."""
        return tuple(dict.fromkeys(change.parameter for change in self.changes))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Case:
    """A scenario to analyse, and the change that made it; a base must succeed."""

    scenario: Scenario
    parameter: str
    label: str
    value: float | tuple[float, ...] | None


def sensitivity(
    scenario: Scenario,
    parameters: Sequence[str] | None = None,
    *,
    change: float = 0.1,
    turn: float = 10.0,
    new_databases: bool = False,
    workers: int | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Sensitivity:
    """Analyse a scenario with each of its parameters up and down.

    Parameters
    ----------
    parameters
        Dotted keys of numbers; those of `ENVIRONMENT` and `PLATFORM` without it.
    change
        Part of the value, between 0 and 1.
    turn
        Of headings (`_deg`), degrees.
    new_databases
        Whether the keys of `NEW_DATABASE` belong to the default parameters.
    workers, progress
        As of `tlpsim.scenarios.parallel.in_parallel`.

    Raises
    ------
    ScenarioError
        When a parameter is named that is no number of the scenario, a change is out of its range, or nothing is left to
        change.
    TlpsimError
        When the scenario itself cannot be analysed. A changed one that cannot is told in its `Change`.
    """
    if not 0.0 < change < 1.0:
        raise ScenarioError(f"change is {100 * change:g} %; it must be above 0 and below 100 %")
    if not 0.0 < turn < 180.0:
        raise ScenarioError(f"change of headings is {turn:g}°; it must be above 0 and below 180°")
    chosen = (*ENVIRONMENT, *PLATFORM, *(NEW_DATABASE if new_databases else ())) if parameters is None else parameters
    cases, failed, notes = _cases(scenario, chosen, change, turn)
    if not cases and not failed:
        raise ScenarioError(f"sensitivity: nothing is left to change; {'; '.join(notes) or 'name parameters'}")
    base = _Case(scenario=scenario, parameter="", label="", value=None)
    first, *changes = in_parallel(_analysed, [base, *cases], workers, progress)
    if first.problem:
        raise SolverError(first.problem)
    order = {name: place for place, name in enumerate(chosen)}
    return Sensitivity(
        scenario=scenario,
        base=first.statistics,
        changes=tuple(sorted([*changes, *failed], key=lambda each: (order[each.parameter], each.label[0] == "+"))),
        notes=tuple(notes),
    )


def _cases(
    scenario: Scenario, parameters: Sequence[str], change: float, turn: float
) -> tuple[list[_Case], list[Change], list[str]]:
    """Scenarios to analyse, changes that no scenario may have, and notes on what is left out."""
    cases, failed, notes = [], [], []
    for parameter in dict.fromkeys(parameters):
        value = _value(scenario, parameter)
        heading = parameter.endswith("_deg")
        if value is None or (not heading and not any(value if isinstance(value, tuple) else (value,))):
            notes.append(f"{parameter} is {'not given' if value is None else 'zero'} in the scenario and left out")
            continue
        for sign in (-1.0, 1.0):
            label = f"{'+' if sign > 0.0 else '-'}{turn:g}°" if heading else f"{sign * 100.0 * change:+g} %"
            if isinstance(value, tuple):
                new: float | tuple[float, ...] = tuple((1.0 + sign * change) * each for each in value)
            else:
                new = value + sign * turn if heading else (1.0 + sign * change) * value
            try:
                changed = _changed(scenario, parameter, new)
                cases.append(_Case(scenario=changed, parameter=parameter, label=label, value=new))
            except ScenarioError as error:
                problem = str(error)
                failed.append(Change(parameter=parameter, label=label, value=new, statistics=(), problem=problem))
    return cases, failed, notes


def _changed(scenario: Scenario, parameter: str, value: float | tuple[float, ...]) -> Scenario:
    """Scenario with another value of a key, in balance."""
    if parameter not in NEW_DATABASE:
        return scenario.with_(**{parameter: value})
    platform: dict[str, Any] = {"tendons": {"pretension": None}}
    if parameter == PRETENSION:
        assert isinstance(value, float)
        platform["mass"] = scenario.platform.mass - (value - _pretension(scenario)) / scenario.site.gravity
    else:
        platform[parameter.partition(".")[2]] = value
    return scenario.with_(platform=platform)


def _pretension(scenario: Scenario) -> float:
    """Of all tendons, N, also where the scenario leaves it to the balance of weight and buoyancy."""
    from tlpsim.loads.issc_tlp import displaced_volume

    given, site = scenario.platform.tendons.pretension, scenario.site
    buoyancy = site.water_density * site.gravity * displaced_volume(scenario.platform.draught)
    return buoyancy - scenario.platform.mass * site.gravity if given is None else given


def _value(scenario: Scenario, parameter: str) -> float | tuple[float, ...] | None:
    """Value of a dotted key; None where it is not given."""
    if parameter == PRETENSION:
        return _pretension(scenario)
    value: Any = scenario.model_dump(by_alias=True)
    for depth, part in enumerate(parts := parameter.split(".")):
        if not isinstance(value, dict) or part not in value:
            where = ".".join(parts[:depth])
            hint = nearest(part, value) if isinstance(value, dict) else ""
            raise ScenarioError(f"--parameters: no key '{parameter}': '{part}' is not in [{where}]{hint}")
        value = value[part]
    numbers = value if isinstance(value, tuple | list) else [value]
    if value is None:
        return None
    if not numbers or not all(isinstance(each, int | float) and not isinstance(each, bool) for each in numbers):
        raise ScenarioError(f"--parameters: '{parameter}' is no number; name keys of numbers, as wind.speed")
    return tuple(map(float, numbers)) if isinstance(value, tuple | list) else float(value)


def _analysed(case: _Case) -> Change:
    from tlpsim.scenarios.spectral import spectral_response

    try:
        statistics = response_statistics(spectral_response(case.scenario), case.scenario.simulation.duration)
        problem = ""
    except TlpsimError as error:
        statistics, problem = (), str(error)
    return Change(parameter=case.parameter, label=case.label, value=case.value, statistics=statistics, problem=problem)


def response_statistics(response: SpectralResponse, duration: float) -> tuple[float, ...]:
    """`STATISTICS` of a response, extremes in a duration (s); NaN for tensions that it has not."""
    found: dict[str, float] = {}
    for degree in DEGREES_OF_FREEDOM:
        each = quantity_statistics(response.quantities[f"position.{degree}"], duration)
        found |= {f"{degree} {short}": getattr(each, field) for short, field in _FIELDS.items()}
    tensions = [
        quantity_statistics(quantity, duration)
        for name, quantity in response.quantities.items()
        if name.startswith(f"{ENDS['top']}[")
    ]
    found["tension std"] = max((each.std for each in tensions), default=math.nan)
    found["tension max"] = max((each.maximum for each in tensions), default=math.nan)
    return tuple(factor * found[name] for name, (_, factor) in STATISTICS.items())
