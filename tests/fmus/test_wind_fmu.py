"""Parameters of the wind FMU, through FMI."""

import json
from pathlib import Path

import numpy as np
import pytest

from tlpsim.fmus.tables import record_to_json
from tlpsim.loads.errors import TlpsimError
from tlpsim.loads.wind.field import Gusts
from tlpsim.loads.wind.force import wind_loads
from tlpsim.loads.wind.profile import Profile
from tlpsim.loads.wind.segments import Boxes, projected_segments
from tlpsim.orchestrator.fmi.fmi2 import FmuInstance

BOXES = {"position": [[3.0, 2.0, 40.0]], "size": [[80.0, 60.0, 12.0]], "shape_coefficient": [1.1]}
DECK = Boxes(**{key: np.array(value) for key, value in BOXES.items()})
PIECES = projected_segments(DECK, 0.0)
TABLE = {name: getattr(PIECES, name).tolist() for name in ("position", "area", "shape_coefficient")}
OUTPUTS = [f"force.{name}" for name in ("surge", "sway", "heave", "roll", "pitch", "yaw")]


def force(
    path: Path, parameters: dict[str, object], time: float, yaw: float = 0.0
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Force at `time` on a platform at rest at `yaw`, and what the FMU logged."""
    instance = FmuInstance("wind", path)
    instance.set_parameters(parameters)
    instance.bind(["position.yaw"], OUTPUTS)
    instance.enter_initialization(0.0)
    instance.set_inputs(np.array([yaw]))
    instance.exit_initialization()
    instance.step(0.0, time)
    values = np.zeros(6)
    instance.get_outputs(values)
    messages = instance.messages
    instance.terminate()
    instance.free()
    return values, messages


def test_parameters_reach_the_model(fmus: dict[str, Path]) -> None:
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
        "boxes": json.dumps(BOXES),
    }
    values, _ = force(fmus["wind"], parameters, 8.6)
    loads = wind_loads(
        heading=0.4,
        profile=Profile(name="iso", speed_10=32.0, roughness_length=0.001),
        gusts=Gusts(spectrum="harris", coherence="npd", admittance="davenport", sampling_step=2.0, seed=9),
        segments=projected_segments(DECK, 0.4),
        decomposition="expanded",
    )
    np.testing.assert_array_equal(values, loads.evaluate(8.6, np.zeros(6), 0.0))


@pytest.mark.parametrize(
    ("parameters", "ratio"),
    [
        ({"boxes": json.dumps(BOXES)}, np.cos(0.3) + 80.0 / 60.0 * np.sin(0.3)),
        ({"boxes": json.dumps(BOXES), "yaw_dependent_area": False}, 1.0),
        ({"segments": record_to_json(PIECES)}, np.cos(0.3) + 80.0 / 60.0 * np.sin(0.3)),
        ({"segments": record_to_json(PIECES), "yaw_dependent_area": False}, 1.0),
        ({"segments": json.dumps(TABLE)}, 1.0),
        ({}, 1.0),
    ],
    ids=["boxes", "boxes, switched off", "segments", "segments, switched off", "segments without plan", "default"],
)
def test_yaw_shows_the_wind_other_areas(fmus: dict[str, Path], parameters: dict[str, object], ratio: float) -> None:
    """By b(beta - psi) / b(beta) with b = l |sin| + w |cos|, at beta = 0, for what comes from a box."""
    ahead, turned = (force(fmus["wind"], {"seed": 4} | parameters, 7.5, yaw)[0] for yaw in (0.0, 0.3))
    assert turned[0] / ahead[0] == pytest.approx(ratio, rel=1e-12)


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
