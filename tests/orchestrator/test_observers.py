"""What observers are told."""

import numpy as np

from tlpsim.orchestrator.execution import RunSummary, run
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.observers import MemoryRecorder, Observer
from tlpsim.orchestrator.system import Component, System

SECOND = 1_000_000_000


def ramp(name: str) -> PythonInstance:
    def step(values: Values, time: float, size: float) -> None:
        values.update(x=time + size, y=2.0 * (time + size))

    return PythonInstance(name, step, outputs={"x": 0.0, "y": 0.0})


def system() -> System:
    return System(
        components=(
            Component(instance=ramp("a"), step=SECOND),
            Component(instance=ramp("b"), step=2 * SECOND, outputs=("y",)),
        )
    )


class Diary(Observer):
    def __init__(self) -> None:
        self.entries: list[tuple[object, ...]] = []

    def started(self, system: System) -> None:
        self.entries.append(("started", len(system.components)))

    def sampled(self, index: int, times: np.ndarray, values: np.ndarray) -> None:
        assert values.shape == (len(times), 2 - index)
        rows = zip(times.tolist(), values.tolist(), strict=True)
        self.entries += [(index, time // SECOND, *row) for time, row in rows]

    def stopped(self, reason: BaseException | None, summary: RunSummary) -> None:
        self.entries.append(("stopped", reason, summary.stop // SECOND))


def test_observers_get_every_sample_in_order() -> None:
    diary = Diary()
    run(system(), 2 * SECOND, observers=[Observer(), diary])
    assert diary.entries == [
        ("started", 2),
        (0, 0, 0.0, 0.0),
        (1, 0, 0.0),
        (0, 1, 1.0, 2.0),
        (0, 2, 2.0, 4.0),
        (1, 2, 4.0),
        ("stopped", None, 2),
    ]


def test_memory_recorder() -> None:
    recorder = MemoryRecorder()
    for _ in range(2):  # a second run starts afresh
        run(system(), 4 * SECOND, observers=[recorder])
    assert recorder.names == {"a": ("x", "y"), "b": ("y",)}
    assert recorder.ticks("b").tolist() == [0, 2 * SECOND, 4 * SECOND]
    assert recorder.times("a").tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert recorder.signal("a", "y").tolist() == [0.0, 2.0, 4.0, 6.0, 8.0]
    assert recorder.values("b").shape == (3, 1)
