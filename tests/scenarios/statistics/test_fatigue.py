"""Rainflow counting and damage-equivalent ranges against the standard's example and closed forms."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
import rainflow
from hypothesis import given
from hypothesis import strategies as st

from tlpsim.scenarios.statistics.fatigue import (
    cycle_histogram,
    damage_equivalent_range,
    rainflow_cycles,
    turning_points,
)

ASTM = [-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]
"""Fig. 6 of ASTM E1049-85, counted in its section 5.4.4.2."""


def through(points: list[float], between: int = 5) -> np.ndarray:
    """Samples of half cosines between turning points."""
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(between) / between)
    parts = [a + (b - a) * rise for a, b in pairwise(points)]
    return np.array([*np.concatenate(parts), points[-1]])


@pytest.mark.parametrize("between", [1, 5])
def test_the_example_of_astm_e1049(between: int) -> None:
    found = rainflow_cycles(through(ASTM, between), 1.0)
    counted: dict[float, float] = {}
    for size, count in zip(np.round(found.ranges, 9), found.counts, strict=True):
        counted[float(size)] = counted.get(float(size), 0.0) + float(count)
    assert counted == {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}
    whole = found.counts == 1.0
    assert (found.ranges[whole].tolist(), found.means[whole].tolist()) == ([4.0], [1.0])


@given(st.lists(st.integers(-5, 5), min_size=2, max_size=60))
def test_turning_points_hold_all_cycles(values: list[int]) -> None:
    """As many cycles of each range as by counting on the samples themselves, levels that stand still among them.

    The first sample is given to the package twice: it counts no half cycle of two samples alone.
    """
    signal = np.array(values, dtype=float)
    found = rainflow_cycles(signal, 1.0)
    all_samples = [signal[0], *signal]
    direct = sorted((size, count) for size, _, count, _, _ in rainflow.extract_cycles(all_samples) if size > 0.0)
    ours = sorted((r, c) for r, c in zip(found.ranges.tolist(), found.counts.tolist(), strict=True) if r > 0.0)
    assert ours == direct
    assert np.all((found.events.place > 0.0) & (found.events.place < 1.0))


def test_turning_points_by_hand() -> None:
    assert turning_points(np.array([1.0, 1.0, 2.0, 2.0, 1.0, 3.0, 4.0, 4.0])).tolist() == [0, 2, 4, 6]
    assert turning_points(np.array([2.0, 2.0, 2.0])).tolist() == [0]
    assert turning_points(np.zeros(1)).tolist() == [0]


@pytest.mark.parametrize("slope", [1.0, 3.0, 5.0])
def test_the_range_of_a_sine(slope: float) -> None:
    """Amplitude 2 at 0.1 Hz: (0.1 (2 · 2)^m / 1 Hz)^(1/m)."""
    time = np.arange(0.0, 6000.0, 0.25)
    found = damage_equivalent_range([rainflow_cycles(2.0 * np.sin(0.2 * np.pi * time) + 9.0, 0.25)], slope, 4, 0.95)
    assert found.value == pytest.approx(4.0 * 0.1 ** (1.0 / slope), rel=3e-3)


@pytest.mark.parametrize("slope", [3.0, 4.0, 5.0])
def test_the_range_of_a_narrow_banded_gaussian_process(gaussian: Callable[..., np.ndarray], slope: float) -> None:
    """Rayleigh amplitudes: E S^m = (2 sqrt(2) sigma)^m Gamma(1 + m / 2), at the rate 0.1 Hz.

    Forty records of 3 hours: the estimate has a standard error of 1 %, and five records tell that of theirs.
    """

    def narrow(frequency: np.ndarray) -> np.ndarray:
        return np.where(np.abs(frequency - 0.1) < 0.005, 9.0 / 0.01, 0.0)

    records = gaussian(narrow, 40, 21600, 0.5, 3)
    # At 20 samples a cycle the largest one is, in the mean, 1 - (2 pi / 20)^2 / 24 of the amplitude.
    sampled = 1.0 - (0.1 * math.pi) ** 2 / 24.0
    expected = sampled * 2.0 * math.sqrt(2.0) * 3.0 * (0.1 * math.gamma(1.0 + 0.5 * slope)) ** (1.0 / slope)
    counted = [rainflow_cycles(each, 0.5) for each in records]
    assert damage_equivalent_range(counted, slope, 6, 0.95).value == pytest.approx(expected, rel=0.03)
    hits = [damage_equivalent_range([each], slope, 6, 0.95) for each in counted]
    assert np.mean([each.low <= expected <= each.high for each in hits]) >= 0.82


def test_records_of_different_length_add_up() -> None:
    """Twice as much time of rest halves the damage."""
    time = np.arange(0.0, 1000.0, 0.25)
    moving, resting = rainflow_cycles(np.sin(0.2 * np.pi * time), 0.25), rainflow_cycles(np.zeros(8000), 0.25)
    alone = damage_equivalent_range([moving], 4.0, 4, 0.95).value
    assert damage_equivalent_range([moving, resting], 4.0, 4, 0.95).value == pytest.approx(alone / 3.0**0.25, rel=1e-9)


def test_a_signal_at_rest_has_no_range() -> None:
    found = damage_equivalent_range([rainflow_cycles(np.full(100, 3.0), 1.0)], 4.0, 4, 0.95)
    assert (found.value, found.low, found.high) == (0.0, 0.0, 0.0)


def test_the_histogram_holds_all_cycles() -> None:
    records = [rainflow_cycles(through(ASTM), 1.0), rainflow_cycles(through(ASTM[::-1]), 1.0)]
    found = cycle_histogram(records, bins=9)
    np.testing.assert_allclose(found.edges, np.arange(10.0))
    assert found.counts.sum() == pytest.approx(sum(each.counts.sum() for each in records) / 2.0)
    # By bins of 1: a range of 9 is in the last one, with its end.
    np.testing.assert_allclose(found.counts[[0, 1, 2, 5, 7]], 0.0)
    assert np.isnan(found.means[0])
    total = np.nansum(found.means * found.counts)
    assert total == pytest.approx(sum(float(each.means @ each.counts) for each in records) / 2.0)
