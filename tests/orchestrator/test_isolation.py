"""A component in a process of its own: the same numbers; its crash is an error; nothing is left behind."""

import functools
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import misbehaving
import numpy as np
import pytest
from native_fmu import FAULTS

from tlpsim.loads.errors import DiscardError, FmuError, StepError, TlpsimError, WiringError
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.fmi.fmi2 import FmuInstance
from tlpsim.orchestrator.instance import Instance
from tlpsim.orchestrator.isolation import IsolatedInstance
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.system import Component, Connection, System

SECOND = 1_000_000_000
STEP = SECOND // 10

Chain = Callable[[int], Path]


MARK = f"TLPSIM_ISOLATION_TEST={os.getpid()}"


def processes() -> set[int]:
    """Numbers of the running processes that a test started, or that these started."""
    found = set()
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            try:
                environment = (entry / "environ").read_bytes().split(b"\0")
            except OSError:
                continue
            if MARK.encode() in environment:
                found.add(int(entry.name))
    return found


def settled(condition: Callable[[], bool], limit: float = 10.0) -> bool:
    end = time.monotonic() + limit
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


@pytest.fixture(autouse=True)
def _nothing_is_left_behind(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    monkeypatch.setenv(*MARK.split("="))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    descriptors = len(os.listdir("/proc/self/fd"))
    yield
    assert settled(lambda: not processes())
    assert not list(tmp_path.glob("tlpsim_isolated_*"))
    assert len(os.listdir("/proc/self/fd")) <= descriptors
    with pytest.raises(ChildProcessError):
        os.waitpid(-1, os.WNOHANG)  # no child, not even one that has ended


def isolated(misbehaviour: str = "none", timeout: float = 20.0) -> IsolatedInstance:
    return IsolatedInstance("hull", functools.partial(misbehaving.component, misbehaviour), timeout)


def single(instance: Instance, **parameters: object) -> System:
    return System(components=(Component(instance=instance, step=STEP, parameters=parameters),))


def started(instance: Instance) -> Instance:
    instance.set_parameters({})
    instance.bind(["u"], ["x"])
    instance.enter_initialization(0.0)
    instance.exit_initialization()
    return instance


def chain_of_two(path: Path, make: Callable[[str, Path], Instance]) -> tuple[np.ndarray, np.ndarray]:
    links = [
        Connection(
            source=a,
            source_variable=f"y[{k}]",
            target=b,
            target_variable=f"u[{k}]",
            extrapolation="linear",
            suppress_unit_conversion=True,
        )
        for a, b in (("a", "b"), ("b", "a"))
        for k in (1, 2, 3)
    ]
    recorder = MemoryRecorder()
    start = {"u[4]": 1.0, "u[5]": -0.5}
    components = (
        Component(instance=make("a", path), step=3 * STEP, parameters=start),
        Component(instance=make("b", path), step=STEP, parameters=start),
    )
    run(System(components=components, connections=tuple(links)), 5 * SECOND, observers=[recorder])
    return recorder.values("a"), recorder.values("b")


def test_same_results_to_the_last_bit(chain_fmu: Chain) -> None:
    expected = chain_of_two(chain_fmu(2), FmuInstance)
    found = chain_of_two(chain_fmu(2), IsolatedInstance)
    assert np.ptp(expected[0]) > 0.0
    for a, b in zip(expected, found, strict=True):
        np.testing.assert_array_equal(a, b)


def test_description_without_a_process(chain_fmu: Chain) -> None:
    plain, instance = FmuInstance("hull", chain_fmu(2)), IsolatedInstance("hull", chain_fmu(2))
    assert instance.variables == plain.variables
    assert (instance.arrays, instance.units) == (plain.arrays, plain.units)
    assert instance.can_get_and_set_state
    assert instance.can_serialize_state
    assert instance.describe() == {**plain.describe(), "isolation": "process"}
    assert not processes()
    instance.free()


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (
            "segfault",
            r"hull: the component was ended by SIGSEGV \(segmentation fault\) while stepping at t = 0\.4 s; its log is",
        ),
        (
            "hang",
            r"hull: the component gave no answer within 0\.5 s \(set a longer timeout.*\) while stepping at t = 0\.4 s",
        ),
        ("exit", r"hull: the component ended its process with exit status 3 while stepping at t = 0\.4 s"),
        ("fatal", r"hull: fmi2DoStep of 0\.1 s at t = 0\.4 s returned fatal: the model is lost at 100 %"),
        ("nan", r"hull: output 'y\[1\]' is nan at t = 0\.5 s"),
    ],
)
def test_five_faults(chain_fmu: Chain, fault: str, message: str) -> None:
    recorder = MemoryRecorder()
    system = single(IsolatedInstance("hull", chain_fmu(2), timeout=0.5), fault=FAULTS[fault], fault_time=0.5)
    with pytest.raises(StepError, match=message) as caught:
        run(system, SECOND, observers=[recorder])
    assert "\n" not in str(caught.value)
    assert recorder.times("hull")[-1] == 0.4


def test_errors_keep_their_class_and_text(chain_fmu: Chain) -> None:
    for parameters in ({"fualt": 1}, {"y[1]": 1.0}, {"fault": 1.5}):
        with pytest.raises(WiringError) as plain:
            run(single(FmuInstance("hull", chain_fmu(2)), **parameters), SECOND)
        with pytest.raises(WiringError, match=f"^{re.escape(str(plain.value))}$"):
            run(single(IsolatedInstance("hull", chain_fmu(2)), **parameters), SECOND)
    instance = started(isolated("discard"))
    with pytest.raises(DiscardError, match=r"^hull: the step of 0\.1 s at t = 0\.3 s is discarded$"):
        instance.step(0.3, 0.1)
    assert instance.last_successful_time() is None
    instance.free()
    with pytest.raises(FmuError, match=r"nothing\.fmu: the FMU cannot be opened"):
        IsolatedInstance("hull", "nothing.fmu")


def test_log_is_in_the_message() -> None:
    with pytest.raises(StepError, match=r"hull: .*SIGSEGV.*at t = 0\.3 s; its log ends: about to read at 0$"):
        run(single(isolated("crash")), SECOND)


def test_messages_of_an_fmu_are_in_its_log(chain_fmu: Chain) -> None:
    plain, instance = FmuInstance("hull", chain_fmu(2)), IsolatedInstance("hull", chain_fmu(2))
    for each in (plain, instance):
        run(single(each, fault=FAULTS["warning"], fault_time=0.8), SECOND)
    assert len(instance.messages) == 3
    assert instance.messages[-1].endswith("warning: the result is rough")


def test_exception_of_the_component() -> None:
    message = r"hull: the component failed with ZeroDivisionError: float division by zero while stepping at t = 0\.3 s"
    with pytest.raises(StepError, match=message + r"; its log ends: .*misbehaving\.py.*") as caught:
        run(single(isolated("exception")), SECOND)
    assert "\n" not in str(caught.value)


def test_exit_of_python() -> None:
    with pytest.raises(StepError, match="ended its process with exit status 5 while stepping"):
        run(single(isolated("sys.exit")), SECOND)


def test_component_that_cannot_be_made() -> None:
    instance = IsolatedInstance("hull", misbehaving.broken)
    for _ in range(2):
        with pytest.raises(FmuError, match="hull: the component failed with RuntimeError: no licence while loading"):
            instance.set_parameters({})
    instance.free()
    with pytest.raises(FmuError, match="hull: what makes the instance cannot be handed to a process"):
        IsolatedInstance("hull", lambda: misbehaving.component())


def test_process_that_cannot_be_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with pytest.raises(FmuError, match=r"hull: no process can be started for the component: .*No such file"):
        isolated().set_parameters({})


def test_failed_instance_stays_so() -> None:
    instance = started(isolated("exit"))
    with pytest.raises(StepError, match="exit status 7"):
        instance.step(0.3, 0.1)
    with pytest.raises(StepError, match="exit status 7"):
        instance.step(0.3, 0.1)
    instance.terminate()
    instance.free_state(object())
    instance.free()
    instance.free()


def test_whatever_it_started_ends_with_it() -> None:
    with pytest.raises(StepError, match="no answer"):
        run(single(isolated("hang with a helper", timeout=0.5)), SECOND)


def test_standard_output_goes_to_the_log(chain_fmu: Chain, capfd: pytest.CaptureFixture[str]) -> None:
    instance = IsolatedInstance("hull", chain_fmu(2))
    run(single(instance, fault=FAULTS["print"], fault_time=0.8), SECOND)
    assert instance.messages == 3 * ("the model prints",)
    other = isolated("print")
    run(single(other), SECOND)
    assert other.messages == 7 * ("a line for people",)
    assert capfd.readouterr() == ("", "")


def test_state(chain_fmu: Chain) -> None:
    instance = IsolatedInstance("hull", chain_fmu(2))
    instance.set_parameters({})
    instance.bind(["u[1]"], ["y[1]"])
    instance.enter_initialization(0.0)
    instance.exit_initialization()
    before, after, again = np.empty(1), np.empty(1), np.empty(1)
    instance.set_inputs(np.ones(1))
    instance.step(0.0, 0.1)
    instance.get_outputs(before)
    state = instance.get_state()
    data = instance.serialize_state(state)
    instance.step(0.1, 0.1)
    instance.get_outputs(after)
    for saved in (state, instance.deserialize_state(data)):
        instance.set_state(saved)
        instance.get_outputs(again)
        np.testing.assert_array_equal(again, before)
        instance.step(0.1, 0.1)
        instance.get_outputs(again)
        np.testing.assert_array_equal(again, after)
        instance.free_state(saved)
    with pytest.raises(StepError, match="hull: int is not a state of this component"):
        instance.set_state(1)
    with pytest.raises(StepError, match="hull: the state is released"):
        instance.set_state(state)
    instance.free()


def test_inputs_wait_for_the_next_call() -> None:
    instance, x = started(isolated()), np.empty(1)
    instance.set_inputs(np.array([3.0]))
    state = instance.get_state()
    instance.set_inputs(np.array([5.0]))
    instance.set_state(state)
    instance.step(0.0, 0.5)
    instance.get_outputs(x)
    assert x[0] == 1.5
    instance.free()


def test_component_runs_in_another_process() -> None:
    recorder = MemoryRecorder()
    run(single(isolated()), SECOND, observers=[recorder])
    numbers = recorder.signal("hull", "process")
    assert len(set(numbers)) == 1
    assert numbers[0] != os.getpid()


def test_interrupt_ends_the_process() -> None:
    instance = started(isolated("hang"))
    previous = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.3)
    try:
        with pytest.raises(KeyboardInterrupt):
            instance.step(0.3, 0.1)
    finally:
        signal.signal(signal.SIGALRM, previous)
    with pytest.raises(TlpsimError, match="hull: the component was interrupted while stepping"):
        instance.get_outputs(np.empty(1))
    instance.free()


def test_instance_that_is_forgotten() -> None:
    started(isolated())


PARENT = """
import functools, sys, misbehaving
from tlpsim.orchestrator.isolation import IsolatedInstance
instances = [IsolatedInstance("hull", functools.partial(misbehaving.component, kind)) for kind in ("none", "hang")]
for instance in instances:
    instance.set_parameters({})
    instance.bind(["u"], ["x"])
    instance.enter_initialization(0.0)
    instance.exit_initialization()
print("ready", flush=True)
instances[int(sys.argv[1])].step(0.3, 0.1)
sys.stdin.read()
"""


def environment(folder: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(Path(__file__).parent), "TMPDIR": str(folder)}


@pytest.mark.parametrize("stepped", [0, 1])
def test_killed_master_leaves_no_process(stepped: int, tmp_path: Path) -> None:
    """One component waits for a call; the other one waits as well, or hangs in its step."""
    command = [sys.executable, "-c", PARENT, str(stepped)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment(tmp_path)) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline() == b"ready\n"
        time.sleep(0.2)
        assert len(processes()) == 3
        parent.kill()
    assert settled(lambda: not processes())


def test_master_that_ends_without_freeing(tmp_path: Path) -> None:
    command = [sys.executable, "-c", PARENT, "0"]
    subprocess.run(command, input=b"", env=environment(tmp_path), check=True, capture_output=True)
    assert not processes()
    assert not list(tmp_path.iterdir())
