"""Who steps when; causality; failures; a loop against its monolithic solution."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from tlpsim.loads.errors import FmuError, StepError, TlpsimError, WiringError
from tlpsim.orchestrator.execution import Master, run
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.observers import MemoryRecorder, Observer
from tlpsim.orchestrator.system import Component, Connection, System

MILLISECOND = 1_000_000
SECOND = 1000 * MILLISECOND


def clock_component(name: str, order: list[tuple[str, float]] | None = None) -> PythonInstance:
    """A component that gives its own time and notes what it receives: the time stamp of a value."""

    def step(values: Values, time: float, size: float) -> None:
        if order is not None:
            order.append((name, time))
        values["stamp"] = time + size
        values["received"] = values["u"]

    return PythonInstance(name, step, inputs={"u": 0.0}, outputs={"stamp": 0.0, "received": 0.0})


def pair(first_step: int, second_step: int, order: list[tuple[str, float]] | None = None) -> System:
    """Two clock components that feed each other, with hold everywhere."""
    link = Connection(
        source="first",
        source_variable="stamp",
        target="second",
        target_variable="u",
        filter="hold",
        extrapolation="hold",
    )
    return System(
        components=(
            Component(instance=clock_component("first", order), step=first_step * MILLISECOND),
            Component(instance=clock_component("second", order), step=second_step * MILLISECOND),
        ),
        connections=(link, replace(link, source="second", target="first")),
    )


@pytest.mark.parametrize("steps", [(100, 300), (300, 100), (200, 300), (300, 200), (100, 100)])
def test_values_are_used_at_or_after_their_own_time(steps: tuple[int, int]) -> None:
    recorder = MemoryRecorder()
    run(pair(*steps), 12 * SECOND, observers=[recorder])
    for name, other in (("first", 1), ("second", 0)):
        times, stamps = recorder.times(name)[1:], recorder.signal(name, "received")[1:]
        assert np.all(stamps <= times + 1e-12)
        # and it is a fresh one: data moves at every step, not only where the rates meet
        own = steps[0 if name == "first" else 1]
        assert np.all(times - stamps <= (own + steps[other]) * 1e-3 + 1e-12)
        if own >= steps[other]:
            assert np.all(np.diff(stamps) > 0.0)


def test_slow_steps_first_then_by_declaration() -> None:
    order: list[tuple[str, float]] = []
    run(pair(100, 300, order), 600 * MILLISECOND)
    assert order == [
        ("second", 0.0),
        ("first", 0.0),
        ("first", 0.1),
        ("first", 0.2),
        ("second", 0.3),
        ("first", 0.3),
        ("first", 0.4),
        ("first", 0.5),
    ]
    order.clear()
    run(pair(100, 100, order), 200 * MILLISECOND)
    assert order == [("first", 0.0), ("second", 0.0), ("first", 0.1), ("second", 0.1)]


def test_clock_does_not_drift() -> None:
    """100000 steps of 0.1 s; a float sum would be off by 1.9e-8 s."""
    times: list[float] = []
    instance = PythonInstance("clock", lambda values, time, size: times.append(time))
    summary = run(System(components=(Component(instance=instance, step=100 * MILLISECOND),)), 10_000 * SECOND)
    assert len(times) == 100_000
    assert times[-1] == 9999.9
    assert summary.components[0].time == 10_000 * SECOND


def test_short_run_is_the_beginning_of_a_longer_one() -> None:
    recorders = [MemoryRecorder(), MemoryRecorder()]
    for recorder, stop in zip(recorders, (1000, 5000), strict=True):
        run(pair(200, 300), stop * MILLISECOND, observers=[recorder])
    for name in ("first", "second"):
        short, long = (recorder.values(name) for recorder in recorders)
        np.testing.assert_array_equal(short, long[: len(short)])
        assert recorders[0].times(name)[-1] >= 1.0


def test_run_in_pieces_equals_run_at_once() -> None:
    recorders = [MemoryRecorder(), MemoryRecorder()]
    run(pair(200, 300), 6 * SECOND, observers=[recorders[0]])
    master = Master(pair(200, 300), [recorders[1]])
    master.initialize()
    for until in (700, 1100, 6000):
        master.advance(until * MILLISECOND)
    for name in ("first", "second"):
        np.testing.assert_array_equal(recorders[0].values(name), recorders[1].values(name))


def test_start_time() -> None:
    recorder = MemoryRecorder()
    summary = run(pair(100, 300), 13 * SECOND, start=12 * SECOND, observers=[recorder])
    assert recorder.times("first")[0] == 12.0
    assert recorder.signal("first", "stamp")[-1] == 13.0
    assert [component.steps for component in summary.components] == [10, 4]


def test_source_that_feeds_nothing_also_runs() -> None:
    recorder = MemoryRecorder()
    lonely = Component(instance=clock_component("lonely"), step=700 * MILLISECOND)
    both = pair(100, 300)
    run(replace(both, components=(lonely, *both.components)), 2 * SECOND, observers=[recorder])
    np.testing.assert_allclose(recorder.signal("lonely", "stamp"), [0.0, 0.7, 1.4, 2.1])


def test_initial_values_pass_through_a_chain() -> None:
    """Direct feed-through in the initialization: c = 2 b, b = a + 1, whatever the order of declaration."""

    def component(name: str, expression: str) -> PythonInstance:
        def outputs(values: Values, time: float) -> None:
            values["y"] = 2.0 * values["u"] if expression == "double" else values["u"] + 1.0

        return PythonInstance(
            name,
            lambda values, time, size: outputs(values, time),
            inputs={"u": 0.0},
            outputs={"y": 0.0},
            initialize=outputs,
        )

    link = Connection(source="b", source_variable="y", target="c", target_variable="u")
    recorder = MemoryRecorder()
    summary = run(
        System(
            components=(
                Component(instance=component("c", "double"), step=SECOND),
                Component(instance=component("b", "increment"), step=SECOND),
                Component(instance=component("a", "increment"), step=SECOND, parameters={"u": 4.0}),
            ),
            connections=(link, replace(link, source="a", target="b")),
        ),
        SECOND,
        observers=[recorder],
    )
    assert recorder.signal("c", "y").tolist() == [12.0, 12.0]
    assert summary.initialization_sweeps == 2


def test_initial_loop_is_iterated_and_a_diverging_one_noted() -> None:
    def gain(name: str, factor: float) -> PythonInstance:
        def outputs(values: Values, time: float) -> None:
            values["y"] = 1.0 + factor * values["u"]

        return PythonInstance(
            name, lambda values, time, size: None, inputs={"u": 0.0}, outputs={"y": 0.0}, initialize=outputs
        )

    def system(factor: float) -> System:
        link = Connection(source="a", source_variable="y", target="b", target_variable="u")
        return System(
            components=(
                Component(instance=gain("a", factor), step=SECOND),
                Component(instance=gain("b", factor), step=SECOND),
            ),
            connections=(link, replace(link, source="b", target="a")),
        )

    recorder = MemoryRecorder()
    summary = run(system(0.1), SECOND, observers=[recorder])
    # y = 1 + 0.1 y
    assert recorder.signal("a", "y")[0] == pytest.approx(1.0 / 0.9, rel=1e-8)
    loop = "algebraic loop a.y -> b.u -> b.y -> a.u -> a.y: its start values are iterated"
    assert summary.notes == (loop,)
    summary = run(system(2.0), SECOND)
    assert summary.notes == (loop, "the initial values did not settle in 10 exchanges")


def integrate(
    state: tuple[float, float], size: float, acceleration: Callable[[float, float, float], float]
) -> tuple[float, float]:
    """Integrate x'' = acceleration(phase, x, x') over one step by 10 Runge-Kutta steps."""
    count = 10
    h = size / count
    y = np.array(state)
    for number in range(count):

        def slope(z: np.ndarray, part: float, number: int = number) -> np.ndarray:
            return np.array([z[1], acceleration((number + part) / count, z[0], z[1])])

        k1 = slope(y, 0.0)
        k2 = slope(y + 0.5 * h * k1, 0.5)
        k3 = slope(y + 0.5 * h * k2, 0.5)
        k4 = slope(y + h * k3, 1.0)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return float(y[0]), float(y[1])


M1, M2, K1, K2, K, C = 2.0, 1.0, 8.0, 3.0, 1.5, 0.3


def two_masses(steps: tuple[int, int], extrapolation: str) -> System:
    """Two masses, each tied to the ground by a spring and to the other by a spring and a damper.

    The first component takes the coupling force and gives position and velocity; the second takes position and
    velocity and gives the coupling force. Inputs belong to the end of the step and vary linearly over it; the
    equations of each component are solved so finely that only the coupling has an error.
    """

    def first_acceleration(values: Values) -> float:
        return float(values["force"] - K1 * values["x"]) / M1

    def step_first(values: Values, time: float, size: float) -> None:
        before, after = values["force before"], values["force"]
        values["x"], values["v"] = integrate(
            (values["x"], values["v"]),
            size,
            lambda phase, x, v: (before + phase * (after - before) - K1 * x) / M1,
        )
        values["a"] = first_acceleration(values)
        values["force before"] = after

    def start_first(values: Values, time: float) -> None:
        values["a"] = first_acceleration(values)
        values["force before"] = values["force"]

    def step_second(values: Values, time: float, size: float) -> None:
        (x0, v0), (x1, v1) = values["before"], (values["x"], values["v"])
        values["x2"], values["v2"] = integrate(
            (values["x2"], values["v2"]),
            size,
            lambda phase, x, v: (-K2 * x - K * (x - x0 - phase * (x1 - x0)) - C * (v - v0 - phase * (v1 - v0))) / M2,
        )
        start_second(values, time)

    def start_second(values: Values, time: float) -> None:
        values["force"] = K * (values["x2"] - values["x"]) + C * (values["v2"] - values["v"])
        values["before"] = (values["x"], values["v"])

    first = PythonInstance(
        "first",
        step_first,
        inputs={"force": 0.0},
        outputs={"x": 1.0, "v": 0.0, "a": 0.0},
        derivatives={"v": "x", "a": "v"},
        initialize=start_first,
    )
    second = PythonInstance(
        "second",
        step_second,
        inputs={"x": 0.0, "v": 0.0},
        outputs={"force": 0.0, "x2": 0.0, "v2": 0.0},
        initialize=start_second,
    )
    link = Connection(
        source="first",
        source_variable="x",
        target="second",
        target_variable="x",
        extrapolation=extrapolation,
    )
    return System(
        components=(
            Component(instance=first, step=steps[0] * MILLISECOND),
            Component(instance=second, step=steps[1] * MILLISECOND),
        ),
        connections=(
            link,
            replace(link, source_variable="v", target_variable="v"),
            replace(link, source="second", target="first", source_variable="force", target_variable="force"),
        ),
    )


def monolithic(times: np.ndarray) -> np.ndarray:
    """Position of the first mass from the eigenvalues of the whole system."""
    matrix = np.array(
        [
            [0, 1, 0, 0],
            [-(K1 + K) / M1, -C / M1, K / M1, C / M1],
            [0, 0, 0, 1],
            [K / M2, C / M2, -(K2 + K) / M2, -C / M2],
        ]
    )
    values, vectors = np.linalg.eig(matrix)
    amplitudes = np.linalg.solve(vectors, [1.0, 0.0, 0.0, 0.0])
    result: np.ndarray = np.real(np.exp(np.outer(times, values)) @ (vectors[0] * amplitudes))
    return result


def coupling_error(steps: tuple[int, int], extrapolation: str = "derivatives") -> float:
    recorder = MemoryRecorder()
    run(two_masses(steps, extrapolation), 10 * SECOND, observers=[recorder])
    return float(np.max(np.abs(recorder.signal("first", "x") - monolithic(recorder.times("first")))))


@pytest.mark.parametrize("ratio", [(1, 1), (1, 5), (5, 1), (2, 3)])
def test_coupled_oscillator_converges_to_the_monolithic_solution(ratio: tuple[int, int]) -> None:
    coarse = coupling_error((40 * ratio[0], 40 * ratio[1]))
    fine = coupling_error((20 * ratio[0], 20 * ratio[1]))
    # inputs that are linear over a step, inter- and extrapolated at least linearly: second order
    assert fine < 0.02
    assert coarse / fine > 3.0


def test_derivatives_beat_holding_the_feedback() -> None:
    assert coupling_error((20, 100)) < 0.2 * coupling_error((20, 100), "hold")


def failing(name: str, at: float, how: object) -> PythonInstance:
    def step(values: Values, time: float, size: float) -> None:
        values["y"] = time + size
        if time + size >= at:
            if isinstance(how, BaseException):
                raise how
            values["y"] = how

    return PythonInstance(name, step, inputs={"u": 0.0}, outputs={"x": 0.0, "y": 0.0})


class Watcher(Observer):
    """Notes how a run ended."""

    def __init__(self) -> None:
        self.reasons: list[BaseException | None] = []
        self.steps: list[int] = []

    def stopped(self, reason: BaseException | None, summary: object) -> None:
        self.reasons.append(reason)
        self.steps = [component.steps for component in summary.components]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("how", "error", "message"),
    [
        (math.nan, StepError, r"pump: output 'y' is nan at t = 0\.5 s, not a finite number"),
        (-math.inf, StepError, r"pump: output 'y' is -inf at t = 0\.5 s, not a finite number"),
        (ValueError("no root"), StepError, r"pump: the step at t = 0\.4 s failed: ValueError: no root"),
        (StepError("pump: broken"), StepError, "pump: broken"),
        (KeyboardInterrupt(), KeyboardInterrupt, None),
    ],
)
def test_failures_name_the_cause_and_free_all(how: object, error: type[BaseException], message: str | None) -> None:
    freed: list[str] = []
    instances = [failing("pump", 0.5, how), clock_component("other")]
    for instance in instances:
        instance._on_free = lambda name=instance.name: freed.append(name)
    watcher = Watcher()
    system = System(components=tuple(Component(instance=item, step=100 * MILLISECOND) for item in instances))
    with pytest.raises(error, match=message) as caught:
        run(system, 10 * SECOND, observers=[watcher])
    assert freed == ["pump", "other"]
    assert watcher.reasons == [caught.value]
    assert max(watcher.steps) < 6


def test_large_finite_values_are_not_mistaken_for_infinite() -> None:
    system = System(components=(Component(instance=failing("pump", 0.0, 1.7e308), step=SECOND),))
    assert run(system, 3 * SECOND).components[0].steps == 3


def test_failing_initialization_names_the_component() -> None:
    def explode(values: Values, time: float) -> None:
        raise ZeroDivisionError("mass is zero")

    freed: list[str] = []
    instance = PythonInstance(
        "hull", lambda values, time, size: None, initialize=explode, on_free=lambda: freed.append("hull")
    )
    with pytest.raises(FmuError, match="hull: failed while initializing it: ZeroDivisionError: mass is zero"):
        run(System(components=(Component(instance=instance, step=1),)), SECOND)
    assert freed == ["hull"]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"mas": 1.0}, "hull: no variable 'mas' to set as a parameter; nearest match: 'mass'"),
        ({"mass": "heavy"}, "hull: parameter 'mass' = 'heavy' is not of the type Real"),
        ({"mass": True}, "hull: parameter 'mass' = True is not of the type Real"),
        ({"mass": math.nan}, "hull: parameter 'mass' = nan is not a finite number"),
        ({"count": 1.5}, r"hull: parameter 'count' = 1\.5 is not of the type Integer"),
        ({"label": 3}, "hull: parameter 'label' = 3 is not of the type String"),
        ({"wet": 1}, "hull: parameter 'wet' = 1 is not of the type Boolean"),
        ({"x": 1.0}, "hull: 'x' is output, continuous, and cannot be set"),
    ],
)
def test_parameter_faults(parameters: dict[str, object], message: str) -> None:
    instance = PythonInstance(
        "hull",
        lambda values, time, size: None,
        outputs={"x": 0.0},
        parameters={"mass": 1.0, "count": 2, "wet": True, "label": "a"},
    )
    with pytest.raises(WiringError, match=message):
        run(System(components=(Component(instance=instance, step=1, parameters=parameters),)), SECOND)


def test_stop_must_follow_start() -> None:
    with pytest.raises(WiringError, match=r"stop time 1\.0 s is not later than the start time 1\.0 s"):
        run(pair(100, 300), SECOND, start=SECOND)


def test_termination_fault_becomes_a_note() -> None:
    class Stubborn(PythonInstance):
        def terminate(self) -> None:
            raise TlpsimError("will not end")

    instance = Stubborn("hull", lambda values, time, size: None)
    summary = run(System(components=(Component(instance=instance, step=SECOND),)), SECOND)
    assert summary.notes == ("hull: failed while terminating: will not end",)


def test_state_of_a_python_component_is_exact() -> None:
    instance = clock_component("clock")
    instance.bind(["u"], ["stamp", "received"])
    instance.set_inputs(np.array([3.0]))
    state = instance.get_state()
    instance.step(1.0, 0.5)
    after = np.empty(2)
    instance.get_outputs(after)
    again = np.empty(2)
    for saved in (state, instance.deserialize_state(instance.serialize_state(state))):
        instance.set_inputs(np.array([7.0]))
        instance.set_state(saved)
        instance.step(1.0, 0.5)
        instance.get_outputs(again)
        np.testing.assert_array_equal(again, after)


def test_summary_counts() -> None:
    summary = run(pair(100, 300), 3 * SECOND)
    names: Sequence[str] = [component.name for component in summary.components]
    assert names == ["first", "second"]
    assert [component.steps for component in summary.components] == [30, 10]
    assert summary.wall_time > sum(component.wall_time for component in summary.components) > 0.0
