"""Checks of parameters that several records share."""

import difflib
from collections.abc import Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.errors import ScenarioError

Entry = TypeVar("Entry")


def require_positive(name: str, value: ArrayLike, unit: str) -> NDArray[np.float64]:
    """Return `value` as an array; ScenarioError unless all of it is finite and > 0."""
    result = np.asarray(value, dtype=np.float64)
    if not (np.all(np.isfinite(result)) and np.all(result > 0.0)):
        raise ScenarioError(f"{name} is {np.array2string(result)} {unit}; it must be finite and > 0")
    return result


def entry(table: Mapping[str, Entry], name: str, what: str) -> Entry:
    """Entry of a table by name, such as `entry(SPECTRA, "kaimal", "wind spectrum")`.

    Raises
    ------
    ScenarioError
        If there is no such entry; the message names the nearest one.
    """
    if name in table:
        return table[name]
    nearest = difflib.get_close_matches(name.lower(), table, n=1, cutoff=0.0)[0]
    raise ScenarioError(f"{what} {name!r} is not known; did you mean {nearest!r}? Known: {', '.join(sorted(table))}")
