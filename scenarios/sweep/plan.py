"""From a sweep's file to its plan: the base scenario, all cases with their settings, and the jobs to do.

A case is a scenario without its seeds, and a job is what one worker does of it: its frequency domain, or one record of
its time domain. Both are named by the hash of all that their results depend on (`tlpsim.scenarios.sweep.identity`), so
that a finished job is recognised in whatever sweep it comes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.problems import dotted
from tlpsim.scenarios.reading import merge, parse_override, read_toml
from tlpsim.scenarios.schema import Scenario, with_absolute_paths
from tlpsim.scenarios.sweep.axes import Axis, Row, axes, combinations, followed
from tlpsim.scenarios.sweep.identity import case_key, job_key, record_seeds
from tlpsim.scenarios.sweep.sections import Domain, KeyPath, SweepFile, beside, key_path

if TYPE_CHECKING:
    from tlpsim.scenarios.sweep.table import SweepTable


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A scenario of a sweep.

    Attributes
    ----------
    number
        From 0, in the order of the plan.
    key
        Hash of the scenario without its seeds; "" where the scenario is not allowed.
    name
        Of listed cases, "" without.
    settings
        Value by key of the scenario, for every key that varies in the sweep.
    probability
        Of its environment among those of its variant; NaN in a sweep without probabilities.
    variant
        Number of its alternative in `Plan.variants`.
    problem
        Why the scenario is not allowed, "" where it is.
    """

    number: int
    key: str
    name: str
    settings: Mapping[KeyPath, Any]
    probability: float
    variant: int
    problem: str = ""

    @property
    def label(self) -> str:
        """Name, or the settings in words."""
        told = ", ".join(f"{dotted(key)} = {value}" for key, value in self.settings.items())
        return self.name or told or "the scenario itself"


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """What one worker does: a case in the frequency domain, or one record of it in the time domain.

    Attributes
    ----------
    key
        Hash of all that the statistics depend on.
    case
        Number of the case.
    domain
        "frequency" or "time".
    replicate
        Number of the record from 1; 0 in the frequency domain.
    seeds
        Of wind and waves; None in the frequency domain.
    """

    key: str
    case: int
    domain: Domain
    replicate: int
    seeds: tuple[int, int] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """All cases and jobs of a sweep.

    Attributes
    ----------
    cases
        In their order.
    jobs
        In the order of the cases, the frequency domain of each first; of all cases, also where the time domain is
        for the worst only.
    keys
        That vary, in the order of the file.
    variants
        Settings of each alternative of the design: combinations of rows without probabilities.
    weighted
        Whether cases have probabilities.
    notes
        What a user must know of it.
    """

    cases: tuple[Case, ...]
    jobs: tuple[Job, ...]
    keys: tuple[KeyPath, ...]
    variants: tuple[Mapping[KeyPath, Any], ...]
    weighted: bool
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """A sweep: make one by `load` or `from_dict`.

    Attributes
    ----------
    title
        Of the sweep.
    path, folder
        Of its file, and the whole path of the folder in which that is.
    file
        What it says.
    base
        Scenario that all cases start from.
    axes
        Rows of settings, of which each case takes one of each.
    """

    title: str
    path: Path
    folder: Path
    file: SweepFile
    base: Scenario
    axes: tuple[Axis, ...]

    @classmethod
    def load(cls, path: str | Path, overrides: Sequence[str] = ()) -> Self:
        """Read a sweep's file.

        Parameters
        ----------
        path
            TOML file; files in it are relative to its folder.
        overrides
            Settings "KEY=VALUE" of the scenario of all cases, over those of the file; paths as there.

        Raises
        ------
        ScenarioError
            When the file, the scenario or a file that it names cannot be read, or a key or value is not allowed.
        """
        return cls.from_dict(read_toml(Path(path), "sweep"), path, overrides)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], path: str | Path = "sweep.toml", overrides: Sequence[str] = ()) -> Self:
        """A sweep of nested mappings as TOML gives them, as if they stood in a file `path`, which need not exist.

        Raises
        ------
        ScenarioError
            As `load`.
        """
        path = Path(path)
        file = SweepFile.read(data, str(path))
        base = Scenario() if file.scenario is None else Scenario.load(beside(path, file.scenario))
        if file.settings:
            common = with_absolute_paths(file.settings, path.resolve().parent)
            base = base.changed(common, f"{path}: set")
        for override in overrides:
            base = base.changed(with_absolute_paths(parse_override(override), path.resolve().parent), "override")
        if "time" not in file.domains and file.replicates.records > 1:
            raise ScenarioError(
                f"{path}: replicates.records = {file.replicates.records}: only the time domain has records; "
                'add it to domains = ["frequency", "time"], or leave the replicates out'
            )
        sweep = cls(
            title=file.title or base.title,
            path=path,
            folder=path.resolve().parent,
            file=file,
            base=base,
            axes=axes(file, path),
        )
        _require_effect(sweep, overrides)
        return sweep

    def plan(self) -> Plan:
        """All cases and jobs.

        Raises
        ------
        ScenarioError
            When no case at all is allowed; the message is that of the first. One of several that is not allowed is
            told in its `Case`.
        """
        return _plan(self)

    def run(self, folder: str | Path, **options: Any) -> SweepTable:
        """Do it, with the options of `tlpsim.scenarios.sweep.execution.run_sweep`, and give its summary."""
        from tlpsim.scenarios.sweep.execution import run_sweep

        return run_sweep(self, folder, **options)

    def scenario(self, case: Case, job: Job | None = None) -> Scenario:
        """Scenario of a case, with the seeds of a job of it.

        Raises
        ------
        ScenarioError
            When it is not allowed.
        """
        return _scenario(self, case, None if job is None else job.seeds)


def _require_effect(sweep: Sweep, overrides: Sequence[str]) -> None:
    """Refuse settings of keys that every case has from elsewhere."""
    everywhere = [key for axis in sweep.axes for key in axis.keys if all(key in row.settings for row in axis.rows)]
    settings = [(f"override '{each}'", parse_override(each)) for each in overrides]
    for where, given in ((f"{sweep.path}: set", sweep.file.settings), *settings):
        for key in (*everywhere, *map(key_path, sweep.file.linked)):
            if _value(given, key) is not None:
                raise ScenarioError(
                    f"{where}: {dotted(key)} varies in {sweep.path}, which goes over it: leave it out here, or there"
                )


def _plan(sweep: Sweep) -> Plan:
    cases = _cases(sweep)
    allowed = [case for case in cases if not case.problem]
    if not allowed:
        raise ScenarioError(cases[0].problem)
    jobs = _jobs(sweep, allowed)
    notes = [note for axis in sweep.axes for note in axis.notes]
    if len(allowed) < len(cases):
        first = next(case for case in cases if case.problem)
        notes.append(f"{len(cases) - len(allowed)} of {len(cases)} cases are not allowed; the first: {first.problem}")
    return Plan(
        cases=tuple(cases),
        jobs=tuple(jobs),
        keys=_keys(sweep),
        variants=tuple(_settings(rows) for rows in combinations(_alternatives(sweep))) or ({},),
        weighted=_weighted(sweep),
        notes=tuple(notes),
    )


def _weighted(sweep: Sweep) -> bool:
    return any(axis.weighted for axis in sweep.axes)


def _alternatives(sweep: Sweep) -> list[Axis]:
    """Axes without probabilities, where there are others with them."""
    return [axis for axis in sweep.axes if not axis.weighted] if _weighted(sweep) else []


def _keys(sweep: Sweep) -> tuple[KeyPath, ...]:
    varied = (key for axis in sweep.axes for key in axis.keys)
    return tuple(dict.fromkeys((*varied, *map(key_path, sweep.file.linked))))


def _settings(rows: Sequence[Row]) -> dict[KeyPath, Any]:
    return {key: value for row in rows for key, value in row.settings.items()}


def _cases(sweep: Sweep) -> list[Case]:
    weighted = _weighted(sweep)
    widths = [1 if axis.weighted or not weighted else len(axis.rows) for axis in sweep.axes]
    numbered = [list(enumerate(axis.rows)) for axis in sweep.axes]
    base = sweep.base.model_dump(mode="json", by_alias=True)
    defaults = {key: _value(base, key) for key in _keys(sweep)}
    found: list[Case] = []
    seen: dict[str, int] = {}
    for number, chosen in enumerate(itertools.product(*numbered)):
        rows = [row for _, row in chosen]
        variant = 0
        for width, (index, _) in zip(widths, chosen, strict=True):
            variant = variant * width + (index if width > 1 else 0)
        case = Case(
            number=number,
            key="",
            name=", ".join(row.name for row in rows if row.name),
            settings=defaults | _settings(rows),
            probability=math.prod(1.0 if row.probability is None else row.probability for row in rows)
            if weighted
            else math.nan,
            variant=variant,
        )
        found.append(_identified(sweep, base, case, seen))
    return found


def _identified(sweep: Sweep, base: Mapping[str, Any], case: Case, seen: dict[str, int]) -> Case:
    """The case with its linked settings and its key, or with its problem."""
    settings, key, problem = dict(case.settings), "", ""
    try:
        for name, linked in sweep.file.linked.items():
            leader = key_path(linked.by)
            value = settings[leader] if leader in settings else _value(base, leader)
            settings[key_path(name)] = followed(linked, value, f"{sweep.path}: case {case.number}: linked: {name}")
        case = replace(case, settings=settings)
        key = case_key(_scenario(sweep, case, None))
        if key in seen:
            told = f"{sweep.path}: case {case.number} ({case.label})"
            problem = f"{told} is the same scenario as case {seen[key]}: leave one out"
        seen.setdefault(key, case.number)
    except ScenarioError as error:
        problem = str(error)
    return replace(case, settings=settings, key="" if problem else key, problem=problem)


def _value(settings: Mapping[str, Any], key: KeyPath) -> Any:
    """Value of a key in nested mappings; None where it has none."""
    value: Any = settings
    for part in key:
        value = value.get(part) if isinstance(value, Mapping) else None
    return value


def _scenario(sweep: Sweep, case: Case, seeds: tuple[int, int] | None) -> Scenario:
    nested: dict[str, Any] = {}
    for key, value in case.settings.items():
        if value is None:  # a key that only other cases of the list have
            continue
        for part in reversed(key):
            value = {part: value}
        nested = merge(nested, value)
    told = {"title": f"{sweep.title}: {case.label}"}
    if seeds is not None:
        nested = merge(nested, {"wind": {"seed": seeds[0]}, "waves": {"seed": seeds[1]}})
    settings = with_absolute_paths(nested, sweep.folder)
    return sweep.base.changed(merge(settings, told), f"{sweep.path}: case {case.number}")


def _jobs(sweep: Sweep, cases: Sequence[Case]) -> list[Job]:
    file, seeds = sweep.file, {}
    if "time" in file.domains:
        records = [(case.key, k + 1) for case in cases for k in range(file.replicates.records)]
        seeds = dict(zip(records, record_seeds(records, file.replicates.seed), strict=True))
    jobs = []
    for case in cases:
        if "frequency" in file.domains:
            key = job_key(case.key, "frequency", file.statistics)
            jobs.append(Job(key=key, case=case.number, domain="frequency", replicate=0, seeds=None))
        if "time" in file.domains:
            for k in range(file.replicates.records):
                own = seeds[case.key, k + 1]
                key = job_key(case.key, "time", file.statistics, file.time.engine, own)
                jobs.append(Job(key=key, case=case.number, domain="time", replicate=k + 1, seeds=own))
    return jobs
