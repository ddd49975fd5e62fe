"""The whole chain: free decay, statics, multi-rate error, repeatability, speed, memory, start-up, bad input.

python benchmarks/chain.py [--quick]
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from report import Row, at_least, at_most, main, within

from tlpsim.fmus.build import build
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import StepError
from tlpsim.orchestrator.clock import to_ticks
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.fmi.fmi2 import FmuInstance
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.observers import MemoryRecorder, Observer
from tlpsim.orchestrator.system import Component, System
from tlpsim.scenarios.results import open_results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.bands import band_statistics

SCENARIO = Path(__file__).parent.parent / "scenarios" / "typical_tlp.toml"
TLPSIM = [sys.executable, "-m", "tlpsim.scenarios.cli"]
# Other seas and winds than the default one, so that no figure rests on one case.
CASES: dict[str, list[str]] = {
    "default storm": [],
    "other seed": ["simulation.seed=77"],
    "JONSWAP Hs 12 m Tp 14 s": ["waves.spectrum=jonswap", "waves.significant_height=12", "waves.peak_period=14"],
    "short sea Hs 4 m Tp 8 s": ["waves.significant_height=4", "waves.peak_period=8", "waves.spectrum=jonswap"],
    "U10 40 m/s across the sea": ["wind.speed=40", "wind.heading_deg=110"],
}


def platform_alone(parameters: dict[str, object], force: dict[str, float], step: float, stop: float) -> MemoryRecorder:
    """Run the platform FMU alone under a constant force."""
    with tempfile.TemporaryDirectory() as folder:
        path = build(Path(folder), ["platform"])[0]
        start = {f"external_force.{degree}": value for degree, value in force.items()}
        recorder = MemoryRecorder()
        component = Component(
            instance=FmuInstance("platform", path), step=to_ticks(step, "step"), parameters=parameters | start
        )
        run(System(components=(component,)), to_ticks(stop, "stop"), observers=[recorder])
        return recorder


def period(times: NDArray[np.float64], motion: NDArray[np.float64]) -> float:
    """Mean time between upward crossings of zero."""
    rises = np.flatnonzero((motion[:-1] < 0.0) & (motion[1:] >= 0.0))
    fraction = motion[rises] / (motion[rises] - motion[rises + 1])
    return float(np.mean(np.diff(times[rises] + fraction * (times[1] - times[0]))))


def free_decay(quick: bool) -> list[Row]:
    rows = []
    for degree, published in {"surge": 103.6, "yaw": 82.7, "heave": 1.82, "pitch": 1.92}.items():
        amplitude = {"surge": 1.0, "yaw": 0.01, "heave": 0.01, "pitch": 1e-4}[degree]
        held: dict[str, object] = {f"free.{other}": False for other in DEGREES_OF_FREEDOM if other != degree}
        for free, others in (("other degrees of freedom held", held), ("all free", {})):
            record = platform_alone(
                {f"initial_position.{degree}": amplitude} | others, {}, 0.1, 6.0 * published // 1 + 1
            )
            found = period(record.times("platform"), record.signal("platform", f"position.{degree}"))
            item = f"free decay, {degree}, {free}"
            bounded = within(item, found, published, 0.02, "s")
            rows.append(bounded if others else Row(item=item, measured=bounded.measured))
    return rows


def statics(quick: bool) -> list[Row]:
    """2.6 MN in surge with critical damping, against Newton's solution of two equations of elastic lines."""
    damping: dict[str, object] = {f"damping_ratio.{degree}": 1.0 for degree in ("surge", "heave", "pitch")}
    record = platform_alone(damping, {"surge": 2.6e6}, 0.5, 1500.0)
    stiffness, pretension, length = 3.37e11, 14.0e6 * 9.80665, 415.0
    waterplane, unstretched = 1025.0 * 9.80665 * 4.0 * np.pi * 8.435**2, length / (1.0 + pretension / stiffness)

    def balance(x: NDArray[np.float64]) -> NDArray[np.float64]:
        line = np.hypot(x[0], length + x[1])
        pull = stiffness * (line / unstretched - 1.0) / line
        return np.array([pull * x[0] - 2.6e6, pull * (length + x[1]) - pretension + waterplane * x[1]])

    x = np.array([7.0, 0.0])
    for _ in range(20):
        jacobian = np.column_stack([(balance(x + d) - balance(x - d)) / 2e-6 for d in 1e-6 * np.eye(2)])
        x = x - np.linalg.solve(jacobian, balance(x))
    tension = stiffness * (np.hypot(x[0], length + x[1]) / unstretched - 1.0)
    at_rest = platform_alone({}, {}, 0.1, 1.0)
    tensions = [f"tendon_tension[{i + 1}]" for i in range(12)]
    found = {name: record.signal("platform", name)[-1] for name in ("position.surge", "position.heave", *tensions)}
    rest = sum(at_rest.signal("platform", name)[0] for name in tensions)
    volume = (40.5e6 * 9.80665 + pretension) / (1025.0 * 9.80665)
    imbalance = abs(rest + 40.5e6 * 9.80665 - 1025.0 * 9.80665 * volume) / (1025.0 * 9.80665 * volume)
    return [
        within("offset under 2.6 MN", found["position.surge"], x[0], 1e-3, "m", ".7g"),
        within("setdown", found["position.heave"], x[1], 1e-3, "m", ".7g"),
        within("total tension", sum(found[name] for name in tensions) / 1e6, tension / 1e6, 1e-3, "MN", ".7g"),
        at_most("tension + weight against buoyancy, relative", imbalance, 1e-9),
    ]


def motions(overrides: Sequence[str]) -> tuple[NDArray[np.float64], float]:
    """Standard deviation of each degree of freedom: total, low and wave frequency, shape (6, 3); and wall time."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        results = run_scenario(Scenario.load(SCENARIO, overrides), Path(folder) / "r.h5")
        wall = time.perf_counter() - began
        times = results.time("platform")
        found = [
            band_statistics(times, results.signal(f"platform.position.{degree}"), start=600.0)
            for degree in DEGREES_OF_FREEDOM
        ]
    return np.array([[s.std, s.low_frequency, s.wave_frequency] for s in found]), wall


def multi_rate(quick: bool) -> list[Row]:
    rows = []
    duration = f"simulation.duration={1800 if quick else 10800}"
    finest = ["components.wave.step=0.1", "components.wind.step=0.1"]
    motions([f"simulation.duration={60}"])  # load and compile
    for case, changes in list(CASES.items())[: 1 if quick else None]:
        reference, wall = motions([duration, *changes, *finest])
        rows.append(Row(item=f"{case}: every component at 0.1 s", measured=f"{wall:.2f} s"))
        for name in ("hold", "linear", "cubic", "quintic"):
            found, wall = motions([duration, *changes, f"coupling.filter={name}"])
            error = 100.0 * np.abs(found / reference - 1.0).max(axis=0)
            worst = DEGREES_OF_FREEDOM[int(np.argmax(np.abs(found / reference - 1.0)[:, 0]))]
            item = f"{case}: {name}, largest error of a standard deviation"
            measured = f"{error[0]:.3f} % ({worst}; LF {error[1]:.2f}, WF {error[2]:.2f} %), {wall:.2f} s"
            bounded = name == "cubic"
            rows.append(
                Row(
                    item=item,
                    measured=measured,
                    bound="≤ 1 %" if bounded else "",
                    ok=error[0] <= 1.0 if bounded else None,
                )
            )
    return rows


def repeatability(quick: bool) -> list[Row]:
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{k}.h5" for k in range(2)]
        for path in paths:
            subprocess.run(
                [*TLPSIM, "run", str(SCENARIO), "-o", str(path), "--duration", "600" if quick else "3600"],
                check=True,
                capture_output=True,
            )
        one, other = (open_results(path) for path in paths)
        different = [
            f"{component}.{name}"
            for component in one.components
            for name in one.signals(component)
            if one.signal(f"{component}.{name}").tobytes() != other.signal(f"{component}.{name}").tobytes()
        ]
        count = sum(len(one.signals(component)) for component in one.components)
    item = f"same seed in another process: signals that differ, of {count}"
    return [Row(item=item, measured=str(len(different)), bound="0, bit for bit", ok=not different)]


class Watch(Observer):
    """Wall time of the first step, and the largest memory at a quarter of the run and at its end."""

    def __init__(self, quarter: int) -> None:
        self.began = self.stepping = time.perf_counter()
        self.quarter = quarter
        self.memory = 0
        self.started_stepping = False

    def sampled(self, index: int, times: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        tick = int(times[-1])
        if not self.started_stepping and tick > 0:
            self.started_stepping = True
            self.stepping = time.perf_counter()
        if not self.memory and tick >= self.quarter:
            self.memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


_STORM = """
import resource, sys, time
sys.path.insert(0, {here!r})
from chain import SCENARIO, Watch
from pathlib import Path
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
watch = Watch({duration} * 10**9 // 4)
run_scenario(Scenario.load(SCENARIO, ["simulation.duration={duration}"]), Path({path!r}), observers=[watch])
end = time.perf_counter()
grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - watch.memory
print(end - watch.began, end - watch.stepping, grown / 1024)
"""


def storm(quick: bool) -> list[Row]:
    """Wall time and memory of a 3-hour storm, in a process of its own, median of three."""
    duration = 3600 if quick else 10800
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        script = _STORM.format(here=str(Path(__file__).parent), duration=duration, path=str(Path(folder) / "r.h5"))
        for _ in range(1 if quick else 3):
            done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
            figures.append([float(word) for word in done.stdout.split()])
    whole, stepping, grown = (statistics.median(column) for column in zip(*figures, strict=True))
    return [
        at_least(
            f"storm of {duration} s, speed from loading the FMUs on", duration / whole, 500.0, "× real time", ".0f"
        ),
        Row(item="of that, stepping alone", measured=f"{duration / stepping:.0f} × real time"),
        at_most("memory grown over the last three quarters of it", grown, 8.0, "MiB", ".1f"),
    ]


def start_up(quick: bool) -> list[Row]:
    def median_time(command: Sequence[str]) -> float:
        walls = []
        for _ in range(5):
            began = time.perf_counter()
            subprocess.run(command, check=True, capture_output=True)
            walls.append(time.perf_counter() - began)
        return statistics.median(walls)

    with tempfile.TemporaryDirectory() as folder:
        first = [*TLPSIM, "run", str(SCENARIO), "-o", str(Path(folder) / "r.h5"), "--duration", "1"]
        subprocess.run(first, check=True, capture_output=True)
        return [
            at_most("tlpsim --help, median of 5", median_time([*TLPSIM, "--help"]), 0.5, "s", ".2f"),
            at_most("warm run of 1 simulated second, whole command, median of 5", median_time(first), 3.0, "s", ".2f"),
        ]


BAD_INPUT: dict[str, list[str]] = {
    "unknown key": ["--set", "waves.height=3"],
    "wrong unit": ["--set", "wind.speed=20 kg"],
    "wrong unit of a connection": ["--set", 'connections={"wind.velocity.surge"={from="platform.position.surge"}}'],
    "missing FMU": ["--set", "components.wave.fmu=nowhere.fmu"],
    "corrupted zip": ["--set", "components.wave.fmu={corrupted}"],
    "step that does not divide": ["--set", "components.wave.step=0.35"],
    "connection to a variable that does not exist": [
        "--set",
        'connections={"platform.wave_force.surge"={from="wave.force.sruge"}}',
    ],
}


def bad_input(quick: bool) -> list[Row]:
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        corrupted = folder / "corrupted.fmu"
        corrupted.write_bytes(b"PK\x03\x04 this is no archive")
        for item, arguments in BAD_INPUT.items():
            output = folder / "r.h5"
            filled = [argument.replace("{corrupted}", str(corrupted)) for argument in arguments]
            done = subprocess.run(
                [*TLPSIM, "run", str(SCENARIO), "-o", str(output), "--duration", "10.5", *filled]
                if "divide" in item
                else [*TLPSIM, "run", str(SCENARIO), "-o", str(output), "--duration", "10", *filled],
                capture_output=True,
                text=True,
                check=False,
            )
            lines = done.stderr.strip().splitlines()
            ok = done.returncode == 2 and len(lines) == 1 and not list(folder.glob("r.h5*"))
            rows.append(
                Row(item=f"{item}: lines, exit code", measured=f"{len(lines)}, {done.returncode}", bound="1, 2", ok=ok)
            )
    return [*rows, not_a_number()]


def not_a_number() -> Row:
    """A component that gives NaN from t = 0.5 s on is named with its variable and the time."""

    def step(values: Values, time: float, size: float) -> None:
        values["y"] = float("nan") if time + size > 0.45 else 1.0

    component = Component(instance=PythonInstance("faulty", step, outputs={"y": 1.0}), step=to_ticks(0.1, "step"))
    try:
        run(System(components=(component,)), to_ticks(1.0, "stop"))
        message = "no error"
    except StepError as error:
        message = str(error)
    ok = all(word in message for word in ("faulty", "'y'", "0.5 s"))
    return Row(item="NaN from a component", measured=message.partition(",")[0], bound="names all three", ok=ok)


if __name__ == "__main__":
    main("The chain", [free_decay, statics, multi_rate, repeatability, storm, start_up, bad_input])
