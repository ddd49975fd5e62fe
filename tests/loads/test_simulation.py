"""The loop over platform, wind and waves: its two forms against each other, its order, and a closed form."""

import dataclasses
import warnings
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads import issc_tlp, simulation
from tlpsim.loads.errors import StepError
from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.platform.body import mass_matrix
from tlpsim.loads.platform.memory import DiscreteMemory, Memory, convolution, recursion
from tlpsim.loads.platform.motion import PlatformModel
from tlpsim.loads.simulation import CoupledModel, Record, simulate, start
from tlpsim.loads.waves.current import uniform_current
from tlpsim.loads.waves.elevation import ArmaSea
from tlpsim.loads.waves.field import calm_water, wave_components
from tlpsim.loads.waves.sea import Sea, SeaState
from tlpsim.loads.wind.field import StillAir
from tlpsim.loads.wind.force import WindLoads, wind_loads
from tlpsim.loads.wind.profile import Profile
from tlpsim.loads.wind.segments import Boxes, Segments, default_segments, projected_segments

FloatArray = NDArray[np.float64]

STEP = 0.1
STATE = SeaState(significant_height=7.0, peak_period=14.0, heading=0.4, water_depth=450.0)
PROFILE = Profile(name="logarithmic", speed_10=25.0, roughness_length=0.001, exponent=0.12)
HEADING = 0.6


@dataclasses.dataclass(frozen=True)
class Taps:
    """Radiation that dies out as exp(-t / 9 s), in surge and pitch with their coupling, in sway, heave and yaw."""

    length: int

    @property
    def longest_step(self) -> float:
        return 1.0

    def discrete(self, step: float) -> DiscreteMemory:
        pairs = np.array([[0, 0], [0, 4], [4, 0], [4, 4], [1, 1], [2, 2], [5, 5]], dtype=np.int64)
        size = np.array([4e5, 1e5, 1e5, 1e7, 4e5, 1e6, 5e8])
        lags = step * np.arange(1, self.length + 1)
        taps = step * size * (np.exp(-lags / 9.0) * np.cos(0.5 * lags))[:, None]
        return convolution(np.diag([1e5, 1e5, 1e5, 1e7, 1e7, 1e8]), pairs, taps)


class States:
    """A recursive filter of surge."""

    longest_step = 1.0

    def discrete(self, step: float) -> DiscreteMemory:
        drive = np.zeros((2, 6))
        drive[0, 0] = 0.5 * step
        transition = np.array([[0.97, -0.03], [0.03, 0.97]])
        output = np.zeros((6, 2))
        output[0] = [3e5, 1e5]
        return recursion(np.zeros((6, 6)), transition, drive, output)


def platform(memory: Memory | None = None, **changes: object) -> PlatformModel:
    model = issc_tlp.platform()
    return dataclasses.replace(model, **({"memory": memory} if memory else {}), **changes)  # type: ignore[arg-type]


def waves(sea: Sea, **options: object) -> WaveLoads:
    return WaveLoads(sea=sea, members=issc_members(), current_speed=0.5, current_heading=1.5, **options)  # type: ignore[arg-type]


def arma(step: float = 0.5, **changes: object) -> ArmaSea:
    return ArmaSea(dataclasses.replace(STATE, **changes), sampling_step=step, seed=3)  # type: ignore[arg-type]


def wind(decomposition: str = "full", segments: Segments | None = None) -> WindLoads:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return wind_loads(heading=HEADING, profile=PROFILE, decomposition=decomposition, segments=segments)


def deck() -> Segments:
    """Two parts of a box, whose area changes with yaw."""
    box = Boxes(
        position=np.array([[8.0, 5.0, 40.0]]), size=np.array([[70.0, 20.0, 12.0]]), shape_coefficient=np.ones(1)
    )
    return projected_segments(box, HEADING)


@dataclasses.dataclass(frozen=True)
class Drift:
    """Two quadratic filters of a sea of `count` components."""

    count: int

    @property
    def transfer(self) -> NDArray[np.complex128]:
        return np.exp(1j * np.outer([1.0, 2.0], np.arange(self.count)))

    @property
    def weight(self) -> FloatArray:
        return np.outer([1e4, 5e3, 1e3, 1e5, 1e5, 1e6], [1.0, -0.3])

    @property
    def constant(self) -> FloatArray:
        return np.array([2e4, 1e4, 0.0, 0.0, 0.0, 1e6])


def drifting() -> WaveLoads:
    sea = arma()
    return waves(sea, drift=Drift(len(sea.wavenumber)))


def in_current() -> WaveLoads:
    return WaveLoads(sea=arma(), members=issc_members(), current=uniform_current(0.5, 0.4), doppler=True)


def together(records: list[Record]) -> dict[str, FloatArray]:
    names = [each.name for each in dataclasses.fields(Record) if each.name not in ("first", "wave_parts")]
    whole = {name: np.concatenate([getattr(record, name) for record in records]) for name in names}
    for part in records[0].wave_parts:
        whole[part] = np.concatenate([record.wave_parts[part] for record in records])
    return whole


def run(model: CoupledModel, steps: int, step: float = STEP, **options: object) -> dict[str, FloatArray]:
    state = start(model, np.array([5.0, 3.0, -0.05, 0.0, 0.0, 0.05]), np.zeros(6))
    return together(list(simulate(model, state, step=step, steps=steps, **options)))  # type: ignore[arg-type]


CASES: dict[str, Callable[[], CoupledModel]] = {
    "storm with a long memory": lambda: CoupledModel(platform=platform(Taps(300)), wind=wind(), waves=waves(arma())),
    "short memory, expanded wind": lambda: CoupledModel(platform=platform(Taps(90)), wind=wind("expanded")),
    "recursive memory, linear wind": lambda: CoupledModel(platform=platform(States()), wind=wind("linear")),
    "boxes in the wind": lambda: CoupledModel(platform=platform(), wind=wind(segments=deck())),
    "spread sea, drag to the surface": lambda: CoupledModel(
        platform=platform(), waves=waves(arma(directions=3), splash=True)
    ),
    "harmonic sea": lambda: CoupledModel(platform=platform(), waves=waves(wave_components(STATE, count=50))),
    "sampling step that does not fit": lambda: CoupledModel(platform=platform(), waves=waves(arma(0.73))),
    "drift": lambda: CoupledModel(platform=platform(), waves=drifting()),
    "waves on a current": lambda: CoupledModel(platform=platform(), waves=in_current()),
    "waves at the origin": lambda: CoupledModel(platform=platform(), waves=waves(arma(), displaced_position=False)),
    "held": lambda: CoupledModel(platform=platform(free=np.arange(6) != 5), waves=waves(arma())),
    "constant load alone": lambda: CoupledModel(platform=platform(), external=np.array([1e6, 0, 0, 0, 0, 1e7])),
}


@pytest.mark.parametrize("case", CASES)
def test_the_compiled_form_repeats_the_plain_one(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Over several blocks of steps and of the memory; they differ by rounding, which sums in another order bring."""
    monkeypatch.setattr(simulation, "BLOCK", 150)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        found = run(CASES[case](), 400)
    plain = run(CASES[case](), 400, compiled=False)
    assert np.ptp(plain["position"], axis=0).max() > 0.1
    for name, values in plain.items():
        size = np.abs(values).max(axis=0)
        np.testing.assert_allclose(found[name], values, rtol=0.0, atol=1e-8 * size.max(initial=1e-300), err_msg=name)


def test_corrections_are_the_same_in_both_forms() -> None:
    one, other = (run(CASES["storm with a long memory"](), 200, corrections=2, compiled=form) for form in (True, False))
    np.testing.assert_allclose(one["position"], other["position"], rtol=0.0, atol=1e-9)


def test_forces_are_those_of_the_platforms_own_place() -> None:
    """The recorded forces against the models asked anew for the recorded position and velocity.

    They miss by eq. (1): at 2 rad/s by 5/12 (omega h)³, 3e-3, of the velocities' part of the force; by rounding where
    corrections have converged.
    """
    for corrections, tolerance in ((0, 3e-3), (4, 1e-9)):
        model = CASES["storm with a long memory"]()
        record = run(model, 300, corrections=corrections)
        assert model.waves is not None
        assert model.wind is not None
        for k in (0, 7, 150, 300):
            position, velocity = record["position"][k], record["velocity"][k]
            forces = model.waves.evaluate(k * STEP, position, velocity)
            gust = model.wind.evaluate(k * STEP, velocity, position[5])
            for name, one in (("viscous", forces.viscous), ("diffraction", forces.diffraction), ("wind_force", gust)):
                np.testing.assert_allclose(record[name][k], one, rtol=0.0, atol=tolerance * np.abs(one).max())
            speed = model.wind.wind_speed(k * STEP)
            assert record["wind_speed"][k] == pytest.approx(speed, rel=1e-12)


def test_the_error_of_the_coupling_is_of_third_order() -> None:
    """Half the step leaves an eighth of the difference from converged corrections; of second order it were a quarter.

    Drag of a current of 3 m/s, so that the coupling by the velocity is strong; no wind and no waves, whose short waves
    are far from the limit of small steps.
    """
    errors = []
    loads = WaveLoads(sea=calm_water(water_depth=450.0), members=issc_members(), current_speed=3.0, current_heading=0.7)
    model = CoupledModel(platform=platform(), waves=loads)
    for step in (0.1, 0.05):
        steps = round(60.0 / step)
        difference = run(model, steps, step)["position"] - run(model, steps, step, corrections=4)["position"]
        errors.append(np.abs(difference).max(axis=0))
    # Within the 30 % that steps of 0.1 s on a heave of 1.8 s leave of the limit.
    assert np.all(errors[0][:2] > 5.6 * errors[1][:2])


def test_drag_takes_the_amplitude_of_a_free_motion() -> None:
    """Quadratic damping b v |v| on a mass m, to first order in b a / m: 1/a grows by 4 b omega t / (3 pi m).

    Surge alone in still "air" as heavy as water, b = sum 0.5 rho A C. At 1 m the tethers' restoring force is linear to
    1e-5. The second order in b a / m, 2 %, of a decay of 20 % is 0.4 %.
    """
    areas = default_segments(0.0)
    air = WindLoads(segments=areas, field=StillAir(len(areas.area)), heading=0.0, air_density=1000.0)
    model = CoupledModel(platform=platform(free=np.arange(6) == 0), wind=air)
    drag = 0.5 * 1000.0 * np.sum(areas.area * areas.shape_coefficient)
    mass = model.platform.mass[0, 0]
    omega = np.sqrt(model.platform.stiffness[0, 0] / mass)
    period = 2.0 * np.pi / omega
    state = start(model, np.array([1.0, 0, 0, 0, 0, 0]), np.zeros(6))
    steps = round(5.0 * period / STEP)
    surge = together(list(simulate(model, state, step=STEP, steps=steps)))["position"][:, 0]
    last = surge[-round(0.5 * period / STEP) :].max()
    expected = 1.0 / (1.0 + 4.0 * drag * omega * 5.0 * period / (3.0 * np.pi * mass))
    assert expected < 0.9
    assert 1.0 - last == pytest.approx(1.0 - expected, rel=0.03)


def test_constant_load_and_lost_tendons_act_from_the_start() -> None:
    """A load changes the first acceleration by what Newton's law gives with the mass matrix, at the origin exactly."""
    load = np.array([1e6, 2e6, -1e6, 1e7, 0.0, 1e7])
    model = platform()
    intact = np.arange(len(model.tendons.pretension)) != 3
    records = []
    for external in (load, np.zeros(6)):
        coupled = CoupledModel(platform=model, external=external)
        state = start(coupled, np.zeros(6), np.zeros(6), intact)
        records.append(together(list(simulate(coupled, state, step=STEP, steps=20))))
    assert not records[0]["tensions"][:, 3].any()
    assert np.all(records[0]["tensions"][:, 4] > 0.0)
    change = records[0]["acceleration"][0] - records[1]["acceleration"][0]
    left = model.mass - model.arrays[3][3]
    np.testing.assert_allclose(left @ change, load, rtol=0.0, atol=1e-9 * np.abs(load).max())


def test_a_model_that_does_more_than_its_kernels_goes_the_plain_way() -> None:
    class Heavier(WaveLoads):
        def evaluate(self, time: float, position: FloatArray, velocity: FloatArray):  # type: ignore[no-untyped-def]
            forces = super().evaluate(time, position, velocity)
            return dataclasses.replace(forces, viscous=1.1 * forces.viscous)

    heavier = Heavier(sea=calm_water(water_depth=450.0), members=issc_members(), current_speed=1.0)
    model = CoupledModel(platform=platform(), waves=heavier)
    with pytest.warns(RuntimeWarning, match="the plain one is taken"):
        found = run(model, 30)
    np.testing.assert_array_equal(found["position"], run(model, 30, compiled=False)["position"])


@pytest.mark.parametrize("compiled", [True, False])
def test_a_failed_step_is_told_with_its_time(compiled: bool) -> None:
    model = CoupledModel(platform=platform(), external=np.array([0, 0, 0, 0, 0, 1e30]))
    with pytest.raises(StepError, match=r"at t = 0\.1 s: platform motion did not converge"):
        run(model, 10, compiled=compiled)


def test_no_steps_give_the_start() -> None:
    record = run(CoupledModel(platform=platform()), 0)
    assert record["position"].shape == (1, 6)
    assert record["position"][0, 0] == 5.0


def test_free_decay_with_wave_drift_damping() -> None:
    """Surge alone, in calm water without drag: the amplitude falls as exp(-B t / 2 M), and no other part acts."""
    damping = np.diag([9e5, 0.0, 0.0, 0.0, 0.0, 0.0])
    free = np.arange(6) == 0
    model = platform(free=free)
    loads = WaveLoads(
        sea=calm_water(water_depth=450.0), members=issc_members(drag_coefficient=1e-9), drift_damping=damping
    )
    whole = CoupledModel(platform=model, waves=loads)
    begun = np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
    steps = 6000
    records = {}
    for name, each in (("damped", whole), ("free", CoupledModel(platform=model))):
        found = list(simulate(each, start(each, begun, np.zeros(6)), step=STEP, steps=steps))
        records[name] = np.concatenate([record.position[:, 0] for record in found])
    # The tendons stiffen with the square of the offset over their length, nothing at 0.3 m.
    rate = 0.5 * damping[0, 0] / mass_matrix(model.body)[0, 0]
    period = _period(records["free"])
    damped_period = 2.0 * np.pi / np.sqrt((2.0 * np.pi / period) ** 2 - rate**2)
    assert _period(records["damped"]) == pytest.approx(damped_period, rel=1e-3)
    for k in range(1, 5):
        near = slice(round((k - 0.2) * period / STEP), round((k + 0.2) * period / STEP))
        ratio = np.max(records["damped"][near]) / np.max(records["free"][near])
        assert ratio == pytest.approx(np.exp(-rate * k * damped_period), rel=2e-3)


def _period(record: FloatArray) -> float:
    """Mean time in s between upward crossings of zero."""
    up = np.flatnonzero((record[:-1] < 0.0) & (record[1:] >= 0.0))
    return STEP * float(up[-1] - up[0]) / (len(up) - 1)
