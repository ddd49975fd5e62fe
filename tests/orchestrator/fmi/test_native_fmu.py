"""Native FMUs of FMI 2.0 and 3.0, the same model in both: values, types, states, and every way to fail."""

import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import fmpy
import numpy as np
import pytest
from native_fmu import FAULTS

from tlpsim.loads.errors import DiscardError, FmuError, StepError, WiringError
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.fmi.fmi2 import FmuInstance
from tlpsim.orchestrator.fmi.fmi3 import Fmi3Instance
from tlpsim.orchestrator.fmi.instance_base import FmiInstance
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.system import Component, System

INPUTS = [f"u[{k + 1}]" for k in range(6)]
OUTPUTS = [f"y[{k + 1}]" for k in range(12)]
STEP = 0.1

Start = Callable[..., FmiInstance]


@pytest.fixture(params=[2, 3])
def version(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture
def path(chain_fmu: Callable[[int], Path], version: int) -> Path:
    return chain_fmu(version)


@pytest.fixture
def start(path: Path) -> Iterator[Start]:
    """Function that makes an instance and initializes it; all are freed at the end."""
    instances: list[FmiInstance] = []

    def initialized(
        inputs: list[str] = INPUTS, outputs: list[str] = OUTPUTS, fault: str = "none", **parameters: object
    ) -> FmiInstance:
        instance = open_fmu("hull", path)
        instances.append(instance)
        instance.set_parameters({"fault": FAULTS[fault], **parameters})
        instance.bind(inputs, outputs)
        instance.enter_initialization(0.0)
        instance.exit_initialization()
        return instance

    yield initialized
    for instance in instances:
        instance.free()


def outputs_of(instance: FmiInstance, count: int = 12) -> np.ndarray:
    values = np.empty(count)
    instance.get_outputs(values)
    return values


def expected(inputs: np.ndarray, steps: int) -> np.ndarray:
    """Outputs by the rule in `native_fmu`."""
    y = np.zeros(12)
    for _ in range(steps):
        y = (y + STEP * np.arange(1.0, 13.0) * inputs[np.arange(12) % 6]) / (1.0 + STEP)
    return y


def test_open_fmu_knows_the_version(path: Path, version: int) -> None:
    assert type(open_fmu("hull", path)) is {2: FmuInstance, 3: Fmi3Instance}[version]
    with pytest.raises(FmuError, match=r"open_fmu takes either"):
        {2: Fmi3Instance, 3: FmuInstance}[version]("hull", path)


def test_values(start: Start) -> None:
    instance = start()
    inputs = np.array([1.0, -2.0, 3.0, 0.0, 5.0, 0.5])
    for step in range(20):
        instance.set_inputs(inputs)
        instance.step(step * STEP, STEP)
    np.testing.assert_allclose(outputs_of(instance), expected(inputs, 20), rtol=1e-13)
    instance.terminate()


def test_order_and_choice_of_variables(start: Start) -> None:
    """Elements of arrays that are not bound keep their start values."""
    instance = start(["u[3]", "u[1]"], ["y[9]", "y[1]", "y[2]", "y[9]"], **{"u[2]": 4.0})
    instance.set_inputs(np.array([3.0, 1.0]))
    instance.step(0.0, STEP)
    y = expected(np.array([1.0, 4.0, 3.0, 0.0, 0.0, 0.0]), 1)
    np.testing.assert_allclose(outputs_of(instance, 4), y[[8, 0, 1, 8]], rtol=1e-13)


def test_whole_numbers_and_booleans(start: Start, version: int) -> None:
    names = (["count_in", "flag_in"], ["count", "flag"])
    if version == 3:
        names = (["int32_in", "boolean_in"], ["int32", "boolean"])
    instance = start(["u[1]", *names[0]], [*names[1], "y[1]"])
    for given, shown in (([1.0, -6.6, 0.5], [-7.0, 1.0]), ([0.0, 2.0**31 - 1.0, 0.49], [2.0**31 - 1.0, 0.0])):
        instance.set_inputs(np.array(given))
        instance.step(0.0, STEP)
        assert outputs_of(instance, 3)[:2].tolist() == shown
    for value in (2.0**31, -(2.0**31) - 1.0, np.nan):
        with pytest.raises(
            StepError, match=rf"hull: input '{names[0][0]}' = .* is not within -2147483648 … 2147483647"
        ):
            instance.set_inputs(np.array([0.0, value, 0.0]))
    assert instance.native_calls() is None


def test_text_and_numbers_that_cannot_be_bound(start: Start) -> None:
    start(label="blue")
    for names in (["label"], ["nothing"]):
        with pytest.raises(WiringError, match=f"hull: '{names[0]}' is not a numerical variable"):
            start(inputs=names)
    with pytest.raises(WiringError, match=r"hull: parameter 'fault' = 2147483648 is not within -2147483648 …"):
        start().set_parameters({"fault": 2**31})


def test_native_calls(start: Start, version: int) -> None:
    instance = start(["u[2]", "u[1]"], OUTPUTS)
    calls = instance.native_calls()
    assert calls is not None
    assert calls.version == version
    assert min(calls.instance, calls.set_values, calls.do_step, calls.get_values) > 0
    assert len(calls.inputs) == (2 if version == 2 else 6)
    assert calls.input_places.tolist() == ([0, 1] if version == 2 else [1, 0])
    calls.inputs[calls.input_places] = 5.0, 7.0
    instance.set_inputs(calls.inputs[calls.input_places])
    instance.step(0.0, STEP)
    instance.get_outputs(np.empty(12))
    want = expected(np.array([7.0, 5.0, 0.0, 0.0, 0.0, 0.0]), 1)
    np.testing.assert_allclose(calls.outputs[calls.output_places], want, rtol=1e-13)


@pytest.mark.parametrize("inputs", [[], INPUTS])
def test_native_calls_without_variables(start: Start, inputs: list[str]) -> None:
    calls = start(inputs, []).native_calls()
    assert calls is not None
    assert len(calls.outputs) == len(calls.output_references) == 0


def test_run(path: Path) -> None:
    recorder = MemoryRecorder()
    component = Component(instance=open_fmu("hull", path), step=100_000_000, parameters={"u[1]": 1.0})
    run(System(components=(component,)), 2_000_000_000, observers=[recorder])
    assert recorder.signal("hull", "y[1]")[-1] == pytest.approx(1.0 - 1.1**-20, rel=1e-12)


def test_states(start: Start) -> None:
    instance = start()
    assert instance.can_get_and_set_state
    assert instance.can_serialize_state
    instance.set_inputs(np.arange(6.0))
    instance.step(0.0, STEP)
    state = instance.get_state()
    data = instance.serialize_state(state)
    instance.step(STEP, STEP)
    after = outputs_of(instance)
    other = start()
    for saved in (state, instance.deserialize_state(data)):
        instance.set_state(saved)
        instance.step(STEP, STEP)
        np.testing.assert_array_equal(outputs_of(instance), after)
        instance.free_state(saved)
    copied = other.deserialize_state(data)
    other.set_state(copied)
    other.set_inputs(np.arange(6.0))
    other.step(STEP, STEP)
    np.testing.assert_array_equal(outputs_of(other), after)
    other.free_state(copied)


def test_bad_data_of_a_state(start: Start) -> None:
    with pytest.raises(StepError, match=r"DeSerializeFMUstate|DeserializeFMUState .* returned error"):
        start().deserialize_state(b"too short")


def test_warnings_are_logged_and_not_fatal(start: Start) -> None:
    instance = start(fault="warning", fault_time=0.25)
    for step in range(4):
        instance.step(step * STEP, STEP)
    assert instance.messages == ("t = 0.2 s, warning: the result is rough", "t = 0.3 s, warning: the result is rough")


def test_error(start: Start) -> None:
    instance = start(fault="error", fault_time=0.2)
    instance.step(0.0, STEP)
    with pytest.raises(
        StepError, match=r"^hull: fmi.DoStep of 0\.1 s at t = 0\.1 s returned error: the model cannot go on at 100 %$"
    ):
        instance.step(STEP, STEP)
    instance.terminate()  # is not called after an error


def test_after_a_fatal_status_no_function_is_called(start: Start) -> None:
    instance = start(fault="fatal", fault_time=0.1)
    state = instance.get_state()
    with pytest.raises(StepError, match=r"returned fatal: the model is lost at 100 %"):
        instance.step(0.0, STEP)
    for call in (
        lambda: instance.step(0.0, STEP),
        lambda: instance.set_inputs(np.zeros(6)),
        lambda: outputs_of(instance),
        lambda: instance.set_state(state),
        lambda: instance.set_parameters({}),
    ):
        with pytest.raises(StepError, match="hull: the FMU returned fatal before"):
            call()
    assert instance.native_calls() is None
    assert instance.last_successful_time() is None or instance.version == 3
    instance.terminate()
    instance.free()


def test_a_discarded_step_goes_on_in_smaller_ones(start: Start) -> None:
    instance = start(fault="discard", fault_time=0.2, fault_step=0.06)
    instance.set_inputs(np.ones(6))
    instance.step(0.0, STEP)
    with pytest.raises(DiscardError, match=r"DoStep of 0\.1 s at t = 0\.1 s returned discard: the step is too long$"):
        instance.step(STEP, STEP)
    assert instance.last_successful_time() == pytest.approx(0.15)
    instance.step(0.15, 0.05)
    assert outputs_of(instance)[0] == pytest.approx(1.0 - 1.0 / (1.1 * 1.05**2), rel=1e-12)
    instance.terminate()


def test_pending_is_an_error(start: Start, version: int) -> None:
    if version == 3:
        pytest.skip("FMI 3.0 has no pending")
    with pytest.raises(StepError, match="returned pending"):
        start(fault="pending").step(0.0, STEP)


def test_the_fmu_ends_the_simulation(start: Start) -> None:
    instance = start(fault="terminate")
    with pytest.raises(StepError, match=r"asks for the end of the simulation|ends the simulation"):
        instance.step(0.0, STEP)


def test_early_return(start: Start, version: int) -> None:
    if version == 2:
        pytest.skip("FMI 2.0 has no early return")
    with pytest.raises(
        StepError, match=r"hull: in the step of 0\.1 s at t = 0 s the FMU returned early at t = 0\.1 s; "
    ):
        start(fault="early_return").step(0.0, STEP)


def test_not_a_number(path: Path) -> None:
    component = Component(
        instance=open_fmu("hull", path), step=100_000_000, parameters={"fault": FAULTS["nan"], "fault_time": 0.5}
    )
    with pytest.raises(StepError, match=r"hull: output 'y\[1\]' is nan at t = 0\.5 s"):
        run(System(components=(component,)), 1_000_000_000)


@pytest.mark.parametrize(("fault", "message"), [("error", "cannot go on"), ("fatal", "is lost")])
@pytest.mark.parametrize("outputs", [("y[1]",), None])  # in the compiled loop, and called from Python
def test_failures_in_a_run(path: Path, fault: str, message: str, outputs: tuple[str, ...] | None) -> None:
    parameters = {"fault": FAULTS[fault], "fault_time": 0.5}
    instance = open_fmu("hull", path)
    component = Component(instance=instance, step=100_000_000, parameters=parameters, outputs=outputs)
    with pytest.raises(
        StepError, match=rf"^hull: fmi.DoStep of 0\.1 s at t = 0\.4 s returned {fault}: the .*{message}"
    ) as caught:
        run(System(components=(component,)), 1_000_000_000)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("outputs", [("y[1]",), None])  # in the compiled loop, and called from Python
def test_the_end_of_the_simulation_in_a_run(path: Path, outputs: tuple[str, ...] | None) -> None:
    """The discarded step of FMI 2.0 is not taken for one that can go on."""
    parameters = {"fault": FAULTS["terminate"], "fault_time": 0.5}
    recorder = MemoryRecorder()
    component = Component(instance=open_fmu("hull", path), step=100_000_000, parameters=parameters, outputs=outputs)
    with pytest.raises(StepError, match=r"^hull: .* at t = 0\.4 s .*(the end of|ends) the simulation"):
        run(System(components=(component,)), 1_000_000_000, observers=[recorder])
    assert recorder.ticks("hull")[-1] == 400_000_000


def test_hundreds_of_instances(path: Path) -> None:
    alive = []
    for number in range(400):
        instance = open_fmu(f"hull{number}", path)
        instance.set_parameters({"u[1]": float(number)})
        instance.bind(INPUTS, OUTPUTS)
        instance.enter_initialization(0.0)
        instance.exit_initialization()
        instance.step(0.0, STEP)
        assert outputs_of(instance)[0] == pytest.approx(STEP * number / (1.0 + STEP))
        alive.append(instance)
        if len(alive) > 50:
            alive.pop(0).free()
    for instance in alive:
        instance.terminate()
        instance.free()
        instance.free()  # harmless


def rewritten(path: Path, target: Path, *changes: tuple[bytes, bytes]) -> Path:
    """Copy an FMU with a changed model description."""
    with zipfile.ZipFile(path) as origin, zipfile.ZipFile(target, "w") as archive:
        for name in origin.namelist():
            data = origin.read(name)
            for old, new in changes if name == "modelDescription.xml" else ():
                assert old in data
                data = data.replace(old, new)
            archive.writestr(name, data)
    return target


def test_instantiated_only_once(path: Path, tmp_path: Path) -> None:
    flag = (b"<CoSimulation", b'<CoSimulation canBeInstantiatedOnlyOncePerProcess="true"')
    once = rewritten(path, tmp_path / "once.fmu", flag)
    first, second = open_fmu("a", once), open_fmu("b", once)
    first.set_parameters({})
    with pytest.raises(FmuError, match=r"b: .*once\.fmu can be instantiated only once per process; "):
        second.set_parameters({})
    first.free()
    second.set_parameters({})
    second.free()


@pytest.mark.parametrize(
    ("flag", "message"), [("needsExecutionTool", "needs the tool that made it"), ("hasEventMode", "has an event mode")]
)
def test_refused_instantiation(path: Path, version: int, tmp_path: Path, flag: str, message: str) -> None:
    key = b'guid="' if version == 2 else b'Token="'
    changes = (b"<CoSimulation", f'<CoSimulation {flag}="true"'.encode()), (key, key + b"0")
    refused = rewritten(path, tmp_path / "refused.fmu", *changes)
    with pytest.raises(FmuError, match=rf"hull: .*refused\.fmu cannot be instantiated: .* no reason; it {message}"):
        open_fmu("hull", refused).set_parameters({})


def test_library_without_a_function(path: Path, version: int, tmp_path: Path) -> None:
    """An FMU whose library is that of the other version."""
    folder = {2: fmpy.platform, 3: fmpy.platform_tuple}
    strange = tmp_path / "strange.fmu"
    with zipfile.ZipFile(path) as origin, zipfile.ZipFile(strange, "w") as archive:
        for name in origin.namelist():
            text = origin.read(name)
            if name == "modelDescription.xml":
                old, new = (b'"2.0"', b'"3.0"') if version == 2 else (b'"3.0"', b'"2.0"')
                text = text.replace(b"fmiVersion=" + old, b"fmiVersion=" + new)
            archive.writestr(name.replace(folder[version], folder[5 - version]), text)
    with pytest.raises(FmuError, match=r"hull: the library .* has no function fmi.Instantiate\w*; export"):
        open_fmu("hull", strange).set_parameters({})


def test_library_that_is_none(path: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(path) as origin, zipfile.ZipFile(broken, "w") as archive:
        for name in origin.namelist():
            archive.writestr(name, origin.read(name) if name.endswith(".xml") else b"no library")
    with pytest.raises(FmuError, match=r"hull: the library of .*broken\.fmu cannot be loaded: "):
        open_fmu("hull", broken).set_parameters({})


CRASH = """
import sys
from tlpsim.orchestrator.fmi.opening import open_fmu
instance = open_fmu("hull", sys.argv[1])
instance.set_parameters({"fault": int(sys.argv[2]), "label": "x"})
instance.bind([], ["y[1]"])
instance.enter_initialization(0.0)
instance.exit_initialization()
instance.step(0.0, 0.1)
instance.terminate()
instance.free()
"""


@pytest.mark.parametrize(
    ("fault", "code", "printed"), [("segfault", -11, ""), ("exit", 3, ""), ("print", 0, "the model prints\n")]
)
def test_the_native_fmu_fails_as_it_says(path: Path, version: int, fault: str, code: int, printed: str) -> None:
    if version == 3:
        pytest.skip("one version is enough")
    command = [sys.executable, "-c", CRASH, str(path), str(FAULTS[fault])]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (code, printed)
