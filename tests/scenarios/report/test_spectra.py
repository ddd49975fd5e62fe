import math
from collections.abc import Callable

import h5py
import numpy as np
import pytest
from scipy.stats import chi2

from tlpsim.scenarios.report.spectra import spectrum
from tlpsim.scenarios.results import Results

NAME = "platform.position.surge"
STEP = 0.5
SAMPLES = 20_000


def noise(seed: int, count: int = SAMPLES) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(count)


def test_white_noise_has_an_even_spectrum_with_its_variance(written: Callable[..., Results]) -> None:
    found = spectrum([written({NAME: noise(1)})], NAME)
    assert found is not None
    # One-sided up to 1 Hz: 2 sigma^2 step = 1 per Hz. The mean of n lines of m segments has 1/sqrt(n m) error, and
    # neighbouring lines of Hann windows share a half.
    error = math.sqrt(2.0 / (len(found.frequency) * found.segments))
    assert found.density.mean() == pytest.approx(1.0, abs=4.0 * error)
    assert found.frequency[-1] <= 1.0


def test_a_harmonic_has_half_its_amplitude_squared(written: Callable[..., Results]) -> None:
    wave = 3.0 * np.sin(2.0 * np.pi * 0.08 * STEP * np.arange(SAMPLES))
    found = spectrum([written({NAME: wave})], NAME)
    assert found is not None
    # A long record of a harmonic: what leaks out of the window's main lobe is less than 1e-4.
    assert np.trapezoid(found.density, found.frequency) == pytest.approx(4.5, rel=1e-3)


def test_the_band_holds_the_true_spectrum_as_often_as_it_says(written: Callable[..., Results]) -> None:
    inside = []
    for seed in range(10, 22):
        found = spectrum([written({NAME: noise(seed)})], NAME)
        assert found is not None
        low, high = found.band()
        lines = found.density[5:-5:3]  # three lines apart Hann windows are independent
        inside.append(np.mean((low * lines <= 1.0) & (high * lines >= 1.0)))
    # 12 records of some 200 lines: 0.95 within four standard deviations of a share, 4 sqrt(0.05 0.95 / 2400)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.018)


def test_the_band_of_known_degrees_of_freedom(written: Callable[..., Results]) -> None:
    found = spectrum([written({NAME: noise(3)})], NAME)
    assert found is not None
    # 10 000 s in segments of 1250 s, half overlapped: 15, of which 18/19 count; tables of chi-square with 28.4 degrees.
    assert found.length == pytest.approx(1250.0)
    assert found.segments == pytest.approx(15 * 18 / 19)
    freedom = 2.0 * found.segments
    assert found.band() == pytest.approx((freedom / chi2.isf(0.025, freedom), freedom / chi2.isf(0.975, freedom)))


def test_records_are_averaged_by_their_lengths(written: Callable[..., Results]) -> None:
    records = [written({NAME: scale * noise(seed)}) for seed, scale in ((1, 1.0), (2, 3.0))]
    single = [spectrum([each], NAME) for each in records]
    together = spectrum(records, NAME)
    assert together is not None
    assert single[0] is not None
    assert single[1] is not None
    np.testing.assert_allclose(together.density, 0.5 * (single[0].density + single[1].density))
    assert together.segments == pytest.approx(2.0 * single[0].segments)


def test_what_gives_no_spectrum(written: Callable[..., Results]) -> None:
    assert spectrum([written({NAME: noise(1, 5)})], NAME) is None
    gap = noise(1)
    gap[100] = np.nan
    assert spectrum([written({NAME: gap})], NAME) is None
    assert spectrum([], NAME) is None
    uneven = written({NAME: noise(1)})
    with h5py.File(uneven.path, "a") as file:
        file["platform"]["time"][-1] += 0.3
    assert spectrum([uneven], NAME) is None
