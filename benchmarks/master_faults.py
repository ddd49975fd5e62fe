"""What a run survives: kills, crashes of a component, hostile input, and ten million steps; see `master`."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from report import Row, at_most

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests" / "orchestrator"))

import hostile_input  # noqa: E402
from master_speed import chain  # noqa: E402
from native_fmu import FAULTS, build  # noqa: E402

from tlpsim.loads.errors import TlpsimError  # noqa: E402
from tlpsim.orchestrator.checkpoint import Checkpoints, read  # noqa: E402
from tlpsim.orchestrator.execution import Master, run  # noqa: E402
from tlpsim.orchestrator.fmi.opening import open_fmu  # noqa: E402
from tlpsim.orchestrator.isolation import IsolatedInstance  # noqa: E402
from tlpsim.orchestrator.observers import MemoryRecorder, Observer  # noqa: E402
from tlpsim.orchestrator.ssp.annotations import SystemDescription  # noqa: E402
from tlpsim.orchestrator.system import Component, System  # noqa: E402
from tlpsim.scenarios.assemble import assembled  # noqa: E402
from tlpsim.scenarios.generic import run_system  # noqa: E402
from tlpsim.scenarios.results import open_results  # noqa: E402
from tlpsim.scenarios.schema import Scenario  # noqa: E402

SECOND = 1_000_000_000
STORM, NATIVE = "storm through the built-in FMUs", "three native FMUs"
_DURATIONS = {STORM: 1800 * SECOND, NATIVE: SECOND // 2}
_EVERY = {STORM: 20 * SECOND, NATIVE: SECOND // 50}


# Kills


def checkpointed(case: str, destination: Path, path: Path, undisturbed: bool = False) -> None:
    """Run a case from its last checkpoint on, or without any, and keep all samples in a file (.npz)."""
    recorder = MemoryRecorder()
    stop = _DURATIONS[case]
    checkpoints = None
    if not undisturbed:
        resumed = read(path) if path.exists() else None
        checkpoints = Checkpoints(path, _EVERY[case], resumed=resumed)
    if case == STORM:
        with assembled(Scenario.load(ROOT / "scenarios" / "typical_tlp.toml")) as assembly:
            run(assembly.system, stop, observers=[recorder], checkpoints=checkpoints)
    else:
        run(chain(destination.parent / "chain.fmu"), stop, observers=[recorder], checkpoints=checkpoints)
    whole = destination.with_name(f"whole_{destination.name}")
    np.savez(whole, **{name: recorder.values(name) for name in recorder.names})
    os.replace(whole, destination)


def _start(case: str, destination: Path, path: Path, undisturbed: bool) -> subprocess.Popen[bytes]:
    call = f"checkpointed({case!r}, Path({str(destination)!r}), Path({str(path)!r}), {undisturbed})"
    text = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\nfrom master_faults import *\n{call}"
    return subprocess.Popen([sys.executable, "-c", text])


def kills(quick: bool) -> Sequence[Row]:
    """SIGKILL at random moments of the stepping, each run resumed again and again until it is killed no more."""
    rows = []
    chance = random.Random(8)
    for case, count in ((NATIVE, 3 if quick else 25), (STORM, 2 if quick else 25)):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            shutil.copy(build(folder), folder / "chain.fmu")
            assert not _start(case, folder / "undisturbed.npz", folder / "none", True).wait()
            whole = dict(np.load(folder / "undisturbed.npz"))
            killed = equal = runs = 0
            while killed < count:
                path, result = folder / f"{runs}.checkpoint", folder / f"{runs}.npz"
                runs += 1
                while not result.exists():
                    process = _start(case, result, path, False)
                    if killed < count:
                        killed += _killed(process, path, chance.uniform(0.0, 0.3))
                    if process.wait() not in (0, -signal.SIGKILL):
                        break
                equal += result.exists() and _same(whole, dict(np.load(result)))
        rows.append(
            Row(
                item=f"{case}: runs that equal the undisturbed one bit for bit, with {killed} kills in all",
                measured=f"{equal} of {runs}",
                bound="all",
                ok=equal == runs,
            )
        )
    return rows


def _killed(process: subprocess.Popen[bytes], path: Path, delay: float) -> bool:
    """Kill a run some seconds after it wrote its next checkpoint; False where it came to its end before."""
    written = _written(path)
    while _written(path) == written and process.poll() is None:
        time.sleep(0.001)
    try:
        process.wait(delay)
    except subprocess.TimeoutExpired:
        if path.exists():  # or else all steps are made
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            return path.exists()
    return False


def _written(path: Path) -> int:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def _same(one: dict[str, NDArray[np.float64]], other: dict[str, NDArray[np.float64]]) -> bool:
    return one.keys() == other.keys() and all(one[name].tobytes() == other[name].tobytes() for name in one)


# Crashes


def crashes(quick: bool) -> Sequence[Row]:
    """A component in a process of its own that fails in each way at 0.5 s."""
    rows = []
    mark = f"TLPSIM_BENCHMARK={os.getpid()}"
    os.environ.update([mark.split("=")])  # type: ignore[list-item]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = build(folder)
        for fault in ("segfault", "hang", "exit", "fatal", "nan"):
            instance = IsolatedInstance("hull", path, timeout=2.0)
            parameters = {"fault": FAULTS[fault], "fault_time": 0.5, "u[1]": 1.0}
            component = Component(instance=instance, step=SECOND // 10, parameters=parameters)
            description = SystemDescription(name=fault, system=System(components=(component,)))
            destination = folder / f"{fault}.h5"
            try:
                run_system(description, destination, stop=1.0)
                message = "no error"
            except TlpsimError as error:
                message = str(error)
            part = open_results(destination.with_name(destination.name + ".part"))
            last = float(part.time("hull")[-1])
            clear = "hull" in message and "\n" not in message and (" 0.4 s" in message or " 0.5 s" in message)
            left = _processes(mark)
            rows.append(
                Row(
                    item=f"{fault}: {message.partition(';')[0]}",
                    measured=f"results to {last:.1f} s, {len(left)} processes left",
                    bound="component and time, 0.4 s, 0",
                    ok=clear and abs(last - 0.4) < 1e-9 and not left,
                )
            )
    return rows


def _processes(mark: str) -> list[int]:
    """Running processes with a mark in their environment, after half a second in which they may end."""
    time.sleep(0.5)
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            try:
                if mark.encode() in (entry / "environ").read_bytes().split(b"\0"):
                    found.append(int(entry.name))
            except OSError:
                continue
    return found


# Hostile input


def hostile(quick: bool) -> Sequence[Row]:
    """Damaged FMUs, system descriptions and scenarios: a run, or an error of one line."""
    count = 10 if quick else 40
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        fmus = hostile_input.whole_fmus(folder / "fmus")
        for kind in hostile_input.KINDS:
            (folder / kind).mkdir()
            cases = [(kind, 1000 + seed) for seed in range(count)]
            found = hostile_input.trials(cases, folder / kind, fmus, deep=True)
            faults = [each for each in found if each.end == hostile_input.FAULT]
            refused = sum(each.end == hostile_input.REFUSED for each in found)
            first = f" ({faults[0].seed}: {faults[0].message[:80]})" if faults else ""
            rows.append(
                Row(
                    item=f"{count} damaged inputs, {kind}: neither a run nor an error of one line{first}",
                    measured=f"{len(faults)}; {refused} refused, {len(found) - len(faults) - refused} run",
                    bound="0",
                    ok=not faults,
                )
            )
    return rows


# Soak


class _Count(Observer):
    def __init__(self) -> None:
        self.samples = 0

    def sampled(self, index: int, times: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        self.samples += len(times)


def _memory() -> float:
    """Resident memory in MiB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def soak(quick: bool) -> Sequence[Row]:
    """Many steps of one run, and many short runs."""
    steps, runs = (1_000_000, 100) if quick else (10_000_000, 1000)
    with tempfile.TemporaryDirectory() as name:
        path = build(name)
        counted = _Count()
        system = chain(path)
        master = Master(system, [counted])
        master.initialize()
        step = system.components[0].step
        grown = 0.0
        for part in range(1, 11):
            master.advance(part * steps // 10 * step)
            grown = _memory() if part == 1 else grown
        grown = _memory() - grown
        master.terminate()
        for component in system.components:
            component.instance.free()
        for number in range(runs):
            if number == runs // 10:
                before, handles = _memory(), len(os.listdir("/proc/self/fd"))
            run(System(components=(Component(instance=open_fmu("hull", path), step=step),)), 10 * step)
        lost = len(os.listdir("/proc/self/fd")) - handles
    return [
        Row(item=f"{steps} macro steps: samples", measured=str(counted.samples), ok=counted.samples == 3 * (steps + 1)),
        at_most(f"{steps} macro steps: memory grown over the last nine tenths", grown, 1.0, "MiB", ".2f"),
        at_most(f"{runs} runs: memory grown over the last nine tenths", _memory() - before, 4.0, "MiB", ".2f"),
        at_most(f"{runs} runs: file handles lost", lost, 0, "", "d"),
    ]
