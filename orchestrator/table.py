"""A table of signals as a component: columns of a CSV file, which feed others in the place of a model.

The first line of the file names the columns with their units, the first of them being the time, and every other line is
an instant:

    time [s], force.surge [kN], wind_speed [m/s]
    0.0, 812.0, 26.1
    0.5, 840.5, 26.9

Columns are parted by commas, semicolons or tabs, whichever the first line has; blank lines and lines that begin with #
are passed over. Times increase, in steps of any sizes. The outputs at a time between two lines are by the parameter
`interpolation`:

    hold    y_n
    linear  through y_n and y_n+1
    cubic   the cubic spline through all lines, with continuous second derivative                      (1)

With the step of the component that of the lines, its samples are those lines, and it is the connections' filters that
find what lies between them. Before the first line and after the last the parameter `beyond` says what holds: "hold"
keeps that line, "error" refuses the step. A component that feeds others is stepped ahead of them, past the end of the
run.
"""

from __future__ import annotations

import csv
import hashlib
import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.errors import FmuError, StepError, WiringError
from tlpsim.orchestrator.clock import NANOSECONDS_PER_SECOND, to_seconds
from tlpsim.orchestrator.instance import Instance, Variable, checked_parameters
from tlpsim.orchestrator.units import spelled

FloatArray = NDArray[np.float64]

TABLE_ENDING = ".csv"
INTERPOLATIONS = ("hold", "linear", "cubic")
BEYOND = ("hold", "error")

_CHOICES = {"interpolation": ("linear", INTERPOLATIONS), "beyond": ("hold", BEYOND)}
_SEPARATORS = ",;\t"
_UNIFORM = 1e-6  # largest difference of steps, relative to them, that counts as none


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """What a file of signals holds.

    Attributes
    ----------
    path
        Of the file.
    sha256
        Digest of its bytes.
    names
        Of the columns after the time.
    units
        As the file spells them, None where it gives none; as many.
    ticks
        Times in ns, increasing, shape (lines,).
    values
        Shape (lines, columns).
    """

    path: Path
    sha256: str
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    ticks: NDArray[np.int64]
    values: FloatArray

    @property
    def step(self) -> float | None:
        """Time between two lines in s where all are alike, else None."""
        steps = np.diff(self.ticks)
        alike = len(steps) > 0 and np.ptp(steps) <= _UNIFORM * steps[0]
        return to_seconds(round(float(np.mean(steps)))) if alike else None


def read_table(path: str | Path) -> Table:
    """Read a file of signals, see the head of this module.

    Raises
    ------
    FmuError
        If the file cannot be read, or a line of it is not as it should be; the message has its number.
    """
    file = Path(path).expanduser().resolve()
    try:
        raw = file.read_bytes()
        text = raw.decode("utf-8-sig")
    except OSError as error:
        raise FmuError(f"{path}: the table cannot be opened: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FmuError(f"{path}: the table is not text in UTF-8 (byte {error.start}); save it as UTF-8") from None
    lines = [(number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip(" \t,;")]
    lines = [(number, line) for number, line in lines if not line.lstrip().startswith("#")]
    if len(lines) < 3:
        raise FmuError(f"{path}: the table has {max(len(lines) - 1, 0)} lines of numbers; give a head and two or more")
    head, body = lines[0], lines[1:]
    separator = next((mark for mark in _SEPARATORS if mark in head[1]), ",")
    names, units, scale = _read_head(head[1], separator, f"{path}, line {head[0]}")
    try:
        values = np.loadtxt([line for _, line in body], delimiter=separator, ndmin=2, comments=None, quotechar='"')
    except ValueError:
        values = np.empty((0, 0))
    if values.shape != (len(body), len(names) + 1) or not np.isfinite(values).all():
        raise _fault(body, separator, len(names) + 1, str(path))
    ticks = np.rint(values[:, 0] * scale * NANOSECONDS_PER_SECOND).astype(np.int64)
    back = np.flatnonzero(np.diff(ticks) <= 0)
    if back.size:
        number, time = body[back[0] + 1][0], values[back[0] + 1, 0]
        raise FmuError(
            f"{path}, line {number}: the time {time:g} does not come after {values[back[0], 0]:g}, that of the line "
            "before; sort the lines, and leave out doubles"
        )
    return Table(
        path=file,
        sha256=hashlib.sha256(raw).hexdigest(),
        names=names,
        units=units,
        ticks=ticks,
        values=np.ascontiguousarray(values[:, 1:]),
    )


def _read_head(line: str, separator: str, where: str) -> tuple[tuple[str, ...], tuple[str | None, ...], float]:
    """Names and units of the columns after the first, and the first one's unit in s."""
    cells = [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    columns = [_named(cell) for cell in cells]
    names = [name for name, _ in columns]
    time, unit = columns[0]
    seconds = spelled(unit or "s")
    if time.lower() not in ("time", "t") or seconds is None or seconds.exponents != (0, 0, 1, 0, 0, 0, 0, 0):
        raise FmuError(f"{where}: the first column is '{cells[0]}'; it must be the time, as in 'time [s]'")
    if len(columns) < 2:
        raise FmuError(f"{where}: there is no column beside the time; part columns by commas, semicolons or tabs")
    for place, name in enumerate(names):
        if not name:
            raise FmuError(
                f"{where}: column {place + 1} has no name; give one, with its unit, as in 'force.surge [kN]'"
            )
        if name in names[:place]:
            raise FmuError(f"{where}: there are two columns '{name}'; give each its own name")
    return tuple(names[1:]), tuple(unit for _, unit in columns[1:]), seconds.factor


def _named(cell: str) -> tuple[str, str | None]:
    """Name and unit of a column; the brackets of ``x[1]`` are those of an element."""
    name, bracket, rest = cell.rpartition("[")
    if not bracket or not rest.endswith("]"):
        return cell, None
    unit = rest[:-1].strip()
    if name == name.rstrip() and all(part.strip().isdigit() for part in unit.split(",")):
        return cell, None
    return name.strip(), unit or None


def _fault(body: Sequence[tuple[int, str]], separator: str, count: int, path: str) -> FmuError:
    """The first line that is not `count` finite numbers."""
    for number, line in body:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
        if len(cells) != count:
            return FmuError(f"{path}, line {number}: {len(cells)} columns, and the first line has {count}")
        for place, cell in enumerate(cells, start=1):
            try:
                finite = math.isfinite(float(cell))
            except ValueError:
                finite = False
            if not finite:
                return FmuError(
                    f"{path}, line {number}: column {place} is '{cell.strip()[:40]}', not a finite number; write 1.5e3"
                )
    return FmuError(f"{path}: the table cannot be read as numbers; write every cell as 1.5e3")


def write_table(
    path: str | Path,
    times: ArrayLike,
    signals: Mapping[str, ArrayLike],
    units: Mapping[str, str] = MappingProxyType({}),
) -> None:
    """Write signals as a file that `read_table` reads to the last bit.

    Parameters
    ----------
    path
        Of the file.
    times
        In s, shape (lines,).
    signals
        By name, each of shape (lines,).
    units
        By name, where there are any.

    Raises
    ------
    FmuError
        If the shapes differ, or the file cannot be written.
    """
    columns = [np.asarray(column, dtype=np.float64) for column in (times, *signals.values())]
    for name, column in zip(signals, columns[1:], strict=True):
        if column.shape != columns[0].shape or column.ndim != 1:
            raise FmuError(f"{path}: '{name}' has the shape {column.shape}, and the times {columns[0].shape}")
    head = ["time [s]", *(f"{name} [{units[name]}]" if units.get(name) else name for name in signals)]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    try:
        with Path(path).open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([head, *([repr(value) for value in row] for row in rows)])
    except OSError as error:
        raise FmuError(f"{path}: the table cannot be written: {error.strerror}") from error


class TableInstance(Instance):
    """A table as a component without inputs; see the head of this module.

    Parameters
    ----------
    name
        Name of the component.
    path
        Path of the file.

    Raises
    ------
    FmuError
        As `read_table`.
    """

    can_get_and_set_state = True
    can_serialize_state = True

    def __init__(self, name: str, path: str | Path) -> None:
        self.name = name
        self.table = table = read_table(path)
        self.variables = {
            column: Variable(name=column, causality="output", unit=unit, depends_on=())
            for column, unit in zip(table.names, table.units, strict=True)
        }
        self._chosen = {key: default for key, (default, _) in _CHOICES.items()}
        for key, (default, known) in _CHOICES.items():
            if key in self.variables:
                raise FmuError(f"{path}: a column is called '{key}', which is a parameter of tables; rename it")
            description = f"one of {', '.join(known)}"
            self.variables[key] = Variable(
                name=key,
                causality="parameter",
                variability="fixed",
                type="String",
                start=default,
                description=description,
            )
        self._pieces: FloatArray | None = None
        self._columns: NDArray[np.intp] = np.arange(len(table.names))
        self._time = 0

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Set `interpolation` and `beyond`; see `Instance`."""
        checked = checked_parameters(self.name, self.variables, values)
        for key, value in checked.items():
            if value not in _CHOICES[key][1]:
                raise WiringError(
                    f"{self.name}: parameter '{key}' = '{value}' is not one of {', '.join(_CHOICES[key][1])}"
                )
        self._chosen |= checked

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Fix the order of the outputs; see `Instance`."""
        self._columns = np.array([self.table.names.index(name) for name in outputs], dtype=np.intp)

    def enter_initialization(self, start_time: float) -> None:
        """Take the start time; see `Instance`."""
        if self._chosen["interpolation"] == "cubic":
            from scipy.interpolate import CubicSpline  # here, because few tables need it and it takes long to load

            ticks = self.table.ticks
            spline = CubicSpline((ticks - ticks[0]) / NANOSECONDS_PER_SECOND, self.table.values)
            self._pieces = np.ascontiguousarray(np.moveaxis(spline.c, 0, 1))
        self._reach(start_time)

    def exit_initialization(self) -> None:
        """Nothing to do; see `Instance`."""

    def set_inputs(self, values: FloatArray) -> None:
        """A table has no inputs; see `Instance`."""

    def step(self, time: float, size: float) -> None:
        """Go to the end of the step; see `Instance`. StepError beyond the table where that is to be an error."""
        self._reach(time + size)

    def _reach(self, time: float) -> None:
        self._time = round(time * NANOSECONDS_PER_SECOND)
        first, last = (int(self.table.ticks[place]) for place in (0, -1))
        if self._chosen["beyond"] == "error" and not first <= self._time <= last:
            raise StepError(
                f"{self.name}: t = {time:.9g} s is beyond the table {self.table.path}, which goes from "
                f"{to_seconds(first):g} to {to_seconds(last):g} s; filters that look ahead ask for samples past the "
                "run's end: lengthen the table, or set its parameter beyond = 'hold'"
            )

    def get_outputs(self, into: FloatArray) -> None:
        """Write the values of the present time; see `Instance`."""
        into[:] = self._row()[self._columns]

    def _row(self) -> FloatArray:
        ticks, values = self.table.ticks, self.table.values
        place = int(np.searchsorted(ticks, self._time, side="right")) - 1
        if place < 0 or place == len(ticks) - 1 or self._chosen["interpolation"] == "hold":
            return np.asarray(values[max(place, 0)])
        since = self._time - int(ticks[place])
        if self._pieces is None:
            phase = since / int(ticks[place + 1] - ticks[place])
            return np.asarray((1.0 - phase) * values[place] + phase * values[place + 1])
        cubic, square, line, constant = self._pieces[place]
        seconds = since / NANOSECONDS_PER_SECOND
        return np.asarray(((cubic * seconds + square) * seconds + line) * seconds + constant)

    def get_state(self) -> object:
        """Return the present time in ns, which is all the state that there is."""
        return self._time

    def set_state(self, state: object) -> None:
        """Go back to a time."""
        if not isinstance(state, int):
            raise StepError(f"{self.name}: {type(state).__name__} is not a state of this component")
        self._time = state

    def free_state(self, state: object) -> None:
        """Nothing to release."""

    def serialize_state(self, state: Any) -> bytes:
        """Eight bytes of the time."""
        return struct.pack("<q", state)

    def deserialize_state(self, data: bytes) -> object:
        """Time of eight bytes."""
        if len(data) != 8:
            raise StepError(f"{self.name}: {len(data)} bytes are not the state of a table, which has 8")
        return int(struct.unpack("<q", data)[0])

    def terminate(self) -> None:
        """Nothing to end."""

    def free(self) -> None:
        """Nothing to release."""

    def describe(self) -> dict[str, str]:
        """Return path and digest of the file; see `Instance`."""
        return {"table": str(self.table.path), "sha256": self.table.sha256}
