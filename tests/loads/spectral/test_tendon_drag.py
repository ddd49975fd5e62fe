"""Drag of the tendons, statistically linear, against the drag itself under normal velocities."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads import issc_tlp
from tlpsim.loads.platform.motion import PlatformModel
from tlpsim.loads.platform.tendons import tendon_drag
from tlpsim.loads.spectral.dynamics import generalized_loads
from tlpsim.loads.spectral.tendon_drag import tendon_damping
from tlpsim.loads.waves.current import Current, power_law_current

POSE = np.array([12.0, -7.0, -0.3, 0.002, -0.003, 0.05])
CURRENTS = {"still": None, "current": power_law_current(0.9, 0.7, 450.0)}


def platform(current: Current | None) -> PlatformModel:
    tubes = issc_tlp.steel_tubes()
    return PlatformModel(body=issc_tlp.body(), tendons=issc_tlp.tendons(tubes=tubes), current=current)


def velocities() -> NDArray[np.float64]:
    """Root of a covariance of the rates, (6, 6), in which the degrees of freedom go together."""
    rng = np.random.default_rng(1)
    return rng.normal(size=(6, 6)) * np.array([0.5, 0.3, 0.05, 5e-3, 5e-3, 5e-3])[:, None]


@pytest.mark.parametrize("current", list(CURRENTS))
def test_mean_and_damping_of_a_random_motion(current: str) -> None:
    """Mean of the drag, and of its change with the rates, over 800 normal velocities and their negatives."""
    model, root = platform(CURRENTS[current]), velocities()
    mean, damping = tendon_damping(model, POSE, generalized_loads(POSE), root @ root.T)
    draws = np.random.default_rng(4).normal(size=(800, 6)) @ root.T
    scale = np.array([1.0, 1.0, 1.0, 0.02, 0.02, 0.02])

    def drag(velocity: NDArray[np.float64]) -> NDArray[np.float64]:
        return tendon_drag(model.tendons, POSE, velocity, model.body.water_density, model.flow)

    # Drag is quadratic, so that differences over a tenth of the motion hardly differ from the derivative.
    forces = np.array([0.5 * (drag(v) + drag(-v)) for v in draws])
    noise = 4.0 * forces.std(axis=0) / np.sqrt(len(draws))
    assert np.all(np.abs(forces.mean(axis=0) - mean) <= noise + 1e-6 * np.abs(mean).max())
    assert np.abs(mean).max() > (1e5 if model.flow is not None else -1.0)
    for degree, unit in enumerate(np.diag(0.05 * scale)):
        slopes = np.array([drag(v - unit) - drag(v + unit) for v in draws]) / (2.0 * unit.max())
        error = 4.0 * slopes.std(axis=0) / np.sqrt(len(draws))
        close = 5e-3 * np.abs(damping[:, degree]).max()
        assert np.all(np.abs(slopes.mean(axis=0) - damping[:, degree]) <= error + close)


def test_current_alone_is_the_drag_at_rest() -> None:
    model, none = platform(CURRENTS["current"]), np.zeros((6, 6))
    mean, damping = tendon_damping(model, POSE, generalized_loads(POSE), none)
    expected = tendon_drag(model.tendons, POSE, np.zeros(6), model.body.water_density, model.flow)
    np.testing.assert_allclose(mean, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    for degree, step in enumerate((1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6)):
        unit = step * np.eye(6)[degree]
        ahead, behind = (
            tendon_drag(model.tendons, POSE, sign * unit, model.body.water_density, model.flow) for sign in (1.0, -1.0)
        )
        slope = (behind - ahead) / (2.0 * step)
        np.testing.assert_allclose(damping[:, degree], slope, rtol=1e-6, atol=1e-7 * np.abs(slope).max())


def test_still_water_and_no_motion_or_no_drag_is_nothing() -> None:
    model = platform(None)
    mean, damping = tendon_damping(model, POSE, generalized_loads(POSE), np.zeros((6, 6)))
    np.testing.assert_allclose(mean, 0.0, atol=1e-9)
    np.testing.assert_allclose(damping, 0.0, atol=1e-9)
    bare = replace(model, tendons=issc_tlp.tendons())
    mean, damping = tendon_damping(bare, POSE, generalized_loads(POSE), np.eye(6))
    assert not mean.any()
    assert not damping.any()
