"""What a scenario may say: one frozen model a section, read from TOML and checked before anything runs.

Every key has a default, and the default scenario is a storm on the ISSC TLP with the three standard
components and their wiring. What the user writes is merged into that, so that a file only holds what
differs. `typical_tlp.toml` writes every key out.

Wiring: keys of `[connections]` are targets, and `*` stands for the six degrees of freedom on both sides.
After loading, `Scenario.connections` has an entry for each single variable, none with `*` and none that
was removed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from pydantic import (
    BaseModel,
    Field,
    StrictStr,
    ValidationError,
    model_validator,
)

from tlpsim.scenarios.event_sections import CurrentChange, Event
from tlpsim.scenarios.problems import Location, Source, nearest, problem, scenario_error
from tlpsim.scenarios.reading import absolute_paths, expand, merge, parse_override, read_toml, resolve
from tlpsim.scenarios.sections import (
    LARGEST_SEED,
    Box,
    Component,
    Connection,
    Coupling,
    Current,
    Extrapolation,
    Filter,
    LoopAdaptation,
    LoopIteration,
    Outputs,
    Platform,
    PlatformTendons,
    Section,
    Segment,
    Simulation,
    Site,
    WaveOrders,
    Waves,
    WaveTable,
    Wind,
    WindCoherence,
    WindOrders,
)
from tlpsim.scenarios.steps import check_steps

if TYPE_CHECKING:
    from tlpsim.loads.spectral.records import SpectralResponse
    from tlpsim.orchestrator.observers import Observer
    from tlpsim.scenarios.compare import Comparison
    from tlpsim.scenarios.results import Results

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
    "platform.elevation": {"from": "wave.elevation"},
}
LARGEST_IMBALANCE = 1e-3
"""Of the buoyancy, between it and weight and pretension; it lifts the ISSC TLP by 0.7 mm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wire:
    """One connection of single variables, in the contract's names, with nothing left to default."""

    source: str
    source_variable: str
    target: str
    target_variable: str
    filter: Filter
    extrapolation: Extrapolation
    factor: float
    offset: float
    suppress_unit_conversion: bool


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
    events: tuple[Event, ...] = ()

    @classmethod
    def load(cls, path: str | Path, overrides: Sequence[str] = ()) -> Self:
        """Read a scenario file.

        Parameters
        ----------
        path : str or Path
            TOML file. Paths of FMUs, of the hydrodynamic database and of the quadratic transfer function in it are
            relative to its folder, and absolute after loading.
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
        folder = file.resolve().parent
        return cls._build(_standard(), with_absolute_paths(changes, folder), sources)

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
        return self.changed(nested, "with_()")

    def changed(self, changes: Mapping[str, Any], where: str) -> Self:
        """Copy with other settings, nested as TOML gives them; `where` names their origin in messages.

        Raises
        ------
        ScenarioError
            When the changed scenario is not allowed.
        """
        base = self.model_dump(by_alias=True, exclude_none=True)
        return self._build(base, changes, [Source(name=where, data=changes)])

    def run(self, destination: str | Path, *, monolithic: bool = False, observers: Sequence[Observer] = ()) -> Results:
        """Run it and open its results: `tlpsim.scenarios.run.run_scenario`."""
        from tlpsim.scenarios.run import run_scenario

        return run_scenario(self, destination, observers, monolithic=monolithic)

    def spectral(self) -> SpectralResponse:
        """Analyse it in the frequency domain: `tlpsim.scenarios.spectral.spectral_response`."""
        from tlpsim.scenarios.spectral import spectral_response

        return spectral_response(self)

    def compare(self, records: int = 24, *, cosimulation: bool = False, workers: int | None = None) -> Comparison:
        """Analyse it in both domains: `tlpsim.scenarios.compare.compare`."""
        from tlpsim.scenarios.compare import compare

        return compare(self, records, cosimulation=cosimulation, workers=workers)

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
                    factor=connection.factor,
                    offset=connection.offset,
                    suppress_unit_conversion=connection.suppress_unit_conversion,
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
        draught = self.platform.draught
        if self.site.water_depth <= draught:
            text = f"must be greater than the draught of {self.platform.model}, {draught:g} m"
            raise problem(("site", "water_depth"), self.site.water_depth, text)
        return self

    @model_validator(mode="after")
    def _pretension_balances(self) -> Self:
        pretension, mass, site = self.platform.tendons.pretension, self.platform.mass, self.site
        if pretension is None:
            return self
        from tlpsim.loads.issc_tlp import displaced_volume

        buoyancy = site.water_density * site.gravity * displaced_volume(self.platform.draught)
        if abs(pretension + mass * site.gravity - buoyancy) > LARGEST_IMBALANCE * buoyancy:
            displaced = buoyancy / site.gravity
            held = pretension / site.gravity
            text = (
                f"with the weight of platform.mass = {mass:g} kg makes {(held + mass) / 1e6:.4g}e6 kg, and the hull "
                f"displaces {displaced / 1e6:.4g}e6 kg: leave the pretension out, which makes it "
                f"{buoyancy - mass * site.gravity:.5g} N, or set platform.mass to {displaced - held:.5g} kg"
            )
            raise problem(("platform", "tendons", "pretension"), pretension, text)
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
    def _events_are_of_components(self) -> Self:
        for number, event in enumerate(self.events):
            for target, value in event.values.items():
                reason = _end_problem(target, tuple(self.components))
                if reason:
                    raise problem(("events", number, "set", target), value, reason)
            if event.current is not None and self.current.doppler:
                text = "cannot change waves that ride on the current: set current.doppler = false"
                raise problem(("events", number, "current"), "", text)
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
    ("platform", "tendons"): PlatformTendons,
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
    ("coupling", "iteration"): LoopIteration,
    ("coupling", "adaptation"): LoopAdaptation,
    ("components", "*"): Component,
    ("connections", "*"): Connection,
    ("outputs",): Outputs,
    ("events", "*"): Event,
    ("events", "*", "current"): CurrentChange,
}


def _standard() -> dict[str, Any]:
    return {"components": STANDARD_COMPONENTS, "connections": expand(STANDARD_CONNECTIONS)}


def with_absolute_paths(data: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """`data` with paths of FMUs, tables and hydrodynamic files, relative to the scenario's folder, made absolute."""
    data = absolute_paths(data, folder)
    for section, key in (("platform", "hydrodynamics"), ("waves", "quadratic_transfer")):
        table = data.get(section)
        name = table.get(key) if isinstance(table, Mapping) else None
        if isinstance(name, str) and name and (key != "hydrodynamics" or name.endswith(".h5")):
            data = merge(data, {section: {key: str((folder / Path(name).expanduser()).resolve())}})
    return data


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
