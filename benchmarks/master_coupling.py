"""What components get from each other: orders of the algorithms, interpolation, and rates; see `master`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from report import Row, at_most

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests" / "orchestrator"))

from linear_systems import MILLISECOND, SECOND, TwoMasses  # noqa: E402

from tlpsim.orchestrator.execution import run  # noqa: E402
from tlpsim.orchestrator.instance import PythonInstance, Values  # noqa: E402
from tlpsim.orchestrator.observers import MemoryRecorder  # noqa: E402
from tlpsim.orchestrator.system import Component, Connection, System  # noqa: E402

# Stiffness of the coupling over that of the first spring, and the second mass over the first, of 1/5 to 5.
PROBLEMS = {
    "soft": TwoMasses(),
    "stiff coupling": TwoMasses(masses=(1.0, 1.0), k=20.0),
    "heavy first": TwoMasses(masses=(10.0, 1.0), k=5.0),
    "heavy second": TwoMasses(masses=(1.0, 10.0), k=5.0),
}
DURATION = 4 * SECOND
FREQUENCY = 0.2  # Hz


def position(
    problem: TwoMasses, step: int, algorithm: str, extrapolation: str, **rule: object
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    recorder = MemoryRecorder()
    run(problem.system((step, step), algorithm, extrapolation, **rule), DURATION, observers=[recorder])
    return recorder.times("first"), recorder.signal("first", "x")


def orders(quick: bool) -> Sequence[Row]:
    """Two masses in two components: the order at which the error goes down with the step."""
    rows = []
    steps, tolerance = ((10, 5), 0.3) if quick else ((4, 2), 0.1)
    cases = [(algorithm, name) for algorithm in ("multirate", "sequential", "parallel") for name in WANTED]
    for algorithm, extrapolation in [*cases, ("iterative", "derivatives")]:
        found = []
        for problem in PROBLEMS.values():
            errors = []
            for step in steps:
                times, x = position(problem, step, algorithm, extrapolation)
                errors.append(float(np.max(np.abs(x - problem.exact(times)))))
            found.append(float(np.log2(errors[0] / errors[1])))
        wanted = 2 if algorithm == "iterative" else WANTED[extrapolation]
        continued = "" if algorithm == "iterative" else f", {extrapolation}"
        rows.append(
            Row(
                item=f"two masses, {algorithm}{continued}: order, {len(PROBLEMS)} ratios of mass and stiffness",
                measured=f"{min(found):.2f} to {max(found):.2f}",
                bound=f"{wanted} ± {tolerance}",
                ok=all(abs(order - wanted) <= tolerance for order in found),
            )
        )
    worst = 0.0
    for problem in PROBLEMS.values():
        found_x = position(problem, 20, "iterative", "derivatives", tolerance=1e-11)[1]
        worst = max(worst, float(np.max(np.abs(found_x - problem.implicit(0.02, len(found_x) - 1)))))
    return [*rows, at_most("two masses, iterative less the monolithic solution of the steps", worst, 1e-9, "m")]


WANTED = {"hold": 1, "linear": 2, "quadratic": 2, "derivatives": 2}


def _interpolated(step: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times, and a sine with its derivative that comes every 0.5 s as a component of a smaller step (ns) gets it."""
    omega = 2.0 * np.pi * FREQUENCY

    def give(values: Values, time: float) -> None:
        values.update(y=np.sin(omega * time), dy=omega * np.cos(omega * time))

    wave = PythonInstance(
        "wave",
        lambda values, time, size: give(values, time + size),
        outputs={"y": 0.0, "dy": 0.0},
        initialize=give,
        derivatives={"dy": "y"},
    )
    sink = PythonInstance("sink", lambda v, time, size: v.update(y=v["u"]), inputs={"u": 0.0}, outputs={"y": 0.0})
    recorder = MemoryRecorder()
    system = System(
        components=(Component(instance=wave, step=500 * MILLISECOND), Component(instance=sink, step=step)),
        connections=(Connection(source="wave", source_variable="y", target="sink", target_variable="u"),),
    )
    run(system, 20 * SECOND, observers=[recorder])
    return recorder.times("sink")[1:], recorder.signal("sink", "y")[1:]


def interpolation(quick: bool) -> Sequence[Row]:
    """The cubic filter with derivatives from 0.5 s to 0.1 s."""
    omega = 2.0 * np.pi * FREQUENCY
    times, found = _interpolated(100 * MILLISECOND)
    error = float(np.max(np.abs(found - np.sin(omega * times))))
    basis = np.column_stack([np.sin(omega * times), np.cos(omega * times)])
    sine, cosine = np.linalg.lstsq(basis, found, rcond=None)[0]
    delay = abs(float(np.arctan2(cosine, sine))) / omega
    # one-sided slopes at the samples, of second order
    times, found = _interpolated(MILLISECOND)
    nodes = np.arange(499, len(found) - 3, 500)
    assert np.allclose(times[nodes] % 0.5, 0.0)
    left = (3.0 * found[nodes] - 4.0 * found[nodes - 1] + found[nodes - 2]) / 2e-3
    right = (-3.0 * found[nodes] + 4.0 * found[nodes + 1] - found[nodes + 2]) / 2e-3
    jump = float(np.max(np.abs(left - right))) / omega
    what = f"cubic with derivatives, 0.5 to 0.1 s, {FREQUENCY} Hz"
    return [
        at_most(f"{what}: error over the amplitude", error, 5e-4),
        at_most(f"{what}: delay", delay, 1e-6, "s"),
        at_most(f"{what}: jump of the slope at a sample over the largest slope", jump, 1e-4),
    ]


def causality(quick: bool) -> Sequence[Row]:
    """Components whose outputs are their own times, and what of them the other one gets."""
    rows = []
    for steps in ((100, 300), (200, 300)):
        later, oldest, moves, expected = -np.inf, 0.0, 0, 0
        for algorithm in ("multirate", "sequential", "parallel"):
            for loop in (True, False):
                later_here, oldest_here, moved, wanted = _ages(steps, algorithm, loop)
                later, oldest = max(later, later_here), max(oldest, oldest_here)
                moves, expected = moves + moved, expected + wanted
        text = " and ".join(f"{step / 1000} s" for step in steps)
        rows += [
            at_most(f"rates {text}: a value's own time less that of its use", later, 0.0, "s"),
            at_most(f"rates {text}: age of a value at its use", oldest, sum(steps) / 1000, "s"),
            Row(
                item=f"rates {text}: values that the faster one got anew, over a value each step of the slower one",
                measured=f"{moves} of {expected}",
                bound="all",
                ok=moves == expected,
            ),
        ]
    return rows


def _ages(steps: tuple[int, int], algorithm: str, loop: bool) -> tuple[float, float, int, int]:
    """Largest time of a value less that of its use, largest age, how often the value changed, and how often it could.

    Values are held, so that each is that of a sample; they are for the end of the steps.
    """
    used: dict[str, list[tuple[float, float]]] = {"fast": [], "slow": []}

    def clock(name: str) -> PythonInstance:
        def step(values: Values, time: float, size: float) -> None:
            used[name].append((time + size, values["u"]))
            values["y"] = time + size

        return PythonInstance(name, step, inputs={"u": 0.0}, outputs={"y": 0.0})

    ends = [("slow", "fast"), ("fast", "slow")]
    system = System(
        components=tuple(
            Component(instance=clock(name), step=step * MILLISECOND)
            for name, step in zip(("fast", "slow"), steps, strict=True)
        ),
        connections=tuple(
            Connection(
                source=a, source_variable="y", target=b, target_variable="u", filter="hold", extrapolation="hold"
            )
            for a, b in ends[: 2 if loop else 1]
        ),
        algorithm=algorithm,
    )
    stop = 12 * SECOND
    run(system, stop)
    pairs = [pair for name in ("fast", "slow")[: 2 if loop else 1] for pair in used[name]]
    ages = [time - stamp for time, stamp in pairs]
    stamps = [stamp for _, stamp in used["fast"]]
    moves = sum(abs(a - b) > 1e-6 for a, b in pairwise(stamps))
    # The last value may come at the stop time, which the parallel algorithm does not reach.
    count = stop // (steps[1] * MILLISECOND) - 1
    return -min(ages) if min(ages) < -1e-9 else 0.0, max(ages), min(moves, count), count
