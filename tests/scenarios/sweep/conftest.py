"""Sweeps of TOML text, a scenario that takes no time, and finished jobs without any computation."""

import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sweep.job import Outcome
from tlpsim.scenarios.sweep.plan import Sweep


@pytest.fixture
def sweep_of(tmp_path: Path) -> Callable[..., Sweep]:
    """Maker of a sweep of the text of its file, which stands in the test's folder."""

    def make(text: str = "", overrides: Sequence[str] = ()) -> Sweep:
        return Sweep.from_dict(tomllib.loads(text), tmp_path / "sweep.toml", overrides)

    return make


@pytest.fixture
def refusal(sweep_of: Callable[..., Sweep]) -> Callable[..., str]:
    """Message with which the plan of a sweep's text is refused: one line, without words of a library."""

    def told(text: str, overrides: Sequence[str] = ()) -> str:
        with pytest.raises(ScenarioError) as refused:
            sweep_of(text, overrides).plan()
        message = str(refused.value)
        assert "\n" not in message
        for jargon in (
            "Input should",
            "Field required",
            "Value error",
            "Tuple",
            "NoneType",
            "validation",
            ".int",
            ".bool",
        ):
            assert jargon not in message
        return message

    return told


@pytest.fixture(scope="session")
def quick() -> Scenario:
    """300 s of waves alone on the platform without diffraction; a second in either domain."""
    settings = {
        "title": "Quick",
        "simulation": {"duration": 300.0},
        "platform": {"hydrodynamics": "morison"},
        "waves": {"drift": "none"},
        "wind": {"speed": 0.0},
        "current": {"speed": 0.0},
        "components": {"wind": {"fmu": ""}},
    }
    return Scenario.from_dict(settings)


@pytest.fixture(scope="session")
def outcome() -> Callable[..., Outcome]:
    """Maker of what became of a job: numbers by name, all of one unit, or its error."""

    def make(key: str, numbers: dict[str, float] | None = None, unit: str = "m", **others: str) -> Outcome:
        numbers = numbers or {}
        return Outcome(
            key=key,
            names=tuple(numbers),
            units=(unit,) * len(numbers),
            values=np.array(list(numbers.values()), dtype=np.float64),
            seconds=0.5,
            **others,
        )

    return make
