"""Results as cases: records of one scenario that differ in their seeds make up one case."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tlpsim.scenarios.results import Results, ResultsError
from tlpsim.scenarios.schema import Scenario

_MOST_DIFFERENCES = 3  # that name a case

Differences = tuple[tuple[str, Any, Any], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Records of one scenario, or of one system without a scenario.

    Attributes
    ----------
    label
        What tells it from the other cases of a report; the title where it is alone.
    results
        Of each record, from other seeds.
    records
        What tells the records apart: "seed 2".
    scenario
        Of the first record; None for a system without a scenario.
    """

    label: str
    results: tuple[Results, ...]
    records: tuple[str, ...]
    scenario: Scenario | None


def cases(results: Sequence[Results]) -> tuple[Case, ...]:
    """Results as cases, in the order in which their first records are given.

    Records of the same scenario, the same components and other seeds are one case. The same record twice, by another
    way, makes two cases that can be compared.

    Raises
    ------
    ResultsError
        When a file is given twice, or a run holds no samples.
    """
    files = Counter(each.path.resolve() for each in results)
    twice = [path for path, count in files.items() if count > 1]
    if twice:
        raise ResultsError(f"{twice[0]}: is given twice; a record counts once")
    for each in results:
        if not any(len(each.time(component)) for component in each.components):
            raise ResultsError(f"{each.path}: the run holds no samples ({each.status}); there is nothing to report")
    groups: dict[tuple[str, int], list[Results]] = {}
    for each in results:
        identity = _identity(each)
        seeds = each.attributes.get("seeds", "")
        number = 0
        while any(seeds == other.attributes.get("seeds", "") for other in groups.get((identity, number), [])):
            number += 1
        groups.setdefault((identity, number), []).append(each)
    found = list(groups.values())
    labels = _case_labels([group[0] for group in found])
    return tuple(
        Case(
            label=label,
            results=tuple(group),
            records=_record_labels(group),
            scenario=group[0].scenario if group[0].has_scenario else None,
        )
        for label, group in zip(labels, found, strict=True)
    )


def differences(scenario: Scenario, other: Scenario | None = None) -> Differences:
    """Keys in which a scenario differs from another (from the default without it), its value and the other's.

    A key that one of the two has not got is None there.
    """
    mine, theirs = (dict(_flat(_plain(each))) for each in (scenario, other or Scenario()))
    keys = [*mine, *(key for key in theirs if key not in mine)]
    return tuple((key, mine.get(key), theirs.get(key)) for key in keys if mine.get(key) != theirs.get(key))


def _plain(scenario: Scenario) -> dict[str, Any]:
    return dict(json.loads(scenario.to_json()))


def _flat(data: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Keys, dotted, with their values; empty tables are left out."""
    for key, value in data.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{path}{key}.")
        else:
            yield f"{path}{key}", value


def _identity(results: Results) -> str:
    """What records of one case have in common: all but title and seeds, and the FMUs."""
    if not results.has_scenario:
        return str(results.path)
    data = dict(_flat(_plain(results.scenario)))
    kept = {key: value for key, value in data.items() if key != "title" and key.rpartition(".")[2] != "seed"}
    origins = {
        name: {key: str(value) for key, value in attributes.items() if key not in ("steps", "wall_time")}
        for name, attributes in results.components.items()
    }
    return json.dumps([kept, origins], sort_keys=True)


def _case_labels(firsts: Sequence[Results]) -> list[str]:
    """A label for each case: titles where they differ, else what differs in the scenarios, else names of files."""
    titles = [each.title for each in firsts]
    if len(set(titles)) == len(titles):
        return titles
    if all(each.has_scenario for each in firsts):
        base = firsts[0].scenario
        changed = [_without_seeds(differences(each.scenario, base)) for each in firsts]
        keys = list(dict.fromkeys(key for each in changed for key, _, _ in each))
        if 0 < len(keys) <= _MOST_DIFFERENCES:
            values = [dict(_flat(_plain(each.scenario))) for each in firsts]
            names = _short_names(keys)
            labels = [", ".join(f"{n} {_shown(v.get(k))}" for k, n in names.items()) for v in values]
            if len(set(labels)) == len(labels):
                return labels
    stems = [each.path.name.removesuffix(".part").removesuffix(".h5") for each in firsts]
    return stems if len(set(stems)) == len(stems) else [str(each.path) for each in firsts]


def _short_names(keys: Sequence[str]) -> dict[str, str]:
    """Names of keys without their sections, where that leaves them apart: "significant height"."""
    last = [key.rpartition(".")[2].replace("_", " ") for key in keys]
    return dict(zip(keys, last if len(set(last)) == len(last) else keys, strict=True))


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _record_labels(group: Sequence[Results]) -> tuple[str, ...]:
    if group[0].has_scenario:
        seeds = [f"seed {each.scenario.simulation.seed}" for each in group]
        if len(set(seeds)) == len(seeds):
            return tuple(seeds)
    names = [each.path.name for each in group]
    return tuple(names if len(set(names)) == len(names) else [str(each.path) for each in group])


def _without_seeds(found: Differences) -> Differences:
    return tuple(each for each in found if each[0] != "title" and each[0].rpartition(".")[2] != "seed")
