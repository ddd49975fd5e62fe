import subprocess
import sys

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import csd

from tlpsim.loads.errors import ScenarioError, SolverError, StepError
from tlpsim.loads.filters.arma import autoregressive_spectrum
from tlpsim.loads.wind.field import WindField, wind_field

FloatArray = NDArray[np.float64]

POSITION = np.array([[0, -30, 22], [0, 0, 22], [0, 30, 22], [0, -20, 40], [0, 20, 40], [0, 0, 70]], dtype=np.float64)
BAND = np.geomspace(0.002, 0.4, 400)


@pytest.fixture(scope="module")
def storm() -> WindField:
    """Six points on a platform in a wind of 40 m/s."""
    return wind_field(position=POSITION, heading=0.0, speed_10=40.0, roughness_length=0.005, seed=1)


@pytest.fixture(scope="module")
def record(storm: WindField) -> FloatArray:
    return np.array([storm.fluctuation(float(n)) for n in range(65_536)])


def deviation(field: WindField) -> tuple[FloatArray, FloatArray]:
    """Deviation of the model's auto spectra in dB, and of its coherency, from the targets, (nf, n) and (nf, n, n)."""
    model = autoregressive_spectrum(field.model, BAND, field.sampling_step)
    target = field.spectrum(BAND)
    auto = np.diagonal(model, axis1=1, axis2=2).real
    auto_target = np.diagonal(target, axis1=1, axis2=2)
    coherency = model / np.sqrt(auto[:, :, None] * auto[:, None, :])
    coherency_target = target / np.sqrt(auto_target[:, :, None] * auto_target[:, None, :])
    return 10.0 * np.log10(auto / auto_target), np.abs(coherency - coherency_target)


def test_order_25_fits_the_kaimal_spectra_of_six_points(storm: WindField) -> None:
    decibels, coherency = deviation(storm)
    # An independent implementation of the same fit found a maximum of 0.41 and a root mean square of 0.17 dB.
    assert np.abs(decibels).max() == pytest.approx(0.41, abs=0.005)
    assert np.sqrt(np.mean(decibels**2)) == pytest.approx(0.17, abs=0.005)
    assert coherency.max() < 0.05


@pytest.mark.parametrize(("spectrum", "largest"), [("harris", 0.23), ("api", 0.64)])
def test_order_25_fits_the_other_spectra(spectrum: str, largest: float) -> None:
    # What the independent implementation reached with a mixed model of order (3, 3) made from this one.
    field = wind_field(position=POSITION, heading=0.0, speed_10=40.0, spectrum=spectrum)
    decibels, _ = deviation(field)
    assert np.abs(decibels).max() < largest


def test_variance_held_by_the_samples_is_the_spectrum_below_nyquist(storm: WindField) -> None:
    # Kaimal in closed form: share below f is 1 - (1 + 50 f z / U)^(-2/3).
    height, speed = storm.points.height, storm.points.speed
    share = 1.0 - (1.0 + 50.0 * 0.5 * height / speed) ** (-2.0 / 3.0)
    np.testing.assert_allclose(storm.captured_variance, share, rtol=1e-4)
    model = autoregressive_spectrum(storm.model, np.linspace(0.0, 0.5, 20_001), 1.0)
    variance = np.trapezoid(np.diagonal(model, axis1=1, axis2=2).real, dx=0.5 / 20_000, axis=0)
    np.testing.assert_allclose(variance, storm.sampled_variance, rtol=1e-5)


def test_sampled_variance_and_mean_lie_within_their_statistical_bands(storm: WindField, record: FloatArray) -> None:
    count = len(record)
    frequency = np.linspace(0.0, 0.5, 20_001)
    density = np.diagonal(autoregressive_spectrum(storm.model, frequency, 1.0), axis1=1, axis2=2).real
    # Gaussian process: var(mean) = S(0) / (2 T) and var(variance) = (1 / T) int S² df, one-sided; four deviations.
    mean_deviation = np.sqrt(density[0] / (2.0 * count))
    variance_deviation = np.sqrt(np.trapezoid(density**2, frequency, axis=0) / count)
    assert np.all(np.abs(record.mean(axis=0)) < 4.0 * mean_deviation)
    assert np.all(np.abs(record.var(axis=0) - storm.sampled_variance) < 4.0 * variance_deviation)


@pytest.mark.parametrize(("first", "second"), [(0, 1), (3, 4), (1, 5)])
def test_sampled_coherency_is_that_of_the_model(storm: WindField, record: FloatArray, first: int, second: int) -> None:
    length = 512
    frequency, cross = csd(record[:, first], record[:, second], nperseg=length)
    auto = [csd(record[:, m], record[:, m], nperseg=length)[1].real for m in (first, second)]
    inside = slice(4, -8)  # the window's own width and the Nyquist end
    sampled = (cross / np.sqrt(auto[0] * auto[1]))[inside]
    model = autoregressive_spectrum(storm.model, frequency[inside], 1.0)
    target = model[:, first, second] / np.sqrt(model[:, first, first] * model[:, second, second])
    # Half-overlapped Hann segments: about 0.95 independent ones in every hop (36/19 fewer degrees than hops).
    segments = (2 * len(record) / length - 1) * 18.0 / 19.0
    spread = (1.0 - np.abs(target) ** 2) / np.sqrt(2.0 * segments)
    score = (sampled - target).real / spread
    assert np.sqrt(np.mean(score**2)) < 1.25  # neighbours are correlated, about 100 independent values: 4 deviations
    assert np.abs(score).max() < 5.0


def test_realization_does_not_depend_on_when_it_is_asked() -> None:
    def field() -> WindField:
        return wind_field(position=POSITION[:2], heading=0.0, speed_10=20.0, sampling_step=1.0, seed=3)

    fine, coarse, late = field(), field(), field()
    every_tenth = np.array([fine.fluctuation(0.1 * n) for n in range(3001)])
    every_second = np.array([coarse.fluctuation(float(n)) for n in range(301)])
    np.testing.assert_array_equal(every_tenth[::10], every_second)
    np.testing.assert_array_equal(late.fluctuation(300.0), every_second[-1])
    np.testing.assert_array_equal(late.fluctuation(2.5), every_tenth[25])  # back beyond the retained samples


def test_interpolated_record_meets_the_samples_and_is_smooth() -> None:
    field = wind_field(position=POSITION[:1], heading=0.0, speed_10=20.0, sampling_step=0.7, seed=3)
    before, at, after = (field.fluctuation(70.0 + shift) for shift in (-1e-6, 0.0, 1e-6))
    np.testing.assert_allclose(before + after, 2.0 * at, atol=1e-8)
    np.testing.assert_allclose(before, at, atol=1e-4)


def test_restored_state_continues_bit_for_bit() -> None:
    field = wind_field(position=POSITION, heading=0.0, speed_10=30.0, seed=5)
    field.fluctuation(123.4)
    state = field.get_state()
    times = 123.4 + 0.3 * np.arange(2000)
    expected = [field.fluctuation(time) for time in times]
    field.set_state(state)
    np.testing.assert_array_equal([field.fluctuation(time) for time in times], expected)
    other = wind_field(position=POSITION, heading=0.0, speed_10=30.0, seed=5)
    other.set_state(state)
    np.testing.assert_array_equal([other.fluctuation(time) for time in times], expected)


def test_another_process_makes_the_same_record() -> None:
    program = (
        "import numpy as np\n"
        "from tlpsim.loads.wind.force import wind_loads\n"
        "loads = wind_loads(speed_10=30.0, heading=0.5, seed=7)\n"
        "values = [loads.evaluate(0.3 * n, np.full(6, 0.01), 0.02) for n in range(400)]\n"
        "print(np.array(values).tobytes().hex())\n"
    )
    outputs = [
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert len(outputs[0]) > 400 * 6 * 16
    assert outputs[0] == outputs[1]


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match="did you mean 'harris'"):
        wind_field(position=POSITION, heading=0.0, speed_10=30.0, spectrum="haris")
    with pytest.raises(ScenarioError, match=r"wind points have shape \(6, 2\)"):
        wind_field(position=POSITION[:, :2], heading=0.0, speed_10=30.0)
    with pytest.raises(ScenarioError, match="wind heading is nan"):
        wind_field(position=POSITION, heading=float("nan"), speed_10=30.0)
    with pytest.raises(ScenarioError, match=r"sampling step .* is -1"):
        wind_field(position=POSITION, heading=0.0, speed_10=30.0, sampling_step=-1.0)
    with pytest.raises(SolverError, match="move coincident points apart"):
        wind_field(position=POSITION[[0, 0]], heading=0.0, speed_10=30.0)
    field = wind_field(position=POSITION[:1], heading=0.0, speed_10=30.0)
    for time in (-1.0, float("nan"), float("inf")):
        with pytest.raises(StepError, match="its record starts at 0 s"):
            field.fluctuation(time)
