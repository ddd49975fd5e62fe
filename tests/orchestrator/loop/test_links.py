"""Values between rates: accuracy of look-ahead, causal filters and extrapolation inside real runs."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tlpsim.loads.errors import WiringError
from tlpsim.loads.filters.interpolation import CAUSAL, SYMMETRIC, interpolation_error
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.loop.links import plan_links
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.system import Component, Connection, System

MILLISECOND = 1_000_000
SECOND = 1000 * MILLISECOND

Function = Callable[[float], float]


def source(name: str, signals: dict[str, Function], derivatives: dict[str, str] | None = None) -> PythonInstance:
    """A component that gives functions of time, and has one input that does nothing."""

    def initialize(values: Values, time: float) -> None:
        values.update({key: function(time) for key, function in signals.items()})

    def step(values: Values, time: float, size: float) -> None:
        initialize(values, time + size)

    return PythonInstance(
        name,
        step,
        inputs={"idle": 0.0},
        outputs=dict.fromkeys(signals, 0.0),
        initialize=initialize,
        derivatives=derivatives or {},
    )


def probe(name: str = "probe", inputs: int = 1) -> PythonInstance:
    """A component whose outputs y0, y1 ... are its inputs u0, u1 ... as they are during the step."""

    def step(values: Values, time: float, size: float) -> None:
        for number in range(inputs):
            values[f"y{number}"] = values[f"u{number}"]

    return PythonInstance(
        name,
        step,
        inputs={f"u{number}": 0.0 for number in range(inputs)},
        outputs={f"y{number}": 0.0 for number in range(inputs)},
        initialize=lambda values, time: step(values, time, 0.0),
    )


def sine(frequency: float) -> Function:
    return lambda time: float(np.sin(2 * np.pi * frequency * time + 0.3))


def received(
    origin: PythonInstance,
    origin_step: int,
    probe_step: int,
    *,
    names: tuple[str, ...] = ("x",),
    in_loop: bool = False,
    stop: int = 60 * SECOND,
    filter_name: str = "cubic",
    extrapolation: str = "derivatives",
    inputs_at: str = "end",
) -> tuple[np.ndarray, np.ndarray]:
    """Run origin -> probe and return times and received values, shape (samples, names)."""
    connections = [
        Connection(
            source=origin.name,
            source_variable=name,
            target="probe",
            target_variable=f"u{number}",
            filter=filter_name,
            extrapolation=extrapolation,
        )
        for number, name in enumerate(names)
    ]
    if in_loop:
        connections.append(Connection(source="probe", source_variable="y0", target=origin.name, target_variable="idle"))
    system = System(
        components=(
            Component(instance=origin, step=origin_step),
            Component(instance=probe(inputs=len(names)), step=probe_step, inputs_at=inputs_at),
        ),
        connections=tuple(connections),
    )
    recorder = MemoryRecorder()
    run(system, stop, observers=[recorder])
    return recorder.times("probe"), recorder.values("probe")


@pytest.mark.parametrize("name", [name for name in SYMMETRIC if name != "hold"])
@pytest.mark.parametrize("frequency", [0.05, 0.1, 0.2])
def test_source_looks_ahead_without_latency(name: str, frequency: float) -> None:
    times, values = received(
        source("wave", {"x": sine(frequency)}), 500 * MILLISECOND, 100 * MILLISECOND, filter_name=name
    )
    settled = times > 0.5 * SYMMETRIC[name].before  # before, the padding of the first sample shows
    errors = values[settled, 0] - np.array([sine(frequency)(time) for time in times[settled]])
    expected = float(interpolation_error(SYMMETRIC[name], frequency, 0.5, 5))
    # a run holds a whole number of periods less the start, so the mean square is that of full periods to 5 %
    assert np.sqrt(2.0 * np.mean(errors**2)) == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("name", ["hold", "linear", "cubic", "quintic"])
def test_causal_filter_in_a_loop(name: str) -> None:
    """The slow component steps first, so the fast one interpolates with the causal filter, never extrapolates."""
    times, values = received(
        source("wind", {"x": sine(0.1)}),
        500 * MILLISECOND,
        100 * MILLISECOND,
        filter_name=name,
        in_loop=True,
    )
    settled = times > 2.5
    errors = values[settled, 0] - np.array([sine(0.1)(time) for time in times[settled]])
    expected = float(interpolation_error(CAUSAL[name], 0.1, 0.5, 5))
    assert np.sqrt(2.0 * np.mean(errors**2)) == pytest.approx(expected, rel=0.1)


def quadratic(time: float) -> float:
    return 3.0 - 2.0 * time + 0.7 * time**2


def test_declared_derivatives_extrapolate_quadratics_exactly() -> None:
    """A fast component with position, velocity and acceleration, asked 0.4 s beyond its newest sample."""
    signals: dict[str, Function] = {
        "x": quadratic,
        "v": lambda time: -2.0 + 1.4 * time,
        "a": lambda time: 1.4,
    }
    origin = source("platform", signals, {"v": "x", "a": "v"})
    times, values = received(
        origin, 100 * MILLISECOND, 500 * MILLISECOND, names=("x", "v"), in_loop=True, stop=20 * SECOND
    )
    # exact but for round-off of values up to 250, from the first step on
    np.testing.assert_allclose(values[:, 0], [quadratic(time) for time in times], rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(values[:, 1], -2.0 + 1.4 * times, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(
    ("extrapolation", "degree"), [("hold", 0), ("linear", 1), ("quadratic", 2), ("derivatives", 1)]
)
def test_extrapolation_through_samples(extrapolation: str, degree: int) -> None:
    """Without declared derivatives, 'derivatives' is linear."""
    coefficients = [2.0, -1.0, 0.5][: degree + 1]
    polynomial = np.polynomial.Polynomial(coefficients)
    times, values = received(
        source("platform", {"x": lambda time: float(polynomial(time))}),
        100 * MILLISECOND,
        500 * MILLISECOND,
        in_loop=True,
        extrapolation=extrapolation,
        stop=10 * SECOND,
    )
    settled = times >= 1.0  # the first step sees the padding only
    np.testing.assert_allclose(values[settled, 0], polynomial(times[settled]), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("extrapolation", "slow", "expected"), [("hold", 0.5, 0.31), ("linear", 0.5, 4.9e-2)])
def test_documented_extrapolation_errors(extrapolation: str, slow: float, expected: float) -> None:
    """Root mean square error at 0.1 Hz, relative to the signal, 0.5 s beyond the newest 0.1 s sample.

    The documented values take the derivative from three samples; two samples change the linear one by 20 %.
    """
    times, values = received(
        source("platform", {"x": sine(0.1)}),
        100 * MILLISECOND,
        round(slow * SECOND),
        in_loop=True,
        extrapolation=extrapolation,
        stop=100 * SECOND,
    )
    settled = times > 1.0
    errors = values[settled, 0] - np.array([sine(0.1)(time) for time in times[settled]])
    assert np.sqrt(2.0 * np.mean(errors**2)) == pytest.approx(expected, rel=0.25)


def test_documented_derivative_extrapolation_errors() -> None:
    """Position by velocity and acceleration, velocity by acceleration, 0.5 s ahead at 0.1 Hz.

    The error is the remainder of the Taylor series of exp(i theta), theta = 2 pi f tau, whatever the fast step.
    """
    omega = 2 * np.pi * 0.1
    signals: dict[str, Function] = {
        "x": lambda time: float(np.sin(omega * time)),
        "v": lambda time: float(omega * np.cos(omega * time)),
        "a": lambda time: float(-(omega**2) * np.sin(omega * time)),
    }
    origin = source("platform", signals, {"v": "x", "a": "v"})
    times, values = received(
        origin, 100 * MILLISECOND, 500 * MILLISECOND, names=("x", "v"), in_loop=True, stop=100 * SECOND
    )
    exact = np.array([[signals[name](time) for name in ("x", "v")] for time in times])
    errors = np.sqrt(2.0 * np.mean((values - exact)[1:] ** 2, axis=0)) / [1.0, omega]
    theta = 0.5 * omega
    remainders = [
        abs(np.exp(1j * theta) - (1.0 + 1j * theta - 0.5 * theta**2)),
        abs(np.exp(1j * theta) - (1.0 + 1j * theta)),
    ]
    np.testing.assert_allclose(errors, remainders, rtol=1e-6)
    np.testing.assert_allclose(remainders, [5.2e-3, 4.9e-2], rtol=0.02)


@pytest.mark.parametrize(("inputs_at", "offset"), [("start", 0.1), ("middle", 0.05), ("end", 0.0)])
def test_instant_of_inputs(inputs_at: str, offset: float) -> None:
    times, values = received(
        source("wave", {"x": lambda time: 2.0 * time}),
        500 * MILLISECOND,
        100 * MILLISECOND,
        inputs_at=inputs_at,
        stop=10 * SECOND,
    )
    settled = times > 2.5
    np.testing.assert_allclose(values[settled, 0], 2.0 * (times[settled] - offset), rtol=1e-12)


@pytest.mark.parametrize("steps", [(300, 100), (300, 200), (100, 300), (70, 100), (1000, 30)])
def test_any_rates(steps: tuple[int, int]) -> None:
    """A straight line arrives exactly at any pair of rates, in and outside loops, and in any order of columns."""
    signals: dict[str, Function] = {f"x{number}": lambda time, n=number: n + time for number in range(5)}  # type: ignore[misc]
    names = ("x3", "x0", "x4")
    for in_loop in (False, True):
        times, values = received(
            source("origin", signals),
            steps[0] * MILLISECOND,
            steps[1] * MILLISECOND,
            names=names,
            in_loop=in_loop,
            stop=40 * SECOND,
        )
        settled = times > 5.0
        expected = times[settled, None] + np.array([3.0, 0.0, 4.0])
        np.testing.assert_allclose(values[settled], expected, rtol=1e-12)


def test_chain_of_sources_looks_ahead_through_all_of_them() -> None:
    """a -> b -> probe, each twice as fast: b must itself get values from beyond the time that it steps to."""
    a, b = source("a", {"x": sine(0.05)}), probe("b")
    link = Connection(source="a", source_variable="x", target="b", target_variable="u0", filter="quintic")
    system = System(
        components=(
            Component(instance=probe(), step=50 * MILLISECOND),  # declared before what feeds it
            Component(instance=b, step=200 * MILLISECOND),
            Component(instance=a, step=400 * MILLISECOND),
        ),
        connections=(link, replace(link, source="b", source_variable="y0", target="probe")),
    )
    recorder = MemoryRecorder()
    run(system, 50 * SECOND, observers=[recorder])
    times, values = recorder.times("probe"), recorder.signal("probe", "y0")
    settled = times > 4.0
    # quintic at 0.05 Hz and 0.4 s: 5e-10 of the amplitude
    np.testing.assert_allclose(values[settled], [sine(0.05)(time) for time in times[settled]], atol=2e-9)


def test_several_targets_of_very_different_rates() -> None:
    """The history is deep enough for a target that lags behind one which runs far ahead."""
    slow_probe, fast_probe = probe("slow"), probe("fast")
    link = Connection(source="wave", source_variable="x", target="slow", target_variable="u0", filter="quintic")
    system = System(
        components=(
            Component(instance=slow_probe, step=10 * SECOND),
            Component(instance=fast_probe, step=10 * MILLISECOND),
            Component(instance=source("wave", {"x": lambda time: 1.0 + time}), step=30 * MILLISECOND),
        ),
        connections=(link, replace(link, target="fast")),
    )
    recorder = MemoryRecorder()
    run(system, 40 * SECOND, observers=[recorder])
    for name in ("slow", "fast"):
        times = recorder.times(name)
        values = recorder.signal(name, "y0")[times > 1.0]
        np.testing.assert_allclose(values, 1.0 + times[times > 1.0], rtol=1e-12)


@pytest.mark.parametrize(("frequency", "factor"), [(0.1, 1.0), (0.9, 0.0)])
def test_anti_alias_takes_off_what_would_fold(frequency: float, factor: float) -> None:
    """From 0.1 to 1 s without a delay: 0.9 Hz would look like 0.1 Hz."""
    times, values = received(
        source("wave", {"x": sine(frequency)}), 100 * MILLISECOND, 1000 * MILLISECOND, filter_name="anti_alias"
    )
    settled = times > 6.0
    exact = np.array([sine(frequency)(time) for time in times[settled]])
    np.testing.assert_allclose(values[settled, 0], factor * exact, atol=3e-4)


def test_anti_alias_in_a_loop_passes_lines_without_delay() -> None:
    noise = np.random.default_rng(2).standard_normal(10_000)
    signals: dict[str, Function] = {
        "line": lambda time: 2.0 + 0.5 * time,
        "noise": lambda time: float(noise[round(10.0 * time)]),
    }
    times, values = received(
        source("wave", signals),
        100 * MILLISECOND,
        1000 * MILLISECOND,
        names=("line", "noise"),
        in_loop=True,
        filter_name="anti_alias",
        stop=500 * SECOND,
    )
    settled = times > 3.0
    np.testing.assert_allclose(values[settled, 0], 2.0 + 0.5 * times[settled], rtol=1e-12)
    # The slow component steps first, on the line through eleven samples, ten samples beyond the newest of them.
    expected = 1.0 / 11.0 + 15.0**2 * 12.0 / (11.0 * 120.0)
    assert np.var(values[settled, 1]) == pytest.approx(expected, rel=0.2)


def test_anti_alias_is_for_slower_targets() -> None:
    with pytest.raises(WiringError, match=r"'probe' steps by 0.1 s, 'wave' by 0.1 s; take cubic"):
        received(source("wave", {"x": sine(0.1)}), 100 * MILLISECOND, 100 * MILLISECOND, filter_name="anti_alias")


@pytest.mark.parametrize(("filter_name", "declared", "bound"), [("cubic", 1, 2.7e-4), ("quintic", 2, 1e-6)])
@pytest.mark.parametrize("in_loop", [False, True])
def test_declared_derivatives_interpolate_without_look_ahead(
    filter_name: str, declared: int, bound: float, in_loop: bool
) -> None:
    """0.5 to 0.1 s at 0.2 Hz; the derivative of what is received is continuous."""
    omega = 2.0 * np.pi * 0.2
    signals: dict[str, Function] = {
        "x": sine(0.2),
        "v": lambda time: float(omega * np.cos(omega * time + 0.3)),
        "a": lambda time: float(-(omega**2) * np.sin(omega * time + 0.3)),
    }
    derivatives = {"v": "x"} | ({"a": "v"} if declared > 1 else {})
    steps = 500 * MILLISECOND, 100 * MILLISECOND
    times, values = received(
        source("wave", signals, derivatives), *steps, names=("x",), in_loop=in_loop, filter_name=filter_name
    )
    errors = values[:, 0] - np.sin(omega * times + 0.3)
    assert np.sqrt(2.0 * np.mean(errors**2)) < bound  # methods: 2.6e-4 and 7.8e-7 of the amplitude
    assert np.max(np.abs(errors)) < 2.0 * bound
    fine, finer = (
        received(
            source("wave", signals, derivatives),
            500 * MILLISECOND,
            step,
            names=("x",),
            in_loop=in_loop,
            filter_name=filter_name,
            stop=20 * SECOND,
        )[1][:, 0]
        for step in (2 * MILLISECOND, MILLISECOND)
    )
    # A kink would leave a second difference over the step that grows as the step shrinks.
    assert np.max(np.abs(np.diff(finer, 2))) / 1e-6 < 1.5 * np.max(np.abs(np.diff(fine, 2))) / 4e-6


def test_connections_of_one_kind_are_one_link() -> None:
    signals: dict[str, Function] = {f"x{number}": lambda time: time for number in range(4)}
    link = Connection(source="wave", source_variable="x0", target="probe", target_variable="u0")
    system = System(
        components=(
            Component(instance=source("wave", signals), step=SECOND),
            Component(instance=probe(inputs=4), step=SECOND),
        ),
        connections=(
            link,
            replace(link, source_variable="x2", target_variable="u3"),
            replace(link, source_variable="x1", target_variable="u1", filter="hold"),
        ),
    )
    plans = plan_links(system)
    assert [plan.inputs for plan in plans] == [("u0", "u3"), ("u1",)]
    assert [plan.filter.name for plan in plans] == ["cubic", "hold"]
    assert plans[0].looks_ahead
    assert plans[0].columns.tolist() == [[0, 2]]


def test_history_keeps_its_samples_when_it_is_full() -> None:
    """Many more samples than a history has rows, at the largest number of outputs: interpolated at every step."""
    signals = {f"x{k}": (lambda time, k=k: 1e-3 * k + time) for k in range(600)}
    times, values = received(
        source("wave", signals), 500 * MILLISECOND, 100 * MILLISECOND, names=("x0", "x599"), stop=300 * SECOND
    )
    settled = times > 2.0
    np.testing.assert_allclose(values[settled], times[settled, None] + np.array([0.0, 0.599]), atol=1e-11)
