"""The three FMUs through FMI, by FMPy: a tool that knows nothing of tlpsim."""

import json
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

from tlpsim.fmus.build import build
from tlpsim.loads.errors import FmuError

NAMES = ("wind", "wave", "platform")
PARAMETERS: dict[str, dict[str, Any]] = {
    "wind": {"mean_speed": 25.0, "heading": 0.5, "seed": 3},
    "wave": {"significant_height": 6.0, "peak_period": 12.0, "current_speed": 0.5, "seed": 4, "components": 50},
    "platform": {"initial_position.surge": 5.0, "initial_position.yaw": 0.02},
}
_extracted: dict[Path, tuple[str, Any]] = {}


class Slave:
    """An FMI 2.0 instance addressed by names."""

    def __init__(self, path: Path) -> None:
        # A second extraction of one Python FMU in a process fails: pythonfmu keeps the first module.
        if path not in _extracted:
            _extracted[path] = (fmpy.extract(str(path)), fmpy.read_model_description(str(path)))
        folder, self.description = _extracted[path]
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.outputs = [v.valueReference for v in self.description.modelVariables if v.causality == "output"]
        self.fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="instance",
        )
        self.fmu.instantiate()

    def initialize(self, parameters: dict[str, Any]) -> None:
        self.fmu.setupExperiment(startTime=0.0)
        for name, value in parameters.items():
            self.set(name, value)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set(self, name: str, value: Any) -> None:
        variable = self.variables[name]
        getattr(self.fmu, f"set{variable.type}")([variable.valueReference], [value])

    def get(self, name: str) -> float:
        return float(self.fmu.getReal([self.variables[name].valueReference])[0])

    def step(self, time: float, size: float) -> list[float]:
        self.fmu.doStep(time, size)
        return list(self.fmu.getReal(self.outputs))


@pytest.fixture
def slave(fmus: dict[str, Path]) -> Iterator[Callable[..., Slave]]:
    made: list[Slave] = []

    def make(name: str, parameters: dict[str, Any] | None = None) -> Slave:
        one = Slave(fmus[name])
        one.initialize(parameters or {})
        made.append(one)  # after a fatal status FMI allows no further call, so only now
        return one

    yield make
    for one in made:
        one.fmu.terminate()
        one.fmu.freeInstance()


@pytest.mark.parametrize("name", NAMES)
def test_fmpy_finds_nothing_to_complain_of(fmus: dict[str, Path], name: str) -> None:
    assert validate_fmu(str(fmus[name])) == []


@pytest.mark.parametrize("name", NAMES)
def test_every_real_variable_has_a_defined_unit(fmus: dict[str, Path], name: str) -> None:
    description = fmpy.read_model_description(str(fmus[name]))
    defined = {unit.name for unit in description.unitDefinitions}
    assert {v.unit for v in description.modelVariables if v.type == "Real"} <= defined
    assert len(description.initialUnknowns) == len(description.outputs) > 0


def test_motion_outputs_say_whose_derivative_they_are(fmus: dict[str, Path]) -> None:
    variables = {v.name: v for v in fmpy.read_model_description(str(fmus["platform"])).modelVariables}
    assert variables["velocity.yaw"].derivative.name == "position.yaw"
    assert variables["acceleration.heave"].derivative.name == "velocity.heave"


@pytest.mark.parametrize("name", NAMES)
def test_runs_alone_in_fmpy(fmus: dict[str, Path], name: str) -> None:
    result = fmpy.simulate_fmu(str(fmus[name]), stop_time=2.0, output_interval=0.1, start_values=PARAMETERS[name])
    assert len(result) == 21
    values = np.array(result.tolist())
    assert np.all(np.isfinite(values))
    assert np.ptp(values[:, 1]) > 0.0


@pytest.mark.parametrize("name", NAMES)
def test_state_set_back_repeats_every_output_exactly(slave: Callable[..., Slave], name: str) -> None:
    one = slave(name, PARAMETERS[name])
    for k in range(50):
        one.step(0.5 * k, 0.5)
    state = one.fmu.getFMUState()
    later = [one.step(25.0 + 0.5 * k, 0.5) for k in range(40)]
    one.fmu.setFMUState(state)
    assert [one.step(25.0 + 0.5 * k, 0.5) for k in range(40)] == later
    one.fmu.freeFMUState(state)


@pytest.mark.parametrize("name", NAMES)
def test_serialized_state_continues_in_a_fresh_instance(slave: Callable[..., Slave], name: str) -> None:
    one = slave(name, PARAMETERS[name])
    for k in range(20):
        one.step(0.5 * k, 0.5)
    state = one.fmu.getFMUState()
    data = one.fmu.serializeFMUstate(state)
    later = [one.step(10.0 + 0.5 * k, 0.5) for k in range(20)]
    other = slave(name)  # with default parameters: the state brings its own
    other.fmu.setFMUState(other.fmu.deSerializeFMUstate(data))
    assert [other.step(10.0 + 0.5 * k, 0.5) for k in range(20)] == later


@pytest.mark.parametrize("name", ["wind", "wave"])
def test_realization_does_not_depend_on_the_communication_step(slave: Callable[..., Slave], name: str) -> None:
    coarse, fine = slave(name, PARAMETERS[name]), slave(name, PARAMETERS[name])
    for k in range(20):
        at_coarse = coarse.step(2.0 * k, 2.0)
        for i in range(20):
            at_fine = fine.step(2.0 * k + 0.1 * i, 0.1)
        np.testing.assert_allclose(at_fine, at_coarse, rtol=1e-9, atol=1e-6)


def test_five_hundred_instances_in_one_process(fmus: dict[str, Path]) -> None:
    # In a process of its own, where a crash of pythonfmu's library is a failure of this test alone.
    script = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
from test_fmus import Slave
paths = [Path(p) for p in {[str(p) for p in fmus.values()]!r}]
alive = []
for k in range(500):
    one = Slave(paths[k % 3])
    if k % 20 < 3:
        one.initialize({{}})
        one.step(0.0, 0.5)
    alive.append(one)
    if k % 2:
        alive.pop(0).fmu.freeInstance()
print("instances", k + 1)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.strip() == "instances 500"


def test_two_builds_are_equal_and_one_can_replace_the_other(fmus: dict[str, Path], tmp_path: Path) -> None:
    again = build(tmp_path, ["wave"])[0]
    assert again.read_bytes() == fmus["wave"].read_bytes()
    assert build(tmp_path, ["wave"])[0] == again
    assert [path.name for path in tmp_path.iterdir()] == ["wave.fmu"]


def test_build_into_an_impossible_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FmuError, match="cannot make folder"):
        build(tmp_path / "file" / "below")


def test_bundle_runs_where_tlpsim_is_not_installed(tmp_path: Path) -> None:
    path = build(tmp_path, ["platform"], bundle=True)[0]
    with zipfile.ZipFile(path) as archive:
        assert json.loads(archive.read("resources/tlpsim.json"))["bundled"] is True
        assert "resources/tlpsim/loads/issc_tlp.py" in archive.namelist()
    script = f"""
import importlib.abc, sys
sys.meta_path = [finder for finder in sys.meta_path if "editable" not in repr(finder)]
sys.path = [entry for entry in sys.path if "__editable__" not in entry]

class NotInstalled(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        # Let only the copy that the FMU brings along be found.
        if name == "tlpsim" and not any("/resources" in entry for entry in sys.path):
            raise ModuleNotFoundError("No module named 'tlpsim'")

sys.meta_path.insert(0, NotInstalled())
try:
    import tlpsim.loads
except ModuleNotFoundError:
    print("not installed")
import fmpy
result = fmpy.simulate_fmu({str(path)!r}, stop_time=1.0, step_size=0.1, start_values={{"initial_position.surge": 1.0}})
import tlpsim.loads
print("resources" in tlpsim.loads.__file__, result["position.surge"][-1] < 1.0)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.stdout.split("\n")[:2] == ["not installed", "True True"], done.stderr[-2000:]


def test_sum_of_the_wave_force_is_that_of_its_parts(slave: Callable[..., Slave]) -> None:
    one = slave("wave", PARAMETERS["wave"])
    for k in range(5):
        one.step(0.5 * k, 0.5)
        for degree in ("surge", "heave", "yaw"):
            parts = sum(one.get(f"{part}.{degree}") for part in ("diffraction", "viscous", "drift"))
            assert one.get(f"force.{degree}") == pytest.approx(parts, rel=1e-12)


def test_calm_water_gives_no_force(slave: Callable[..., Slave]) -> None:
    wave = slave("wave", {"significant_height": 0.0})
    assert wave.step(0.0, 0.5) == [0.0] * len(wave.outputs)


def test_still_air_gives_no_force_at_rest(slave: Callable[..., Slave]) -> None:
    wind = slave("wind", {"mean_speed": 0.0})
    assert wind.step(0.0, 1.0) == [0.0] * len(wind.outputs)


# Published figures of the ISSC TLP: a free decay with one degree of freedom, the others held.
PERIODS = {"surge": 103.6, "yaw": 82.7, "heave": 1.82, "pitch": 1.92}


@pytest.mark.parametrize(("degree", "published"), PERIODS.items())
def test_free_decay_has_the_published_period(slave: Callable[..., Slave], degree: str, published: float) -> None:
    amplitude = {"surge": 1.0, "yaw": 0.01, "heave": 0.01, "pitch": 1e-4}[degree]
    held = {f"free.{other}": False for other in ("surge", "sway", "heave", "roll", "pitch", "yaw") if other != degree}
    one = slave("platform", {f"initial_position.{degree}": amplitude} | held)
    step = published / 200.0 if published < 10.0 else 0.5
    times = step * np.arange(1, round(4.2 * published / step))
    motion = []
    for time in times:
        one.step(time - step, step)
        motion.append(one.get(f"position.{degree}"))
    rises = np.flatnonzero((np.array(motion[:-1]) < 0.0) & (np.array(motion[1:]) >= 0.0))
    crossings = [times[i] - step * motion[i] / (motion[i + 1] - motion[i]) for i in rises]
    assert np.mean(np.diff(crossings)) == pytest.approx(published, rel=0.02)


def test_static_offset_is_that_of_elastic_lines(slave: Callable[..., Slave]) -> None:
    """2.6 MN in surge on a platform critically damped, against the balance solved here by bisection."""
    force = 2.6e6
    one = slave("platform", {f"damping_ratio.{d}": 1.0 for d in ("surge", "heave", "pitch")})
    one.set("external_force.surge", force)
    for k in range(3000):
        one.step(0.5 * k, 0.5)

    # Four groups of lines that stay parallel (pitch is 1e-5 rad): T x/l = F, T z/l = pretension - rho g A heave.
    stiffness, pretension, length, waterplane = 3.37e11, 14.0e6 * 9.80665, 415.0, 4.0 * np.pi * 8.435**2
    unstretched = length / (1.0 + pretension / stiffness)

    def at(offset: float) -> tuple[float, float, float]:
        low, high = -1.0, 0.0
        for _ in range(200):
            heave = 0.5 * (low + high)
            line = np.hypot(offset, length + heave)
            tension = stiffness * (line / unstretched - 1.0)
            vertical = tension * (length + heave) / line - (pretension - 1025.0 * 9.80665 * waterplane * heave)
            low, high = (heave, high) if vertical < 0.0 else (low, heave)
        return tension * offset / line, heave, tension

    low, high = 0.0, 20.0
    for _ in range(200):
        offset = 0.5 * (low + high)
        low, high = (offset, high) if at(offset)[0] < force else (low, offset)
    _, heave, tension = at(offset)
    assert one.get("position.surge") == pytest.approx(offset, rel=1e-3)
    assert one.get("position.heave") == pytest.approx(heave, rel=1e-3)
    total = sum(one.get(f"tendon_tension[{i + 1}]") for i in range(12))
    assert total == pytest.approx(tension, rel=1e-3)


def test_tensions_and_weight_balance_buoyancy_at_rest(slave: Callable[..., Slave]) -> None:
    one = slave("platform")
    total = sum(one.get(f"tendon_tension[{i + 1}]") for i in range(12))
    weight = 40.5e6 * 9.80665
    assert total + weight == pytest.approx(1025.0 * 9.80665 * one.get("displaced_volume"), rel=1e-9)


def test_failing_initializations_leave_the_process_sound(fmus: dict[str, Path]) -> None:
    """pythonfmu logs whole tracebacks, which no part of the way to our message may take for a printf format."""
    script = f"""
import faulthandler
faulthandler.enable()
import numpy as np
from tlpsim.loads.errors import TlpsimError
from tlpsim.orchestrator.fmi.fmi2 import FmuInstance
for _ in range(100):
    instance = FmuInstance("wave", {str(fmus["wave"])!r})
    instance.set_parameters({{"current_speed": -1.0, "spectrum": "100 %n %s" * 400, "components": 3}})
    instance.bind([], ["force.surge"])
    try:
        instance.enter_initialization(0.0)
        instance.exit_initialization()
    except TlpsimError as error:
        message = str(error)
    instance.free()
print(len(message.splitlines()), "%n" in message)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "1 True"), done.stderr[-2000:]
