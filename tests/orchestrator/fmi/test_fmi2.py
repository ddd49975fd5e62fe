"""FMUs: a real one made of Python, whose failures are chosen by a parameter, and files that are not FMUs."""

import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.errors import FmuError, StepError, WiringError
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.fmi.description import read_description
from tlpsim.orchestrator.fmi.fmi2 import FmuInstance
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.system import Component, Connection, System

SECOND = 1_000_000_000
STEP = SECOND // 10

SCRIPT = '''
import ctypes
# pythonfmu releases a reference to this module's globals that it does not own
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String


class Oscillator(Fmi2Slave):
    """x'' = force - gain x by the symplectic Euler method; `mode` chooses a failure at t = 0.5 s."""

    description = "test oscillator"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.force = 0.0
        self.x = 1.0
        self.v = 0.0
        self.gain = 1.0
        self.mode = 0
        self.loud = False
        self.label = "none"
        fixed = dict(causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed)
        self.register_variable(Real("force", causality=Fmi2Causality.input))
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        self.register_variable(Real("v", causality=Fmi2Causality.output))
        self.register_variable(Real("gain", **fixed))
        self.register_variable(Integer("mode", **fixed))
        self.register_variable(Boolean("loud", **fixed))
        self.register_variable(String("label", **fixed))

    def to_xml(self, model_options={}):
        root = super().to_xml(model_options)
        reals = {item.get("name"): item.find("Real") for item in root.iter("ScalarVariable")}
        reals["x"].set("unit", "m")
        reals["v"].set("unit", "m/s")
        reals["v"].set("derivative", "2")
        return root

    def exit_initialization_mode(self):
        if self.mode == 5:
            raise ValueError("gain %s is refused: 100 %d")
        if self.label != "none":
            self.log(f"label is {self.label}")

    def do_step(self, time, size):
        if time + size >= 0.5:
            if self.mode == 1:
                raise RuntimeError("line 1\\\\nthe solver diverged")
            if self.mode == 2:
                return False
            if self.mode == 3:
                self.x = float("nan")
                return True
        self.v += size * (self.force - self.gain * self.x)
        self.x += size * self.v
        return True
'''

BUILD = """
import sys
from pythonfmu.builder import FmuBuilder
FmuBuilder.build_FMU(sys.argv[1], dest=sys.argv[2], canGetAndSetFMUstate=True, canSerializeFMUstate=True)
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fmu")
    script = folder / "orchestrator_test_oscillator.py"
    script.write_text(SCRIPT)
    # in a process of its own, because the builder imports the script and leaves it in sys.modules
    subprocess.run([sys.executable, "-c", BUILD, str(script), str(folder)], check=True, capture_output=True)
    return folder / "Oscillator.fmu"


def single(path: Path, **parameters: object) -> System:
    return System(components=(Component(instance=FmuInstance("hull", path), step=STEP, parameters=parameters),))


def test_description(path: Path) -> None:
    description = read_description(path)
    assert description.model_name == "Oscillator"
    assert description.fmi_version == "2.0"
    assert description.generation_tool.startswith("PythonFMU")
    assert description.description == "test oscillator"
    assert len(description.sha256) == 64
    assert description.capabilities["canGetAndSetFMUstate"]
    assert not description.capabilities["canInterpolateInputs"]
    velocity = description.variables["v"]
    assert (velocity.causality, velocity.type, velocity.unit) == ("output", "Real", "m/s")
    assert velocity.derivative_of == "x"
    assert description.variables["mode"].type == "Integer"
    assert description.variables["gain"].start == 1.0
    assert description.variables["label"].variability == "fixed"
    assert FmuInstance("hull", path).describe()["sha256"] == description.sha256


def oscillator(gain: float, steps: int) -> np.ndarray:
    x, v, result = 1.0, 0.0, [1.0]
    for _ in range(steps):
        v += 0.1 * (0.0 - gain * x)
        x += 0.1 * v
        result.append(x)
    return np.array(result)


def test_run_gives_what_the_model_computes(path: Path) -> None:
    recorder = MemoryRecorder()
    summary = run(single(path, gain=2.5), 10 * SECOND, observers=[recorder])
    # the same operations in the same order: equal to the last bit
    np.testing.assert_array_equal(recorder.signal("hull", "x"), oscillator(2.5, 100))
    assert summary.notes == ("input hull.force is not connected and keeps its start value",)


def test_input_keeps_its_start_value(path: Path) -> None:
    recorder = MemoryRecorder()
    summary = run(single(path, force=1.0), 2 * SECOND, observers=[recorder])
    assert recorder.signal("hull", "x").tolist() == [1.0] * 21  # in equilibrium
    assert summary.notes == ()


def test_two_instances_coupled_through_the_master(path: Path) -> None:
    link = Connection(source="a", source_variable="v", target="b", target_variable="force")
    recorder = MemoryRecorder()
    run(
        System(
            components=(
                Component(instance=FmuInstance("a", path), step=3 * STEP),
                Component(instance=FmuInstance("b", path), step=STEP),
            ),
            connections=(link,),
        ),
        3 * SECOND,
        observers=[recorder],
    )
    assert np.ptp(recorder.signal("b", "x")) > 0.0
    assert recorder.times("b")[-1] == 3.0


@pytest.mark.parametrize(
    ("mode", "message"),
    [
        (1, r"hull: fmi2DoStep of 0\.1 s at t = 0\.4 s returned fatal: RuntimeError.*the solver diverged"),
        (2, r"hull: fmi2DoStep of .* returned discard; it asks for the end of the simulation"),
        (3, r"hull: output 'x' is nan at t = 0\.5 s"),
    ],
)
def test_failures_of_a_step(path: Path, mode: int, message: str) -> None:
    with pytest.raises(StepError, match=message) as caught:
        run(single(path, mode=mode), SECOND)
    assert "\n" not in str(caught.value)


def test_failing_initialization_gives_the_message_of_the_fmu(path: Path) -> None:
    """The message holds percent signs, which must not be taken for a format."""
    with pytest.raises(FmuError, match=r"hull: .*ValueError.*gain %s is refused: 100 %d") as caught:
        run(single(path, mode=5), SECOND)
    assert "\n" not in str(caught.value)


def test_log_messages_are_kept_and_not_printed(path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    instance = FmuInstance("hull", path)
    system = System(components=(Component(instance=instance, step=STEP, parameters={"label": "blue"}),))
    run(system, SECOND)
    assert instance.messages == ("t = 0 s, ok: label is blue",)
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"gian": 1.0}, "hull: no variable 'gian' to set as a parameter; nearest match: 'gain'"),
        ({"x": 1.0}, "hull: 'x' is output, continuous, and cannot be set"),
        ({"mode": 1.0}, r"hull: parameter 'mode' = 1\.0 is not of the type Integer"),
    ],
)
def test_parameter_faults(path: Path, parameters: dict[str, object], message: str) -> None:
    with pytest.raises(WiringError, match=message):
        run(single(path, **parameters), SECOND)


def test_parameters_of_every_type(path: Path) -> None:
    run(single(path, gain=np.float64(2.0), mode=0, loud=True, label="x"), SECOND)


def test_state_is_restored_exactly(path: Path) -> None:
    instance = FmuInstance("hull", path)
    instance.set_parameters({})
    instance.bind(["force"], ["x", "v"])
    instance.enter_initialization(0.0)
    instance.exit_initialization()
    try:
        after, again = np.empty(2), np.empty(2)
        instance.step(0.0, 0.1)
        state = instance.get_state()
        data = instance.serialize_state(state)
        instance.step(0.1, 0.1)
        instance.get_outputs(after)
        for saved in (state, instance.deserialize_state(data)):
            instance.set_state(saved)
            instance.step(0.1, 0.1)
            instance.get_outputs(again)
            np.testing.assert_array_equal(again, after)
            instance.free_state(saved)
    finally:
        instance.terminate()
        instance.free()
        instance.free()  # harmless


def test_many_instances_in_one_process(path: Path) -> None:
    for _ in range(4):
        components = tuple(Component(instance=FmuInstance(f"hull{number}", path), step=STEP) for number in range(50))
        summary = run(System(components=components), STEP)
        assert all(component.steps == 1 for component in summary.components)


def test_copy_of_an_fmu_is_the_same_fmu(path: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.fmu"
    copy.write_bytes(path.read_bytes())
    run(single(path), STEP)
    run(single(copy), STEP)


def rewritten(path: Path, target: Path, old: str, new: str, omit: str = "nothing") -> Path:
    """Copy an FMU with a changed model description, and without members whose names hold `omit`."""
    with zipfile.ZipFile(path) as origin, zipfile.ZipFile(target, "w") as archive:
        for name in origin.namelist():
            if omit in name:
                continue
            data = origin.read(name)
            if name == "modelDescription.xml":
                assert old in data.decode()
                data = data.replace(old.encode(), new.encode())
            archive.writestr(name, data)
    return target


@pytest.mark.parametrize(
    ("old", "new", "omit", "message"),
    [
        ('fmiVersion="2.0"', 'fmiVersion="3.0"', "no member", r"of FMI version 3\.0, not 2\.0; .*open_fmu"),
        ("CoSimulation", "ModelExchange", "no member", r"for model exchange only; open it with .*model_exchange"),
        ("fmiVersion", "fmiVersion", "binaries", "no binary binaries/.* the FMU has no binaries"),
        ("fmiVersion", "fmiVersion", "modelDescription", r"holds no modelDescription\.xml"),
        ("<ModelVariables>", "<ModelVariables", "no member", r"modelDescription\.xml: the XML cannot be parsed"),
        ('valueReference="0"', 'valueReference="zero"', "no member", "'force' has the malformed valueReference 'zero'"),
    ],
)
def test_unsuitable_fmus(path: Path, tmp_path: Path, old: str, new: str, omit: str, message: str) -> None:
    broken = rewritten(path, tmp_path / "broken.fmu", old, new, omit)
    with pytest.raises(FmuError, match=message) as caught:
        FmuInstance("hull", broken)
    assert str(broken) in str(caught.value)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(FmuError, match=r"nothing\.fmu: the FMU cannot be opened: No such file"):
        FmuInstance("hull", tmp_path / "nothing.fmu")


def test_file_that_is_no_zip_file(tmp_path: Path) -> None:
    text = tmp_path / "text.fmu"
    text.write_text("not an FMU")
    with pytest.raises(FmuError, match=r"text\.fmu: the file is not an FMU, or damaged: .*; export it again"):
        FmuInstance("hull", text)


def test_truncated_file(path: Path, tmp_path: Path) -> None:
    broken = tmp_path / "short.fmu"
    data = path.read_bytes()
    broken.write_bytes(data[: len(data) // 2])
    with pytest.raises(FmuError, match="not an FMU, or damaged"):
        FmuInstance("hull", broken)


def test_damaged_member(path: Path, tmp_path: Path) -> None:
    """The directory of the archive is whole, but the library's bytes are not."""
    broken = tmp_path / "damaged.fmu"
    data = bytearray(path.read_bytes())
    with zipfile.ZipFile(path) as archive:
        member = next(item for item in archive.infolist() if item.filename.endswith(".so"))
    position = member.header_offset + 200
    data[position : position + 64] = bytes(64 * [255])
    broken.write_bytes(data)
    with pytest.raises(FmuError, match=r"damaged\.fmu: the file is not a zip archive, or damaged"):
        run(single(broken), STEP)


def test_native_and_python_fmus_in_one_process(path: Path, chain_fmu: Callable[[int], Path]) -> None:
    """A Python FMU, and native ones of both versions, in one loop."""
    names = ("a", "b", "c")
    files = dict(zip(names, (path, chain_fmu(2), chain_fmu(3)), strict=True))
    links = (("a", "x", "b", "u[1]"), ("b", "y[1]", "c", "u[1]"), ("c", "y[1]", "a", "force"))
    results = []
    for _ in range(2):
        recorder = MemoryRecorder()
        run(
            System(
                components=tuple(Component(instance=open_fmu(name, files[name]), step=STEP) for name in names),
                connections=tuple(
                    Connection(
                        source=source,
                        source_variable=output,
                        target=target,
                        target_variable=into,
                        suppress_unit_conversion=True,
                    )
                    for source, output, target, into in links
                ),
            ),
            2 * SECOND,
            observers=[recorder],
        )
        results.append(recorder.signal("a", "x"))
    assert np.ptp(results[0]) > 0.1
    np.testing.assert_array_equal(results[0], results[1])
