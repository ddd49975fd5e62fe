"""The axes of a sweep: rows of settings that vary together, each with its probability where the axis is weighted.

A scatter diagram is one axis of two keys, a list of cases one of all its keys, a key of the grid one of its own, and a
Latin hypercube one of as many rows as it has samples. Cases are all combinations of a row of each axis.
"""

from __future__ import annotations

import csv
import itertools
import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.random_numbers import random_generator
from tlpsim.scenarios.sweep.sections import (
    SEEDS,
    KeyPath,
    LatinHypercube,
    Linked,
    Normal,
    Range,
    Scatter,
    SweepFile,
    Uniform,
    Values,
    beside,
    key_path,
)

_STREAM = 9  # of random numbers, apart from those of wind (1) and waves


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """Settings that a case takes together.

    Attributes
    ----------
    settings
        Value by key of the scenario.
    probability
        Of this row of its axis; None on an axis that is not weighted.
    name
        "" for none.
    """

    settings: Mapping[KeyPath, Any]
    probability: float | None = None
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """Rows of which each case has one.

    Attributes
    ----------
    keys
        Of all rows.
    rows
        One or more.
    weighted
        Whether rows have probabilities: they are then environments, and otherwise alternatives of a design.
    notes
        What was left out.
    """

    keys: tuple[KeyPath, ...]
    rows: tuple[Row, ...]
    weighted: bool
    notes: tuple[str, ...] = ()


def axes(file: SweepFile, path: Path) -> tuple[Axis, ...]:
    """Axes of a sweep's file, whose `path` is for messages and for the files that it names.

    Raises
    ------
    ScenarioError
        When a key is no key or stands on two axes, is a seed, or a scatter diagram cannot be read.
    """
    try:
        found = [
            *([_scatter(file.scatter, path)] if file.scatter else []),
            *([_listed(file)] if file.cases else []),
            *(_grid(key, values) for key, values in file.grid.items()),
            *([_latin_hypercube(file.latin_hypercube)] if file.latin_hypercube else []),
        ]
        linked = [key_path(key) for key in file.linked]
        leaders = [key_path(each.by) for each in file.linked.values()]
    except ValueError as error:
        raise ScenarioError(f"{path}: {error}") from None
    taken: dict[KeyPath, None] = {}
    for keys in (*(axis.keys for axis in found), linked):
        for key in keys:
            if key in taken:
                raise ScenarioError(
                    f"{path}: '{'.'.join(key)}' varies in two places: leave it in one of scatter, cases, grid, "
                    "latin_hypercube and linked"
                )
            if key in SEEDS:
                raise ScenarioError(
                    f"{path}: '{'.'.join(key)}' cannot vary: every record has seeds of its own; "
                    "[replicates] says how many records a case has, and from which seed"
                )
            taken[key] = None
    for number, (key, leader) in enumerate(zip(linked, leaders, strict=True)):
        if leader in linked[number:]:
            raise ScenarioError(
                f"{path}: linked: '{'.'.join(key)}' follows '{'.'.join(leader)}', which is linked too and does not "
                "stand before it: put that one first"
            )
    return tuple(found)


def combinations(found: Sequence[Axis]) -> Iterator[tuple[Row, ...]]:
    """A row of each axis, the last axis varying fastest."""
    return itertools.product(*(axis.rows for axis in found))


# Kinds of axes


def _grid(key: str, values: Values | Range) -> Axis:
    path = key_path(key)
    if isinstance(values, Range):
        numbers = np.linspace(values.first, values.last, values.count).tolist()
        return Axis(keys=(path,), rows=tuple(Row(settings={path: each}) for each in numbers), weighted=False)
    shares = values.probability or (None,) * len(values.values)
    rows = tuple(
        Row(settings={path: each}, probability=share) for each, share in zip(values.values, shares, strict=True)
    )
    return Axis(keys=(path,), rows=rows, weighted=values.probability is not None)


def _listed(file: SweepFile) -> Axis:
    rows = tuple(
        Row(
            settings={key_path(key): value for key, value in case.settings.items()},
            probability=case.probability,
            name=case.name,
        )
        for case in file.cases
    )
    keys = dict.fromkeys(key for row in rows for key in row.settings)
    return Axis(keys=tuple(keys), rows=rows, weighted=rows[0].probability is not None)


def _latin_hypercube(given: LatinHypercube) -> Axis:
    """Samples of each key in as many strata of the same probability, one in each, in random order."""
    keys = [key_path(key) for key in given.keys]
    columns = []
    for number, spread in enumerate(given.keys.values()):
        generator = random_generator(given.seed, _STREAM, number)
        level = (generator.permutation(given.samples) + generator.random(given.samples)) / given.samples
        if isinstance(spread, Uniform):
            columns.append((spread.low + (spread.high - spread.low) * level).tolist())
        elif isinstance(spread, Normal):
            columns.append((spread.mean + spread.std * ndtri(level)).tolist())
        else:
            share = np.cumsum(spread.probability or np.full(len(spread.values), 1.0 / len(spread.values)))
            chosen = np.minimum(np.searchsorted(share / share[-1], level, side="right"), len(spread.values) - 1)
            columns.append([spread.values[index] for index in chosen])
    # Samples of a few discrete values may be the same: they are one row.
    alike = Counter(json.dumps(values) for values in zip(*columns, strict=True))
    rows = tuple(
        Row(settings=dict(zip(keys, json.loads(values), strict=True)), probability=count / given.samples)
        for values, count in alike.items()
    )
    return Axis(keys=tuple(keys), rows=rows, weighted=True)


def _scatter(given: Scatter, path: Path) -> Axis:
    heights, periods, table = given.heights, given.periods, given.occurrences
    if given.file is not None:
        heights, periods, table = read_scatter(beside(path, given.file))
    cells = np.array(table, dtype=np.float64)
    total = float(np.sum(cells)) if given.total is None else float(given.total)
    if not 0.0 < float(np.sum(cells)) <= total * (1.0 + 1e-9):
        raise ScenarioError(
            f"{path}: scatter: occurrences add up to {np.sum(cells):g}, and total is {total:g}; they must add up to "
            "more than 0, and to the total at most"
        )
    share = cells / total
    keys = key_path(given.height_key), key_path(given.period_key)
    rows = tuple(
        Row(
            settings={keys[0]: float(height), keys[1]: float(period) * given.period_factor},
            probability=float(share[i, j]),
        )
        for i, height in enumerate(heights)
        for j, period in enumerate(periods)
        if share[i, j] > 0.0 and share[i, j] >= given.least_probability
    )
    if not rows:
        raise ScenarioError(
            f"{path}: scatter: no cell has a probability of {given.least_probability:g} (least_probability) or more"
        )
    left = int(np.sum(cells > 0.0)) - len(rows)
    missing = 1.0 - sum(row.probability or 0.0 for row in rows)
    notes = [f"scatter: {left} cells below {given.least_probability:g} are left out"] if left else []
    if missing > 1e-9:
        notes.append(f"scatter: sea states with a probability of {missing:.3g} are not in it")
    return Axis(keys=keys, rows=rows, weighted=True, notes=tuple(notes))


def read_scatter(path: Path) -> tuple[tuple[float, ...], tuple[float, ...], tuple[tuple[float, ...], ...]]:
    """Heights (n,), periods (m,) and occurrences (n, m) of a scatter diagram in CSV.

    The first row holds the periods and the first column the heights; what stands where they meet says nothing. An empty
    cell is 0; a height or period without any occurrences may be empty too, NaN. Lines that begin with # are remarks.

    Raises
    ------
    ScenarioError
        When there is no such file, or it is no such table; then with the line.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file in UTF-8"
        raise ScenarioError(f"{path}: the scatter diagram cannot be read: {reason}") from None
    kept = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]
    try:
        rows = [(number, next(csv.reader([line]))) for number, line in kept]
    except csv.Error as error:
        raise ScenarioError(f"{path}: holds no scatter diagram: {error}") from None
    if len(rows) < 2 or len(rows[0][1]) < 2:
        raise ScenarioError(
            f"{path}: holds no scatter diagram: the first row has the periods, and each row below a height and how "
            "often each period comes with it"
        )
    periods = _numbers(path, rows[0][0], rows[0][1][1:], math.nan)
    body = [
        [*_numbers(path, number, cells[:1], math.nan), *_numbers(path, number, cells[1:], 0.0)]
        for number, cells in rows[1:]
    ]
    for (number, _), row in zip(rows[1:], body, strict=True):
        if len(row) != len(periods) + 1:
            raise ScenarioError(
                f"{path}, line {number}: has {len(row) - 1} cells, and there are {len(periods)} periods in line "
                f"{rows[0][0]}"
            )
        if any(not math.isfinite(cell) or cell < 0.0 for cell in row[1:]):
            raise ScenarioError(f"{path}, line {number}: occurrences must be finite numbers that are 0 or more")
        for cell, period in zip(row[1:], periods, strict=True):
            if cell > 0.0 and not (math.isfinite(row[0]) and math.isfinite(period)):
                raise ScenarioError(
                    f"{path}, line {number}: has occurrences at the height {row[0]:g} and the period {period:g}; both "
                    "must be finite numbers, in the first column and in the first row"
                )
    return tuple(row[0] for row in body), tuple(periods), tuple(tuple(row[1:]) for row in body)


def _numbers(path: Path, line: int, cells: Sequence[str], empty: float) -> list[float]:
    try:
        return [float(cell) if cell.strip() else empty for cell in cells]
    except ValueError as error:
        raise ScenarioError(f"{path}, line {line}: {error}; give numbers") from None


def followed(linked: Linked, leader: object, key: str) -> float:
    """Value of a key that follows another one.

    Raises
    ------
    ScenarioError
        When that one's value is no number.
    """
    if isinstance(leader, bool) or not isinstance(leader, int | float):
        told = "which is not there or has no value" if leader is None else f"which is {leader!r}"
        raise ScenarioError(f"{key} follows {linked.by}, {told}: it must be a number; follow another key")
    value = float(np.interp(leader, linked.at, linked.value)) if linked.at else float(leader)
    return value + linked.plus
