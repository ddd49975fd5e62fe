"""Statistics of results against processes whose answers are known: coverage of intervals, bias of extremes, speed.

A part of benchmarks/results.py; alone: python benchmarks/statistics_accuracy.py [--quick]
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from report import Row, at_least, at_most, main
from scipy.stats import gumbel_r, skew, weibull_min

from tlpsim.scenarios.monolithic import run_monolithic
from tlpsim.scenarios.parallel import in_parallel
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.extremes import fit_gumbel, fit_weibull, maxima_between_crossings
from tlpsim.scenarios.statistics.records import SignalStatistics
from tlpsim.scenarios.statistics.signals import signal_statistics
from tlpsim.scenarios.time_domain import PlatformRecorder, seeded

FloatArray = NDArray[np.float64]

SCENARIO = Path(__file__).parent.parent / "scenarios" / "typical_tlp.toml"
STEP = 0.1  # s
LENGTHS = {"3 h": 108000, "50 min": 30000}  # samples
PERIOD = 2**18  # samples after which a simulated process repeats itself
MOMENTS = (
    "mean",
    "low_frequency",
    "wave_frequency",
    "std",
    "skewness",
    "excess_kurtosis",
    "zero_crossing_period",
    "damage_equivalent_range",
)
EXTREMES = ("expected_maximum", "expected_minimum")
SHORT = {
    "low_frequency": "low",
    "wave_frequency": "wave",
    "excess_kurtosis": "kurtosis",
    "zero_crossing_period": "period",
    "damage_equivalent_range": "DEL",
    "expected_maximum": "maximum",
    "expected_minimum": "minimum",
}
SIGNALS = ("position.surge", "position.heave", "position.roll", "position.pitch", "tendon_tension[1]")
UNITS = ("m", "m", "rad", "rad", "N")
LEAST, LEAST_OF_EXTREMES = 85.0, 83.0  # %, of the worst statistic


def rows(quick: bool) -> list[Row]:
    """All rows."""
    return [*coverage(quick), *platform(quick), *tails(quick), *gumbel(quick), *speed(quick)]


# Processes


def spectra() -> dict[str, FloatArray]:
    """Variances of the lines of four processes: waves, slow drift, both, and mostly waves."""
    frequency = np.fft.rfftfreq(PERIOD, STEP)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        waves = np.nan_to_num(frequency**-5.0 * np.exp(-1.25 * (0.069 / frequency) ** 4))
    waves[(frequency == 0.0) | (frequency > 0.35)] = 0.0
    waves /= waves.sum()

    def drift(ratio: float) -> FloatArray:
        position = frequency / 0.01
        made = 1.0 / ((1.0 - position**2) ** 2 + (2.0 * ratio * position) ** 2)
        return made / made.sum()

    return {
        "waves": waves,
        "drift, 5 % damped": drift(0.05),
        "drift and waves": 0.7 * drift(0.08) + 0.3 * waves,
        "waves and drift": 0.2 * drift(0.08) + 0.8 * waves,
    }


def records(variance: FloatArray, count: int, length: int, seed: int) -> Iterator[FloatArray]:
    """Gaussian records of lines with given variances."""
    generator = np.random.default_rng(seed)
    amplitude = np.sqrt(variance / 4.0) * PERIOD
    for _ in range(count):
        lines = generator.standard_normal((2, len(variance)))
        yield np.fft.irfft(amplitude * (lines[0] + 1j * lines[1]), PERIOD)[:length]


def known(variance: FloatArray) -> dict[str, float]:
    """Answers in closed form of a Gaussian process."""
    frequency = np.fft.rfftfreq(PERIOD, STEP)
    wave = (frequency >= 0.022) & (frequency < 0.2)
    total = variance.sum()
    return {
        "mean": 0.0,
        "low_frequency": float(np.sqrt(variance[frequency < 0.022].sum())),
        "wave_frequency": float(np.sqrt(variance[wave].sum())),
        "std": float(np.sqrt(total)),
        "skewness": 0.0,
        "excess_kurtosis": 0.0,
        "zero_crossing_period": float(np.sqrt(total / np.sum(frequency**2 * variance))),
    }


# Coverage


def covered(found: Sequence[SignalStatistics], truth: dict[str, float]) -> dict[str, float]:
    """Share of the intervals, %, that hold the truth."""
    shares = {}
    for name, value in truth.items():
        estimates = [getattr(each, name) for each in found]
        shares[name] = 100.0 * float(np.mean([each.low <= value <= each.high for each in estimates]))
    return shares


def _rows(item: str, shares: dict[str, float], trials: int) -> Iterator[Row]:
    """A row for moments and one for extremes; the bound allows two standard errors of the trials."""
    for what, names, least in (("", MOMENTS, LEAST), (", extremes", EXTREMES, LEAST_OF_EXTREMES)):
        inside = {SHORT.get(name, name.replace("_", " ")): shares[name] for name in names if name in shares}
        bound = least - 200.0 * float(np.sqrt(0.01 * least * (1.0 - 0.01 * least) / trials))
        yield Row(
            item=f"95 % intervals that hold the truth, %: {item}{what}",
            measured=", ".join(f"{name} {share:.0f}" for name, share in inside.items()),
            bound=f"≥ {bound:.0f}",
            ok=bool(min(inside.values()) >= bound),
        )


def coverage(quick: bool) -> list[Row]:
    """Coverage of one record and of five, of Gaussian processes; extremes and DEL against the mean of the records."""
    count = 40 if quick else 300
    made = []
    for number, (name, variance) in enumerate(spectra().items()):
        for label, length in LENGTHS.items():
            samples = list(records(variance, count, length, 2 * number + (label == "3 h")))
            found = [signal_statistics([each], STEP, exposure=length * STEP) for each in samples]
            whole = float(np.mean([each.damage_equivalent_range.value**4 for each in found])) ** 0.25
            truth = known(variance) | {
                "damage_equivalent_range": whole,
                "expected_maximum": float(np.mean([each.max() for each in samples])),
                "expected_minimum": float(np.mean([each.min() for each in samples])),
            }
            if variance[np.fft.rfftfreq(PERIOD, STEP) < 0.022].sum() < 1e-3:
                del truth["low_frequency"]
            elif "waves" not in name:
                del truth["wave_frequency"]
            made += _rows(f"{name}, 1 × {label}", covered(found, truth), count)
            if label == "50 min":
                groups = [samples[k : k + 5] for k in range(0, count - 4, 5)]
                pooled = [signal_statistics(each, STEP, exposure=length * STEP) for each in groups]
                made += _rows(f"{name}, 5 × {label}", covered(pooled, truth), len(groups))
    return made


def _platform_record(scenario: Scenario) -> FloatArray:
    recorder = PlatformRecorder(scenario, SIGNALS, UNITS)
    run_monolithic(scenario, [recorder])
    return recorder.samples()[6000:].T.copy()


def platform(quick: bool) -> list[Row]:
    """Coverage for the default platform in its storm, against all records together, over signals in the mean."""
    count = 4 if quick else 96
    scenario = Scenario.load(SCENARIO).with_(simulation={"duration": 11400.0})
    made = in_parallel(_platform_record, [seeded(scenario, 1000 + k) for k in range(count)], None)
    rows = []
    for label, length in LENGTHS.items():
        shares: dict[str, list[float]] = {}
        for place in range(len(SIGNALS)):
            whole = [each[place][: LENGTHS["3 h"]] for each in made]
            together = signal_statistics(whole, STEP)
            truth = {name: getattr(together, name).value for name in MOMENTS}
            truth |= {"expected_maximum": float(np.mean([each.max() for each in whole]))}
            truth |= {"expected_minimum": float(np.mean([each.min() for each in whole]))}
            pieces = [each[k : k + length] for each in whole for k in range(0, len(each) - length + 1, length)]
            for name, share in covered([signal_statistics([each], STEP) for each in pieces], truth).items():
                shares.setdefault(name, []).append(share)
        mean = {name: float(np.mean(each)) for name, each in shares.items()}
        rows += _rows(f"platform in its storm, mean of {len(SIGNALS)} signals, 1 × {label}", mean, len(pieces))
    for place, name in enumerate(SIGNALS):
        for sign, end in ((1.0, "maximum"), (-1.0, "minimum")):
            turned = [sign * each[place][: LENGTHS["3 h"]] for each in made]
            rows.append(_bias(f"expected {end}, bias ± spread, %: platform, {name}", turned)[0])
    return rows


# Extremes


def tails(quick: bool) -> list[Row]:
    """Bias and spread of the expected maximum of 3 h, of Gaussian processes and of functions of them."""
    shapes: dict[str, Callable[[FloatArray], FloatArray]] = {
        "Gaussian": lambda x: x,
        "x + 0.15 x²": lambda x: x + 0.15 * x**2,
        "x + 0.08 x³": lambda x: x + 0.08 * x**3,
    }
    made, worst = [], 0.0
    for number, (name, variance) in enumerate(spectra().items()):
        samples = list(records(variance, 12 if quick else 150, LENGTHS["3 h"], 100 + number))
        for shape, function in shapes.items():
            curved = [function(each) for each in samples]
            row, bias = _bias(f"expected maximum, bias ± spread, %: {name}, {shape}", curved)
            worst = max(worst, abs(bias))
            made.append(row)
    return [*made, at_most("the same: largest bias of the tail", worst, 15.0 if quick else 10.0, "%")]


def _bias(item: str, samples: Sequence[FloatArray]) -> tuple[Row, float]:
    """Expected maxima of records against the mean of what they have: by three ways, and the bias of the first, %."""
    mean = float(np.mean([np.mean(each) for each in samples]))
    truth = float(np.mean([each.max() for each in samples])) - mean
    ways = np.array([_expected_maxima(each - mean) for each in samples])
    bias, spread = 100.0 * (np.mean(ways, axis=0) / truth - 1.0), 100.0 * np.std(ways, axis=0) / truth
    each = zip(("tail", "all", "three moments"), bias, spread, strict=True)
    return Row(item=item, measured=", ".join(f"{what} {b:+.1f} ± {s:.0f}" for what, b, s in each)), float(bias[0])


def _expected_maxima(fluctuation: FloatArray) -> tuple[float, float, float]:
    """Expected maximum by the tail of the maxima, by all of them with the mean as origin, and by three moments."""
    found = maxima_between_crossings(fluctuation, STEP).value
    fit = fit_weibull(found, time=len(fluctuation) * STEP)
    chance = -np.log((np.arange(2000) + 0.5) / 2000) / len(found)
    tail = fit.level(chance)
    shape, _, scale = weibull_min.fit(found[found > 0.0], floc=0.0)
    shapes = np.linspace(0.5, 8.0, 2000)
    three = float(np.interp(-skew(found), -weibull_min.stats(shapes, moments="s"), shapes))
    mean, variance = weibull_min.stats(three)
    width = float(np.std(found) / np.sqrt(variance))
    origin = float(np.mean(found) - width * mean)
    logarithm = np.maximum(-np.log(chance), 0.0)
    return (
        float(np.mean(tail)),
        float(np.mean(scale * logarithm ** (1.0 / shape))),
        float(np.mean(origin + width * logarithm ** (1.0 / three))),
    )


def gumbel(quick: bool) -> list[Row]:
    """Bias of three ways to fit Gumbel's distribution, and coverage of the expected extreme, of n records."""
    generator = np.random.default_rng(0)
    made = []
    for count in (3, 5, 10, 20):
        trials = generator.gumbel(size=((200 if quick else 2000), count))
        fits = [fit_gumbel(each, 1.0, 1.0, 0.95) for each in trials]
        ways = {
            "L-moments": np.array([(each.location, each.scale) for each in fits]),
            "moments": np.array([_by_moments(each) for each in trials]),
            "likelihood": np.array([gumbel_r.fit(each) for each in trials[:200]]),
        }
        listed = []
        for name, found in ways.items():
            level = np.mean(found[:, 0] - found[:, 1] * np.log(-np.log(0.9))) + np.log(-np.log(0.9))
            listed.append(f"{name} {100.0 * (np.mean(found[:, 1]) - 1.0):+.0f} %, {level:+.2f}")
        made.append(
            Row(
                item=f"Gumbel, {count} records: bias of scale, and of 90 % fractile / scale", measured="; ".join(listed)
            )
        )
        inside = np.mean([each.expected.low <= np.euler_gamma <= each.expected.high for each in fits])
        made.append(
            at_least("the same: 95 % intervals of the mean extreme that hold it", 100.0 * float(inside), 85.0, "%")
        )
    return made


def _by_moments(extremes: FloatArray) -> tuple[float, float]:
    scale = float(np.std(extremes, ddof=1)) * np.sqrt(6.0) / np.pi
    return float(np.mean(extremes)) - np.euler_gamma * scale, scale


def speed(quick: bool) -> list[Row]:
    """Time for positions and tensions of one record of 3 hours."""
    waves, mixed = spectra()["waves"], spectra()["drift and waves"]
    samples = [*records(mixed, 6, LENGTHS["3 h"], 1), *records(waves, 12, LENGTHS["3 h"], 2)]
    began = time.perf_counter()
    for each in samples:
        signal_statistics([each], STEP)
    return [at_most("18 signals of 3 h at 0.1 s, all with cycles of fatigue", time.perf_counter() - began, 5.0, "s")]


if __name__ == "__main__":
    main("Statistics", [coverage, platform, tails, gumbel, speed])
