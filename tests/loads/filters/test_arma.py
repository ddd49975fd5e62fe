"""Fits of wind-like spectra at several points: accuracy, singular cases, fallback, advice, and what is refused."""

import warnings
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.filters import arma, matching
from tlpsim.loads.filters.arma import (
    FilterFitWarning,
    Orders,
    _long_autoregression,
    covariance,
    fit,
    recommended_orders,
    spectrum,
)
from tlpsim.loads.filters.model import LARGEST_POLE, ArmaModel
from tlpsim.loads.filters.process import generate

FloatArray = NDArray[np.float64]
Spectrum = Callable[[FloatArray], FloatArray]

# (y, z) in m, in a logarithmic profile of 40 m/s at 10 m with z0 = 0.005 m.
SIX_POINTS = np.array([(-30, 22), (0, 22), (30, 22), (-20, 40), (20, 40), (0, 70)], dtype=float)


def kaimal(frequency: FloatArray, height: FloatArray, speed: FloatArray, friction: float) -> FloatArray:
    time = height / speed
    return 200.0 * friction**2 * time / (1.0 + 50.0 * frequency[:, None] * time) ** (5.0 / 3.0)


def harris(frequency: FloatArray, height: FloatArray, speed: FloatArray, friction: float) -> FloatArray:
    time = 1800.0 * 0.4 / (friction * np.log(10.0 / 0.005))
    return np.tile((4.0 * friction**2 * time / (2.0 + (frequency * time) ** 2) ** (5.0 / 6.0))[:, None], len(height))


def davenport(frequency: FloatArray, height: FloatArray, speed: FloatArray, friction: float) -> FloatArray:
    time = 1200.0 * 0.4 / (friction * np.log(10.0 / 0.005))
    x = frequency * time
    return np.tile((4.0 * friction**2 * time * x / (1.0 + x**2) ** (4.0 / 3.0))[:, None], len(height))


def wind(density: Callable[..., FloatArray], points: FloatArray, speed_10: float = 40.0) -> Spectrum:
    """Cross-spectra with Davenport's coherence, Cy = 16 and Cz = 10."""
    friction = 0.4 * speed_10 / np.log(10.0 / 0.005)
    height = points[:, 1]
    speed = friction / 0.4 * np.log(height / 0.005)
    separation = np.abs(points[:, None, :] - points[None, :, :])
    decay = np.hypot(16.0 * separation[..., 0], 10.0 * separation[..., 1]) / (0.5 * (speed[:, None] + speed[None, :]))

    def matrix(frequency: FloatArray) -> FloatArray:
        root = np.sqrt(density(frequency, height, speed, friction))
        return np.exp(-frequency[:, None, None] * decay) * root[:, :, None] * root[:, None, :]

    return matrix


def test_six_points_in_a_kaimal_wind_at_the_orders_of_the_paper() -> None:
    certificate = fit(wind(kaimal, SIX_POINTS), 1.0).certificate
    assert certificate.trusted
    assert certificate.orders_used == "AR(25) -> ARMA(3, 3)"
    assert certificate.band == pytest.approx((0.002, 0.4))
    # The square match alone has 0.56 dB, 0.14 dB, 0.080 and 0.032.
    assert certificate.auto_error_max <= 0.6
    assert certificate.auto_error_rms <= 0.2
    assert certificate.cross_error_max <= 0.09
    assert certificate.coherence_error_max <= 0.04
    assert certificate.variance_error < 1e-12


def test_random_layouts_are_stable_and_good() -> None:
    generator = np.random.default_rng(3)
    for density, worst in ((kaimal, 1.3), (harris, 1.3), (davenport, np.inf)):
        for step in (0.6, 1.0, 2.0):
            count = int(generator.integers(1, 8))
            points = np.column_stack([generator.uniform(-60, 60, count), generator.uniform(8, 120, count)])
            orders = Orders(long=max(25, int(np.ceil(25.0 / step))))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FilterFitWarning)
                certificate = fit(wind(density, points, generator.uniform(8, 50)), step, orders=orders).certificate
            assert certificate.largest_pole < LARGEST_POLE
            assert not certificate.fallback
            assert certificate.auto_error_max < worst
            assert certificate.variance_error < 1e-10


def test_coincident_points_move_as_one() -> None:
    points = np.vstack([SIX_POINTS, SIX_POINTS[1], SIX_POINTS[4]])
    result = fit(wind(kaimal, points), 1.0)
    assert result.certificate.rank == 6
    assert result.certificate.ridge == 0.0
    alone = fit(wind(kaimal, SIX_POINTS), 1.0)
    np.testing.assert_allclose(covariance(result.model, 0)[0, :6, :6], covariance(alone.model, 0)[0], rtol=1e-9)
    # The cross-spectra of the two pairs count in the choice between matches, so that a little differs beyond lag zero.
    np.testing.assert_allclose(covariance(result.model, 2)[:, :6, :6], covariance(alone.model, 2), rtol=0.02)
    samples = generate(result.model, 1, 1, 500)
    np.testing.assert_allclose(samples[:, [6, 7]], samples[:, [1, 4]], atol=1e-9)
    assert np.std(samples[:, 1] - samples[:, 0]) > 0.5


@pytest.mark.parametrize("distance", [1e-9, 1e-6, 1e-3, 0.1])
def test_points_that_almost_coincide_work(distance: float) -> None:
    points = np.vstack([SIX_POINTS, SIX_POINTS[2] + [distance, 0.0]])
    certificate = fit(wind(kaimal, points), 1.0).certificate
    assert certificate.trusted
    assert certificate.ridge <= 1e-6


def test_full_coherence_is_one_process() -> None:
    def coherent(frequency: FloatArray) -> FloatArray:
        scale = np.array([1.0, 2.0, -0.5])
        return (1.0 / (1.0 + (20.0 * frequency) ** 2))[:, None, None] * np.outer(scale, scale)

    result = fit(coherent, 1.0)
    assert result.certificate.rank == 1
    samples = generate(result.model, 0, 0, 300)
    np.testing.assert_allclose(samples, np.outer(samples[:, 0], [1.0, 2.0, -0.5]), atol=1e-9)


def test_cross_spectra_with_a_phase() -> None:
    """A component that lags another by 0.7 steps: complex cross-spectra, and a correlation that is not symmetric."""

    def delayed(frequency: FloatArray) -> NDArray[np.complex128]:
        density = 1.0 / (1.0 + (30.0 * frequency) ** 2)
        cross = 0.8 * density * np.exp(2j * np.pi * frequency * 0.7)
        return np.moveaxis(np.array([[density, cross], [cross.conj(), density]]), 2, 0)

    result = fit(delayed, 1.0, orders=Orders(long=50, autoregressive=5, moving_average=5))
    assert result.certificate.trusted
    frequency = np.array([0.01, 0.05, 0.1])
    found = np.angle(spectrum(result.model, frequency)[:, 0, 1])
    np.testing.assert_allclose(found, 2.0 * np.pi * frequency * 0.7, atol=0.02)


def test_poor_fit_warns_with_the_orders_that_would_do() -> None:
    target = wind(davenport, SIX_POINTS)
    with pytest.warns(
        FilterFitWarning, match=r"auto error max [2-5]\.\d+, limit 1\.2; .*AR\(\d+\) -> ARMA\(.*would do"
    ):
        poor = fit(target, 1.0)
    assert not poor.certificate.trusted
    better = recommended_orders(target, 1.0)
    assert better is not None
    assert str(better) in poor.certificate.advice
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        good = fit(target, 1.0, orders=better).certificate
    assert good.auto_error_max <= 1.2
    assert good.auto_error_rms <= 0.35


def test_unstable_match_falls_back_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """No spectrum is known whose match is unstable at all lags: the upper orders are made so by hand."""

    def spoiled(long: ArmaModel, correlation: FloatArray, p: int, q: int, lags: int) -> ArmaModel:
        model = matching.matched_arma(long, correlation, p, q, lags)
        if p <= lowest:
            return model
        return ArmaModel(
            autoregressive=5.0 * model.autoregressive, moving_average=model.moving_average, step=model.step
        )

    monkeypatch.setattr(arma, "matched_arma", spoiled)
    for stable, used in ((2, "AR(25) -> ARMA(2, 1)"), (0, "AR(25)")):
        lowest = stable
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FilterFitWarning)
            certificate = fit(
                wind(harris, SIX_POINTS), 1.0, orders=Orders(autoregressive=4, moving_average=3)
            ).certificate
        assert certificate.fallback.startswith("AR(25) -> ARMA(4, 3): ARMA model: its largest pole is")
        assert certificate.orders_asked == "AR(25) -> ARMA(4, 3)"
        assert certificate.orders_used == used
        assert certificate.largest_pole < LARGEST_POLE
        assert certificate.variance_error < 1e-10


def test_long_autoregression_alone() -> None:
    orders = Orders(long=25, autoregressive=25, moving_average=0)
    result = fit(wind(kaimal, SIX_POINTS), 1.0, orders=orders)
    assert result.model.orders == (25, 0)
    assert result.certificate.orders_used == str(orders) == "AR(25)"
    assert result.certificate.auto_error_max == pytest.approx(0.41, abs=0.01)


def test_variance_above_nyquist_is_reported() -> None:
    """A Kaimal spectrum has (1 + 50 n)^(-2/3) of its variance above n."""
    points = np.array([[0.0, 22.0]])
    certificate = fit(wind(kaimal, points), 1.0).certificate
    speed = 40.0 / np.log(10.0 / 0.005) * np.log(22.0 / 0.005)
    exact = (1.0 + 50.0 * 0.5 * 22.0 / speed) ** (-2.0 / 3.0)
    # The sum ends at 1000 times the Nyquist frequency, where 1 % of that part is left.
    assert certificate.variance_lost == pytest.approx(exact, rel=0.015)


def flat(frequency: FloatArray) -> FloatArray:
    return np.where(frequency < 0.2, 1.0, 0.01)


def pair(frequency: FloatArray, cross: complex, back: complex) -> NDArray[np.complex128]:
    ones = np.ones(len(frequency), dtype=np.complex128)
    return np.moveaxis(np.array([[ones, cross * ones], [back * ones, ones]]), 2, 0)


@pytest.mark.parametrize(
    ("target", "message"),
    [
        (lambda f: np.where(f > 0.1, np.nan, 1.0), "is not finite at 0.1"),
        (lambda f: np.where(f > 0.1, -1.0, 1.0), r"is -1 at 0.1\d* Hz .* must be >= 0"),
        (lambda f: np.zeros(len(f)), "has no variance below the Nyquist frequency 0.5 Hz"),
        (lambda f: np.exp(-0.5 * ((f - 0.8) / 0.1) ** 2), r"below the spectrum's peak at 0\.[78]\d* Hz; it must be"),
        (lambda f: pair(f, 0.5, 0.2), "not Hermitian"),
        (lambda f: pair(f, 1.5, 1.5), r"has no process at .* eigenvalue -0.5"),
        (lambda f: np.ones((len(f), 2)), r"it must be \(nf,\) or \(nf, m, m\)"),
    ],
)
def test_bad_spectra_are_refused(target: Spectrum, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        fit(target, 1.0)


def test_bad_parameters_are_refused() -> None:
    with pytest.raises(ScenarioError, match="sampling step of a random process is 0"):
        fit(flat, 0.0)
    with pytest.raises(ScenarioError, match=r"white floor .* is 1.0"):
        fit(flat, 1.0, white_floor=1.0)
    with pytest.raises(ScenarioError, match=r"must lie between zero and the Nyquist frequency 0.5 Hz"):
        fit(flat, 1.0, band=(0.1, 0.7))
    with pytest.raises(ScenarioError, match="the polish is for one component, not for 2"):
        fit(lambda f: pair(f, 0.1, 0.1), 1.0, polish=True)
    for orders in ({"long": 5, "autoregressive": 6}, {"autoregressive": 0}, {"long": 3, "moving_average": 4}):
        with pytest.raises(ScenarioError, match="the autoregressive order must be from 1"):
            Orders(**orders)


def test_correlations_that_no_ridge_makes_definite_are_refused() -> None:
    with pytest.raises(SolverError, match=r"innovation covariance of order 1 .*tried with ridges of up to 1e-06"):
        _long_autoregression(np.array([[[1.0]], [[1.5]]]), 1.0)
