"""Rows of WAMIT's numeric output files: numbers, modes, places in a grid, and the dimensions of second-order forces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.bem.exchange.conventions import MODES
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

ROTATES = np.array([0, 0, 0, 1, 1, 1])
"""1 for a rotation, whose numbers have one more power of the length scale."""
_SAME = 1e-4  # relative difference of two prints of one period or heading


def drift_scale(density: float, gravity: float, length: float) -> FloatArray:
    """ρ g L and ρ g L², (6,), that second-order forces a unit amplitude squared are divided by; `length` is ULEN."""
    return np.asarray(density * gravity * length ** (1 + ROTATES), dtype=np.float64)


def is_in(value: float, grid: FloatArray) -> bool:
    """Whether a period or heading is one of a grid, to the digits that files have."""
    return bool(np.any(np.isclose(grid, value, rtol=_SAME, atol=_SAME)))


def place_in(path: Path, value: float, grid: FloatArray, what: str) -> int:
    """Index of a period or heading in the grid of the .1 or .3 file; ScenarioError where it is not there."""
    index = int(np.argmin(np.abs(grid - value)))
    if not is_in(value, grid):
        raise ScenarioError(f"{path} has the {what} {value:g}, which the .1 or .3 file has not; write all in one run")
    return index


def mode_of(path: Path, value: float) -> int:
    """Index, 0 to 5, of a mode's number; ScenarioError for those of a second body."""
    if not 1 <= value <= MODES:
        raise ScenarioError(f"{path} has mode {value:g}; only the six of one rigid body are read: export one body")
    return int(value) - 1


def numeric_rows(path: Path, columns: int) -> list[list[float]]:
    """Rows of numbers, without the heading lines that WAMIT writes or not.

    Raises
    ------
    ScenarioError
        If the file cannot be read, holds no rows, or a row is shorter than `columns`.
    """
    try:
        lines = [line.replace("D", "E").split() for line in path.read_text().splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: cannot be read ({error}); give the path or the stem of WAMIT's output") from error
    rows: list[list[float]] = []
    for line in lines:
        try:
            rows.append([float(word) for word in line])
        except ValueError:
            if rows:  # a heading stands above the numbers only
                rows.append([])
    if not rows or min(len(row) for row in rows) < columns:
        raise ScenarioError(f"{path}: rows of at least {columns} numbers are needed; write the WAMIT numeric output")
    return rows
