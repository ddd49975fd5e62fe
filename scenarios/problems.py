"""Messages about a bad scenario, on one line: what is wrong, where, the value, what is allowed, the way out.

The first problem is told in full and the others are counted. `ScenarioError` messages about keys are made
here from pydantic's records of what failed, so that the schema itself holds little prose.
"""

import difflib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError, PydanticUndefined

from tlpsim.loads.errors import ScenarioError

Location = tuple[int | str, ...]

_PHRASES = {
    "missing": "is missing: give it a value",
    "greater_than": "must be greater than {gt}",
    "greater_than_equal": "must be at least {ge}",
    "less_than": "must be less than {lt}",
    "less_than_equal": "must be at most {le}",
    "literal_error": "must be {expected}",
    "string_type": "must be text in quotes",
    "bool_type": "must be true or false",
    "int_type": "must be a whole number",
    "tuple_type": "must be a list in square brackets",
    "dict_type": "must be a table of keys",
    "model_type": "must be a table of keys",
    "too_long": "must have at most {max_length} entries, not {actual_length}",
    "too_short": "must have {min_length} or more entries, not {actual_length}",
    "string_too_short": "must not be empty",
    "value_error": "{error}",
    "scenario": "{text}",
}
_WITHOUT_VALUE = ("missing", "extra_forbidden")


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Where some keys of a scenario were written: a name for messages, and the keys as nested mappings."""

    name: str
    data: Mapping[str, Any]


def problem(location: Location, value: object, text: str) -> PydanticCustomError:
    """Error for a validator of the schema, about the key at `location` below the section it is raised in."""
    return PydanticCustomError("scenario", "{text}", {"location": location, "value": value, "text": text})


def nearest(word: str, known: Iterable[str]) -> str:
    """Hint " (did you mean '...'?)" for the closest known word, or "" when none is close."""
    close = difflib.get_close_matches(word, list(known), n=1)
    return f" (did you mean '{close[0]}'?)" if close else ""


def dotted(location: Location) -> str:
    """Location much as TOML writes it: ``wind.segments[0].area``, ``connections."wave.velocity.*"``."""
    text = ""
    for part in location:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            bare = re.fullmatch(r"[A-Za-z0-9_-]+", part)
            text += ("." if text else "") + (part if bare else f'"{part}"')
    return text


def scenario_error(
    error: ValidationError, sources: Sequence[Source], sections: Mapping[Location, type[BaseModel]]
) -> ScenarioError:
    """One-line error for the first of the problems that pydantic found.

    Parameters
    ----------
    error : ValidationError
        What pydantic found, in the order of the schema.
    sources : Sequence[Source]
        What was read, the strongest last; the message names the strongest one that holds the key.
    sections : Mapping[Location, type[BaseModel]]
        Model of every section by location; "*" stands for any name or index.
    """
    # A missing key comes last: it is often there under a wrong name.
    found = sorted(error.errors(include_url=False), key=lambda details: details["type"] == "missing")
    located = [(_location(details, sources), details) for details in found]
    location, details = located[0]
    others = len({other for other, _ in located} - {location})
    section = _section(location[:-1], sections)
    value = "" if details["type"] in _WITHOUT_VALUE else f" = {_shown(details, sources, location)}"
    text = f"{_source_name(location, sources)}: {dotted(location)}{value}: {_phrase(details, location, section)}"
    default = _default(location, section)
    if default and details["type"] not in _WITHOUT_VALUE:
        text += f"; the default is {default}"
    return ScenarioError(" ".join(text.split()) + (f" (and {others} more)" if others else ""))


def _location(details: ErrorDetails, sources: Sequence[Source]) -> Location:
    """Location of the key as the user wrote it, which is with `*` where that stood for six entries."""
    location: Location = details["loc"]
    if details["type"] == "scenario":
        location += details["ctx"]["location"]
    if len(location) > 1 and location[0] == "connections" and not _held(location[:2], sources):
        target = str(location[1]).rpartition(".")[0] + ".*"
        if _held(("connections", target), sources):
            return ("connections", target, *location[2:])
    return location


def _held(location: Location, sources: Sequence[Source]) -> list[tuple[Source, Any]]:
    """Sources that hold the location, each with the value there, the strongest last."""
    found = []
    for source in sources:
        value: Any = source.data
        try:
            for part in location:
                value = value[part]
        except (KeyError, IndexError, TypeError):
            continue
        found.append((source, value))
    return found


def _source_name(location: Location, sources: Sequence[Source]) -> str:
    held = _held(location, sources)
    return held[-1][0].name if held else sources[0].name


def _shown(details: ErrorDetails, sources: Sequence[Source], location: Location) -> str:
    held = _held(location, sources)
    value = held[-1][1] if held else details.get("ctx", {}).get("value", details["input"])
    try:
        text = json.dumps(value, ensure_ascii=False)
    except TypeError:
        text = str(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _phrase(details: ErrorDetails, location: Location, section: type[BaseModel] | None) -> str:
    if details["type"] == "extra_forbidden":
        known = [field.alias or name for name, field in section.model_fields.items()] if section else []
        return f"unknown key{nearest(str(location[-1]), known)}; the keys here are {', '.join(known)}"
    if details["type"] in _PHRASES:
        return _PHRASES[details["type"]].format(**details.get("ctx", {}))
    return details["msg"].replace("Input should be", "must be")


def _section(location: Location, sections: Mapping[Location, type[BaseModel]]) -> type[BaseModel] | None:
    for pattern, section in sections.items():
        if len(pattern) == len(location) and all(
            name in ("*", part) for name, part in zip(pattern, location, strict=True)
        ):
            return section
    return None


def _default(location: Location, section: type[BaseModel] | None) -> str:
    field = section.model_fields.get(str(location[-1])) if section and location else None
    if field is None or field.default is None or field.default is PydanticUndefined:
        return ""
    try:
        return json.dumps(field.default, ensure_ascii=False)
    except TypeError:
        return ""
