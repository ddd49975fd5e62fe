"""The derivatives of the forces of the wind and the wave FMU, as plain Python objects, against finer steps."""

from pathlib import Path

import numpy as np
import pytest

from tlpsim.fmus.component import Component
from tlpsim.fmus.wave_fmu import TlpsimWave
from tlpsim.fmus.wind_fmu import TlpsimWind

FINE = 0.01  # s


def moved(kind: type[Component], folder: Path, **parameters: float) -> tuple[np.ndarray, np.ndarray]:
    """Forces and their rates every 0.01 s of a platform that surges, sways and turns."""
    one = kind(instance_name="one", resources=str(folder))
    for name, value in parameters.items():
        one.set_real([one.references[name]], [value])

    def motion(time: float) -> None:
        for name, amplitude, omega in (("surge", 1.5, 0.5), ("sway", 0.8, 0.4), ("yaw", 0.02, 0.3)):
            for key, value in (
                (f"position.{name}", amplitude * np.sin(omega * time)),
                (f"velocity.{name}", amplitude * omega * np.cos(omega * time)),
            ):
                if key in one.references:
                    one.set_real([one.references[key]], [float(value)])

    one.setup_experiment(0.0, None, None)
    motion(0.0)
    one.enter_initialization_mode()
    one.exit_initialization_mode()
    records = []
    for k in range(1500):
        motion((k + 1) * FINE)
        one.do_step(k * FINE, FINE)
        records.append(np.concatenate([one.force, one.force_rate]))
    forces, rates = np.hsplit(np.array(records), 2)
    return forces, rates


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [(TlpsimWave, {"heading": 0.4, "current_speed": 0.6}), (TlpsimWind, {"heading": 0.4})],
    ids=["wave", "wind"],
)
def test_rate_is_the_derivative_of_the_force(
    kind: type[Component], parameters: dict[str, float], tmp_path: Path
) -> None:
    forces, rates = moved(kind, tmp_path, **parameters)
    difference = (forces[2:] - forces[:-2]) / (2.0 * FINE)
    # The kernels of the sea leave small jumps at its sampling instants, every 0.5 s, which are no slopes.
    inside = np.abs((np.arange(2, len(forces)) % 50) - 25) < 24
    largest = np.abs(difference).max(axis=0)
    assert np.all(largest[[0, 1, 3, 4, 5]] > 0.0)
    for degree in np.flatnonzero(largest > 0.0):
        off = np.sqrt(np.mean((rates[1:-1, degree] - difference[:, degree])[inside] ** 2))
        # The acceleration lags by half a step; pieces of the splash zone get wet and dry.
        assert off < 5e-3 * np.sqrt(np.mean(difference[:, degree] ** 2))
