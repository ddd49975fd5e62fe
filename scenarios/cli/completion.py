"""What the shell offers at TAB: keys of a scenario and the values that they take.

Files, options, and the words of an option that takes one of a few are completed without this.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

COMPONENTS = ("wind", "wave", "platform")


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """A key of a scenario.

    Attributes
    ----------
    words
        That it takes, where it takes words only.
    default
        As text; "" where there is none that fits on a line.
    """

    words: tuple[str, ...]
    default: str


def settings(incomplete: str) -> list[tuple[str, str]]:
    """Keys for `--set`, each with what it is by default; of a single key its values, too.

    The key itself stands beside them, so that the shell leaves the cursor behind the =.
    """
    typed, equals, _ = incomplete.partition("=")
    matching = {name: key for name, key in scenario_keys() if (name == typed if equals else name.startswith(typed))}
    found = [(f"{name}=", f"default {key.default}" if key.default else "") for name, key in matching.items()]
    if len(matching) == 1:
        name, key = next(iter(matching.items()))
        found += [(f"{name}={value}", "") for value in key.words or (key.default,) if value and " " not in value]
    return [(text, told) for text, told in found if text.startswith(incomplete)]


def parameters(incomplete: str) -> list[str]:
    """Keys for the last of a list with commas, as `tlpsim sensitivity --parameters` takes it."""
    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name, _ in scenario_keys() if name.startswith(last)]


def component_names(incomplete: str) -> list[str]:
    """Components that have a contract, for `tlpsim swap`."""
    return [name for name in COMPONENTS if name.startswith(incomplete)]


def scenario_keys() -> Iterator[tuple[str, Key]]:
    """All dotted keys of a scenario with the standard components.

    Those of parameters and connections are left out: their names are not the schema's.
    """
    from tlpsim.scenarios.schema import STANDARD_COMPONENTS, Scenario
    from tlpsim.scenarios.sections import Component

    yield from _keys(Scenario, "")
    for component in STANDARD_COMPONENTS:
        yield from _keys(Component, f"components.{component}.")


def _keys(section: Any, prefix: str) -> Iterator[tuple[str, Key]]:
    for name, field in section.model_fields.items():
        kinds = list(_kinds(field.annotation))
        if any(get_origin(kind) is dict for kind in kinds):
            continue
        inner = [kind for kind in kinds if hasattr(kind, "model_fields")]
        if inner:
            yield from _keys(inner[0], f"{prefix}{name}.")
            continue
        value = None if field.is_required() else field.default
        text = str(value) if isinstance(value, str | int | float) else ""
        default = text.lower() if isinstance(value, bool) else text
        yield f"{prefix}{name}", Key(words=tuple(word for kind in kinds for word in _words(kind)), default=default)


def _kinds(annotation: Any) -> Iterator[Any]:
    """Types of a field; those of `X | None` are two."""
    if get_origin(annotation) in (Union, UnionType):
        for each in get_args(annotation):
            yield from _kinds(each)
    elif hasattr(annotation, "__metadata__"):
        yield from _kinds(annotation.__origin__)
    else:
        yield annotation


def _words(kind: Any) -> tuple[str, ...]:
    if kind is bool:
        return "true", "false"
    return tuple(str(word) for word in get_args(kind)) if get_origin(kind) is Literal else ()
