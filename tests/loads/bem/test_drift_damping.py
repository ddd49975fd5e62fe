import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.bem.drift_damping import wave_drift_damping
from tlpsim.loads.errors import ScenarioError

OMEGA = np.linspace(0.4, 1.2, 17)
TURN = np.linspace(0.0, 2.0 * np.pi, 33)
GRAVITY = 9.80665


def _drift(omega: NDArray, heading: NDArray) -> NDArray:
    """Smooth drift of no symmetry, (surge, sway, yaw)."""
    return np.stack(
        np.broadcast_arrays(
            1e4 * omega**3 * np.cos(heading),
            2e4 * omega**2 * (np.sin(heading) + 0.2 * np.cos(2.0 * heading)),
            1e5 * omega * np.sin(2.0 * heading + 0.3),
        ),
        axis=-1,
    )


def test_damping_of_short_waves_on_a_round_wall() -> None:
    """Fully reflecting circular wall: D = 2/3 ρ g a (Havelock 1940) for every frequency, so that B = 4 ω D / g along
    the waves, and half of that across: the force keeps its size and turns with the waves' energy."""
    density, radius = 1025.0, 10.0
    size = 2.0 / 3.0 * density * GRAVITY * radius
    drift = size * np.broadcast_to(np.stack([np.cos(TURN), np.sin(TURN)], axis=-1), (len(OMEGA), len(TURN), 2))
    damping = wave_drift_damping(drift, OMEGA, TURN, GRAVITY)
    along = np.stack([np.cos(TURN), np.sin(TURN)], axis=-1)
    across = np.stack([-np.sin(TURN), np.cos(TURN)], axis=-1)
    wanted = 8.0 / 3.0 * density * radius * OMEGA
    # Cubic splines over 32 headings of a cosine: (2 π / 32)³ / some tens.
    np.testing.assert_allclose(
        np.einsum("hi,fhij,hj->fh", along, damping, along), wanted[:, None] * np.ones(33), rtol=1e-3
    )
    np.testing.assert_allclose(
        np.einsum("hi,fhij,hj->fh", across, damping, across), 0.5 * wanted[:, None] * np.ones(33), rtol=1e-3
    )
    np.testing.assert_allclose(np.einsum("hi,fhij,hj->fh", across, damping, along), 0.0, atol=1e-3 * wanted[-1])


@pytest.mark.parametrize("power", [0.0, 2.0, 6.0])
def test_damping_of_a_power_law_in_head_waves(power: float) -> None:
    """D ~ ω^p towards the waves gives (4 + p) ω D / g."""
    drift = np.stack(np.broadcast_arrays(OMEGA[:, None] ** power, np.zeros((1, 2))), axis=-1) * [1.0, 0.0]
    damping = wave_drift_damping(drift, OMEGA, [-0.1, 0.0], GRAVITY)[:, 1, 0, 0]
    # Splines over steps of 0.05: (step/ω)³ at the lower end.
    np.testing.assert_allclose(damping, (4.0 + power) * OMEGA ** (power + 1.0) / GRAVITY, rtol=2e-2, atol=1e-3)


def test_damping_is_what_a_moving_body_loses() -> None:
    """The encounter-frequency form of the force, differentiated by numbers at an oblique heading."""
    damping = wave_drift_damping(_drift(OMEGA[:, None], TURN[None, :]), OMEGA, TURN, GRAVITY)
    row, column, step = 8, 5, 1e-4
    omega, heading = OMEGA[row], TURN[column]

    def force(velocity: NDArray) -> NDArray:
        along = velocity @ [np.cos(heading), np.sin(heading)]
        across = velocity @ [-np.sin(heading), np.cos(heading)]
        ratio = omega / GRAVITY
        seen = _drift(np.array(omega * (1.0 - ratio * along)), np.array(heading - 2.0 * ratio * across))
        return (1.0 - 4.0 * ratio * along) * seen

    wanted = -np.stack([(force(v) - force(-v)) / (2.0 * step) for v in step * np.eye(2)], axis=-1)
    # The splines' derivatives over a 32nd of a turn and a sixteenth of the band.
    np.testing.assert_allclose(damping[row, column], wanted, rtol=5e-3, atol=5e-3 * np.max(np.abs(wanted)))


def test_headings_that_close_the_circle_are_periodic() -> None:
    drift = _drift(OMEGA[:, None], TURN[None, :])
    damping = wave_drift_damping(drift, OMEGA, TURN, GRAVITY)
    np.testing.assert_allclose(damping[:, 0], damping[:, -1], rtol=1e-12, atol=1e-10)
    part = wave_drift_damping(drift[:, :9], OMEGA, TURN[:9], GRAVITY)
    np.testing.assert_allclose(part[:, 4], damping[:, 4], rtol=1e-2, atol=1e-2 * np.max(np.abs(damping)))


def test_arrays_that_do_not_fit_are_refused() -> None:
    drift = _drift(OMEGA[:, None], TURN[None, :])
    with pytest.raises(ScenarioError, match="shape"):
        wave_drift_damping(drift[:, :-1], OMEGA, TURN)
    with pytest.raises(ScenarioError, match="headings"):
        wave_drift_damping(drift[:, :1], OMEGA, TURN[:1])
    with pytest.raises(ScenarioError, match="frequencies"):
        wave_drift_damping(drift[::-1], OMEGA[::-1], TURN)
