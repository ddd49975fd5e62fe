"""What a sweep's file may say: one frozen model a section, checked before anything is planned.

A key of a scenario is written as in a scenario's file, dotted or in tables: `waves.heading_deg = [0, 45]` below
`[grid]` is the same as `"waves.heading_deg" = [0, 45]`. Here it is a tuple of its parts, a `KeyPath`.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    Field,
    StrictInt,
    StrictStr,
    ValidationError,
    model_validator,
)

from tlpsim.scenarios.problems import Location, Source, dotted, problem, scenario_error
from tlpsim.scenarios.quantities import PositiveDuration, Ratio
from tlpsim.scenarios.sections import LARGEST_SEED, Section
from tlpsim.scenarios.statistics.sea_states import YEAR

KeyPath = tuple[str, ...]
"""A key of a scenario by its parts: ("waves", "heading_deg")."""
Domain = Literal["frequency", "time"]
Engine = Literal["cosimulation", "monolithic"]
SEEDS: tuple[KeyPath, ...] = (("simulation", "seed"), ("wind", "seed"), ("waves", "seed"))
"""Keys that belong to `[replicates]`."""


def _number(value: object) -> float:
    try:
        if not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value):
            return float(value)
    except OverflowError:  # a whole number in TOML may have any number of digits
        pass
    raise ValueError("must be a finite number")


def _plain(value: object) -> object:
    if not isinstance(value, bool | int | float | str | list):
        raise ValueError("must be a number, text, true, false or a list")
    return value


Number = Annotated[float, BeforeValidator(_number)]
Probability = Annotated[Ratio, Field(ge=0)]
_Value = Annotated[Any, BeforeValidator(_plain)]


def key_path(text: str) -> KeyPath:
    """Parts of a dotted key as TOML splits it; a part in quotes is one.

    Raises
    ------
    ValueError
        When it is no key.
    """
    try:
        table: Any = tomllib.loads(f"{text} = 0")
    except tomllib.TOMLDecodeError:
        table = {}
    if "\n" in text or len(table) != 1:
        raise ValueError(f"'{text}' is no key of a scenario: write it dotted, as waves.heading_deg")
    parts = []
    while isinstance(table, dict):
        ((part, table),) = table.items()
        parts.append(part)
    return tuple(parts)


def _leaves(table: Mapping[str, Any], kinds: tuple[type[Section], ...], above: KeyPath) -> Iterator[tuple[str, Any]]:
    """Dotted keys with their values; a table with a key of one of the kinds is a value."""
    known = [{field.alias or name for name, field in kind.model_fields.items()} for kind in kinds]
    for key, value in table.items():
        parts = (*above, key) if above else key_path(key)
        if isinstance(value, Mapping) and (value or not kinds) and not any(set(value) & names for names in known):
            yield from _leaves(value, kinds, parts)
        else:
            yield dotted(parts), value


def _flat(*kinds: type[Section]) -> BeforeValidator:
    """Tables of a scenario's keys as one table of dotted ones."""

    def flatten(value: object) -> object:
        if not isinstance(value, Mapping):
            return value
        found: dict[str, Any] = {}
        for key, each in _leaves(value, kinds, ()):
            if key in found:
                raise ValueError(f"{key} is there twice, dotted and in quotes or in a table: leave one of them")
            found[key] = each
        return found

    return BeforeValidator(flatten)


class Values(Section):
    """Values of a key, with the probability of each where they are weighted."""

    values: Annotated[tuple[_Value, ...], Field(min_length=1)]
    probability: tuple[Probability, ...] | None = None

    @model_validator(mode="after")
    def _as_many(self) -> Self:
        if self.probability is not None:
            _require_probabilities(("probability",), self.probability, len(self.values), "values")
        return self


class Range(Section):
    """Equally spaced values of a key, both ends among them."""

    first: Annotated[Number, Field(alias="from")]
    last: Annotated[Number, Field(alias="to")]
    count: Annotated[StrictInt, Field(ge=2)]


class Uniform(Section):
    """A key that is as likely anywhere between two values."""

    low: Annotated[Number, Field(alias="from")]
    high: Annotated[Number, Field(alias="to")]

    @model_validator(mode="after")
    def _rises(self) -> Self:
        if not self.low < self.high:
            raise problem(("to",), self.high, f"must be above 'from', {self.low:g}")
        return self


class Normal(Section):
    """A key of a normal distribution."""

    mean: Number
    std: Annotated[Number, Field(gt=0)]


def _as_values(value: object) -> object:
    return {"values": value} if isinstance(value, list | tuple) else value


def _one_of(*kinds: type[Section]) -> BeforeValidator:
    """The kind of table whose keys these are, so that messages are about one and not about all of them."""

    def choose(value: object) -> object:
        value = _as_values(value)
        if not isinstance(value, Mapping):
            raise ValueError(f"must be a list, or a table of {' or '.join(_form(kind) for kind in kinds)}")
        for kind in kinds:
            if set(value) & {field.alias or name for name, field in kind.model_fields.items()} or kind is kinds[-1]:
                try:
                    return kind.model_validate(value)
                except ValidationError as error:
                    source = Source(name=f"in {_form(kind)}", data=value)
                    raise ValueError(str(scenario_error(error, [source], {(): kind}))) from None
        return value

    return BeforeValidator(choose)


def _form(kind: type[Section]) -> str:
    return "{ " + ", ".join(field.alias or name for name, field in kind.model_fields.items()) + " }"


Axis = Annotated[Values | Range, _one_of(Range, Values)]
Spread = Annotated[Uniform | Normal | Values, _one_of(Uniform, Normal, Values)]


class Scatter(Section):
    """A scatter diagram: how often each pair of significant height and period of the waves comes.

    Either `file` (CSV: periods in the first row, heights in the first column) or the three lists.
    """

    file: StrictStr | None = Field(default=None, description="CSV beside the sweep's file")
    heights: tuple[Number, ...] = Field(default=(), description="of the rows, in the unit of their key")
    periods: tuple[Number, ...] = Field(default=(), description="of the columns")
    occurrences: tuple[tuple[Number, ...], ...] = Field(
        default=(), description="a row a height: how often, in any unit"
    )
    height_key: StrictStr = "waves.significant_height"
    period_key: StrictStr = "waves.peak_period"
    period_factor: Annotated[Ratio, Field(gt=0)] = Field(
        default=1.0, description="from the diagram's period to that of the key: 1.408 from Tz of Pierson-Moskowitz"
    )
    total: Annotated[Number, Field(gt=0)] | None = Field(
        default=None, description="occurrences of all sea states, where the diagram leaves some out"
    )
    least_probability: Probability = Field(default=0.0, description="cells that are rarer are left out, and told")

    @model_validator(mode="after")
    def _is_a_table(self) -> Self:
        given = bool(self.heights or self.periods or self.occurrences)
        if given == (self.file is not None):
            raise problem(("file",), self.file, "give either a file, or heights, periods and occurrences")
        if given:
            rows, columns = len(self.heights), len(self.periods)
            if len(self.occurrences) != rows or any(len(row) != columns for row in self.occurrences):
                text = f"must have a row for each of {rows} heights, of {columns} numbers for the periods"
                raise problem(("occurrences",), "", text)
            if any(cell < 0 for row in self.occurrences for cell in row):
                raise problem(("occurrences",), "", "must be numbers that are 0 or more")
        return self


class LatinHypercube(Section):
    """Samples of uncertain keys, stratified in each of them; all are as likely."""

    samples: Annotated[StrictInt, Field(ge=1)]
    seed: Annotated[StrictInt, Field(ge=0)] = 1
    keys: Annotated[dict[str, Spread], _flat(Uniform, Normal, Values), Field(min_length=1)]


class Linked(Section):
    """A key that follows another one: its value, or linear between points and constant beyond them."""

    by: StrictStr = Field(description="the key that it follows")
    at: tuple[Number, ...] = Field(default=(), description="values of that key, rising")
    value: tuple[Number, ...] = Field(default=(), description="of this key there")
    plus: Number = Field(default=0.0, description="added")

    @model_validator(mode="after")
    def _rises(self) -> Self:
        if len(self.at) != len(self.value) or len(self.at) == 1:
            text = f"must have as many numbers as 'at', {len(self.at)}, and two or more or none"
            raise problem(("value",), self.value, text)
        if any(not a < b for a, b in zip(self.at, self.at[1:], strict=False)):
            raise problem(("at",), self.at, "must rise")
        return self


class Replicates(Section):
    """Records of the time domain for each case; every one has seeds of its own, which no other record has."""

    records: Annotated[StrictInt, Field(ge=1, le=100_000)] = 1
    seed: Annotated[StrictInt, Field(ge=0, le=LARGEST_SEED)] = 1


class TimeDomain(Section):
    """How cases are simulated, and which."""

    engine: Engine = "cosimulation"
    worst: Annotated[StrictInt, Field(ge=1)] | None = Field(
        default=None, description="only as many cases, the worst by the frequency domain; all without it"
    )
    by: StrictStr = Field(
        default="platform.tendon_tension[*].expected_maximum",
        description="SIGNAL.STATISTIC by which they are the worst; * stands for any text",
    )


class Statistics(Section):
    """Of which signals statistics are taken, and how."""

    signals: Annotated[tuple[StrictStr, ...], Field(min_length=1)] | None = Field(
        default=None, description="names or patterns; the six positions and all tensions without it"
    )
    exposure: PositiveDuration = Field(default=10800.0, description="of expected extremes, and of a sea state")
    slope: Annotated[Ratio, Field(gt=0)] = Field(default=4.0, description="of the S-N curve")


class LongTerm(Section):
    """What is made of the cases with a probability."""

    years: Annotated[tuple[Annotated[Number, Field(gt=0)], ...], Field(min_length=1)] = Field(
        default=(1.0, 10.0, 100.0), description="return periods"
    )
    life: Annotated[Number, Field(gt=0)] = Field(default=25.0, description="for fatigue, years")
    log10_a: Number | None = Field(
        default=None, description="of an S-N curve log10 N = log10_a - slope log10 S, S in MPa; no damage without it"
    )
    area: Annotated[Number, Field(gt=0)] | None = Field(
        default=None, description="of a tether's steel, m2: the stress is its tension over this"
    )
    stress_concentration: Annotated[Ratio, Field(gt=0)] = 1.0

    @model_validator(mode="after")
    def _has_a_stress(self) -> Self:
        if (self.log10_a is None) != (self.area is None):
            raise problem(("area",), self.area, "goes with log10_a: give both, or none")
        return self


def _own_case(value: object) -> object:
    """A case of the list: its name and probability, and all other keys as settings."""
    if not isinstance(value, Mapping):
        return value
    own = {name: value[name] for name in ("name", "probability") if name in value}
    return {**own, "settings": {key: each for key, each in value.items() if key not in own}}


class Listed(Section):
    """A case that is written out: keys that differ, and a name."""

    name: StrictStr = ""
    probability: Probability | None = None
    settings: Annotated[dict[str, Any], _flat()] = Field(default={})


class SweepFile(Section):
    """A whole sweep as it is written."""

    title: StrictStr = ""
    scenario: StrictStr | None = Field(default=None, description="file that all cases start from; the standard one")
    domains: Annotated[tuple[Domain, ...], Field(min_length=1)] = ("frequency",)
    files: tuple[Domain, ...] = Field(
        default=("frequency", "time"), description="domains whose cases leave a results file each"
    )
    settings: dict[str, Any] = Field(default={}, alias="set", description="keys of the scenario for all cases")
    scatter: Scatter | None = None
    cases: tuple[Annotated[Listed, BeforeValidator(_own_case)], ...] = ()
    grid: Annotated[dict[str, Axis], _flat(Values, Range)] = Field(default={})
    latin_hypercube: LatinHypercube | None = None
    linked: Annotated[dict[str, Linked], _flat(Linked)] = Field(default={})
    replicates: Replicates = Replicates()
    time: TimeDomain = TimeDomain()
    statistics: Statistics = Statistics()
    long_term: LongTerm = LongTerm()

    @model_validator(mode="after")
    def _time_has_its_worst(self) -> Self:
        if self.time.worst is not None and set(self.domains) != {"frequency", "time"}:
            text = 'needs domains = ["frequency", "time"]: the first says which cases are the worst'
            raise problem(("time", "worst"), self.time.worst, text)
        return self

    @model_validator(mode="after")
    def _years_hold_sea_states(self) -> Self:
        for number, years in enumerate(self.long_term.years):
            if not years * YEAR > self.statistics.exposure:
                text = f"must be longer than a sea state, statistics.exposure = {self.statistics.exposure:g} s"
                raise problem(("long_term", "years", number), years, text)
        return self

    @model_validator(mode="after")
    def _list_is_weighted_or_not(self) -> Self:
        given = [case.probability for case in self.cases if case.probability is not None]
        if given and len(given) < len(self.cases):
            text = "give it to all cases of the list, or to none"
            raise problem(("cases",), f"{len(given)} of {len(self.cases)} with a probability", text)
        if given:
            _require_probabilities(("cases",), given, len(given), "cases")
        return self

    @classmethod
    def read(cls, data: Mapping[str, Any], where: str) -> SweepFile:
        """Validate the contents of a file.

        Raises
        ------
        ScenarioError
            When a key or a value is not allowed.
        """
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise scenario_error(error, [Source(name=where, data=data)], SECTIONS) from None


SECTIONS: dict[Location, type[BaseModel]] = {
    (): SweepFile,
    ("scatter",): Scatter,
    ("cases", "*"): Listed,
    ("latin_hypercube",): LatinHypercube,
    ("linked", "*"): Linked,
    ("replicates",): Replicates,
    ("time",): TimeDomain,
    ("statistics",): Statistics,
    ("long_term",): LongTerm,
}


def _require_probabilities(location: Location, given: tuple[float, ...] | list[float], count: int, what: str) -> None:
    if len(given) != count:
        raise problem(location, list(given), f"must have one number for each of {count} {what}")
    if sum(given) > 1.0 + 1e-9 or not sum(given) > 0.0:
        raise problem(location, list(given), f"must add up to 1 at most, and to more than 0, not to {sum(given):g}")


def beside(path: Path, name: str) -> Path:
    """A file that a sweep's file names, which is relative to its folder."""
    return (path.resolve().parent / Path(name).expanduser()).resolve()
