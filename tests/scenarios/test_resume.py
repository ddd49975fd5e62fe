"""Runs that are killed or interrupted and go on: their results are those of an undisturbed run, bit for bit."""

import os
import random
import signal
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest
from typer.testing import CliRunner

from tlpsim.loads.errors import ScenarioError, TlpsimError, WiringError
from tlpsim.orchestrator.checkpoint import CheckpointError, Checkpoints, read
from tlpsim.orchestrator.fmi.log import Message, parsed
from tlpsim.orchestrator.observers import Observer
from tlpsim.scenarios.cli.main import app
from tlpsim.scenarios.generic import opened, run_system
from tlpsim.scenarios.progress import RunWatcher
from tlpsim.scenarios.results import Results, open_results
from tlpsim.scenarios.resume import (
    checkpoint_path,
    checkpointed,
    hint,
    interrupted,
    resume,
    scenario_request,
    system_request,
)
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario

COMMAND = [sys.executable, "-m", "tlpsim.scenarios.cli"]
SECOND = 1_000_000_000


class Stop(Observer):
    """Ends a run at a time (s), as Ctrl-C does."""

    def __init__(self, at: float) -> None:
        self.at = at

    def sampled(self, index: int, times: np.ndarray, values: np.ndarray) -> None:
        if times[-1] >= self.at * SECOND:
            raise KeyboardInterrupt


def assert_same(one: Results, other: Results) -> None:
    assert one.complete
    assert other.complete
    for component in one.components:
        assert one.signals(component) == other.signals(component)
        assert one.time(component).tobytes() == other.time(component).tobytes()
        for name in (f"{component}.{variable}" for variable in one.signals(component)):
            assert one.signal(name).tobytes() == other.signal(name).tobytes(), name


def wait_for_checkpoint(process: subprocess.Popen[bytes], path: Path, after: int) -> int:
    """Time of the first checkpoint later than another, ns."""
    deadline = monotonic() + 120.0
    while not path.exists() or read(path).time <= after:
        assert process.poll() is None, process.communicate()
        assert monotonic() < deadline
        sleep(0.01)
    return read(path).time


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs POSIX signals")
def test_a_run_that_is_killed_twice_gives_the_same_bits(scenario_file: Path, tmp_path: Path) -> None:
    """The second time while it goes on; the interval is not a multiple of any step."""
    undisturbed = run_scenario(Scenario.load(scenario_file, ["simulation.duration=2000"]), tmp_path / "whole.h5")
    output, chance = tmp_path / "r.h5", random.Random(11)
    first = [*COMMAND, "run", "short.toml", "-o", "r.h5", "--duration", "2000", "--checkpoint-every", "33.37"]
    time = 0
    for command in (first, [*COMMAND, "resume", str(output)]):
        folder = tmp_path if command is first else Path("/")
        process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        time = wait_for_checkpoint(process, checkpoint_path(output), time)
        sleep(chance.uniform(0.0, 0.1))
        process.kill()
        process.communicate()
        assert open_results(f"{output}.part").status == "running"
    told = subprocess.run([*COMMAND, "resume", str(output)], capture_output=True, text=True, check=True).stdout
    begin = float(told.split("goes on at t = ")[1].split()[0])
    assert time / SECOND <= begin < 2000.0
    assert "of 2000 s" in told
    assert "surge, m" in told
    assert_same(undisturbed, open_results(output))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["r.h5", "short.toml", "whole.h5"]


def interrupted_chain(chain: Path, folder: Path) -> Path:
    """Results file of two FMUs, named relative to the folder, that were stopped at 7 s of 10."""
    (folder / "chain.fmu").write_bytes(chain.read_bytes())
    texts = (["a=chain.fmu", "b=chain.fmu"], ["a.flag=b.u[1]"], ["0.1", "b=0.25"], ["a.flag_in=true", "a.u[2]=0.3"])
    output = folder / "r.h5"
    with (
        pytest.raises(KeyboardInterrupt),
        opened(*texts) as description,
        checkpointed(output, 0.7, system_request(*texts, 1.0, 10.0)) as checkpoints,
    ):
        run_system(description, output, 10.0, 1.0, [Stop(7.0)], checkpoints)
    return output


def test_a_system_goes_on_from_any_folder(chain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    output = interrupted_chain(chain, tmp_path)
    assert hint(output) == f"; go on with: tlpsim resume {output}"
    monkeypatch.chdir("/")
    found = interrupted(output)
    assert found.stop == 10.0
    assert 1.0 < found.time <= 7.0
    results = resume(found)
    assert Path.cwd() == Path("/")
    with opened(
        [f"a={chain}", f"b={chain}"], ["a.flag=b.u[1]"], ["0.1", "b=0.25"], ["a.flag_in=true", "a.u[2]=0.3"]
    ) as description:
        assert_same(run_system(description, tmp_path / "whole.h5", 10.0, 1.0), results)
    assert hint(output) == ""
    assert sorted(path.name for path in tmp_path.iterdir()) == ["chain.fmu", "r.h5", "whole.h5"]


def test_ctrl_c_says_how_to_go_on(scenario_file: Path, tmp_path: Path, listening: Callable[[], None]) -> None:
    output = tmp_path / "r.h5"
    command = [*COMMAND, "run", str(scenario_file), "-o", str(output), "--duration", "1e6", "--checkpoint-every", "10"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, preexec_fn=listening)
    wait_for_checkpoint(process, checkpoint_path(output), 0)
    with pytest.raises(CheckpointError, match="a run is writing it; wait until it has ended"):
        interrupted(output)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert told.decode().strip() == (
        f"tlpsim: interrupted; the samples so far are in {output}.part; open it with: tlpsim info {output}.part; "
        f"go on with: tlpsim resume {output}"
    )


# Refusals


def test_what_cannot_be_resumed(chain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CheckpointError, match=r"none\.h5\.checkpoint: no checkpoint can be read .*--checkpoint-every"):
        interrupted("none.h5")
    output = interrupted_chain(chain, tmp_path)
    checkpoint, names = checkpoint_path(output), sorted(path.name for path in tmp_path.iterdir())

    with (
        pytest.raises(CheckpointError, match=r"can go on from here by `tlpsim resume .*; delete .* to start afresh"),
        checkpointed(output, 1.0, {}),
    ):
        pass
    with zipfile.ZipFile("chain.fmu", "a") as archive:
        archive.writestr("documentation/index.html", "changed")
    with pytest.raises(CheckpointError, match="is of another system: an FMU, a parameter, a step or a connection"):
        resume(interrupted(output))
    Path("chain.fmu").rename("elsewhere.fmu")
    with pytest.raises(TlpsimError, match=r"chain\.fmu"):
        resume(interrupted(output))
    Path("elsewhere.fmu").rename("chain.fmu")
    assert sorted(path.name for path in tmp_path.iterdir()) == names

    output.write_bytes(b"complete")
    os.utime(output, ns=(checkpoint.stat().st_mtime_ns + 1,) * 2)
    with pytest.raises(CheckpointError, match=r"complete and newer than its checkpoint; .* delete .*r\.h5\.checkpoint"):
        interrupted(output)
    os.utime(output, ns=(checkpoint.stat().st_mtime_ns - 1,) * 2)  # of an earlier run, to be replaced
    assert interrupted(output).time > 0.0
    checkpoint.unlink()
    with pytest.raises(CheckpointError, match="no checkpoint beside it, so there is nothing to resume"):
        interrupted(output)


def test_a_checkpoint_of_another_program_or_folder(
    chain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a").mkdir()
    monkeypatch.chdir(tmp_path / "a")
    output = interrupted_chain(chain, tmp_path / "a")
    (tmp_path / "a").rename(tmp_path / "b")
    with pytest.raises(CheckpointError, match=r"the run began in .*a, which is no longer there; restore it"):
        interrupted(tmp_path / "b" / output.name)
    monkeypatch.chdir(tmp_path)
    checkpoints = Checkpoints(checkpoint_path("r.h5"), SECOND)
    with opened([f"a={chain}"], steps=["0.1"]) as description, pytest.raises(KeyboardInterrupt):
        run_system(description, "r.h5", 10.0, observers=[Stop(7.0)], checkpoints=checkpoints)
    with pytest.raises(CheckpointError, match="was not written by `tlpsim run`"):
        interrupted("r.h5")


def test_runs_without_a_state_are_refused_and_leave_nothing(
    chain: Path, scenario_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with zipfile.ZipFile(chain) as archive, zipfile.ZipFile("mute.fmu", "w") as mute:
        for name in archive.namelist():
            mute.writestr(name, archive.read(name).replace(b'canSerializeFMUstate="true"', b""))
    scenario = Scenario.load(scenario_file)
    before = sorted(tmp_path.iterdir())
    with (
        pytest.raises(ScenarioError, match="a monolithic run has none: leave one out"),
        checkpointed("r.h5", 1.0, scenario_request(scenario)) as checkpoints,
    ):
        run_scenario(scenario, "r.h5", monolithic=True, checkpoints=checkpoints)
    for interval, error, message in (
        ("1", WiringError, "no checkpoints of this system: mute cannot serialize the state .* run it without"),
        ("0", WiringError, "--checkpoint-every: 0.0 s is not positive"),
        ("soon", ScenarioError, "--checkpoint-every is 'soon'"),
    ):
        arguments = ["run", "mute.fmu", "--step", "1", "--stop", "5", "-o", "r.h5", "--checkpoint-every", interval]
        told = CliRunner().invoke(app, arguments)
        assert isinstance(told.exception, error)
        assert told.exception.args
        with pytest.raises(error, match=message):
            raise told.exception
    assert sorted(tmp_path.iterdir()) == before


# What is shown


def test_progress_goes_on_where_the_run_does(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(100))
    monkeypatch.setattr("tlpsim.scenarios.progress.monotonic", lambda: float(next(clock)))
    shown: list[tuple[float, float, str]] = []
    watcher = RunWatcher(lambda *what: shown.append(what), 100.0, begin=60.0)
    for time in (10, 60):
        watcher.sampled(0, np.array([time * SECOND]), np.zeros((1, 1)))
        assert shown == []
    watcher.sampled(0, np.array([72 * SECOND]), np.zeros((1, 1)))
    assert shown == [(72.0, 100.0, "72 of 100 s, 4 × real time")]  # 12 s in the 3 since the start


def warnings_of(*arguments: object) -> list[str]:
    done = subprocess.run([*COMMAND, "run", *map(str, arguments)], capture_output=True, text=True, check=True)
    return [line for line in done.stderr.splitlines() if "rough" in line]


def test_messages_of_fmus_are_shown_once(chain: Path, tmp_path: Path) -> None:
    """The FMU warns in each step, of b from another time on than of a."""
    settings = [word for text in ("a.fault=8", "b.fault=8", "b.fault_time=4") for word in ("--set", text)]
    rates = ("--step", "1", "--stop", "50")
    assert warnings_of(f"a={chain}", f"b={chain}", *settings, *rates, "-o", tmp_path / "r.h5") == [
        "tlpsim: a: t = 0 s, warning: the result is rough",
        "tlpsim: b: t = 3 s, warning: the result is rough",
    ]


def test_messages_of_a_process_of_its_own_are_shown_too(chain: Path, scenario_file: Path, tmp_path: Path) -> None:
    gauge = f'components.gauge={{fmu = "{chain}", step = 1.0, isolation = "process", parameters = {{fault = 8}}}}'
    shown = warnings_of(scenario_file, "--set", gauge, "-o", tmp_path / "r.h5")
    assert shown == ["tlpsim: gauge: t = 0 s, warning: the result is rough"]


def test_an_fmu_that_talks_is_cut_short(capsys: pytest.CaptureFixture[str]) -> None:
    watcher = RunWatcher(lambda *what: None, 100.0, 0.0)
    for number in range(100):
        watcher.tell(Message(component="a", time=float(number), status=number % 2, text=f"x = {number // 2}"))
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "tlpsim: a: t = 1 s, warning: x = 0"
    assert lines[-1] == "tlpsim: a: further messages are not shown"
    assert len(lines) == 11


def test_a_message_is_read_from_its_line() -> None:
    message = Message(component="a", time=0.3, status=3, text="no: [way]")
    assert parsed("a", str(message)) == message
    for line in ("", "no", "t = 3 s, all is well", "warning: 3"):
        assert parsed("a", line) is None
