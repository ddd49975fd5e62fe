"""Fits that a process knows: made once, carried to others, the oldest forgotten."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any

import pytest

from tlpsim.loads.errors import SolverError
from tlpsim.loads.filters import known_fits
from tlpsim.loads.filters.known_fits import MOST, fits_used, known_fit, learn


class Maker:
    """Makes a fit of its own at each call, and counts."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self) -> Any:
        self.calls += 1
        return object()


@pytest.fixture(autouse=True)
def nothing_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(known_fits, "_fits", OrderedDict())
    monkeypatch.setattr(known_fits, "_recorders", [])


@pytest.fixture
def make() -> Maker:
    return Maker()


def test_a_fit_is_made_once(make: Maker) -> None:
    first = known_fit(("a", 1), make)
    assert known_fit(("a", 1), make) is first
    assert make.calls == 1
    assert known_fit(("a", 2), make) is not first
    assert make.calls == 2


def test_what_fails_is_not_kept(make: Maker) -> None:
    def fail() -> Any:
        raise SolverError("no fit")

    with fits_used() as used, pytest.raises(SolverError, match="no fit"):
        known_fit("a", fail)
    assert used == {}
    known_fit("a", make)
    assert make.calls == 1


def test_fits_that_are_learnt_are_not_made(make: Maker) -> None:
    theirs: Any = object()
    learn({"a": theirs})
    assert known_fit("a", make) is theirs
    assert make.calls == 0


def test_the_last_that_was_learnt_counts(make: Maker) -> None:
    known_fit("a", make)
    theirs: Any = object()
    learn({"a": theirs})
    assert known_fit("a", make) is theirs


def test_those_that_were_used_last_are_kept(make: Maker) -> None:
    for number in range(MOST):
        known_fit(number, make)
    known_fit(0, make)  # so that 1 is the oldest
    known_fit("more", make)
    assert make.calls == MOST + 1
    kept: tuple[Hashable, ...] = (0, 2, MOST - 1, "more")
    for key in kept:
        known_fit(key, make)
    assert make.calls == MOST + 1
    known_fit(1, make)
    assert make.calls == MOST + 2
    assert len(known_fits._fits) == MOST


def test_more_than_there_is_room_for_may_be_learnt(make: Maker) -> None:
    many: dict[Hashable, Any] = {number: object() for number in range(MOST + 10)}
    learn(many)
    assert len(known_fits._fits) == MOST
    assert known_fit(MOST + 9, make) is many[MOST + 9]


def test_what_is_used_is_recorded_whether_known_or_not(make: Maker) -> None:
    before = known_fit("known", make)
    known_fit("not used", make)
    with fits_used() as used:
        made = known_fit("made", make)
        known_fit("known", make)
    known_fit("after", make)
    assert used == {"known": before, "made": made}


def test_recorders_stand_in_each_other(make: Maker) -> None:
    with fits_used() as outer:
        known_fit("a", make)
        with fits_used() as inner:
            known_fit("b", make)
        known_fit("c", make)
    assert set(outer) == {"a", "b", "c"}
    assert set(inner) == {"b"}
    assert known_fits._recorders == []


def test_two_recorders_that_hold_the_same_are_two(make: Maker) -> None:
    """They are told apart by identity: equal ones, both empty here, do not end each other."""
    with fits_used() as outer:
        with fits_used():
            pass
        known_fit("a", make)
    assert set(outer) == {"a"}


def test_a_recorder_ends_with_an_error(make: Maker) -> None:
    def use() -> None:
        with fits_used():
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        use()
    assert known_fits._recorders == []


def test_threads_get_one_fit_in_the_end(make: Maker) -> None:
    together = threading.Barrier(4)

    def slow() -> Any:
        together.wait(timeout=10)
        return make()

    def run(maker: Callable[[], Any]) -> None:
        known_fit("a", maker)

    threads = [threading.Thread(target=run, args=(slow,)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert make.calls == 4  # a fit has no effect but itself, and so nobody waits for it
    assert known_fit("a", make) is known_fit("a", make)
    assert make.calls == 4
