"""From TOML text to nested mappings: the file, settings on the command line, merging, `*` in the wiring.

Nothing here knows which keys exist, beside the tables `components` and `connections`; the schema does.
"""

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError

# The key whose empty text removes an entry of the table.
_REMOVED_BY = {"components": "fmu", "connections": "from"}


def read_toml(path: Path, what: str = "scenario") -> dict[str, Any]:
    """Contents of a TOML file; `what` it holds is for messages.

    Raises
    ------
    ScenarioError
        When there is no such file, it cannot be read, or it is not TOML; then with the line and the reason.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")  # a file from Windows may begin with a byte order mark
    except FileNotFoundError:
        raise ScenarioError(f"{path}: no such {what} file; give the path of a .toml file") from None
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: not a text file in UTF-8 (byte {error.start}); save it as UTF-8") from None
    except OSError as error:
        raise ScenarioError(f"{path}: the {what} file cannot be read: {error.strerror}") from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(_toml_problem(path, text, str(error))) from None


def _toml_problem(path: Path, text: str, reason: str) -> str:
    lines = text.splitlines()
    match = re.search(r" \(at line (\d+), column \d+\)$", reason)
    # Without a number the parser stopped at the end of the document.
    line = int(match[1]) if match else len(lines)
    written = lines[line - 1].strip()[:60] if 0 < line <= len(lines) else ""
    reason = reason.partition(" (at ")[0]
    return f"{path}, line {line}: not valid TOML: {reason}; the line is: {written}"


def parse_override(text: str) -> dict[str, Any]:
    """Nested mapping of one setting "KEY=VALUE", read as a line of TOML; a VALUE that is no TOML is text.

    Raises
    ------
    ScenarioError
        When the text has no "=" or the key is not a dotted TOML key.
    """
    key, equals, value = text.partition("=")
    # The second reading is of the value as text; a string of JSON is one of TOML.
    for written in (value, json.dumps(value.strip(), ensure_ascii=False)):
        try:
            if equals and key.strip():
                return tomllib.loads(f"{key} = {written}")
        except tomllib.TOMLDecodeError:
            continue
    raise ScenarioError(f"override '{text}' is not of the form KEY=VALUE: write it like wind.speed=30")


def merge(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """`base` with `changes` over it: tables are merged key by key, everything else is replaced."""
    merged = dict(base)
    for key, value in changes.items():
        below = merged.get(key)
        merged[key] = merge(below, value) if isinstance(below, Mapping) and isinstance(value, Mapping) else value
    return merged


def expand(connections: Mapping[str, Any]) -> dict[str, Any]:
    """Connections with `*` written out for the six degrees of freedom; an entry without `*` is the stronger.

    A `*` on one side only is left as it is, for the schema to refuse.
    """
    general: dict[str, Any] = {}
    single: dict[str, Any] = {}
    for target, entry in connections.items():
        source = entry.get("from") if isinstance(entry, Mapping) else None
        from_all = source.count("*") == 1 if isinstance(source, str) and source else True
        if target.count("*") != 1 or not from_all:
            single[target] = entry
            continue
        for name in DEGREES_OF_FREEDOM:
            one = {**entry, "from": source.replace("*", name)} if isinstance(source, str) else entry
            general[target.replace("*", name)] = one
    return merge(general, single)


def resolve(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Merge `changes` into a complete scenario and leave out what they remove.

    Parameters
    ----------
    base : Mapping[str, Any]
        Scenario with every component and every connection, the latter without `*`.
    changes : Mapping[str, Any]
        Keys that differ. A component with ``fmu = ""`` is removed together with the connections of the base
        that touch it, and a connection with ``from = ""`` is removed.
    """
    removed = {name for name, entry in _table(changes, "components").items() if _is_removed("components", entry)}
    connections = {
        target: entry
        for target, entry in base["connections"].items()
        if not {target.partition(".")[0], entry["from"].partition(".")[0]} & removed
    }
    expanded = {"connections": expand(_table(changes, "connections"))} if _table(changes, "connections") else {}
    merged = merge({**base, "connections": connections}, {**changes, **expanded})
    for section in _REMOVED_BY:
        if isinstance(merged[section], Mapping):
            entries = merged[section].items()
            merged[section] = {name: entry for name, entry in entries if not _is_removed(section, entry)}
    return merged


def absolute_paths(data: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """`data` with the paths of FMUs and tables, which are relative to the scenario's folder, made absolute."""
    components = {}
    for name, entry in _table(data, "components").items():
        fmu = entry.get("fmu") if isinstance(entry, Mapping) else None
        if isinstance(fmu, str) and fmu.lower().endswith((".fmu", ".csv")):
            components[name] = {"fmu": str((folder / Path(fmu).expanduser()).resolve())}
    return merge(data, {"components": components}) if components else dict(data)


def _table(data: Mapping[str, Any], section: str) -> Mapping[str, Any]:
    value = data.get(section)
    return value if isinstance(value, Mapping) else {}


def _is_removed(section: str, entry: object) -> bool:
    return isinstance(entry, Mapping) and entry.get(_REMOVED_BY[section]) == ""
