import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.field import WaveComponents, calm_water, elevation, regular_wave, wave_components
from tlpsim.loads.waves.sea import SeaState


def sea(*, count: int = 300, seed: int = 3, **changes: object) -> WaveComponents:
    parameters: dict[str, object] = {
        "spectrum": "pierson_moskowitz",
        "significant_height": 8.0,
        "peak_period": 14.0,
        "heading": 0.4,
        "water_depth": 450.0,
        "highest_frequency": 0.25,
    }
    return wave_components(SeaState(**(parameters | changes)), count=count, seed=seed)  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", [0, 1, 2**40])
def test_every_realization_has_the_variance_of_the_spectrum_in_its_band(seed: int) -> None:
    components = sea(seed=seed, lowest_frequency=0.03, highest_frequency=0.25)
    # The share of Pierson-Moskowitz below f is exp(-1.25 (fp / f)^4).
    share = np.exp(-1.25 / (14.0 * 0.25) ** 4) - np.exp(-1.25 / (14.0 * 0.03) ** 4)
    assert np.sum(components.amplitude**2) / 2 == pytest.approx(8.0**2 / 16 * share, rel=1e-8)


def test_default_band_holds_the_height_of_a_storm() -> None:
    components = sea(spectrum="jonswap", peak_enhancement=3.3)
    assert 4.0 * np.sqrt(np.sum(components.amplitude**2) / 2) == pytest.approx(8.0, rel=0.01)


def test_frequencies_lie_one_in_each_bin_and_not_on_a_grid() -> None:
    components = sea(count=100, lowest_frequency=0.03, highest_frequency=0.23)
    place = (components.frequency - 0.03) / 0.002
    np.testing.assert_array_equal(np.floor(place), np.arange(100))
    assert np.ptp(place - np.floor(place)) > 0.9
    assert 0.0 <= components.phase.min() < components.phase.max() < 2 * np.pi


def test_record_has_the_variance_of_its_components() -> None:
    components = sea()
    time = np.arange(0.0, 3 * 3600.0, 0.5)
    record = elevation(components, time, 10.0, -20.0)
    # Over three hours the beats of neighbours in 0.77 mHz bins average out as 1 / (2 pi df T): 2 %, four of them.
    assert record.var() == pytest.approx(np.sum(components.amplitude**2) / 2, rel=0.08)


def test_short_crested_sea_has_the_energy_and_the_directions_of_its_spreading() -> None:
    one, many = sea(), sea(directions=5, spreading_exponent=4.0)
    energy = many.amplitude**2 / 2
    assert energy.sum() == pytest.approx(np.sum(one.amplitude**2) / 2, rel=1e-12)
    assert len(np.unique(many.heading)) == 5
    # First and second moment of cos-2s: s / (s + 1), and that times (s - 1) / (s + 2).
    assert energy @ np.cos(many.heading - 0.4) / energy.sum() == pytest.approx(4 / 5, rel=1e-12)
    assert energy @ np.cos(2 * (many.heading - 0.4)) / energy.sum() == pytest.approx(4 / 5 * 3 / 6, rel=1e-12)


def test_seed_names_the_realization() -> None:
    np.testing.assert_array_equal(sea(seed=5).phase, sea(seed=5).phase)
    assert not np.any(sea(seed=5).phase == sea(seed=6).phase)


def test_regular_wave_travels_along_its_heading() -> None:
    wave = regular_wave(amplitude=2.0, period=10.0, heading=np.pi / 2, water_depth=np.inf)
    length = 9.80665 * 100.0 / (2 * np.pi)
    assert elevation(wave, 0.0, 77.0, 0.0) == pytest.approx(2.0)
    assert elevation(wave, 2.5, 0.0, length / 4) == pytest.approx(2.0)  # the crest a quarter period later
    assert elevation(wave, 2.5, 0.0, 0.0) == pytest.approx(0.0, abs=1e-12)


def test_calm_water_is_flat() -> None:
    np.testing.assert_array_equal(elevation(calm_water(water_depth=450.0), np.arange(3.0), 1.0, 2.0), 0.0)


def test_arrays_are_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        sea().amplitude[0] = 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"significant_height": -8.0}, r"significant wave height is -8.0 m"),
        ({"significant_height": float("nan")}, "significant wave height is nan"),
        ({"peak_period": float("nan")}, "peak period of the waves is nan"),
        ({"spectrum": "pierson-moskowitz"}, "did you mean 'pierson_moskowitz'"),
        (
            {"highest_frequency": 0.06},
            r"0.02 to 0.06 Hz does not cover the spectral peak at 0.07143 Hz .* widen it",
        ),
        ({"lowest_frequency": 0.0}, "lowest wave frequency is 0"),
        ({"count": 0}, "number of wave components is 0"),
        ({"directions": 0}, "number of wave directions is 0"),
        ({"spreading_exponent": 0.0}, "spreading exponent of the waves is 0"),
        ({"heading": float("inf")}, "wave heading is inf"),
        ({"water_depth": 0.0}, "water depth is 0.0 m"),
        ({"seed": -1}, "random seed is -1"),
    ],
)
def test_bad_input_is_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        sea(**changes)  # type: ignore[arg-type]


def test_bad_components_are_refused() -> None:
    with pytest.raises(ScenarioError, match=r"wave components: phase has shape \(1,\)"):
        regular_wave(amplitude=1.0, period=8.0, heading=0.0, water_depth=9.0, phase=float("nan"))
    with pytest.raises(ScenarioError, match=r"wave amplitude is -1.0 m"):
        regular_wave(amplitude=-1.0, period=8.0, heading=0.0, water_depth=9.0)
