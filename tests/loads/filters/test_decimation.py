"""Anti-alias filters: pass band, what folds, and the line of least squares."""

import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.decimation import causal_decimation_filter, decimation_filter, line_weights


def gain(ratio: float, cycles: np.ndarray, phase: float) -> np.ndarray:
    """Response to exp(i 2 pi f t) relative to its value at the instant, f in cycles a step of the target."""
    chosen = decimation_filter(ratio)
    times = np.arange(1 - chosen.before, chosen.after + 1) - phase
    return np.asarray(np.exp(2j * np.pi * np.outer(cycles / ratio, times)) @ chosen.weights(phase))


@pytest.mark.parametrize("ratio", [1.5, 2.0, 5.0, 20.0, 97.3])
@pytest.mark.parametrize("phase", [0.0, 0.37])
def test_pass_band_and_what_folds_onto_it(ratio: float, phase: float) -> None:
    np.testing.assert_allclose(gain(ratio, np.linspace(0.0, 0.25, 26), phase), 1.0, atol=3e-4)
    folding = np.linspace(0.75, 0.5 * ratio, 200) if ratio > 1.5 else np.array([0.75])
    assert np.max(np.abs(gain(ratio, folding, phase))) < 2e-4


@pytest.mark.parametrize("count", [2, 5, 21])
@pytest.mark.parametrize("time", [-0.5, 3.0, 30.0])
def test_line_is_that_of_least_squares(count: int, time: float) -> None:
    samples = np.random.default_rng(1).standard_normal(count)
    expected = np.polyval(np.polyfit(np.arange(count), samples, 1), time)
    assert line_weights(count, time) @ samples == pytest.approx(expected, rel=1e-9)


def test_causal_filter_passes_lines_and_takes_noise_off() -> None:
    chosen = causal_decimation_filter(10.0)
    assert (chosen.before, chosen.after) == (11, 0)
    line = 3.0 + 0.25 * np.arange(-10.0, 1.0)
    assert chosen.weights(0.0) @ line == pytest.approx(3.0, rel=1e-12)
    assert chosen.weights(0.4) @ line == pytest.approx(3.1, rel=1e-12)
    # Variance at the newest of n samples: (4 n - 2) / (n (n + 1)).
    assert np.sum(chosen.weights(0.0) ** 2) == pytest.approx(42.0 / (11.0 * 12.0), rel=1e-12)


@pytest.mark.parametrize("ratio", [1.0, 0.5, np.nan, 1e4])
def test_ratios_without_a_filter_are_refused(ratio: float) -> None:
    for make in (decimation_filter, causal_decimation_filter):
        with pytest.raises(ScenarioError, match="must be more than 1 and at most 200 times"):
            make(ratio)
