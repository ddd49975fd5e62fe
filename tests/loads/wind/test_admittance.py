import numpy as np
import pytest
from scipy.signal import csd

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.arma import Orders, spectrum
from tlpsim.loads.filters.process import generate
from tlpsim.loads.wind.admittance import admittance_by_name, davenport
from tlpsim.loads.wind.field import Gusts, WindField, gust_spectrum, wind_field
from tlpsim.loads.wind.profile import Profile

POSITION = np.array([[0.0, -20.0, 30.0], [0.0, 20.0, 40.0]])
AREA = np.array([40_000.0, 300.0])  # the first so large that hardly a gust covers it
PROFILE = Profile(speed_10=25.0)


def effective(admittance: str) -> WindField:
    field = wind_field(
        position=POSITION,
        area=AREA,
        heading=0.0,
        profile=PROFILE,
        gusts=Gusts(admittance=admittance, orders=Orders(long=50, autoregressive=5, moving_average=5)),
    )
    assert isinstance(field, WindField)
    return field


def test_davenport_in_closed_form() -> None:
    # One at zero frequency; a half where a gust's half length U / 2 f is the side of the area.
    frequency = np.array([0.0, 30.0 / (2.0 * 20.0)])
    np.testing.assert_allclose(davenport(frequency, np.array([400.0]), np.array([30.0]))[:, 0], [1.0, 0.5])
    # Far above it falls with the power 4/3 of frequency.
    high = davenport(np.array([1e5, 2e5]), np.array([400.0]), np.array([30.0]))[:, 0]
    assert high[1] / high[0] == pytest.approx(2.0 ** (-4 / 3), rel=1e-4)


def test_it_acts_on_both_speeds_of_a_cross_spectrum() -> None:
    frequency = np.array([0.0, 0.03, 0.2])
    speed, with_it = gust_spectrum(
        position=POSITION, area=AREA, heading=0.0, profile=PROFILE, gusts=Gusts(admittance="davenport")
    )
    _, without = gust_spectrum(position=POSITION, area=AREA, heading=0.0, profile=PROFILE, gusts=Gusts())
    chi = davenport(frequency, AREA, speed)
    np.testing.assert_allclose(with_it(frequency), without(frequency) * chi[:, :, None] * chi[:, None, :], rtol=1e-12)


def test_the_filter_realizes_it_in_the_time_domain() -> None:
    plain, filtered = effective("none"), effective("davenport")
    band = np.geomspace(0.002, 0.4, 200)
    chi = davenport(band, AREA, filtered.speed)
    gain = np.sqrt(
        np.diagonal(spectrum(filtered.model, band), axis1=1, axis2=2).real
        / np.diagonal(plain.spectrum(band), axis1=1, axis2=2)
    )
    # The admittance is down to 0.1 in this band. The fit's certificate allows 1.2 dB, a factor of 1.15.
    assert chi.min() < 0.12
    np.testing.assert_allclose(gain, chi, rtol=0.1)


def test_sampled_spectra_carry_it() -> None:
    field = effective("davenport")
    samples = generate(field.model, 5, 1, 200_000)
    frequency, density = csd(samples, samples, nperseg=512, axis=0)
    inside = slice(5, 200)  # up to 0.39 Hz
    target = np.diagonal(field.spectrum(frequency[inside]), axis1=1, axis2=2)
    # Half-overlapped Hann segments: a relative deviation of 1 / sqrt(0.95 segments), and the fit's own error.
    deviation = 1.0 / np.sqrt((2 * 200_000 / 512) * 18.0 / 19.0)
    assert np.abs(density.real[inside] / target - 1.0).max() < 5.0 * deviation + 0.1


def test_variance_is_less_where_the_area_is_larger() -> None:
    plain, filtered = effective("none"), effective("davenport")
    ratio = filtered.sampled_variance / plain.sampled_variance
    assert 0.3 < ratio[0] < 0.9 < ratio[1] < 1.0


def test_unknown_name_is_refused() -> None:
    with pytest.raises(ScenarioError, match="did you mean 'davenport'"):
        admittance_by_name("Davenport ")
