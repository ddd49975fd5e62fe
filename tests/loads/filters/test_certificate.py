"""Figures of the certificate against cases whose errors are known, its limits, and its table."""

from dataclasses import fields, replace

import numpy as np
import pytest

from tlpsim.loads.filters.arma import Orders, fit
from tlpsim.loads.filters.certificate import DEFAULT_LIMITS, Limits, model_errors, spectral_errors
from tlpsim.loads.filters.model import ArmaModel, covariance, spectrum

FREQUENCY = np.linspace(0.01, 0.4, 200)


def pair(density: float, coherence: float) -> np.ndarray:
    matrix = density * np.array([[1.0, coherence], [coherence, 1.0]])
    return np.tile(matrix, (len(FREQUENCY), 1, 1))


def test_known_errors() -> None:
    found = spectral_errors(pair(1.0, 0.6), pair(2.0, 0.5), FREQUENCY)
    three = 10.0 * np.log10(2.0)
    assert found["auto_error_max"] == pytest.approx(three)
    assert found["auto_error_rms"] == pytest.approx(three)
    assert found["cross_error_max"] == pytest.approx(0.4)  # |2 * 0.5 - 0.6|
    assert found["cross_error_rms"] == pytest.approx(0.4)
    assert found["coherence_error_max"] == pytest.approx(0.1)
    assert found["density_error"] == pytest.approx(1.0)


def test_phase_counts_in_the_cross_spectrum_and_not_in_the_coherence() -> None:
    turned = pair(1.0, 0.6).astype(complex)
    turned[:, 0, 1] *= 1j
    turned[:, 1, 0] *= -1j
    found = spectral_errors(pair(1.0, 0.6), turned, FREQUENCY)
    assert found["cross_error_max"] == pytest.approx(0.6 * np.sqrt(2.0))
    assert found["coherence_error_max"] == pytest.approx(0.0, abs=1e-12)


def test_voids_do_not_count() -> None:
    target = np.where(FREQUENCY < 0.2, 1.0, 1e-3)[:, None, None]
    model = np.where(FREQUENCY < 0.2, 1.0, 1e-2)[:, None, None]
    assert spectral_errors(target, model, FREQUENCY)["auto_error_max"] == pytest.approx(10.0)
    assert spectral_errors(target, model, FREQUENCY, level=0.01)["auto_error_max"] == pytest.approx(0.0)


def test_a_model_has_no_error_against_itself() -> None:
    model = ArmaModel(autoregressive=np.array([[[0.5, 0.1], [0.0, 0.7]]]), moving_average=np.eye(2)[None], step=1.0)
    variance = np.diagonal(covariance(model, 0)[0])
    found = model_errors(model, spectrum(model, FREQUENCY), FREQUENCY, variance, 0.0)
    assert found["largest_pole"] == pytest.approx(0.7)
    assert max(value for name, value in found.items() if name != "largest_pole") < 1e-12
    louder = model_errors(model, spectrum(model, FREQUENCY), FREQUENCY, 0.8 * variance, 0.0)
    assert louder["variance_error"] == pytest.approx(0.25)


def test_trust_and_table() -> None:
    certificate = fit(
        lambda frequency: 1.0 / (1.0 + (30.0 * frequency) ** 2), 1.0, orders=Orders(autoregressive=2, moving_average=1)
    ).certificate
    assert certificate.trusted
    assert "MISSED" not in certificate.table()
    for field in fields(Limits):
        strict = replace(certificate, limits=replace(DEFAULT_LIMITS, **{field.name: -1.0}))
        assert strict.misses == (field.name,)
        assert not strict.trusted
        assert strict.table().count("MISSED") == 1
    text = replace(certificate, advice="do this").table()
    assert text.endswith("do this")
    for title in ("orders", "band", "largest pole", "condition number", "variance above the Nyquist frequency"):
        assert title in text


def test_a_figure_that_is_not_a_number_is_a_miss() -> None:
    certificate = fit(lambda frequency: 1.0 / (1.0 + (30.0 * frequency) ** 2), 1.0).certificate
    assert replace(certificate, auto_error_max=float("nan")).misses == ("auto_error_max",)
