"""What a results file says of the run that it is of, and which signals it keeps."""

from __future__ import annotations

import fnmatch
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from tlpsim.loads.errors import ScenarioError
from tlpsim.orchestrator.clock import to_ticks
from tlpsim.scenarios.problems import nearest
from tlpsim.scenarios.schema import Scenario

_NONE: Mapping[str, Mapping[str, str]] = MappingProxyType({})


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """What is recorded of a run.

    Parameters
    ----------
    title
        Title of the run.
    end
        Time in ns after which samples are left out.
    signals
        Names of signals or patterns, see `select_signals`.
    names
        Names under which outputs are recorded, by component and output, where they differ.
    attributes
        Further attributes of the file.
    """

    title: str
    end: int
    signals: tuple[str, ...] = ("*",)
    names: Mapping[str, Mapping[str, str]] = field(default_factory=lambda: _NONE)
    attributes: Mapping[str, str] = field(default_factory=dict)

    def name(self, component: str, output: str) -> str:
        """Name under which an output of a component is recorded."""
        return self.names.get(component, {}).get(output, output)


def recording_of(scenario: Scenario) -> Recording:
    """Recording of a scenario's run: under the contract's names, with the scenario and its seeds."""
    return Recording(
        title=scenario.title,
        end=to_ticks(scenario.simulation.duration, "simulation.duration"),
        signals=scenario.outputs.signals,
        names={
            name: {own: contract for contract, own in entry.map.items()} for name, entry in scenario.components.items()
        },
        attributes={"scenario": scenario.to_json(), "seeds": json.dumps(scenario.seeds())},
    )


def select_signals(names: Sequence[str], patterns: Sequence[str]) -> set[str]:
    """Signals that match one of the patterns, in which `*` and `?` are wildcards and brackets are not.

    Raises
    ------
    ScenarioError
        When a pattern matches none of the names.
    """
    chosen: set[str] = set()
    for pattern in patterns:
        # tendon_tension[1] is a name, not a set of characters.
        literal = pattern.replace("[", "[[]")
        matching = {name for name in names if fnmatch.fnmatchcase(name, literal)}
        if not matching:
            raise ScenarioError(
                f"outputs.signals: '{pattern}' matches no signal{nearest(pattern, names)}; "
                "`*` stands for any text, as in 'platform.position.*'"
            )
        chosen |= matching
    return chosen
