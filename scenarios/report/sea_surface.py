"""The sea around the platform, from the elevation that a run recorded, for the animation in a report.

A run records the elevation at one place. Of a long-crested sea that is enough: the elevation s further along the
heading is the record's convolution with the kernel of the travel there,

    eta(s, t_n) = sum_m h_m(s) eta(0, t_n - m dt),   h_m(s) = 2 dt df sum_j cos(2 pi f_j m dt - k_j s)       (1)

with k_j of the dispersion relation in this water, and in the current where the waves ride on it. `assets/sea.js` sums
eq. (1); here are the record, f_j and k_j. The kernel must be as long as the slowest waves take over the distance,

    half dt = s dk/domega + 5/f_c,   f_c the highest frequency that is drawn                                (2)

The wave FMU records the elevation at the platform's reference point. There the surface goes with the platform, s is
counted from it, and a crest moves by the platform's velocity too fast: 0.3 m/s of 20 m/s in a storm.

A short-crested sea is made again from the scenario: its directions' elevations at the origin are each carried on by
eq. (1). The surface at the platform must then be the one recorded. Where it is not, as with the waves of another FMU
or of another version, and where there are no such waves to make, the record is taken as long-crested.

Beyond the ends of the run the record is continued by its mirror image, so that far from the platform the first and the
last half minute are made up in part.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from tlpsim.fmus.current import current_of
from tlpsim.fmus.wave_fmu import TlpsimWave
from tlpsim.fmus.wave_parameters import hull_members, realized_sea
from tlpsim.loads.errors import TlpsimError
from tlpsim.loads.filters.certificate import FilterFitWarning
from tlpsim.loads.waves.airy import travel, wavenumber
from tlpsim.loads.waves.doppler import current_along_waves, sea_in_current, wavenumber_in_current
from tlpsim.loads.waves.elevation import ArmaSea
from tlpsim.loads.waves.sea import Sea
from tlpsim.scenarios.parameters import parameter_values, standard_parameters
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sections import BUILTIN
from tlpsim.scenarios.statistics.summary import conversion

FloatArray = NDArray[np.float64]

EXTENT = 300.0
"""m, radius of the surface that is drawn about the origin."""
REACH = EXTENT + 60.0
"""m, along the waves, farthest from the place of the record: with room for the platform's offset."""
HIGHEST_FREQUENCY = 0.4
"""Hz; a wave of 10 m, shorter ones are not drawn."""
LARGEST_DIFFERENCE = 0.05
"""Of a sea made again from the one recorded, of its standard deviation."""

ELEVATION = "wave.elevation"
_COMPARED_TIMES = 60
_FEWEST_SAMPLES = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class SeaSurface:
    """Long-crested parts of the surface, each with the elevation at one place, and what carries it elsewhere.

    Attributes
    ----------
    heading : (M,) rad.
    elevation : (M, n + 2 half) m, at the frames' times and `half` of their steps beyond either end.
    half : half of the length of the kernel of eq. (1), in steps.
    frequency : (F,) Hz, f_j of eq. (1), evenly spaced.
    wavenumber : (M, F) rad/m, k_j.
    at_platform : whether the elevation is that at the platform's reference point, not at the origin.
    note : what a reader must know of where it comes from.
    """

    heading: FloatArray
    elevation: FloatArray
    half: int
    frequency: FloatArray
    wavenumber: FloatArray
    at_platform: bool
    note: str


def sea_surface(results: Results, times: FloatArray) -> SeaSurface | None:
    """The sea of a run of a scenario at evenly spaced `times` (s); None for calm water or no recorded elevation."""
    scenario = results.scenario
    record = _record(results)
    if record is None:
        return None
    recorded_times, elevation = record
    headings, series, source = np.array([math.radians(scenario.waves.heading_deg)]), elevation[None], recorded_times
    at_platform = _is_at_platform(results, scenario)
    note = "the elevation recorded, carried along the waves' heading by the dispersion relation of linear waves"
    if scenario.waves.directions > 1:
        sea = _sea_made_again(results, scenario, recorded_times, elevation)
        if sea is None:
            note += (
                f"; the sea has {scenario.waves.directions} directions, but one record does not tell them apart: "
                "drawn as long-crested in the mean heading"
            )
        else:
            headings, source, series = _at_origin(sea, scenario.waves.sampling_step, float(recorded_times[-1]))
            at_platform = False
            note = f"made again from the scenario's seed, in {len(headings)} directions; at the platform as recorded"
    step = float(times[-1] - times[0]) / (len(times) - 1)
    highest = min(_band_end(scenario), HIGHEST_FREQUENCY, 0.45 / step)
    along = _wavenumbers(scenario, headings)
    half = _half_length(along, highest, step)
    spacing = 1.0 / (1.3 * (2 * half + 1) * step)
    frequency: FloatArray = spacing * (np.arange(int(highest / spacing), dtype=np.float64) + 0.5)
    wide = times[0] + step * np.arange(-half, len(times) + half)
    return SeaSurface(
        heading=headings,
        elevation=np.stack([CubicSpline(source, each)(_mirrored(wide, source)) for each in series]),
        half=half,
        frequency=frequency,
        wavenumber=along(frequency),
        at_platform=at_platform,
        note=note + "; without what the hull does to it",
    )


def _record(results: Results) -> tuple[FloatArray, FloatArray] | None:
    """Times and recorded elevation, s and m; None where there is none or the water is calm."""
    if "wave" not in results.components or "elevation" not in results.signals("wave"):
        return None
    times = results.time("wave")
    elevation = conversion(results.unit(ELEVATION), "m") * results.signal(ELEVATION)
    if len(times) < _FEWEST_SAMPLES or not np.all(np.isfinite(elevation)) or np.ptp(elevation) == 0.0:
        return None
    return times, elevation


def _is_at_platform(results: Results, scenario: Scenario) -> bool:
    """Whether the wave FMU is one of ours, which gives the elevation where it takes the waves."""
    entry, name = scenario.components["wave"], "displaced_position"
    displaced = entry.parameters.get(entry.own_name(name), scenario.waves.displaced_position)
    return "reference point" in results.description(ELEVATION) and bool(displaced)


def _is_own(scenario: Scenario) -> bool:
    """Whether the waves are those of this version, whose parameters are known."""
    return scenario.components["wave"].fmu == f"{BUILTIN}wave"


def _parameters(scenario: Scenario) -> Callable[[str], Any]:
    """Parameters of the built-in wave FMU."""
    given = standard_parameters(scenario, "wave") | scenario.components["wave"].parameters
    return parameter_values(TlpsimWave, given)


def _band_end(scenario: Scenario) -> float:
    """Frequency at which the waves end, Hz: of the digital filters a tenth above the highest one that is given."""
    return (1.1 if scenario.waves.generator == "arma" else 1.0) * scenario.waves.frequency_max


def _mirrored(times: FloatArray, record: FloatArray) -> FloatArray:
    """Times within the record, from which those outside it take their values."""
    first, length = record[0], record[-1] - record[0]
    return np.asarray(first + length - np.abs((times - first) % (2.0 * length) - length))


def _wavenumbers(scenario: Scenario, headings: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Wavenumbers (M, F), rad/m, of frequencies (F,), Hz, for waves of each heading."""
    depth, gravity = scenario.site.water_depth, scenario.site.gravity
    current = current_of(_parameters(scenario)) if scenario.current.doppler and _is_own(scenario) else None

    def along(frequency: FloatArray) -> FloatArray:
        omega = 2.0 * np.pi * frequency
        still = wavenumber(omega, depth, gravity)
        if current is None:
            return np.tile(still, (len(headings), 1))
        flows = [current_along_waves(current, still, np.full_like(still, each), depth) for each in headings]
        return np.stack([wavenumber_in_current(omega, depth, flow, gravity) for flow in flows])

    return along


def _half_length(along: Callable[[FloatArray], FloatArray], highest: float, step: float) -> int:
    """Half of the kernel's length in steps, eq. (2)."""
    pair = along(np.array([0.998, 0.999]) * highest)
    slowness = float(np.max(np.diff(pair, axis=1))) / (2.0 * np.pi * 0.001 * highest)
    return math.ceil((slowness * REACH + 5.0 / highest) / step)


def _sea_made_again(results: Results, scenario: Scenario, times: FloatArray, elevation: FloatArray) -> Sea | None:
    """The scenario's sea, if it is the one recorded."""
    if not _is_own(scenario):
        return None
    parameter = _parameters(scenario)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FilterFitWarning)  # which the run gave
            sea = realized_sea(parameter, hull_members(parameter))
        current = current_of(parameter)
        moved = sea_in_current(sea, current) if parameter("doppler") and current is not None else sea
    except TlpsimError:
        return None
    chosen = np.unique(np.linspace(0, len(times) - 1, _COMPARED_TIMES).astype(int))
    places = np.zeros((len(times), 2))
    if parameter("displaced_position"):
        for column, degree in enumerate(("surge", "sway")):
            if f"position.{degree}" not in results.signals("platform"):
                return None
            name = f"platform.position.{degree}"
            moves = conversion(results.unit(name), "m") * results.signal(name)
            places[:, column] = np.interp(times, results.time("platform"), moves)
    made = [
        float(np.real(travel(moved.wavenumber, moved.heading, *places[i, :, None])[0] @ moved.amplitudes(times[i])))
        for i in chosen
    ]
    difference = float(np.sqrt(np.mean((np.array(made) - elevation[chosen]) ** 2)))
    return sea if difference <= LARGEST_DIFFERENCE * float(np.std(elevation)) else None


def _at_origin(sea: Sea, sampling_step: float, end: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Headings (M,), times (n,) up to `end` (s), and the directions' elevations at the origin (M, n), rad, s, m."""
    headings, which = np.unique(sea.heading, return_inverse=True)
    count = math.ceil(end / sampling_step) + 1
    times: FloatArray = sampling_step * np.arange(count, dtype=np.float64)
    if isinstance(sea, ArmaSea):
        kernel = sea.kernels(np.ones((1, len(sea.frequency)), dtype=np.complex128))[0]
        samples = sea.samples(-sea.half, count + 2 * sea.half)
        order = which[:: len(sea.frequency)]  # of the directions as the sea has them
        filtered = np.empty((len(headings), count))
        for row, column in zip(order, samples.T, strict=True):
            filtered[row] = np.convolve(column, kernel, "valid")
        return headings, times, filtered
    shares = [np.bincount(which, sea.amplitudes(time).real, len(headings)) for time in times]
    return headings, times, np.array(shares, dtype=np.float64).T
