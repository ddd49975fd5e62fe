"""Derivatives that an FMU gives by a function: read as variables, and used by filters and extrapolation."""

from pathlib import Path

import native_fmu
import numpy as np
import pytest

from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.system import Component, Connection, System, declared_derivatives

pytestmark = pytest.mark.skipif(native_fmu.COMPILER is None, reason=native_fmu.NO_COMPILER)

MILLISECOND = 1_000_000
SECOND = 1000 * MILLISECOND


@pytest.fixture(scope="module", params=[2, 3])
def path(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return native_fmu.build(tmp_path_factory.mktemp("fmus"), request.param, derivatives=2)


def test_derivatives_are_those_of_the_states(path: Path) -> None:
    instance = open_fmu("chain", path)
    assert declared_derivatives(instance, "y[2]") == ("der(y[2])", "der(der(y[2]))")
    outputs = ["y[2]", "der(y[3])", "y[3]", "der(der(y[2]))", "der(y[2])"]
    instance.set_parameters({})
    instance.bind(["u[2]"], outputs)
    instance.enter_initialization(0.0)
    instance.exit_initialization()
    found = np.full(5, np.nan)
    instance.get_outputs(found)
    assert found.tolist() == [0.0] * 5
    instance.set_inputs(np.array([1.5]))
    instance.step(0.0, 0.25)
    instance.get_outputs(found)
    # y' = 2 u - y and 3 u[3] - y, y'' = -y' for a constant input; y by one step of the backward Euler method.
    y = 0.25 * 2.0 * 1.5 / 1.25
    np.testing.assert_allclose(found, [y, 0.0, 0.0, y - 3.0, 3.0 - y], rtol=1e-14)
    assert instance.native_calls() is None
    instance.free()


def test_without_an_order_there_are_none(tmp_path: Path) -> None:
    instance = open_fmu("chain", native_fmu.build(tmp_path))
    assert declared_derivatives(instance, "y[2]") == ()


def test_filters_interpolate_by_them(path: Path) -> None:
    """From steps of 0.5 s to 0.1 s; the cubic polynomial has the slopes of the equation of the states at both ends."""

    def step(values: Values, time: float, size: float) -> None:
        values["y"] = values["u"]

    sink = PythonInstance("sink", step, inputs={"u": 0.0}, outputs={"y": 0.0})
    recorder = MemoryRecorder()
    run(
        System(
            components=(
                Component(instance=open_fmu("chain", path), step=500 * MILLISECOND, parameters={"u[1]": 1.0}),
                Component(instance=sink, step=100 * MILLISECOND),
            ),
            connections=(
                Connection(source="chain", source_variable="y[1]", target="sink", target_variable="u", filter="cubic"),
            ),
        ),
        4 * SECOND,
        observers=[recorder],
    )
    coarse, fine = recorder.signal("chain", "y[1]"), recorder.signal("sink", "y")
    assert recorder.names["chain"][-1] == "der(y[1])"
    k, s, size = 3, 0.4, 0.5
    slopes = 1.0 - coarse
    basis = (2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, -2 * s**3 + 3 * s**2, s**3 - s**2)
    expected = basis @ np.array([coarse[k], size * slopes[k], coarse[k + 1], size * slopes[k + 1]])
    assert fine[5 * k + 2] == pytest.approx(expected, rel=1e-12)
