"""Model-exchange FMUs as components: solutions in closed form, times of events, rollback, failures."""

import itertools
import math
from collections.abc import Callable
from pathlib import Path

import fmpy
import hybrid_fmu
import native_fmu
import numpy as np
import pytest

from tlpsim.loads.errors import FmuError, SolverError, StepError, WiringError
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.fmi.model_exchange import ModelExchange, ModelExchangeInstance
from tlpsim.orchestrator.fmi.ode import SolverOptions, first_time, ode_steps
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.system import Component, Connection, System

SECOND = 1_000_000_000
G = 9.81

Hybrid = Callable[[int], Path]


@pytest.fixture(scope="module")
def hybrid(tmp_path_factory: pytest.TempPathFactory) -> Hybrid:
    if native_fmu.COMPILER is None:
        pytest.skip(native_fmu.NO_COMPILER)
    folder = tmp_path_factory.mktemp("hybrid")
    built = {version: hybrid_fmu.build(folder, version) for version in (2, 3)}
    return built.__getitem__


def initialized(path: Path, options: SolverOptions | None = None, **parameters: float) -> ModelExchange:
    instance = open_fmu("hull", path, solver=options)
    assert isinstance(instance, ModelExchange)
    instance.set_parameters(parameters)
    instance.bind(["u", "level"], ["x", "h", "v", "ticks", "bounces", "changes", "steps", "y"])
    instance.enter_initialization(0.0)
    instance.exit_initialization()
    return instance


def outputs(instance: ModelExchange) -> dict[str, float]:
    values = np.empty(8)
    instance.get_outputs(values)
    return dict(zip(("x", "h", "v", "ticks", "bounces", "changes", "steps", "y"), values.tolist(), strict=True))


def stepped(instance: ModelExchange, sizes: list[float]) -> list[dict[str, float]]:
    """Outputs after each of these steps."""
    time, result = 0.0, []
    for size in sizes:
        instance.step(time, size)
        time += size
        result.append(outputs(instance))
    return result


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("method", ["RK45", "DOP853", "Radau"])
def test_exponential_to_the_tolerance(hybrid: Hybrid, version: int, method: str) -> None:
    for tolerance in (1e-5, 1e-8):
        options = SolverOptions(method=method, relative_tolerance=tolerance)
        instance = initialized(hybrid(version), options, g=0.0)
        found = [row["x"] for row in stepped(instance, 3 * [1.0])]
        np.testing.assert_allclose(found, np.exp([-1.0, -2.0, -3.0]), rtol=0.0, atol=10.0 * tolerance)
        instance.free()


def test_tighter_tolerance_gives_smaller_errors(hybrid: Hybrid) -> None:
    errors = []
    for tolerance in (1e-4, 1e-6, 1e-8, 1e-10):
        instance = initialized(hybrid(2), SolverOptions(relative_tolerance=tolerance), g=0.0)
        errors.append(abs(stepped(instance, [2.0])[0]["x"] - math.exp(-2.0)))
        instance.free()
    assert all(finer < coarser for coarser, finer in itertools.pairwise(errors))
    assert errors[-1] < 1e-9


def test_stiff_equation(hybrid: Hybrid) -> None:
    """x' = 1e6 (u - x): the implicit method takes few steps, so that this ends at all."""
    instance = initialized(hybrid(2), SolverOptions(method="Radau"), gain=1e6, g=0.0)
    instance.set_inputs(np.array([0.5, 0.0]))
    assert stepped(instance, [10.0])[0]["x"] == pytest.approx(0.5, abs=1e-6)
    instance.free()


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("size", [0.05, 0.3, 3.0])
def test_bouncing_ball(hybrid: Hybrid, version: int, size: float) -> None:
    """Impacts are at t1 (1 + 2 e + 2 e² + …); the parabola after them tells to which accuracy they were found."""
    restitution = 0.8
    options = SolverOptions(relative_tolerance=1e-8)
    instance = initialized(hybrid(version), options, restitution=restitution)
    first = math.sqrt(2.0 / G)
    impacts = first * (1.0 + 2.0 * np.cumsum([0.0, *(restitution**k for k in range(1, 20))]))
    count = round(3.0 / size)
    for number, row in enumerate(stepped(instance, count * [size]), 1):
        time = number * size
        bounces = int(np.searchsorted(impacts, time))
        assert row["bounces"] == bounces
        since = time - (impacts[bounces - 1] if bounces else 0.0)
        height, speed = (0.0, restitution**bounces * G * first) if bounces else (1.0, 0.0)
        assert row["h"] == pytest.approx(height + speed * since - 0.5 * G * since**2, abs=1e-9)
        assert row["v"] == pytest.approx(speed - G * since, abs=1e-9)
    instance.free()


@pytest.mark.parametrize("version", [2, 3])
def test_time_events(hybrid: Hybrid, version: int) -> None:
    """An event at the end of a step is handled in it, and there may be several within one."""
    instance = initialized(hybrid(version), g=0.0, period=0.25)
    rows = stepped(instance, [0.125, 0.125, 0.125, 0.125, 1.0])
    assert [row["ticks"] for row in rows] == [0, 1, 1, 2, 6]
    assert rows[-1]["x"] == pytest.approx(math.exp(-1.5), abs=1e-6)
    instance.free()


def test_same_as_by_another_master(hybrid: Hybrid) -> None:
    """FMPy with CVode, which restarts at the same events."""
    parameters = {"restitution": 0.8, "period": 0.3, "gain": 2.0}
    names = ("x", "h", "v", "ticks", "bounces")
    reference = fmpy.simulate_fmu(
        str(hybrid(2)),
        fmi_type="ModelExchange",
        stop_time=2.0,
        output_interval=0.1,
        relative_tolerance=1e-10,
        start_values=parameters,
        output=names,
    )
    instance = initialized(hybrid(2), SolverOptions(relative_tolerance=1e-10), **parameters)
    found = stepped(instance, 20 * [0.1])[-1]
    assert [found[name] for name in names] == pytest.approx(list(reference[-1])[1:], abs=1e-6)
    instance.free()


def test_event_that_follows_a_step_of_the_solver(hybrid: Hybrid) -> None:
    instance = initialized(hybrid(2), g=0.0, step_event=0.5)
    assert [row["steps"] for row in stepped(instance, [0.25, 0.25, 0.25])] == [0, 1, 1]
    instance.free()


@pytest.mark.parametrize("version", [2, 3])
def test_jump_of_an_input_is_an_event(hybrid: Hybrid, version: int) -> None:
    """One of a continuous input when an event indicator crosses zero by it, one of a discrete input always.

    Both at once are one event.
    """
    instance = initialized(hybrid(version), SolverOptions(inputs="hold"), g=0.0)
    changes = []
    for number, inputs in enumerate([(0.5, 0), (1.5, 0), (1.6, 0), (1.6, 1), (1.6, 1), (0.0, 2)]):
        instance.set_inputs(np.array(inputs, dtype=float))
        instance.step(0.1 * number, 0.1)
        changes.append(outputs(instance)["changes"])
    assert changes == [0, 1, 1, 2, 2, 3]
    instance.free()


@pytest.mark.parametrize("version", [2, 3])
def test_event_of_one_input_while_another_changes_linearly(hybrid: Hybrid, version: int) -> None:
    """The linear one is not at its end when the event of the other one is handled, at the start of the step."""
    instance = initialized(hybrid(version), g=0.0)
    changes = []
    for number, inputs in enumerate([(0.5, 0), (1.5, 1), (1.5, 1)]):
        instance.set_inputs(np.array(inputs, dtype=float))
        instance.step(0.1 * number, 0.1)
        changes.append(outputs(instance)["changes"])
    assert changes == [0, 2, 2]
    instance.free()


def test_held_input(hybrid: Hybrid) -> None:
    instance = initialized(hybrid(2), SolverOptions(relative_tolerance=1e-10, inputs="hold"), g=0.0)
    x = 1.0
    for number, u in enumerate((0.0, 3.0, -1.0)):
        instance.set_inputs(np.array([u, 0.0]))
        instance.step(0.5 * number, 0.5)
        x = u + (x - u) * math.exp(-0.5)
        row = outputs(instance)
        assert row["x"] == pytest.approx(x, abs=1e-9)
        assert row["y"] == pytest.approx(2.0 * x + u, abs=1e-9)
    instance.free()


def driven(path: Path, inputs: str, step: float) -> float:
    """Largest error of x' = sin t - x, with the input of the end of each communication step."""
    instance = initialized(path, SolverOptions(relative_tolerance=1e-10, inputs=inputs), g=0.0)
    error = 0.0
    for number in range(round(4.0 / step)):
        time = (number + 1) * step
        instance.set_inputs(np.array([math.sin(time), 0.0]))
        instance.step(number * step, step)
        exact = 1.5 * math.exp(-time) + 0.5 * (math.sin(time) - math.cos(time))
        error = max(error, abs(outputs(instance)["x"] - exact))
    instance.free()
    return error


@pytest.mark.parametrize(("inputs", "order"), [("hold", 1.0), ("linear", 2.0)])
def test_order_in_the_communication_step(hybrid: Hybrid, inputs: str, order: float) -> None:
    errors = [driven(hybrid(2), inputs, step) for step in (0.2, 0.1, 0.05)]
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(rates, order, atol=0.15)


@pytest.mark.parametrize("inputs", ["hold", "linear"])
def test_rollback_is_exact(hybrid: Hybrid, inputs: str) -> None:
    options = SolverOptions(inputs=inputs)
    instance = initialized(hybrid(2), options, restitution=0.7, period=0.3)
    instance.set_inputs(np.array([0.2, 0.0]))
    instance.step(0.0, 0.4)

    def rest() -> list[dict[str, float]]:
        rows = []
        for number in range(5):
            instance.set_inputs(np.array([math.sin(number) + 0.5, number // 2]))
            instance.step(0.4 + 0.4 * number, 0.4)
            rows.append(outputs(instance))
        return rows

    state = instance.get_state()
    data = instance.serialize_state(state)
    expected = rest()
    assert expected[-1]["bounces"] > 2
    for saved in (state, instance.deserialize_state(data)):
        instance.set_state(saved)
        assert rest() == expected  # to the last bit
        instance.free_state(saved)
    with pytest.raises(StepError, match="hull: int is not a state of this component"):
        instance.set_state(3)
    instance.free()


@pytest.mark.parametrize(
    ("fault", "parameters", "message"),
    [
        (
            "nan",
            {},
            r"hull: the solver RK45 failed at t = 0\.4[\d]* s, with x = 0\.6\d+ \(derivative nan\), h = .*",
        ),
        ("terminate", {"period": 0.25}, r"hull: the FMU ends the simulation at t = 0\.5 s"),
        ("chatter", {"period": 0.25}, r"hull: 1000 events between t = 0\.4 s and 0\.5 s, in one step"),
        ("fatal", {}, r"hull: fmi2GetDerivatives at t = 0\.\d+ s returned fatal"),
    ],
)
def test_failures(hybrid: Hybrid, fault: str, parameters: dict[str, float], message: str) -> None:
    instance = ModelExchangeInstance("hull", hybrid(2))
    given = {"g": 0.0, "fault": hybrid_fmu.FAULTS[fault], "fault_time": 0.45, **parameters}
    component = Component(instance=instance, step=SECOND // 5, parameters=given)
    with pytest.raises(StepError, match=message) as caught:
        run(System(components=(component,)), SECOND)
    assert "\n" not in str(caught.value)


def test_fmu_that_discards_states_gets_smaller_steps(hybrid: Hybrid) -> None:
    """The FMU refuses x < 0, which an explicit method tries on the way to x = 0 when its step is too long."""
    instance = initialized(hybrid(2), g=0.0, gain=50.0, fault=hybrid_fmu.FAULTS["discard"])
    instance._size = 1.0
    assert stepped(instance, [1.0])[0]["x"] == pytest.approx(0.0, abs=1e-5)
    instance.free()


@pytest.mark.parametrize(
    "given", [{"method": "Euler"}, {"inputs": "cubic"}, {"relative_tolerance": 0.0}, {"longest_step": -1.0}]
)
def test_options_out_of_range(given: dict[str, object]) -> None:
    with pytest.raises(WiringError, match=f"solver option {next(iter(given))} = "):
        SolverOptions(**given)  # type: ignore[arg-type]


def test_solver_without_a_solution() -> None:
    """y' = y² from 1 has a pole at t = 1."""
    steps = ode_steps(lambda t, y: y * y, 0.0, np.ones(1), 2.0, np.full(1, 1e-6), SolverOptions())
    with pytest.raises(SolverError, match="Required step size is less than spacing between numbers"):
        list(steps)


def test_first_time() -> None:
    assert first_time(lambda time: time >= math.pi, 3.0, 4.0) == math.pi


def test_factory(hybrid: Hybrid, chain_fmu: Callable[[int], Path]) -> None:
    for version in (2, 3):
        assert isinstance(open_fmu("hull", hybrid(version)), ModelExchange)
        assert not isinstance(open_fmu("hull", chain_fmu(version)), ModelExchange)
    instance = open_fmu("hull", hybrid(2), solver=SolverOptions(method="Radau"))
    assert instance.describe()["solver"].startswith("Radau")
    with pytest.raises(FmuError, match=r"the FMU is for co-simulation only; .*export it for model exchange"):
        open_fmu("hull", chain_fmu(2), kind="model exchange")
    with pytest.raises(FmuError, match=r"the FMU is for model exchange only; .*export it for co-simulation"):
        open_fmu("hull", hybrid(2), kind="co-simulation")


def test_in_a_system_with_another_rate(hybrid: Hybrid) -> None:
    """The ball's bounces counted by a component of a smaller step; the run is that of the instance alone."""

    def count(values: Values, time: float, size: float) -> None:
        values["seen"] = max(values["seen"], values["bounces"])

    counter = PythonInstance("counter", count, inputs={"bounces": 0.0}, outputs={"seen": 0.0})
    recorder = MemoryRecorder()
    components = (
        Component(instance=open_fmu("ball", hybrid(2)), step=SECOND // 10, parameters={"restitution": 0.8}),
        Component(instance=counter, step=SECOND // 20),
    )
    link = Connection(
        source="ball", source_variable="bounces", target="counter", target_variable="bounces", filter="hold"
    )
    run(System(components=components, connections=(link,)), 2 * SECOND, observers=[recorder])
    alone = initialized(hybrid(2), restitution=0.8)
    rows = stepped(alone, 20 * [0.1])
    np.testing.assert_allclose(recorder.signal("ball", "h")[1:], [row["h"] for row in rows], atol=1e-9)
    assert recorder.signal("counter", "seen")[-1] == rows[-1]["bounces"] == 3
    alone.free()
