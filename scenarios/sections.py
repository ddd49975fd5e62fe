"""The sections of a scenario: one frozen model each, with defaults, units and limits."""

import math
from typing import Annotated, Literal, Self

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
    field_validator,
    model_validator,
)

from tlpsim.loads.constants import MORISON
from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.problems import nearest, problem
from tlpsim.scenarios.quantities import (
    Acceleration,
    Area,
    Density,
    Duration,
    Force,
    Frequency,
    Heading,
    Inertia,
    Length,
    LinearDensity,
    Mass,
    PositiveDuration,
    PositiveFrequency,
    PositiveLength,
    Ratio,
    Speed,
)

BUILTIN = "builtin:"
BUILTIN_COMPONENTS = ("wind", "wave", "platform")
TABLE = ".csv"
LARGEST_SEED = 2**31 - 1  # an FMI Integer is a signed 32-bit number
HULLS = ("issc_tlp",)
PONTOON_HEIGHT = 10.5  # m, of the ISSC TLP: `tlpsim.loads.issc_tlp`, which is slow to import

Filter = Literal["hold", "linear", "cubic", "quintic", "six_point", "kaiser", "optimal", "anti_alias"]
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


class PlatformTendons(Section):
    """Tethers of the platform: pretension and stiffness of all together, and the tube that each of them is.

    They reach from the keel to the sea bed. Without a pretension it is what balances weight and buoyancy.
    """

    pretension: Annotated[Force, Field(gt=0)] | None = None
    axial_stiffness: Annotated[Force, Field(gt=0)] = 3.37e11
    diameter: Annotated[Length, Field(ge=0)] = 0.0
    mass_per_length: Annotated[LinearDensity, Field(ge=0)] = 0.0
    drag_coefficient: Annotated[Ratio, Field(ge=0)] = 1.0


class Platform(Section):
    """Hull, its hydrodynamics, its tethers, and its linear damping as ratios of critical by degree of freedom."""

    model: Literal["issc_tlp"] = "issc_tlp"
    mass: Annotated[Mass, Field(gt=0)] = 40.5e6
    centre_of_gravity: Length = 3.0
    roll_inertia: Annotated[Inertia, Field(gt=0)] = 82.37e9
    yaw_inertia: Annotated[Inertia, Field(gt=0)] = 98.07e9
    draught: Annotated[Length, Field(gt=PONTOON_HEIGHT)] = 35.0
    drag_coefficient: Annotated[Ratio, Field(ge=0)] = 0.8
    hydrodynamics: StrictStr = "issc_tlp"
    radiation: Literal["convolution", "state_space", "none"] = "convolution"
    damping_ratios: tuple[DampingRatio, DampingRatio, DampingRatio, DampingRatio, DampingRatio, DampingRatio] = (
        0.0,
        0.0,
        0.02,
        0.02,
        0.02,
        0.0,
    )
    tendons: PlatformTendons = PlatformTendons()

    @field_validator("hydrodynamics")
    @classmethod
    def _known_or_file(cls, value: str) -> str:
        known = (*HULLS, MORISON)
        if value not in known and not value.endswith(".h5"):
            hint = nearest(value, known)
            raise ValueError(f"must be the path of a hydrodynamic database (.h5) or one of {', '.join(known)}{hint}")
        return value


class Segment(Section):
    """A part of the deck that the wind blows on; its position is relative to the reference point."""

    position: tuple[Length, Length, Length] = Field(description="of its centre, relative to the reference point")
    area: Annotated[Area, Field(gt=0, description="that the wind sees")]
    shape_coefficient: Annotated[Ratio, Field(gt=0, description="of the drag")]
    plan: tuple[Length, Length] = Field(
        default=(0.0, 0.0),
        description="length and width of the box that it is a part of, with which the area changes with yaw; [0, 0] is "
        "an area that does not",
    )

    @field_validator("plan")
    @classmethod
    def _of_a_box(cls, value: tuple[float, float]) -> tuple[float, float]:
        if value != (0.0, 0.0) and not min(value) > 0.0:
            raise ValueError("must be a length and a width > 0, or [0, 0] for an area that does not change with yaw")
        return value


class Box(Section):
    """An upright box that stands in the wind: its centre relative to the reference point, and length, width, height."""

    position: tuple[Length, Length, Length] = Field(description="of its centre, relative to the reference point")
    size: tuple[PositiveLength, PositiveLength, PositiveLength] = Field(description="length, width and height")
    shape_coefficient: Annotated[Ratio, Field(gt=0, description="of the drag")]

    @model_validator(mode="after")
    def _above_water(self) -> Self:
        if self.position[2] - 0.5 * self.size[2] < -1e-9:
            text = "must be at least half the height, so that the box does not reach below the water"
            raise problem(("position", 2), self.position[2], text)
        return self


DecayCoefficient = Annotated[Ratio, Field(ge=0)]


class WindCoherence(Section):
    """Coherence of the gusts; the decay coefficients are those of Davenport's model."""

    model: Literal["davenport", "npd"] = Field(default="davenport", description="npd is without the numbers below")
    lateral: DecayCoefficient = Field(default=16.0, description="decay with the distance across the wind")
    vertical: DecayCoefficient = Field(default=10.0, description="decay with the distance in height")
    longitudinal: DecayCoefficient = Field(default=0.0, description="decay with the distance along the wind")


_LONG = "of the autoregression that is fitted first; over its span the process must forget"
_AUTOREGRESSIVE = "of the ARMA model; at most the long one"
_MOVING_AVERAGE = "of the ARMA model; at most the long one"


class WindOrders(Section):
    """Orders of the digital filter that makes the gusts: long autoregression, then ARMA."""

    long: Annotated[StrictInt, Field(ge=1, le=1000, description=_LONG)] = 25
    autoregressive: Annotated[StrictInt, Field(ge=1, description=_AUTOREGRESSIVE)] = 3
    moving_average: Annotated[StrictInt, Field(ge=0, description=_MOVING_AVERAGE)] = 3

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
    yaw_dependent_area: StrictBool = True
    sampling_step: PositiveDuration = 1.0
    orders: WindOrders = WindOrders()
    seed: Seed | None = None
    segments: tuple[Segment, ...] | None = Field(
        default=None, description="parts that the wind blows on; six equal ones of 3000 m2 in all without it"
    )
    boxes: tuple[Box, ...] | None = Field(
        default=None, description="what stands in the wind, instead of segments; its projection follows the heading"
    )

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

    frequency: tuple[Frequency, ...] = Field(description="of the points, rising")
    density: tuple[StrictFloat, ...] = Field(description="at the points, m2/Hz, one-sided")

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

    long: Annotated[StrictInt, Field(ge=1, le=1000, description=_LONG)] = 59
    autoregressive: Annotated[StrictInt, Field(ge=1, description=_AUTOREGRESSIVE)] = 8
    moving_average: Annotated[StrictInt, Field(ge=0, description=_MOVING_AVERAGE)] = 7


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
    drift: Literal["newman", "newman_geometric", "qtf", "none"] = "newman"
    quadratic_transfer: Annotated[StrictStr, Field(min_length=1)] | None = None
    drift_damping: StrictBool = True
    splash: StrictBool = True
    stretching: Literal["vertical", "wheeler", "linear", "none"] = "vertical"

    @model_validator(mode="after")
    def _drift_has_its_file(self) -> Self:
        if self.drift == "qtf" and self.quadratic_transfer is None:
            text = (
                'needs waves.quadratic_transfer = "FILE", which `tlpsim bem HULL -o DATABASE.h5 --qtf FILE.h5` makes, '
                "or WAMIT's .12d"
            )
            raise problem(("drift",), self.drift, text)
        if self.drift != "qtf" and self.quadratic_transfer is not None:
            text = f'is for waves.drift = "qtf", and that is "{self.drift}": change it, or leave the file out'
            raise problem(("quadratic_transfer",), self.quadratic_transfer, text)
        return self

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


class CurrentTable(Section):
    """A current by depths below mean water level, linear in between and constant beyond."""

    depth: tuple[Length, ...] = Field(description="of the points below mean water level, rising")
    speed: tuple[Speed, ...] = Field(description="at the points")
    heading_deg: tuple[Heading, ...] = Field(description="at the points, toward which the water flows")

    @model_validator(mode="after")
    def _is_a_profile(self) -> Self:
        from tlpsim.loads.waves.current import Current as Profile

        try:
            Profile(depth=np.array(self.depth), speed=np.array(self.speed), heading=np.radians(self.heading_deg))
        except ScenarioError as error:
            raise ValueError(str(error)) from None
        return self


class Current(Section):
    """Current: uniform, by a power law, or by a table of depths."""

    speed: Annotated[Speed, Field(ge=0)] = 0.41
    heading_deg: Heading = 96.0
    exponent: Annotated[Ratio, Field(ge=0)] = 0.0
    table: CurrentTable | None = None
    stretched: StrictBool = False
    doppler: StrictBool = False


class LoopIteration(Section):
    """When the iteration of a loop ends, and how it is accelerated, see `tlpsim.orchestrator.system.Iteration`."""

    tolerance: Annotated[Ratio, Field(gt=0, lt=1, description="largest relative change of an input at its end")] = 1e-9
    most: Annotated[StrictInt, Field(ge=1, description="iterations of a step, after which it counts as failed")] = 50
    acceleration: Literal["quasi_newton", "aitken", "none"] = Field(
        default="quasi_newton", description="what gets it there sooner"
    )


class LoopAdaptation(Section):
    """How many steps at a time a loop takes, see `tlpsim.orchestrator.system.Adaptation`."""

    tolerance: Annotated[Ratio, Field(gt=0, lt=1, description="relative error of a continued input")] = 1e-4
    longest: Annotated[StrictInt, Field(ge=1, description="steps at a time at most")] = 64


class Coupling(Section):
    """How loops are stepped, and how a value is found between and after a source's samples.

    `filter` and `extrapolation` are for the connections that do not say, `iteration` is of the algorithm iterative,
    `adaptation` of adaptive, and `threads` of parallel.
    """

    filter: Filter = Field(default="cubic", description="for values between the samples of a source")
    extrapolation: Extrapolation = Field(
        default="derivatives", description="for values after the newest sample of a source, inside a loop"
    )
    algorithm: Literal["multirate", "sequential", "parallel", "iterative", "adaptive"] = Field(
        default="multirate", description="by which components of a feedback loop are stepped"
    )
    iteration: LoopIteration = LoopIteration()
    adaptation: LoopAdaptation = LoopAdaptation()
    threads: Annotated[StrictInt, Field(ge=1)] = 1


class Component(Section):
    """An FMU or a table, its step, its parameters, and its own names for the contract's variables (`map`).

    `timeout` is how long a call may take of a component that runs in a process of its own (`isolation`).
    """

    fmu: Annotated[StrictStr, Field(min_length=1)] = Field(
        description="builtin:wind, builtin:wave or builtin:platform, or the path of an .fmu or of a table (.csv), "
        'relative to this file; "" takes the component out'
    )
    step: PositiveDuration = Field(description="communication step; the smallest must divide all others")
    inputs_at: Literal["end", "middle", "start"] = Field(
        default="end", description="of the step; start or middle for FMUs that hold inputs"
    )
    isolation: Literal["none", "process"] = Field(
        default="none", description="in a process of its own a crash or a hang becomes an error"
    )
    timeout: PositiveDuration = Field(
        default=60.0, description="that a call may take in a process of its own, ten times as long while loading"
    )
    parameters: dict[str, ParameterValue] = Field(default={}, description="of the FMU or table, by name")
    map: dict[str, StrictStr] = Field(default={}, description="contract name = the FMU's own name")

    @field_validator("fmu")
    @classmethod
    def _builtin_or_file(cls, value: str) -> str:
        known = [BUILTIN + name for name in BUILTIN_COMPONENTS]
        if value not in known and (value.startswith(BUILTIN) or not value.lower().endswith((".fmu", TABLE))):
            hint = nearest(value if value.startswith(BUILTIN) else BUILTIN + value, known)
            raise ValueError(
                f"must be the path of an .fmu file, of a table ({TABLE}) or one of {', '.join(known)}{hint}"
            )
        return value

    @property
    def is_table(self) -> bool:
        """Whether it is a table of signals, see `tlpsim.orchestrator.table`."""
        return self.fmu.lower().endswith(TABLE)

    def own_name(self, variable: str) -> str:
        """The FMU's own name of a contract variable."""
        return self.map.get(variable, variable)


class Connection(Section):
    """Source of a target variable, target = factor * source + offset; None means the default of `[coupling]`.

    Units are converted first, unless that is suppressed.
    """

    source: Annotated[StrictStr, Field(alias="from", description='COMPONENT.OUTPUT; "" takes the connection out')]
    filter: Filter | None = Field(default=None, description="instead of that of [coupling]")
    extrapolation: Extrapolation | None = Field(default=None, description="instead of that of [coupling]")
    factor: Ratio = Field(default=1.0, description="target = factor * source + offset, after units are converted")
    offset: Ratio = Field(default=0.0, description="in the unit of the target")
    suppress_unit_conversion: StrictBool = Field(
        default=False, description="whether the numbers are taken as they are, where units differ"
    )


class Outputs(Section):
    """Which signals are recorded (names or patterns), and from what time statistics are taken."""

    signals: tuple[StrictStr, ...] = ("*",)
    statistics_from: Annotated[Duration, Field(ge=0)] = 600.0
