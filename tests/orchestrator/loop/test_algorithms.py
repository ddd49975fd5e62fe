"""Order and limits of the coupling algorithms on two masses that are exact but for their coupling."""

import threading
from dataclasses import replace

import numpy as np
import pytest
from linear_systems import SECOND, TwoMasses

from tlpsim.loads.errors import StepError, WiringError
from tlpsim.orchestrator.execution import RunSummary, run
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.system import Adaptation, Component, Connection, System

PROBLEMS = {
    "soft": TwoMasses(),
    "stiff coupling": TwoMasses(masses=(1.0, 1.0), k=20.0),
    "heavy first": TwoMasses(masses=(10.0, 1.0), k=5.0),
    "heavy second": TwoMasses(masses=(1.0, 10.0), k=5.0),
}


def position(
    problem: TwoMasses,
    steps: tuple[int, int],
    algorithm: str,
    extrapolation: str = "derivatives",
    **rule: object,
) -> tuple[np.ndarray, np.ndarray, RunSummary]:
    """Times and position of the first mass over 4 s."""
    recorder = MemoryRecorder()
    summary = run(problem.system(steps, algorithm, extrapolation, **rule), 4 * SECOND, observers=[recorder])
    return recorder.times("first"), recorder.signal("first", "x"), summary


def error(problem: TwoMasses, steps: tuple[int, int], algorithm: str, extrapolation: str = "derivatives") -> float:
    times, found, _ = position(problem, steps, algorithm, extrapolation)
    return float(np.max(np.abs(found - problem.exact(times))))


@pytest.mark.parametrize("ratio", [(1, 1), (5, 1), (1, 5)])
@pytest.mark.parametrize("algorithm", ["multirate", "sequential", "parallel"])
@pytest.mark.parametrize(("extrapolation", "order"), [("hold", 1), ("linear", 2), ("quadratic", 2), ("derivatives", 2)])
def test_order(algorithm: str, extrapolation: str, order: int, ratio: tuple[int, int]) -> None:
    """Inputs are linear over a step, so no extrapolation makes the order higher than two."""
    errors = [error(PROBLEMS["soft"], (h * ratio[0], h * ratio[1]), algorithm, extrapolation) for h in (10, 5)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.12)


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("algorithm", ["multirate", "parallel", "iterative"])
def test_order_whatever_the_ratios_of_mass_and_stiffness(problem: str, algorithm: str) -> None:
    errors = [error(PROBLEMS[problem], (h, h), algorithm) for h in (20, 10)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("acceleration", ["none", "aitken", "quasi_newton"])
def test_iteration_is_the_monolithic_solution_of_a_step(problem: str, acceleration: str) -> None:
    """The equations of both components and their coupling solved together, step by step."""
    found = position(PROBLEMS[problem], (20, 20), "iterative", acceleration=acceleration, tolerance=1e-11)[1]
    np.testing.assert_allclose(found, PROBLEMS[problem].implicit(0.02, 200), atol=1e-9)


def test_iteration_converges_where_the_others_do_not() -> None:
    """A coupling so stiff that the explicit algorithms blow up; the plain iteration does too, and says so."""
    stiff = TwoMasses(masses=(0.2, 1.0), springs=(8.0, 3.0), k=400.0, c=3.0)
    step = 80
    assert error(stiff, (step, step), "multirate") > 1e3
    times, found, summary = position(stiff, (step, step), "iterative", tolerance=1e-10)
    np.testing.assert_allclose(found, stiff.implicit(1e-3 * step, len(times) - 1), atol=1e-8)
    assert any("windows took" in note for note in summary.notes)
    with pytest.raises(StepError, match=r"loop of first, second did not converge in 50 .* choose the .* quasi_newton"):
        position(stiff, (step, step), "iterative", acceleration="none")


@pytest.mark.parametrize("steps", [(50, 10), (10, 50)])
def test_iteration_over_windows_of_several_steps(steps: tuple[int, int]) -> None:
    coarse = error(PROBLEMS["soft"], steps, "iterative")
    fine = error(PROBLEMS["soft"], (steps[0] // 2, steps[1] // 2), "iterative")
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)
    assert coarse < error(PROBLEMS["soft"], steps, "parallel")


def test_iterated_loop_with_a_source_and_a_sink_of_other_rates() -> None:
    """What comes from outside a window looks ahead as elsewhere, and what goes out is what converged."""
    wave = PythonInstance(
        "wave",
        lambda values, time, size: values.update(y=np.sin(time + size)),
        outputs={"y": 0.0},
    )
    ends = {}
    for name in ("a", "b"):
        ends[name] = PythonInstance(
            name,
            lambda values, time, size: values.update(y=0.5 * values["u"] + values["w"]),
            inputs={"u": 0.0, "w": 0.0},
            outputs={"y": 0.0},
        )
    sink = PythonInstance("sink", lambda v, t, h: v.update(y=v["u"]), inputs={"u": 0.0}, outputs={"y": 0.0})
    wires = [("wave", "a", "w"), ("a", "b", "u"), ("b", "a", "u"), ("b", "sink", "u")]
    recorder = MemoryRecorder()
    run(
        System(
            components=tuple(
                Component(instance=each, step=step * SECOND // 100)
                for each, step in ((wave, 30), (ends["a"], 20), (ends["b"], 10), (sink, 10))
            ),
            connections=tuple(
                Connection(source=a, source_variable="y", target=b, target_variable=name) for a, b, name in wires
            ),
            algorithm="iterative",
        ),
        20 * SECOND,
        observers=[recorder],
    )
    # a = b / 2 + w, b = a / 2, hence b = 2 w / 3 where both have samples; the cubic filter leaves 1e-3 at 0.3 s.
    times = recorder.times("sink")
    samples = (np.rint(times * 100).astype(int) % 20 == 0) & (times > 3.0)
    np.testing.assert_allclose(recorder.signal("sink", "y")[samples], np.sin(times[samples]) / 1.5, atol=1e-3)


def test_sequential_goes_with_the_connections() -> None:
    """A chain declared backwards with one connection back: only that one is extrapolated."""
    order: list[str] = []

    def link(name: str) -> PythonInstance:
        def step(values: dict[str, float], time: float, size: float) -> None:
            order.append(name)

        return PythonInstance(name, step, inputs={"u": 0.0, "back": 0.0}, outputs={"y": 0.0})  # type: ignore[arg-type]

    names = "dcba"
    wires = [("a", "b", "u"), ("b", "c", "u"), ("c", "d", "u"), ("a", "c", "back"), ("d", "a", "back")]
    system = System(
        components=tuple(Component(instance=link(name), step=SECOND) for name in names),
        connections=tuple(
            Connection(source=a, source_variable="y", target=b, target_variable=name) for a, b, name in wires
        ),
        algorithm="sequential",
    )
    run(system, SECOND)
    assert order == ["a", "b", "c", "d"]


def adaptive(tolerance: float, longest: int = 64) -> tuple[float, int, str]:
    """Error, number of steps of the first component, and the note, for a light mass on a stiff coupling."""
    problem = TwoMasses(masses=(2.0, 0.05), springs=(1.0, 3.0), k=40.0, c=4.0)
    recorder = MemoryRecorder()
    system = replace(problem.system((5, 5), "adaptive"), adaptation=Adaptation(tolerance=tolerance, longest=longest))
    summary = run(system, 20 * SECOND, observers=[recorder])
    times = recorder.times("first")
    assert np.array_equal(np.diff(recorder.ticks("first")), np.full(len(times) - 1, 5_000_000))
    found = float(np.max(np.abs(recorder.signal("first", "x") - problem.exact(times))))
    return found, summary.components[0].steps, summary.notes[-1]


def test_adaptive_takes_long_steps_where_it_can() -> None:
    coarse, middle, fine = (adaptive(tolerance) for tolerance in (1e-2, 1e-3, 1e-4))
    assert coarse[0] > middle[0] > fine[0]
    assert coarse[1] < middle[1] < fine[1] < 2000
    assert "windows of" in fine[2]
    # Better than equal steps of 0.04 s in about as many.
    problem = TwoMasses(masses=(2.0, 0.05), springs=(1.0, 3.0), k=40.0, c=4.0)
    recorder = MemoryRecorder()
    run(problem.system((40, 40), "sequential"), 20 * SECOND, observers=[recorder])
    equal = float(np.max(np.abs(recorder.signal("first", "x") - problem.exact(recorder.times("first")))))
    assert middle[1] < 1.05 * 500
    assert middle[0] < equal


def test_adaptive_with_single_steps_is_sequential() -> None:
    single = replace(PROBLEMS["soft"].system((20, 20), "adaptive"), adaptation=Adaptation(longest=1))
    recorders = MemoryRecorder(), MemoryRecorder()
    run(single, 4 * SECOND, observers=[recorders[0]])
    run(PROBLEMS["soft"].system((20, 20), "sequential"), 4 * SECOND, observers=[recorders[1]])
    np.testing.assert_array_equal(recorders[0].values("first"), recorders[1].values("first"))


def test_parallel_steps_see_nothing_of_each_other_from_the_first_on() -> None:
    """y = 2 u of the other, held: both double together, also in the step in which the weights are first needed."""

    def one(name: str) -> PythonInstance:
        return PythonInstance(
            name, lambda values, time, size: values.update(y=2.0 * values["u"]), inputs={"u": 0.0}, outputs={"y": 1.0}
        )

    recorder = MemoryRecorder()
    system = System(
        components=tuple(Component(instance=one(name), step=SECOND) for name in "ab"),
        connections=tuple(
            Connection(source=a, source_variable="y", target=b, target_variable="u", extrapolation="hold")
            for a, b in ("ab", "ba")
        ),
        algorithm="parallel",
    )
    run(system, 5 * SECOND, observers=[recorder])
    for name in "ab":
        assert recorder.signal(name, "y").tolist() == [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]


def test_threads_step_together_and_change_nothing() -> None:
    """Each of two components waits in its step until the other one is in its own."""
    meeting = threading.Barrier(2, timeout=20.0)

    def ring(threads: int, wait: bool) -> MemoryRecorder:
        def step(values: Values, time: float, size: float) -> None:
            if wait:
                meeting.wait()
            values["y"] = 0.5 * values["u"] + time + size

        def one(name: str) -> PythonInstance:
            return PythonInstance(name, step, inputs={"u": 0.0}, outputs={"y": 1.0})

        wires = [("a", "b"), ("b", "a")]
        recorder = MemoryRecorder()
        system = System(
            components=tuple(Component(instance=one(name), step=SECOND) for name in "ab"),
            connections=tuple(
                Connection(source=a, source_variable="y", target=b, target_variable="u") for a, b in wires
            ),
            algorithm="parallel",
            threads=threads,
        )
        run(system, 10 * SECOND, observers=[recorder])
        return recorder

    together, after_each_other = ring(2, True), ring(1, False)
    for name in "ab":
        np.testing.assert_array_equal(together.values(name), after_each_other.values(name))


def test_a_failure_in_a_thread_names_the_component() -> None:
    def step(values: Values, time: float, size: float) -> None:
        raise ValueError("no root")

    system = PROBLEMS["soft"].system((20, 20), "parallel")
    system.components[1].instance._step = step  # type: ignore[attr-defined]
    with pytest.raises(StepError, match="second: the step at t = 0 s failed: ValueError: no root"):
        run(replace(system, threads=2), SECOND)


def test_what_cannot_be_iterated_is_refused() -> None:
    system = PROBLEMS["soft"].system((20, 30), "iterative")
    with pytest.raises(WiringError, match=r"'first' .* its step of 0.02 s .* 0.03 s, is not a whole number of it"):
        run(system, SECOND)
    system = PROBLEMS["soft"].system((20, 20), "iterative")
    system.components[1].instance.can_get_and_set_state = False
    with pytest.raises(
        WiringError, match="'second' is in a loop of the algorithm iterative, but cannot save its state"
    ):
        run(system, SECOND)
    with pytest.raises(WiringError, match=r"'first' .* its step of 0.02 s .* 0.04 s, is another"):
        run(PROBLEMS["soft"].system((20, 40), "adaptive"), SECOND)
    with pytest.raises(WiringError, match="algorithm 'jacobi' is not one of multirate, sequential, parallel"):
        run(PROBLEMS["soft"].system((20, 20), "jacobi"), SECOND)
    with pytest.raises(WiringError, match="acceleration 'newton' is not one of none, aitken, quasi_newton"):
        run(PROBLEMS["soft"].system((20, 20), "iterative", acceleration="newton"), SECOND)
