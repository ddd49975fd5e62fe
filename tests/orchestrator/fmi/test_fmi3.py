"""What only FMI 3.0 has: many numeric types and arrays."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.errors import StepError
from tlpsim.orchestrator.fmi.fmi3 import Fmi3Instance

WHOLE = {f"{sign}int{bits}": np.dtype(f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)}
TYPES = ("float32", *WHOLE, "boolean")


@pytest.fixture
def instance(chain_fmu: Callable[[int], Path]) -> Iterator[Fmi3Instance]:
    """An instance of which one variable of every type is bound, and no element of its arrays."""
    made = Fmi3Instance("hull", chain_fmu(3))
    made.set_parameters({})
    made.bind([f"{name}_in" for name in TYPES], TYPES)
    made.enter_initialization(0.0)
    made.exit_initialization()
    yield made
    made.free()


def passed(instance: Fmi3Instance, values: list[float]) -> list[float]:
    into = np.empty(len(values))
    instance.set_inputs(np.array(values))
    instance.step(0.0, 0.1)
    instance.get_outputs(into)
    return into.tolist()


def test_types(instance: Fmi3Instance) -> None:
    types = [instance.variables[name].type for name in TYPES]
    assert types == ["Real", *["Integer"] * 8, "Boolean"]
    assert passed(instance, [0.1, *[99.6] * 8, 0.7]) == [float(np.float32(0.1)), *[100.0] * 8, 1.0]
    assert passed(instance, [-0.5, *[-0.4] * 8, -3.0]) == [-0.5, *[0.0] * 8, 0.0]


@pytest.mark.parametrize("name", WHOLE)
def test_ranges(instance: Fmi3Instance, name: str) -> None:
    limits = np.iinfo(WHOLE[name])
    place = TYPES.index(name)
    values = np.zeros(len(TYPES))
    beyond = 2.0 ** (limits.bits - (limits.min < 0))
    largest = min(float(limits.max), np.nextafter(beyond, 0.0))
    for edge in (float(limits.min), largest):
        values[place] = edge
        assert passed(instance, values.tolist())[place] == edge
    for outside in (limits.min - 1.0 if limits.bits < 64 else -1e20, beyond, np.inf, np.nan):
        values[place] = outside
        with pytest.raises(
            StepError, match=f"hull: input '{name}_in' = .* is not within {limits.min} … {limits.max}, "
        ):
            instance.set_inputs(values)


def test_arrays(chain_fmu: Callable[[int], Path]) -> None:
    """The size of y is a structural parameter's start value; parameters set elements of an array one by one."""
    instance = Fmi3Instance("hull", chain_fmu(3))
    assert dict(instance.arrays) == {"u": (6,), "y": (12,)}
    assert instance.variables["y[12]"].depends_on == tuple(f"u[{k + 1}]" for k in range(6))
    assert instance.variables["int8"].depends_on == ("int8_in",)
    instance.set_parameters({"u[2]": 2.0})
    instance.set_parameters({"u[5]": 5.0})
    instance.bind([], [f"y[{k + 1}]" for k in range(12)])
    instance.enter_initialization(0.0)
    instance.exit_initialization()
    instance.step(0.0, 0.1)
    into = np.empty(12)
    instance.get_outputs(into)
    inputs = np.tile([0.0, 2.0, 0.0, 0.0, 5.0, 0.0], 2)
    np.testing.assert_allclose(into, 0.1 * np.arange(1, 13) * inputs / 1.1, rtol=1e-13)
    instance.terminate()
    instance.free()
