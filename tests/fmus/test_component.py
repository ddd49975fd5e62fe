"""The base class of the FMUs, tried as a plain Python object; test_fmus.py tries it through FMI."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.fmus.component import Component, Variable, six
from tlpsim.loads.errors import FmuError


class Gain(Component):
    """force = gain · velocity + number of steps."""

    table = (
        *six("velocity", "input", "velocity", ("m/s", "rad/s")),
        *six("force", "output", "force", ("N", "N.m"), depends_on=("velocity.*",)),
        Variable(name="gain", causality="parameter", description="gain", unit="1", start=2.0),
        Variable(name="count", causality="parameter", description="integer", kind="Integer", start=3),
        Variable(name="word", causality="parameter", description="string", kind="String", start="a"),
        Variable(name="offset", causality="parameter", description="added", unit="1", start=0.0, tunable=True),
    )

    def prepare(self) -> None:
        self.steps = np.zeros(1)
        self.gain = self.parameter("gain")
        self.retune()

    def retune(self) -> None:
        self.offset = self.parameter("offset")

    def start(self, time: float) -> None:
        self.view("force.")[:] = self.gain * self.view("velocity.")

    def advance(self, time: float, step: float) -> None:
        self.steps += 1
        self.view("force.")[:] = self.gain * self.view("velocity.") + self.steps + self.offset

    def snapshot(self) -> dict[str, NDArray[Any]]:
        return {"steps": self.steps.copy()}

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        self.steps[:] = arrays["steps"]


VELOCITY, FORCE, GAIN, COUNT, WORD, OFFSET = list(range(6)), list(range(6, 12)), [12], [13], [14], [15]


@pytest.fixture
def component(tmp_path: Any) -> Gain:
    return Gain(instance_name="gain", resources=str(tmp_path))


def started(component: Gain) -> Gain:
    component.setup_experiment(0.0, None, None)
    component.enter_initialization_mode()
    component.exit_initialization_mode()
    return component


def test_outputs_follow_inputs_and_parameters_during_initialization(component: Gain) -> None:
    component.setup_experiment(0.0, None, None)
    component.enter_initialization_mode()
    component.set_real(VELOCITY, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    assert component.get_real(FORCE) == [2.0, 4.0, 6.0, 8.0, 10.0, 12.0]
    component.set_real(GAIN, [-1.0])
    assert component.get_real(FORCE[:2]) == [-1.0, -2.0]


def test_a_parameter_is_fixed_once_stepping(component: Gain) -> None:
    started(component)
    with pytest.raises(FmuError, match="gain is fixed"):
        component.set_real(GAIN, [5.0])
    assert component.get_real(GAIN) == [2.0]


def test_a_tunable_parameter_counts_from_the_next_step(component: Gain) -> None:
    started(component)
    component.do_step(0.0, 1.0)
    component.set_real(OFFSET, [10.0])
    assert component.get_real(FORCE) == [1.0] * 6
    state = component._fmu_state_from_bytes(component._fmu_state_to_bytes(component._get_fmu_state()))
    component.do_step(1.0, 1.0)
    assert component.get_real(FORCE) == [12.0] * 6
    component.set_real(OFFSET, [0.0])
    component._set_fmu_state(state)  # which waits for its step
    component.do_step(1.0, 1.0)
    assert component.get_real(FORCE) == [12.0] * 6


def test_settings_of_each_kind(component: Gain) -> None:
    component.set_integer(COUNT, [7])
    component.set_string(WORD, ["b"])
    assert component.get_integer(COUNT) == [7]
    assert component.get_string(WORD) == ["b"]
    assert component.parameter("word") == "b"


@pytest.mark.parametrize("other_parameters", [False, True])
def test_a_serialized_state_continues_in_another_instance(
    component: Gain, other_parameters: bool, tmp_path: Any
) -> None:
    component.set_real(GAIN, [3.0])
    started(component)
    component.set_real(VELOCITY, [0.1] * 6)
    component.do_step(0.0, 0.1)
    stored = Gain._fmu_state_to_bytes(component._get_fmu_state())
    component.do_step(0.1, 0.1)

    other = Gain(instance_name="other", resources=str(tmp_path))
    if other_parameters:
        started(other)
    other._set_fmu_state(Gain._fmu_state_from_bytes(stored))
    other.do_step(0.1, 0.1)
    assert other.get_real(FORCE) == component.get_real(FORCE)
    assert other.parameter("gain") == 3.0


def test_model_description_names_units_dependencies_and_unknowns(component: Gain) -> None:
    root = component.to_xml()
    units = {unit.get("name"): unit[0].attrib for unit in root.iter("Unit")}
    assert units["N.m"] == {"kg": "1", "m": "2", "s": "-2"}
    outputs = root.find("ModelStructure/Outputs")
    unknowns = root.find("ModelStructure/InitialUnknowns")
    assert outputs is not None
    assert unknowns is not None
    assert [node.get("index") for node in outputs] == [str(i + 1) for i in FORCE]
    assert [node.get("index") for node in unknowns] == [str(i + 1) for i in FORCE]
    assert {node.get("dependencies") for node in outputs} == {"1 2 3 4 5 6"}


def test_guid_is_stable_and_tells_interfaces_apart(tmp_path: Any) -> None:
    class Other(Gain):
        table = Gain.table[:-1]

    one = Gain(instance_name="a", resources=str(tmp_path))
    same = Gain(instance_name="b", resources=str(tmp_path))
    assert one.guid == same.guid
    assert one.guid != Other(instance_name="c", resources=str(tmp_path)).guid


def test_another_version_is_refused(tmp_path: Any) -> None:
    (tmp_path / "tlpsim.json").write_text('{"version": "0.0.0", "bundled": false}')
    with pytest.raises(FmuError, match=r"the FMU was built with tlpsim 0\.0\.0.*tlpsim build"):
        Gain(instance_name="old", resources=str(tmp_path))


def test_a_view_must_be_consecutive(component: Gain) -> None:
    with pytest.raises(FmuError, match="not consecutive"):
        component.view("sway")
