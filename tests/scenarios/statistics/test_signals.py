"""Statistics of signals against closed forms and scipy, and their intervals against what they should hold."""

import math
from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kurtosis, skew

from tlpsim.scenarios.results import Results, ResultsError
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.bands import band_statistics
from tlpsim.scenarios.statistics.records import Estimate, SignalStatistics
from tlpsim.scenarios.statistics.signals import run_statistics, signal_statistics

STEP = 0.5  # s
THREE_HOURS = 21600  # samples
MOMENTS = ("mean", "low_frequency", "wave_frequency", "std", "skewness", "excess_kurtosis", "zero_crossing_period")


def drift_and_waves(frequency: np.ndarray) -> np.ndarray:
    """Resonance at 100 s, damped by 8 %, and waves from 0.06 to 0.1 Hz: variances 0.7 and 0.3."""
    position = frequency / 0.01
    # The integral over f of a resonance is pi f0 / (4 ratio).
    resonance = 4.0 * 0.08 / (math.pi * 0.01) / ((1.0 - position**2) ** 2 + (0.16 * position) ** 2)
    return 0.7 * resonance + np.where((frequency > 0.06) & (frequency < 0.1), 0.3 / 0.04, 0.0)


def known() -> dict[str, float]:
    frequency = np.arange(1, 200000) * 1e-5
    density = drift_and_waves(frequency)
    parts = {
        "low_frequency": density[frequency < 0.022].sum() * 1e-5,
        "wave_frequency": density[(frequency >= 0.022) & (frequency < 0.2)].sum() * 1e-5,
        "std": density.sum() * 1e-5,
    }
    period = math.sqrt(density.sum() / np.sum(frequency**2 * density))  # Rice (1945)
    level = {"mean": 0.0, "skewness": 0.0, "excess_kurtosis": 0.0, "zero_crossing_period": period}
    return level | {name: math.sqrt(variance) for name, variance in parts.items()}


@pytest.fixture(scope="module")
def records(gaussian: Callable[..., np.ndarray]) -> np.ndarray:
    return gaussian(drift_and_waves, 90, THREE_HOURS, STEP, 11)


@pytest.fixture(scope="module")
def singles(records: np.ndarray) -> list[SignalStatistics]:
    return [signal_statistics([each], STEP) for each in records]


def test_values_are_those_of_numpy_and_scipy(records: np.ndarray) -> None:
    signal = np.exp(0.3 * records[0]) + 4.0
    found = signal_statistics([signal], STEP, name="a.b", unit="m", start=600.0)
    bands = band_statistics(np.arange(THREE_HOURS) * STEP, signal)
    assert (found.name, found.unit, found.start, found.records) == ("a.b", "m", 600.0, 1)
    assert found.duration == pytest.approx(10800.0)
    assert (found.maximum, found.minimum) == (signal.max(), signal.min())
    for name in ("mean", "low_frequency", "wave_frequency", "std"):
        assert getattr(found, name).value == pytest.approx(getattr(bands, name), rel=1e-9)
    assert found.skewness.value == pytest.approx(skew(signal), rel=1e-9)
    assert found.excess_kurtosis.value == pytest.approx(kurtosis(signal), rel=1e-9)
    assert found.note == ""


def test_all_records_together_come_near_the_known_answers(records: np.ndarray) -> None:
    """Ninety records of 3 hours: 270 hours, in which the low-frequency spread has a standard error of 1.1 %."""
    found = signal_statistics(list(records), STEP, slope=None)
    truth = known()
    for name in ("low_frequency", "wave_frequency", "std", "zero_crossing_period"):
        assert getattr(found, name).value == pytest.approx(truth[name], rel=0.035), name
    for name in ("mean", "skewness", "excess_kurtosis"):
        assert getattr(found, name).value == pytest.approx(0.0, abs=0.04), name
    assert found.records == 90
    assert found.damage_equivalent_range is None
    assert found.cycles is None


def test_intervals_of_one_record_hold_the_truth(singles: list[SignalStatistics]) -> None:
    """Nominal 95 %; 90 trials tell 2.3 %, so that 87 % is three and a half standard errors low."""
    truth = known()
    shares = {}
    for name in MOMENTS:
        estimates = [getattr(each, name) for each in singles]
        shares[name] = np.mean([each.low <= truth[name] <= each.high for each in estimates])
    assert min(shares.values()) >= 0.87, shares
    assert 0.91 <= np.mean(list(shares.values())) <= 0.985, shares


def test_intervals_of_several_records_hold_the_truth(records: np.ndarray) -> None:
    """Thirty groups of three; all seven statistics together tell 1.5 % and more, as they are correlated."""
    truth = known()
    hits = []
    for group in records.reshape(30, 3, -1):
        found = signal_statistics(list(group), STEP, slope=None)
        for name in MOMENTS:
            estimate = getattr(found, name)
            hits.append(estimate.low <= truth[name] <= estimate.high)
    assert 0.90 <= np.mean(hits) <= 0.995


def test_intervals_of_expected_extremes_hold_the_mean_of_those_of_the_records(
    records: np.ndarray, singles: list[SignalStatistics]
) -> None:
    """Nominal 95 %, measured 85 to 95 % of single records; minima count too, as the process is symmetrical."""
    truth = 0.5 * float(np.mean(records.max(axis=1)) - np.mean(records.min(axis=1)))
    ends = [(each.expected_maximum, 1.0) for each in singles] + [(each.expected_minimum, -1.0) for each in singles]
    hits = [each.low <= sign * truth <= each.high for each, sign in ends]
    assert 0.83 <= np.mean(hits) <= 0.98
    values = [sign * each.value for each, sign in ends]
    assert np.mean(values) == pytest.approx(truth, rel=0.04)


def test_intervals_know_that_slow_cycles_are_few(singles: list[SignalStatistics]) -> None:
    """108 cycles of drift in 3 hours; as many independent samples would tell the mean to 2 std / 147."""
    half = np.median([0.5 * (each.mean.high - each.mean.low) for each in singles])
    assert half > 3.0 * 2.0 / math.sqrt(THREE_HOURS)
    low, wave = (
        np.median([(getattr(each, name).high / getattr(each, name).low) for each in singles])
        for name in ("low_frequency", "wave_frequency")
    )
    assert low - 1.0 > 2.0 * (wave - 1.0)


def test_more_records_make_narrower_intervals(records: np.ndarray, singles: list[SignalStatistics]) -> None:
    ten = signal_statistics(list(records[:10]), STEP)
    for name in (*MOMENTS, "expected_maximum", "damage_equivalent_range"):
        single = np.median([getattr(each, name).high - getattr(each, name).low for each in singles])
        together = getattr(ten, name)
        assert 0.1 * single < together.high - together.low < 0.6 * single, name
    assert ten.gumbel_maximum is not None
    assert singles[0].gumbel_maximum is None
    assert ten.gumbel_maximum.expected.value == pytest.approx(np.mean(records[:10].max(axis=1)), rel=1e-3)


@given(factor=st.floats(0.01, 1e6), offset=st.floats(-100.0, 100.0))
@settings(max_examples=8, deadline=None)
def test_units_and_origin_change_nothing_else(factor: float, offset: float) -> None:
    """Of a signal a + b x with b > 0: levels are a + b times, spreads b times, shapes the same."""
    generator = np.random.default_rng(0)
    signal = np.convolve(generator.standard_normal(4000), np.hanning(12), mode="valid")
    plain = signal_statistics([signal], STEP)
    other = signal_statistics([factor * (signal + offset)], STEP)
    for name in ("mean", "expected_maximum", "expected_minimum"):
        _same(getattr(other, name), getattr(plain, name), factor, factor * offset)
    for name in ("low_frequency", "wave_frequency", "std", "damage_equivalent_range"):
        _same(getattr(other, name), getattr(plain, name), factor, 0.0)
    for name in ("skewness", "excess_kurtosis", "zero_crossing_period"):
        _same(getattr(other, name), getattr(plain, name), 1.0, 0.0)


def _same(found: Estimate, plain: Estimate, factor: float, offset: float) -> None:
    scale = abs(offset) + factor
    for end in ("value", "low", "high"):
        assert getattr(found, end) == pytest.approx(factor * getattr(plain, end) + offset, rel=1e-5, abs=1e-6 * scale)


def test_minima_are_maxima_turned_over(records: np.ndarray) -> None:
    signal = np.exp(0.3 * records[1])
    up, down = signal_statistics([signal], STEP), signal_statistics([-signal], STEP)
    assert down.expected_minimum.value == pytest.approx(-up.expected_maximum.value)
    assert down.expected_minimum.low == pytest.approx(-up.expected_maximum.high)
    assert down.weibull_minima is not None
    assert up.weibull_maxima is not None
    assert down.weibull_minima.shape == pytest.approx(up.weibull_maxima.shape)
    assert float(down.weibull_minima.level(1e-3)) == pytest.approx(-float(up.weibull_maxima.level(1e-3)))


# What has no statistics


@pytest.mark.parametrize("value", [0.0, 5.0e6])
def test_a_signal_that_does_not_move(value: float) -> None:
    """The tension of a lost tendon."""
    found = signal_statistics([np.full(1000, value)] * 3, STEP)
    assert (found.mean.value, found.mean.low, found.mean.high) == (value, value, value)
    assert found.std.value == found.low_frequency.value == 0.0
    assert (found.maximum, found.minimum, found.expected_maximum.value) == (value, value, value)
    assert math.isnan(found.skewness.value)
    assert math.isnan(found.zero_crossing_period.value)
    assert found.damage_equivalent_range is not None
    assert found.damage_equivalent_range.value == 0.0
    assert found.note == "constant"


def test_values_that_are_not_finite_are_told() -> None:
    found = signal_statistics([np.array([1.0, 2.0, math.nan, 3.0]), np.arange(4.0)], STEP)
    assert found.note == "no statistics: values that are not finite"
    assert math.isnan(found.mean.value)


def test_a_tendon_that_is_lost_on_the_way() -> None:
    time = np.arange(7200) * STEP
    tension = np.where(time < 1800.0, 5.0 + np.sin(0.6 * time), 0.0)
    found = signal_statistics([tension], STEP)
    assert found.minimum == 0.0
    assert found.mean.value == pytest.approx(2.5, rel=0.01)
    assert found.damage_equivalent_range is not None
    assert found.damage_equivalent_range.value > 0.0


@pytest.mark.parametrize("count", [0, 1, 2, 3, 20, 150])
def test_records_that_are_too_short(count: int) -> None:
    signal = np.sin(np.arange(count) * 0.7)
    found = signal_statistics([signal], STEP)
    assert "fewer than" in found.note
    assert math.isnan(found.expected_maximum.value)
    assert math.isnan(found.low_frequency.value)
    assert found.mean.value == pytest.approx(signal.mean()) if count > 1 else math.isnan(found.mean.value)
    if 1 < count < 20:
        assert math.isnan(found.mean.high)


def test_a_sine_has_maxima_that_are_all_alike() -> None:
    time = np.arange(14400) * STEP
    found = signal_statistics([np.sin(2.0 * math.pi * time / 10.0)], STEP)
    assert "maxima all alike" in found.note
    assert found.weibull_maxima is None
    assert found.zero_crossing_period.value == pytest.approx(10.0, rel=2e-3)
    assert found.std.value == pytest.approx(math.sqrt(0.5), rel=1e-3)
    assert found.excess_kurtosis.value == pytest.approx(-1.5, abs=1e-3)


def test_records_of_different_length(records: np.ndarray) -> None:
    """Samples count alike; a record that was cut short is not among those whose extremes are compared."""
    parts = [records[0], records[1], records[2], records[3][:8000]]
    found = signal_statistics(parts, STEP)
    assert found.mean.value == pytest.approx(np.concatenate(parts).mean())
    assert found.duration == pytest.approx(4000.0)
    assert found.gumbel_maximum is not None
    assert found.gumbel_maximum.records == 3


# Of results


@pytest.fixture(scope="module")
def two(record: Callable[..., Results], gaussian: Callable[..., np.ndarray]) -> list[Results]:
    """Two records of 2000 s; tendon 2 is lost from the beginning."""
    surge, tension = gaussian(drift_and_waves, 4, 4001, STEP, 21).reshape(2, 2, -1)
    made = []
    for number in range(2):
        signals = {
            "position.surge": 5.0 + surge[number],
            "position.heave": 0.1 * surge[number],
            "tendon_tension[1]": 2e6 + 1e5 * tension[number],
            "tendon_tension[2]": np.zeros(4001),
            "elevation": tension[number],
        }
        made.append(record(Scenario.from_dict({"simulation": {"seed": number + 1}}), signals))
    return made


def test_positions_and_tensions_are_taken(two: list[Results]) -> None:
    found = {each.name: each for each in run_statistics(two)}
    names = ("position.surge", "position.heave", "tendon_tension[1]", "tendon_tension[2]")
    assert list(found) == [f"platform.{name}" for name in names]
    assert {(each.records, each.start) for each in found.values()} == {(2, 600.0)}
    signal = np.concatenate([each.signal("platform.position.surge")[each.time("platform") >= 600.0] for each in two])
    assert found["platform.position.surge"].mean.value == pytest.approx(signal.mean())
    assert found["platform.position.surge"].std.value == pytest.approx(signal.std())
    assert found["platform.tendon_tension[2]"].note == "constant"


def test_start_names_and_slope_are_heard(two: list[Results]) -> None:
    (found,) = run_statistics(two[:1], ["*.elevation"], start=0.0, slope=3.0, exposure=3600.0)
    assert (found.name, found.start, found.duration) == ("platform.elevation", 0.0, pytest.approx(2000.5))
    same = signal_statistics([two[0].signal("platform.elevation")], STEP, slope=3.0, exposure=3600.0)
    for each in fields(SignalStatistics):
        if isinstance(getattr(same, each.name), Estimate):
            assert getattr(found, each.name) == getattr(same, each.name)


def test_an_event_within_the_record_is_noted(record: Callable[..., Results]) -> None:
    scenario = Scenario.from_dict({"events": [{"at": 100.0, "lose_tendons": 2}]})
    results = record(scenario, {"position.surge": np.sin(np.arange(800) * 0.3)})
    (found,) = run_statistics([results], start=50.0)
    assert "events at 100 s change the case" in found.note
    (found,) = run_statistics([results], start=150.0)
    assert "events" not in found.note


@pytest.mark.parametrize(
    ("given", "value", "limit"),
    [
        ("exposure", 0.0, "at least 1 s"),
        ("exposure", math.inf, "at least 1 s"),
        ("slope", -3.0, "from 1 to 20"),
        ("slope", math.nan, "from 1 to 20"),
        ("confidence", 1.0, "from 0.5 to 0.999"),
        ("start", -1.0, "at least 0 s"),
    ],
)
def test_parameters_out_of_range(two: list[Results], given: str, value: float, limit: str) -> None:
    with pytest.raises(ResultsError, match=f"statistics: {given} is .*{limit}"):
        run_statistics(two, **{given: value})
