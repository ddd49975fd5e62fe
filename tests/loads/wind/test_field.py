import subprocess
import sys
import warnings

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import csd

from tlpsim.loads.errors import ScenarioError, StepError
from tlpsim.loads.filters.arma import FilterFitWarning, Orders, spectrum
from tlpsim.loads.wind.coherence import Decay
from tlpsim.loads.wind.field import Gusts, StillAir, WindField, wind_field
from tlpsim.loads.wind.profile import Profile
from tlpsim.loads.wind.spectra import SPECTRA

FloatArray = NDArray[np.float64]

POSITION = np.array([[0, -30, 22], [0, 0, 22], [0, 30, 22], [0, -20, 40], [0, 20, 40], [0, 0, 70]], dtype=np.float64)
BAND = np.geomspace(0.002, 0.4, 400)


def gusty(position: FloatArray = POSITION, speed_10: float = 40.0, heading: float = 0.0, **gusts: object) -> WindField:
    field = wind_field(
        position=position,
        area=np.full(len(position), 500.0),
        heading=heading,
        profile=Profile(speed_10=speed_10, roughness_length=0.005),
        gusts=Gusts(**gusts),  # type: ignore[arg-type]
    )
    assert isinstance(field, WindField)
    return field


@pytest.fixture(scope="module")
def storm() -> WindField:
    """Six points on a platform in a wind of 40 m/s, by the paper's AR(25) and ARMA(3, 3)."""
    return gusty(seed=1)


@pytest.fixture(scope="module")
def record(storm: WindField) -> FloatArray:
    return np.array([storm.fluctuation(float(n)) for n in range(65_536)])


def deviation(field: WindField) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Deviation of the model: of auto spectra in dB (nf, n), of cross-spectra and of root coherence (nf, n, n)."""
    model, target = spectrum(field.model, BAND), field.spectrum(BAND)
    auto = np.diagonal(model, axis1=1, axis2=2).real
    auto_target = np.diagonal(target, axis1=1, axis2=2)
    scale = np.sqrt(auto[:, :, None] * auto[:, None, :])
    scale_target = np.sqrt(auto_target[:, :, None] * auto_target[:, None, :])
    cross = np.abs(model - target) / scale_target
    cross[:, np.arange(len(POSITION)), np.arange(len(POSITION))] = 0.0
    root_coherence = np.abs(np.abs(model) / scale - target / scale_target)
    return 10.0 * np.log10(auto / auto_target), cross, root_coherence


def test_the_papers_orders_fit_the_kaimal_spectra_of_six_points(storm: WindField) -> None:
    # An independent implementation found 0.56 and 0.14 dB, 0.080, 0.032 and -0.2 % of variance.
    decibels, cross, coherence = deviation(storm)
    assert np.abs(decibels).max() < 0.6
    assert np.sqrt(np.mean(decibels**2)) < 0.2
    assert cross.max() < 0.09
    assert coherence.max() < 0.04
    assert storm.model.orders == (3, 3)
    assert storm.certificate.trusted


@pytest.mark.parametrize(("name", "largest"), [("harris", 0.25), ("api", 0.65)])
def test_they_fit_other_spectra(name: str, largest: float) -> None:
    # What the independent implementation reached is 0.23 and 0.64 dB.
    decibels, _, _ = deviation(gusty(spectrum=name))
    assert np.abs(decibels).max() < largest


@pytest.mark.parametrize("name", SPECTRA)
@pytest.mark.parametrize("coherence", ["davenport", "npd"])
def test_every_spectrum_is_sampled_with_its_variance(name: str, coherence: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FilterFitWarning)
        field = gusty(POSITION[[0, 5]], spectrum=name, coherence=coherence, sampling_step=2.0)
    frequency = np.linspace(0.0, 0.25, 20_001)
    target = np.diagonal(field.spectrum(frequency), axis1=1, axis2=2)
    expected = np.trapezoid(target, dx=0.25 / 20_000, axis=0)
    # The trapezoids of the fit's coarser grid leave some 1e-4 at the steep foot of NPD and Davenport.
    np.testing.assert_allclose(field.sampled_variance, expected, rtol=2e-3)


def test_a_poor_fit_warns_each_time_with_the_orders_that_would_do() -> None:
    for _ in range(2):
        with pytest.warns(FilterFitWarning, match=r"gusts, spectrum 'davenport'.*limit.*would do"):
            gusty(POSITION[[0, 1]], spectrum="davenport", sampling_step=2.0)


def test_a_good_fit_does_not_warn() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gusty()


def test_orders_are_those_asked_for() -> None:
    field = gusty(POSITION[:3], orders=Orders(long=40, autoregressive=4, moving_average=2))
    assert field.model.orders == (4, 2)


def test_coincident_points_have_the_same_speed() -> None:
    position = POSITION[[0, 0, 4]]
    field = gusty(position, seed=3)
    values = np.array([field.fluctuation(0.7 * n) for n in range(500)])
    np.testing.assert_allclose(values[:, 0], values[:, 1], atol=1e-9)
    assert np.abs(values[:, 0] - values[:, 2]).max() > 1.0


def test_full_coherence_gives_one_gust_everywhere() -> None:
    field = gusty(spectrum="harris", decay=Decay(lateral=0.0, vertical=0.0), seed=3)
    values = np.array([field.fluctuation(0.7 * n) for n in range(500)])
    np.testing.assert_allclose(values, np.tile(values[:, :1], (1, 6)), atol=1e-9)
    assert values.std() > 1.0


@pytest.mark.parametrize("case", ["no decay", "one place, two areas"])
def test_fully_coherent_points_of_different_spectra_are_fitted_too(case: str) -> None:
    # Kaimal's spectra of two heights, or one under the admittances of two areas, in one gust; without the loosening
    # of the coherence by a hundredth the errors are 8 and 4 dB.
    no_decay = Gusts(decay=Decay(lateral=0.0, vertical=0.0))
    two_areas = Gusts(admittance="davenport")
    field = wind_field(
        position=POSITION[[1, 5]] if case == "no decay" else POSITION[[1, 1]],
        area=np.array([400.0, 1600.0]),
        heading=0.0,
        profile=Profile(speed_10=25.0),
        gusts=no_decay if case == "no decay" else two_areas,
    )
    assert isinstance(field, WindField)
    assert field.certificate.auto_error_max < 1.2
    target = field.spectrum(np.array([0.05]))[0]
    assert target[0, 1] == pytest.approx(0.99 * np.sqrt(target[0, 0] * target[1, 1]))


def test_ordinary_coherence_is_left_as_it_is(storm: WindField) -> None:
    frequency = np.array([0.01])
    target = storm.spectrum(frequency)[0]
    distance = np.hypot(16.0 * 30.0, 0.0)
    expected = np.exp(-frequency[0] * distance / storm.speed[0])
    assert target[0, 1] / np.sqrt(target[0, 0] * target[1, 1]) == pytest.approx(expected)


def test_no_wind_is_still_air() -> None:
    field = wind_field(
        position=POSITION, area=np.full(6, 500.0), heading=0.0, profile=Profile(speed_10=0.0), gusts=Gusts()
    )
    assert isinstance(field, StillAir)
    np.testing.assert_array_equal(field.fluctuation(12.3), np.zeros(6))
    np.testing.assert_array_equal(field.speed + field.sampled_variance, np.zeros(6))
    field.set_state(field.get_state())
    with pytest.raises(StepError, match="its record starts at 0 s"):
        field.fluctuation(-1.0)


def test_variance_held_by_the_samples_is_the_spectrum_below_nyquist(storm: WindField) -> None:
    # Kaimal in closed form: share below f is 1 - (1 + 50 f z / U)^(-2/3).
    share = 1.0 - (1.0 + 50.0 * 0.5 * POSITION[:, 2] / storm.speed) ** (-2.0 / 3.0)
    np.testing.assert_allclose(storm.captured_variance, share, rtol=2e-4)
    model = spectrum(storm.model, np.linspace(0.0, 0.5, 20_001))
    variance = np.trapezoid(np.diagonal(model, axis1=1, axis2=2).real, dx=0.5 / 20_000, axis=0)
    np.testing.assert_allclose(variance, storm.sampled_variance, rtol=1e-5)


def test_sampled_variance_and_mean_lie_within_their_statistical_bands(storm: WindField, record: FloatArray) -> None:
    count = len(record)
    frequency = np.linspace(0.0, 0.5, 20_001)
    density = np.diagonal(spectrum(storm.model, frequency), axis1=1, axis2=2).real
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
    model = spectrum(storm.model, frequency[inside])
    target = model[:, first, second] / np.sqrt(model[:, first, first] * model[:, second, second])
    # Half-overlapped Hann segments: about 0.95 independent ones in every hop (36/19 fewer degrees than hops).
    segments = (2 * len(record) / length - 1) * 18.0 / 19.0
    spread = (1.0 - np.abs(target) ** 2) / np.sqrt(2.0 * segments)
    score = (sampled - target).real / spread
    assert np.sqrt(np.mean(score**2)) < 1.25  # neighbours are correlated, about 100 independent values: 4 deviations
    assert np.abs(score).max() < 5.0


def test_realization_does_not_depend_on_when_it_is_asked() -> None:
    def field() -> WindField:
        return gusty(POSITION[:2], speed_10=20.0, seed=3)

    fine, coarse, late = field(), field(), field()
    every_tenth = np.array([fine.fluctuation(0.1 * n) for n in range(3001)])
    every_second = np.array([coarse.fluctuation(float(n)) for n in range(301)])
    np.testing.assert_array_equal(every_tenth[::10], every_second)
    np.testing.assert_array_equal(late.fluctuation(300.0), every_second[-1])
    np.testing.assert_array_equal(late.fluctuation(2.5), every_tenth[25])  # back beyond the retained samples


def test_interpolated_record_meets_the_samples_and_is_smooth() -> None:
    field = gusty(POSITION[:1], speed_10=20.0, sampling_step=0.7, seed=3)
    before, at, after = (field.fluctuation(70.0 + shift) for shift in (-1e-6, 0.0, 1e-6))
    np.testing.assert_allclose(before + after, 2.0 * at, atol=1e-8)
    np.testing.assert_allclose(before, at, atol=1e-4)


def test_restored_state_continues_bit_for_bit() -> None:
    field = gusty(seed=5)
    field.fluctuation(123.4)
    state = field.get_state()
    times = 123.4 + 0.3 * np.arange(2000)
    expected = [field.fluctuation(time) for time in times]
    field.set_state(state)
    np.testing.assert_array_equal([field.fluctuation(time) for time in times], expected)
    other = gusty(seed=5)
    other.set_state(state)
    np.testing.assert_array_equal([other.fluctuation(time) for time in times], expected)


def test_another_process_makes_the_same_record() -> None:
    program = (
        "import numpy as np\n"
        "from tlpsim.loads.wind.field import Gusts\n"
        "from tlpsim.loads.wind.force import wind_loads\n"
        "from tlpsim.loads.wind.profile import Profile\n"
        "loads = wind_loads(heading=0.5, profile=Profile(speed_10=40.0), gusts=Gusts(seed=7))\n"
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
        gusty(spectrum="haris")
    with pytest.raises(ScenarioError, match="wind coherence 'nbd'"):
        gusty(coherence="nbd")
    with pytest.raises(ScenarioError, match="aerodynamic admittance 'kareem'"):
        gusty(admittance="kareem")
    with pytest.raises(ScenarioError, match=r"wind points have shape \(6, 2\)"):
        gusty(POSITION[:, :2])
    with pytest.raises(ScenarioError, match="wind heading is nan"):
        gusty(heading=float("nan"))
    with pytest.raises(ScenarioError, match="mean wind speed at 10 m is -3"):
        gusty(speed_10=-3.0)
    with pytest.raises(ScenarioError, match=r"-1"):
        gusty(sampling_step=-1.0)
    with pytest.raises(ScenarioError, match="random seed is -1"):
        gusty(seed=-1)
    field = gusty(POSITION[:1])
    for time in (-1.0, float("nan"), float("inf")):
        with pytest.raises(StepError, match="its record starts at 0 s"):
            field.fluctuation(time)
