"""Checkpoints of runs that are killed: what is resumed repeats the undisturbed run bit for bit."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.errors import StepError, WiringError
from tlpsim.orchestrator.checkpoint import CheckpointError, Checkpoints, read, spooled
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.observers import MemoryRecorder, Observer
from tlpsim.orchestrator.system import Component, Connection, System

MILLISECOND = 1_000_000
SECOND = 1000 * MILLISECOND


def random_walk(name: str, gain: float) -> PythonInstance:
    """A component whose state is a generator of random numbers, which only its saved state can repeat."""

    def step(values: Values, time: float, size: float) -> None:
        generator = values.setdefault("generator", np.random.Generator(np.random.Philox(7)))
        values["y"] = 0.9 * values["y"] + gain * values["u"] + generator.standard_normal()
        values["dy"] = values["y"] - values["u"]

    return PythonInstance(
        name, step, inputs={"u": 0.0}, outputs={"y": 0.0, "dy": 0.0}, parameters={"p": 1.0}, derivatives={"dy": "y"}
    )


def system(algorithm: str = "multirate", parameter: float = 1.0) -> System:
    """A loop of two rates that is fed by a third component which looks ahead, and feeds a fourth."""
    components = [(random_walk("source", 0.0), 300), (random_walk("a", 0.1), 200), (random_walk("b", 0.2), 100)]
    wires = [("source", "sink"), ("a", "b"), ("b", "a")]
    return System(
        components=(
            *(Component(instance=each, step=step * MILLISECOND) for each, step in components),
            Component(instance=random_walk("sink", 0.3), step=70 * MILLISECOND, parameters={"p": parameter}),
        ),
        connections=tuple(Connection(source=a, source_variable="y", target=b, target_variable="u") for a, b in wires),
        algorithm=algorithm,
    )


class Stop(Observer):
    """Ends a run at a time, as a fault or a kill would."""

    def __init__(self, at: int) -> None:
        self.at = at

    def sampled(self, index: int, times: np.ndarray, values: np.ndarray) -> None:
        if times[-1] >= self.at:
            raise KeyboardInterrupt


@pytest.mark.parametrize("algorithm", ["multirate", "parallel", "iterative"])
@pytest.mark.parametrize("interval", [1.0, 0.7, 7.31])
def test_resumed_run_equals_the_undisturbed_one(algorithm: str, interval: float, tmp_path: Path) -> None:
    undisturbed = MemoryRecorder()
    run(system(algorithm), 40 * SECOND, observers=[undisturbed])
    path, every = tmp_path / "run.checkpoint", round(interval * SECOND)
    with pytest.raises(KeyboardInterrupt):
        run(system(algorithm), 40 * SECOND, observers=[Stop(20 * SECOND)], checkpoints=Checkpoints(path, every))
    for at in (30, 41):
        found = read(path)
        assert found.time % every == 0
        recorder = MemoryRecorder()
        checkpoints = Checkpoints(path, every, resumed=found)
        try:
            run(system(algorithm), 40 * SECOND, observers=[recorder, Stop(at * SECOND)], checkpoints=checkpoints)
        except KeyboardInterrupt:
            assert at == 30
    for name in ("source", "a", "b", "sink"):
        assert recorder.ticks(name).tobytes() == undisturbed.ticks(name).tobytes()
        assert recorder.values(name).tobytes() == undisturbed.values(name).tobytes()
    assert list(tmp_path.iterdir()) == []


KILLED = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import test_checkpoint as test
from tlpsim.orchestrator.checkpoint import Checkpoints, read
from tlpsim.orchestrator.execution import run
path = Path(sys.argv[2])
found = read(path) if path.exists() else None
run(test.system(), 4000 * test.SECOND, checkpoints=Checkpoints(path, test.SECOND, resumed=found))
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs POSIX signals")
def test_killed_process_leaves_a_whole_checkpoint(tmp_path: Path) -> None:
    """Killed at a random moment, again and again; benchmarks/master.py does so fifty times."""
    path = tmp_path / "run.checkpoint"
    generator = np.random.Generator(np.random.Philox(3))
    times = [0]
    for _ in range(3):
        process = subprocess.Popen([sys.executable, "-c", KILLED, str(Path(__file__).parent), str(path)])
        while not (path.exists() and read(path).time > times[-1]):
            assert process.poll() is None
        try:
            process.wait(generator.uniform(0.0, 0.2))
        except subprocess.TimeoutExpired:
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
        times.append(read(path).time)
    assert times == sorted(set(times))
    end = times[-1] + 20 * SECOND
    undisturbed, resumed = MemoryRecorder(), MemoryRecorder()
    run(system(), end, observers=[undisturbed])
    run(system(), end, observers=[resumed], checkpoints=Checkpoints(path, SECOND, resumed=read(path)))
    for name in ("source", "a", "b", "sink"):
        assert resumed.values(name).tobytes() == undisturbed.values(name).tobytes()


def test_another_system_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    with pytest.raises(KeyboardInterrupt):
        run(system(), 40 * SECOND, observers=[Stop(20 * SECOND)], checkpoints=Checkpoints(path, SECOND))
    for other in (system(parameter=2.0), system("parallel")):
        with pytest.raises(CheckpointError, match="of another system: an FMU, a parameter, a step or a connection"):
            run(other, 40 * SECOND, checkpoints=Checkpoints(path, SECOND, resumed=read(path)))


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    with pytest.raises(CheckpointError, match=r"no checkpoint can be read .*--checkpoint-every"):
        read(path)
    with pytest.raises(KeyboardInterrupt):
        run(system(), 40 * SECOND, observers=[Stop(20 * SECOND)], checkpoints=Checkpoints(path, SECOND))
    whole, spool = path.read_bytes(), path.with_name(path.name + ".spool")
    for damaged in (b"", whole[:-1], whole[:100] + b"x" + whole[101:], b"tlpsim checkpoint 0\n" + whole[20:]):
        path.write_bytes(damaged)
        with pytest.raises(CheckpointError, match="not a checkpoint of this version, or damaged"):
            read(path)
    path.write_bytes(whole)
    spool.write_bytes(spool.read_bytes()[: read(path).spooled - 8])
    with pytest.raises(CheckpointError, match=r"bytes, .* are needed; start the run afresh"):
        Checkpoints(path, SECOND, resumed=read(path))
    with pytest.raises(CheckpointError, match="ends before"):
        list(spooled(spool, read(path).spooled))
    with pytest.raises(CheckpointError, match="every 0 ns; give a positive interval"):
        Checkpoints(path, 0)


def test_a_component_without_serialized_state_is_named(tmp_path: Path) -> None:
    wired = system()
    wired.components[1].instance.can_serialize_state = False
    with pytest.raises(WiringError, match="no checkpoints of this system: a cannot serialize the state"):
        run(wired, SECOND, checkpoints=Checkpoints(tmp_path / "c", SECOND))


def test_a_failed_step_keeps_the_checkpoint(tmp_path: Path) -> None:
    wired = system()
    whole = wired.components[3].instance
    assert isinstance(whole, PythonInstance)
    inner = whole._step

    def step(values: Values, time: float, size: float) -> None:
        inner(values, time, size)
        if time > 10.0:
            values["y"] = np.nan

    whole._step = step
    path = tmp_path / "run.checkpoint"
    with pytest.raises(StepError, match="sink: output 'y' is nan"):
        run(wired, 40 * SECOND, checkpoints=Checkpoints(path, SECOND))
    assert read(path).time in (9 * SECOND, 10 * SECOND)
