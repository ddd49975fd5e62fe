"""The integrator with fluid memory: what it reads and keeps of the past."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tlpsim.loads import issc_tlp
from tlpsim.loads.errors import StepError
from tlpsim.loads.platform.memory import DiscreteMemory, NoMemory, convolution, recursion, resampled
from tlpsim.loads.platform.motion import PlatformModel, PlatformState, advance, initial_state

REST = np.zeros(6)
PAIRS = np.array([[i, i] for i in range(6)])
TAPS = 60


def kernel(step: float, lags: np.ndarray) -> np.ndarray:
    """A retardation function exp(-t) of 2e6 N/m in every degree of freedom."""
    return step * 2e6 * np.exp(-step * lags)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Exponential:
    """The same memory as taps or as one state a degree of freedom."""

    recursive: bool
    longest_step: float = 0.25

    def discrete(self, step: float) -> DiscreteMemory:
        if not self.recursive:
            taps = kernel(step, np.arange(1, int(12.0 / step)))[:, None] * np.ones(6)
            return convolution(0.5 * kernel(step, np.zeros(1)) * np.eye(6), PAIRS, taps)
        # z' = -z + v, F = -2e6 z by the trapezoidal rule.
        drive = 0.5 * step / (1.0 + 0.5 * step) * np.eye(6)
        transition = (1.0 - 0.5 * step) / (1.0 + 0.5 * step) * np.eye(6)
        return recursion(2e6 * drive, transition, drive, 2e6 * np.eye(6))


def model(recursive: bool) -> PlatformModel:
    return replace(issc_tlp.platform(), memory=Exponential(recursive=recursive))


def run(chosen: PlatformModel, state: PlatformState, steps: int, step: float = 0.1) -> np.ndarray:
    positions = []
    for k in range(steps):
        advance(chosen, state, 1e6 * np.sin(0.05 * k) * np.ones(6), step)
        positions.append(state.position.copy())
    return np.array(positions)


def start(chosen: PlatformModel) -> PlatformState:
    return initial_state(chosen, [5.0, 2.0, 0.0, 0.0, 0.0, 0.02], REST, REST)


def test_taps_and_states_of_one_retardation_move_the_platform_alike() -> None:
    one, other = (run(model(recursive), start(model(recursive)), 3000) for recursive in (False, True))
    plain = run(issc_tlp.platform(), start(issc_tlp.platform()), 3000)
    # Both rules are off by h²/12 of what the memory does; it does a metre.
    assert np.abs(one - plain)[:, 0].max() > 0.5
    np.testing.assert_allclose(other, one, atol=2e-3 * np.abs(one - plain).max())


def test_a_force_of_the_past_is_the_sum_over_the_taps() -> None:
    """All but surge held at speed zero: surge velocities, and the balance of forces at the end of the last step."""
    chosen = replace(model(False), free=np.arange(6) == 0)
    state = start(chosen)
    speeds = [0.0]
    for k in range(200):
        advance(chosen, state, np.array([2e6 * np.sin(0.1 * k), 0, 0, 0, 0, 0]), 0.1)
        speeds.append(state.velocity[0])
    memory = chosen.memory.discrete(0.1)
    past = memory.taps[:, 0] @ np.array(speeds[-2::-1])[: len(memory.taps)]
    force = memory.direct[0, 0] * speeds[-1] + past
    without = initial_state(chosen, state.position, REST, state.force)
    assert chosen.mass[0, 0] * (without.acceleration[0] - state.acceleration[0]) == pytest.approx(force, rel=1e-6)


@pytest.mark.parametrize("recursive", [False, True])
def test_a_copied_state_goes_on_bit_for_bit(recursive: bool) -> None:
    chosen = model(recursive)
    state = start(chosen)
    run(chosen, state, 500)
    kept = state.copy()
    assert run(chosen, state, 300).tobytes() == run(chosen, kept, 300).tobytes()


@pytest.mark.parametrize("recursive", [False, True])
def test_a_failed_step_leaves_the_memory_unchanged(recursive: bool) -> None:
    chosen = model(recursive)
    state, other = start(chosen), start(chosen)
    run(chosen, state, 200)
    run(chosen, other, 200)
    for step in (0.1, 2.0):
        with pytest.raises(StepError):
            advance(chosen, state, np.full(6, 1e300), step)
        with pytest.raises(StepError):
            advance(chosen, state, np.full(6, np.nan), step)
    assert run(chosen, state, 50).tobytes() == run(chosen, other, 50).tobytes()


def test_long_steps_are_cut_to_what_the_memory_allows() -> None:
    """Held but in surge nothing else asks for short steps, and one of 2 s goes as eight."""
    chosen = replace(model(False), free=np.arange(6) == 0)
    one, other = start(chosen), start(chosen)
    for _ in range(20):
        advance(chosen, one, REST, 2.0)
        for _ in range(8):
            advance(chosen, other, REST, 0.25)
    np.testing.assert_allclose(one.position, other.position, atol=1e-12)


def test_another_step_takes_the_past_along() -> None:
    chosen = model(False)
    state, other = start(chosen), start(chosen)
    run(chosen, state, 600)
    run(chosen, other, 600)
    found = run(replace(chosen), state, 200, 0.05)[1::2]
    for k in range(100):
        advance(chosen, other, 1e6 * np.sin(0.05 * (2 * k + 1)) * np.ones(6), 0.1)
        # The load is linear between other instants, a thousandth of the motion.
        np.testing.assert_allclose(found[k], other.position, atol=5e-3 * np.abs(other.position).max())


def test_a_ring_is_resampled_in_order_of_age() -> None:
    ring = np.roll(np.arange(5.0)[:, None] * np.ones(6), 2, axis=0)  # values 0 ... 4, the newest 4 in row 1
    found = resampled(ring, 1, 0.2, 0.1, 12)[:, 0]
    np.testing.assert_allclose(found, [0, 0, 0, 0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4][-12:], atol=1e-12)
    assert not resampled(np.zeros((0, 6)), 0, 0.0, 0.1, 3).any()


def test_no_memory_is_none() -> None:
    memory = NoMemory().discrete(0.1)
    assert not memory.direct.any()
    assert not memory.taps.size
    assert not memory.transition.size
