"""Ctrl-C and SIGTERM as exceptions, and signals that are ignored."""

import signal
import threading
from collections.abc import Iterator

import pytest

from tlpsim.scenarios.interruption import Terminated, interrupts_told

HANDLED = (signal.SIGINT, signal.SIGTERM)


@pytest.fixture
def handlers() -> Iterator[None]:
    """Handlers of the signals as they were before the test."""
    before = [signal.getsignal(number) for number in HANDLED]
    yield
    for number, handler in zip(HANDLED, before, strict=True):
        signal.signal(number, handler)


@pytest.mark.parametrize(("number", "kind"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)])
def test_a_function_is_told_of_a_signal(number: int, kind: type[BaseException], handlers: None) -> None:
    for each in HANDLED:
        signal.signal(each, signal.SIG_DFL)
    told: list[KeyboardInterrupt] = []
    with interrupts_told(told.append):
        signal.raise_signal(number)
    assert [type(reason) for reason in told] == [kind]
    assert signal.Signals(number).name in str(told[0]) or "Ctrl-C" in str(told[0])
    assert [signal.getsignal(each) for each in HANDLED] == [signal.SIG_DFL, signal.SIG_DFL]


@pytest.mark.parametrize("number", HANDLED)
def test_what_is_ignored_stays_ignored(number: int, handlers: None) -> None:
    signal.signal(number, signal.SIG_IGN)
    told: list[KeyboardInterrupt] = []
    with interrupts_told(told.append):
        assert signal.getsignal(number) is signal.SIG_IGN
        signal.raise_signal(number)
    assert told == []
    assert signal.getsignal(number) is signal.SIG_IGN


def test_blocks_may_stand_in_each_other(handlers: None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    outer: list[KeyboardInterrupt] = []
    inner: list[KeyboardInterrupt] = []
    with interrupts_told(outer.append):
        with interrupts_told(inner.append):
            signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)
    assert (len(outer), len(inner)) == (1, 1)


def test_another_thread_goes_without() -> None:
    """Python lets only the main thread have handlers."""
    failures: list[BaseException] = []

    def work() -> None:
        try:
            with interrupts_told(lambda reason: None):
                pass
        except BaseException as error:
            failures.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert failures == []
