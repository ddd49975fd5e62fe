"""Large, long, odd and empty systems: what the master's loop makes of them."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.errors import WiringError
from tlpsim.loads.filters.interpolation import SYMMETRIC
from tlpsim.orchestrator.clock import LARGEST_STEP, LARGEST_TIME, to_ticks
from tlpsim.orchestrator.execution import Master, run
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.system import Component, Connection, System, check

SECOND = 1_000_000_000
ALGORITHMS = ("multirate", "sequential", "parallel")


def wire(source: str, output: str, target: str, into: str, **more: object) -> Connection:
    ends = {"source": source, "source_variable": output, "target": target, "target_variable": into}
    return Connection(**ends, suppress_unit_conversion=True, **more)  # type: ignore[arg-type]


def follower(name: str, start: float = 0.0) -> PythonInstance:
    """y(t + h) = 0.9 y(t) + u, with y(0) = `start`."""

    def step(values: Values, time: float, size: float) -> None:
        values["y"] = 0.9 * values["y"] + values["u"]

    return PythonInstance(name, step, inputs={"u": 0.0}, outputs={"y": start})


def clock(name: str) -> PythonInstance:
    """The output is its own time less the start time."""

    def step(values: Values, time: float, size: float) -> None:
        values.setdefault("first", time)
        values["y"] = time + size - values["first"]

    return PythonInstance(name, step, outputs={"y": 0.0})


def recorded(system: System, stop: int, start: int = 0) -> MemoryRecorder:
    recorder = MemoryRecorder()
    run(system, stop, start=start, observers=[recorder])
    return recorder


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("ring", [False, True])
def test_steps_by_address_and_by_call_agree(
    chain_fmu: Callable[[int], Path], algorithm: str, ring: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twelve FMUs of mixed steps; whose turn it is, is found anew after every step that is called from Python."""
    steps = np.random.Generator(np.random.Philox(5)).choice([50, 100, 100, 100, 150, 300], 12)
    results = []
    for by_address in (True, False):
        instances = [open_fmu(f"c{k}", chain_fmu(2)) for k in range(12)]
        if not by_address:
            for instance in instances:
                monkeypatch.setattr(instance, "native_calls", lambda: None)
        wires = [(k, (k + 1) % 12) for k in range(12 if ring else 11)] + ([(3, 9), (11, 4)] if ring else [(0, 5)])
        system = System(
            components=tuple(
                Component(instance=instance, step=int(step) * SECOND // 1000, parameters={"u[4]": 1.0})
                for instance, step in zip(instances, steps, strict=True)
            ),
            connections=tuple(
                wire(f"c{a}", "y[1]", f"c{b}", f"u[{1 + k % 3}]", factor=0.3) for k, (a, b) in enumerate(wires)
            ),
            algorithm=algorithm,
        )
        results.append(recorded(system, 20 * SECOND))
    for k in range(12):
        assert results[0].ticks(f"c{k}").tobytes() == results[1].ticks(f"c{k}").tobytes()
        assert results[0].values(f"c{k}").tobytes() == results[1].values(f"c{k}").tobytes()


@pytest.mark.parametrize("ring", [False, True])
def test_a_component_step_costs_the_same_in_a_large_system(chain_fmu: Callable[[int], Path], ring: bool) -> None:
    """About 0.07 µs with three components and 0.08 µs with a hundred; the bound has room for a busy machine.

    The runs are long enough for the histories to fill up several times.
    """
    costs = []
    for count in (3, 100):
        instances = [open_fmu(f"c{k}", chain_fmu(2)) for k in range(count)]
        components = tuple(Component(instance=each, step=SECOND, outputs=()) for each in instances)
        wires = [(k, (k + 1) % count) for k in range(count if ring else count - 1)]
        connections = tuple(wire(f"c{a}", "y[1]", f"c{b}", "u[1]") for a, b in wires)
        master = Master(System(components=components, connections=connections))
        master.initialize()
        master.advance(100 * SECOND)
        walls = []
        for part in range(1, 11):
            began = time.perf_counter()
            master.advance((100 + part * 100_000 // count) * SECOND)
            walls.append(time.perf_counter() - began)
        costs.append(np.median(walls))
        for instance in instances:
            instance.free()
    assert costs[1] < 2.5 * costs[0]


@pytest.mark.parametrize("components", [2, 20, 1000])
@pytest.mark.parametrize("algorithm", ["multirate", "sequential"])
def test_two_thousand_connections_are_set_up_at_once(components: int, algorithm: str) -> None:
    """About 0.2 s; the bound is what it took when the time grew with the square of the number."""
    each = 2000 // components
    names = [f"v{k}" for k in range(each)]
    instances = [
        PythonInstance(
            f"c{k}",
            lambda values, time, size: None,
            inputs={f"u{name}": 0.0 for name in names},
            outputs={f"y{name}": 0.0 for name in names},
        )
        for k in range(components)
    ]
    wires = tuple(
        wire(f"c{k}", f"y{name}", f"c{(k + 1) % components}", f"u{name}") for k in range(components) for name in names
    )
    system = System(
        components=tuple(Component(instance=instance, step=SECOND) for instance in instances),
        connections=wires,
        algorithm=algorithm,
    )
    began = time.perf_counter()
    Master(system).initialize()
    assert time.perf_counter() - began < 5.0


@pytest.mark.parametrize("steps", [(100_000_000, 33_333_333), (33_333_333, 100_000_000), (99_999_999, 100_000_000)])
@pytest.mark.parametrize("name", ["linear", "cubic", "quintic", "optimal"])
def test_odd_ratios_of_steps(steps: tuple[int, int], name: str) -> None:
    """Thousands of instants within a sample step, more than weights are kept for: each as by the filter itself."""
    wave = PythonInstance("wave", lambda v, time, size: v.update(y=np.sin(time + size)), outputs={"y": 0.0})
    sink = PythonInstance("sink", lambda v, time, size: v.update(y=v["u"]), inputs={"u": 0.0}, outputs={"y": 0.0})
    system = System(
        components=(Component(instance=wave, step=steps[0]), Component(instance=sink, step=steps[1])),
        connections=(wire("wave", "y", "sink", "u", filter=name),),
    )
    recorder = recorded(system, 150 * SECOND)
    samples, chosen = recorder.signal("wave", "y"), SYMMETRIC[name]
    ticks, found = recorder.ticks("sink"), recorder.signal("sink", "y")
    for k in np.flatnonzero((ticks > 5 * SECOND) & (ticks < 149 * SECOND)):
        segment, since = divmod(int(ticks[k]), steps[0])
        first = segment + 1 - chosen.before
        weights = chosen.weights(since / steps[0])
        assert found[k] == pytest.approx(weights @ samples[first : segment + 1 + chosen.after], abs=1e-12)
    if name != "linear":
        np.testing.assert_allclose(found[ticks > 5 * SECOND], np.sin(1e-9 * ticks[ticks > 5 * SECOND]), atol=1e-5)


@pytest.mark.parametrize("start", [-7.3, 1e-9, 0.05, 86400.0, 3.1e9])
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_run_does_not_depend_on_its_start_time(start: float, algorithm: str) -> None:
    """Neither the start nor the stop time is a multiple of a step."""

    def loop() -> System:
        return System(
            components=(
                Component(instance=clock("clock"), step=SECOND // 4),
                Component(instance=follower("a", 1.0), step=SECOND // 10),
                Component(instance=follower("b"), step=3 * SECOND // 10),
            ),
            connections=(wire("a", "y", "b", "u"), wire("b", "y", "a", "u", factor=0.05)),
            algorithm=algorithm,
        )

    begin = to_ticks(start, "start")
    one, other = recorded(loop(), 7_770_000_000), recorded(loop(), begin + 7_770_000_000, begin)
    for name in ("a", "b", "clock"):
        np.testing.assert_array_equal(other.ticks(name) - begin, one.ticks(name))
        tolerance = 4.0 * np.spacing(abs(start) + 10.0) if name == "clock" else 0.0
        np.testing.assert_allclose(other.values(name), one.values(name), rtol=0.0, atol=tolerance)
    assert one.ticks("b")[-1] == 7_800_000_000


def test_times_of_more_than_a_century() -> None:
    start = LARGEST_TIME - 1000 * SECOND
    system = System(
        components=(
            Component(instance=follower("a", 1.0), step=SECOND),
            Component(instance=follower("b"), step=7 * SECOND),
        ),
        connections=(wire("a", "y", "b", "u"),),
    )
    recorder = recorded(system, LARGEST_TIME, start)
    assert recorder.ticks("a")[:3].tolist() == [start, start + SECOND, start + 2 * SECOND]
    assert recorder.ticks("b")[-1] >= LARGEST_TIME
    np.testing.assert_allclose(recorder.signal("a", "y")[:1001], 0.9 ** np.arange(1001), rtol=1e-12)


@pytest.mark.parametrize("seconds", [1e10, -1e10, 1e300, 1.7e308])
def test_times_that_do_not_fit_are_refused(seconds: float) -> None:
    with pytest.raises(WiringError, match=r"stop time: .* s is longer than 4\.612e\+09 s; give a shorter time"):
        to_ticks(seconds, "stop time")


def test_steps_that_do_not_fit_are_refused() -> None:
    system = System(components=(Component(instance=follower("a"), step=LARGEST_STEP + 1),))
    with pytest.raises(WiringError, match=r"'a': step 9\.0072e\+06 s is longer than 9\.007e\+06 s; give a shorter one"):
        check(system)


@pytest.mark.parametrize("step", [1, LARGEST_STEP])
def test_smallest_and_largest_step(step: int) -> None:
    recorder = recorded(System(components=(Component(instance=clock("clock"), step=step),)), 5 * step)
    assert recorder.ticks("clock").tolist() == [k * step for k in range(6)]


@pytest.mark.parametrize("stop", [1, SECOND - 1, SECOND])
def test_a_run_shorter_than_a_step(stop: int) -> None:
    recorder = recorded(System(components=(Component(instance=clock("clock"), step=SECOND),)), stop)
    assert recorder.ticks("clock").tolist() == [0, SECOND]


@pytest.mark.parametrize("algorithm", [*ALGORITHMS, "iterative"])
def test_components_without_inputs_or_outputs(algorithm: str) -> None:
    taken: list[float] = []
    silent = PythonInstance("silent", lambda values, time, size: taken.append(time))
    deaf = PythonInstance("deaf", lambda values, time, size: taken.append(values["u"]), inputs={"u": 0.0})
    system = System(
        components=(
            Component(instance=silent, step=SECOND),
            Component(instance=deaf, step=SECOND),
            Component(instance=clock("clock"), step=SECOND),
        ),
        connections=(wire("clock", "y", "deaf", "u"),),
        algorithm=algorithm,
    )
    recorder = recorded(system, 3 * SECOND)
    assert sorted(taken) == [0.0, 1.0, 1.0, 2.0, 2.0, 3.0]
    assert recorder.values("silent").shape == recorder.values("deaf").shape == (4, 0)


def test_native_components_without_bound_variables(chain_fmu: Callable[[int], Path]) -> None:
    component = Component(instance=open_fmu("hull", chain_fmu(2)), step=SECOND, outputs=())
    summary = run(System(components=(component,)), 100_000 * SECOND)
    assert summary.components[0].steps == 100_000


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize(
    ("extrapolation", "expected"), [("hold", [1.0, 1.4, 1.96, 2.744]), ("linear", [1.0, 1.4, 2.16, 3.404])]
)
def test_a_component_that_feeds_itself(algorithm: str, extrapolation: str, expected: list[float]) -> None:
    """Its input at the end of a step is extrapolated from its outputs so far."""
    system = System(
        components=(Component(instance=follower("a", 1.0), step=SECOND),),
        connections=(wire("a", "y", "a", "u", factor=0.5, extrapolation=extrapolation),),
        algorithm=algorithm,
    )
    np.testing.assert_allclose(recorded(system, 3 * SECOND).signal("a", "y"), expected, rtol=1e-12)


def test_parallel_components_of_different_rates() -> None:
    """Where both are due each gets the other's value of that time, and else what is held."""
    system = System(
        components=(
            Component(instance=follower("fast", 1.0), step=SECOND),
            Component(instance=follower("slow", 2.0), step=2 * SECOND),
        ),
        connections=(
            wire("fast", "y", "slow", "u", extrapolation="hold"),
            wire("slow", "y", "fast", "u", extrapolation="hold", filter="hold"),
        ),
        algorithm="parallel",
    )
    recorder = recorded(system, 4 * SECOND)
    # What the fast one gets at the end of its steps: at 1 s the slow one has its value of 2 s already, and the filter
    # holds that of 0 s; at 0 s and 2 s the slow one has not stepped when the inputs are taken.
    slow = [2.0, 0.9 * 2.0 + 1.0]
    fast = [1.0, 0.9 + slow[0]]
    fast.append(0.9 * fast[1] + slow[1])
    fast.append(0.9 * fast[2] + slow[1])
    slow.append(0.9 * slow[1] + fast[2])
    fast.append(0.9 * fast[3] + slow[2])
    np.testing.assert_allclose(recorder.signal("slow", "y"), slow, rtol=1e-12)
    np.testing.assert_allclose(recorder.signal("fast", "y"), fast, rtol=1e-12)


def test_names_twice() -> None:
    component = Component(instance=follower("a"), step=SECOND, outputs=("y", "y"))
    system = System(components=(component,), connections=(wire("a", "y", "a", "u"),))
    assert recorded(system, SECOND).names == {"a": ("y",)}
    with pytest.raises(WiringError, match=r"a\.y -> a\.u: the input is already fed by a\.y -> a\.u; remove one"):
        check(System(components=(component,), connections=(wire("a", "y", "a", "u"),) * 2))
    with pytest.raises(WiringError, match="component 'a' exists twice"):
        check(System(components=(component, component)))
