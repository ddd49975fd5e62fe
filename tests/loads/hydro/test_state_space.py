"""The recursive filter of radiation: against the convolution, in frequency and in free decay, and its passivity."""

from dataclasses import replace

import numpy as np
import pytest

from tlpsim.loads import issc_tlp
from tlpsim.loads.bem.issc import issc_database
from tlpsim.loads.hydro.radiation import LONGEST_STEP, Radiation, convolution_memory, frequency_response, radiation
from tlpsim.loads.hydro.state_space import (
    StateSpaceMemory,
    active_frequencies,
    is_passive,
    state_space_memory,
)
from tlpsim.loads.platform.motion import PlatformModel, advance, initial_state


@pytest.fixture(scope="module")
def issc() -> Radiation:
    return radiation(issc_database())


@pytest.fixture(scope="module")
def memory(issc: Radiation) -> StateSpaceMemory:
    return state_space_memory(issc)


def test_fit_is_as_good_as_it_says(issc: Radiation, memory: StateSpaceMemory) -> None:
    omega = np.arange(0.01, 2.4, 0.01)
    exact = frequency_response(convolution_memory(issc).discrete(0.02), omega, 0.02)
    found = memory.response(omega)
    outer = np.outer(issc.scale, issc.scale)
    for group in ([0, 4], [1, 3], [2], [5]):
        cut = np.ix_(range(len(omega)), group, group)
        error = np.linalg.norm(((found - exact) / outer)[cut]) / np.linalg.norm((exact / outer)[cut])
        assert error < memory.error + 0.003  # of the step of the reference
    # The columns' echoes ask for more than the most states there may be; 2 % is what they reach.
    assert memory.error < 0.02


def test_the_filter_is_passive_at_every_frequency(issc: Radiation, memory: StateSpaceMemory) -> None:
    """On a grid of its own, ten times finer than the fit's."""
    omega = np.concatenate([np.arange(0.0, 5.0, 0.001), np.geomspace(5.0, 1e4, 2000)])
    response = memory.response(omega).real / np.outer(issc.scale, issc.scale)
    assert np.linalg.eigvalsh(0.5 * (response + response.transpose(0, 2, 1)))[:, 0].min() >= 0.0


@pytest.mark.parametrize("step", [0.05, LONGEST_STEP])
def test_the_filter_in_steps_is_the_bilinear_map_of_that_in_time(memory: StateSpaceMemory, step: float) -> None:
    """The trapezoidal rule at omega is the filter itself at 2/h tan(omega h / 2), so it is as passive at any step."""
    omega = np.array([0.06, 0.5, 1.3, 2.4, 6.0])
    found = frequency_response(memory.discrete(step), omega, step)
    exact = memory.response(2.0 / step * np.tan(0.5 * step * omega))
    np.testing.assert_allclose(found, exact, rtol=1e-8, atol=1e-8 * np.abs(exact).max())


def test_passivity_is_told_apart() -> None:
    """s/(s² + 0.4 s + 1) is positive real; with 0.3 added to its numerator, (s + 0.3), its real part is (0.3 - 0.3 w² +
    0.4 w²)/..., still positive; with -0.3 it is negative below sqrt(0.3/0.7)."""
    dynamics, drive = np.array([[0.0, 1.0], [-1.0, -0.4]]), np.array([[0.0], [1.0]])
    direct = np.array([[1e-6]])
    for constant, passive in ((0.0, True), (0.3, True), (-0.3, False)):
        assert is_passive(dynamics, drive, np.array([[constant, 1.0]]), direct) is passive
    found = active_frequencies(dynamics, drive, np.array([[-0.3, 1.0]]), direct)
    assert len(found) == 1
    assert 0.0 < found[0] < np.sqrt(0.3 / 0.7)
    assert not is_passive(-dynamics, drive, np.array([[0.0, 1.0]]), direct)


@pytest.mark.parametrize("degree", range(6))
def test_free_decay_is_that_of_the_convolution(issc: Radiation, memory: StateSpaceMemory, degree: int) -> None:
    amplitude = [1.0, 1.0, 0.01, 1e-4, 1e-4, 0.01][degree]
    period = [104.0, 104.0, 1.82, 1.92, 1.92, 83.0][degree]
    records = []
    for kind in (convolution_memory(issc), memory):
        model = PlatformModel(
            body=replace(issc_tlp.body(), added_mass=kind.added_mass),
            tendons=issc_tlp.tendons(),
            free=np.arange(6) == degree,
            memory=kind,
        )
        state = initial_state(model, amplitude * (np.arange(6) == degree), np.zeros(6), np.zeros(6))
        record = []
        for _ in range(int(5.0 * period / 0.1)):
            advance(model, state, np.zeros(6), 0.1)
            record.append(state.position[degree])
        records.append(np.array(record))
    difference = np.sqrt(np.mean((records[1] - records[0]) ** 2) / np.mean(records[0] ** 2))
    assert difference < 0.005
