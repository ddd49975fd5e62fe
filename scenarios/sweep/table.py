"""The summary of a sweep: a row a finished job, with its settings and every statistic; as a Parquet file.

Columns: `case`, `case_key`, `name`, `variant`, `probability` (of the environment; NaN without), `domain`, `replicate`
(0 in the frequency domain), `wind_seed`, `wave_seed`, `status` ("done" or "failed"), `error`, `notes`, `file`; then
each key that varies; then "SIGNAL.STATISTIC". Numbers that a row does not have are NaN. What the columns do not say is
JSON in the schema's metadata under "tlpsim". The file depends on the numbers alone, so that a sweep that was resumed
gives the bytes of one that was not.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from tlpsim.loads.whole_file import whole_file
from tlpsim.scenarios.problems import dotted
from tlpsim.scenarios.results import ResultsError
from tlpsim.scenarios.sweep.ledger import Finished, Layout, Ledger
from tlpsim.scenarios.sweep.plan import Case, Job, Plan, Sweep
from tlpsim.scenarios.sweep.sections import LongTerm

NAME = "summary.parquet"
SCHEMA_VERSION = 1
DONE, FAILED = "done", "failed"
_METADATA = b"tlpsim"
_ROWS = 65536  # of a group

Column = NDArray[Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SweepTable:
    """The summary of a sweep.

    Attributes
    ----------
    title
        Of the sweep.
    keys
        That vary, dotted.
    variants
        Settings of each alternative of the design.
    weighted
        Whether cases have probabilities.
    units
        Of each signal.
    columns
        By name, see the head of this file; each (n,), of numbers or of text.
    duration
        Of a record, s.
    exposure, slope
        Of the statistics.
    long_term
        What is made of cases with probabilities.
    notes
        Of the plan.
    planned
        Jobs that the sweep has; there are fewer rows where it is not finished.
    """

    title: str
    keys: tuple[str, ...]
    variants: tuple[Mapping[str, Any], ...]
    weighted: bool
    units: Mapping[str, str]
    columns: Mapping[str, Column]
    duration: float
    exposure: float
    slope: float
    long_term: LongTerm
    notes: tuple[str, ...]
    planned: int

    @property
    def rows(self) -> int:
        """Number of them."""
        return len(self.columns["case"])

    def statistic(self, signal: str, statistic: str) -> Column:
        """Numbers of a statistic (rows,), NaN where it is not known."""
        found = self.columns.get(f"{signal}.{statistic}")
        return np.full(self.rows, np.nan) if found is None else found

    def setting(self, key: str, row: int) -> str:
        """Setting of a row, short."""
        value = self.columns[key][row]
        return f"{value:g}" if isinstance(value, float | np.floating) else str(value)

    @property
    def failed(self) -> int:
        """Number of failed rows."""
        return int(np.sum(self.columns["status"] == FAILED))


def summary_table(sweep: Sweep, plan: Plan, jobs: Sequence[Job], ledger: Ledger) -> SweepTable:
    """Table of those of the jobs that are finished, and of cases that are not allowed.

    Parameters
    ----------
    jobs
        That the sweep has, in the order of the plan.
    """
    layouts = ledger.layouts()
    by_key = {job.key: job for job in jobs}
    finished = list(ledger.finished([job.key for job in jobs]))
    problems = [case for case in plan.cases if case.problem]
    rows: list[tuple[Case, Job | None, Finished | None]] = [
        (plan.cases[by_key[each.key].case], by_key[each.key], each) for each in finished
    ]
    rows += [(case, None, None) for case in problems]
    rows.sort(key=lambda row: row[0].number)  # stable: jobs of a case stay in their order
    columns = _own_columns(sweep, rows)
    for key in plan.keys:
        columns[dotted(key)] = _setting([case.settings.get(key) for case, _, _ in rows])
    used = dict.fromkeys(done.layout for _, _, done in rows if done is not None and not done.error)
    names = _ordered([layouts[number].names for number in used])
    place = {name: k for k, name in enumerate(names)}
    indices = {number: np.array([place[name] for name in layouts[number].names]) for number in used}
    numbers = np.full((len(names), len(rows)), np.nan)
    for k, (_, _, done) in enumerate(rows):
        if done is not None and not done.error:
            numbers[indices[done.layout], k] = done.values
    columns |= dict(zip(names, numbers, strict=True))
    units = {signal: unit for number in used for signal, unit in _units(layouts[number])}
    return SweepTable(
        title=sweep.title,
        keys=tuple(map(dotted, plan.keys)),
        variants=tuple({dotted(key): value for key, value in each.items()} for each in plan.variants),
        weighted=plan.weighted,
        units=units,
        columns=columns,
        duration=sweep.base.simulation.duration,
        exposure=sweep.file.statistics.exposure,
        slope=sweep.file.statistics.slope,
        long_term=sweep.file.long_term,
        notes=plan.notes,
        planned=len(jobs) + len(problems),
    )


def _units(layout: Layout) -> Iterator[tuple[str, str]]:
    """Signals with their units: each has a mean."""
    for name, unit in zip(layout.names, layout.units, strict=True):
        if name.endswith(".mean"):
            yield name.removesuffix(".mean"), unit


def _own_columns(sweep: Sweep, rows: Sequence[tuple[Case, Job | None, Finished | None]]) -> dict[str, Column]:
    first = sweep.file.domains[0]

    def error(case: Case, done: Finished | None) -> str:
        return case.problem if done is None else done.error

    return {
        "case": np.array([case.number for case, _, _ in rows], dtype=np.int64),
        "case_key": _text([case.key for case, _, _ in rows]),
        "name": _text([case.name for case, _, _ in rows]),
        "variant": np.array([case.variant for case, _, _ in rows], dtype=np.int64),
        "probability": np.array([case.probability for case, _, _ in rows], dtype=np.float64),
        "domain": _text([first if job is None else job.domain for _, job, _ in rows]),
        "replicate": np.array([0 if job is None else job.replicate for _, job, _ in rows], dtype=np.int64),
        **{
            name: np.array([(job.seeds or (0, 0))[k] if job else 0 for _, job, _ in rows], dtype=np.int64)
            for k, name in enumerate(("wind_seed", "wave_seed"))
        },
        "status": _text([FAILED if error(case, done) else DONE for case, _, done in rows]),
        "error": _text([error(case, done) for case, _, done in rows]),
        "notes": _text([done.notes if done else "" for _, _, done in rows]),
        "file": _text([done.file if done else "" for _, _, done in rows]),
    }


def _text(values: Sequence[str]) -> Column:
    return np.array(values, dtype=object)


def _setting(values: Sequence[Any]) -> Column:
    """Numbers, or text where one is none: lists as JSON."""
    if all(isinstance(value, bool | int | float) or value is None for value in values):
        return np.array([np.nan if value is None else float(value) for value in values], dtype=np.float64)
    return _text([value if isinstance(value, str) else "" if value is None else json.dumps(value) for value in values])


def _ordered(layouts: Sequence[tuple[str, ...]]) -> list[str]:
    """All names, signal after signal."""
    names = dict.fromkeys(name for layout in layouts for name in layout)
    signals = [name.removesuffix(".mean") for name in names if name.endswith(".mean")]
    order = {signal: k for k, signal in enumerate(signals)}

    def signal(name: str) -> int:
        while name and name not in order:
            name = name.rpartition(".")[0]
        return order.get(name, -1)

    return sorted(names, key=signal)


# File


def write_table(table: SweepTable, path: Path) -> None:
    """Write a summary; the file is there when it is complete.

    Raises
    ------
    ScenarioError
        If it cannot be written.
    """
    content = {
        "schema_version": SCHEMA_VERSION,
        **{name: getattr(table, name) for name in _ATTRIBUTES},
        "long_term": table.long_term.model_dump(mode="json"),
    }
    arrays = {
        name: pa.array(values.tolist(), pa.string()) if values.dtype == object else pa.array(values)
        for name, values in table.columns.items()
    }
    made = pa.table(arrays).replace_schema_metadata({_METADATA: json.dumps(content).encode()})
    with whole_file(path, "the summary") as part:
        pq.write_table(made, part, row_group_size=_ROWS, compression="zstd")


_ATTRIBUTES = ("title", "keys", "variants", "weighted", "units", "duration", "exposure", "slope", "notes", "planned")


def read_table(path: str | Path) -> SweepTable:
    """Summary of a sweep: its file, or the folder that holds it.

    Raises
    ------
    ResultsError
        If there is none, or it is of another kind or a newer version.
    """
    path = Path(path)
    file = path / NAME if path.is_dir() else path
    if not file.is_file():
        raise ResultsError(f"{file}: no such file; make one by `tlpsim sweep SWEEP.toml -o {path}`")
    try:
        made = pq.read_table(file)
        content = json.loads((made.schema.metadata or {}).get(_METADATA, b"{}"))
    except (OSError, pa.ArrowInvalid, ValueError) as error:
        raise ResultsError(f"{file}: cannot be read as the summary of a sweep ({error})") from None
    version = content.get("schema_version", 0)
    if not 1 <= version <= SCHEMA_VERSION:
        told = f"is of version {version} and this tlpsim knows {SCHEMA_VERSION}" if version else "is not of a sweep"
        raise ResultsError(f"{file}: {told}; give the folder of `tlpsim sweep`")
    columns = {}
    for name in made.column_names:
        column = made.column(name)
        text = pa.types.is_string(column.type)
        columns[name] = _text(column.to_pylist()) if text else column.to_numpy()
    attributes = {name: content[name] for name in _ATTRIBUTES}
    tuples = {name: tuple(attributes[name]) for name in ("keys", "variants", "notes")}
    return SweepTable(**attributes | tuples, columns=columns, long_term=LongTerm.model_validate(content["long_term"]))
