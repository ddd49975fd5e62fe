"""What a scenario may say: one frozen model a section, read from TOML and checked before anything runs.

Every key has a default, and the default scenario is a storm on the ISSC TLP with the three standard
components and their wiring. What the user writes is merged into that, so that a file only holds what
differs. `typical_tlp.toml` writes every key out.

Wiring: keys of `[connections]` are targets, and `*` stands for the six degrees of freedom on both sides.
After loading, `Scenario.connections` has an entry for each single variable, none with `*` and none that
was removed.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StrictBool,
    StrictFloat,
    StrictInt,
    StrictStr,
    ValidationError,
    field_validator,
    model_validator,
)

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.problems import Location, Source, nearest, problem, scenario_error
from tlpsim.scenarios.quantities import (
    Acceleration,
    Area,
    Density,
    Duration,
    Frequency,
    Heading,
    Length,
    PositiveDuration,
    PositiveFrequency,
    PositiveLength,
    Ratio,
    Speed,
)
from tlpsim.scenarios.reading import absolute_paths, expand, merge, parse_override, read_toml, resolve
from tlpsim.scenarios.steps import check_steps

BUILTIN = "builtin:"
BUILTIN_COMPONENTS = ("wind", "wave", "platform")
LARGEST_SEED = 2**31 - 1  # an FMI Integer is a signed 32-bit number
# Depth of the deepest part of each hull below the mean water level, m.
DRAFT = {"issc_tlp": 35.0}

Filter = Literal["hold", "linear", "cubic", "quintic", "six_point", "kaiser", "optimal"]
Extrapolation = Literal["hold", "linear", "quadratic", "derivatives"]
Seed = Annotated[StrictInt, Field(ge=0, le=LARGEST_SEED)]


def _scalar(value: object) -> object:
    if not isinstance(value, bool | int | float | str) or (isinstance(value, float) and not math.isfinite(value)):
        raise ValueError("must be a finite number, true, false or text; an FMU's table is text that holds JSON")
    return value


ParameterValue = Annotated[bool | int | float | str, BeforeValidator(_scalar)]


class Section(BaseModel):
    """Base of all sections: frozen, and an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


class Simulation(Section):
    """How long to simulate, from which seed and from which position of the platform."""

    duration: PositiveDuration = 3600.0
    seed: Annotated[StrictInt, Field(ge=0)] = 1
    start: Literal["equilibrium", "rest"] = "equilibrium"


class Site(Section):
    """Water, air and gravity."""

    water_depth: PositiveLength = 450.0
    water_density: Annotated[Density, Field(gt=0)] = 1025.0
    air_density: Annotated[Density, Field(gt=0)] = 1.225
    gravity: Annotated[Acceleration, Field(gt=0)] = 9.80665


DampingRatio = Annotated[Ratio, Field(ge=0)]


class Platform(Section):
    """Hull and its linear damping, as ratios of critical by degree of freedom."""

    model: Literal["issc_tlp"] = "issc_tlp"
    damping_ratios: tuple[DampingRatio, DampingRatio, DampingRatio, DampingRatio, DampingRatio, DampingRatio] = (
        0.0,
        0.0,
        0.02,
        0.02,
        0.02,
        0.0,
    )


class Segment(Section):
    """A part of the deck that the wind blows on; its position is relative to the reference point."""

    position: tuple[Length, Length, Length]
    area: Annotated[Area, Field(gt=0)]
    shape_coefficient: Annotated[Ratio, Field(gt=0)]


class Box(Section):
    """An upright box that stands in the wind: its centre relative to the reference point, and length, width, height."""

    position: tuple[Length, Length, Length]
    size: tuple[PositiveLength, PositiveLength, PositiveLength]
    shape_coefficient: Annotated[Ratio, Field(gt=0)]

    @model_validator(mode="after")
    def _above_water(self) -> Self:
        if self.position[2] - 0.5 * self.size[2] < -1e-9:
            text = "must be at least half the height, so that the box does not reach below the water"
            raise problem(("position", 2), self.position[2], text)
        return self


DecayCoefficient = Annotated[Ratio, Field(ge=0)]


class WindCoherence(Section):
    """Coherence of the gusts; the decay coefficients are those of Davenport's model."""

    model: Literal["davenport", "npd"] = "davenport"
    lateral: DecayCoefficient = 16.0
    vertical: DecayCoefficient = 10.0
    longitudinal: DecayCoefficient = 0.0


class WindOrders(Section):
    """Orders of the digital filter that makes the gusts: long autoregression, then ARMA."""

    long: Annotated[StrictInt, Field(ge=1, le=1000)] = 25
    autoregressive: Annotated[StrictInt, Field(ge=1)] = 3
    moving_average: Annotated[StrictInt, Field(ge=0)] = 3

    @model_validator(mode="after")
    def _no_longer_than_the_long_one(self) -> Self:
        for name in ("autoregressive", "moving_average"):
            if getattr(self, name) > self.long:
                raise problem((name,), getattr(self, name), f"must be at most the order of the long one, {self.long}")
        return self


class Wind(Section):
    """Wind: mean speed 10 m above the water and turbulence."""

    speed: Annotated[Speed, Field(ge=0)] = 26.9
    heading_deg: Heading = 34.5
    profile: Literal["logarithmic", "power", "api", "iso"] = "logarithmic"
    profile_exponent: Annotated[Ratio, Field(gt=0)] = 0.12
    # The logarithmic profile is anchored 10 m above the water and needs a roughness far below that.
    roughness: Annotated[Length, Field(gt=0, lt=10)] = 0.001
    spectrum: Literal["kaimal", "kareem", "davenport", "harris", "ochi_shin", "simiu_leigh", "api", "npd"] = "kaimal"
    coherence: WindCoherence = WindCoherence()
    admittance: Literal["none", "davenport"] = "none"
    decomposition: Literal["full", "expanded", "linear"] = "full"
    sampling_step: PositiveDuration = 1.0
    orders: WindOrders = WindOrders()
    seed: Seed | None = None
    segments: tuple[Segment, ...] | None = None
    boxes: tuple[Box, ...] | None = None

    @field_validator("segments", "boxes")
    @classmethod
    def _not_empty(cls, value: tuple[Section, ...] | None) -> tuple[Section, ...] | None:
        if value == ():
            raise ValueError("must have 1 or more entries; without the key the default segments are taken")
        return value

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        if self.segments is not None and self.boxes is not None:
            raise problem(("boxes",), len(self.boxes), "cannot stand beside segments: give one of them")
        return self


class WaveTable(Section):
    """A wave spectrum by points, linear in between and zero outside."""

    frequency: tuple[Frequency, ...]
    density: tuple[StrictFloat, ...]

    @model_validator(mode="after")
    def _is_a_spectrum(self) -> Self:
        from tlpsim.loads.waves.spectra import SpectrumTable

        try:
            SpectrumTable(frequency=np.array(self.frequency), density=np.array(self.density))
        except ScenarioError as error:
            raise ValueError(str(error)) from None
        return self

    @property
    def peak_frequency(self) -> float:
        """Frequency of the largest density, Hz."""
        return self.frequency[int(np.argmax(self.density))]


class WaveOrders(WindOrders):
    """Orders of the digital filter that makes the elevation."""

    long: Annotated[StrictInt, Field(ge=1, le=1000)] = 59
    autoregressive: Annotated[StrictInt, Field(ge=1)] = 8
    moving_average: Annotated[StrictInt, Field(ge=0)] = 7


class Waves(Section):
    """Waves: irregular sea of one or more directions."""

    spectrum: Literal["jonswap", "pierson_moskowitz", "torsethaugen"] = "pierson_moskowitz"
    significant_height: Annotated[Length, Field(ge=0)] = 7.08
    peak_period: PositiveDuration = 14.52
    peak_enhancement: Annotated[Ratio, Field(ge=1)] = 3.3
    table: WaveTable | None = None
    heading_deg: Heading = 21.6
    directions: Annotated[StrictInt, Field(ge=1, le=32)] = 1
    spreading_exponent: Annotated[Ratio, Field(gt=0)] = 10.0
    generator: Literal["arma", "harmonic"] = "arma"
    sampling_step: PositiveDuration = 0.5
    orders: WaveOrders = WaveOrders()
    seed: Seed | None = None
    frequency_min: PositiveFrequency = 0.02
    frequency_max: PositiveFrequency = 0.35
    components: Annotated[StrictInt, Field(ge=1)] = 400
    displaced_position: StrictBool = True

    @model_validator(mode="after")
    def _band_holds_the_peak(self) -> Self:
        peak = 1.0 / self.peak_period if self.table is None else self.table.peak_frequency
        if self.frequency_min >= self.frequency_max:
            text = f"must be greater than frequency_min, {self.frequency_min:g} Hz"
            raise problem(("frequency_max",), self.frequency_max, text)
        what = "1/peak_period" if self.table is None else "of the table"
        text = f"leaves out the peak of the spectrum at {peak:.4g} Hz, {what}: widen the band"
        if peak <= self.frequency_min:
            raise problem(("frequency_min",), self.frequency_min, text)
        if peak >= self.frequency_max:
            raise problem(("frequency_max",), self.frequency_max, text)
        # The band of the filters ends a tenth above, and must lie below the Nyquist frequency of their step.
        longest = 0.5 / (1.1 * self.frequency_max)
        if self.generator == "arma" and self.sampling_step >= longest:
            text = f"must be less than {longest:.4g} s for waves up to frequency_max, {self.frequency_max:g} Hz"
            raise problem(("sampling_step",), self.sampling_step, text)
        return self


class Current(Section):
    """Current, uniform with depth."""

    speed: Annotated[Speed, Field(ge=0)] = 0.41
    heading_deg: Heading = 96.0


class Coupling(Section):
    """How a value is found between and after a source's samples, where a connection does not say."""

    filter: Filter = "cubic"
    extrapolation: Extrapolation = "derivatives"


class Component(Section):
    """An FMU, its step, its parameters, and its own names for the contract's variables (`map`)."""

    fmu: Annotated[StrictStr, Field(min_length=1)]
    step: PositiveDuration
    inputs_at: Literal["end", "middle", "start"] = "end"
    parameters: dict[str, ParameterValue] = {}
    map: dict[str, StrictStr] = {}

    @field_validator("fmu")
    @classmethod
    def _builtin_or_file(cls, value: str) -> str:
        known = [BUILTIN + name for name in BUILTIN_COMPONENTS]
        if value not in known and (value.startswith(BUILTIN) or not value.endswith(".fmu")):
            hint = nearest(value if value.startswith(BUILTIN) else BUILTIN + value, known)
            raise ValueError(f"must be the path of an .fmu file or one of {', '.join(known)}{hint}")
        return value

    def own_name(self, variable: str) -> str:
        """The FMU's own name of a contract variable."""
        return self.map.get(variable, variable)


class Connection(Section):
    """Source of a target variable; None means the default of `[coupling]`."""

    source: Annotated[StrictStr, Field(alias="from")]
    filter: Filter | None = None
    extrapolation: Extrapolation | None = None


class Outputs(Section):
    """Which signals are recorded (names or patterns), and from what time statistics are taken."""

    signals: tuple[StrictStr, ...] = ("*",)
    statistics_from: Annotated[Duration, Field(ge=0)] = 600.0


STANDARD_COMPONENTS: dict[str, dict[str, Any]] = {
    "wind": {"fmu": "builtin:wind", "step": 1.0},
    "wave": {"fmu": "builtin:wave", "step": 0.5},
    "platform": {"fmu": "builtin:platform", "step": 0.1},
}
STANDARD_CONNECTIONS: dict[str, dict[str, Any]] = {
    "platform.wind_force.*": {"from": "wind.force.*"},
    "platform.wave_force.*": {"from": "wave.force.*"},
    "wind.velocity.*": {"from": "platform.velocity.*"},
    "wind.position.yaw": {"from": "platform.position.yaw"},
    "wave.position.*": {"from": "platform.position.*"},
    "wave.velocity.*": {"from": "platform.velocity.*"},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Wire:
    """One connection of single variables, in the contract's names, with nothing left to default."""

    source: str
    source_variable: str
    target: str
    target_variable: str
    filter: Filter
    extrapolation: Extrapolation


def _standard_components() -> dict[str, Component]:
    return {name: Component(**component) for name, component in STANDARD_COMPONENTS.items()}


def _standard_connections() -> dict[str, Connection]:
    expanded = expand(STANDARD_CONNECTIONS)
    return {target: Connection(**connection) for target, connection in expanded.items()}


class Scenario(Section):
    """A whole scenario. Make one by `load`, `from_dict` or `with_`, whose errors are told in one line."""

    title: StrictStr = "Typical TLP in a storm"
    simulation: Simulation = Simulation()
    site: Site = Site()
    platform: Platform = Platform()
    wind: Wind = Wind()
    waves: Waves = Waves()
    current: Current = Current()
    coupling: Coupling = Coupling()
    components: dict[str, Component] = Field(default_factory=_standard_components, min_length=1)
    connections: dict[str, Connection] = Field(default_factory=_standard_connections)
    outputs: Outputs = Outputs()

    @classmethod
    def load(cls, path: str | Path, overrides: Sequence[str] = ()) -> Self:
        """Read a scenario file.

        Parameters
        ----------
        path : str or Path
            TOML file. Paths of FMUs in it are relative to its folder, and absolute after loading.
        overrides : Sequence[str]
            Settings "KEY=VALUE" that go over those of the file, each read as one line of TOML, KEY dotted.
            A VALUE that is no TOML is text: ``wind.spectrum=harris``, ``simulation.duration=3h``.

        Raises
        ------
        ScenarioError
            When the file cannot be read or the scenario in it is not allowed.
        """
        file = Path(path)
        settings: dict[str, Any] = {}
        for override in overrides:
            settings = merge(settings, parse_override(override))
        sources = [Source(name=str(path), data=read_toml(file)), Source(name="override", data=settings)]
        changes = merge(sources[0].data, settings)
        return cls._build(_standard(), absolute_paths(changes, file.resolve().parent), sources)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], where: str = "scenario") -> Self:
        """Scenario from nested mappings as TOML gives them; `where` names their origin in messages.

        Raises
        ------
        ScenarioError
            When a key, value or unit is not allowed.
        """
        return cls._build(_standard(), data, [Source(name=where, data=data)])

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Scenario from the text of `to_json`.

        Raises
        ------
        ScenarioError
            When the text is no scenario of this version.
        """
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise scenario_error(error, [Source(name="scenario", data={})], SECTIONS) from None

    def to_json(self) -> str:
        """Whole scenario as JSON, for the results file; `from_json` gives an equal scenario."""
        return self.model_dump_json(by_alias=True)

    def with_(self, **changes: Any) -> Self:
        """Copy with other settings: ``with_(wind={"speed": 30})`` or ``with_(**{"wind.speed": 30})``.

        A dotted name is split at every dot; a connection, whose target has dots itself, is given nested.

        Raises
        ------
        ScenarioError
            When the changed scenario is not allowed.
        """
        nested: dict[str, Any] = {}
        for name, value in changes.items():
            for part in reversed(name.split(".")):
                value = {part: value}
            nested = merge(nested, value)
        base = self.model_dump(by_alias=True, exclude_none=True)
        return self._build(base, nested, [Source(name="with_()", data=nested)])

    def seeds(self) -> dict[str, int]:
        """Seeds of wind and waves, 31-bit integers; those not given derive from the scenario's seed."""
        given = {"wind": self.wind.seed, "wave": self.waves.seed}
        taken = {seed for seed in given.values() if seed is not None}
        seeds = {}
        streams = np.random.SeedSequence(self.simulation.seed).spawn(len(given))
        for (name, seed), stream in zip(given.items(), streams, strict=True):
            if seed is None:
                # One word would do; the spare ones are for the rare case of a seed that is taken.
                candidates = (int(word) % LARGEST_SEED + 1 for word in stream.generate_state(len(given) + 1))
                seed = next(candidate for candidate in candidates if candidate not in taken)
                taken.add(seed)
            seeds[name] = seed
        return seeds

    def wiring(self) -> tuple[Wire, ...]:
        """All connections, with the defaults of `[coupling]` filled in."""
        wires = []
        for target, connection in self.connections.items():
            source_name, _, source_variable = connection.source.partition(".")
            target_name, _, target_variable = target.partition(".")
            wires.append(
                Wire(
                    source=source_name,
                    source_variable=source_variable,
                    target=target_name,
                    target_variable=target_variable,
                    filter=connection.filter or self.coupling.filter,
                    extrapolation=connection.extrapolation or self.coupling.extrapolation,
                )
            )
        return tuple(wires)

    @classmethod
    def _build(cls, base: Mapping[str, Any], changes: Mapping[str, Any], sources: Sequence[Source]) -> Self:
        try:
            return cls.model_validate(resolve(base, changes))
        except ValidationError as error:
            raise scenario_error(error, sources, SECTIONS) from None

    @model_validator(mode="after")
    def _hull_floats_free(self) -> Self:
        draft = DRAFT[self.platform.model]
        if self.site.water_depth <= draft:
            text = f"must be greater than the draft of {self.platform.model}, {draft:g} m"
            raise problem(("site", "water_depth"), self.site.water_depth, text)
        return self

    @model_validator(mode="after")
    def _connections_join_components(self) -> Self:
        for name, component in self.components.items():
            if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_-]*", name):
                raise problem(("components", name), component.fmu, "name must be of letters, digits, _ and -")
        for target, connection in self.connections.items():
            for end, key in ((target, ()), (connection.source, ("from",))):
                reason = _end_problem(end, tuple(self.components))
                if reason:
                    raise problem(("connections", target, *key), connection.source, reason)
        return self

    @model_validator(mode="after")
    def _steps_fit(self) -> Self:
        check_steps(self.simulation.duration, {name: entry.step for name, entry in self.components.items()})
        return self


SECTIONS: dict[Location, type[BaseModel]] = {
    (): Scenario,
    ("simulation",): Simulation,
    ("site",): Site,
    ("platform",): Platform,
    ("wind",): Wind,
    ("wind", "coherence"): WindCoherence,
    ("wind", "orders"): WindOrders,
    ("wind", "segments", "*"): Segment,
    ("wind", "boxes", "*"): Box,
    ("waves",): Waves,
    ("waves", "table"): WaveTable,
    ("waves", "orders"): WaveOrders,
    ("current",): Current,
    ("coupling",): Coupling,
    ("components", "*"): Component,
    ("connections", "*"): Connection,
    ("outputs",): Outputs,
}


def _standard() -> dict[str, Any]:
    return {"components": STANDARD_COMPONENTS, "connections": expand(STANDARD_CONNECTIONS)}


def _end_problem(end: str, components: Sequence[str]) -> str:
    """What is wrong with one end of a connection, or ""."""
    component, _, variable = end.partition(".")
    if "*" in end:
        return "'*' stands for the six degrees of freedom: write it once in the target and once in 'from'"
    if not variable:
        return f"'{end}' must be written COMPONENT.VARIABLE"
    if component not in components:
        hint = nearest(component, components)
        return f"there is no component '{component}'{hint}; the components are {', '.join(components)}"
    return ""
