"""The scalar polish: stable and of minimum phase whatever it starts from, and as good as wave spectra need."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tlpsim.loads.filters.arma import Orders, fit, spectrum
from tlpsim.loads.filters.model import LARGEST_POLE, ArmaModel, largest_pole
from tlpsim.loads.filters.polish import _data, _log_spectrum, _polynomial, _reflections, _Sections, polished

FloatArray = NDArray[np.float64]

WAVES = Orders(long=59, autoregressive=8, moving_average=7)


def jonswap(frequency: FloatArray, peak_period: float, enhancement: float) -> FloatArray:
    """JONSWAP's shape, with the peak of the Pierson-Moskowitz spectrum scaled to one."""
    ratio = np.maximum(frequency * peak_period, 1e-6)
    width = np.where(ratio <= 1.0, 0.07, 0.09)
    tail = 5.0 * np.log(ratio) + 1.25 * (ratio**-4.0 - 1.0)
    return np.exp(-tail) * enhancement ** np.exp(-0.5 * ((ratio - 1.0) / width) ** 2)


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 7))
@settings(max_examples=60, deadline=None)
def test_reflections_and_polynomials_are_inverse(seed: int, count: int) -> None:
    generator = np.random.default_rng(seed)
    pairs = generator.uniform(0.1, 0.9, count) * np.exp(1j * generator.uniform(0.1, 3.0, count))
    real = generator.uniform(-0.9, 0.9, seed % 3)
    roots = np.concatenate([pairs, pairs.conj(), real])
    reflections = _reflections(roots)
    assert np.all(np.abs(reflections) < 1.0)
    # Products of up to 16 roots, hence sums of thousands of terms.
    np.testing.assert_allclose(_polynomial(reflections, len(roots)), np.poly(roots).real, atol=1e-9)


def test_roots_outside_the_circle_are_reflected_and_keep_the_shape() -> None:
    roots = np.array([1.25 * np.exp(0.4j), 1.25 * np.exp(-0.4j), -2.0])
    inside = np.roots(_polynomial(_reflections(roots), 3))
    assert np.max(np.abs(inside)) == pytest.approx(0.8)
    z = np.exp(1j * np.linspace(0.1, 3.0, 7))
    ratio = np.abs(np.polyval(np.poly(roots), z) / np.polyval(np.poly(inside), z))
    np.testing.assert_allclose(ratio, 1.25**2 * 2.0, rtol=1e-12)


def test_derivatives_agree_with_differences() -> None:
    data, _ = _data(lambda frequency: jonswap(frequency, 12.0, 3.3), 1.0)
    free = np.ones((4, 2), dtype=bool)
    free[3, 1] = False
    sections = _Sections(denominators=2, free=free)
    x = np.random.default_rng(1).uniform(-1.5, 1.5, 8)
    _, derivative = _log_spectrum(x, sections, data)
    for i in range(8):
        move = 1e-6 * np.eye(8)[i]
        high, low = (_log_spectrum(x + sign * move, sections, data)[0] for sign in (1, -1))
        np.testing.assert_allclose(derivative[:, i], (high - low) / 2e-6, atol=1e-6 * np.abs(derivative).max())


@pytest.mark.parametrize("enhancement", [1.0, 3.3])
@pytest.mark.parametrize(("peak_period", "step"), [(14, 0.5), (14, 1.0), (14, 2.0), (8, 0.5), (8, 1.0), (18, 0.5)])
def test_waves_at_the_orders_of_the_paper(peak_period: float, step: float, enhancement: float) -> None:
    result = fit(
        lambda frequency: jonswap(frequency, peak_period, enhancement),
        step,
        orders=WAVES,
        white_floor=1e-4,
        polish=True,
    )
    frequency = np.linspace(0.0, 0.5 / step, 4001)
    target = jonswap(frequency, peak_period, enhancement)
    found = spectrum(result.model, frequency)[:, 0, 0].real
    core = target > 0.01 * target.max()
    assert np.max(np.abs(10.0 * np.log10(found[core] / target[core]))) <= 0.35
    assert np.sqrt(np.sum((found - target) ** 2) / np.sum(target**2)) <= 0.02
    height_ratio = np.sqrt(np.trapezoid(found, frequency) / np.trapezoid(target, frequency))
    assert height_ratio == pytest.approx(1.0, abs=1e-4)
    assert result.certificate.trusted
    assert result.certificate.orders_used == str(WAVES)
    # No more than the floor of the peak in the void below the waves, where platforms resonate.
    assert found[frequency < 0.3 / peak_period].max() < 3e-3 * target.max()


def test_steep_peaks_are_good_where_it_matters() -> None:
    """A peak enhancement of 5 is kinked more sharply than eight poles can follow."""
    certificate = fit(lambda f: jonswap(f, 14.0, 5.0), 0.5, orders=WAVES, white_floor=1e-4, polish=True).certificate
    assert certificate.auto_error_max <= 0.35
    assert certificate.density_error <= 0.03


@given(seed=st.integers(0, 2**32 - 1), p=st.integers(1, 9), q=st.integers(0, 9))
@settings(max_examples=15, deadline=None)
def test_any_start_gives_a_stable_model_of_minimum_phase(seed: int, p: int, q: int) -> None:
    generator = np.random.default_rng(seed)
    start = ArmaModel(
        autoregressive=generator.standard_normal((p, 1, 1)),
        moving_average=generator.standard_normal((q + 1, 1, 1)),
        step=1.0,
    )
    model = polished(start, lambda frequency: jonswap(frequency, 12.0, 2.0), 30)
    assert model.orders == (p, q)
    assert largest_pole(model) < LARGEST_POLE
    if q:
        # Roots that crowd are computed to a few digits only.
        assert np.max(np.abs(np.roots(model.moving_average[:, 0, 0]))) < 1.0 + 1e-3


def test_two_peaks() -> None:
    """Swell and wind sea: not the shape that anything here was made for."""

    def two(frequency: FloatArray) -> FloatArray:
        return jonswap(frequency, 15.0, 3.0) + 0.5 * jonswap(frequency, 7.0, 1.5)

    orders = Orders(long=59, autoregressive=12, moving_average=11)
    certificate = fit(two, 0.5, orders=orders, white_floor=1e-4, polish=True).certificate
    assert certificate.trusted
