"""The compiled static loads against their array form and against differences."""

import numpy as np
import pytest

from tlpsim.loads import issc_tlp
from tlpsim.loads.platform.body import generalized_force, generalized_force_slope, hydrostatic_load
from tlpsim.loads.platform.motion import (
    PlatformModel,
    remaining,
    restoring_force,
    tangent_stiffness,
    tension_gradients,
)
from tlpsim.loads.platform.tendons import tendon_loads

TLP = PlatformModel(body=issc_tlp.body(), tendons=issc_tlp.tendons(tubes=issc_tlp.steel_tubes()))
POSES = [
    np.array([20.0, -8.0, -0.6, 0.004, -0.003, 0.1]),
    np.array([3.0, 40.0, 0.2, -0.05, 0.04, 2.5]),
    np.array([-5.0, 2.0, -4.0, 0.03, 0.02, -1.0]),  # heave by which all lines slacken
]


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("model", [TLP, remaining(TLP, np.arange(12) % 5 != 0), remaining(TLP, np.zeros(12))])
def test_compiled_loads_are_those_of_the_array_form(model: PlatformModel, pose: np.ndarray) -> None:
    scale = 9.8 * model.body.mass * 50.0  # N·m
    for at in (pose, *(pose + 1e-30j * np.eye(6))):
        load, tops, _ = tendon_loads(model.tendons, at)
        expected = -generalized_force(hydrostatic_load(model.body, at) + load, at)
        found = restoring_force(model, at)
        # A line's tension carries the rounding of its length times its stiffness, 1e-13 of EA.
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * scale)
        if np.iscomplexobj(at):
            np.testing.assert_allclose(found.imag, expected.imag, rtol=1e-11, atol=1e-43 * scale)
            slopes = tension_gradients(model, pose)[:, int(np.argmax(at.imag))]
            np.testing.assert_allclose(slopes, tops.imag / 1e-30, rtol=1e-11, atol=1e-6)


@pytest.mark.parametrize("pose", POSES)
def test_gradients_against_differences(pose: np.ndarray) -> None:
    step = 1e-6
    ends = [(pose + step * unit, pose - step * unit) for unit in np.eye(6)]
    load = np.array([3e6, -2e6, 5e6, 4e8, -7e8, 2e8])
    slope = np.stack(
        [(generalized_force(load, a) - generalized_force(load, b)) / (2.0 * step) for a, b in ends], axis=1
    )
    np.testing.assert_allclose(generalized_force_slope(load, pose), slope, rtol=0, atol=1e-9 * np.abs(load).max())
    size = np.sqrt(np.diag(TLP.mass))
    stiffness = np.stack([restoring_force(TLP, a) - restoring_force(TLP, b) for a, b in ends], axis=1) / (2.0 * step)
    exact = tangent_stiffness(TLP, pose) / np.outer(size, size)
    np.testing.assert_allclose(exact, stiffness / np.outer(size, size), rtol=0, atol=1e-7 * np.abs(exact).max())
