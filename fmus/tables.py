"""Tables in String parameters: JSON text to a record of `tlpsim.loads` and back.

FMI 2.0 has no arrays, so a table of any length travels as one JSON object of columns, such as
`{"position": [[0, 0, 30]], "area": [500], "shape_coefficient": [1.2]}`.
"""

from __future__ import annotations

import dataclasses
import json
from typing import Any, TypeVar

import numpy as np

from tlpsim.loads.errors import ScenarioError

Record = TypeVar("Record")


def record_from_json(record: type[Record], text: str, parameter: str) -> Record:
    """Make a record from JSON text; the columns are the record's fields.

    Raises
    ------
    ScenarioError
        When the text is no JSON object, a column is missing or unknown, or the record refuses a value.
    """
    try:
        columns = json.loads(text)
    except json.JSONDecodeError as error:
        raise ScenarioError(
            f"parameter {parameter} is no JSON: {error.msg} at character {error.pos}; give an object of columns"
        ) from error
    fields = [f for f in dataclasses.fields(record) if f.init]  # type: ignore[arg-type]
    names = [f.name for f in fields]
    required = {f.name for f in fields if f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING}
    if not isinstance(columns, dict) or not required <= set(columns) <= set(names):
        given = ", ".join(columns) if isinstance(columns, dict) else type(columns).__name__
        raise ScenarioError(f"parameter {parameter} has {given}; give an object with {', '.join(names)}")
    try:
        return record(**{name: _array(value) for name, value in columns.items()})
    except ValueError as error:
        raise ScenarioError(f"parameter {parameter}: {error}") from error


def record_to_json(record: Any) -> str:
    """JSON text from which `record_from_json` makes the same record."""
    columns = {f.name: getattr(record, f.name) for f in dataclasses.fields(record) if f.init}
    return json.dumps(
        {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in columns.items()}
    )


def matrix_from_json(text: str, parameter: str) -> Any:
    """Array from nested JSON lists.

    Raises
    ------
    ScenarioError
        When the text is no JSON list of numbers.
    """
    try:
        return np.array(json.loads(text), dtype=np.float64)
    except (json.JSONDecodeError, ValueError, TypeError) as error:
        raise ScenarioError(f"parameter {parameter} is no JSON list of numbers: {error}") from error


def _array(value: Any) -> Any:
    return np.array(value) if isinstance(value, list) else value
