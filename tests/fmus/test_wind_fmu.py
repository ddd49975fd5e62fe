"""Parameters of the wind FMU, through FMI."""

import json
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.errors import TlpsimError
from tlpsim.loads.wind.field import Gusts
from tlpsim.loads.wind.force import wind_loads
from tlpsim.loads.wind.profile import Profile
from tlpsim.loads.wind.segments import Boxes, projected_segments
from tlpsim.orchestrator.fmu import FmuInstance

OUTPUTS = [f"force.{name}" for name in ("surge", "sway", "heave", "roll", "pitch", "yaw")]


def force(path: Path, parameters: dict[str, object], time: float) -> tuple[np.ndarray, tuple[str, ...]]:
    """Force at `time` on a platform at rest, and what the FMU logged."""
    instance = FmuInstance("wind", path)
    instance.set_parameters(parameters)
    instance.bind([], OUTPUTS)
    instance.enter_initialization(0.0)
    instance.exit_initialization()
    instance.step(0.0, time)
    values = np.zeros(6)
    instance.get_outputs(values)
    messages = instance.messages
    instance.terminate()
    instance.free()
    return values, messages


def test_parameters_reach_the_model(fmus: dict[str, Path]) -> None:
    boxes = {"position": [[3.0, 2.0, 40.0]], "size": [[80.0, 60.0, 12.0]], "shape_coefficient": [1.1]}
    parameters = {
        "mean_speed": 32.0,
        "heading": 0.4,
        "profile": "iso",
        "spectrum": "harris",
        "coherence.model": "npd",
        "admittance": "davenport",
        "decomposition": "expanded",
        "sampling_step": 2.0,
        "seed": 9,
        "boxes": json.dumps(boxes),
    }
    values, _ = force(fmus["wind"], parameters, 8.6)
    loads = wind_loads(
        heading=0.4,
        profile=Profile(name="iso", speed_10=32.0, roughness_length=0.001),
        gusts=Gusts(spectrum="harris", coherence="npd", admittance="davenport", sampling_step=2.0, seed=9),
        segments=projected_segments(Boxes(**{key: np.array(value) for key, value in boxes.items()}), 0.4),
        decomposition="expanded",
    )
    np.testing.assert_array_equal(values, loads.evaluate(8.6, np.zeros(6), 0.0))


@pytest.mark.parametrize(
    ("orders", "warned"), [((25, 3, 3), True), ((100, 6, 6), False)], ids=["the paper's", "those that do"]
)
def test_a_poor_fit_is_a_warning_in_the_log(fmus: dict[str, Path], orders: tuple[int, int, int], warned: bool) -> None:
    names = ("orders.long", "orders.autoregressive", "orders.moving_average")
    parameters = {"spectrum": "davenport", "seed": 3} | dict(zip(names, orders, strict=True))
    _, messages = force(fmus["wind"], parameters, 1.0)
    found = [message for message in messages if "gusts, spectrum 'davenport'" in message]
    assert bool(found) is warned
    if warned:
        assert "warning" in found[0]
        assert "would do" in found[0]


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"spectrum": "kaimel"}, "did you mean 'kaimal'"),
        ({"orders.autoregressive": 30}, "orders of a random process"),
        ({"segments": '{"position": [[0, 0, 30]], "area": [9], "shape_coefficient": [1]}', "boxes": "{}"}, "one of"),
        ({"boxes": '{"position": [[0, 0, 30]]}'}, "parameter boxes has position"),
        ({"mean_speed": -1.0}, "mean wind speed at 10 m is -1"),
    ],
)
def test_bad_parameters_are_told(fmus: dict[str, Path], parameters: dict[str, object], words: str) -> None:
    with pytest.raises(TlpsimError, match=words):
        force(fmus["wind"], parameters, 1.0)
