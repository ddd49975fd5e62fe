import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.spectra import SPECTRA, jonswap, pierson_moskowitz, spectrum_by_name

# Above 40 / Tp lies 1.25 / 40^4 = 5e-7 of the energy.
FREQUENCY = np.linspace(0.0, 40.0 / 12.0, 400_001)


@pytest.mark.parametrize("gamma", [1.0, 2.0, 3.3, 5.0, 7.0])
def test_jonswap_has_the_variance_of_its_height(gamma: float) -> None:
    density = jonswap(FREQUENCY, 8.0, 12.0, gamma)
    assert np.trapezoid(density, FREQUENCY) == pytest.approx(8.0**2 / 16.0, rel=2e-6)


def test_pierson_moskowitz_in_closed_form() -> None:
    density = pierson_moskowitz(FREQUENCY, 8.0, 12.0)
    assert np.trapezoid(density, FREQUENCY) == pytest.approx(4.0, rel=2e-6)
    assert FREQUENCY[np.argmax(density)] == pytest.approx(1.0 / 12.0, rel=1e-3)
    peak = 5.0 / 16.0 * 8.0**2 * 12.0 * np.exp(-1.25)
    assert density.max() == pytest.approx(peak, rel=1e-6)
    # Mean zero-crossing period: Tz / Tp = (1.25 pi)^(-1/4) = 0.710. The cut tail of f² S is 5e-4 of it.
    second = np.trapezoid(FREQUENCY**2 * density, FREQUENCY)
    assert np.sqrt(4.0 / second) / 12.0 == pytest.approx((1.25 * np.pi) ** -0.25, rel=1e-3)


def test_jonswap_without_enhancement_is_pierson_moskowitz() -> None:
    frequency = FREQUENCY[::1000]
    np.testing.assert_allclose(jonswap(frequency, 5.0, 9.0, 1.0), pierson_moskowitz(frequency, 5.0, 9.0))


@pytest.mark.parametrize("gamma", [2.0, 3.3, 5.0])
def test_jonswap_scale_agrees_with_the_published_approximation(gamma: float) -> None:
    # DNV-RP-C205: C = 1 - 0.287 ln gamma, stated to fit for 1 < gamma < 7 within a few per cent. Far above the peak
    # the enhancement is one, so that the ratio to the other spectrum is C.
    scale = jonswap(np.array([0.5]), 5.0, 10.0, gamma) / pierson_moskowitz(np.array([0.5]), 5.0, 10.0)
    assert scale[0] == pytest.approx(1.0 - 0.287 * np.log(gamma), rel=0.02)


def test_no_energy_at_zero_frequency_or_in_calm_water() -> None:
    for function in SPECTRA.values():
        assert function(np.array([0.0, 1e-4]), 8.0, 12.0, 3.3).tolist() == [0.0, 0.0]
        assert not np.any(function(FREQUENCY[::1000], 0.0, 12.0, 3.3))


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"significant wave height is -1.0 m; it must be finite and >= 0"):
        jonswap(FREQUENCY, -1.0, 12.0)
    with pytest.raises(ScenarioError, match="significant wave height is nan"):
        pierson_moskowitz(FREQUENCY, float("nan"), 12.0)
    with pytest.raises(ScenarioError, match="peak period of the waves is 0"):
        jonswap(FREQUENCY, 1.0, 0.0)
    with pytest.raises(ScenarioError, match=r"peak enhancement factor of the waves is 0.5; it must be from 1 to 20"):
        jonswap(FREQUENCY, 1.0, 12.0, 0.5)
    with pytest.raises(ScenarioError, match="'jonswop' is not known; did you mean 'jonswap'"):
        spectrum_by_name("jonswop")
