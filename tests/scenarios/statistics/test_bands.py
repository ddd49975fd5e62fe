"""Band statistics against sines whose spread is known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tlpsim.scenarios.results import ResultsError
from tlpsim.scenarios.statistics.bands import band_signals, band_statistics


def sine(time: np.ndarray, period: float, deviation: float, phase: float = 0.0) -> np.ndarray:
    return deviation * math.sqrt(2.0) * np.sin(2.0 * math.pi * time / period + phase)


@pytest.mark.parametrize("phase", [0.0, 0.9, 2.1])
@pytest.mark.parametrize(("length", "slow_period"), [(3600.0, 100.0), (3650.0, 100.0), (3600.0, 133.7)])
def test_slow_drift_and_waves_are_told_apart(length: float, slow_period: float, phase: float) -> None:
    """Whole and broken numbers of periods; without the taper the broken ones leak several per cent."""
    time = np.arange(round(length / 0.1) + 1) * 0.1
    signal = 7.0 + sine(time, slow_period, 1.0, phase) + sine(time, 14.0, 0.5)
    statistics = band_statistics(time, signal)
    assert statistics.low_frequency == pytest.approx(1.0, rel=0.01)
    assert statistics.wave_frequency == pytest.approx(0.5, rel=0.01)
    assert statistics.note == ""


def test_a_drift_over_the_whole_record_stays_out_of_the_wave_band() -> None:
    """A ramp, whose ends do not meet: as a periodic record it has jumps, with lines that fall only as 1/f."""
    time = np.arange(36000) * 0.1
    ramp = (time / 3600.0 - 0.5) * math.sqrt(12.0)  # standard deviation 1
    statistics = band_statistics(time, ramp + sine(time, 14.0, 0.1))
    assert statistics.wave_frequency == pytest.approx(0.1, rel=0.01)


def test_what_is_above_the_second_edge_is_in_the_total_only() -> None:
    time = np.arange(36000) * 0.1
    statistics = band_statistics(time, sine(time, 14.0, 0.5) + sine(time, 2.0, 1.2))
    # A sine's taper side lobes are far below these tolerances.
    assert statistics.wave_frequency == pytest.approx(0.5, rel=1e-3)
    assert statistics.std == pytest.approx(1.3, rel=1e-3)
    assert statistics.low_frequency < 1e-3


@given(st.integers(0, 2**32 - 1), st.integers(2000, 2003))
@settings(max_examples=20, deadline=None)
def test_bands_that_cover_all_frequencies_hold_the_variance(seed: int, count: int) -> None:
    """Parseval, for white noise: the taper weighs samples unevenly, by a part of about 1 / sqrt(count)."""
    time = np.arange(count) * 1.0
    signal = np.random.default_rng(seed).standard_normal(count)
    statistics = band_statistics(time, signal, edges=(0.1, 1.0))
    total = math.hypot(statistics.low_frequency, statistics.wave_frequency)
    assert total == pytest.approx(statistics.std, rel=0.05)
    scaled = band_statistics(time, 3.0 + 2.0 * signal, edges=(0.1, 1.0))
    assert scaled.low_frequency == pytest.approx(2.0 * statistics.low_frequency, rel=1e-9)
    assert scaled.wave_frequency == pytest.approx(2.0 * statistics.wave_frequency, rel=1e-9)


def test_mean_and_extremes_leave_the_transient_out() -> None:
    time = np.arange(2001) * 0.5
    signal = np.where(time < 200.0, 50.0, 4.0)
    signal[1500], signal[1600] = 6.0, 1.0
    statistics = band_statistics(time, signal, start=200.0)
    assert (statistics.maximum, statistics.minimum) == (6.0, 1.0)
    assert statistics.mean == pytest.approx(4.0 - 1.0 / 1601)
    assert statistics.start == 200.0
    assert statistics.duration == pytest.approx(800.5)


def test_a_record_too_short_for_the_low_band_says_so() -> None:
    time = np.arange(801) * 0.1  # 80 s; two periods of 0.022 Hz are 91 s
    statistics = band_statistics(time, sine(time, 10.0, 1.0))
    assert math.isnan(statistics.low_frequency)
    assert statistics.wave_frequency == pytest.approx(1.0, rel=0.01)
    assert "no low-frequency part" in statistics.note


def test_a_transient_as_long_as_the_record_is_not_left_out_silently() -> None:
    time = np.arange(6501) * 0.1
    statistics = band_statistics(time, sine(time, 10.0, 1.0), start=600.0)
    assert statistics.start == 0.0
    assert "whole record of 650 s" in statistics.note
    assert not math.isnan(statistics.low_frequency)


def test_two_samples_are_enough_not_to_fail() -> None:
    statistics = band_statistics(np.array([0.0, 1.0]), np.array([1.0, 3.0]), start=5.0)
    assert (statistics.mean, statistics.maximum, statistics.minimum) == (2.0, 3.0, 1.0)
    assert math.isnan(statistics.low_frequency)


@pytest.mark.parametrize(
    ("time", "signal"),
    [([0.0], [1.0]), ([0.0, 1.0], [1.0]), ([0.0, 1.0, 3.0], [1.0, 1.0, 1.0]), ([[0.0, 1.0]], [[1.0, 1.0]])],
)
def test_records_without_statistics(time: list, signal: list) -> None:
    with pytest.raises(ResultsError, match=r"statistics: .*; give"):
        band_statistics(np.array(time), np.array(signal))


def test_signals_of_the_bands_are_the_parts_of_which_a_signal_is_made() -> None:
    time = np.arange(36000) * 0.1
    slow, waves = sine(time, 100.0, 1.0), sine(time, 12.0, 0.5)
    low, wave = band_signals(slow + waves + sine(time, 2.0, 0.3), 0.1)
    np.testing.assert_allclose(low, slow, atol=1e-9)
    np.testing.assert_allclose(wave, waves, atol=1e-9)
