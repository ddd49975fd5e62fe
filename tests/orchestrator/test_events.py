"""Events: from which step they count, what cannot change, and that a resumed run repeats them."""

from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.errors import WiringError
from tlpsim.orchestrator.checkpoint import Checkpoints, read
from tlpsim.orchestrator.events import Event
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.isolation import IsolatedInstance
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.system import Component, Connection, System, check

SECOND = 1_000_000_000
TENTH = SECOND // 10


def gate(name: str = "gate") -> PythonInstance:
    """y = k u + fed, with u open and k tunable."""

    def step(values: Values, time: float, size: float) -> None:
        values["y"] = values["k"] * values["u"] + values["fed"]
        values["total"] += values["y"] * size

    return PythonInstance(
        name,
        step,
        inputs={"u": 1.0, "fed": 0.0},
        outputs={"y": 1.0, "total": 0.0},
        parameters={"k": 1.0, "fixed": 1.0, "word": "a"},
        tunable=("k", "word"),
    )


def clock() -> PythonInstance:
    def step(values: Values, time: float, size: float) -> None:
        values["t"] = time + size

    return PythonInstance("clock", step, outputs={"t": 0.0})


def of(*events: Event, step: int = TENTH, instance: PythonInstance | IsolatedInstance | None = None) -> System:
    return System(components=(Component(instance=instance or gate(), step=step),), events=events)


def event(time: float, component: str = "gate", **values: float | str) -> Event:
    return Event(time=round(time * SECOND), component=component, values=values)


def recorded(system: System, stop: int = 2 * SECOND) -> MemoryRecorder:
    recorder = MemoryRecorder()
    run(system, stop, observers=[recorder])
    return recorder


def test_inputs_and_tunable_parameters_count_from_the_step_that_begins_at_their_time() -> None:
    found = recorded(of(event(0.5, u=3.0), event(1.0, k=2.0), event(1.5, u=0.0, k=1.0)))
    expected = np.repeat([1.0, 3.0, 6.0, 0.0], 5)
    assert np.array_equal(found.signal("gate", "y")[1:], expected)
    assert found.signal("gate", "total")[-1] == pytest.approx(0.5 * (1.0 + 3.0 + 6.0), rel=1e-12)


def test_an_event_at_the_start_counts_for_the_first_step_and_one_after_the_end_for_none() -> None:
    found = recorded(of(event(0.0, u=5.0), event(7.0, u=9.0)))
    assert set(found.signal("gate", "y")[1:]) == {5.0}


def test_of_one_time_the_last_in_order_holds() -> None:
    assert recorded(of(event(1.0, u=5.0), event(1.0, u=7.0))).signal("gate", "y")[-1] == 7.0


def test_between_the_steps_of_a_component_it_counts_from_the_next_and_a_note_says_so() -> None:
    recorder = MemoryRecorder()
    summary = run(of(event(0.5, u=3.0), step=SECOND), 3 * SECOND, observers=[recorder])
    assert list(recorder.signal("gate", "y")) == [1.0, 1.0, 3.0, 3.0]
    assert any("event at t = 0.5 s: gate has it from t = 1 s on" in note for note in summary.notes)


def test_a_component_that_is_stepped_ahead_has_it_later_and_a_note_says_so() -> None:
    """A filter that looks ahead asks for samples after the event before it happens."""
    source = gate("source")
    system = System(
        components=(Component(instance=source, step=TENTH), Component(instance=gate(), step=TENTH // 2)),
        connections=(
            Connection(source="source", source_variable="y", target="gate", target_variable="fed", filter="kaiser"),
        ),
        events=(event(1.0, "source", u=3.0),),
    )
    summary = run(system, 2 * SECOND)
    assert any("source has it from t = " in note for note in summary.notes)


def test_pauses_for_events_change_nothing_else() -> None:
    def pair(*events: Event) -> System:
        link = Connection(source="clock", source_variable="t", target="gate", target_variable="fed")
        parts = Component(instance=clock(), step=3 * TENTH), Component(instance=gate(), step=TENTH)
        return System(components=parts, connections=(link,), events=events)

    plain, paused = recorded(pair()), recorded(pair(event(0.35, k=1.0), event(1.0, u=1.0)))
    assert np.array_equal(plain.values("gate"), paused.values("gate"))


def test_a_component_in_a_process_of_its_own_changes_too() -> None:
    found = recorded(of(event(1.0, u=3.0, k=2.0), instance=IsolatedInstance("gate", gate)))
    assert np.array_equal(found.signal("gate", "y")[1:], np.repeat([1.0, 6.0], 10))


def test_an_input_that_events_set_is_not_reported_as_open() -> None:
    assert not any("gate.u" in note for note in check(of(event(1.0, u=3.0))))
    assert any("gate.u" in note for note in check(of()))


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        (event(1.0, "gat", u=1.0), "no component 'gat'; nearest match: 'gate'"),
        (event(1.0, uu=1.0), "component 'gate' has no variable 'uu'"),
        (event(1.0, fixed=2.0), "'gate.fixed' is parameter, fixed, and cannot change in a run"),
        (event(1.0, y=2.0), "'gate.y' is output, continuous, and cannot change"),
        (event(1.0, fed=2.0), "'gate.fed' is fed by clock.t -> gate.fed; take that connection out"),
        (event(1.0, word=2.0), "'word' = 2.0 is not of the type String"),
        (event(1.0, u=float("nan")), "is not a finite number"),
        (event(-1.0, u=1.0), "the time is negative"),
    ],
)
def test_what_cannot_change_is_told_before_the_run(changed: Event, text: str) -> None:
    link = Connection(source="clock", source_variable="t", target="gate", target_variable="fed")
    parts = Component(instance=clock(), step=TENTH), Component(instance=gate(), step=TENTH)
    with pytest.raises(WiringError, match="event at t = ") as caught:
        check(System(components=parts, connections=(link,), events=(changed,)))
    assert text in str(caught.value)


def test_a_resumed_run_has_the_events_before_and_after_its_checkpoint(tmp_path: Path) -> None:
    events = event(0.5, u=3.0), event(1.0, k=2.0), event(1.7, u=4.0)
    whole = recorded(of(*events))
    path = tmp_path / "r.checkpoint"
    run(of(*events), 13 * TENTH, checkpoints=Kept(path))
    found = MemoryRecorder()
    resumed = Checkpoints(path, TENTH, resumed=read(path))
    run(of(*events), 2 * SECOND, observers=[found], checkpoints=resumed)
    assert np.array_equal(found.values("gate"), whole.values("gate"))


class Kept(Checkpoints):
    """Checkpoints that stay when the run comes to its end."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, TENTH)

    def stopped(self, reason: BaseException | None) -> None:
        super().stopped(reason or InterruptedError())
