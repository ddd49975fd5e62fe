"""Results that are records of one case: the same scenario but for its seeds; and which of their signals are meant."""

from __future__ import annotations

import fnmatch
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.scenarios.problems import nearest
from tlpsim.scenarios.results import Results, ResultsError

_LABELS = ("title", "outputs.signals")  # what changes no value
_DEFAULT = (*(f"platform.position.{degree}" for degree in DEGREES_OF_FREEDOM), "platform.tendon_tension[*]")


def require_one_case(results: Sequence[Results]) -> None:
    """Refuse results that are not different records of one case.

    Raises
    ------
    ResultsError
        When there are none, two are of scenarios that differ in another key than a seed, have the same seeds, or one of
        several is not of a scenario.
    """
    if not results:
        raise ResultsError("statistics: there are no results; give one or more")
    first = results[0]
    if len(results) == 1:
        return
    keys = {id(each): _keys(each) for each in results}
    seen: dict[str, Results] = {}
    for each in results:
        mine, others = keys[id(each)], keys[id(first)]
        for key in (*others, *(key for key in mine if key not in others)):
            if mine.get(key) != others.get(key) and key not in _LABELS and not _is_seed(key):
                raise ResultsError(
                    f"{each.path}: is of another case than {first.path}: {key} is {_text(mine.get(key))}, and not "
                    f"{_text(others.get(key))}; records of one case differ in their seeds alone"
                )
        seeds = json.dumps([each.seeds, {key: value for key, value in mine.items() if _is_seed(key)}], sort_keys=True)
        if seeds in seen:
            raise ResultsError(
                f"{each.path}: has the same seeds as {seen[seeds].path}, and so is the same record; "
                "give one of them, or run it with another --seed"
            )
        seen[seeds] = each


def chosen_signals(results: Results, patterns: Sequence[str] | None) -> tuple[tuple[str, str], ...]:
    """Components and full names of recorded signals that match a pattern, in which `*` and `?` are wildcards.

    Without patterns, the platform's six positions and its tensions; without a platform, all signals.

    Raises
    ------
    ResultsError
        When a pattern matches none.
    """
    components = {f"{each}.{name}": each for each in results.components for name in results.signals(each)}
    chosen = matching_names(list(components), patterns)
    for pattern in patterns or ():
        if not any(_matches(name, pattern) for name in chosen):
            raise ResultsError(
                f"{results.path}: no recorded signal matches '{pattern}'{nearest(pattern, components)}; "
                "`*` stands for any text, as in 'platform.position.*'"
            )
    return tuple((components[name], name) for name in chosen)


def matching_names(names: Sequence[str], patterns: Sequence[str] | None) -> list[str]:
    """Names that match a pattern, in their order; by default those of `chosen_signals`."""
    if patterns is None:
        return [name for pattern in _DEFAULT for name in names if _matches(name, pattern)] or list(names)
    return [name for name in names if any(_matches(name, pattern) for pattern in patterns)]


def _matches(name: str, pattern: str) -> bool:
    # tendon_tension[1] is a name, not a set of characters.
    return fnmatch.fnmatchcase(name, pattern.replace("[", "[[]"))


def _keys(results: Results) -> dict[str, Any]:
    """Keys of the scenario, dotted, with their values."""
    if not results.has_scenario:
        raise ResultsError(
            f"{results.path}: is not of a scenario, whose seeds tell records of one case apart; give it alone"
        )
    return dict(_flat("", json.loads(results.attributes["scenario"])))


def _flat(prefix: str, content: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in content.items():
        name = f"{prefix}.{key}" if prefix else key
        if isinstance(value, Mapping) and value:
            yield from _flat(name, value)
        else:
            yield name, value


def _is_seed(key: str) -> bool:
    return key in ("simulation.seed", "wind.seed", "waves.seed") or key.endswith(".parameters.seed")


def _text(value: Any) -> str:
    return "not set" if value is None else json.dumps(value)
