"""What a results file says of the run that it is of, and which signals it keeps."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from tlpsim.orchestrator.clock import to_ticks
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
        Names of signals or patterns, see `tlpsim.scenarios.results.select_signals`.
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
