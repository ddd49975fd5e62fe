"""The filtered sea against theory (|H|² S), against FFT filtering of the same samples, and against itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError, StepError
from tlpsim.loads.filters.arma import Orders
from tlpsim.loads.filters.certificate import FilterFitWarning
from tlpsim.loads.filters.convolution import ToeplitzKernels, floored, kernel_error, kernel_response, quadrature
from tlpsim.loads.filters.model import spectrum
from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import divide, inertia_transfer, strip_velocity_transfer
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.elevation import ArmaSea, transition, voids, window_half_length
from tlpsim.loads.waves.field import WaveComponents
from tlpsim.loads.waves.sea import SeaState
from tlpsim.loads.waves.spectra import SpectrumTable, pierson_moskowitz

FloatArray = NDArray[np.float64]
HEADING = np.deg2rad(21.6)
REACH = 95.0
MEMBERS = issc_members()
STRIPS = divide(MEMBERS, 5.0, 1025.0)
HEIGHT = np.repeat(STRIPS.position[:, 2], 2)


def sea_state(**changes: object) -> SeaState:
    parameters: dict[str, object] = {
        "spectrum": "pierson_moskowitz",
        "significant_height": 7.08,
        "peak_period": 14.52,
        "heading": HEADING,
        "water_depth": 450.0,
    }
    return SeaState(**(parameters | changes))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def sea() -> ArmaSea:
    return ArmaSea(sea_state(), reach=REACH, seed=1)


@pytest.fixture(scope="module")
def loads(sea: ArmaSea) -> WaveLoads:
    return WaveLoads(sea=sea, members=MEMBERS)


def unit_waves(frequency: FloatArray, heading: float = HEADING) -> WaveComponents:
    one = np.ones(len(frequency))
    return WaveComponents(
        frequency=frequency,
        amplitude=one,
        phase=0.0 * one,
        wavenumber=wavenumber(2.0 * np.pi * frequency, 450.0),
        heading=heading * one,
        water_depth=450.0,
        gravity=9.80665,
    )


def transfer(frequency: FloatArray, offset: float = 0.0, heading: float = HEADING) -> NDArray[np.complex128]:
    """Elevation, six forces and strip velocities at an offset along the waves, shape (rows, nf)."""
    waves = unit_waves(frequency, heading)
    rows = [
        np.ones((1, len(frequency))),
        inertia_transfer(MEMBERS, waves),
        strip_velocity_transfer(STRIPS, waves),
    ]
    return np.vstack(rows) * np.exp(-1j * waves.wavenumber * offset)


# The table at the head of the module: half of the window, then errors near the surface and of the pontoons without
# offset, and the same at 20 m.
DOCUMENTED = {
    20.0: (6.4e-2, 9.4e-5, 1.7e-1, 2.2e-3),
    30.0: (7.3e-3, 4.2e-5, 4.4e-2, 4.7e-5),
    40.0: (9.0e-4, 5.8e-6, 5.8e-3, 6.5e-6),
    50.0: (4.1e-4, 1.3e-6, 8.9e-4, 1.6e-6),
    60.0: (2.3e-4, 6.2e-7, 3.8e-4, 7.3e-7),
}


@pytest.mark.parametrize("half", DOCUMENTED)
def test_documented_kernel_errors(half: float) -> None:
    state, step = sea_state(), 0.5
    count = round(half / step)
    grid = (np.arange(600) + 0.5) / 600.0
    fine = (np.arange(2000) + 0.5) / 2000.0
    kernels = ToeplitzKernels(floored(state.density(grid)), grid, step, count, count)
    found = []
    for offset in (0.0, 20.0):
        weights = kernels.kernels((transfer(grid, offset) * transition(grid, 0.35)).T)
        exact = (transfer(fine, offset) * transition(fine, 0.35)).T
        error = kernel_error(weights, exact, fine, state.density(fine), step, count)[7:]
        found += [error[HEIGHT > -5.0].max(), error[HEIGHT < -29.0].max()]
    np.testing.assert_allclose(found, DOCUMENTED[half], rtol=0.05)


@pytest.mark.parametrize(
    ("changes", "step"),
    [
        ({}, 0.5),
        ({"spectrum": "jonswap", "significant_height": 4.0, "peak_period": 8.0}, 0.5),
        ({"spectrum": "jonswap", "significant_height": 12.0, "peak_period": 14.0}, 1.0),
        ({"spectrum": "torsethaugen", "significant_height": 4.0, "peak_period": 16.0}, 0.5),
        ({"spectrum": "torsethaugen", "significant_height": 4.0, "peak_period": 8.0}, 0.5),
    ],
)
@pytest.mark.filterwarnings("ignore::tlpsim.loads.filters.certificate.FilterFitWarning")
@pytest.mark.parametrize("offset", [0.0, 20.0, -30.0])
def test_forces_have_the_theoretical_standard_deviation(changes: dict[str, object], step: float, offset: float) -> None:
    one = ArmaSea(sea_state(**changes), sampling_step=step, reach=REACH, seed=1)
    nyquist = 0.5 / step
    fine = nyquist * (np.arange(4000) + 0.5) / 4000.0
    response = kernel_response(one.kernels(transfer(one.frequency, offset)), fine, step, one.half).T
    made = np.abs(response) ** 2 @ (spectrum(one.model, fine)[:, 0, 0].real * quadrature(fine))
    asked = np.abs(transfer(fine)) ** 2 @ (one.state.density(fine) * quadrature(fine) * (fine < 0.35))
    significant = asked > 1e-12 * asked[1]  # a strip along the waves has no velocity across
    ratio = np.sqrt(made[significant] / asked[significant])
    # Elevation, all six forces, all strips. Largest measured: 0.24 % (heave, from the white floor); 1 % is wanted.
    np.testing.assert_allclose(ratio, 1.0, atol=0.003)


@pytest.mark.filterwarnings("ignore::tlpsim.loads.filters.certificate.FilterFitWarning")
@pytest.mark.parametrize(
    ("shape", "height", "period"), [("pierson_moskowitz", 7.08, 14.52), ("torsethaugen", 4.0, 16.0)]
)
def test_white_floor_would_be_felt_in_heave(shape: str, height: float, period: float) -> None:
    one = ArmaSea(sea_state(spectrum=shape, significant_height=height, peak_period=period), reach=REACH, seed=1)
    fine = (np.arange(2000) + 0.5) / 2000.0
    made = spectrum(one.model, fine)[:, 0, 0].real * quadrature(fine)
    heave = np.abs(transfer(fine)[3]) ** 2
    response = np.abs(kernel_response(one.kernels(transfer(one.frequency)[3:4]), fine, 0.5, one.half)[:, 0]) ** 2
    low = fine < 0.03
    without = np.sqrt(heave[low] @ made[low] / (heave @ made))
    left = np.sqrt(response[low] @ made[low] / (response @ made))
    # The figures at the head of the module; what is left is a third of it, 1 % of 1 in variance at most.
    assert 0.08 < without < 0.32
    assert left < min(0.4 * without, 0.1)


def filtered(sea: ArmaSea, first: int, count: int, fraction: float, offset: float) -> FloatArray:
    """Rows of `transfer` at the times (first + n + fraction) step by the FFT of a long record, shape (rows, count)."""
    margin = 1000
    record = sea.samples(first - margin, count + 2 * margin)[:, 0]
    frequency = np.fft.rfftfreq(len(record), sea.sampling_step)
    frequency[0] = 1e-9
    gain = transition(frequency, sea.state.highest_frequency) * voids(frequency, sea.state, 0.5 / sea.sampling_step)
    shift = np.exp(2j * np.pi * frequency * fraction * sea.sampling_step)
    result = np.fft.irfft(np.fft.rfft(record) * gain * shift * transfer(frequency, offset), len(record))
    return np.asarray(result[:, margin : margin + count])


@pytest.mark.parametrize(("fraction", "offset"), [(0.0, 0.0), (0.4, 0.0), (0.0, 20.0), (0.6, -20.0)])
def test_loads_in_time_against_fft_filtering_of_the_same_record(sea: ArmaSea, fraction: float, offset: float) -> None:
    loads = WaveLoads(sea=sea, members=MEMBERS)
    exact = filtered(sea, 2000, 600, fraction, offset)
    place = np.array([offset * np.cos(HEADING), offset * np.sin(HEADING), 0.0, 0.0, 0.0, 0.0])
    found = np.empty((7, 600))
    for n in range(600):
        forces = loads.evaluate((2000 + n + fraction) * sea.sampling_step, place, np.zeros(6))
        found[0, n], found[1:, n] = forces.elevation, forces.diffraction
    error = np.sqrt(np.mean((found - exact[:7]) ** 2, axis=1) / np.mean(exact[:7] ** 2, axis=1))
    # The error of a finite kernel. Measured: 3e-4, heave (for the void below the peak) 1.2e-3.
    assert error.max() < 2e-3


@given(time=st.floats(0.0, 500.0), offset=st.floats(-30.0, 30.0), across=st.floats(-30.0, 30.0))
@settings(max_examples=25, deadline=None)
def test_displaced_position_is_the_kernel_shifted_to_it(
    sea: ArmaSea, loads: WaveLoads, time: float, offset: float, across: float
) -> None:
    # Against kernels made for this very place and time, convolved with the samples.
    number = int(np.floor(time / sea.sampling_step + 0.5e-9))
    moment = 2j * np.pi * sea.frequency * (time - number * sea.sampling_step)
    weights = sea.kernels(transfer(sea.frequency, offset)[:7] * np.exp(moment))
    window = sea.samples(number - sea.half, 2 * sea.half + 1)[:, 0]
    expected = weights[:, ::-1] @ window
    cosine, sine = np.cos(HEADING), np.sin(HEADING)
    along = np.array([offset * cosine - across * sine, offset * sine + across * cosine])
    forces = loads.evaluate(time, np.concatenate([along, np.zeros(4)]), np.zeros(6))
    found = np.concatenate([[forces.elevation], forces.diffraction])
    scale = np.abs(transfer(np.array([0.08])))[:7, 0] * 7.08 / 4
    # Times are resolved to 1e-9 of a step.
    assert np.all(np.abs(found - expected) < 1e-7 * scale)


def test_value_at_a_sample_is_the_kernel_on_the_samples(sea: ArmaSea) -> None:
    weights = sea.kernels(transfer(sea.frequency)[:7])
    window = sea.samples(100 - sea.half, 2 * sea.half + 1)[:, 0]
    forces = WaveLoads(sea=sea, members=MEMBERS).evaluate(50.0, np.zeros(6), np.zeros(6))
    found = np.concatenate([[forces.elevation], forces.diffraction])
    np.testing.assert_allclose(found, weights[:, ::-1] @ window, rtol=1e-9)


def test_another_force_can_take_the_place_of_the_members(sea: ArmaSea) -> None:
    twice = WaveLoads(sea=sea, members=MEMBERS, excitation=lambda waves: 2.0 * inertia_transfer(MEMBERS, waves))
    once = WaveLoads(sea=sea, members=MEMBERS)
    moved = np.array([3.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    pair = [loads.evaluate(20.0, moved, np.zeros(6)).diffraction for loads in (once, twice)]
    np.testing.assert_allclose(pair[1], 2.0 * pair[0], rtol=1e-12)


def test_values_do_not_depend_on_what_was_asked_before(sea: ArmaSea) -> None:
    other = ArmaSea(sea_state(), reach=REACH, seed=1)
    times = [5000.0, 0.0, 3.3, 12.5, 9999.7, 3.3]
    for time in times:
        assert other.amplitudes(time).tobytes() == sea.amplitudes(time).tobytes()
    assert not np.array_equal(ArmaSea(sea_state(), reach=REACH, seed=2).amplitudes(3.3), sea.amplitudes(3.3))


def test_state_set_back_repeats_every_value_exactly() -> None:
    one = ArmaSea(sea_state(directions=3), reach=REACH, seed=1)
    one.amplitudes(700.0)
    state = one.get_state()
    later = [one.amplitudes(700.0 + 0.7 * k).tobytes() for k in range(900)]
    other = ArmaSea(sea_state(directions=3), reach=REACH, seed=1)
    for restored in (one, other):
        restored.set_state(state)
        assert [restored.amplitudes(700.0 + 0.7 * k).tobytes() for k in range(900)] == later
    with pytest.raises(ScenarioError, match="state of the waves has 3 directions; it must be 1"):
        ArmaSea(sea_state(), reach=REACH, seed=1).set_state(state)


def test_directions_are_independent_and_share_the_energy() -> None:
    one = ArmaSea(sea_state(directions=3, spreading_exponent=5.0), reach=0.0, seed=4)
    record = one.samples(0, 40_000)
    share = one.state.spread().share
    # 20 000 s of waves of 14.5 s with a relative bandwidth near 0.5 hold about 1000 independent values.
    np.testing.assert_allclose(record.var(axis=0), share * 7.08**2 / 16, rtol=0.15)
    assert np.abs(np.corrcoef(record.T) - np.eye(3)).max() < 0.1
    assert record.sum(axis=1).var() == pytest.approx(7.08**2 / 16, rel=0.1)


@pytest.mark.parametrize("directions", [1, 5])
def test_current_and_depth_do_not_matter_where_waves_are_short(directions: int) -> None:
    deep = ArmaSea(sea_state(water_depth=np.inf, directions=directions, peak_period=8.0), reach=50.0, seed=1)
    finite = ArmaSea(sea_state(directions=directions, peak_period=8.0), reach=50.0, seed=1)
    # tanh(kd) of 450 m differs from one by 1e-8 at the longest waves that matter.
    np.testing.assert_allclose(deep.amplitudes(40.0), finite.amplitudes(40.0), rtol=1e-9)


def test_window_grows_as_the_slowness_of_the_shortest_waves() -> None:
    # In deep water the group speed is g / 2 omega.
    slowness = 2.0 * 2.0 * np.pi * 0.35 / 9.80665
    assert window_half_length(sea_state(), 100.0) == pytest.approx(100.0 * slowness + 1.0 / 0.07, rel=1e-6)


def test_certificate_and_orders_come_with_the_sea() -> None:
    one = ArmaSea(sea_state(), orders=Orders(long=80, autoregressive=10, moving_average=9), seed=1)
    assert one.model.orders == (10, 9)
    assert one.certificate.trusted


def test_poor_fit_warns_every_time_with_what_it_is_of() -> None:
    frequency = np.linspace(0.03, 0.9, 300)
    table = SpectrumTable(frequency=frequency, density=pierson_moskowitz(frequency, 5.0, 10.0))
    for _ in range(2):  # the filter is made once, and is as poor the second time
        with pytest.warns(FilterFitWarning, match="elevation, spectrum of the table: .* misses its spectrum"):
            ArmaSea(sea_state(table=table), orders=Orders(long=10, autoregressive=2, moving_average=1))


def test_bad_input_is_refused(sea: ArmaSea) -> None:
    with pytest.raises(ScenarioError, match=r"Nyquist frequency 0\.3333 Hz lies below 0\.385 Hz.*at most 1\.3 s"):
        ArmaSea(sea_state(), sampling_step=1.5)
    with pytest.raises(ScenarioError, match="sampling step of the waves is 0"):
        ArmaSea(sea_state(), sampling_step=0.0)
    with pytest.raises(ScenarioError, match=r"reach of the waves is -1\.0 m"):
        ArmaSea(sea_state(), reach=-1.0)
    with pytest.raises(StepError, match=r"waves asked for time -5\.0 s"):
        sea.amplitudes(-5.0)
    with pytest.raises(StepError, match="nan"):
        sea.amplitudes(float("nan"))
