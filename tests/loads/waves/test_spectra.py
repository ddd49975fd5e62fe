import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.spectra import (
    SPECTRA,
    SpectrumTable,
    jonswap,
    pierson_moskowitz,
    spectrum_by_name,
    torsethaugen,
    torsethaugen_systems,
)

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


@pytest.mark.parametrize(("height", "period"), [(7.0, 14.0), (7.0, 10.0), (3.0, 16.0), (2.0, 6.0), (12.0, 16.0)])
def test_torsethaugen_has_the_variance_of_its_height(height: float, period: float) -> None:
    frequency = np.linspace(0.0, 5.0, 500_001)
    density = torsethaugen(frequency, height, period)
    # Its tail is f^-4: beyond 5 Hz lie less than 3.3 / 3 (5 Hz * Tp)^-3, 1e-4 for the shortest of the periods.
    assert np.trapezoid(density, frequency) == pytest.approx(height**2 / 16.0, rel=2e-4)
    primary, secondary = torsethaugen_systems(height, period)
    assert np.hypot(primary.significant_height, secondary.significant_height) == pytest.approx(height, rel=1e-12)


def test_torsethaugen_by_hand() -> None:
    # Hs = 8 m: Tf = 6.6 * 2 = 13.2 s. Swell at 16 s: eps = 2.8 / 11.8, share 0.6 + 0.4 exp(-(eps / 0.3)²) = 0.81397,
    # gamma = 35 (2 pi 8 / (9.80665 * 13.2²))^0.857 (1 + 6 eps) = 1.714 * 2.4237; wind sea of 8 sqrt(1 - 0.81397²) m.
    swell, wind_sea = torsethaugen_systems(8.0, 16.0)
    assert swell.significant_height == pytest.approx(8.0 * 0.81397, rel=1e-4)
    assert swell.peak_enhancement == pytest.approx(35 * 0.029417**0.857 * 2.4237, rel=1e-3)
    assert wind_sea.significant_height == pytest.approx(8.0 * 0.58090, rel=1e-4)
    assert wind_sea.peak_period == pytest.approx(6.6 * 4.6472 ** (1 / 3), rel=1e-4)
    # Wind sea at 8 s: eps = 5.2 / (13.2 - 2 sqrt 8), share 0.7 + 0.3 exp(-(eps / 0.5)²).
    wind_sea, swell = torsethaugen_systems(8.0, 8.0)
    share = 0.7 + 0.3 * np.exp(-((5.2 / 7.54315 / 0.5) ** 2))
    assert wind_sea.significant_height == pytest.approx(8.0 * share, rel=1e-5)
    assert swell.peak_period == pytest.approx(15.2)
    assert swell.peak_enhancement == 1.0


def test_torsethaugen_has_two_peaks_away_from_the_developed_sea() -> None:
    frequency = np.linspace(0.02, 0.4, 2000)
    density = torsethaugen(frequency, 4.0, 18.0)
    peaks = frequency[1:-1][(density[1:-1] > density[:-2]) & (density[1:-1] > density[2:])]
    assert peaks == pytest.approx([1 / 18.0, 1 / torsethaugen_systems(4.0, 18.0)[1].peak_period], rel=0.05)


def test_table_is_linear_between_its_points_and_zero_outside() -> None:
    table = SpectrumTable(frequency=np.array([0.05, 0.10, 0.20]), density=np.array([0.0, 40.0, 0.0]))
    np.testing.assert_allclose(table(np.array([0.01, 0.075, 0.1, 0.15, 0.3])), [0.0, 20.0, 40.0, 20.0, 0.0])
    assert table.peak_frequency == 0.10
    assert table.significant_height == pytest.approx(4.0 * np.sqrt(0.5 * 40.0 * 0.15))


@pytest.mark.parametrize(
    ("frequency", "density", "message"),
    [
        ([0.1, 0.1], [1.0, 2.0], "must rise"),
        ([0.1, 0.2], [1.0], "2 or more|two or more"),
        ([0.1, 0.2], [1.0, 2.0, 3.0], "2 frequencies, but 3 densities"),
        ([0.1, 0.2], [1.0, -2.0], "density must be"),
        ([0.1, 0.2], [1.0, np.nan], "density must be"),
        ([0.1, 0.2], [0.0, 0.0], "all densities are zero"),
    ],
)
def test_bad_table_is_refused(frequency: list[float], density: list[float], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        SpectrumTable(frequency=np.array(frequency), density=np.array(density))


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
